//! The pyramid: contributions of (s, t), a row a path length [Veach 1997, figure 10.2].

use super::comparison::shown;
use super::context::{Context, Entry, SceneView};
use super::layers::{Group, Kind, energy, longest_pair, name};
use super::markup::Markup;
use super::montage::{Montage, Tile};
use super::numbers::{percent, plural};
use super::paper::Paper;
use super::picture::{Picture, factor};
use crate::film::exr::LayeredImage;
use crate::film::{Image, ScalarImage};
use rayon::prelude::*;

/// Images are at most so large.
const SIDE: usize = 224;
/// A row is brightened by at most so many stops.
const MOST_STOPS: i32 = 16;

/// The paths of one length.
struct Row {
    length: u32,
    /// By s, from 0.
    cells: Vec<Cell>,
    /// Stops by which the row is brighter than the page's exposure.
    stops: i32,
    /// Share of the combined image's energy.
    share: f64,
}

/// The paths of one (s, t).
struct Cell {
    /// Weighted and unweighted.
    pictures: [Option<Picture>; 2],
    /// Share of the combined image's energy, where there is a weighted layer.
    share: Option<f64>,
}

/// The pyramid of an estimator with (s, t) layers, for paths of `lengths` segments; nothing for others.
pub(super) fn pyramid(
    context: &mut Context,
    view: &SceneView,
    entry: &Entry,
    layers: &LayeredImage,
    lengths: [u32; 2],
    m: &mut Markup,
) {
    let Some((combined, longest)) = layers.layer("").zip(longest_pair(layers)) else { return };
    let rows: Vec<Row> = (lengths[0].max(1)..=lengths[1].min(longest))
        .map(|k| row(layers, combined, k, view.scene.exposure))
        .collect();
    if rows.is_empty() {
        return;
    }
    let id = format!("{}-pyramid-{}", view.id, context.estimator_slug(entry.index));
    m.tag("article", &[("id", &id), ("class", &"pyramid"), ("data-estimator", &entry.info.key)], |m| {
        m.leaf("h4", &[], &entry.info.label);
        if rows.iter().any(|r| r.cells.iter().any(|c| c.pictures[1].is_some())) {
            switch(m, &id);
        }
        let label = format!("pyramid of {}", entry.info.label);
        let widest = rows.iter().map(|r| r.cells.len()).max().unwrap_or(1);
        let style = format!("--columns:{widest}");
        m.region(&[("class", &"scroll")], &label, |m| {
            m.tag("div", &[("class", &"levels"), ("style", &style)], |m| {
                rows.iter().for_each(|r| level(m, view, entry, r));
            });
        });
    });
    let figure = figure(view, entry, &rows, context.paper());
    let slug = context.estimator_slug(entry.index);
    context.figures.push((format!("{}-pyramid-{slug}", view.slug), figure));
}

fn row(layers: &LayeredImage, combined: &Image, length: u32, exposure: f32) -> Row {
    let layer =
        |s: u32, weighted: bool| layers.layer(&name(&Group::Pair(s, length + 1 - s), Kind::of(weighted)));
    let weighted: Vec<&Image> = (0..=length).filter_map(|s| layer(s, true)).collect();
    let stops = brightening(combined, &weighted);
    let total = energy(combined);
    let cell = |s: u32| {
        let show = |w: bool| Picture::of(layer(s, w)?, exposure + stops as f32, SIDE);
        Cell { pictures: [show(true), show(false)], share: layer(s, true).map(|i| energy(i) / total) }
    };
    let cells: Vec<Cell> = (0..=length).into_par_iter().map(cell).collect();
    Row { length, stops, share: cells.iter().filter_map(|c| c.share).sum(), cells }
}

/// Whole stops that lift the brightest image of a row to where the combined image is, as seen by a high quantile of
/// the luminance; never less than 0.
fn brightening(combined: &Image, images: &[&Image]) -> i32 {
    let bright = |i: &Image| {
        let luminance: ScalarImage = i.luminance();
        luminance.quantile(0.97)
    };
    let most = images.iter().map(|i| bright(i)).fold(0.0, f32::max);
    let stops = (bright(combined) / most).log2().floor();
    if stops.is_finite() { (stops as i32).clamp(0, MOST_STOPS) } else { 0 }
}

