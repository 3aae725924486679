//! An experiment file, checked and resolved: which estimators run in which scenes, and for how long.

use super::metrics::Metric;
use super::overrides::Override;
use super::resolve::resolve;
use super::results::{Crop, Figures, Origin};
use crate::error::{Error, Result};
use crate::render::Budget;
use crate::scene::RenderDefaults;
use crate::scene::file::source::Source;
use crate::transport::expression::Expression;
use crate::transport::merge::MergeSettings;
use crate::transport::settings::{Connections, Heuristic, Layers, LightStarts, Settings, Tracking};
use crate::transport::technique::TechniqueSet;
use std::path::{Path, PathBuf};

/// A whole experiment.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The file's name without `.toml`.
    pub name: String,
    /// The file it comes from.
    pub source: Origin,
    /// The file's text, with the changes from the command line.
    pub text: String,
    /// For people.
    pub title: String,
    /// For the page.
    pub description: String,
    /// Independent runs a scene and estimator.
    pub runs: u32,
    /// Which paths count where neither scene nor estimator says it.
    pub paths: Expression,
    /// What all seeds are hashed from.
    pub seed: u64,
    /// The main one first.
    pub metrics: Vec<Metric>,
    /// Which figures are wanted.
    pub figures: Figures,
    /// In order; at least one.
    pub scenes: Vec<ScenePlan>,
    /// In order; at least one.
    pub estimators: Vec<EstimatorPlan>,
    /// What the file says that changes nothing.
    pub warnings: Vec<String>,
}

/// Bounds on the lengths of paths, in segments; what is none is left to the next level: the estimator's come
/// before the scene entry's, these before the experiment's, these before the scene file's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lengths {
    /// Shortest.
    pub min: Option<u32>,
    /// Longest.
    pub max: Option<u32>,
}

impl From<RenderDefaults> for Lengths {
    fn from(defaults: RenderDefaults) -> Self {
        Self { min: defaults.min_length, max: defaults.max_length }
    }
}

/// A scene of an experiment.
#[derive(Clone, Debug)]
pub struct ScenePlan {
    /// Names it in results and paths.
    pub key: String,
    /// For people.
    pub label: String,
    /// For the page.
    pub caption: String,
    /// The scene file.
    pub path: PathBuf,
    /// As the experiment file wrote it.
    pub file: String,
    /// Width and height in pixels; none: the scene file's.
    pub size: Option<[u32; 2]>,
    /// Stops.
    pub exposure: f32,
    /// Not yet known to lie inside the image.
    pub crops: Vec<Crop>,
    /// Of the scene's entry, or the experiment's.
    pub lengths: Lengths,
    /// Which paths count, where the estimator has none of its own: of the scene's entry, or the experiment's.
    pub paths: Expression,
    /// What the estimators are measured against.
    pub reference: Option<ReferencePlan>,
}

/// Where a reference comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum ReferencePlan {
    /// An EXR.
    File {
        /// Where it is.
        path: PathBuf,
        /// As the experiment file wrote it.
        file: String,
    },
    /// To be rendered.
    Render {
        /// With these techniques.
        techniques: TechniqueSet,
        /// With media on grids gone through like this.
        tracking: Tracking,
        /// Merged like this.
        merging: Box<MergeSettings>,
        /// Of these paths.
        paths: Box<Expression>,
        /// At least this much.
        budget: Budget,
    },
}

/// An estimator of an experiment.
#[derive(Clone, Debug)]
pub struct EstimatorPlan {
    /// Names it in results and paths.
    pub key: String,
    /// For people.
    pub label: String,
    /// For the page.
    pub caption: String,
    /// `#rrggbb`.
    pub color: String,
    /// What it is made of.
    pub techniques: TechniqueSet,
    /// How these are weighted.
    pub heuristic: Heuristic,
    /// Which connections are made.
    pub connections: Connections,
    /// Which lights light subpaths start on.
    pub light_starts: LightStarts,
    /// How media on grids are gone through.
    pub tracking: Tracking,
    /// The estimator's own.
    pub lengths: Lengths,
    /// How merges are made.
    pub merging: MergeSettings,
    /// Which paths count, if not the scene's: the estimator's own.
    pub paths: Option<Expression>,
    /// Which images are kept.
    pub layers: Layers,
    /// Longest paths with (s, t) layers, in segments.
    pub pyramid: u32,
    /// What each run may use.
    pub budget: Budget,
}

/// Reads an experiment file, with changes from the command line.
///
/// # Errors
/// Whatever is wrong with the file, with the place in it; or with the changes.
pub fn read(path: &Path, overrides: &[Override]) -> Result<Plan> {
    let source = Source::read(path)?;
    // The file on its own comes first, so that its errors have their places.
    let plan = resolve(&source);
    if overrides.is_empty() {
        return plan;
    }
    let mut table: toml::Table = source.parse()?;
    for change in overrides {
        change.apply(&mut table)?;
    }
    let changes = overrides.iter().map(|c| format!("--set {}", c.text())).collect::<Vec<_>>().join(" ");
    let text = toml::to_string(&table).map_err(|e| Error::usage(format!("{changes}: {e}")))?;
    let origin = Origin::of(&source);
    let changed = resolve(&Source::from_text(path, text)).map(|changed| Plan { source: origin, ..changed });
    changed.map_err(|error| match (plan, error) {
        (Err(original), _) => original,
        (Ok(_), Error::File { path, message, .. }) => {
            Error::usage(format!("{} with {changes}: {message}", path.display()))
        }
        (Ok(_), other) => other,
    })
}

impl Plan {
    /// Settings of run `run` of an estimator in a scene, of which `file` has the bounds of its scene file.
    ///
    /// # Errors
    /// Lengths that exclude each other.
    pub fn settings(
        &self,
        scene: &ScenePlan,
        file: Lengths,
        estimator: &EstimatorPlan,
        run: u32,
    ) -> Result<Settings> {
        let mut settings = scene.settings(file, estimator.lengths, estimator.techniques)?;
        settings.heuristic = estimator.heuristic;
        settings.connections = estimator.connections;
        settings.light_starts = estimator.light_starts;
        settings.tracking = estimator.tracking;
        settings.merging = estimator.merging;
        settings.paths = estimator.paths.unwrap_or(scene.paths);
        settings.layers = estimator.layers;
        settings.pyramid = estimator.pyramid;
        settings.seed = super::hash::seed(self.seed, &[&scene.key, &estimator.key, &run.to_string()]);
        settings.validate().map_err(|e| Error::usage(format!("estimator {}: {e}", estimator.key)))?;
        Ok(settings)
    }
}

impl ScenePlan {
    /// Settings of a render of this scene with bounds `own` before the scene's.
    ///
    /// # Errors
    /// Lengths that exclude each other.
    pub fn settings(&self, file: Lengths, own: Lengths, techniques: TechniqueSet) -> Result<Settings> {
        let mut settings = Settings::new(techniques);
        let levels = [own, self.lengths, file];
        let first = |get: fn(&Lengths) -> Option<u32>| levels.iter().find_map(get);
        settings.min_length = first(|l| l.min).unwrap_or(settings.min_length);
        settings.max_length = first(|l| l.max).unwrap_or(settings.max_length);
        settings.validate().map_err(|e| Error::usage(format!("scene {}: {e}", self.key)))?;
        Ok(settings)
    }
}
