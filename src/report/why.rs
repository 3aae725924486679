//! Why the numbers are as they are: what each technique adds, causes and costs, and where variance and bias lie.

use super::comparison::{shown, swatch};
use super::context::{Context, Entry, SceneView, estimate};
use super::markup::Markup;
use super::montage::{Montage, ScaleBar, Tile};
use super::numbers::{percent, significant};
use super::paper::Paper;
use super::picture::Picture;
use crate::experiment::results::{Estimate, Run, TechniqueShare};
use crate::explain::{Largest, command, largest};
use crate::film::exr::LayeredImage;
use crate::film::false_color::Scale;
use crate::film::{Image, ScalarImage};
use crate::render::LEFT_OUT;
use crate::transport::technique::TECHNIQUES;

/// Maps are at most so large.
const SIDE: usize = 400;
/// The share of a map's values that lies within its scale.
const QUANTILE: f64 = 0.99;
/// So many of the largest samples of a run are listed.
const LARGEST: usize = 5;

/// The section; nothing where there is nothing to tell.
pub(super) fn section(context: &mut Context, view: &SceneView, m: &mut Markup) {
    let told: Vec<&Entry> = view.entries.iter().filter(|e| !e.cell.techniques.is_empty()).collect();
    let maps: Vec<(&Entry, LayeredImage)> = view
        .entries
        .iter()
        .filter_map(|e| Some((e, context.load(e.cell.files.statistics_exr.as_deref()?, view.scene)?)))
        .collect();
    let samples: Vec<(&Entry, Vec<Largest>)> = view
        .entries
        .iter()
        .filter_map(|e| Some((e, largest(&context.load(&e.cell.files.exr, view.scene)?)?)))
        .collect();
    if told.is_empty() && maps.is_empty() && samples.is_empty() {
        return;
    }
    let id = format!("{}-why", view.id);
    let mut figure = None;
    let paper = context.paper();
    m.tag("section", &[("id", &id), ("class", &"why")], |m| {
        m.leaf("h3", &[], "Why");
        if !told.is_empty() {
            let text = "What each technique adds to the image, which variance its own image has, and which share of the whole \
                 image's variance it causes (its covariance with the whole: these sum up to 100 %, and one is negative where \
                 its noise is against that of the others)";
            let end = if is_timed(&told) { "; and how much shorter an iteration is without it." } else { "." };
            m.leaf("p", &[("class", &"note")], format!("{text}{end}"));
            let label = format!("techniques of {}", view.scene.label);
            m.region(&[("class", &"scroll")], &label, |m| m.tag("table", &[], |m| table(m, &told)),
            );
        }
        figure = spread(m, view, &maps, paper);
        if !samples.is_empty() {
            fireflies(m, context, view, &samples);
        }
    });
    let wanted = context.results.figures.comparison;
    context.figures.extend(figure.filter(|_| wanted).map(|svg| (format!("{}-spread", view.slug), svg)));
}

/// Whether it was measured how much time each technique takes.
fn is_timed(told: &[&Entry]) -> bool {
    told.iter().any(|e| e.cell.techniques.iter().any(|t| t.time.is_some()))
}

fn table(m: &mut Markup, told: &[&Entry]) {
    let timed = is_timed(told);
    let mut headings = vec!["estimator", "technique", "energy", "its own variance", "variance it causes"];
    if timed {
        headings.push("time without it");
    }
    m.tag("thead", &[], |m| {
        m.tag("tr", &[], |m| headings.iter().for_each(|h| m.leaf("th", &[("scope", &"col")], h)));
    });
    m.tag("tbody", &[], |m| {
        for entry in told {
            for share in &entry.cell.techniques {
                m.tag(
                    "tr",
                    &[("data-estimator", &entry.info.key), ("data-technique", &share.technique)],
                    |m| {
                        m.tag("th", &[("scope", &"row")], |m| {
                            swatch(m, entry.index);
                            m.text(&entry.info.label);
                        });
                        technique(m, share);
                        if left_out(entry, share) {
                            let columns = if timed { "4" } else { "3" };
                            m.leaf("td", &[("class", &"note"), ("colspan", &columns)], LEFT_OUT);
                            return;
                        }
                        for value in [Some(share.energy), share.variance, share.caused] {
                            let text = value.map_or_else(|| "–".into(), |v| share_text(&v));
                            m.leaf("td", &[("class", &"number")], text);
                        }
                        if timed {
                            let text = share.time.map_or_else(|| "–".into(), |v| saved_text(&v));
                            m.leaf("td", &[("class", &"number")], text);
                        }
                    },
                );
            }
        }
    });
}

