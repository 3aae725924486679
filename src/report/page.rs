//! The page as a whole: head, summary, a section a scene, and what is needed to repeat the experiment.

use super::comparison::{self, Images, swatch};
use super::context::{Context, Entry, SceneView, estimate, paragraphs, warnings};
use super::layers::{self, Group, Kind};
use super::markup::Markup;
use super::numbers::{bytes, count, plural, significant};
use super::palette::css_variables;
use super::viewer::Role;
use super::{contributions, convergence, pyramid, reproduce, table, techniques, verdict, why};
use crate::experiment::results::Cell;
use crate::film::exr::LayeredImage;
use crate::render::files::all_paths;

/// The style sheet; colours of the estimators are added to it.
const STYLE: &str = include_str!("style.css");
/// Nothing but what is within the page may be shown or run: it asks the browser to refuse all else.
const POLICY: &str =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// The whole page.
pub(super) fn page(context: &mut Context) -> String {
    let results = context.results;
    let mut body = Markup::default();
    for n in 0..results.scenes.len() {
        let view = context.scene(n);
        scene(context, &view, &mut body);
        body.newline();
    }
    reproduce::section(context, &mut body);
    let body = body.into_string();
    let mut viewer = Markup::default();
    let views: Vec<SceneView> = (0..results.scenes.len()).map(|n| context.scene(n)).collect();
    std::mem::take(&mut context.viewer).write(&views, &mut viewer);
    let viewer = viewer.into_string();

    let mut m = Markup::default();
    m.raw("<!doctype html>\n");
    m.tag("html", &[("lang", &"en")], |m| {
        m.tag("head", &[], |m| {
            m.void("meta", &[("charset", &"utf-8")]);
            m.void("meta", &[("http-equiv", &"Content-Security-Policy"), ("content", &POLICY)]);
            m.void("meta", &[("name", &"viewport"), ("content", &"width=device-width, initial-scale=1")]);
            m.void("meta", &[("name", &"color-scheme"), ("content", &"light dark")]);
            m.leaf("title", &[], format!("{} – tyndall", results.title));
            m.tag("style", &[], |m| {
                m.raw(STYLE);
                m.raw(&css_variables(&context.colors));
            });
        });
        m.newline();
        m.tag("body", &[("data-experiment", &results.experiment), ("data-results", &"results.json")], |m| {
            m.leaf("a", &[("class", &"skip"), ("href", &"#main")], "Skip to the results");
            header(context, m);
            navigation(context, m);
            m.tag("main", &[("id", &"main")], |m| {
                estimators(context, m);
                overview(context, m);
                m.raw(&body);
            });
            m.tag("footer", &[], |m| {
                m.text(format!(
                    "Made by {}. This page holds everything that it shows ({} of text and images) and \
                    loads nothing.",
                    results.program,
                    bytes(body.len() + viewer.len())
                ));
            });
            m.newline();
            m.raw(&viewer);
        });
    });
    m.into_string()
}

fn header(context: &Context, m: &mut Markup) {
    let results = context.results;
    m.tag("header", &[], |m| {
        m.leaf("p", &[("class", &"kicker")], format!("{} · {}", results.program, results.experiment));
        m.leaf("h1", &[], &results.title);
        paragraphs(m, "lead", &results.description);
        let made = [
            plural(results.scenes.len() as u64, "scene"),
            plural(results.estimators.len() as u64, "estimator"),
            plural(u64::from(results.runs), "run"),
            format!("{} ({} threads)", results.machine.cpu, results.machine.threads),
            results.rendered().map_or(results.finished.as_str(), |[_, last]| last).to_owned(),
        ];
        m.tag("p", &[("class", &"facts-line")], |m| made.iter().for_each(|t| m.leaf("span", &[], t)));
        if results.partial {
            m.leaf(
                "p",
                &[("class", &"warning partial"), ("role", &"note")],
                "Partial results: the experiment was interrupted, or is still running. What is here is complete as far as \
                 it goes; what is missing is named below.",
            );
        }
        warnings(m, "Warnings", &results.warnings);
        warnings(m, "Could not be shown", &context.problems);
    });
}

fn navigation(context: &Context, m: &mut Markup) {
    m.tag("nav", &[("aria-label", &"sections")], |m| {
        m.tag("ul", &[], |m| {
            for n in 0..context.results.scenes.len() {
                let view = context.scene(n);
                m.tag("li", &[], |m| m.leaf("a", &[("href", &format!("#{}", view.id))], &view.scene.label));
            }
            m.tag("li", &[], |m| m.leaf("a", &[("href", &"#reproducibility")], "To repeat"));
        });
    });
}

