//! One sentence on a scene: which estimator is best and by how much; and one on what the other loses by.

use super::context::{Entry, SceneView};
use super::numbers::{percent, significant};
use super::statistics::{Ratio, ratio};
use super::table::ratio_text;
use crate::experiment::results::{Estimate, TechniqueShare};
use crate::experiment::statistics::mean;
use crate::transport::technique::TECHNIQUES;

/// The sentences; none where nothing is measured against a reference, or there is nothing to compare.
///
/// Estimators are compared by error · seconds, without the reference's noise, where the error is the metric with the key and label
/// `by`. The best is compared with the next, and where
/// these cannot be told apart, with the last, too.
pub(super) fn verdict(view: &SceneView, by: (&str, &str)) -> Option<String> {
    let costs = |e: &'_ Entry| {
        let costs = e.cell.costs(by.0);
        mean(&costs).filter(|mean| *mean > 0.0).map(|mean| (mean, costs))
    };
    let mut all: Vec<(&Entry, (f64, Vec<f64>))> =
        view.entries.iter().filter_map(|e| Some((e, costs(e)?))).collect();
    all.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
    let [(best, (_, least)), (next, (_, its)), rest @ ..] = &all[..] else { return None };
    let found = ratio(its, least)?;
    if told_apart(&found) {
        return Some(won(best, next, "the next", by.1, &found));
    }
    let equal = format!(
        "{} is as efficient (1/({} · s)) as {}, as far as can be told: {}.",
        best.info.label,
        by.1,
        next.info.label,
        ratio_text(&found)
    );
    let last = rest.last().and_then(|(last, (_, its))| Some((last, ratio(its, least)?)));
    Some(match last.filter(|(_, found)| told_apart(found)) {
        Some((last, found)) => format!("{equal} {}", won(best, last, "the last", by.1, &found)),
        None => equal,
    })
}

/// Whether two estimators differ, as far as is known: single runs do not say.
fn told_apart(ratio: &Ratio) -> bool {
    match ratio {
        Ratio::Bare(_) => true,
        Ratio::Known(_, interval) => interval.is_some_and(|i| !i.contains(1.0)),
    }
}

/// By how much the best is better than another one, and why.
fn won(best: &Entry, other: &Entry, place: &str, by: &str, ratio: &Ratio) -> String {
    let single = if matches!(ratio, Ratio::Bare(_)) { ", of one run, which says little" } else { "" };
    let (label, than) = (&best.info.label, &other.info.label);
    let factor = ratio_text(ratio);
    let text = format!("{label} is {factor} as efficient (1/({by} · s)) as {than}, {place}{single}.");
    [Some(text), blame(other)].into_iter().flatten().collect::<Vec<_>>().join(" ")
}

/// What most of an estimator's error is: its bias, or the variance that one technique causes. None where that is not known.
fn blame(entry: &Entry) -> Option<String> {
    let label = &entry.info.label;
    let surely = |e: &Estimate, least: f64| e.interval.is_some_and(|i| i.low > least);
    let split = entry.cell.bias.zip(entry.cell.variance);
    if split.is_some_and(|(bias, variance)| surely(&bias, variance.mean)) {
        return Some(format!("More of the error of {label} is bias than variance."));
    }
    let known = entry.cell.techniques.iter().filter_map(|t| Some((t, t.caused?)));
    let (technique, caused) = known.max_by(|a, b| a.1.mean.total_cmp(&b.1.mean))?;
    // What may be nothing is no reason; and one technique alone causes all, which is none either.
    if !surely(&caused, 0.0) || entry.cell.techniques.len() < 2 {
        return None;
    }
    let half = caused.interval.map_or(0.0, |i| 50.0 * (i.high - i.low));
    let part = if surely(&caused, 0.5) { "Most" } else { "The largest part" };
    Some(format!(
        "{part} of the variance of {label} is caused by {} ({} ±\u{a0}{}).",
        name(technique),
        percent(caused.mean),
        significant(half, 2)
    ))
}

fn name(share: &TechniqueShare) -> &str {
    let info = TECHNIQUES.iter().find(|t| t.key == share.technique);
    info.map_or(share.technique.as_str(), |i| i.label)
}
