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
//! `convergence.csv` has the same columns without `partial`, a row a checkpoint of a run and metric.

use super::results::{Results, Run};
use crate::error::Result;
use crate::film::output::write_bytes;
use std::fmt::Write;
use std::path::Path;

/// Name of the table of final values.
pub const FILE_NAME: &str = "results.csv";

/// Name of the table of values on the way.
pub const CONVERGENCE_FILE_NAME: &str = "convergence.csv";

/// Writes both tables into the folder of results.
///
/// # Errors
/// Where a file cannot be written.
pub fn write(results: &Results, dir: &Path) -> Result<()> {
    write_bytes(&dir.join(FILE_NAME), table(results).as_bytes())?;
    write_bytes(&dir.join(CONVERGENCE_FILE_NAME), convergence(results).as_bytes())
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
