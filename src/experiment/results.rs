//! What an experiment leaves behind: the schema of `results/<experiment>/results.json`.
//!
//! The file is a [`Results`], written by serde: every field below is a key of the same name. All paths are
//! relative to the folder that holds `results.json`, with `/` between the parts; all times are seconds of rendering
//! by the wall clock (reading scenes, computing metrics and writing files do not count); all images are linear
//! Rec. 709. A number that does not exist (a confidence interval of a single run, say) is `null`, and so is one that is not
//! finite, as JSON has none: where a number has to be, `null` is read back as NaN.
//!
//! A value under the key of a metric is what the page shows, here and in the tables: of a metric to which the reference's own noise
//! adds up (MSE, relMSE), and where that is known, the value without it. It may come out negative where that noise is most of it. What
//! was measured before that was taken off is `measured` here, and the metric `relmse_measured` or `mse_measured` in the tables.
//!
//! ```text
//! results/<experiment>/
//!     results.json            this file
//!     results.csv             a row a number: see `csv`
//!     convergence.csv         likewise a row a checkpoint
//!     <scene>/<estimator>/convergence.json    the mean over the runs, for figure-gen: see `csv`
//!     experiment.toml         the experiment file, with the changes of `--set`
//!     index.html, figures/    the page, and its figures as SVG, PDF and PNG files, with a list of what was made: see [`crate::report`]
//!     <scene>/reference.exr   default layer: the image; layer `variance`: variance of its mean, where known
//!     <scene>/reference.png
//!     <scene>/<estimator>/settings.toml  the resolved settings of each run
//!     <scene>/<estimator>/run-00.exr …   default layer, `variance` from 2 samples per pixel on, `outliers`
//!     <scene>/<estimator>/run-00.png     the first run: what the budget buys
//!     <scene>/<estimator>/mean.exr       the mean over the runs, with the technique layers that were asked for
//!     <scene>/<estimator>/mean.png
//!     <scene>/<estimator>/error.exr      a layer a metric: its map, the mean over the runs
//!     <scene>/<estimator>/error-<metric>.png
//!     <scene>/<estimator>/statistics.exr  layers `variance`, `bias`, `variance.<technique>`
//!     cells/                  runs as far as they have come: see [`super::store`]
//! ```

use super::hash::Hasher;
use super::numbers::{named, number, three};
use super::older;
use super::split::efficiency;
use crate::error::{Error, Result, from_root};
use crate::film::output::write_bytes;
pub use crate::render::Budget;
use crate::render::files::all_paths;
use crate::scene::file::source::Source;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The version of the schema that this program writes. It grows when a reader of the old one would be misled;
/// new keys alone do not change it.
pub const SCHEMA: u32 = 2;

/// Keys of the metrics that fall as 1/samples, so that 1/(metric · seconds) does not go with the time that was given.
pub const EFFICIENT: [&str; 2] = ["relmse", "mse"];

/// The file's name within the folder of results.
pub const FILE_NAME: &str = "results.json";

/// Everything known about an experiment that ran, or is running.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// See [`SCHEMA`].
    pub schema: u32,
    /// The experiment's name: its file's, without `.toml`.
    pub experiment: String,
    /// The experiment file; none in results from before this was kept.
    #[serde(default)]
    pub source: Option<Origin>,
    /// For people; the name where the file has none.
    pub title: String,
    /// What it is about; may be empty. Plain text, paragraphs separated by blank lines.
    pub description: String,
    /// Name and version of the program, such as `tyndall 0.1.0`.
    pub program: String,
    /// A hash of the code that rendered: [`crate::render::files::RENDERING`]; empty in files from before there was one.
    #[serde(default)]
    pub rendering: String,
    /// Where it ran.
    pub machine: Machine,
    /// When the command started that wrote these results, UTC, RFC 3339 to the second. It may have measured anew what was rendered
    /// long before: see [`Run::rendered`].
    pub started: String,
    /// When it wrote the last of them, likewise.
    pub finished: String,
    /// Whether something that was asked for is missing: it was interrupted, or is still running.
    pub partial: bool,
    /// Independent runs that were asked for, each scene and estimator.
    pub runs: u32,
    /// The metrics, in the order in which they are to be shown; the first is the main one.
    pub metrics: Vec<MetricInfo>,
    /// The scenes, in order.
    pub scenes: Vec<SceneResult>,
    /// The estimators, in order.
    pub estimators: Vec<EstimatorInfo>,
    /// What was measured: a cell a (scene, estimator), scene by scene. A partial result lacks some.
    pub cells: Vec<Cell>,
    /// Which figures are wanted.
    pub figures: Figures,
    /// What the reader of the results should know.
    pub warnings: Vec<String>,
}

