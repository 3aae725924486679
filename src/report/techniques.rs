//! The technique strip: what each technique contributes to an estimator's image.

use super::comparison::{energy as energy_text, shown};
use super::context::{Context, Entry, SceneView};
use super::layers::{Group, Kind, energy, families, name};
use super::markup::Markup;
use super::montage::{Montage, ScaleBar, Tile};
use super::numbers::significant;
use super::paper::Paper;
use super::picture::{Picture, factor};
use crate::film::exr::LayeredImage;
use crate::film::false_color::Scale;
use crate::film::{Image, ScalarImage};
use crate::transport::technique::{TECHNIQUES, TechniqueInfo};
use rayon::prelude::*;

/// Images of the strip are at most so large; the combined one twice that.
const SIDE: usize = 400;

/// The kinds of layers, in the order of the rows.
pub(super) const KINDS: [Kind; 3] = [Kind::Weighted, Kind::Unweighted, Kind::Weight];

/// A technique's layers in an image.
pub(super) struct Row<'a> {
    pub key: String,
    pub info: Option<&'static TechniqueInfo>,
    /// By [`KINDS`].
    layers: [Option<&'a Image>; 3],
    /// As they are shown.
    pictures: [Option<Picture>; 3],
    /// Share of the combined image's energy.
    pub share: f64,
    /// The same of the unweighted contribution, in which a path counts once for each (s, t) that the technique makes it by:
    /// it may be more than 1.
    unweighted: f64,
}

impl<'a> Row<'a> {
    pub fn label(&self) -> &str {
        self.info.map_or(&self.key, |i| i.label)
    }

    fn symbol(&self) -> &str {
        self.info.map_or("", |i| i.symbol)
    }

    /// Of the technique, where it is known.
    pub fn color(&self) -> Option<&'static str> {
        self.info.map(|i| i.color)
    }

    /// The same for the page.
    fn ink(&self) -> &'static str {
        self.color().unwrap_or("var(--quiet)")
    }

    pub fn layer(&self, kind: Kind) -> Option<&'a Image> {
        self.layers[place(kind)]
    }

    /// What is written under an image of the row.
    fn fact(&self, kind: Kind) -> String {
        match kind {
            Kind::Weighted => energy_text(self.share),
            Kind::Unweighted => energy_text(self.unweighted),
            Kind::Weight => self
                .mean_weight()
                .map_or("no samples".into(), |w| format!("mean weight {}", significant(w, 2))),
        }
    }

    /// The mean of the mean weights over the pixels that have samples.
    fn mean_weight(&self) -> Option<f64> {
        let weights = self.layer(Kind::Weight)?.pixels.iter().map(|p| f64::from(p[0])).filter(|w| *w > 0.0);
        let (sum, count) = weights.fold((0.0, 0.0), |(sum, n), w| (sum + w, n + 1.0));
        (count > 0.0).then_some(sum / count)
    }
}

fn place(kind: Kind) -> usize {
    KINDS.iter().position(|k| *k == kind).expect("every kind is there")
}

/// The techniques of an image with layers, by the order of the table, but for those that made nothing, as they were left out or had
/// nothing to do; contributions at 2^`stops`, images at most `side`
/// pixels wide and high.
pub(super) fn rows<'a>(layers: &'a LayeredImage, combined: &Image, stops: f32, side: usize) -> Vec<Row<'a>> {
    let total = energy(combined);
    let row = |key: String| {
        let group = Group::Family(key.clone());
        let images = KINDS.map(|kind| layers.layer(&name(&group, kind)));
        let share = |kind| images[place(kind)].map_or(f64::NAN, |i: &Image| energy(i) / total);
        let show = |kind| match kind {
            Kind::Weight => weight_picture(images[place(kind)]?, side),
            _ => Picture::of(images[place(kind)]?, stops, side),
        };
        Row {
            info: TECHNIQUES.iter().find(|t| t.key == key),
            pictures: KINDS.map(show),
            share: share(Kind::Weighted),
            unweighted: share(Kind::Unweighted),
            layers: images,
            key,
        }
    };
    let made = |row: &Row| row.share != 0.0 || row.unweighted != 0.0;
    families(layers).into_par_iter().map(row).filter(made).collect()
}

/// Weights in false colour from 0 to 1.
fn weight_picture(weights: &Image, side: usize) -> Option<Picture> {
    let values = weights.pixels.iter().map(|p| p[0]).collect();
    let map = ScalarImage { width: weights.width, height: weights.height, values };
    Picture::of_map(&map, Scale::Linear(1.0), side)
}

/// The strip of an estimator with technique layers; nothing for others.
pub(super) fn strip(
    context: &mut Context,
    view: &SceneView,
    entry: &Entry,
    layers: &LayeredImage,
    m: &mut Markup,
) {
    let stops = view.scene.exposure;
    let Some(combined) = layers.layer("") else { return };
    let rows = rows(layers, combined, stops, SIDE);
    if rows.is_empty() {
        return;
    }
    let id = format!("{}-techniques-{}", view.id, context.estimator_slug(entry.index));
    m.tag("article", &[("id", &id), ("class", &"strip"), ("data-estimator", &entry.info.key)], |m| {
        m.leaf("h4", &[], &entry.info.label);
        m.tag("div", &[("class", &"strip-body")], |m| {
            m.tag("figure", &[("class", &"combined")], |m| {
                let picture = Picture::of(combined, stops, 2 * SIDE);
                let alt = format!("{}: all techniques together", entry.info.label);
                shown(m, picture.as_ref(), &alt, &entry.cell.files.mean_exr, "", view);
                m.tag("figcaption", &[], |m| {
                    m.leaf("b", &[], "all techniques");
                    m.leaf("span", &[("class", &"fact")], size_note(view, 2 * SIDE));
                });
                energy_bar(m, &rows);
            });
            m.tag("div", &[("class", &"strip-rows")], |m| {
                for kind in shown_kinds(&rows) {
                    images_row(m, view, entry, &rows, kind, &explained(kind, view));
                }
            });
        });
    });
    let figure = figure(entry, view, combined, &rows, context.paper());
    let slug = context.estimator_slug(entry.index);
    context.figures.push((format!("{}-techniques-{slug}", view.slug), figure));
}

