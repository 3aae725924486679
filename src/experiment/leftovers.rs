//! Files in a folder of results that nothing needs: half written ones, and images of what the experiment does not have any more.

use super::metrics::TABLE;
use super::plan::Plan;
use super::store::{self, run_of};
use crate::render::files::entries;
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
    for path in entries(dir) {
        if path.is_dir() && !path.is_symlink() && path.file_name().is_none_or(|n| n != store::FOLDER) {
            if depth > 0 {
                remove_down_to(&path, depth - 1);
            }
        } else if store::is_partial(&path) && old(&path) == Some(true) {
            let _ = std::fs::remove_file(path);
        }
    }
}

/// What runs left in folders of scenes and estimators, and the experiment does not have: of estimators and scenes that were
/// taken out, of runs beyond their number, of metrics. What somebody else put there is not among it.
pub fn taken_out(plan: &Plan, out: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for scene in entries(out).into_iter().filter(|path| path.is_dir()) {
        let planned = plan.scenes.iter().any(|s| is_called(&scene, &s.key));
        for folder in entries(&scene).into_iter().filter(|path| path.join(SETTINGS).is_file()) {
            let planned = planned && plan.estimators.iter().any(|e| is_called(&folder, &e.key));
            found.extend(entries(&folder).into_iter().filter(|file| match made(file) {
                None => false,
                Some(_) if !planned => true,
                Some(Made::Run(run)) => run >= plan.runs,
                Some(Made::Error(key)) => !plan.metrics.iter().any(|metric| metric.description().key == key),
                Some(Made::Other) => false,
            }));
        }
    }
    found
}

/// Deletes these files, and the folders that are empty without them.
///
/// # Errors
/// The first file that cannot be deleted.
pub fn delete(files: &[PathBuf]) -> std::io::Result<()> {
    for file in files {
        std::fs::remove_file(file)?;
    }
    for folder in files.iter().filter_map(|file| file.parent()) {
        // One with something in it stays.
        if std::fs::remove_dir(folder).is_ok() {
            let _ = folder.parent().map(std::fs::remove_dir);
        }
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
