//! What is needed to repeat the experiment and to read its numbers: program, machine, settings, seeds, times, metrics.

use super::comparison::swatch;
use super::context::{Context, Entry, SceneView};
use super::markup::Markup;
use super::numbers::{count, duration, significant};
use crate::experiment::results::{Budget, EstimatorSettings, Results, Run};
use crate::transport::technique::TECHNIQUES;
use std::collections::BTreeMap;

/// The last section.
pub(super) fn section(context: &Context, m: &mut Markup) {
    let results = context.results;
    m.tag("section", &[("id", &"reproducibility"), ("class", &"reproduce")], |m| {
        m.leaf("h2", &[], "To repeat and to read this");
        program(results, m);
        m.leaf("h3", &[], "Estimators");
        settings(results, m);
        m.leaf("h3", &[], "Metrics");
        metrics(results, m);
        m.leaf("h3", &[], "Runs");
        for n in 0..results.scenes.len() {
            let view = context.scene(n);
            m.tag("details", &[], |m| {
                m.leaf("summary", &[], format!("{}: seeds, times and files", view.scene.label));
                runs(&view, m);
            });
        }
    });
}

fn pair(m: &mut Markup, term: &str, text: &str) {
    m.tag("div", &[], |m| {
        m.leaf("dt", &[], term);
        m.leaf("dd", &[], text);
    });
}

fn program(results: &Results, m: &mut Markup) {
    let machine = &results.machine;
    m.tag("dl", &[("class", &"facts")], |m| {
        let code = if results.rendering.is_empty() {
            results.program.clone()
        } else {
            format!("{}, rendering code {}", results.program, results.rendering)
        };
        pair(m, "program", &code);
        pair(
            m,
            "experiment",
            &format!("{} (resolved: experiment.toml beside this page)", results.experiment),
        );
        pair(m, "machine", &format!("{}, {} cores, {} threads", machine.cpu, machine.cores, machine.threads));
        match results.rendered() {
            Some([first, last]) => {
                pair(m, "rendered", &format!("the first run was done {first}, the last {last}"));
                pair(m, "measured", &results.finished);
            }
            None => {
                pair(m, "started", &results.started);
                pair(m, "finished", &results.finished);
            }
        }
        let total: f64 = results.cells.iter().flat_map(|c| &c.runs).map(|r| r.seconds).sum();
        pair(m, "rendering in all", &format!("{}, the sum over all runs", duration(total)));
        pair(m, "data", "results.json (all numbers), results.csv (a row a number, under the keys of this page's metrics with the values of this page)");
    });
}

fn budget(budget: &Budget) -> String {
    match budget {
        Budget::Spp(n) => format!("{} samples per pixel", count(*n)),
        Budget::Seconds(s) => duration(*s),
        Budget::RelMse { target, spp, seconds } => {
            let bounds = [spp.map(|n| format!("{} samples per pixel", count(n))), seconds.map(duration)];
            let bounds: Vec<String> = bounds.into_iter().flatten().collect();
            format!(
                "until the relMSE is {}, but no more than {}",
                significant(*target, 3),
                bounds.join(" or ")
            )
        }
    }
}

fn lengths(s: &EstimatorSettings) -> String {
    let end = |v: Option<u32>| v.map_or_else(|| "the scene's".into(), |v| v.to_string());
    match (s.min_length, s.max_length) {
        (None, None) => "the scene's".into(),
        (min, max) => format!("{} to {}", end(min), end(max)),
    }
}

fn settings(results: &Results, m: &mut Markup) {
    let headings =
        ["estimator", "key", "techniques", "heuristic", "paths", "path lengths", "budget of a run", "layers"];
    table(m, "settings of the estimators", &headings, |m| {
        for (i, e) in results.estimators.iter().enumerate() {
            let s = &e.settings;
            let label = |key: &String| {
                let info = TECHNIQUES.iter().find(|t| t.key == key);
                info.map_or_else(|| key.clone(), |t| format!("{} ({})", t.label, t.symbol))
            };
            let techniques: Vec<String> = s.techniques.iter().map(label).collect();
            let layers =
                if s.layers == "all" { format!("all, (s, t) up to {}", s.pyramid) } else { s.layers.clone() };
            m.tag("tr", &[("id", &format!("settings-{i}"))], |m| {
                m.tag("th", &[("scope", &"row")], |m| {
                    swatch(m, i);
                    m.text(&e.label);
                });
                let texts = [
                    e.key.clone(),
                    techniques.join(", "),
                    s.heuristic.clone(),
                    s.paths.clone(),
                    lengths(s),
                    budget(&s.budget),
                    layers,
                ];
                texts.iter().for_each(|t| m.leaf("td", &[], t));
            });
        }
    });
}

