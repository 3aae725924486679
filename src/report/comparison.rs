//! Images side by side: the reference and each estimator at one exposure, error maps, enlarged parts.

use super::context::{Context, Entry, SceneView, estimate};
use super::crops::{Crop, choose};
use super::insets::{self, Insets, Part};
use super::maps::{color_bar, error_map, map_scale, other_maps};
use super::markup::Markup;
use super::montage::{Montage, Tile};
use super::numbers::{count, duration, percent, plural, significant};
use super::picture::{Picture, factor};
use crate::experiment::results::{MetricInfo, Reference, ReferenceKind};
use crate::film::exr::LayeredImage;
use crate::film::false_color::Scale;
use crate::film::{Image, ScalarImage};
use crate::render::files::all_paths;

/// Images are shown whole up to this many pixels a side; larger ones are whole in the viewer.
const IMAGE_SIDE: usize = 1000;
/// Error maps of the main metric.
const MAP_SIDE: usize = 960;
/// Images of the plain strip.
const STRIP_SIDE: usize = 800;
/// Images of up to so many columns are enlarged with visible pixels.
const FEW_PIXELS: usize = 200;
/// Colours of the frames of the enlarged parts, in the image and about the part.
const CROP_COLORS: [&str; 4] = ["#e69f00", "#56b4e9", "#f0e442", "#cc79a7"];

/// The images of a scene: the reference, what one run of each estimator gives, and the maps of its error.
pub(super) struct Images {
    /// The reference, where there is one that can be read.
    pub reference: Option<Image>,
    /// An image an estimator.
    pub estimates: Vec<Option<Image>>,
    /// Error maps an estimator: a layer a metric.
    pub maps: Vec<Option<LayeredImage>>,
}

impl Images {
    /// Reads them.
    pub fn load(context: &mut Context, view: &SceneView) -> Self {
        let mut default = |path: &str| context.load(path, view.scene).and_then(|i| i.layer("").cloned());
        let reference = view.scene.reference.as_ref().and_then(|r| default(&r.exr));
        let estimates = view.entries.iter().map(|e| default(&e.cell.files.exr)).collect();
        let map =
            |e: &Entry| e.cell.files.error_exr.as_deref().and_then(|path| context.load(path, view.scene));
        Self { reference, estimates, maps: view.entries.iter().map(map).collect() }
    }
}

/// A column of the comparison.
struct Column<'a> {
    label: &'a str,
    /// Lines under the image.
    facts: Vec<String>,
    exr: &'a str,
    image: Option<&'a Image>,
    /// `None` for the reference.
    entry: Option<Entry<'a>>,
    map: Option<ScalarImage>,
}

/// The section of images.
pub(super) fn section(context: &mut Context, view: &SceneView, images: &Images, m: &mut Markup) {
    let metric = main_metric(context, view);
    let columns = columns(view, images, metric);
    let (crops, origin) = crops(view, images);
    let scale = metric.map(|k| map_scale(k, view, columns.iter().filter_map(|c| c.map.as_ref())));
    let has_maps = columns.iter().any(|c| c.map.is_some());
    let id = format!("{}-images", view.id);
    m.tag("section", &[("id", &id), ("class", &"images")], |m| {
        m.leaf("h3", &[], "Images");
        m.leaf("p", &[("class", &"note")], note(view, context.results.runs));
        let rows = 2 + usize::from(has_maps) + usize::from(!crops.is_empty());
        let style = format!("--columns:{};--rows:{rows}", columns.len());
        let label = format!("images of {} side by side", view.scene.label);
        m.region(&[("class", &"scroll")], &label, |m| {
            m.tag("div", &[("class", &"columns"), ("style", &style)], |m| {
                for column in &columns {
                    column_of(m, view, column, &crops, has_maps, metric.zip(scale));
                }
            });
        });
        if let Some((metric, scale)) = metric.zip(scale).filter(|_| has_maps) {
            color_bar(m, metric, scale);
        }
        if !crops.is_empty() {
            m.leaf("p", &[("class", &"note")], origin);
        }
        other_maps(context.results, view, images, metric, m);
    });
    if !crops.is_empty() {
        let figure = crops_figure(view, &columns, &crops, metric, context.results.runs).svg(context.paper());
        context.figures.push((format!("{}-crops", view.slug), figure));
    }
}