/// The file that an experiment was read from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// Its absolute path.
    pub file: PathBuf,
    /// A hash of its text, without the changes of `--set`.
    pub contents: String,
}

impl Origin {
    /// Of a text that was read.
    pub fn of(source: &Source) -> Self {
        let file = from_root(source.path());
        Self { file, contents: Hasher::default().field(source.text().as_bytes()).hex() }
    }

    /// Whether the file is still there and has another text now.
    pub fn has_changed(&self) -> bool {
        Source::read(&self.file).is_ok_and(|now| Self::of(&now).contents != self.contents)
    }
}

/// A computer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// The processor as it calls itself; `unknown` where it does not tell.
    pub cpu: String,
    /// Processors that the system offered.
    pub cores: usize,
    /// Threads that rendered.
    pub threads: usize,
}

/// A metric: the key under which values are stored, and how to show it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MetricInfo {
    /// Such as `relmse`.
    pub key: String,
    /// Such as `relMSE`.
    pub label: String,
    /// One line on what it is.
    pub description: String,
    /// The value to which the top of the error maps' scale is set, each scene: the 99th percentile over the maps of
    /// all its estimators. By the scene's key; a scene without maps is missing.
    #[serde(deserialize_with = "named")]
    pub map_scale: BTreeMap<String, f64>,
}

/// A scene of the experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneResult {
    /// Names it in [`Cell::scene`] and in paths.
    pub key: String,
    /// For people.
    pub label: String,
    /// For the page; may be empty.
    pub caption: String,
    /// The scene file as the experiment named it.
    pub file: String,
    /// Width of the images in pixels.
    pub width: usize,
    /// Height of the images in pixels.
    pub height: usize,
    /// Exposure at which its images are to be shown, in stops.
    pub exposure: f32,
    /// Parts of the images that are to be shown enlarged.
    pub crops: Vec<Crop>,
    /// What the estimators are measured against; none where the experiment has none.
    pub reference: Option<Reference>,
    /// What loading the scene warned about.
    pub warnings: Vec<String>,
}

/// A rectangle of an image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crop {
    /// For people; may be empty.
    pub name: String,
    /// Leftmost column.
    pub x: usize,
    /// Uppermost row.
    pub y: usize,
    /// In pixels.
    pub width: usize,
    /// In pixels.
    pub height: usize,
}

/// An image taken for the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Where it comes from.
    pub kind: ReferenceKind,
    /// The EXR in the folder of results.
    pub exr: String,
    /// The same as a PNG at the scene's exposure.
    pub png: String,
    /// Samples per pixel, where known.
    pub spp: Option<u64>,
    /// How long it took to render (now or, from the cache, earlier), where known.
    pub seconds: Option<f64>,
    /// The mean over pixels and channels of the variance of the image, from its own estimate; where known. The MSE of
    /// an estimator without any error would come out as this.
    pub variance: Option<f64>,
    /// Whether it is still short of the samples that were asked for.
    pub partial: bool,
    /// Which paths it has: `all`, or a light path expression; none where that is not known.
    #[serde(default)]
    pub paths: Option<String>,
}

/// Where a reference comes from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ReferenceKind {
    /// A file that the experiment names.
    File(String),
    /// Rendered with this technique set.
    Estimator(String),
}

/// An estimator of the experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimatorInfo {
    /// Names it in [`Cell::estimator`] and in paths.
    pub key: String,
    /// For people.
    pub label: String,
    /// For the page; may be empty.
    pub caption: String,
    /// sRGB, `#rrggbb`; different for each estimator of the experiment.
    pub color: String,
    /// What it was asked for, as far as it is the same in every scene.
    pub settings: EstimatorSettings,
}

/// What an estimator does, resolved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimatorSettings {
    /// Keys of its techniques, in the order of the table of techniques.
    pub techniques: Vec<String>,
    /// `balance`, or `power 2`.
    pub heuristic: String,
    /// Shortest paths, in segments; none: the scene's.
    pub min_length: Option<u32>,
    /// Longest paths, in segments; none: the scene's.
    pub max_length: Option<u32>,
    /// Which paths count where the scene does not say it: `all`, or the light path expression as it was given.
    #[serde(default = "all_paths")]
    pub paths: String,
    /// `none`, `families` or `all`.
    pub layers: String,
    /// With layers `all`: (s, t) layers for paths of up to so many segments.
    pub pyramid: u32,
    /// What each run may use.
    pub budget: Budget,
}

