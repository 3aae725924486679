//! The table of metrics: means with intervals over the runs, and who is best where that can be told.

use super::comparison::swatch;
use super::context::{Context, Entry, SceneView, estimate};
use super::markup::Markup;
use super::numbers::significant;
use super::statistics::{Best, Ratio, best, ratio};
use crate::experiment::results::{Cell, Estimate, MetricInfo};
use crate::experiment::split::LEAST_RUNS;

/// A column of the table.
struct Column {
    heading: String,
    /// Shown on hovering, and read aloud.
    about: String,
    /// What stands in each estimator's row.
    texts: Vec<String>,
    best: Option<Best>,
}

/// The section of metrics.
pub(super) fn section(context: &Context, view: &SceneView, m: &mut Markup) {
    let id = format!("{}-metrics", view.id);
    m.tag("section", &[("id", &id), ("class", &"metrics")], |m| {
        m.leaf("h3", &[], "Metrics");
        let columns = columns(context, view);
        let label = format!("metrics of {}", view.scene.label);
        m.region(&[("class", &"scroll")], &label, |m| m.tag("table", &[], |m| table(m, view, &columns)));
        m.leaf("p", &[("class", &"note")], note(view));
    });
}

fn columns(context: &Context, view: &SceneView) -> Vec<Column> {
    let mut out: Vec<Column> = context
        .results
        .metrics
        .iter()
        .filter(|k| view.entries.iter().any(|e| e.cell.metric(&k.key).is_some()))
        .map(|k| metric_column(view, k))
        .collect();
    let each = |f: &dyn Fn(&Cell) -> String| view.entries.iter().map(|e| f(e.cell)).collect::<Vec<_>>();
    let optional = |e: Option<Estimate>| e.map_or_else(|| "–".into(), |e| estimate(&e));
    out.push(Column {
        heading: "spp".into(),
        about: "samples per pixel of a run".into(),
        texts: each(&|c| estimate_or_whole(&c.spp)),
        best: None,
    });
    out.push(Column {
        heading: "seconds".into(),
        about: "rendering time of a run by the wall clock".into(),
        texts: each(&|c| estimate(&c.seconds)),
        best: None,
    });
    out.extend(efficiency_columns(view, context.results.efficiency_metric()));
    if view.entries.iter().any(|e| e.cell.variance.is_some()) {
        out.push(Column {
            heading: "variance".into(),
            about: "mean squared difference of a run from the mean of all runs, per pixel and channel".into(),
            texts: each(&|c| optional(c.variance)),
            best: None,
        });
    }
    if view.entries.iter().any(|e| e.cell.bias.is_some()) {
        out.push(Column {
            heading: "bias²".into(),
            about: "squared bias, from products of different runs: with the variance it adds up to the MSE"
                .into(),
            texts: each(&|c| c.bias.map_or_else(|| "–".into(), |b| bias_text(&b))),
            best: None,
        });
    }
    out
}

/// A squared bias, and a word where it may be 0.
fn bias_text(bias: &Estimate) -> String {
    match bias.interval {
        Some(i) if i.contains(0.0) => format!("{}, not distinguishable from 0", estimate(bias)),
        _ => estimate(bias),
    }
}

fn estimate_or_whole(e: &Estimate) -> String {
    if e.mean.fract() == 0.0 && e.interval.is_none_or(|i| i.low == i.high) {
        super::numbers::count(e.mean as u64)
    } else {
        estimate(e)
    }
}

fn metric_column(view: &SceneView, metric: &MetricInfo) -> Column {
    let texts = view.entries.iter().map(|e| match e.cell.metric(&metric.key) {
        Some(v) => estimate(&v),
        None => "–".into(),
    });
    let sets: Vec<Vec<f64>> = view.entries.iter().map(|e| values(e.cell, &metric.key)).collect();
    Column {
        heading: metric.label.clone(),
        about: metric.description.clone(),
        texts: texts.collect(),
        best: (view.entries.len() > 1).then(|| best(&sets)),
    }
}

/// A metric of each run.
fn values(cell: &Cell, key: &str) -> Vec<f64> {
    cell.runs.iter().map(|r| r.metrics.get(key).copied().unwrap_or(f64::NAN)).collect()
}

/// By the metric with this key and label.
fn efficiency_columns(view: &SceneView, (by, by_label): (&str, &str)) -> Vec<Column> {
    if view.entries.iter().all(|e| e.cell.efficiency_by(by).is_none()) {
        return Vec::new();
    }
    let costs: Vec<Vec<f64>> = view.entries.iter().map(|e| e.cell.costs(by)).collect();
    let optional = |e: &Entry| e.cell.efficiency_by(by).map_or_else(|| "–".into(), |e| estimate(&e));
    let mut out = vec![Column {
        heading: format!("efficiency ({by_label})"),
        about: format!("1/({by_label} · seconds)"),
        texts: view.entries.iter().map(optional).collect(),
        best: (view.entries.len() > 1).then(|| best(&costs)),
    }];
    if view.entries.len() > 1 {
        let first = &view.entries[0].info.label;
        let texts = costs.iter().enumerate().map(|(i, c)| {
            if i == 0 {
                "1".into()
            } else {
                ratio(&costs[0], c).map_or_else(|| "–".into(), |r| ratio_text(&r))
            }
        });
        out.push(Column {
            heading: format!("ratio to {first}"),
            about: format!("efficiency over that of {first}, with the 95% interval of the ratio"),
            texts: texts.collect(),
            best: None,
        });
    }
    out
}