/// The images of all estimators in a row, without more.
pub(super) fn strip(context: &mut Context, view: &SceneView, images: &Images, m: &mut Markup) {
    let id = format!("{}-strip", view.id);
    let mut montage = Montage::new(format!("{}: the estimators in a row", view.scene.label), 240.0);
    m.tag("section", &[("id", &id), ("class", &"images")], |m| {
        m.leaf("h3", &[], "In a row");
        let style = format!("--columns:{}", view.entries.len());
        m.region(&[("class", &"scroll")], &"estimators in a row", |m| {
            m.tag("div", &[("class", &"row"), ("style", &style)], |m| {
                for (entry, image) in view.entries.iter().zip(&images.estimates) {
                    let picture =
                        image.as_ref().and_then(|i| Picture::of(i, view.scene.exposure, STRIP_SIDE));
                    let fact = format!("{} spp, {}", samples(entry), duration(entry.cell.seconds.mean));
                    m.tag("figure", &[], |m| {
                        let alt = format!("{} by {}, {fact}", view.scene.label, entry.info.label);
                        shown(m, picture.as_ref(), &alt, &entry.cell.files.exr, "", view);
                        m.tag("figcaption", &[], |m| {
                            m.leaf("b", &[], &entry.info.label);
                            m.leaf("span", &[("class", &"fact")], &fact);
                        });
                    });
                    montage
                        .push(0, Tile { picture, label: entry.info.label.clone(), fact, ..Tile::default() });
                }
            });
        });
    });
    context.figures.push((format!("{}-strip", view.slug), montage.on(context.paper())));
}

/// The metric whose maps stand under the images: the first that has them here.
fn main_metric<'a>(context: &Context<'a>, view: &SceneView) -> Option<&'a MetricInfo> {
    let metrics = &context.results.metrics;
    let mapped = |k: &&MetricInfo| k.map_scale.contains_key(&view.scene.key);
    metrics.iter().find(mapped).or(metrics.first()).filter(|_| view.scene.reference.is_some())
}

fn columns<'a>(view: &SceneView<'a>, images: &'a Images, metric: Option<&MetricInfo>) -> Vec<Column<'a>> {
    let mut out = Vec::new();
    if let Some(reference) = &view.scene.reference {
        out.push(Column {
            label: "Reference",
            facts: reference_facts(reference),
            exr: &reference.exr,
            image: images.reference.as_ref(),
            entry: None,
            map: None,
        });
    }
    for ((entry, image), maps) in view.entries.iter().zip(&images.estimates).zip(&images.maps) {
        out.push(Column {
            label: &entry.info.label,
            facts: estimate_facts(entry, metric),
            exr: &entry.cell.files.exr,
            image: image.as_ref(),
            entry: Some(*entry),
            map: metric.and_then(|k| error_map(maps.as_ref()?, &k.key)),
        });
    }
    out
}

/// Mean samples per pixel of a run.
fn samples(entry: &Entry) -> String {
    let spp = entry.cell.spp.mean;
    if spp.fract() == 0.0 { count(spp as u64) } else { significant(spp, 3) }
}

fn estimate_facts(entry: &Entry, metric: Option<&MetricInfo>) -> Vec<String> {
    let mut out = vec![format!("{} spp · {}", samples(entry), duration(entry.cell.seconds.mean))];
    if let Some(k) = metric {
        let value = entry.cell.metric(&k.key).map_or("not measured".into(), |v| estimate(&v));
        out.push(format!("{} {value}", k.label));
    }
    out
}

