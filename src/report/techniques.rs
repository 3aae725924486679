//! The technique strip: what each technique contributes to an estimator's image.

use super::comparison::{energy as energy_text, shown};
use super::context::{Context, Entry, SceneView};
use super::layers::{Group, energy, families, name};
use super::markup::Markup;
use super::montage::{Montage, Tile};
use super::numbers::significant;
use super::picture::{Picture, factor};
use crate::film::Image;
use crate::film::exr::LayeredImage;
use crate::transport::technique::{TECHNIQUES, TechniqueInfo};
use rayon::prelude::*;

/// Images of the strip are at most so large; the combined one twice that.
const SIDE: usize = 400;

/// A technique's layers in an image.
struct Row<'a> {
    key: String,
    info: Option<&'static TechniqueInfo>,
    weighted: Option<&'a Image>,
    unweighted: Option<&'a Image>,
    /// Both as they are shown.
    pictures: [Option<Picture>; 2],
    /// Share of the combined image's energy.
    share: f64,
}

impl Row<'_> {
    fn label(&self) -> &str {
        self.info.map_or(&self.key, |i| i.label)
    }

    fn symbol(&self) -> &str {
        self.info.map_or("", |i| i.symbol)
    }

    /// Weighted over unweighted energy: the mean weight, each path counted by what it carries.
    fn mean_weight(&self) -> Option<f64> {
        let ratio = energy(self.weighted?) / energy(self.unweighted?);
        ratio.is_finite().then_some(ratio)
    }
}

/// The strip of an estimator with technique layers; nothing for others.
pub(super) fn strip(
    context: &mut Context,
    view: &SceneView,
    entry: &Entry,
    layers: &LayeredImage,
    m: &mut Markup,
) {
    let keys = families(layers);
    let Some(combined) = layers.layer("").filter(|_| !keys.is_empty()) else { return };
    let total = energy(combined);
    let stops = view.scene.exposure;
    let rows: Vec<Row> = keys
        .into_par_iter()
        .map(|key| {
            let group = Group::Family(key.clone());
            let weighted = layers.layer(&name(&group, true));
            let unweighted = layers.layer(&name(&group, false));
            Row {
                info: TECHNIQUES.iter().find(|t| t.key == key),
                pictures: [weighted, unweighted].map(|i| Picture::of(i?, stops, SIDE)),
                share: weighted.map_or(f64::NAN, |i| energy(i) / total),
                weighted,
                unweighted,
                key,
            }
        })
        .collect();
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
                images_row(m, view, entry, &rows, true);
                if shows_unweighted(&rows) {
                    images_row(m, view, entry, &rows, false);
                }
            });
        });
    });
    let figure = figure(entry, view, combined, &rows);
    let slug = context.estimator_slug(entry.index);
    context.figures.push((format!("{}-techniques-{slug}", view.slug), figure));
}

/// A technique that is alone has weight 1: both images are the same.
fn shows_unweighted(rows: &[Row]) -> bool {
    rows.len() > 1 && rows.iter().any(|r| r.unweighted.is_some())
}

/// Says so where images are shrunk.
fn size_note(view: &SceneView, most: usize) -> String {
    match factor(view.scene.width, view.scene.height, most) {
        1 => "mean over the runs".into(),
        factor => format!("mean over the runs, at 1/{factor} of its size"),
    }
}

/// Shares of the energy as a bar in the techniques' colours.
fn energy_bar(m: &mut Markup, rows: &[Row]) {
    m.tag("div", &[("class", &"energy-bar"), ("aria-hidden", &true)], |m| {
        for row in rows.iter().filter(|r| r.share.is_finite() && r.share > 0.0) {
            let color = row.info.map_or("var(--quiet)", |i| i.color);
            let style = format!("flex-grow:{:.4};background:{color}", row.share);
            m.tag("span", &[("style", &style), ("title", &row.label())], |_| {});
        }
    });
}

fn images_row(m: &mut Markup, view: &SceneView, entry: &Entry, rows: &[Row], weighted: bool) {
    let style = format!("--columns:{}", rows.len().max(2));
    let (title, what) = if weighted {
        ("Weighted", "each times its weight: together they are the image")
    } else {
        ("Unweighted", "each as it would be alone, on the paths that it can make")
    };
    m.tag("div", &[("class", &if weighted { "weighted-row" } else { "unweighted-row" })], |m| {
        m.tag("p", &[("class", &"row-title")], |m| {
            m.leaf("b", &[], title);
            m.text(format!(" – {what}; {}", size_note(view, SIDE)));
        });
        m.tag("div", &[("class", &"row"), ("style", &style)], |m| {
            for row in rows {
                let picture = &row.pictures[usize::from(!weighted)];
                m.tag("figure", &[("data-technique", &row.key)], |m| {
                    let layer = name(&Group::Family(row.key.clone()), weighted);
                    let alt = format!("{} of {}, {title}", row.label(), entry.info.label);
                    shown(m, picture.as_ref(), &alt, &entry.cell.files.mean_exr, &layer, view);
                    m.tag("figcaption", &[], |m| caption(m, row, weighted));
                });
            }
        });
    });
}

fn caption(m: &mut Markup, row: &Row, weighted: bool) {
    m.tag("b", &[], |m| {
        let style = format!("background:{}", row.info.map_or("var(--quiet)", |i| i.color));
        m.tag("span", &[("class", &"swatch"), ("style", &style)], |_| {});
        m.text(row.label());
    });
    m.leaf("span", &[("class", &"symbol")], row.symbol());
    if weighted {
        m.leaf("span", &[("class", &"fact")], energy_text(row.share));
    } else if let Some(weight) = row.mean_weight() {
        m.leaf("span", &[("class", &"fact")], format!("mean weight {}", significant(weight, 2)));
    }
}

fn figure(entry: &Entry, view: &SceneView, combined: &Image, rows: &[Row]) -> String {
    let mut montage =
        Montage::new(format!("{}: techniques of {}", view.scene.label, entry.info.label), 170.0);
    let stops = view.scene.exposure;
    let tile = |picture: Option<Picture>, label: &str, fact: String| Tile {
        picture,
        label: label.to_owned(),
        fact,
        pixelated: false,
    };
    montage.push(0, tile(Picture::of(combined, stops, SIDE), &entry.info.label, String::new()));
    for row in rows {
        montage.push(1, tile(row.pictures[0].clone(), row.label(), energy_text(row.share)));
    }
    montage.name_row(1, "weighted");
    if shows_unweighted(rows) {
        for row in rows {
            let fact =
                row.mean_weight().map_or(String::new(), |w| format!("mean weight {}", significant(w, 2)));
            montage.push(2, tile(row.pictures[1].clone(), row.label(), fact));
        }
        montage.name_row(2, "unweighted");
    }
    montage.svg()
}