/// A ratio with its interval, and a word where it may be 1.
pub(super) fn ratio_text(r: &Ratio) -> String {
    let (value, interval) = match *r {
        Ratio::Bare(value) => return format!("{}×", significant(value, 3)),
        Ratio::Known(value, None) => {
            return format!("{}× (interval without end), not distinguishable from 1", significant(value, 3));
        }
        Ratio::Known(value, Some(interval)) => (value, interval),
    };
    if interval.low == interval.high {
        return format!("{}×", significant(value, 3));
    }
    let ends = [value, interval.low, interval.high].map(|v| significant(v, 3));
    let text = format!("{}× [{},\u{a0}{}]", ends[0], ends[1], ends[2]);
    if interval.contains(1.0) { format!("{text}, not distinguishable from 1") } else { text }
}

fn table(m: &mut Markup, view: &SceneView, columns: &[Column]) {
    m.tag("thead", &[], |m| {
        m.tag("tr", &[], |m| {
            m.leaf("th", &[("scope", &"col")], "estimator");
            for column in columns {
                m.leaf("th", &[("scope", &"col"), ("title", &column.about)], &column.heading);
            }
        });
    });
    m.tag("tbody", &[], |m| {
        for (i, entry) in view.entries.iter().enumerate() {
            m.tag("tr", &[("data-estimator", &entry.info.key)], |m| {
                m.tag("th", &[("scope", &"row")], |m| {
                    swatch(m, entry.index);
                    m.text(&entry.info.label);
                });
                for column in columns {
                    let is_best = column.best == Some(Best::One(i));
                    let class = if is_best { "number best" } else { "number" };
                    m.leaf("td", &[("class", &class)], &column.texts[i]);
                }
            });
        }
    });
    if columns.iter().any(|c| c.best.is_some()) {
        m.tag("tfoot", &[], |m| {
            m.tag("tr", &[], |m| {
                m.leaf("th", &[("scope", &"row")], "best");
                for column in columns {
                    m.leaf("td", &[], column.best.as_ref().map_or(String::new(), |b| verdict(b, view)));
                }
            });
        });
    }
}

fn verdict(best: &Best, view: &SceneView) -> String {
    let label = |i: &usize| view.entries[*i].info.label.as_str();
    match best {
        Best::One(i) => label(i).into(),
        Best::Among(all) if all.len() == view.entries.len() => "not distinguishable".into(),
        Best::Among(all) => {
            format!("not distinguishable: {}", all.iter().map(label).collect::<Vec<_>>().join(", "))
        }
        Best::Unknown => "not known".into(),
    }
}

fn note(view: &SceneView) -> String {
    let runs = view.entries.iter().map(|e| e.cell.runs.len());
    let (least, most) = (runs.clone().min().unwrap_or(0), runs.max().unwrap_or(0));
    if most < 2 {
        return "One run: there are no intervals, and nothing can be said about which is better.".into();
    }
    let few = if (2..LEAST_RUNS).contains(&least) {
        format!(" Variance and bias² have an interval from {LEAST_RUNS} runs on.")
    } else {
        String::new()
    };
    let runs = if least == most { format!("{most} runs") } else { format!("{least} to {most} runs") };
    format!(
        "Means over {runs}, with 95% confidence intervals. The reference's own noise is taken off where it adds up (MSE, relMSE, \
         efficiency), and variance and bias² add up to the MSE without it. The best is bold where Welch's t-test tells it from \
         every other at 5% in all (Šidák); else the last line lists those that cannot be told apart. The interval of a ratio of efficiencies (Fieller) \
         is for that one comparison alone.{few}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::results::Interval;

    #[test]
    fn ratios_say_when_they_may_be_one() {
        let text = |value, low, high| ratio_text(&Ratio::Known(value, Some(Interval { low, high })));
        assert_eq!(text(2.0, 1.5, 2.7), "2.00× [1.50,\u{a0}2.70]");
        assert_eq!(text(1.2, 0.9, 1.6), "1.20× [0.900,\u{a0}1.60], not distinguishable from 1");
        assert!(ratio_text(&Ratio::Known(2.0, None)).contains("without end"));
        assert_eq!(ratio_text(&Ratio::Bare(3.0)), "3.00×");
    }
}