/// One estimator in one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// The scene's key.
    pub scene: String,
    /// The estimator's key.
    pub estimator: String,
    /// Shortest paths that counted, in segments.
    pub min_length: u32,
    /// Longest paths that counted, in segments.
    pub max_length: u32,
    /// Which paths counted: `all`, or the light path expression as it was given.
    #[serde(default = "all_paths")]
    pub paths: String,
    /// The runs that are there, in order.
    pub runs: Vec<Run>,
    /// Each metric over the runs, in the order of [`Results::metrics`]. Empty without a reference, but for
    /// metrics that need none.
    pub summary: Vec<Summary>,
    /// Mean squared difference between a run and the mean of all, per pixel and channel, with the factor R/(R−1): the
    /// variance of one run, whatever the reference. None for a single run.
    pub variance: Option<Estimate>,
    /// The squared bias, mean over pixels and channels, from products of different runs: variance and bias² add up to the MSE less the
    /// reference's noise (see [`super::split`]). It may come out negative where there is none. None for a single run or without a
    /// reference.
    #[serde(default)]
    pub bias: Option<Estimate>,
    /// 1/(MSE · seconds), where the reference's noise is taken off the MSE. None without a reference, or where nothing is left
    /// of the MSE then.
    pub efficiency: Option<Estimate>,
    /// 1/(variance · seconds): the same without a reference. None for a single run.
    pub variance_efficiency: Option<Estimate>,
    /// Seconds a run: the mean over the runs.
    pub seconds: Estimate,
    /// Samples per pixel a run: the mean over the runs.
    pub spp: Estimate,
    /// Error against samples and time: a curve a metric.
    pub convergence: Vec<Curve>,
    /// What each technique adds, causes and costs, in the order of the table of techniques.
    #[serde(default)]
    pub techniques: Vec<TechniqueShare>,
    /// Where the images are.
    pub files: Files,
    /// What the reader of these numbers should know.
    pub warnings: Vec<String>,
}

/// What a technique is to an estimator in a scene; shares of the whole, with intervals over the runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TechniqueShare {
    /// The technique's key.
    pub technique: String,
    /// Share of the image's energy (its mean luminance) that is in the technique's weighted image.
    pub energy: Estimate,
    /// Variance of the technique's weighted image over that of the whole image. None for a single run.
    pub variance: Option<Estimate>,
    /// Share of the whole image's variance that the technique causes: cov(technique, whole) / var(whole); these sum up to 1. None for
    /// a single run.
    pub caused: Option<Estimate>,
    /// Share of the time of an iteration that leaving out this technique saves, see [`super::costs`]; none where that was not
    /// asked for.
    pub time: Option<Estimate>,
}

/// One run: one seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Number of the run, from 0.
    pub index: u32,
    /// Names all its random numbers.
    pub seed: u64,
    /// Samples per pixel that were made.
    pub spp: u64,
    /// Rendering, by the wall clock, with the pilots before it.
    pub seconds: f64,
    /// Of these, the pilots that choose radii, counts of light paths and shares of connections.
    #[serde(default)]
    pub setup: f64,
    /// Seconds that its threads waited for a processor, all together, as something else ran beside it; 0 where that is not known.
    #[serde(default)]
    pub waited: f64,
    /// When the last of its samples was rendered, UTC, RFC 3339 to the second; none where that is not known.
    #[serde(default)]
    pub rendered: Option<String>,
    /// Camera subpaths that were walked.
    pub camera_paths: u64,
    /// Light subpaths that were walked.
    pub light_paths: u64,
    /// How merges gathered in the first iteration and connections were thinned out, in words, by the technique's key.
    #[serde(default)]
    pub merges: BTreeMap<String, String>,
    /// Contributions that were not finite and were dropped, by the technique's key; those without any are missing.
    pub dropped: BTreeMap<String, u64>,
    /// Whether it was stopped before its budget.
    pub partial: bool,
    /// The mean of the image over its pixels, by channel.
    #[serde(deserialize_with = "three")]
    pub mean: [f64; 3],
    /// Value of each metric, by its key: as the page shows it, without the reference's noise where that is known.
    #[serde(deserialize_with = "named")]
    pub metrics: BTreeMap<String, f64>,
    /// Of metrics from which such noise was taken off, the value with it: as measured against the reference.
    #[serde(default, deserialize_with = "named")]
    pub measured: BTreeMap<String, f64>,
    /// relMSE against the reference, less what the reference's own noise adds to it; none without a reference. It may come out
    /// negative where that dominates.
    #[serde(default)]
    pub relmse: Option<f64>,
    /// The MSE likewise.
    #[serde(default)]
    pub mse: Option<f64>,
    /// The same on the way: after 1, 2, 4, 8 … iterations, and at the end. Only metrics that are quick to compute:
    /// not FLIP.
    pub checkpoints: Vec<Checkpoint>,
    /// Its EXR.
    pub exr: String,
}

