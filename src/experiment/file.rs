//! The experiment file: what each table of `EXPERIMENT.toml` may hold, with units and defaults.
//!
//! Paths are relative to the experiment file. Every structure refuses keys that it does not know.
//!
//! ```toml
//! title = "Path tracing and bidirectional path tracing at equal time"
//! budget = { seconds = 10 }      # or { spp = 64 }, or { relmse = 0.01, spp = 9999 }: what each run may use
//! runs = 4                       # independent runs, each with a seed of its own
//! metrics = ["relmse", "mse"]
//!
//! [reference]                    # or: file = "truth.exr"
//! preset = "bpt"
//! spp = 2000
//!
//! [[scene]]
//! file = "../scenes/room/scene.toml"
//! exposure = 1.0
//!
//! [[estimator]]
//! preset = "pt"
//!
//! [[estimator]]
//! name = "no-lens"
//! techniques = ["hit", "nee", "connect"]
//! heuristic = "power"
//! ```

use crate::scene::file::values::{Count, Number, Positive};
use crate::transport::merge::MergeDef;
use crate::transport::settings::{Connections, Layers, LightStarts, Tracking};
use serde::Deserialize;
use toml::Spanned;

/// A whole experiment file.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct ExperimentFile {
    /// For people; default: the file's name.
    pub title: Option<String>,
    /// What it is about, for the page. Paragraphs are separated by blank lines.
    #[serde(default)]
    pub description: String,
    /// What each run may use, unless the estimator says otherwise.
    pub budget: Option<Spanned<BudgetDef>>,
    /// Independent runs of each estimator in each scene; default 1. Intervals need at least 2.
    pub runs: Option<Count<1>>,
    /// All seeds are hashed from this number; default 0.
    pub seed: Option<Count<0>>,
    /// Keys of the metrics, the main one first; default `["relmse", "mse", "mae", "smape", "flip"]`.
    pub metrics: Option<Vec<Spanned<String>>>,
    /// Which technique images are kept: `none`, `families` or `all`; default: as much as the figures want.
    pub layers: Option<Spanned<Layers>>,
    /// Shortest paths, in segments, unless the scene's or the estimator's entry says otherwise; default: the scene file's.
    pub min_length: Option<Spanned<Count<1>>>,
    /// Longest paths, likewise.
    pub max_length: Option<Spanned<Count<1>>>,
    /// Which paths count, unless the scene's or the estimator's entry says otherwise: `all`, `media`, `surfaces` or a light path
    /// expression such as `ES*M(S|D|M)*L`; default `all`.
    pub paths: Option<Spanned<String>>,
    /// Width and height of the images in pixels, unless the scene's entry says otherwise; default: the scene file's.
    pub size: Option<[Count<1>; 2]>,
    /// Exposure at which images are shown, in stops, unless the scene's entry says otherwise; default 0.
    pub exposure: Option<Number>,
    /// What all is measured against: `[reference]`. Without one only variances are measured.
    pub reference: Option<Spanned<ReferenceDef>>,
    /// Which figures the page has: `[figures]`.
    #[serde(default)]
    pub figures: FiguresDef,
    /// Scenes, in order: `[[scene]]`.
    #[serde(default)]
    pub scene: Vec<Spanned<SceneDef>>,
    /// Estimators, in order: `[[estimator]]`.
    #[serde(default)]
    pub estimator: Vec<Spanned<EstimatorDef>>,
}

/// `budget = { spp = N }` or `budget = { seconds = T }`, exactly one; or `budget = { relmse = X, spp = N, seconds = T }`, where
/// at least one of `spp` and `seconds` is the bound that an estimator stops at which does not come to that relMSE.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct BudgetDef {
    /// Samples per pixel.
    pub spp: Option<Count<1>>,
    /// Seconds of rendering, pilots included.
    pub seconds: Option<Positive>,
    /// Until the relMSE against the reference, less the reference's own noise, is no more than this.
    pub relmse: Option<Positive>,
}

/// Names of heuristics.
#[derive(Deserialize, Clone, Copy, Debug, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum HeuristicDef {
    /// Weights proportional to densities.
    Balance,
    /// Weights proportional to powers of densities.
    Power,
}

/// `[[scene]]`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct SceneDef {
    /// The scene file, or its folder.
    pub file: Spanned<String>,
    /// Names it in results; default: the name of its folder (of the file, if it is not called `scene.toml`).
    pub name: Option<Spanned<String>>,
    /// For people; default: its name.
    pub label: Option<String>,
    /// For the page.
    #[serde(default)]
    pub caption: String,
    /// Width and height in pixels.
    pub size: Option<[Count<1>; 2]>,
    /// Stops.
    pub exposure: Option<Number>,
    /// Parts of the image to show enlarged.
    #[serde(default)]
    pub crops: Vec<Spanned<CropDef>>,
    /// Shortest paths, in segments.
    pub min_length: Option<Spanned<Count<1>>>,
    /// Longest paths, in segments.
    pub max_length: Option<Spanned<Count<1>>>,
    /// Which paths count, instead of the experiment's: a scene may be there twice, in full and for media alone.
    pub paths: Option<Spanned<String>>,
    /// Instead of the experiment's `[reference]`.
    pub reference: Option<Spanned<ReferenceDef>>,
}

