//! Results of the schema before, in which a metric's value still had the reference's noise in it.

use super::results::{Results, SCHEMA};
use serde_json::{Map, Value};

/// Reads results of schema 1.
///
/// # Errors
/// Damaged ones.
pub fn read(text: &str) -> serde_json::Result<Results> {
    let mut results: Value = serde_json::from_str(text)?;
    results["schema"] = SCHEMA.into();
    for cell in results["cells"].as_array_mut().into_iter().flatten() {
        let mut noises = Vec::new();
        for summary in cell["summary"].as_array_mut().into_iter().flatten().filter_map(Value::as_object_mut) {
            let Some(corrected) = summary.remove("corrected").filter(|c| !c.is_null()) else { continue };
            if let Some(measured) = summary.insert("value".into(), corrected) {
                summary.insert("measured".into(), measured);
            }
            let key = summary.get("metric").and_then(Value::as_str).map(str::to_owned);
            noises.extend(key.zip(summary.get("noise").and_then(Value::as_f64)));
        }
        for run in cell["runs"].as_array_mut().into_iter().flatten() {
            let measured = without(&mut run["metrics"], &noises);
            run["measured"] = Value::Object(measured);
            for checkpoint in run["checkpoints"].as_array_mut().into_iter().flatten() {
                without(&mut checkpoint["metrics"], &noises);
            }
        }
    }
    serde_json::from_value(results)
}

/// Takes the noise off; what was there.
fn without(metrics: &mut Value, noises: &[(String, f64)]) -> Map<String, Value> {
    let mut measured = Map::new();
    let Some(metrics) = metrics.as_object_mut() else { return measured };
    for (key, noise) in noises {
        let Some(value) = metrics.get_mut(key) else { continue };
        // What is not finite is `null`, and stays so.
        let less = value.as_f64().map_or(Value::Null, |v| (v - noise).into());
        measured.insert(key.clone(), std::mem::replace(value, less));
    }
    measured
}

#[cfg(test)]
mod tests {
    use super::super::results::{Estimate, FILE_NAME, read};

    /// As version 0.1.0 wrote it, but for what does not matter here.
    const OLD: &str = r#"{
        "schema": 1, "experiment": "e", "title": "E", "description": "", "program": "tyndall 0.1.0",
        "machine": {"cpu": "unknown", "cores": 1, "threads": 1}, "started": "", "finished": "", "partial": false, "runs": 1,
        "metrics": [], "scenes": [], "estimators": [], "warnings": [],
        "figures": {"strip": false, "comparison": true, "techniques": false, "pyramid": null, "convergence": true},
        "cells": [{
            "scene": "box", "estimator": "pt", "min_length": 1, "max_length": 9, "variance": null, "efficiency": null,
            "variance_efficiency": null, "seconds": {"mean": 1, "interval": null}, "spp": {"mean": 4, "interval": null},
            "convergence": [], "warnings": [],
            "files": {"png": "", "exr": "", "mean_exr": "", "mean_png": "", "error_exr": null, "error_png": {}, "layers": []},
            "summary": [
                {"metric": "mse", "value": {"mean": 0.5, "interval": null}, "noise": 0.125,
                 "corrected": {"mean": 0.375, "interval": null}},
                {"metric": "flip", "value": {"mean": 0.25, "interval": null}, "noise": null, "corrected": null}],
            "runs": [{
                "index": 0, "seed": 7, "spp": 4, "seconds": 1, "camera_paths": 1, "light_paths": 0, "dropped": {},
                "partial": false, "mean": [1, 1, 1], "metrics": {"mse": 0.5, "flip": 0.25}, "exr": "",
                "checkpoints": [{"spp": 1, "seconds": 0.2, "metrics": {"mse": 2.125}},
                                {"spp": 2, "seconds": 0.3, "metrics": {"mse": null}}]}]}]
    }"#;

    #[test]
    fn noise_is_taken_off_what_older_results_have() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join(FILE_NAME), OLD).unwrap();
        let results = read(dir.path()).unwrap();
        let (cell, run) = (&results.cells[0], &results.cells[0].runs[0]);
        let value = |mean| Some(Estimate { mean, interval: None });
        assert_eq!((cell.metric("mse"), cell.summary[0].measured), (value(0.375), value(0.5)));
        assert_eq!((cell.metric("flip"), cell.summary[1].measured), (value(0.25), None));
        assert_eq!((run.metrics["mse"], run.metrics["flip"]), (0.375, 0.25));
        assert_eq!((run.measured.len(), run.measured["mse"]), (1, 0.5));
        assert_eq!(run.checkpoints[0].metrics["mse"], 2.0);
        assert!(run.checkpoints[1].metrics["mse"].is_nan());
        assert_eq!(cell.costs("mse"), [0.375]);
    }
}
