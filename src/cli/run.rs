//! `tyndall run`, and what it has in common with `status` and `merge`.

use super::args::{ExperimentArgs, RunArgs};
use super::folder::announce;
use super::progress::Progress;
use super::session::{Ending, print, stop_on_interrupt, with_threads};
#[cfg(not(feature = "mpi"))]
use crate::error::Error;
use crate::error::Result;
use crate::experiment::overrides::Override;
use crate::experiment::plan::{self, Plan};
use crate::experiment::results::{Cell, Estimate, Results};
use crate::experiment::run::{self, Options, Part};
use crate::report::statistics::{Ratio, ratio};
use crate::report::{plural, report_of};
use std::path::{Path, PathBuf};

/// Runs an experiment, and writes its page.
///
/// # Errors
/// Anything wrong with the experiment or its scenes, before anything is rendered; files that cannot be written.
pub fn run(args: &RunArgs) -> Result<Ending> {
    #[cfg(feature = "mpi")]
    if super::ranks::are_launched() {
        return super::ranks::run(args);
    }
    #[cfg(not(feature = "mpi"))]
    if std::env::var("OMPI_COMM_WORLD_SIZE").is_ok_and(|size| size != "1") {
        return Err(Error::usage(
            "mpirun started this, but it was built without MPI: build it with --features mpi (scripts/install-mpi.sh installs what \
             that needs)",
        ));
    }
    alone(args)
}

/// Runs it in this process.
///
/// # Errors
/// As [`run`].
pub fn alone(args: &RunArgs) -> Result<Ending> {
    let (plan, out, cache) = open(&args.of)?;
    announce(&args.of, &plan, &out);
    let stop = stop_on_interrupt()?;
    let part = args.shard.map_or(Part::All, |(index, of)| Part::Shard { index, of });
    let options = Options { out: &out, cache: &cache, stop: &stop, part };
    let mut progress = Progress::new().with_tev(args.tev.as_deref());
    let results = with_threads(args.of.threads, || run::run(&plan, &options, &mut progress))?;
    if let Some((index, of)) = args.shard {
        let state = if stop.requested() { "stopped" } else { "done" };
        print(format!("shard {} of {of}: {state}; the runs are in {}\n", index + 1, out.display()))?;
        return Ok(Ending::from(&stop));
    }
    show(&out, &results)?;
    Ok(Ending::from(&stop))
}

/// Writes the page, and prints what came out.
///
/// # Errors
/// Files that cannot be written.
pub fn show(out: &Path, results: &Results) -> Result<()> {
    let [scenes, estimators] = [(results.scenes.len(), "scene"), (results.estimators.len(), "estimator")]
        .map(|(n, noun)| plural(n as u64, noun));
    eprintln!("page and figures of {scenes} and {estimators}");
    let report = report_of(out, results)?;
    for problem in &report.problems {
        eprintln!("warning: {problem}");
    }
    print(summary(results))?;
    if results.partial {
        print("These results are partial.\n")?;
    }
    let figures = out.join("figures");
    if !report.figures.is_empty() {
        print(format!("figures as SVG, PDF and PNG: {}\n", figures.display()))?;
    }
    print(format!("{}\n", report.page.display()))
}

/// The plan of an experiment, and the folders of results and of references.
///
/// # Errors
/// Anything wrong with the experiment or with what is changed of it.
pub fn open(args: &ExperimentArgs) -> Result<(Plan, PathBuf, PathBuf)> {
    let overrides: Result<Vec<Override>> = args.overrides.iter().map(|text| Override::parse(text)).collect();
    let plan = plan::read(&args.experiment, &overrides?)?;
    let out = args.out.clone().unwrap_or_else(|| Path::new("results").join(&plan.name));
    let cache = args.cache.clone().unwrap_or_else(|| default_cache(&out));
    Ok((plan, out, cache))
}

/// Beside the results, so that experiments share it.
pub fn default_cache(out: &Path) -> PathBuf {
    let parent = out.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    parent.join(".references")
}

/// A line a scene and estimator.
fn summary(results: &Results) -> String {
    let main = results.metrics.first();
    let label = main.map_or("", |m| m.label.as_str());
    let several = results.estimators.len() > 1;
    let (by, by_label) = results.efficiency_metric();
    let efficiency = format!("1/({by_label}·s)");
    let over = results.estimators.first().filter(|_| several).map(|e| format!("over {}", e.key));
    let mut text = format!(
        "{:<20} {:<16} {:>9} {:>10}  {label:<32} {efficiency:<32} {}\n",
        "scene",
        "estimator",
        "spp",
        "seconds",
        over.unwrap_or_default()
    );
    for cell in &results.cells {
        let metric = main.and_then(|m| cell.metric(&m.key));
        let first = results.estimators.first().and_then(|e| results.cell(&cell.scene, &e.key));
        let faster = first.filter(|f| f.estimator != cell.estimator).map(|first| speed_up(first, cell, by));
        let line = format!(
            "{:<20} {:<16} {:>9.1} {:>10.2}  {:<32} {:<32} {}",
            cell.scene,
            cell.estimator,
            cell.spp.mean,
            cell.seconds.mean,
            with_interval(metric),
            with_interval(cell.efficiency_by(by)),
            faster.unwrap_or_default()
        );
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

/// How much more efficient, by a metric, a cell is than another, where that can be told.
fn speed_up(first: &Cell, cell: &Cell, by: &str) -> String {
    match ratio(&first.costs(by), &cell.costs(by)) {
        None => "-".into(),
        Some(Ratio::Bare(value)) => format!("{}×, of one run", number(value)),
        Some(Ratio::Known(_, None)) => "not distinguishable".into(),
        Some(Ratio::Known(_, Some(i))) if i.contains(1.0) => {
            format!("not distinguishable [{}, {}]", number(i.low), number(i.high))
        }
        Some(Ratio::Known(value, Some(i))) => {
            format!("{}× [{}, {}]", number(value), number(i.low), number(i.high))
        }
    }
}

fn with_interval(estimate: Option<Estimate>) -> String {
    match estimate {
        None => "-".into(),
        Some(Estimate { mean, interval: None }) => number(mean),
        Some(Estimate { mean, interval: Some(i) }) => {
            format!("{} [{}, {}]", number(mean), number(i.low), number(i.high))
        }
    }
}

/// Four significant digits.
fn number(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-3..1e6).contains(&size) {
        return format!("{value:.3e}");
    }
    let before = if size >= 1.0 { size.log10().floor() as usize + 1 } else { 1 };
    format!("{value:.*}", 4usize.saturating_sub(before))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        for (value, text) in [
            (0.0, "0.000"),
            (0.12345, "0.123"),
            (-12.345, "-12.35"),
            (480.54, "480.5"),
            (123456.0, "123456"),
            (1.5e-5, "1.500e-5"),
            (2.5e7, "2.500e7"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn references_are_kept_beside_the_results() {
        assert_eq!(default_cache(Path::new("results/a")), Path::new("results/.references"));
        assert_eq!(default_cache(Path::new("a")), Path::new("./.references"));
    }
}