/// A run on its way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Samples per pixel so far.
    pub spp: u64,
    /// Seconds of rendering so far.
    pub seconds: f64,
    /// Value of each metric, by its key, without the reference's noise where that is known.
    #[serde(deserialize_with = "named")]
    pub metrics: BTreeMap<String, f64>,
}

/// A number over the runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The mean.
    #[serde(deserialize_with = "number")]
    pub mean: f64,
    /// The 95% confidence interval of the mean; none for a single run.
    pub interval: Option<Interval>,
}

/// A confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Its lower end.
    #[serde(deserialize_with = "number")]
    pub low: f64,
    /// Its upper end.
    #[serde(deserialize_with = "number")]
    pub high: f64,
}

/// A metric over the runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// The metric's key.
    pub metric: String,
    /// Its mean and interval, as the page shows them: without the reference's own noise where that is known, and then the interval
    /// holds what is not known of the noise too.
    pub value: Estimate,
    /// What the reference's own noise adds to it; none where that is not known, or the metric is not one to which it adds up.
    #[serde(default)]
    pub noise: Option<f64>,
    /// Where there is such noise, mean and interval with it: as measured against the reference.
    #[serde(default)]
    pub measured: Option<Estimate>,
}

/// How a metric falls as a run goes on, without the reference's noise where that is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// The metric's key.
    pub metric: String,
    /// By increasing samples: the points that every run has.
    pub points: Vec<CurvePoint>,
    /// Slope of log(metric) over log(samples), the mean over the runs; none with fewer than 3 points.
    pub slope_spp: Option<Estimate>,
    /// Slope of log(metric) over log(seconds after the set-up); none with fewer than 3 points.
    pub slope_seconds: Option<Estimate>,
}

/// A point of a [`Curve`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Samples per pixel; of the last point the mean over the runs, rounded, where they end apart.
    pub spp: u64,
    /// Seconds of rendering, the mean over the runs.
    pub seconds: f64,
    /// The metric over the runs.
    pub value: Estimate,
}

/// The images of a [`Cell`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Files {
    /// The first run as a PNG at the scene's exposure: what the budget buys.
    pub png: String,
    /// The first run as an EXR, without technique layers.
    pub exr: String,
    /// The mean over the runs as an EXR, with the technique layers that were asked for.
    pub mean_exr: String,
    /// The same as a PNG.
    pub mean_png: String,
    /// An EXR with a layer a metric: its map, R = G = B, the mean over the runs. None without a reference.
    pub error_exr: Option<String>,
    /// PNGs of these maps in false colour from 0 to [`MetricInfo::map_scale`], by the metric's key.
    pub error_png: BTreeMap<String, String>,
    /// An EXR of layers `variance` (of the pixels of one run, from its iterations), `bias` (mean over the runs less the
    /// reference) and `variance.<technique>` (of the technique's weighted image in one run). None where there is none of them.
    #[serde(default)]
    pub statistics_exr: Option<String>,
    /// Names of the technique layers of `mean_exr`: `weighted.nee`, `weight.nee`, `unweighted.s02t03` and so on (see
    /// [`crate::film::ImageKind`]). Mean weights are those over the samples of all runs.
    pub layers: Vec<String>,
}

/// Which figures the experiment asks for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Images of all estimators in a row, in order, without more; for series of one estimator at several budgets.
    pub strip: bool,
    /// Images beside the reference, with crops and error maps.
    pub comparison: bool,
    /// Key of the estimator whose contributions come first, in large.
    #[serde(default)]
    pub contributions: Option<String>,
    /// Contributions of each technique, weighted and unweighted, and its mean weight; wants layers.
    pub techniques: bool,
    /// Weighted (s, t) images for paths of `[min, max]` segments; wants layers `all`.
    pub pyramid: Option<[u32; 2]>,
    /// Error against samples and time.
    pub convergence: bool,
    /// What each technique costs, which takes some renders more.
    #[serde(default)]
    pub costs: bool,
    /// Width of the figures that are files, in centimetres; none: as large as their contents.
    #[serde(default)]
    pub width_cm: Option<f64>,
    /// Size of the letters in figures of that width, in points; none: 7.
    #[serde(default)]
    pub font_pt: Option<f64>,
}

