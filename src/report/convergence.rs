//! Error against samples and against time: plots, and the table of fitted slopes.

use super::comparison::swatch;
use super::context::{Context, Entry, SceneView, slope};
use super::curve::{Curve, MeanPoint};
use super::markup::Markup;
use super::numbers::plural;
use super::plot::Plot;
use crate::experiment::measure::curve;
use crate::experiment::results::{self, Checkpoint, CurvePoint, Estimate, MetricInfo, Run};

/// What runs to the right.
#[derive(Clone, Copy)]
enum Against {
    Samples,
    Time,
}

impl Against {
    fn label(self) -> &'static str {
        match self {
            Self::Samples => "samples per pixel",
            Self::Time => "seconds of rendering",
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Time => "time",
        }
    }

    fn of_run(self, c: &Checkpoint) -> f64 {
        match self {
            Self::Samples => c.spp as f64,
            Self::Time => c.seconds,
        }
    }

    fn of_mean(self, p: &CurvePoint) -> f64 {
        match self {
            Self::Samples => p.spp as f64,
            Self::Time => p.seconds,
        }
    }

    /// The label of a plot in which some run had a set-up, or none: slopes are to be read with it, and a figure may stand alone.
    fn label_of(self, with_setup: bool) -> String {
        match self {
            Self::Time if with_setup => format!("{}; slopes without set-up", self.label()),
            _ => self.label().to_owned(),
        }
    }

    fn slope(self, entry: &Entry, c: &results::Curve) -> Option<Estimate> {
        match self {
            Self::Samples => c.slope_spp,
            // Older results have it with the set-up, which alone may make a line steep: it is fitted again.
            Self::Time if entry.cell.runs.iter().any(|r| r.setup > 0.0) => {
                curve(&c.metric, &entry.cell.runs)?.slope_seconds
            }
            Self::Time => c.slope_seconds,
        }
    }
}

/// The interval of a mean as it is on a logarithmic axis, from its width: by the delta method the standard error of log m is s/m,
/// which gives m · exp(±t s/m), always above 0.
fn log_interval(mean: f64, width: f64) -> Option<(f64, f64)> {
    let factor = (0.5 * width / mean).exp();
    (mean > 0.0 && factor.is_finite()).then_some((mean / factor, mean * factor))
}

/// The section of convergence; nothing where no estimator has a curve.
pub(super) fn section(context: &mut Context, view: &SceneView, m: &mut Markup) {
    let results = context.results;
    let has =
        |k: &&MetricInfo| view.entries.iter().any(|e| e.cell.convergence.iter().any(|c| c.metric == k.key));
    let metrics: Vec<&MetricInfo> = results.metrics.iter().filter(has).collect();
    let Some((main, others)) = metrics.split_first() else { return };
    let id = format!("{}-convergence", view.id);
    m.tag("section", &[("id", &id), ("class", &"convergence")], |m| {
        m.leaf("h3", &[], "Convergence");
        m.leaf(
            "p",
            &[("class", &"note")],
            "Bold: mean over the runs, with its 95% interval as a band, which is taken on the scale of the axis: the mean times \
             exp(±t·s/mean), where s is the mean's standard error and t Student's; faint: each run. Slopes are fitted to the \
             logarithms, with their 95% intervals; those against time without the seconds of the set-up, which the axis has. The \
             reference's own noise is taken off where it adds up; a line that flattens out has a bias.",
        );
        plots(context, view, main, m);
        slopes(view, &metrics, m);
        let without: Vec<&str> =
            results.metrics.iter().filter(|k| !has(k)).map(|k| k.label.as_str()).collect();
        if !without.is_empty() {
            let text = format!(
                "None of {}: on the way only sums over pixels are measured, as filters take seconds an image.",
                without.join(", ")
            );
            m.leaf("p", &[("class", &"note")], text);
        }
        if !others.is_empty() {
            m.tag("details", &[], |m| {
                let names: Vec<&str> = others.iter().map(|k| k.label.as_str()).collect();
                m.leaf("summary", &[], format!("Convergence of the other metrics: {}", names.join(", ")));
                others.iter().for_each(|k| plots(context, view, k, m));
            });
        }
    });
}

/// Slope of an unbiased estimator's line, where theory knows one: squared errors fall as 1/N, absolute ones as its root.
fn expected_slope(metric: &str) -> Option<f64> {
    match metric {
        "mse" | "relmse" => Some(-1.0),
        "mae" | "smape" => Some(-0.5),
        _ => None,
    }
}

