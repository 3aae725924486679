//! What every section needs: the results, names and colours, and images on demand.

use super::markup::{Markup, unique_slugs};
use super::numbers::{significant, with_half_width};
use super::palette::series_color;
use super::paper::Paper;
use super::viewer::Viewer;
use crate::experiment::results::{Cell, Estimate, EstimatorInfo, Results, SceneResult};
use crate::film::exr::{LayeredImage, read_layers};
use std::path::Path;

/// The results, and what making the page gathers beside it.
pub(super) struct Context<'a> {
    dir: &'a Path,
    /// The results.
    pub results: &'a Results,
    /// Colour of each estimator on paper, `#rrggbb`.
    pub colors: Vec<String>,
    scene_slugs: Vec<String>,
    estimator_slugs: Vec<String>,
    /// Figures that are to be files too: name without extension, content.
    pub figures: Vec<(String, String)>,
    /// What could not be shown.
    pub problems: Vec<String>,
    /// The images that the page's viewer has.
    pub viewer: Viewer,
}

/// A scene with the estimators that have results in it.
pub(super) struct SceneView<'a> {
    /// The scene.
    pub scene: &'a SceneResult,
    /// Id of its section, and start of the ids within: `scene-<name>`.
    pub id: String,
    /// Its name in names of files.
    pub slug: String,
    /// The estimators, in order.
    pub entries: Vec<Entry<'a>>,
    /// Labels of estimators without results.
    pub missing: Vec<&'a str>,
}

/// An estimator in a scene.
#[derive(Clone, Copy)]
pub(super) struct Entry<'a> {
    /// Its number in the experiment: decides colour and marker.
    pub index: usize,
    /// What it is.
    pub info: &'a EstimatorInfo,
    /// What it did here.
    pub cell: &'a Cell,
}

impl<'a> Context<'a> {
    /// Names and colours of the results in a folder.
    pub fn new(dir: &'a Path, results: &'a Results) -> Self {
        let colors = results.estimators.iter().enumerate().map(|(i, e)| series_color(&e.color, i)).collect();
        Self {
            dir,
            results,
            colors,
            scene_slugs: unique_slugs(results.scenes.iter().map(|s| s.key.as_str())),
            estimator_slugs: unique_slugs(results.estimators.iter().map(|e| e.key.as_str())),
            figures: Vec::new(),
            problems: Vec::new(),
            viewer: Viewer::default(),
        }
    }

    /// The n-th scene.
    pub fn scene(&self, n: usize) -> SceneView<'a> {
        let results = self.results;
        let scene = &results.scenes[n];
        let mut entries = Vec::new();
        let mut missing = Vec::new();
        for (index, info) in results.estimators.iter().enumerate() {
            match results.cell(&scene.key, &info.key) {
                Some(cell) => entries.push(Entry { index, info, cell }),
                None => missing.push(info.label.as_str()),
            }
        }
        let slug = self.scene_slugs[n].clone();
        SceneView { scene, id: format!("scene-{slug}"), slug, entries, missing }
    }

    /// Name of an estimator in ids and names of files.
    pub fn estimator_slug(&self, index: usize) -> &str {
        &self.estimator_slugs[index]
    }

    /// What figures are laid out on.
    pub fn paper(&self) -> Option<Paper> {
        Paper::of(&self.results.figures)
    }

    /// The images of an EXR of the results, which must have the scene's size; noted where that fails.
    pub fn load(&mut self, path: &str, scene: &SceneResult) -> Option<LayeredImage> {
        if path.is_empty() {
            return None;
        }
        let problem = match read_layers(self.dir.join(path)) {
            Ok(image) if (image.width, image.height) == (scene.width, scene.height) => return Some(image),
            Ok(image) => format!(
                "{path} has {}×{} pixels where the scene '{}' has {}×{}",
                image.width, image.height, scene.label, scene.width, scene.height
            ),
            Err(e) => e.to_string(),
        };
        self.note(problem);
        None
    }

    /// A file of the results as it is named from where the page was made.
    pub fn path(&self, file: &str) -> std::path::PathBuf {
        self.dir.join(file)
    }

    /// Notes once what could not be shown.
    pub fn note(&mut self, problem: String) {
        if !self.problems.contains(&problem) {
            self.problems.push(problem);
        }
    }
}

/// Half of the interval's width, where it is symmetric about the mean to the digits that are printed.
fn half_width(e: &Estimate) -> Option<f64> {
    let interval = e.interval?;
    let (up, down) = (interval.high - e.mean, e.mean - interval.low);
    ((up - down).abs() <= 0.05 * (up + down)).then_some(0.5 * (up + down))
}

/// An estimate with its interval: `0.123 ± 0.004`, or with both ends where they are not symmetric.
pub(super) fn estimate(e: &Estimate) -> String {
    match (e.interval, half_width(e)) {
        (Some(i), None) if i.low.is_finite() && i.high.is_finite() && i.low < i.high => {
            format!("{} [{},\u{a0}{}]", significant(e.mean, 3), significant(i.low, 2), significant(i.high, 2))
        }
        (_, half) => with_half_width(e.mean, half),
    }
}

/// A fitted slope with its interval.
pub(super) fn slope(e: &Estimate) -> String {
    format!("slope {}", with_half_width(e.mean, half_width(e)))
}

/// A list of warnings, if there are any.
pub(super) fn warnings(m: &mut Markup, heading: &str, texts: &[String]) {
    if texts.is_empty() {
        return;
    }
    m.tag("div", &[("class", &"warning"), ("role", &"note")], |m| {
        m.leaf("strong", &[], heading);
        m.tag("ul", &[], |m| texts.iter().for_each(|t| m.leaf("li", &[], t)));
    });
}

/// Paragraphs separated by blank lines.
pub(super) fn paragraphs(m: &mut Markup, class: &str, text: &str) {
    for paragraph in text.replace("\r\n", "\n").split("\n\n").map(str::trim).filter(|p| !p.is_empty()) {
        m.leaf("p", &[("class", &class)], paragraph);
    }
}
