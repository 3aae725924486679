//! How far an experiment has come: what is done, under way and left.

use super::cell::SceneContext;
use super::plan::Plan;
use super::reference::{Maker, Making};
use super::run::{clock, load_scenes};
use super::store::{COSTS, FOLDER, SceneKey, Unit, is_busy};
use super::{leftovers, moved};
use crate::error::Result;
use crate::render::{Budget, Silent, Spent, Stop};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// How far one estimator has come in one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The scene's key.
    pub scene: String,
    /// The estimator's key.
    pub estimator: String,
    /// What each run may use.
    pub budget: Budget,
    /// Runs at the end of their budget.
    pub done: u32,
    /// Runs that a process is at.
    pub busy: u32,
    /// Runs that were begun and that no process is at.
    pub begun: u32,
    /// Runs in all.
    pub runs: u32,
    /// Iterations on disk, of all runs.
    pub iterations: u64,
    /// Seconds that they took.
    pub seconds: f64,
    /// Seconds of rendering that are left, where that can be told.
    pub left: Option<f64>,
}

/// How far the reference of a scene has come that is rendered.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceRow {
    /// The scene's key.
    pub scene: String,
    /// How much is asked for.
    pub budget: Budget,
    /// Iterations on disk.
    pub iterations: u64,
    /// Seconds that they took.
    pub seconds: f64,
    /// Whether that is all that is asked for.
    pub done: bool,
    /// Whether a process is at it.
    pub busy: bool,
    /// Seconds of rendering that are left, where that can be told.
    pub left: Option<f64>,
}

/// How far an experiment has come.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// A row a scene whose reference is rendered.
    pub references: Vec<ReferenceRow>,
    /// A row a scene and estimator.
    pub rows: Vec<Row>,
    /// Whether it is measured, in the end, what techniques cost.
    pub costs: bool,
    /// Runs that are there and are not found: of scenes under another name, of estimators with more layers.
    pub hints: Vec<String>,
    /// Folders of runs with other settings, contents or code, and the bytes in them.
    pub stale: Vec<(PathBuf, u64)>,
    /// Images and the like of estimators, scenes, runs and metrics that the experiment does not have any more, and their bytes.
    pub taken_out: (Vec<PathBuf>, u64),
}

/// Looks at the folder of results `out`, and at that of references: runs that end at an error are named by their reference
/// too, and nothing is known of them as long as it is not there.
///
/// # Errors
/// Anything wrong with the scenes.
pub fn status(plan: &Plan, out: &Path, cache: &Path) -> Result<Status> {
    let scenes = load_scenes(plan)?;
    let (clock, stop) = (clock(), Stop::default());
    let (mut references, mut rows, mut hints) = (Vec::new(), Vec::new(), Vec::new());
    let mut current = HashSet::new();
    for (entry, scene) in plan.scenes.iter().zip(&scenes) {
        let key = SceneKey::new(scene)?;
        hints.extend(moved::hint(plan, entry, &key, out));
        let measured = plan.estimators.iter().any(|e| matches!(e.budget, Budget::RelMse { .. }));
        let mut maker = Maker { cache, stop: &stop, observer: &mut Silent, frozen: true };
        references.extend(maker.making(entry, scene, &key)?.map(|making| reference(&entry.key, &making)));
        let truth = if measured { maker.obtain(entry, scene, &key).ok().flatten() } else { None };
        let truth = truth.as_ref();
        let (key, clock, stop) = (&key, &clock, &stop);
        let context = SceneContext { plan, entry, scene, truth, out, key, clock, frozen: true, stop };
        hints.extend(moved::fuller(&context)?);
        for estimator in &plan.estimators {
            let mut row = Row {
                scene: entry.key.clone(),
                estimator: estimator.key.clone(),
                budget: estimator.budget,
                done: 0,
                busy: 0,
                begun: 0,
                runs: plan.runs,
                iterations: 0,
                seconds: 0.0,
                left: None,
            };
            let mut left = Vec::new();
            for run in 0..plan.runs {
                let (unit, work) = context.unit(estimator, run)?;
                current.insert(unit.folder().to_owned());
                let header = unit.peek(work.budget);
                let state = header.as_ref().map_or((0, 0.0), |h| (h.iterations, h.seconds));
                let (iterations, seconds) = with_ahead(&unit, state);
                row.iterations += iterations;
                row.seconds += seconds;
                if header.is_some_and(|h| h.is_done(work.budget)) {
                    row.done += 1;
                    continue;
                }
                left.push((iterations, seconds));
                if unit.is_busy() {
                    row.busy += 1;
                } else if iterations > 0 {
                    row.begun += 1;
                }
            }
            row.left = time_left(&row, &left);
            rows.push(row);
        }
    }
    let taken_out = leftovers::taken_out(plan, out);
    let size = taken_out.iter().filter_map(|file| file.metadata().ok()).map(|m| m.len()).sum();
    let (stale, taken_out) = (stale(out, &current), (taken_out, size));
    Ok(Status { references, rows, costs: plan.figures.costs, hints, stale, taken_out })
}