fn reference_facts(reference: &Reference) -> Vec<String> {
    let mut first = match &reference.kind {
        ReferenceKind::File(path) => vec![format!("file {path}")],
        ReferenceKind::Estimator(key) => vec![format!("rendered by {key}")],
    };
    if let Some(paths) = reference.paths.as_deref().filter(|p| *p != all_paths()) {
        first.push(format!("paths {paths}"));
    }
    let mut second = Vec::new();
    if let Some(spp) = reference.spp {
        second.push(format!("{} spp", count(spp)));
    }
    if let Some(seconds) = reference.seconds {
        second.push(duration(seconds));
    }
    if reference.partial {
        first.push("still short of its budget".into());
    }
    let mut out = vec![first.join(", ")];
    if !second.is_empty() {
        out.insert(0, second.join(" · "));
    }
    out
}

fn note(view: &SceneView, runs: u32) -> String {
    let scene = view.scene;
    let factor = factor(scene.width, scene.height, IMAGE_SIDE);
    let size = if factor > 1 {
        format!("{}×{} pixels, here at 1/{factor} of their size", scene.width, scene.height)
    } else {
        format!("{}×{} pixels", scene.width, scene.height)
    };
    let which = if runs > 1 {
        " Each estimator's image is that of its first run; numbers are means over the runs."
    } else {
        ""
    };
    format!(
        "{size}, sRGB at {} stops for all; a pixel that is not finite is magenta.{which}",
        signed(scene.exposure)
    )
}

pub(super) fn signed(stops: f32) -> String {
    format!("{stops:+.1}").replace('-', "−")
}

/// The parts to enlarge, and a line on where they come from.
fn crops(view: &SceneView, images: &Images) -> (Vec<(String, Crop)>, String) {
    let letter = |i: usize| char::from(b'A' + (i % 26) as u8).to_string();
    let (width, height) = (view.scene.width, view.scene.height);
    if !view.scene.crops.is_empty() {
        let stated = view.scene.crops.iter().filter_map(|c| {
            let crop = Crop { x: c.x, y: c.y, width: c.width, height: c.height }.within(width, height)?;
            Some((c.name.clone(), crop))
        });
        let crops: Vec<_> = stated
            .enumerate()
            .map(|(i, (name, c))| {
                (if name.is_empty() { letter(i) } else { format!("{}: {name}", letter(i)) }, c)
            })
            .collect();
        let text = format!("Enlarged parts as the experiment names them: {}.", places(&crops));
        return (crops, text);
    }
    let Some(reference) = &images.reference else { return (Vec::new(), String::new()) };
    let estimates: Vec<&Image> = images.estimates.iter().flatten().collect();
    let chosen = choose(reference, &estimates, view.scene.exposure, 2);
    let crops: Vec<_> = chosen.into_iter().enumerate().map(|(i, c)| (letter(i), c)).collect();
    let why = if estimates.len() > 1 { "the estimators' errors differ most" } else { "the error is largest" };
    let why = format!("{why} and the reference is not uniform");
    let text = format!("Enlarged parts chosen automatically, where {why}: {}.", places(&crops));
    (crops, text)
}

fn places(crops: &[(String, Crop)]) -> String {
    let place =
        |(name, c): &(String, Crop)| format!("{name} at ({}, {}), {}×{} pixels", c.x, c.y, c.width, c.height);
    crops.iter().map(place).collect::<Vec<_>>().join("; ")
}

/// An image, or a note that it is not there.
pub(super) fn shown(
    m: &mut Markup,
    picture: Option<&Picture>,
    alt: &str,
    exr: &str,
    layer: &str,
    view: &SceneView,
) {
    match picture {
        // Few pixels are shown as what they are, not blurred into more.
        Some(p) if view.scene.width <= FEW_PIXELS => {
            p.img(m, alt, &[("class", &"pixels"), ("data-exr", &exr), ("data-layer", &layer)]);
        }
        Some(p) => p.img(m, alt, &[("data-exr", &exr), ("data-layer", &layer)]),
        None => {
            let style = format!("aspect-ratio:{}/{}", view.scene.width.max(1), view.scene.height.max(1));
            m.leaf("div", &[("class", &"absent"), ("style", &style)], "image missing");
        }
    }
}

