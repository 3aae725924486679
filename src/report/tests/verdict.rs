//! What is said of a scene in one sentence.

use super::synthetic::{Options, results};
use crate::experiment::results::{Estimate, Interval, Results};
use crate::report::context::Context;
use crate::report::verdict::verdict;
use std::path::Path;

/// Results in which estimators have these errors, run by run, in a second each.
fn with_errors(dir: &Path, errors: [[f64; 4]; 3]) -> Results {
    let mut results = results(dir, &Options { layers: false, ..Options::default() });
    for (cell, errors) in results.cells.iter_mut().zip(errors) {
        for (run, error) in cell.runs.iter_mut().zip(errors) {
            // By the MSE it would be the other way round.
            (run.seconds, run.relmse, run.mse) = (1.0, Some(error), Some(1.0 / error));
        }
        (cell.bias, cell.variance) = (None, None);
        for (share, caused) in cell.techniques.iter_mut().zip([0.2, 0.7, 0.1]) {
            share.caused = Some(known(caused, 0.05));
        }
    }
    results
}

fn known(mean: f64, half: f64) -> Estimate {
    Estimate { mean, interval: Some(Interval { low: mean - half, high: mean + half }) }
}

fn said(results: &Results) -> Option<String> {
    let dir = tempfile::tempdir().unwrap();
    verdict(&Context::new(dir.path(), results).scene(0), results.efficiency_metric())
}

#[test]
fn the_best_is_named_with_its_factor_and_what_the_other_loses_by() {
    let dir = tempfile::tempdir().unwrap();
    let [low, middle, high] = [[1.0, 1.1, 0.9, 1.0], [4.0, 4.4, 3.6, 4.0], [9.0, 9.9, 8.1, 9.0]];
    let mut results = with_errors(dir.path(), [middle, high, low]);
    let text = said(&results).unwrap();
    assert!(text.starts_with("bidirectional path tracing is 4.00× ["), "{text}");
    assert!(text.contains("as efficient (1/(relMSE · s)) as path tracing, the next. "), "{text}");
    let why = "Most of the variance of path tracing is caused by next-event estimation (70.0 % ±\u{a0}5.0).";
    assert!(text.ends_with(why), "{text}");
    // Less than a half, and what may be nothing.
    results.cells[0].techniques[1].caused = Some(known(0.4, 0.1));
    assert!(said(&results).unwrap().contains("The largest part of the variance of path tracing"));
    results.cells[0].techniques[1].caused = Some(known(0.4, 0.5));
    assert!(said(&results).unwrap().ends_with("the next."));
    // Where it is bias, no technique's variance is the reason.
    results.cells[0].techniques[1].caused = Some(known(0.7, 0.05));
    (results.cells[0].bias, results.cells[0].variance) = (Some(known(3.0, 0.5)), Some(known(1.0, 0.1)));
    assert!(said(&results).unwrap().ends_with("More of the error of path tracing is bias than variance."));
    results.cells[0].bias = Some(known(3.0, 2.5));
    assert!(said(&results).unwrap().ends_with(why), "not for sure");
}

/// It goes by the first metric of which there is an efficiency.
#[test]
fn the_metric_that_is_asked_for_decides() {
    let dir = tempfile::tempdir().unwrap();
    let [low, middle, high] = [[1.0, 1.1, 0.9, 1.0], [4.0, 4.4, 3.6, 4.0], [9.0, 9.9, 8.1, 9.0]];
    let mut results = with_errors(dir.path(), [middle, high, low]);
    let all = results.metrics.clone();
    let named = |key: &str| all.iter().find(|m| m.key == key).unwrap().clone();
    for (metrics, start) in [
        (&["flip", "relmse", "mse"][..], "bidirectional path tracing is 4.00× ["),
        (&["mse", "relmse"], "light tracing is 2.2"),
        (&["flip", "smape"], "light tracing is 2.2"),
    ] {
        results.metrics = metrics.iter().map(|key| named(key)).collect();
        let (text, by) = (said(&results).unwrap(), if start.starts_with("b") { "relMSE" } else { "MSE" });
        assert!(text.starts_with(start) && text.contains(&format!("(1/({by} · s))")), "{metrics:?}: {text}");
    }
}

#[test]
fn what_cannot_be_told_apart_is_said_to_be() {
    let dir = tempfile::tempdir().unwrap();
    let (a, b, high) = ([1.0, 1.1, 0.9, 1.0], [1.05, 1.15, 0.95, 1.0], [9.0, 9.9, 8.1, 9.0]);
    let text = said(&with_errors(dir.path(), [a, b, b])).unwrap();
    assert!(text.starts_with("path tracing is as efficient") && text.contains("as far as can be told"));
    assert!(text.ends_with("not distinguishable from 1."), "{text}");
    let text = said(&with_errors(dir.path(), [a, high, b])).unwrap();
    assert!(text.contains("not distinguishable from 1. path tracing is 9.00× ["), "{text}");
    assert!(text.contains("as light tracing, the last."), "{text}");
}

#[test]
fn nothing_is_said_where_nothing_is_compared() {
    let dir = tempfile::tempdir().unwrap();
    let mut results = with_errors(dir.path(), [[1.0; 4], [2.0; 4], [3.0; 4]]);
    results.cells.truncate(1);
    assert_eq!(said(&results), None);
    let mut results = with_errors(dir.path(), [[1.0; 4], [2.0; 4], [3.0; 4]]);
    for run in results.cells.iter_mut().flat_map(|c| &mut c.runs) {
        (run.mse, run.relmse) = (None, None);
        run.metrics.clear();
    }
    assert_eq!(said(&results), None, "no reference");
}