/// The estimators with their captions, once for all scenes.
fn estimators(context: &Context, m: &mut Markup) {
    m.tag("section", &[("id", &"estimators")], |m| {
        m.leaf("h2", &[], "Estimators");
        m.tag("ul", &[("class", &"estimators")], |m| {
            for (i, e) in context.results.estimators.iter().enumerate() {
                m.tag("li", &[("data-estimator", &e.key)], |m| {
                    swatch(m, i);
                    m.leaf("b", &[], &e.label);
                    m.leaf(
                        "span",
                        &[("class", &"quiet")],
                        format!(" – {}", e.settings.techniques.join(", ")),
                    );
                    paragraphs(m, "caption", &e.caption);
                });
            }
        });
    });
}

/// The main metric of every scene and estimator; with more than one scene.
fn overview(context: &Context, m: &mut Markup) {
    let results = context.results;
    let Some(metric) = results.metrics.first().filter(|_| results.scenes.len() > 1) else { return };
    m.tag("section", &[("id", &"overview")], |m| {
        m.leaf("h2", &[], format!("{} in all scenes", metric.label));
        m.region(&[("class", &"scroll")], &"overview", |m| {
            m.tag("table", &[], |m| {
                m.tag("thead", &[], |m| {
                    m.tag("tr", &[], |m| {
                        m.leaf("th", &[("scope", &"col")], "scene");
                        results.estimators.iter().for_each(|e| m.leaf("th", &[("scope", &"col")], &e.label));
                    });
                });
                m.tag("tbody", &[], |m| {
                    for n in 0..results.scenes.len() {
                        let view = context.scene(n);
                        m.tag("tr", &[], |m| {
                            m.tag("th", &[("scope", &"row")], |m| {
                                m.leaf("a", &[("href", &format!("#{}", view.id))], &view.scene.label);
                            });
                            for e in &results.estimators {
                                let cell = results.cell(&view.scene.key, &e.key);
                                let value = cell.and_then(|c| c.metric(&metric.key));
                                let text = value.map_or_else(|| "–".into(), |v| estimate(&v));
                                m.leaf("td", &[("class", &"number")], text);
                            }
                        });
                    }
                });
            });
        });
    });
}

fn scene(context: &mut Context, view: &SceneView, m: &mut Markup) {
    let figures = context.results.figures.clone();
    m.tag("section", &[("id", &view.id), ("class", &"scene"), ("data-scene", &view.scene.key)], |m| {
        m.leaf("h2", &[], &view.scene.label);
        paragraphs(m, "caption", &view.scene.caption);
        if let Some(text) = verdict::verdict(view, context.results.efficiency_metric()) {
            m.leaf("p", &[("class", &"verdict")], text);
        }
        warnings(m, "Warnings", &scene_warnings(view));
        if let Some(paths) = paths(view) {
            m.leaf("p", &[("class", &"note")], paths);
        }
        contributions::section(context, view, m);
        let images = Images::load(context, view);
        if let Some((reference, image)) = view.scene.reference.as_ref().zip(images.reference.as_ref()) {
            context.viewer.add(view, Role::Reference, "reference", (&reference.exr, ""), image);
        }
        for (entry, image) in view.entries.iter().zip(&images.estimates) {
            if let Some(image) = image {
                let file = (entry.cell.files.exr.as_str(), "");
                context.viewer.add(view, Role::Estimate, &entry.info.label, file, image);
            }
        }
        if figures.comparison {
            comparison::section(context, view, &images, m);
        }
        if figures.strip {
            comparison::strip(context, view, &images, m);
        }
        drop(images);
        if view.entries.iter().any(|e| !e.cell.summary.is_empty() || e.cell.variance.is_some()) {
            table::section(context, view, m);
        }
        why::section(context, view, m);
        if figures.convergence {
            convergence::section(context, view, m);
        }
        layered(context, view, m);
    });
}

/// Which paths are in the images, where some are left out and all estimators have the same.
fn paths(view: &SceneView) -> Option<String> {
    let first = &view.entries.first()?.cell.paths;
    let same = view.entries.iter().all(|e| e.cell.paths == *first);
    (same && *first != all_paths()).then(|| format!("Paths {first} alone: all others are left out."))
}