/// A part of an image, in pixels.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct CropDef {
    /// For people.
    #[serde(default)]
    pub name: String,
    /// Leftmost column.
    pub x: Count<0>,
    /// Uppermost row.
    pub y: Count<0>,
    /// In pixels.
    pub width: Count<1>,
    /// In pixels.
    pub height: Count<1>,
}

/// `[[estimator]]`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct EstimatorDef {
    /// Names it in results: letters, digits, `-`, `_`, `.` and `+`; default: the preset's, or its techniques'.
    pub name: Option<Spanned<String>>,
    /// For people; default: what the preset is called, or the name.
    pub label: Option<String>,
    /// For the page.
    #[serde(default)]
    pub caption: String,
    /// Key of a preset: see `tyndall techniques`. Exactly one of this and `techniques`.
    pub preset: Option<Spanned<String>>,
    /// Keys of techniques.
    pub techniques: Option<Spanned<Vec<String>>>,
    /// `balance` or `power`; default `balance`.
    pub heuristic: Option<HeuristicDef>,
    /// `thinned` or `all`: whether only a share of the connections is made in media that scatter light many times; default
    /// `thinned`.
    pub connections: Option<Connections>,
    /// `power` or `pilot`: whether light subpaths start on lights by the lights' powers, or by what a pilot sees them bring to the image;
    /// default `power`.
    pub light_starts: Option<LightStarts>,
    /// `auto`, `exact` or `delta`: how flights and shadow rays go through media on grids whose extinction is grey; `delta`, which is delta
    /// and ratio tracking, takes no other techniques than `hit` and `nee`, and `auto`, the default, is `delta` for these.
    pub tracking: Option<Spanned<Tracking>>,
    /// How merges are made.
    pub merge: Option<Spanned<MergeDef>>,
    /// The power heuristic's exponent; default 2.
    pub exponent: Option<Spanned<Positive>>,
    /// Shortest paths, in segments.
    pub min_length: Option<Spanned<Count<1>>>,
    /// Longest paths, in segments.
    pub max_length: Option<Spanned<Count<1>>>,
    /// Which paths count, instead of the scene's and the experiment's.
    pub paths: Option<Spanned<String>>,
    /// Instead of the experiment's.
    pub layers: Option<Spanned<Layers>>,
    /// Instead of the experiment's.
    pub budget: Option<Spanned<BudgetDef>>,
    /// In figures, `#rrggbb`; default: one of a palette.
    pub color: Option<Spanned<String>>,
}

/// `[reference]`: an EXR, or an estimator and a budget.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct ReferenceDef {
    /// An EXR with R, G and B. Its layer `variance`, if there is one, is taken for the variance of its pixels.
    pub file: Option<Spanned<String>>,
    /// Key of a preset.
    pub preset: Option<Spanned<String>>,
    /// Keys of techniques.
    pub techniques: Option<Spanned<Vec<String>>>,
    /// As an estimator's.
    pub tracking: Option<Spanned<Tracking>>,
    /// How merges are made. Estimators that merge with the same radii would be measured against their own bias: a reference
    /// that merges wants smaller ones, and one whose radii are left open is warned of.
    pub merge: Option<Spanned<MergeDef>>,
    /// Which paths count; default: the scene's. Estimators with other paths are warned about.
    pub paths: Option<Spanned<String>>,
    /// Samples per pixel.
    pub spp: Option<Count<1>>,
    /// Seconds of rendering.
    pub seconds: Option<Positive>,
}

/// `[figures]`.
#[derive(Deserialize, Debug, Default)]
#[serde(deny_unknown_fields)]
pub struct FiguresDef {
    /// All estimators' images in a row and nothing more; default false.
    pub strip: Option<bool>,
    /// Images beside the reference, crops, error maps; default true.
    pub comparison: Option<bool>,
    /// The name of an estimator whose weighted and unweighted contributions and mean weights come first, in large;
    /// default: none. Its layers are kept.
    pub contributions: Option<Spanned<String>>,
    /// What each technique contributes; default: whether layers are kept, beside those of `contributions`.
    pub techniques: Option<Spanned<bool>>,
    /// Weighted (s, t) images of paths of `[min, max]` segments; default: none.
    pub pyramid: Option<Spanned<[Count<1>; 2]>>,
    /// Error against samples and time, of the metrics that are sums over pixels: FLIP's filters would take seconds at each point;
    /// default: whether there is a reference.
    pub convergence: Option<bool>,
    /// What share of the time each technique costs, measured by leaving each out in turn, which takes some renders more;
    /// default false.
    pub costs: Option<bool>,
    /// Width of the figures that are files (SVG, PDF, PNG), in centimetres, as for a column of a paper: they are laid out at that width, with
    /// rows wrapped before images are narrower than 1.8 cm; default: as large as their contents.
    pub width_cm: Option<Positive>,
    /// With `width_cm`, the size of all letters of these figures in print, in points; default 7.
    pub font_pt: Option<Positive>,
}