fn column_of(
    m: &mut Markup,
    view: &SceneView,
    column: &Column,
    crops: &[(String, Crop)],
    has_maps: bool,
    metric: Option<(&MetricInfo, f32)>,
) {
    let key = column.entry.map_or("reference", |e| e.info.key.as_str());
    m.tag("figure", &[("class", &"column"), ("data-estimator", &key)], |m| {
        m.tag("div", &[("class", &"frame")], |m| {
            let picture = column.image.and_then(|i| Picture::of(i, view.scene.exposure, IMAGE_SIDE));
            let alt = format!("{}: {}, {}", view.scene.label, column.label, column.facts.join(", "));
            shown(m, picture.as_ref(), &alt, column.exr, "", view);
            if column.image.is_some() {
                crops.iter().enumerate().for_each(|(i, (_, c))| crop_mark(m, view, i, c));
            }
        });
        m.tag("figcaption", &[], |m| {
            m.tag("b", &[], |m| {
                if let Some(entry) = column.entry {
                    swatch(m, entry.index);
                }
                m.text(column.label);
            });
            column.facts.iter().for_each(|f| m.leaf("span", &[("class", &"fact")], f));
        });
        if has_maps {
            map_cell(m, column, metric);
        }
        if !crops.is_empty() {
            m.tag("div", &[("class", &"crops")], |m| {
                for (i, (name, crop)) in crops.iter().enumerate() {
                    crop_cell(m, view, column, i, name, crop);
                }
            });
        }
    });
    m.newline();
}

/// The small square in an estimator's colour.
pub(super) fn swatch(m: &mut Markup, index: usize) {
    let style = format!("background:var(--series-{index})");
    m.tag("span", &[("class", &"swatch"), ("style", &style)], |_| {});
}

fn crop_mark(m: &mut Markup, view: &SceneView, i: usize, c: &Crop) {
    let share = |a: usize, b: usize| 100.0 * a as f64 / b.max(1) as f64;
    let (w, h) = (view.scene.width, view.scene.height);
    let style = format!(
        "left:{:.2}%;top:{:.2}%;width:{:.2}%;height:{:.2}%;--mark:{}",
        share(c.x, w),
        share(c.y, h),
        share(c.width, w),
        share(c.height, h),
        CROP_COLORS[i % CROP_COLORS.len()]
    );
    m.tag("span", &[("class", &"mark"), ("style", &style), ("aria-hidden", &true)], |_| {});
}

fn map_cell(m: &mut Markup, column: &Column, metric: Option<(&MetricInfo, f32)>) {
    m.tag("div", &[("class", &"map")], |m| {
        let Some((metric, scale)) = metric else { return };
        let Some(map) = &column.map else {
            let text = if column.entry.is_none() { "error maps →" } else { "no error map" };
            return m.leaf("span", &[("class", &"quiet")], text);
        };
        let alt = format!(
            "{} of {} in false colour from 0 to {}",
            metric.label,
            column.label,
            significant(f64::from(scale), 2)
        );
        let exr = column.entry.and_then(|e| e.cell.files.error_exr.as_deref()).unwrap_or_default();
        match Picture::of_map(map, Scale::Linear(scale), MAP_SIDE) {
            Some(p) => {
                p.img(m, &alt, &[("data-exr", &exr), ("data-layer", &metric.key), ("data-scale", &scale)])
            }
            None => m.leaf("span", &[("class", &"quiet")], "no error map"),
        }
    });
}

