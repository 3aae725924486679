//! Where the results of an experiment are, said before anything happens there.

use super::args::ExperimentArgs;
use crate::error::from_root;
use crate::experiment::plan::Plan;
use crate::experiment::store::FOLDER;
use std::path::{Path, PathBuf};

/// Names the folder of results whole, says what of the experiment file changes nothing, and where results of the same
/// experiment are if not there.
pub fn announce(args: &ExperimentArgs, plan: &Plan, out: &Path) {
    eprintln!("results of {}: {}", plan.name, from_root(out).display());
    for warning in &plan.warnings {
        eprintln!("warning: {warning}");
    }
    if args.out.is_some() || out.exists() {
        return;
    }
    if let Some(other) = elsewhere(&args.experiment, &plan.name, out) {
        eprintln!(
            "warning: there are results of an experiment of this name in {other}, and none here yet: --out {other} goes on with those",
            other = other.display()
        );
    }
}

/// Results of an experiment where they would be if it had been run from its own folder, or from the one about that.
fn elsewhere(experiment: &Path, name: &str, out: &Path) -> Option<PathBuf> {
    // Without `..`, so that it can be read and copied.
    let experiment = experiment.canonicalize().unwrap_or_else(|_| from_root(experiment));
    let folder = experiment.parent()?;
    let places = [Some(folder), folder.parent()].into_iter().flatten();
    let mut found = places.map(|place| place.join("results").join(name));
    found.find(|place| *place != from_root(out) && place.join(FOLDER).is_dir())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_found_beside_the_experiment_and_above_it() {
        let root = tempfile::tempdir().unwrap();
        let experiment = root.path().join("experiments/a.toml");
        let here = root.path().join("elsewhere/results/a");
        assert_eq!(elsewhere(&experiment, "a", &here), None);
        let above = root.path().join("results/a");
        std::fs::create_dir_all(above.join(FOLDER)).unwrap();
        assert_eq!(elsewhere(&experiment, "a", &here), Some(above.clone()));
        assert_eq!(elsewhere(&experiment, "b", &here), None, "another experiment");
        assert_eq!(elsewhere(&experiment, "a", &above), None, "these are the ones that are meant");
        let beside = root.path().join("experiments/results/a");
        std::fs::create_dir_all(beside.join(FOLDER)).unwrap();
        assert_eq!(elsewhere(&experiment, "a", &here), Some(beside));
    }
}
