//! The figure of weighted contributions: the combined image over what each technique adds to it [Křivánek et al. 2014,
//! figure 1], and under that the contributions before they are weighted, and the weights.

use super::comparison::shown;
use super::context::{Context, Entry, SceneView};
use super::layers::{Kind, energy};
use super::markup::Markup;
use super::montage::{Montage, Tile};
use super::numbers::{duration, percent, plural, significant};
use super::paper::Paper;
use super::picture::Picture;
use super::techniques::{Row, energy_bar, images_row, rows, shown_kinds, size_note};
use crate::film::Image;
use crate::film::false_color::Scale;

/// Images of techniques are at most so large in the page.
const SIDE: usize = 400;
/// The combined one.
const WHOLE: usize = 1600;

/// The section of the estimator that the experiment names; nothing where it has no layers.
pub(super) fn section(context: &mut Context, view: &SceneView, m: &mut Markup) {
    let Some(key) = context.results.figures.contributions.as_deref() else { return };
    let Some(entry) = view.entries.iter().find(|e| e.info.key == key && !e.cell.files.layers.is_empty())
    else {
        return;
    };
    let Some(layers) = context.load(&entry.cell.files.mean_exr, view.scene) else { return };
    let Some(combined) = layers.layer("") else { return };
    super::page::offer(context, view, entry, &layers, true, None);
    let stops = view.scene.exposure;
    let rows = rows(&layers, combined, stops, SIDE);
    if rows.is_empty() {
        return;
    }
    let id = format!("{}-contributions", view.id);
    m.tag(
        "section",
        &[("id", &id), ("class", &"contributions strip"), ("data-estimator", &entry.info.key)],
        |m| {
            m.leaf("h3", &[], format!("Weighted contributions: {}", entry.info.label));
            whole(m, view, entry, combined, &rows);
            for kind in shown_kinds(&rows) {
                images_row(m, view, entry, &rows, kind, &explained(kind, view));
            }
            if shown_kinds(&rows).contains(&Kind::Weight) {
                weight_bar(m);
            }
        },
    );
    let slug = format!("{}-contributions-{}", view.slug, context.estimator_slug(entry.index));
    context.figures.push((slug, figure(view, combined, &rows, entry, context.paper())));
}

/// The combined image with its caption.
fn whole(m: &mut Markup, view: &SceneView, entry: &Entry, combined: &Image, rows: &[Row]) {
    m.tag("figure", &[("class", &"whole")], |m| {
        let picture = Picture::of(combined, view.scene.exposure, WHOLE);
        let alt = format!("{} by {}: all techniques together", view.scene.label, entry.info.label);
        shown(m, picture.as_ref(), &alt, &entry.cell.files.mean_exr, "", view);
        energy_bar(m, rows);
        m.tag("figcaption", &[], |m| {
            m.leaf("b", &[], "all techniques together");
            m.leaf("span", &[("class", &"fact")], made(view, entry));
        });
    });
}

/// What the image is made of.
fn made(view: &SceneView, entry: &Entry) -> String {
    let cell = entry.cell;
    let paths = if cell.paths == "all" { String::new() } else { format!("; paths {} alone", cell.paths) };
    format!(
        "{}: {} of {} samples per pixel and {}{paths}; the bar shows each technique's share of the image's energy",
        size_note(view, WHOLE),
        plural(cell.runs.len() as u64, "run"),
        significant(cell.spp.mean, 3),
        duration(cell.seconds.mean),
    )
}

/// What is seen in a row.
fn explained(kind: Kind, view: &SceneView) -> String {
    let what = match kind {
        Kind::Weighted => {
            "what each technique adds to the image: its contribution times its weight, at the exposure of the image above. Added \
             up pixel by pixel these are that image. Black is where a technique cannot make the paths, or leaves them to one \
             that makes them better."
        }
        Kind::Unweighted => {
            "the contribution before it is weighted, at the same exposure. Dark is what a technique cannot make or hardly ever \
             makes; speckles that are gone above are what the weights are for. A path counts once for each way in which the \
             technique makes it (a merge at any of its vertices, a connection along any of its edges), so that long paths, as in \
             milk, come to more than the image."
        }
        Kind::Weight => {
            "the mean weight of the samples of a pixel that carry light, each counted once: how far a technique is trusted with \
             the paths that it makes there. Black too where it makes none."
        }
    };
    format!("{what} ({})", size_note(view, SIDE))
}

/// The scale of the weights.
fn weight_bar(m: &mut Markup) {
    m.tag("div", &[("class", &"color-bar")], |m| {
        m.leaf("span", &[], "mean weight:");
        m.leaf("span", &[("class", &"number")], "0");
        if let Some(p) = Picture::of_scale(Scale::Linear(1.0)) {
            p.img(m, "colours of the mean weights from 0 to 1", &[]);
        }
        m.leaf("span", &[("class", &"number")], "1");
    });
}

/// Width of a technique's image in the figure.
const TILE: f64 = 150.0;

/// The figure: the combined image over the weighted contributions in one or two rows.
fn figure(view: &SceneView, combined: &Image, rows: &[Row], entry: &Entry, paper: Option<Paper>) -> String {
    let stops = view.scene.exposure;
    let columns = if rows.len() > 5 { rows.len().div_ceil(2) } else { rows.len() };
    let title = format!("{}: weighted contributions of {}", view.scene.label, entry.info.label);
    let mut montage = Montage::new(title, TILE);
    let (picture, label) = (Picture::of(combined, stops, WHOLE), entry.info.label.clone());
    montage.push(0, Tile { picture, label, ..Tile::default() });
    montage.widen(0, 0.62 * TILE * columns.max(3) as f64);
    let total = energy(combined);
    for (i, row) in rows.iter().enumerate() {
        let weighted = row.layer(Kind::Weighted);
        let share = weighted.map_or(f64::NAN, |image| energy(image) / total);
        let tile = Tile {
            picture: weighted.and_then(|image| Picture::of(image, stops, SIDE)),
            label: row.label().to_owned(),
            fact: percent(share),
            bar: row.color(),
            ..Tile::default()
        };
        // On a paper the montage wraps what is too long.
        montage.push(if paper.is_some() { 1 } else { 1 + i / columns }, tile);
    }
    montage.on(paper)
}