fn crop_cell(m: &mut Markup, view: &SceneView, column: &Column, i: usize, name: &str, crop: &Crop) {
    let style = format!("--mark:{}", CROP_COLORS[i % CROP_COLORS.len()]);
    m.tag("div", &[("class", &"crop"), ("style", &style)], |m| {
        let alt = format!("part {name} of {}, enlarged", column.label);
        let place = format!("{},{},{},{}", crop.x, crop.y, crop.width, crop.height);
        match crop_picture(column, crop, view.scene.exposure) {
            Some(p) => p.img(m, &alt, &[("data-exr", &column.exr), ("data-crop", &place)]),
            None => m.leaf("span", &[("class", &"quiet")], "image missing"),
        }
        m.leaf("span", &[("class", &"letter"), ("aria-hidden", &true)], name);
    });
}

fn crop_picture(column: &Column, crop: &Crop, stops: f32) -> Option<Picture> {
    let part = column.image?.crop(crop.x, crop.y, crop.width, crop.height).ok()?;
    Picture::of(&part, stops, IMAGE_SIDE)
}

/// The first image with frames about the parts, and beside it these enlarged of every image, as a figure of its own; under each part
/// its own error, where there are maps of it.
fn crops_figure(
    view: &SceneView,
    columns: &[Column],
    crops: &[(String, Crop)],
    metric: Option<&MetricInfo>,
    runs: u32,
) -> Insets {
    let (width, height) = (view.scene.width as f64, view.scene.height as f64);
    let exposure = view.scene.exposure;
    let first = columns.iter().find_map(|c| c.image);
    let letter = |name: &str| name.split(':').next().unwrap_or_default().to_owned();
    let part = |(i, (name, c)): (usize, &(String, Crop))| {
        let [x, y, w, h] = [c.x, c.y, c.width, c.height].map(|v| v as f64);
        let color = CROP_COLORS[i % CROP_COLORS.len()];
        let place = [x / width, y / height, w / width, h / height];
        Part { letter: letter(name), place, color, shape: h / w }
    };
    let error = |map: &ScalarImage, crop: &Crop| {
        let rows = crop.y..crop.y + crop.height;
        let values = rows.flat_map(|y| &map.values[y * map.width + crop.x..][..crop.width]);
        let sum: f64 = values.map(|v| f64::from(*v)).sum();
        significant(sum / (crop.width * crop.height) as f64, 3)
    };
    let cell = |column: &Column, crop: &Crop| {
        let text = column.map.as_ref().map_or(String::new(), |map| error(map, crop));
        (crop_picture(column, crop, exposure), text)
    };
    let names: Vec<String> =
        crops.iter().filter(|(n, _)| n.contains(':')).map(|(n, _)| n.replacen(": ", "\u{a0}", 1)).collect();
    let mut note = if names.is_empty() { String::new() } else { format!("{}. ", names.join(", ")) };
    if let Some(metric) = metric.filter(|_| columns.iter().any(|c| c.map.is_some())) {
        let mean = if runs > 1 { format!(", mean of {}", plural(runs.into(), "run")) } else { String::new() };
        note.push_str(&format!("Under each part: its {}{mean}.", metric.label));
    }
    Insets {
        title: format!("{}: enlarged parts", view.scene.label),
        // Its parts are in a column with a name: here the scene's is what is not said yet.
        whole: first.and_then(|i| Some((Picture::of(i, exposure, IMAGE_SIDE)?, view.scene.label.clone()))),
        note,
        parts: crops.iter().enumerate().map(part).collect(),
        columns: columns
            .iter()
            .map(|c| insets::Column {
                label: c.label.to_owned(),
                cells: crops.iter().map(|(_, crop)| cell(c, crop)).collect(),
            })
            .collect(),
    }
}

/// Share of the light: `45.7 % of the energy`.
pub(super) fn energy(share: f64) -> String {
    format!("{} of the energy", percent(share))
}
