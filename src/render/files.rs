//! What a render leaves on disk: one EXR with its layers and with the words that tell how it was made.

use super::Outcome;
use crate::error::{Error, Result, from_root};
use crate::film::Film;
use crate::film::exr::LayeredImage;
use crate::medium::Medium;
use crate::scene::Scene;
use crate::transport::expression::Expression;
use crate::transport::merge::auto::{self, Chosen};
use crate::transport::merge::{Beams, GatherNow, Kernel, MERGES, MergeSettings};
use crate::transport::settings::{Connections, Heuristic, Layers, LightStarts, Settings, Tracking};
use crate::transport::technique::{Technique, TechniqueSet};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Name of the layer with the variance of the default layer's pixels.
pub const VARIANCE: &str = "variance";

/// Name of the layer with what one iteration added most to each pixel: its luminance, its number from 0, and its share of
/// all that the pixel got; the channels are `outliers.luminance`, `outliers.iteration` and `outliers.share`, and R, G and B
/// in files of before they had these names. `tyndall explain RUN.exr` lists and replays it.
pub const OUTLIERS: &str = crate::film::exr::OUTLIERS;

/// Name of the metadata with the absolute path of the scene file.
pub const SCENE_FILE: &str = "tyndall.sceneFile";

/// Name of the metadata with the number of runs, in an image that is a mean over them.
pub const RUNS: &str = "tyndall.runs";

/// Name of the metadata of an image that is a reference, put together from blocks and without samples of its own.
pub const REFERENCE: &str = "tyndall.reference";

/// Names of the metadata with the program, the code that rendered, and the settings.
pub const MADE_BY: [&str; 3] = ["tyndall.version", "tyndall.rendering", "tyndall.settings"];

/// Name of the metadata with a hash of the contents of the scene's files.
pub const SCENE_CONTENTS: &str = "tyndall.sceneContents";

/// The program's name and version.
pub const PROGRAM: &str = concat!("tyndall ", env!("CARGO_PKG_VERSION"));

/// A hash of the code that decides what is rendered, 16 hexadecimal digits: comments do not count, nor does what shows and
/// measures images. The build script makes it.
pub const RENDERING: &str = env!("TYNDALL_RENDERING");

/// Everything that decides the pixels beside the scene, in words: written beside every result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Resolved {
    /// The scene file.
    pub scene: String,
    /// Width and height of the full frame in pixels.
    pub size: [u32; 2],
    /// What of it was rendered: x0, y0, x1, y1.
    pub crop: [u32; 4],
    /// Keys of the techniques.
    pub techniques: Vec<String>,
    /// `balance`, or `power 2`.
    pub heuristic: String,
    /// Shortest paths, in segments.
    pub min_length: u32,
    /// Longest paths, in segments.
    pub max_length: u32,
    /// Which paths counted: a light path expression, as it was given.
    #[serde(default = "all_paths")]
    pub paths: String,
    /// Which connections between subpaths were made, where there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub connections: Option<Connections>,
    /// The shares of the light subpaths that started on each light, where they were chosen and not in proportion to the powers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light_starts: Option<Vec<f32>>,
    /// How media on grids were gone through, where that could be chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracking: Option<Tracking>,
    /// How merges are made, where there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub merging: Option<ResolvedMerging>,
    /// Whether lights as they are seen directly were connected with the lens, beside being hit, where that was said or chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direct: Option<bool>,
    /// Names the random numbers; as text, since TOML has no such large numbers.
    pub seed: String,
    /// Which images were kept.
    pub layers: Layers,
    /// With layers `all`: longest paths with (s, t) images.
    pub pyramid: u32,
}

/// How merges are made, with what was chosen from the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResolvedMerging {
    /// Of all techniques.
    pub kernel: Kernel,
    /// Of light subpaths.
    pub photon_beams: Beams,
    /// Of camera subpaths.
    pub camera_beams: Beams,
    /// Whether camera subpaths end at their first vertex that is not specular.
    pub first: bool,
    /// Techniques that are off, as they are not worth what they cost in this scene.
    pub left_out: Vec<String>,
    /// By medium, the probability with which camera subpaths go on from a collision at most; none where it is 1 in all.
    pub continuations: Vec<f32>,
    /// By the technique's key; those that are on.
    pub techniques: BTreeMap<String, ResolvedGather>,
}