/// The largest samples of the first runs, with what to type to see where each comes from; folded.
fn fireflies(m: &mut Markup, context: &Context, view: &SceneView, samples: &[(&Entry, Vec<Largest>)]) {
    m.tag("details", &[("class", &"fireflies")], |m| {
        m.leaf("summary", &[], "Largest samples of the first runs, by luminance times share of the pixel, and how to have them explained");
        let label = format!("largest samples of {}", view.scene.label);
        m.region(&[("class", &"scroll")], &label, |m| {
            m.tag("table", &[], |m| {
                let headings = ["estimator", "pixel", "luminance", "of the pixel", "sample", "command"];
                m.tag("thead", &[], |m| {
                    m.tag("tr", &[], |m| headings.iter().for_each(|h| m.leaf("th", &[("scope", &"col")], h)));
                });
                m.tag("tbody", &[], |m| {
                    for (entry, l) in
                        samples.iter().flat_map(|(e, all)| all.iter().take(LARGEST).map(move |l| (e, l)))
                    {
                        m.tag("tr", &[("data-estimator", &entry.info.key)], |m| {
                            m.tag("th", &[("scope", &"row")], |m| {
                                swatch(m, entry.index);
                                m.text(&entry.info.label);
                            });
                            let numbers = [
                                format!("{}, {}", l.pixel[0], l.pixel[1]),
                                significant(l.luminance.into(), 3),
                                percent(l.share.into()),
                                l.iteration.to_string(),
                            ];
                            numbers.iter().for_each(|n| m.leaf("td", &[("class", &"number")], n));
                            let run = context.path(&entry.cell.files.exr);
                            m.tag("td", &[], |m| m.leaf("code", &[], command(&run, l.pixel)));
                        });
                    }
                });
            });
        });
    });
}

/// Whether a pilot left a technique out.
fn left_out(entry: &Entry, share: &TechniqueShare) -> bool {
    let mut runs = entry.cell.runs.iter();
    let left_out = |run: &Run| run.merges.get(&share.technique).is_some_and(|words| words == LEFT_OUT);
    runs.next().is_some_and(left_out)
}

fn technique(m: &mut Markup, share: &TechniqueShare) {
    let info = TECHNIQUES.iter().find(|t| t.key == share.technique);
    m.tag("td", &[], |m| {
        let style = format!("background:{}", info.map_or("var(--quiet)", |i| i.color));
        m.tag("span", &[("class", &"swatch"), ("style", &style)], |_| {});
        m.text(info.map_or(share.technique.as_str(), |i| i.label));
    });
}

/// `12.3 % ± 0.4`, and a word where it may be nothing.
fn share_text(e: &Estimate) -> String {
    let Some(i) = e.interval.filter(|i| i.low < i.high) else { return percent(e.mean) };
    let text = format!("{} ±\u{a0}{}", percent(e.mean), significant(50.0 * (i.high - i.low), 2));
    if i.contains(0.0) { format!("{text}, not distinguishable from 0") } else { text }
}

/// `−12 %` of the time.
fn saved_text(e: &Estimate) -> String {
    let less = Estimate {
        mean: -e.mean,
        interval: e.interval.map(|i| crate::experiment::results::Interval { low: -i.high, high: -i.low }),
    };
    share_text(&less)
}

fn scalar(image: &Image, f: impl Fn(&[f32; 3]) -> f32) -> ScalarImage {
    ScalarImage { width: image.width, height: image.height, values: image.pixels.iter().map(f).collect() }
}

fn mean_of(p: &[f32; 3]) -> f32 {
    (p[0] + p[1] + p[2]) / 3.0
}

/// A row of maps of variance, one of bias, and the variance of each technique, on common scales; the first two as a figure
/// too.
fn spread(
    m: &mut Markup,
    view: &SceneView,
    maps: &[(&Entry, LayeredImage)],
    paper: Option<Paper>,
) -> Option<String> {
    let mut montage = Montage::new(format!("{}: variance and bias", view.scene.label), 170.0);
    let mut rows = 0;
    for (layer, title, signed) in [
        ("variance", "Variance of a pixel in one run", false),
        ("bias", "Mean over the runs less the reference", true),
    ] {
        let found: Vec<(&Entry, ScalarImage)> =
            maps.iter().filter_map(|(e, file)| Some((*e, scalar(file.layer(layer)?, mean_of)))).collect();
        let lacking = if signed { None } else { lacking(view) };
        if found.is_empty() {
            lacking.iter().for_each(|text| m.leaf("p", &[("class", &"note")], text));
            continue;
        }
        let top = top(found.iter().map(|(_, map)| map));
        let scale = if signed { Scale::Signed(top) } else { Scale::Linear(top) };
        let ends = significant(f64::from(top), 2);
        let range =
            if signed { format!("−{ends} blue, 0 black, {ends} red") } else { format!("0 to {ends}") };
        m.leaf("h4", &[], format!("{title}: {range}"));
        let columns = found.iter().map(|(entry, map)| {
            let value = if signed { entry.cell.bias } else { entry.cell.variance };
            let name = if signed { "bias²" } else { "variance" };
            let fact = value.map_or(String::new(), |v| format!("{name} {}", estimate(&v)));
            let exr = entry.cell.files.statistics_exr.clone().unwrap_or_default();
            (entry.info.label.clone(), fact, Picture::of_map(map, scale, SIDE), exr, layer.to_owned())
        });
        let columns: Vec<Column> = columns.collect();
        for (label, fact, picture, ..) in &columns {
            let (label, fact, picture) = (label.clone(), fact.clone(), picture.clone());
            montage.push(rows, Tile { picture, label, fact, ..Tile::default() });
        }
        for entry in view.entries.iter().filter(|e| !signed && has_one_sample(e)) {
            let (label, fact) = (entry.info.label.clone(), "no map: one sample a pixel".to_owned());
            montage.push(rows, Tile { label, fact, ..Tile::default() });
        }
        montage.name_row(rows, if signed { "bias\nmean less reference" } else { "variance\nin one run" });
        if let Some(ramp) = Picture::of_scale(scale) {
            let low = if signed { format!("−{ends}") } else { "0".to_owned() };
            montage.scale_row(rows, ScaleBar { ramp, ends: [low, ends] });
        }
        rows += 1;
        row(m, view, title, columns);
        lacking.iter().for_each(|text| m.leaf("p", &[("class", &"note")], text));
    }
    for (entry, file) in maps {
        techniques(m, view, entry, file);
    }
    (rows > 0).then(|| montage.on(paper))
}