fn metrics(results: &Results, m: &mut Markup) {
    m.tag("dl", &[("class", &"facts")], |m| {
        results.metrics.iter().for_each(|k| pair(m, &k.label, &k.description));
        pair(
            m,
            "variance",
            "mean squared difference of a run from the mean of all runs, per pixel and channel, times R/(R−1)",
        );
        let efficiency =
            format!("1/({} · seconds); the ratio is that of the mean products over the runs", results.efficiency_metric().1);
        pair(m, "efficiency", &efficiency);
        pair(m, "energy", "mean luminance of a layer over the finite pixels; its share is of the combined image's");
    });
}

fn runs(view: &SceneView, m: &mut Markup) {
    if let Some(reference) = &view.scene.reference {
        m.tag("p", &[], |m| {
            m.text("Scene file ");
            m.leaf("code", &[], &view.scene.file);
            m.text("; reference ");
            m.leaf("code", &[], &reference.exr);
            if let Some(v) = reference.variance {
                m.text(format!(", of variance {} a pixel and channel", significant(v, 3)));
            }
            m.text(".");
        });
    }
    let headings = [
        "estimator",
        "run",
        "seed",
        "spp",
        "seconds",
        "of them pilots",
        "done",
        "camera paths",
        "light paths",
        "lengths",
        "dropped",
        "EXR",
    ];
    table(m, "runs", &headings, |m| {
        for entry in &view.entries {
            for run in &entry.cell.runs {
                m.tag("tr", &[], |m| {
                    m.leaf("th", &[("scope", &"row")], &entry.info.label);
                    let lengths = format!("{} to {}", entry.cell.min_length, entry.cell.max_length);
                    let partial = if run.partial { " (stopped early)" } else { "" };
                    let numbers = [
                        run.index.to_string(),
                        run.seed.to_string(),
                        format!("{}{partial}", count(run.spp)),
                        significant(run.seconds, 4),
                        significant(run.setup, 2),
                        run.rendered.clone().unwrap_or_else(|| "–".into()),
                        count(run.camera_paths),
                        count(run.light_paths),
                        lengths,
                        dropped(run),
                    ];
                    numbers.iter().for_each(|t| m.leaf("td", &[("class", &"number")], t));
                    m.tag("td", &[], |m| m.leaf("code", &[], &run.exr));
                });
            }
        }
    });
    chosen(view, m);
}

/// Radii, counts and shares that were chosen from the scene, of the first run of each estimator that has some.
fn chosen(view: &SceneView, m: &mut Markup) {
    let first = |e: &Entry| e.cell.runs.first().map(|r| (e.info.label.clone(), r.merges.clone()));
    let rows: Vec<(String, BTreeMap<String, String>)> =
        view.entries.iter().filter_map(first).filter(|(_, merges)| !merges.is_empty()).collect();
    if rows.is_empty() {
        return;
    }
    m.leaf("p", &[("class", &"note")], "What was chosen from the scene, in the first run:");
    table(
        m,
        "radii, counts and shares",
        &["estimator", "technique", "gathers in the first iteration"],
        |m| {
            for (label, merges) in &rows {
                for (key, words) in merges {
                    m.tag("tr", &[], |m| {
                        m.leaf("th", &[("scope", &"row")], label);
                        m.leaf("td", &[], key);
                        m.leaf("td", &[], words);
                    });
                }
            }
        },
    );
}

/// Dropped contributions of a run: their number, by technique.
pub(super) fn dropped(run: &Run) -> String {
    let by_technique: Vec<String> =
        run.dropped.iter().filter(|(_, n)| **n > 0).map(|(key, n)| format!("{} {key}", count(*n))).collect();
    if by_technique.is_empty() { "0".into() } else { by_technique.join(", ") }
}

fn table(m: &mut Markup, label: &str, headings: &[&str], rows: impl FnOnce(&mut Markup)) {
    m.region(&[("class", &"scroll")], &label, |m| {
        m.tag("table", &[("class", &"plain")], |m| {
            m.tag("thead", &[], |m| {
                m.tag("tr", &[], |m| headings.iter().for_each(|h| m.leaf("th", &[("scope", &"col")], h)));
            });
            m.tag("tbody", &[], rows);
        });
    });
}