/// Two radio buttons; the style sheet shows the images that they name.
fn switch(m: &mut Markup, id: &str) {
    m.tag("fieldset", &[("class", &"switch")], |m| {
        m.leaf("legend", &[], "contributions");
        for (value, checked) in [("weighted", true), ("unweighted", false)] {
            m.tag("label", &[], |m| {
                let mut attributes: Vec<super::markup::Attribute> =
                    vec![("type", &"radio"), ("name", &id), ("value", &value)];
                if checked {
                    attributes.push(("checked", &"checked"));
                }
                m.void("input", &attributes);
                m.text(value);
            });
        }
    });
}

/// The exposure of a row against that of the page, on two lines.
fn multiplier(stops: i32) -> Vec<String> {
    let factor = format!("exposure ×{}", 1u32 << stops);
    if stops == 0 { vec![factor] } else { vec![factor, format!("(+{})", plural(stops as u64, "stop"))] }
}

fn level(m: &mut Markup, view: &SceneView, entry: &Entry, row: &Row) {
    m.tag("div", &[("class", &"level")], |m| {
        m.tag("div", &[("class", &"level-name")], |m| {
            m.leaf("b", &[], format!("k = {}", row.length));
            multiplier(row.stops).iter().for_each(|t| m.leaf("span", &[], t));
            m.leaf("span", &[], format!("{} of the energy", percent(row.share)));
        });
        m.tag("div", &[("class", &"level-images")], |m| {
            for (s, cell) in row.cells.iter().enumerate() {
                let t = row.length as usize + 1 - s;
                m.tag("figure", &[], |m| {
                    one(m, view, entry, row, s, true);
                    if cell.pictures[1].is_some() {
                        one(m, view, entry, row, s, false);
                    }
                    m.tag("figcaption", &[], |m| {
                        m.leaf("span", &[], format!("s={s} t={t}"));
                        if let Some(share) = cell.share {
                            m.leaf("span", &[("class", &"fact")], percent(share));
                        }
                    });
                });
            }
        });
    });
    m.newline();
}

fn one(m: &mut Markup, view: &SceneView, entry: &Entry, row: &Row, s: usize, weighted: bool) {
    let kind = if weighted { "weighted" } else { "unweighted" };
    let group = Group::Pair(s as u32, row.length + 1 - s as u32);
    let layer = name(&group, Kind::of(weighted));
    m.tag("div", &[("class", &format!("layer {kind}"))], |m| {
        let alt = format!("{} of {}, {layer}", view.scene.label, entry.info.label);
        let picture = row.cells[s].pictures[usize::from(!weighted)].as_ref();
        shown(m, picture, &alt, &entry.cell.files.mean_exr, &layer, view);
    });
}

/// What the images of the section are shrunk to, if they are.
pub(super) fn size_note(view: &SceneView) -> String {
    match factor(view.scene.width, view.scene.height, SIDE) {
        1 => "Images at their size.".into(),
        factor => format!("Images at 1/{factor} of their size; the EXR has them whole."),
    }
}

fn figure(view: &SceneView, entry: &Entry, rows: &[Row], paper: Option<Paper>) -> String {
    let mut montage = Montage::new(format!("{}: pyramid of {}", view.scene.label, entry.info.label), 120.0);
    for (i, row) in rows.iter().enumerate() {
        for (s, cell) in row.cells.iter().enumerate() {
            let share = cell.share.map_or(String::new(), |share| format!(": {}", percent(share)));
            let label = format!("s={s} t={}{share}", row.length as usize + 1 - s);
            let picture = cell.pictures[0].clone();
            montage.push(i, Tile { picture, label, ..Tile::default() });
        }
        montage.name_row(i, &format!("k = {}\n{}", row.length, multiplier(row.stops).join("\n")));
    }
    montage.on(paper)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dim_rows_are_brightened_by_whole_stops() {
        let grey = |v: f32| Image::from_fn(4, 4, |_, _| [v; 3]);
        let combined = grey(1.0);
        assert_eq!(brightening(&combined, &[&grey(0.24), &grey(0.1)]), 2);
        assert_eq!(brightening(&combined, &[&grey(3.0)]), 0, "never darkened");
        assert_eq!(brightening(&combined, &[&grey(0.0)]), 0, "black stays black");
        assert_eq!(brightening(&combined, &[&grey(1e-30)]), MOST_STOPS);
        assert_eq!(brightening(&grey(0.0), &[&grey(0.0)]), 0);
        assert_eq!(brightening(&combined, &[]), 0);
        assert_eq!(multiplier(2).join(" "), "exposure ×4 (+2 stops)");
    }
}
