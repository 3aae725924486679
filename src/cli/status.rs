//! `tyndall status`.

use super::args::StatusArgs;
use super::folder::announce;
use super::progress::clock;
use super::run::open;
use super::session::{Ending, print, with_threads};
use crate::error::{Error, Result};
use crate::experiment::leftovers::{delete, folders_of};
use crate::experiment::status::{ReferenceRow, Row, Status, status};
use crate::experiment::store::FOLDER;
use crate::render::Budget;
use crate::report::plural;
use std::path::Path;

/// Tells how far an experiment has come.
///
/// # Errors
/// Anything wrong with the experiment or its scenes.
pub fn run(args: &StatusArgs) -> Result<Ending> {
    let (plan, out, cache) = open(&args.of)?;
    announce(&args.of, &plan, &out);
    let status = with_threads(args.of.threads, || status(&plan, &out, &cache))?;
    print(text(&status))?;
    for hint in &status.hints {
        print(format!("{hint}\n"))?;
    }
    let bytes: u64 = status.stale.iter().map(|(_, bytes)| bytes).sum();
    let stale = plural(status.stale.len() as u64, "run");
    let (files, of_files) = &status.taken_out;
    let (count, of_files) = (plural(files.len() as u64, "file"), size(*of_files));
    let folders: Vec<String> = folders_of(files).iter().map(|folder| folder.display().to_string()).collect();
    let folders = folders.join(", ");
    if args.prune {
        for (folder, _) in &status.stale {
            std::fs::remove_dir_all(folder).map_err(|e| Error::io(folder, "delete it", &e))?;
        }
        delete(files)?;
        print(format!("deleted {stale} of before, {}\n", size(bytes)))?;
        if !files.is_empty() {
            print(format!(
                "deleted {count} of what was taken out of the experiment, {of_files}, in {folders}\n"
            ))?;
        }
        return Ok(Ending::Done);
    }
    if !status.stale.is_empty() {
        let (size, place) = (size(bytes), out.join(FOLDER));
        print(format!(
            "{stale} of other settings, scene contents or code take {size} in {}: --prune deletes them\n",
            Path::display(&place)
        ))?;
    }
    if !files.is_empty() {
        print(format!(
            "{count} of scenes, estimators, runs and metrics that were taken out of the experiment take {of_files} in {folders}: \
             --prune deletes them\n"
        ))?;
    }
    Ok(Ending::Done)
}

fn size(bytes: u64) -> String {
    match bytes {
        0..1_000_000 => format!("{:.0} kB", bytes as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

/// A line a reference, one a scene and estimator, and one for all.
fn text(status: &Status) -> String {
    let mut text = format!(
        "{:<20} {:<16} {:>16} {:>6} {:>6} {:>6} {:>9} {:>12} {:>12}\n",
        "scene", "estimator", "done", "at it", "begun", "left", "spp", "rendered", "to go"
    );
    let left = |seconds: Option<f64>| seconds.map_or_else(|| "unknown".into(), clock);
    for row in &status.references {
        let ReferenceRow { scene, budget, iterations, seconds, done, busy, .. } = row;
        let part = match budget {
            Budget::Seconds(limit) => format!("{seconds:.1} of {limit} s"),
            Budget::Spp(_) | Budget::RelMse { .. } => format!("{iterations} of {budget}"),
        };
        let begun = !done && !busy && *iterations > 0;
        let [busy, begun, open] = [*busy, begun, !done && !busy && !begun].map(u32::from);
        text.push_str(&format!(
            "{scene:<20} {:<16} {part:>16} {busy:>6} {begun:>6} {open:>6} {iterations:>9} {:>12} {:>12}\n",
            "the reference",
            clock(*seconds),
            left(row.left),
        ));
    }
    for row in &status.rows {
        let Row { scene, estimator, done, busy, begun, runs, .. } = row;
        let (done_text, spp) = (format!("{done} of {runs}"), row.iterations);
        text.push_str(&format!(
            "{scene:<20} {estimator:<16} {done_text:>16} {busy:>6} {begun:>6} {:>6} {spp:>9} {:>12} {:>12}\n",
            runs - done - busy - begun,
            clock(row.seconds),
            left(row.left),
        ));
    }
    text.push_str(&last_line(status));
    text
}

/// What is done in all, and what is to come.
fn last_line(status: &Status) -> String {
    let parts = || status.references.iter().map(|r| r.left).chain(status.rows.iter().map(|r| r.left));
    // From +0: the empty sum of floats is −0.
    let known = parts().flatten().fold(0.0, |sum, seconds| sum + seconds);
    let (done, runs) = status.rows.iter().fold((0, 0), |(d, n), r| (d + r.done, n + r.runs));
    let references = status.references.iter().filter(|r| r.done).count();
    let of_references = match status.references.len() {
        0 => String::new(),
        1 => format!(" and {references} of 1 reference"),
        n => format!(" and {references} of {n} references"),
    };
    let left = match (parts().all(|left| left.is_some()), known > 0.0) {
        (true, _) => format!("{} of rendering to go", clock(known)),
        (false, true) => {
            format!("at least {} of rendering to go, a part of it cannot be told yet", clock(known))
        }
        (false, false) => "what is left cannot be told yet".into(),
    };
    let whole = done == runs && references == status.references.len();
    let then = match (whole, status.costs) {
        (true, _) => "",
        (false, false) => ", and then measuring",
        (false, true) => ", and then measuring, with what each technique costs",
    };
    format!("{done} of {runs} runs{of_references} are done; {left}{then}\n")
}
