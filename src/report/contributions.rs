//! The figure of weighted contributions: the combined image over what each technique adds to it [Křivánek et al. 2014,
//! figure 1], and under that the contributions before they are weighted, and the weights.

use super::comparison::shown;
use super::context::{Context, Entry, SceneView};
use super::layers::{Kind, energy};
use super::markup::Markup;
use super::numbers::{duration, percent, plural, significant};
use super::picture::{Picture, displayed};
use super::raster::{Canvas, LEADING, lines, rgb};
use super::techniques::{Row, energy_bar, images_row, rows, shown_kinds, size_note};
use crate::film::exr::LayeredImage;
use crate::film::false_color::Scale;
use crate::film::png::DisplayImage;
use crate::film::{Image, ScalarImage};

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
    context.pictures.push((slug, picture(&layers, combined, &rows, entry, stops)));
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
    let ramp = ScalarImage { width: 256, height: 1, values: (0..256).map(|i| i as f32 / 255.0).collect() };
    m.tag("div", &[("class", &"color-bar")], |m| {
        m.leaf("span", &[], "mean weight:");
        m.leaf("span", &[("class", &"number")], "0");
        if let Some(p) = Picture::of_map(&ramp, Scale::Linear(1.0), 256) {
            p.img(m, "colours of the mean weights from 0 to 1", &[]);
        }
        m.leaf("span", &[("class", &"number")], "1");
    });
}

/// Space about images in the PNG.
const GAP: usize = 8;
/// Tiles of the PNG are not made narrower than this by shrinking.
const TILE: usize = 140;
const TEXT: [u8; 3] = [0x1b, 0x1f, 0x24];
const QUIET: [u8; 3] = [0x59, 0x63, 0x6e];

/// The figure as an image: the combined one over the weighted contributions in one or two rows.
fn picture(layers: &LayeredImage, combined: &Image, rows: &[Row], entry: &Entry, stops: f32) -> DisplayImage {
    debug_assert_eq!((layers.width, layers.height), (combined.width, combined.height));
    let columns = if rows.len() > 5 { rows.len().div_ceil(2) } else { rows.len() };
    let shrink = (combined.width / TILE).clamp(1, columns);
    let side = combined.width.max(combined.height).div_ceil(shrink);
    let tiles: Vec<DisplayImage> = rows
        .iter()
        .map(|row| match row.layer(Kind::Weighted) {
            Some(image) => displayed(image, stops, side),
            None => displayed(&Image::new(combined.width, combined.height), stops, side),
        })
        .collect();
    let (tile_width, tile_height) = (tiles[0].width, tiles[0].height);
    let strip = columns * (tile_width + GAP) - GAP;
    let enlarge = (3 * strip / 5 / combined.width).max(1);
    let main = displayed(combined, stops, usize::MAX);
    let width = strip.max(main.width * enlarge) + 2 * GAP;
    let face = if tile_width >= 130 { 2 } else { 1 };
    let labels: Vec<Vec<String>> = rows.iter().map(|r| lines(r.label(), face, tile_width)).collect();
    let line = LEADING * face;
    let top = GAP + main.height * enlarge + 2 * GAP + line;
    // Where each line of tiles starts, and where the last one ends.
    let mut starts = vec![top];
    for labels in labels.chunks(columns) {
        let words = labels.iter().map(Vec::len).max().unwrap_or(0) + 1;
        starts.push(starts.last().expect("there is one") + tile_height + words * line + 2 * GAP);
    }
    let height = *starts.last().expect("there is one");
    let mut canvas = Canvas::new(width, height, [255; 3]);
    canvas.draw(&main, [(width - main.width * enlarge) / 2, GAP], enlarge);
    canvas.text(&entry.info.label, [width / 2, GAP + main.height * enlarge + GAP], face, TEXT);
    let total = energy(combined);
    for (i, (row, tile)) in rows.iter().zip(&tiles).enumerate() {
        let in_line = columns.min(rows.len() - i / columns * columns);
        let left = (width - (in_line * (tile_width + GAP) - GAP)) / 2 + i % columns * (tile_width + GAP);
        let y = starts[i / columns];
        canvas.draw(tile, [left, y], 1);
        canvas.fill([left, y + tile_height], [tile_width, 3], rgb(row.color()));
        let mut y = y + tile_height + GAP;
        for words in &labels[i] {
            canvas.text(words, [left + tile_width / 2, y], face, TEXT);
            y += line;
        }
        let share = row.layer(Kind::Weighted).map_or(f64::NAN, |image| energy(image) / total);
        canvas.text(&percent(share), [left + tile_width / 2, y], face, QUIET);
    }
    canvas.finish()
}