fn plots(context: &mut Context, view: &SceneView, metric: &MetricInfo, m: &mut Markup) {
    m.tag("div", &[("class", &"plots")], |m| {
        for against in [Against::Samples, Against::Time] {
            let plot = plot(context, view, metric, against);
            m.tag("figure", &[("class", &"plot")], |m| {
                m.raw(&plot.inline());
                let hidden = plot.undrawable() as u64;
                if hidden > 0 {
                    let text = format!(
                        "{} of zero, or not finite, that a logarithmic axis cannot show",
                        plural(hidden, "value")
                    );
                    m.leaf("figcaption", &[("class", &"quiet")], text);
                }
            });
            let name =
                format!("{}-convergence-{}-{}", view.slug, super::markup::slug(&metric.key), against.word());
            context.figures.push((name, plot.file(context.paper())));
        }
    });
}

fn plot(context: &Context, view: &SceneView, metric: &MetricInfo, against: Against) -> Plot {
    let curve = |entry: &Entry| {
        let found = entry.cell.convergence.iter().find(|c| c.metric == metric.key)?;
        let mean = found.points.iter().map(|p| MeanPoint {
            x: against.of_mean(p),
            y: p.value.mean,
            interval: p.value.interval.and_then(|i| log_interval(p.value.mean, i.high - i.low)),
        });
        Some(Curve {
            label: entry.info.label.clone(),
            series: entry.index,
            color: context.colors[entry.index].clone(),
            runs: runs(&entry.cell.runs, &metric.key, against),
            mean: mean.collect(),
            remark: against.slope(entry, found).map_or_else(|| "too few points to fit".into(), |s| slope(&s)),
        })
    };
    Plot {
        title: format!("{} – {} against {}", view.scene.label, metric.label, against.word()),
        x_label: against.label_of(view.entries.iter().any(|e| e.cell.runs.iter().any(|r| r.setup > 0.0))),
        y_label: metric.label.clone(),
        curves: view.entries.iter().filter_map(curve).collect(),
        reference_slope: expected_slope(&metric.key),
    }
}

/// Each run's way, without the reference's noise; nothing for a single run, which is its own mean.
fn runs(runs: &[Run], key: &str, against: Against) -> Vec<Vec<(f64, f64)>> {
    if runs.len() < 2 {
        return Vec::new();
    }
    let way = |r: &Run| {
        let value = |c: &Checkpoint| Some((against.of_run(c), *c.metrics.get(key)?));
        let points = r.checkpoints.iter().filter_map(value);
        points.collect::<Vec<_>>()
    };
    runs.iter().map(way).collect()
}

/// Slopes of all metrics, for reading and copying.
fn slopes(view: &SceneView, metrics: &[&MetricInfo], m: &mut Markup) {
    m.tag("details", &[], |m| {
        m.leaf("summary", &[], "Table of fitted slopes");
        m.region(&[("class", &"scroll")], &"slopes", |m| {
            m.tag("table", &[], |m| {
                m.tag("thead", &[], |m| {
                    m.tag("tr", &[], |m| {
                        m.leaf("th", &[("scope", &"col")], "estimator");
                        for k in metrics {
                            m.leaf("th", &[("scope", &"col")], format!("{} / samples", k.label));
                            m.leaf("th", &[("scope", &"col")], format!("{} / time", k.label));
                        }
                    });
                });
                m.tag("tbody", &[], |m| {
                    for entry in &view.entries {
                        m.tag("tr", &[], |m| {
                            m.tag("th", &[("scope", &"row")], |m| {
                                swatch(m, entry.index);
                                m.text(&entry.info.label);
                            });
                            for k in metrics {
                                let curve = entry.cell.convergence.iter().find(|c| c.metric == k.key);
                                for against in [Against::Samples, Against::Time] {
                                    let text = curve
                                        .and_then(|c| against.slope(entry, c))
                                        .map_or_else(|| "–".into(), |s| super::context::estimate(&s));
                                    m.leaf("td", &[("class", &"number")], text);
                                }
                            }
                        });
                    }
                });
            });
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_stay_above_nothing_and_are_the_usual_ones_where_narrow() {
        let (low, high) = log_interval(2.0, 0.02).unwrap();
        assert!((low - 1.99).abs() < 1e-4 && (high - 2.01).abs() < 1e-4, "{low} {high}");
        let (low, high) = log_interval(1.0, 6.0).unwrap();
        assert!(low > 0.0 && (low * high - 1.0).abs() < 1e-12 && (high - 3f64.exp()).abs() < 1e-9);
        assert!(
            [(0.0, 1.0), (-1.0, 1.0), (f64::NAN, 1.0), (1e-9, 1e9)]
                .iter()
                .all(|(m, w)| log_interval(*m, *w).is_none())
        );
    }
}