/// Whether no pixel of a run has a variance.
fn has_one_sample(entry: &Entry) -> bool {
    entry.cell.runs.iter().all(|r| r.spp < 2)
}

/// Which estimators have no map of their variance, and why.
fn lacking(view: &SceneView) -> Option<String> {
    let labels: Vec<&str> =
        view.entries.iter().filter(|e| has_one_sample(e)).map(|e| e.info.label.as_str()).collect();
    (!labels.is_empty()).then(|| {
        format!(
            "No map of {}: the variance of a pixel needs at least two samples in a run.",
            labels.join(", ")
        )
    })
}

/// The variance that each technique's image has, pixel by pixel; folded.
fn techniques(m: &mut Markup, view: &SceneView, entry: &Entry, file: &LayeredImage) {
    let layers: Vec<(&TechniqueShare, ScalarImage)> = entry
        .cell
        .techniques
        .iter()
        .filter(|t| !left_out(entry, t))
        .filter_map(|t| Some((t, scalar(file.layer(&format!("variance.{}", t.technique))?, mean_of))))
        .collect();
    if layers.len() < 2 {
        return;
    }
    let top = top(layers.iter().map(|(_, map)| map));
    m.tag("details", &[], |m| {
        m.leaf("summary", &[], format!("Variance of each technique of {}", entry.info.label));
        let columns = layers.iter().map(|(share, map)| {
            let info = TECHNIQUES.iter().find(|t| t.key == share.technique);
            let label = info.map_or(share.technique.as_str(), |i| i.label).to_owned();
            let fact = share.caused.map_or(String::new(), |c| format!("causes {}", share_text(&c)));
            let exr = entry.cell.files.statistics_exr.clone().unwrap_or_default();
            let layer = format!("variance.{}", share.technique);
            (label, fact, Picture::of_map(map, Scale::Linear(top), SIDE), exr, layer)
        });
        row(m, view, "variance of each technique", columns.collect());
        let note = format!("From 0 to {}.", significant(f64::from(top), 2));
        m.leaf("p", &[("class", &"note")], note);
    });
}

/// Top of a common scale: the largest 99th percentile of the magnitudes.
fn top<'a>(maps: impl Iterator<Item = &'a ScalarImage>) -> f32 {
    let magnitude = |map: &ScalarImage| {
        let values = map.values.iter().map(|v| v.abs()).collect();
        ScalarImage { values, ..*map }.quantile(QUANTILE)
    };
    maps.map(magnitude).fold(0.0, f32::max)
}

/// Label, fact, picture, EXR and layer of each image.
type Column = (String, String, Option<Picture>, String, String);

fn row(m: &mut Markup, view: &SceneView, title: &str, columns: Vec<Column>) {
    let style = format!("--columns:{}", columns.len().max(3));
    m.region(&[("class", &"row"), ("style", &style)], &title, |m| {
        for (label, fact, picture, exr, layer) in &columns {
            m.tag("figure", &[], |m| {
                shown(m, picture.as_ref(), &format!("{title}: {label}"), exr, layer, view);
                m.tag("figcaption", &[], |m| {
                    m.leaf("b", &[], label);
                    m.leaf("span", &[("class", &"fact")], fact);
                });
            });
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::results::Interval;

    #[test]
    fn shares_say_when_they_may_be_nothing() {
        let e = |mean: f64, half: f64| Estimate {
            mean,
            interval: Some(Interval { low: mean - half, high: mean + half }),
        };
        assert_eq!(share_text(&e(0.25, 0.02)), "25.0 % ±\u{a0}2.0");
        assert!(share_text(&e(0.01, 0.02)).ends_with("not distinguishable from 0"));
        assert_eq!(share_text(&Estimate { mean: 0.5, interval: None }), "50.0 %");
        assert_eq!(saved_text(&e(0.3, 0.01)), "−30.0 % ±\u{a0}1.0");
    }
}