impl Results {
    /// The cell of a scene and an estimator, by their keys.
    pub fn cell(&self, scene: &str, estimator: &str) -> Option<&Cell> {
        self.cells.iter().find(|c| c.scene == scene && c.estimator == estimator)
    }

    /// When the first of the runs was done, and when the last; none where that is not known.
    pub fn rendered(&self) -> Option<[&str; 2]> {
        let ends = || self.cells.iter().flat_map(|c| &c.runs).filter_map(|r| r.rendered.as_deref());
        // Times of this form sort as texts.
        Some([ends().min()?, ends().max()?])
    }

    /// Key and label of the metric that the page compares efficiencies by: the first that was asked for of those that fall as
    /// 1/samples, else the MSE.
    pub fn efficiency_metric(&self) -> (&str, &str) {
        let found = self.metrics.iter().find(|m| EFFICIENT.contains(&m.key.as_str()));
        found.map_or(("mse", "MSE"), |m| (&m.key, &m.label))
    }

    /// Writes `results.json` into the folder of results, whole or not at all.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write(&self, dir: impl AsRef<Path>) -> Result<()> {
        let path = dir.as_ref().join(FILE_NAME);
        let json = serde_json::to_string_pretty(self).map_err(|e| Error::file(&path, e.to_string()))?;
        write_bytes(&path, json.as_bytes())
    }
}

impl Cell {
    /// A metric over the runs, by its key.
    pub fn metric(&self, key: &str) -> Option<Estimate> {
        self.summary.iter().find(|s| s.metric == key).map(|s| s.value)
    }

    /// A metric of [`EFFICIENT`] times seconds, of each run, without the reference's noise: the reciprocal of its efficiency.
    pub fn costs(&self, metric: &str) -> Vec<f64> {
        let kept = |r: &Run| match metric {
            "mse" => r.mse,
            "relmse" => r.relmse,
            _ => None,
        };
        let error = |r: &Run| kept(r).or_else(|| r.metrics.get(metric).copied()).unwrap_or(f64::NAN);
        self.runs.iter().map(|r| error(r) * r.seconds).collect()
    }

    /// 1/(metric · seconds) for a metric of [`EFFICIENT`], likewise. None where that was not asked for, or nothing is left of it
    /// without the noise.
    pub fn efficiency_by(&self, metric: &str) -> Option<Estimate> {
        if metric == "mse" { self.efficiency } else { efficiency(self.metric(metric), &self.seconds) }
    }
}

/// Whether whole results lie in a folder that were finished after `time` ([`machine::now`](super::machine::now)).
pub fn finished_since(dir: &Path, time: &str) -> bool {
    #[derive(Deserialize)]
    struct End {
        finished: String,
        partial: bool,
    }
    let end = || serde_json::from_slice::<End>(&std::fs::read(dir.join(FILE_NAME)).ok()?).ok();
    end().is_some_and(|end| !end.partial && *end.finished > *time)
}

/// Reads the results in a folder, or in the `results.json` that is named itself.
///
/// # Errors
/// A folder without results, a damaged file, or one of another version of the schema.
pub fn read(dir: impl AsRef<Path>) -> Result<Results> {
    let dir = dir.as_ref();
    let path = if dir.is_file() { dir.to_owned() } else { dir.join(FILE_NAME) };
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            let hint = "there are no results here: 'tyndall run EXPERIMENT.toml' makes them";
            return Err(Error::file(&path, hint));
        }
        Err(e) => return Err(Error::io(&path, "read it", &e)),
    };
    let damaged =
        |e: serde_json::Error| Error::at(&path, e.line(), e.column(), format!("damaged results: {e}"));
    // The version comes first: an unknown one explains every other error.
    #[derive(Deserialize)]
    struct Version {
        schema: u32,
    }
    let Version { schema } = serde_json::from_str(&text).map_err(damaged)?;
    if schema == 1 {
        return older::read(&text).map_err(damaged);
    }
    if schema != SCHEMA {
        let message = format!("results of schema {schema}: this program reads schema {SCHEMA}");
        return Err(Error::file(&path, message));
    }
    serde_json::from_str(&text).map_err(damaged)
}

#[cfg(test)]
#[path = "results_tests.rs"]
mod tests;