/// The kinds of images that say something: a technique that is alone has weight 1, and both its images are the same.
pub(super) fn shown_kinds(rows: &[Row]) -> Vec<Kind> {
    let says = |kind: &Kind| {
        *kind == Kind::Weighted || rows.len() > 1 && rows.iter().any(|r| r.layer(*kind).is_some())
    };
    KINDS.into_iter().filter(says).collect()
}

/// In short what a row of a strip is.
fn explained(kind: Kind, view: &SceneView) -> String {
    let what = match kind {
        Kind::Weighted => "each times its weight: together they are the image",
        Kind::Unweighted => "before that: a path counts once for each (s, t) by which the technique makes it",
        Kind::Weight => "over the samples of a pixel, black 0 to light yellow 1",
    };
    format!("{what}; {}", size_note(view, SIDE))
}

/// Says so where images are shrunk.
pub(super) fn size_note(view: &SceneView, most: usize) -> String {
    match factor(view.scene.width, view.scene.height, most) {
        1 => "mean over the runs".into(),
        factor => format!("mean over the runs, at 1/{factor} of its size"),
    }
}

/// Shares of the energy as a bar in the techniques' colours.
pub(super) fn energy_bar(m: &mut Markup, rows: &[Row]) {
    m.tag("div", &[("class", &"energy-bar"), ("aria-hidden", &true)], |m| {
        for row in rows.iter().filter(|r| r.share.is_finite() && r.share > 0.0) {
            let style = format!("flex-grow:{:.4};background:{}", row.share, row.ink());
            m.tag("span", &[("style", &style), ("title", &row.label())], |_| {});
        }
    });
}

/// One kind of image of every technique in a row, with a title and what the row shows.
pub(super) fn images_row(
    m: &mut Markup,
    view: &SceneView,
    entry: &Entry,
    rows: &[Row],
    kind: Kind,
    explanation: &str,
) {
    let style = format!("--columns:{}", rows.len().max(2));
    let (title, class) = match kind {
        Kind::Weighted => ("Weighted", "weighted-row"),
        Kind::Unweighted => ("Unweighted", "unweighted-row"),
        Kind::Weight => ("Mean weight", "weight-row"),
    };
    m.tag("div", &[("class", &class)], |m| {
        m.tag("p", &[("class", &"row-title")], |m| {
            m.leaf("b", &[], title);
            m.text(format!(" – {explanation}"));
        });
        let label = format!("{title}: a technique an image");
        m.region(&[("class", &"row"), ("style", &style)], &label, |m| {
            for row in rows {
                let picture = &row.pictures[place(kind)];
                m.tag("figure", &[("data-technique", &row.key)], |m| {
                    let layer = name(&Group::Family(row.key.clone()), kind);
                    let alt = format!("{} of {}, {title}", row.label(), entry.info.label);
                    shown(m, picture.as_ref(), &alt, &entry.cell.files.mean_exr, &layer, view);
                    m.tag("figcaption", &[], |m| caption(m, row, kind));
                });
            }
        });
    });
}

fn caption(m: &mut Markup, row: &Row, kind: Kind) {
    m.tag("b", &[], |m| {
        let style = format!("background:{}", row.ink());
        m.tag("span", &[("class", &"swatch"), ("style", &style)], |_| {});
        m.text(row.label());
    });
    m.leaf("span", &[("class", &"symbol")], row.symbol());
    m.leaf("span", &[("class", &"fact")], row.fact(kind));
}

/// The same as a figure of its own.
fn figure(entry: &Entry, view: &SceneView, combined: &Image, rows: &[Row], paper: Option<Paper>) -> String {
    let mut montage =
        Montage::new(format!("{}: techniques of {}", view.scene.label, entry.info.label), 170.0);
    let stops = view.scene.exposure;
    let tile = |picture: Option<Picture>, label: &str, fact: String| Tile {
        picture,
        label: label.to_owned(),
        fact,
        ..Tile::default()
    };
    montage.push(0, tile(Picture::of(combined, stops, SIDE), &entry.info.label, String::new()));
    for (line, kind) in shown_kinds(rows).into_iter().enumerate() {
        for row in rows {
            let tile = tile(row.pictures[place(kind)].clone(), row.label(), row.fact(kind));
            let tile = Tile { bar: row.color(), ..tile };
            montage.push(line + 1, tile);
        }
        montage.name_row(line + 1, ["weighted", "unweighted", "mean weight"][place(kind)]);
        if kind == Kind::Weight
            && let Some(ramp) = Picture::of_scale(Scale::Linear(1.0))
        {
            montage.scale_row(line + 1, ScaleBar { ramp, ends: ["0".into(), "1".into()] });
        }
    }
    montage.on(paper)
}