/// How far a reference has come.
fn reference(scene: &str, making: &Making) -> ReferenceRow {
    let budget = making.budget();
    let (iterations, seconds) = making.there();
    let done = !budget.goes_on(Spent::new(iterations, seconds));
    let left =
        if done { Some(0.0) } else { left_of(budget, (iterations, seconds), seconds / iterations as f64) };
    let busy = is_busy(making.folder());
    ReferenceRow { scene: scene.to_owned(), budget, iterations, seconds, done, busy, left }
}

/// Iterations and seconds with those of blocks that were rendered ahead.
fn with_ahead(unit: &Unit, (iterations, seconds): (u64, f64)) -> (u64, f64) {
    let ahead = unit.blocks_ahead().into_iter().filter(|(first, _)| *first >= iterations);
    let known = ahead.filter_map(|(first, end)| Some((end - first, unit.seconds_ahead(first, end)?)));
    known.fold((iterations, seconds), |sum, block| (sum.0 + block.0, sum.1 + block.1))
}

/// Seconds that the runs which are not done will take, from what those before them took.
fn time_left(row: &Row, left: &[(u64, f64)]) -> Option<f64> {
    let an_iteration = row.seconds / row.iterations as f64;
    let of = |at: &(u64, f64)| left_of(row.budget, *at, an_iteration);
    // From +0: the empty sum of floats is −0.
    left.iter().map(of).try_fold(0.0, |sum, seconds| Some(sum + seconds?))
}

/// Seconds that are left of a budget after so many iterations and seconds, where an iteration takes so long.
fn left_of(budget: Budget, (iterations, seconds): (u64, f64), an_iteration: f64) -> Option<f64> {
    match budget {
        Budget::Spp(spp) => {
            Some(spp.saturating_sub(iterations) as f64 * an_iteration).filter(|v| v.is_finite())
        }
        Budget::Seconds(limit) => Some((limit - seconds).max(0.0)),
        Budget::RelMse { .. } => None,
    }
}

/// Folders of runs that the plan does not have.
fn stale(out: &Path, current: &HashSet<PathBuf>) -> Vec<(PathBuf, u64)> {
    let Ok(entries) = std::fs::read_dir(out.join(FOLDER)) else { return Vec::new() };
    let other = |p: &PathBuf| p.is_dir() && !p.ends_with(COSTS) && !current.contains(p);
    let others = entries.flatten().map(|e| e.path()).filter(other);
    let mut found: Vec<(PathBuf, u64)> = others.map(|path| (path.clone(), bytes(&path))).collect();
    found.sort();
    found
}

fn bytes(folder: &Path) -> u64 {
    let Ok(entries) = std::fs::read_dir(folder) else { return 0 };
    entries.flatten().filter_map(|e| e.metadata().ok()).map(|m| m.len()).sum()
}
