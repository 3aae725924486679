//! What each technique costs: how much shorter an iteration is without it.
//!
//! Walks, structures and weights are shared by the techniques, so that their times do not add up to the whole: a technique's
//! share is what leaving it out, and nothing else, would save. Radii and counts stay as they are. Sets are measured in turn,
//! several times around, so that what else the machine does falls on all of them.

use super::hash::Hasher;
use super::results::Estimate;
use super::shares::ratio;
use crate::error::Result;
use crate::film::output::write_bytes;
use crate::render::{Engine, Observer};
use crate::scene::Scene;
use crate::transport::settings::{Layers, Settings};
use crate::transport::technique::{Technique, TechniqueSet};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;

/// How often each set is measured.
const ROUNDS: usize = 5;
/// Seconds that one measurement takes at least, if its iterations are shorter.
const LEAST_SECONDS: f64 = 0.02;

/// Seconds an iteration, round by round.
#[derive(Serialize, Deserialize)]
struct Seconds {
    /// Of the whole set.
    whole: Vec<f64>,
    /// Without each technique, by its key; none for those that are left out of the set as it is.
    without: Vec<(String, Vec<f64>)>,
}

/// The share of an iteration's time that each technique costs, read from `file` if it was measured before. Empty where one
/// technique is alone. The observer is told of the renders under that name.
///
/// # Errors
/// Settings that make no sense; a file that cannot be written.
pub fn costs(
    scene: &Scene,
    settings: &Settings,
    file: &Path,
    (name, observer): (&str, &mut dyn Observer),
) -> Result<Vec<(Technique, Estimate)>> {
    if settings.techniques.iter().count() < 2 {
        return Ok(Vec::new());
    }
    let known = std::fs::read(file).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
    let seconds: Seconds = match known {
        Some(seconds) => seconds,
        None => {
            let seconds = measure(scene, settings, name, observer)?;
            write_bytes(file, &serde_json::to_vec(&seconds).expect("numbers have a JSON form"))?;
            seconds
        }
    };
    let share = |technique: Technique| {
        let (_, without) = seconds.without.iter().find(|(key, _)| key == technique.info().key)?;
        let pairs = seconds.whole.iter().zip(without);
        let values: Vec<[f64; 2]> = pairs.map(|(all, less)| [all - less, *all]).collect();
        Some((technique, ratio(&values)?))
    };
    Ok(settings.techniques.iter().filter_map(share).collect())
}

/// Names what is measured: what decides the samples, and the machine.
pub fn file_name(unit: &str, clock: &str) -> String {
    let mut hasher = Hasher::default();
    hasher.field(unit.as_bytes()).field(clock.as_bytes());
    format!("{}.json", &hasher.hex()[..16])
}

/// Seconds an iteration: of the whole set, then without each technique of it.
fn measure(scene: &Scene, settings: &Settings, name: &str, observer: &mut dyn Observer) -> Result<Seconds> {
    let pinned = Settings { layers: Layers::None, ..settings.pinned(scene) };
    let active: Vec<Technique> = pinned.active().iter().collect();
    let without = |technique: &Technique| {
        let others = pinned.techniques.without(TechniqueSet::of(&[*technique]));
        Settings { techniques: others, ..pinned }
    };
    let sets = std::iter::once(pinned).chain(active.iter().map(without));
    let mut engines = sets.map(|s| Engine::new(scene, s)).collect::<Result<Vec<_>>>()?;
    let mut outcomes: Vec<_> = engines.iter().map(Engine::nothing_yet).collect();
    let mut seconds = vec![Vec::new(); engines.len()];
    let what = format!("{name}: what techniques cost, each left out in turn");
    observer.begin_steps(&what, ((ROUNDS + 1) * engines.len()) as u64, "renders");
    let mut done = 0;
    for round in 0..=ROUNDS {
        for ((engine, outcome), seconds) in engines.iter_mut().zip(&mut outcomes).zip(&mut seconds) {
            let (start, mut count) = (Instant::now(), 0u32);
            while count == 0 || start.elapsed().as_secs_f64() < LEAST_SECONDS {
                engine.iterations(outcome.film.iterations(), 1, outcome);
                count += 1;
            }
            // The first round warms up.
            if round > 0 {
                seconds.push(start.elapsed().as_secs_f64() / f64::from(count));
            }
            done += 1;
            observer.step(done);
        }
    }
    observer.end_steps();
    let mut seconds = seconds.into_iter();
    let whole = seconds.next().expect("the whole set is measured first");
    let keys = active.iter().map(|t| t.info().key.to_owned());
    Ok(Seconds { whole, without: keys.zip(seconds).collect() })
}
