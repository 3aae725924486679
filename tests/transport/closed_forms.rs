//! Rung 4: scenes whose radiance is known.

use crate::measure::{Means, runs};
use crate::scenes;
use tyndall::transport::{Heuristic, Settings, TechniqueSet};

/// Radiance inside a diffuse sphere with reflectance and emission 1/2 is 1 everywhere; cut after K segments it is
/// 1 - 2^-K. Every set that has a technique for each length has to find it, whatever the heuristic.
#[test]
fn the_furnace_is_one_for_every_set() {
    let scene = scenes::load("furnace");
    for heuristic in [Heuristic::Balance, Heuristic::Power(2.0)] {
        for techniques in TechniqueSet::connections() {
            let expected = furnace_radiance(techniques, 10);
            let settings = Settings { heuristic, max_length: 10, ..Settings::new(techniques) };
            let means = Means::of(&runs(&scene, &settings, 16, 128));
            means.assert_mean(&format!("furnace {techniques} {heuristic:?}"), expected, 0.025);
        }
    }
}

/// What a set finds of the furnace's radiance: each length adds 2^-k if some technique of the set can make it.
fn furnace_radiance(techniques: TechniqueSet, max_length: i32) -> f64 {
    use tyndall::transport::Technique::*;
    (1..=max_length)
        .filter(|k| {
            techniques.has(Hit)
                || techniques.has(Lens)
                || (*k >= 2 && techniques.has(NextEvent))
                || (*k >= 3 && techniques.has(Connect))
        })
        .map(|k| 0.5f64.powi(k))
        .sum()
}
