//! The report of an experiment: one self-contained HTML page and figures, from the results on disk.
//!
//! The page needs no network: images and plots are within it, and can be read without a script; one opens images in a viewer. It is made of one section a scene, with
//! ids `scene-<name>-contributions`, `-images`, `-metrics`, `-why`, `-convergence`, `-techniques` and `-pyramid`; every image carries
//! the EXR that it comes from in `data-exr` and the layer in `data-layer`, relative to the folder of results.
//!
//! | file | what it makes |
//! |---|---|
//! | `page` | the whole: head, summary, scenes, what is needed to repeat it |
//! | `comparison`, `crops`, `insets`, `maps` | images side by side, error maps, enlarged parts |
//! | `table`, `statistics` | metrics with intervals, and who is best |
//! | `convergence`, `plot`, `curve`, `axis`, `palette` | error against samples and time |
//! | `contributions`, `techniques`, `pyramid`, `layers` | contributions of techniques, and of (s, t) |
//! | `verdict` | which estimator is best, and what the other loses by |
//! | `why` | what each technique adds, causes and costs; maps of variance and bias |
//! | `viewer` | images flipped in place, as floating-point data |
//! | `reproduce` | program, machine, settings, seeds, times, definitions |
//! | `paper`, `face` | the width that figures are laid out at, and their font |
//! | `outlined`, `pdf`, `drawn`, `made` | figures as SVG, as PDF and as PNG; which of them are of before |
//! | `markup`, `numbers`, `picture`, `montage` | HTML and SVG, numbers, images as `data:` addresses |

mod axis;
mod comparison;
mod context;
mod contributions;
mod convergence;
mod crops;
mod curve;
mod drawn;
mod face;
mod insets;
mod layers;
mod made;
mod maps;
mod markup;
mod montage;
mod numbers;
mod outlined;
mod page;
mod palette;
mod paper;
mod path;
mod pdf;
mod picture;
mod plot;
mod pyramid;
mod reproduce;
pub(crate) mod statistics;
mod table;
mod techniques;
#[cfg(test)]
mod tests;
mod verdict;
mod viewer;
mod why;

use crate::error::{Error, Result};
use crate::experiment::results::{self, Results};
use crate::film::output::write_bytes;
use comparison::signed;
use made::{Made, sum_of};
pub(crate) use numbers::plural;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// What a report consists of.
#[derive(Clone, Debug, PartialEq)]
pub struct ReportSummary {
    /// The page.
    pub page: PathBuf,
    /// Its size in bytes.
    pub bytes: usize,
    /// The figures beside it, each an SVG file of its own.
    pub figures: Vec<PathBuf>,
    /// The same as PNG files.
    pub pictures: Vec<PathBuf>,
    /// What could not be shown, such as an image that is missing; the page says so too.
    pub problems: Vec<String>,
}

/// Reads the results in a folder and writes `index.html`, `figures/*.svg`, the same as `*.pdf` and `*.png`, there, each whole or not at all.
///
/// Images that are missing or damaged leave a note in the page. Figures that an earlier report made and this one does not are deleted.
///
/// # Errors
/// No results in the folder, damaged ones, or a file that cannot be written.
pub fn report(dir: &Path) -> Result<ReportSummary> {
    report_at(dir, None)
}

/// [`report`] with the images of all scenes at another exposure than the experiment file's, in stops; the page says so.
///
/// # Errors
/// As [`report`].
pub fn report_at(dir: &Path, exposure: Option<f32>) -> Result<ReportSummary> {
    let mut results = results::read(dir)?;
    if let Some(stops) = exposure {
        for scene in &mut results.scenes {
            let said = (scene.exposure != stops)
                .then(|| format!(" instead of {}, as the experiment has it", signed(scene.exposure)));
            let note =
                format!("Shown at an exposure of {} stops{}.", signed(stops), said.unwrap_or_default());
            scene.caption = [scene.caption.as_str(), &note].join("\n\n").trim().to_owned();
            scene.exposure = stops;
        }
    }
    let dir = if dir.is_file() { dir.parent().unwrap_or(Path::new(".")) } else { dir };
    report_of(dir, &results)
}

/// [`report`] of results that are at hand, with their images in `dir`.
///
/// # Errors
/// A file that cannot be written.
pub fn report_of(dir: &Path, results: &Results) -> Result<ReportSummary> {
    let mut context = context::Context::new(dir, results);
    let html = page::page(&mut context);
    let folder = dir.join("figures");
    std::fs::create_dir_all(&folder).map_err(|e| Error::io(&folder, "make the folder", &e))?;
    let width = results.figures.width_cm;
    let written = context.figures.par_iter().map(|(name, svg)| figure(&folder.join(name), svg, width));
    let written = written.collect::<Result<Vec<_>>>()?;
    made::tidy(&folder, &written.iter().flat_map(|w| w.made.clone()).collect())?;
    let figures = written.iter().map(|w| w.svg.clone()).collect();
    let pictures = written.into_iter().filter_map(|w| w.png).collect();
    let page = dir.join("index.html");
    write_bytes(&page, html.as_bytes())?;
    Ok(ReportSummary { page, bytes: html.len(), figures, pictures, problems: context.problems })
}

/// A figure on disk.
struct Written {
    svg: PathBuf,
    png: Option<PathBuf>,
    /// Its files.
    made: Made,
}

/// Writes a figure as SVG, PDF and PNG, at `path` with these extensions.
fn figure(path: &Path, svg: &str, width: Option<f64>) -> Result<Written> {
    let mut made = Made::new();
    let mut write = |extension: &str, bytes: &[u8]| {
        let name = format!("{}.{extension}", path.file_name().unwrap_or_default().to_string_lossy());
        let path = path.with_file_name(&name);
        write_bytes(&path, bytes)?;
        made.insert(name, sum_of(bytes));
        Ok(path)
    };
    let file = write("svg", outlined::outlined(&pdf::sized(svg, width)).as_bytes())?;
    if let Some(pdf) = pdf::pdf(svg, width) {
        write("pdf", &pdf)?;
    }
    let png = drawn::png(svg, width).map(|png| write("png", &png)).transpose()?;
    Ok(Written { svg: file, png, made })
}
