//! The results as tables for other programs: `pandas.read_csv("results.csv")`.
//!
//! `results.csv` has a row a number, in the tidy form: a column a variable.
//!
//! | column | meaning |
//! |---|---|
//! | scene, estimator | keys |
//! | run | from 0; empty for a number over all runs |
//! | seed | of the run; empty likewise |
//! | spp | samples per pixel of the run; over all runs, their mean |
//! | seconds | rendering, wall clock; over all runs, their mean |
//! | partial | `true` where the run, or one of them, was stopped early |
//! | metric | see below |
//! | value | its value |
//! | low, high | 95% confidence interval of a number over all runs; empty where there is none, and for a single run |
//!
//! | metric | of | meaning |
//! |---|---|---|
//! | `relmse`, … | each run, their mean | the metrics of the experiment, as the page shows them: without the reference's noise where that is known |
//! | `relmse_measured`, `mse_measured` | each run, their mean | these with that noise, as measured against the reference |
//! | `mean` | each run, their mean | the mean of the image over pixels and channels |
//! | `spp`, `seconds` | each run, their mean | as the columns, with intervals |
//! | `variance`, `bias2`, `efficiency`, `variance_efficiency` | all runs | see [`Cell`]; `efficiency` is 1/(MSE · seconds) |
//! | `relmse_efficiency` | all runs | 1/(relMSE · seconds), where the relMSE was asked for |
//! | `energy.nee`, … | all runs | share of the energy that a technique carries, see [`TechniqueShare`] |
//! | `variance.nee`, … | all runs | variance of its own image over that of the whole |
//! | `caused.nee`, … | all runs | share of the variance that it causes |
//! | `time.nee`, … | all runs | share of the time that leaving it out saves |
//!
//! `<scene>/<estimator>/convergence.json` is `{"timesteps": […], "data": [{"relmse": …, …}, …]}`, the form that figure-gen reads: seconds of
//! rendering, and for each the mean over the runs of every metric that is computed on the way; `spp` beside it has the samples.
//!
//! `convergence.csv` has the same columns without `partial` and intervals, a row a checkpoint of a run and metric, without the
//! reference's noise where that is known.

use super::measure::estimate;
use super::results::{Cell, Curve, Estimate, Interval, Results, Run, TechniqueShare};
use crate::error::Result;
use crate::film::output::write_bytes;
use std::fmt::Write;
use std::path::Path;

/// Name of the table of final values.
pub const FILE_NAME: &str = "results.csv";

/// Name of the table of values on the way.
pub const CONVERGENCE_FILE_NAME: &str = "convergence.csv";

/// Name of a cell's curves.
pub const FIGURE_GEN_FILE_NAME: &str = "convergence.json";

/// Writes both tables, and the cells' curves, into the folder of results.
///
/// # Errors
/// Where a file cannot be written.
pub fn write(results: &Results, dir: &Path) -> Result<()> {
    write_bytes(&dir.join(FILE_NAME), table(results).as_bytes())?;
    write_bytes(&dir.join(CONVERGENCE_FILE_NAME), convergence(results).as_bytes())?;
    for cell in results.cells.iter().filter(|c| !c.convergence.is_empty()) {
        let path = dir.join(&cell.scene).join(&cell.estimator).join(FIGURE_GEN_FILE_NAME);
        write_bytes(&path, figure_gen(cell).to_string().as_bytes())?;
    }
    Ok(())
}

/// The curves of a cell as figure-gen reads them.
fn figure_gen(cell: &Cell) -> serde_json::Value {
    let points = &cell.convergence[0].points;
    let at = |spp: u64| -> serde_json::Value {
        let value =
            |c: &Curve| Some((c.metric.clone(), c.points.iter().find(|p| p.spp == spp)?.value.mean.into()));
        serde_json::Value::Object(cell.convergence.iter().filter_map(value).collect())
    };
    serde_json::json!({
        "timesteps": points.iter().map(|p| p.seconds).collect::<Vec<_>>(),
        "spp": points.iter().map(|p| p.spp).collect::<Vec<_>>(),
        "data": points.iter().map(|p| at(p.spp)).collect::<Vec<_>>(),
    })
}