/// How one technique merges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResolvedGather {
    /// Radius of the kernel in the first iteration, in metres.
    pub radius: f32,
    /// The kernel's measure falls with the iteration i (from 1) as i^(α − 1).
    pub alpha: f32,
    /// Light subpaths that are merged with, the first of an iteration.
    pub paths: u64,
}

impl ResolvedMerging {
    /// None where nothing merges.
    fn new(settings: &Settings, chosen: Chosen) -> Option<Self> {
        if !settings.techniques.merges() {
            return None;
        }
        let MergeSettings { kernel, photon_beams, camera_beams, first, .. } = settings.merging;
        let of = |t: Technique| {
            let GatherNow { radius, paths } = *chosen.gathers.of(t);
            (t.info().key.to_owned(), ResolvedGather { radius, alpha: settings.merging.of(t).alpha, paths })
        };
        let merges = settings.techniques.without(chosen.left_out);
        let techniques = MERGES.into_iter().filter(|t| merges.has(*t)).map(of).collect();
        let left_out = chosen.left_out.iter().map(|t| t.info().key.to_owned()).collect();
        let continuations = chosen.thinning.continuations;
        Some(Self { kernel, photon_beams, camera_beams, first, techniques, left_out, continuations })
    }
}

impl Resolved {
    /// Of a render of the scene in the file `path`.
    pub fn new(path: &str, scene: &Scene, settings: &Settings) -> Self {
        let (size, crop) = (scene.camera.size(), scene.camera.crop());
        let is_chosen = settings.techniques.merges() || settings.light_starts != LightStarts::Power;
        let chosen = if is_chosen { auto::resolve(scene, settings) } else { Chosen::default() };
        Self {
            scene: path.to_owned(),
            size: size.to_array(),
            crop: [crop.x0, crop.y0, crop.x1, crop.y1],
            techniques: settings.techniques.iter().map(|t| t.info().key.to_owned()).collect(),
            heuristic: heuristic_text(settings.heuristic),
            min_length: settings.min_length,
            max_length: settings.max_length,
            paths: settings.paths.to_string(),
            connections: settings.techniques.has(Technique::Connect).then_some(settings.connections),
            light_starts: chosen.starts.as_deref().map(|q| (0..q.len()).map(|i| q.pdf(i)).collect()),
            tracking: tracking(scene, settings),
            direct: settings.merging.direct,
            merging: ResolvedMerging::new(settings, chosen),
            seed: settings.seed.to_string(),
            layers: settings.layers,
            pyramid: settings.pyramid,
        }
    }

    /// As JSON in one line.
    pub fn json(&self) -> String {
        serde_json::to_string(self).expect("plain structs have a JSON form")
    }
}

/// None where there is nothing to track, or a technique that forbids it.
fn tracking(scene: &Scene, settings: &Settings) -> Option<Tracking> {
    let chosen = settings.techniques.without(TechniqueSet::tracked()).is_empty()
        && scene.media.iter().any(Medium::is_tracked);
    chosen.then(|| settings.with_tracking().tracking)
}

/// What files say that were written before paths could be left out.
pub fn all_paths() -> String {
    Expression::ALL.to_string()
}

/// `balance`, or `power 2`.
pub fn heuristic_text(heuristic: Heuristic) -> String {
    match heuristic {
        Heuristic::Balance => "balance".into(),
        Heuristic::Power(exponent) => format!("power {exponent}"),
    }
}

/// How many contributions were dropped, by the technique's key; those without any are missing.
pub fn dropped(film: &Film) -> BTreeMap<String, u64> {
    let counts = film.dropped().0;
    let of = |t: Technique| (t.info().key.to_owned(), counts[t.index()]);
    Technique::all().map(of).filter(|(_, count)| *count > 0).collect()
}

