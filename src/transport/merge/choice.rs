//! The numbers of merges, and how far camera subpaths go on, that give the least error for what they cost.
//!
//! The error of other numbers is that of [`super::evidence`], their cost that of [`super::cost`]; the product is what a render of a given
//! time comes to. From what is asked, or as many merges of each technique, one number after the other is moved along its ladder as long
//! as the product falls. Both are estimates, and the more there is, the more they leave out: a technique is left out unless it gains clearly.

use super::cost;
use super::evidence::{Counts, Evidence};
use super::pilot::Pilot;
use super::settings::MERGES;
use crate::scene::Scene;

/// What may be chosen.
#[derive(Clone, Debug)]
pub struct Open {
    /// Where to start.
    pub counts: Counts,
    /// The most of each technique: 1, the pilot's, or less. By technique in the order of [`MERGES`].
    pub most: [f64; MERGES.len()],
    /// Whether the number of a technique's merges is open.
    pub merges: [bool; MERGES.len()],
    /// Whether a technique may be left out.
    pub may_leave: [bool; MERGES.len()],
    /// Whether continuations are open.
    pub continuations: bool,
    /// Whether it is open if lights are connected with the lens.
    pub direct: bool,
}

/// Steps of the numbers of merges, relative to where they start.
const STEPS: [f64; 5] = [1.0 / 64.0, 1.0 / 16.0, 0.25, 1.0, 4.0];
/// Steps of continuations.
const CONTINUATIONS: [f32; 8] = [0.05, 0.2, 0.4, 0.6, 0.7, 0.8, 0.9, 1.0];
/// A move has to make the product so much smaller,
const CLEARLY: f64 = 0.97;
/// and where it is not so much larger without a technique, that is left out.
const WORTHLESS: f64 = 1.04;
/// Rounds over all numbers at most.
const ROUNDS: usize = 4;

/// The best of what is open.
pub fn choose(scene: &Scene, pilots: &[Pilot], evidence: &Evidence, open: &Open) -> Counts {
    let product = |counts: &Counts| evidence.error(counts) * cost::mean(scene, pilots, counts);
    let start = open.counts.clone();
    let mut best = start.clone();
    let mut least = product(&best);
    for _ in 0..ROUNDS {
        let before = best.clone();
        if open.direct {
            let other = Counts { direct: !best.direct, ..best.clone() };
            take(&mut best, &mut least, vec![other], &product, CLEARLY);
        }
        if open.continuations {
            let all = |q: f32| Counts { continuations: vec![q; best.continuations.len()], ..best.clone() };
            let candidates: Vec<Counts> = CONTINUATIONS.into_iter().map(all).collect();
            take(&mut best, &mut least, candidates, &product, CLEARLY);
            for medium in 0..best.continuations.len() {
                let one = |q: f32| {
                    let mut counts = best.clone();
                    counts.continuations[medium] = q;
                    counts
                };
                let candidates: Vec<Counts> = CONTINUATIONS.into_iter().map(one).collect();
                take(&mut best, &mut least, candidates, &product, CLEARLY);
            }
        }
        for i in (0..MERGES.len()).filter(|i| open.merges[*i] && start.merges[*i] > 0.0) {
            let with = |n: f64| {
                let mut counts = best.clone();
                counts.merges[i] = n;
                counts
            };
            let candidates: Vec<Counts> =
                STEPS.into_iter().map(|step| with((step * start.merges[i]).min(open.most[i]))).collect();
            let without = with(0.0);
            take(&mut best, &mut least, candidates, &product, CLEARLY);
            if open.may_leave[i] {
                take(&mut best, &mut least, vec![without], &product, WORTHLESS);
            }
        }
        if best == before {
            break;
        }
    }
    best
}

/// Takes the best of the candidates if it is so much better.
fn take(
    best: &mut Counts,
    least: &mut f64,
    candidates: Vec<Counts>,
    product: &impl Fn(&Counts) -> f64,
    enough: f64,
) {
    let found = candidates.into_iter().map(|c| (product(&c), c)).min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((value, counts)) = found
        && value < enough * *least
    {
        (*least, *best) = (value, counts);
    }
}
