//! The results as tables for other programs: `pandas.read_csv("results.csv")`.
//!
//! `results.csv` has a row a (scene, estimator, run, metric), in the tidy form: a column a variable. Beside the
//! metrics of the experiment there is `mean`, the mean of the image over pixels and channels.
//!
//! | column | meaning |
//! |---|---|
//! | scene, estimator | keys |
//! | run | from 0 |
//! | seed | of the run |
//! | spp | samples per pixel |
//! | seconds | rendering, wall clock |
//! | partial | `true` where the run was stopped early |
//! | metric | its key |
//! | value | its value |
//!
//! `<scene>/<estimator>/convergence.json` is `{"timesteps": […], "data": [{"relmse": …, …}, …]}`, the form that figure-gen reads: seconds of
//! rendering, and for each the mean over the runs of every metric that is computed on the way; `spp` beside it has the samples.
//!
//! `convergence.csv` has the same columns without `partial`, a row a checkpoint of a run and metric.

use super::results::{Cell, Curve, Results, Run};
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
    let mut text = String::from("scene,estimator,run,seed,spp,seconds,partial,metric,value\n");
    for_each_run(results, |scene, estimator, run| {
        let mean = run.mean.iter().sum::<f64>() / 3.0;
        let values = run.metrics.iter().map(|(k, v)| (k.as_str(), *v)).chain([("mean", mean)]);
        for (metric, value) in values {
            let Run { index, seed, spp, seconds, partial, .. } = run;
            writeln!(text, "{scene},{estimator},{index},{seed},{spp},{seconds},{partial},{metric},{value:e}")
                .expect("writing to a string does not fail");
        }
    });
    text
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