/// The film as an EXR: the image in the default layer, its variance (from the second iteration on), the technique
/// layers that `settings` ask for, and how it was made.
pub fn layered(scene: &Scene, settings: &Settings, resolved: &Resolved, outcome: &Outcome) -> LayeredImage {
    let film = &outcome.film;
    let mut file = LayeredImage::new(film.image());
    let origin = film.origin();
    file.origin = origin.map(|v| v as i32);
    file.full_size = scene.camera.size().to_array().map(|v| v as usize);
    if film.iterations() > 1 {
        file.push(VARIANCE, film.variance());
    }
    if settings.layers != Layers::None {
        for (kind, image) in film.layers() {
            file.push(kind.name(), image);
        }
        file.push(OUTLIERS, film.outliers());
    }
    file.metadata = metadata(resolved, settings, outcome);
    file
}

/// Where a scene lies and what is in its files, as an EXR's string attributes: with the settings, all that it takes to
/// walk a sample again.
pub fn origin(scene: &Path, contents: &str) -> [(String, String); 2] {
    [(SCENE_FILE, from_root(scene).to_string_lossy().into_owned()), (SCENE_CONTENTS, contents.to_owned())]
        .map(|(key, text)| (key.to_owned(), text))
}

/// [`MADE_BY`] of what this program renders with these settings.
pub fn made_by(resolved: &Resolved) -> Vec<(String, String)> {
    let texts = [PROGRAM.to_owned(), RENDERING.to_owned(), resolved.json()];
    MADE_BY.into_iter().map(str::to_owned).zip(texts).collect()
}

/// How a render was made, as an EXR's string attributes.
fn metadata(resolved: &Resolved, settings: &Settings, outcome: &Outcome) -> Vec<(String, String)> {
    let dropped = serde_json::to_string(&dropped(&outcome.film)).expect("a map of numbers has a JSON form");
    let entries = [
        ("seed", settings.seed.to_string()),
        ("iterations", outcome.film.iterations().to_string()),
        ("seconds", format!("{:.6}", outcome.seconds)),
        ("cameraPaths", outcome.camera_paths.to_string()),
        ("lightPaths", outcome.light_paths.to_string()),
        ("dropped", dropped),
        (
            "merges",
            outcome
                .merges
                .iter()
                .map(|(key, words)| format!("{key}: {words}"))
                .collect::<Vec<_>>()
                .join("; "),
        ),
        ("partial", outcome.partial.to_string()),
    ];
    let entries = entries.into_iter().map(|(key, text)| (format!("tyndall.{key}"), text));
    made_by(resolved).into_iter().chain(entries).collect()
}

/// What is in a folder, in order; nothing where it cannot be read.
pub fn entries(folder: &Path) -> Vec<PathBuf> {
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let found = std::fs::read_dir(here).into_iter().flatten().flatten();
    let mut entries: Vec<PathBuf> = found.map(|entry| folder.join(entry.file_name())).collect();
    entries.sort();
    entries
}

/// The folders in a folder, in order. Links to others are not among them.
pub fn folders(folder: &Path) -> Vec<PathBuf> {
    let mut found = entries(folder);
    found.retain(|path| path.is_dir() && !path.is_symlink());
    found
}

/// Makes a folder, and those above it, unless they are there; and sees whether files can be made in it.
///
/// # Errors
/// Where they cannot.
pub fn prepare_folder(dir: &Path) -> Result<()> {
    let dir = if dir.as_os_str().is_empty() { Path::new(".") } else { dir };
    std::fs::create_dir_all(dir).map_err(|e| Error::io(dir, "make this folder", &e))?;
    check_writable(dir)
}

/// Sees whether a file of that name can be made, before hours are spent on what goes into it.
///
/// # Errors
/// Where it cannot.
pub fn check_output(file: &Path) -> Result<()> {
    if file.is_dir() {
        return Err(Error::file(file, "is a folder: the name of a file is needed"));
    }
    let dir = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !dir.is_dir() {
        return Err(Error::file(file, format!("cannot write it: there is no folder {}", dir.display())));
    }
    check_writable(dir)
}

fn check_writable(dir: &Path) -> Result<()> {
    tempfile::Builder::new()
        .prefix(".tyndall-")
        .tempfile_in(dir)
        .map(drop)
        // The kind alone: the error's own words name the temporary file.
        .map_err(|e| Error::io(dir, "write into this folder", &e.kind().into()))
}
