//! Files in a folder of results that nothing needs: half written ones, and images of what the experiment does not have any more.

use super::metrics::TABLE;
use super::plan::Plan;
use super::store::{self, run_of};
use crate::error::{Error, Result};
use crate::film::exr::read_text;
use crate::render::files::{REFERENCE, entries, folders};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Folders that deep hold files of an experiment: those of estimators.
const DEPTH: u32 = 2;

/// Deletes files that a process left half written an hour ago or more.
pub fn remove_half_written(out: &Path) {
    remove_down_to(out, DEPTH);
}

fn remove_down_to(dir: &Path, depth: u32) {
    let old = |path: &Path| {
        let modified = path.metadata().and_then(|m| m.modified()).ok()?;
        Some(modified.elapsed().ok()? > Duration::from_secs(3600))
    };
    for path in entries(dir).into_iter().filter(|path| store::is_partial(path) && old(path) == Some(true)) {
        let _ = std::fs::remove_file(path);
    }
    if depth > 0 {
        let below = folders(dir).into_iter().filter(|path| !is_called(path, store::FOLDER));
        below.for_each(|path| remove_down_to(&path, depth - 1));
    }
}

/// What runs left in folders of scenes and estimators, and the experiment does not have: of estimators and scenes that were
/// taken out, of runs beyond their number, of metrics. What somebody else put there is not among it. In the order in which it may be
/// deleted: what tells that a folder is an estimator's comes last.
pub fn taken_out(plan: &Plan, out: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for scene in folders(out) {
        let planned = plan.scenes.iter().any(|s| is_called(&scene, &s.key));
        for folder in folders(&scene).into_iter().filter(|path| path.join(SETTINGS).is_file()) {
            let planned = planned && plan.estimators.iter().any(|e| is_called(&folder, &e.key));
            let is_over = |file: &PathBuf| match made(file) {
                None => false,
                Some(_) if !planned => true,
                Some(Made::Run(run)) => run >= plan.runs,
                Some(Made::Error(key)) => !plan.metrics.iter().any(|metric| metric.description().key == key),
                Some(Made::Other) => false,
            };
            let (last, others): (Vec<PathBuf>, Vec<PathBuf>) =
                entries(&folder).into_iter().filter(is_over).partition(|file| is_called(file, SETTINGS));
            found.extend(others.into_iter().chain(last));
        }
        let reference = scene.join("reference.exr");
        if !planned && read_text(&reference, REFERENCE).is_some() {
            found.extend([scene.join("reference.png"), reference].into_iter().filter(|file| file.is_file()));
        }
    }
    found
}

/// The folders that files lie in, each once.
pub fn folders_of(files: &[PathBuf]) -> Vec<&Path> {
    let mut folders: Vec<&Path> = files.iter().filter_map(|file| file.parent()).collect();
    folders.dedup();
    folders
}

/// Deletes these files, and the folders that are empty without them. What is gone already is no error.
///
/// # Errors
/// The first file that cannot be deleted.
pub fn delete(files: &[PathBuf]) -> Result<()> {
    for file in files {
        match std::fs::remove_file(file) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                return Err(Error::io(file, "delete it", &e));
            }
            _ => {}
        }
    }
    for folder in folders_of(files) {
        // One with something in it stays.
        let _ = std::fs::remove_dir(folder);
        let _ = folder.parent().map(std::fs::remove_dir);
    }
    Ok(())
}

/// The resolved settings of an estimator's runs, in its folder.
pub const SETTINGS: &str = "settings.toml";

/// What a file in the folder of an estimator is of.
enum Made {
    Run(u32),
    Error(&'static str),
    Other,
}

fn made(file: &Path) -> Option<Made> {
    let name = file.file_name()?.to_str()?;
    if let Some(run) = run_of(name) {
        return Some(Made::Run(run));
    }
    let others = [
        SETTINGS,
        "run-00.png",
        "mean.exr",
        "mean.png",
        "error.exr",
        "statistics.exr",
        super::csv::FIGURE_GEN_FILE_NAME,
    ];
    if others.contains(&name) {
        return Some(Made::Other);
    }
    let key = name.strip_prefix("error-")?.strip_suffix(".png")?;
    TABLE.iter().map(|metric| metric.key).find(|known| *known == key).map(Made::Error)
}

fn is_called(path: &Path, name: &str) -> bool {
    path.file_name().is_some_and(|n| n == name)
}