/// Strips and pyramids: both come from one EXR an estimator, which is read once.
fn layered(context: &mut Context, view: &SceneView, m: &mut Markup) {
    let figures = context.results.figures.clone();
    if !figures.techniques && figures.pyramid.is_none() {
        return;
    }
    let (mut strips, mut pyramids) = (Markup::default(), Markup::default());
    for entry in view.entries.iter().filter(|e| !e.cell.files.layers.is_empty()) {
        let Some(image) = context.load(&entry.cell.files.mean_exr, view.scene) else { continue };
        offer(context, view, entry, &image, figures.techniques, figures.pyramid);
        if figures.techniques {
            techniques::strip(context, view, entry, &image, &mut strips);
        }
        if let Some(lengths) = figures.pyramid {
            pyramid::pyramid(context, view, entry, &image, lengths, &mut pyramids);
        }
    }
    let (strips, pyramids) = (strips.into_string(), pyramids.into_string());
    if !strips.is_empty() {
        m.tag("section", &[("id", &format!("{}-techniques", view.id)), ("class", &"techniques")], |m| {
            m.leaf("h3", &[], "What each technique contributes");
            m.leaf("p", &[("class", &"note")], "All images of an estimator at the scene's exposure.");
            m.raw(&strips);
        });
    }
    if !pyramids.is_empty() {
        m.tag("section", &[("id", &format!("{}-pyramid", view.id)), ("class", &"pyramids")], |m| {
            m.leaf("h3", &[], "Pyramid");
            let text = format!(
                "A row a path length of k segments; within it, s vertices of the light subpath from 0 at the left to k at the \
                 right, and t = k + 1 − s of the camera's. Each row is brightened as it says. {}",
                pyramid::size_note(view)
            );
            m.leaf("p", &[("class", &"note")], text);
            m.raw(&pyramids);
        });
    }
}

/// Gives the viewer the layers of an estimator that the page shows.
pub(super) fn offer(
    context: &mut Context,
    view: &SceneView,
    entry: &Entry,
    image: &LayeredImage,
    techniques: bool,
    pyramid: Option<[u32; 2]>,
) {
    let (exr, label) = (&entry.cell.files.mean_exr, &entry.info.label);
    if let Some(mean) = image.layer("") {
        context.viewer.add(view, Role::Layer, &format!("{label}: mean of the runs"), (exr, ""), mean);
    }
    for layer in &image.layers {
        let shown = match layers::parse(&layer.name) {
            Some((Group::Family(_), kind)) => techniques && kind != Kind::Weight,
            Some((Group::Pair(s, t), Kind::Weighted)) => {
                pyramid.is_some_and(|[min, max]| (min..=max).contains(&(s + t).saturating_sub(1)))
            }
            _ => false,
        };
        // What a technique set cannot make is black.
        if shown && layer.image.pixels.iter().any(|p| *p != [0.0; 3]) {
            let name = format!("{label}: {}", layer.name);
            context.viewer.add(view, Role::Layer, &name, (exr, &layer.name), &layer.image);
        }
    }
}

/// What the reader should know of a scene's results: what was said on the way, and what the numbers show.
fn scene_warnings(view: &SceneView) -> Vec<String> {
    let mut out = view.scene.warnings.clone();
    if !view.missing.is_empty() {
        out.push(format!("No results yet of {}.", view.missing.join(", ")));
    }
    if view.scene.reference.as_ref().is_some_and(|r| r.partial) {
        out.push("The reference is still short of the samples that were asked for.".into());
    }
    for entry in &view.entries {
        let label = &entry.info.label;
        // What the experiment said itself is not said again.
        let told = |word: &str| entry.cell.warnings.iter().any(|w| w.contains(word));
        let early = entry.cell.runs.iter().filter(|r| r.partial).count() as u64;
        let stopped =
            (early > 0).then(|| format!("{} stopped before the budget was used.", plural(early, "run")));
        let found = [
            dropped(entry.cell).filter(|_| !told("dropped")),
            stopped.filter(|_| !told("stopped")),
            reference_noise(view, entry.cell).filter(|_| !told("noise")),
        ];
        out.extend(entry.cell.warnings.iter().chain(found.iter().flatten()).map(|w| format!("{label}: {w}")));
    }
    out
}

/// Contributions that were dropped as not finite, over all runs.
fn dropped(cell: &Cell) -> Option<String> {
    let mut by_technique: std::collections::BTreeMap<&str, u64> = Default::default();
    for (key, n) in cell.runs.iter().flat_map(|r| &r.dropped) {
        *by_technique.entry(key).or_default() += n;
    }
    by_technique.retain(|_, n| *n > 0);
    let list: Vec<String> = by_technique.iter().map(|(key, n)| format!("{} of {key}", count(*n))).collect();
    (!list.is_empty()).then(|| {
        format!(
            "contributions that were not finite were dropped in {}: {}.",
            plural(cell.runs.len() as u64, "run"),
            list.join(", ")
        )
    })
}

/// Share of the MSE beyond which the reference's own noise is worth a warning.
const NOISE_SHARE: f64 = 0.1;

fn reference_noise(view: &SceneView, cell: &Cell) -> Option<String> {
    let noise = view.scene.reference.as_ref()?.variance?;
    let mse = cell.summary.iter().find(|s| s.metric == "mse")?;
    let mse = mse.measured.unwrap_or(mse.value).mean;
    let share = noise / mse;
    (share > NOISE_SHARE && share.is_finite()).then(|| {
        format!(
            "{} % of its MSE is the reference's own noise (variance {}): it needs more samples.",
            significant(100.0 * share.min(1.0), 2),
            significant(noise, 2)
        )
    })
}