/// Keys consist of letters, digits and a few signs, and numbers of digits: nothing needs quotes.
fn table(results: &Results) -> String {
    let mut text = String::from("scene,estimator,run,seed,spp,seconds,partial,metric,value,low,high\n");
    for cell in &results.cells {
        let mut row = |who: [String; 5], metric: &str, value: f64, interval: Option<Interval>| {
            let [run, seed, spp, seconds, partial] = who;
            let (scene, estimator) = (&cell.scene, &cell.estimator);
            write!(text, "{scene},{estimator},{run},{seed},{spp},{seconds},{partial},{metric},{value:e},")
                .expect("writing to a string does not fail");
            match interval {
                Some(i) => writeln!(text, "{:e},{:e}", i.low, i.high),
                None => writeln!(text, ","),
            }
            .expect("writing to a string does not fail");
        };
        for run in &cell.runs {
            for (metric, value) in of_run(run) {
                let Run { index, seed, spp, seconds, partial, .. } = run;
                let who = [
                    index.to_string(),
                    seed.to_string(),
                    spp.to_string(),
                    seconds.to_string(),
                    partial.to_string(),
                ];
                row(who, &metric, value, None);
            }
        }
        let partial = cell.runs.iter().any(|r| r.partial).to_string();
        let (spp, seconds) = (cell.spp.mean.to_string(), cell.seconds.mean.to_string());
        for (metric, e) in of_all(cell) {
            let who = [String::new(), String::new(), spp.clone(), seconds.clone(), partial.clone()];
            row(who, &metric, e.mean, e.interval);
        }
    }
    text
}

/// The mean of a run's image over pixels and channels.
fn mean_of(run: &Run) -> f64 {
    run.mean.iter().sum::<f64>() / 3.0
}

/// What a metric is called where the reference's noise is still in it.
fn measured(key: &str) -> String {
    format!("{key}_measured")
}

/// The numbers of a run.
fn of_run(run: &Run) -> Vec<(String, f64)> {
    let mut rows: Vec<_> = run.metrics.iter().map(|(key, value)| (key.clone(), *value)).collect();
    rows.extend(run.measured.iter().map(|(key, value)| (measured(key), *value)));
    rows.extend([
        ("mean".into(), mean_of(run)),
        ("spp".into(), run.spp as f64),
        ("seconds".into(), run.seconds),
    ]);
    rows
}

/// The numbers over all runs.
fn of_all(cell: &Cell) -> Vec<(String, Estimate)> {
    let mut rows: Vec<(String, Estimate)> =
        cell.summary.iter().map(|s| (s.metric.clone(), s.value)).collect();
    rows.extend(cell.summary.iter().filter_map(|s| Some((measured(&s.metric), s.measured?))));
    let mean = estimate(&cell.runs.iter().map(mean_of).collect::<Vec<_>>());
    rows.extend(mean.map(|mean| ("mean".into(), mean)));
    rows.extend([("spp".into(), cell.spp), ("seconds".into(), cell.seconds)]);
    let whole = [
        ("variance", cell.variance),
        ("bias2", cell.bias),
        ("efficiency", cell.efficiency),
        ("relmse_efficiency", cell.efficiency_by("relmse")),
        ("variance_efficiency", cell.variance_efficiency),
    ];
    rows.extend(whole.into_iter().filter_map(|(name, e)| Some((name.to_owned(), e?))));
    for share in &cell.techniques {
        let TechniqueShare { technique, energy, variance, caused, time } = share;
        let parts =
            [("energy", Some(*energy)), ("variance", *variance), ("caused", *caused), ("time", *time)];
        rows.extend(parts.into_iter().filter_map(|(name, e)| Some((format!("{name}.{technique}"), e?))));
    }
    rows
}

fn convergence(results: &Results) -> String {
    let mut text = String::from("scene,estimator,run,seed,spp,seconds,metric,value\n");
    for_each_run(results, |scene, estimator, run| {
        for point in &run.checkpoints {
            for (metric, value) in &point.metrics {
                let (index, seed, spp, seconds) = (run.index, run.seed, point.spp, point.seconds);
                writeln!(text, "{scene},{estimator},{index},{seed},{spp},{seconds},{metric},{value:e}")
                    .expect("writing to a string does not fail");
            }
        }
    });
    text
}

fn for_each_run(results: &Results, mut f: impl FnMut(&str, &str, &Run)) {
    for cell in &results.cells {
        for run in &cell.runs {
            f(&cell.scene, &cell.estimator, run);
        }
    }
}
