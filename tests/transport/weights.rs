//! Rung 2: the renderer's weights and contributions are those of the oracle, for paths that it really sampled.

use crate::collect::{pass, trace_pixel};
use crate::merges::edges_are_longer;
use crate::oracle::{Verdict, judge};
use crate::scenes;
use glam::{DVec3, UVec2};
use tyndall::scene::Scene;
use tyndall::transport::mis::{Link, Pending, connection_weight};
use tyndall::transport::{Heuristic, Settings, Technique, TechniqueSet};

/// Shortest edges of which f32 is compared (metres). Positions are rounded to 1e-7, so of an edge of a millimetre the direction is known
/// to 1e-4, and on which side of a surface an end lies need not be the same for f32 and f64.
const LEAST_EDGE: f32 = 0.002;
/// Largest relative difference that f32 arithmetic explains.
const TOLERANCE_F32: f64 = 1e-3;
/// The recursion in f64 on the oracle's own densities.
const TOLERANCE_F64: f64 = 1e-6;

pub fn settings(techniques: TechniqueSet, heuristic: Heuristic) -> Settings {
    Settings { heuristic, max_length: 9, seed: 11, ..Settings::new(techniques) }
}

/// The weight of technique s by the recursion, run in f64 from the oracle's p, r and c.
fn recursion(verdict: &Verdict, s: usize, heuristic: Heuristic) -> f64 {
    let k = verdict.p.len() - 1;
    let raise = |x: f64| heuristic.raise(x);
    // p and r are products with all geometry in them, so ρ is taken as 1 and r_{i-1} as the geometry.
    let side = |own: &[f64], other: &[f64], counts: &[f64]| -> f64 {
        let mut total = 0.0;
        let mut link = Link { density: 1.0, behind: 0.0, count: 0.0 };
        for i in 0..own.len() {
            let sum = if i == 0 { 0.0 } else { link.leave(false, Pending::NONE, 1.0).known };
            let geometry = if i == 0 { 0.0 } else { raise(other[i - 1]) };
            link = Link::next(raise(own[i]), sum, geometry, raise(counts[i]));
            total = link.close(0.0, 1.0, raise(other[i]));
        }
        total
    };
    let light = side(&verdict.p[..s], &verdict.r[..s], &verdict.c[..s]);
    let reversed = |v: &[f64]| v.iter().rev().copied().collect::<Vec<f64>>();
    // The camera side pairs vertex i with c_{i+1}; c_{k+1} is 0.
    let mut counts = verdict.c[s + 1..].to_vec();
    counts.push(0.0);
    let camera = side(&reversed(&verdict.r[s..=k]), &reversed(&verdict.p[s..=k]), &reversed(&counts));
    connection_weight(raise(verdict.c[s]), light, camera)
}

pub struct Seen {
    samples: usize,
    pub by_technique: [usize; Technique::COUNT],
}

impl Seen {
    /// Adds what was seen by technique to a total.
    pub fn add_to(&self, total: &mut [usize; Technique::COUNT]) {
        for (total, new) in total.iter_mut().zip(self.by_technique) {
            *total += new;
        }
    }
}

pub fn check(name: &str, scene: &Scene, settings: &Settings, iterations: u64) -> Seen {
    let beta = match settings.heuristic {
        Heuristic::Balance => 1.0,
        Heuristic::Power(beta) => f64::from(beta),
    };
    let mut seen = Seen { samples: 0, by_technique: [0; Technique::COUNT] };
    let size = scene.camera.size();
    for iteration in 0..iterations {
        let pass = pass(scene, settings, iteration);
        for y in (0..size.y).step_by(3) {
            for x in (0..size.x).step_by(3) {
                for traced in trace_pixel(scene, settings, iteration, UVec2::new(x, y)) {
                    let sample = &traced.sample;
                    let s = sample.s as usize;
                    let verdict = judge(scene, &pass, &traced.path, traced.made_by());
                    let what = || {
                        format!("{name} {} {:?}\n{verdict:?}\n{:?}", settings.techniques, sample, traced.path)
                    };
                    let sum: f64 = verdict.techniques().map(|t| verdict.weight(t, beta)).sum();
                    assert!((sum - 1.0).abs() < 1e-9, "weights sum to {sum}: {}", what());
                    if !edges_are_longer(scene, &traced.path, LEAST_EDGE) {
                        continue;
                    }
                    let weight = verdict.weight(traced.made_by(), beta);
                    let difference = (f64::from(sample.weight) - weight).abs();
                    assert!(difference <= TOLERANCE_F32 * weight, "weight {weight}: {}", what());
                    let recursive = recursion(&verdict, s, settings.heuristic);
                    assert!(
                        (recursive - weight).abs() <= TOLERANCE_F64 * weight,
                        "f64 {recursive}: {}",
                        what()
                    );
                    let expected = verdict.contribution / verdict.density(traced.made_by());
                    let got = sample.contribution.as_dvec3();
                    if pass.tracks {
                        check_tracked(got, expected, sample.technique, &what());
                    } else {
                        assert!(
                            (got - expected).abs().max_element() <= TOLERANCE_F32 * expected.max_element(),
                            "contribution {expected}: {}",
                            what()
                        );
                    }
                    seen.samples += 1;
                    seen.by_technique[sample.technique.index()] += 1;
                }
            }
        }
    }
    seen
}

/// Where media are tracked, a flight's contribution is without their transmittance, which is grey, and a shadow ray's has an estimate
/// of it: the channels are to each other as the oracle has them, and what is hit brings no less.
fn check_tracked(got: DVec3, expected: DVec3, technique: Technique, what: &str) {
    let passed = expected.max_element() / got.max_element();
    assert!(
        (got * passed - expected).abs().max_element() <= TOLERANCE_F32 * expected.max_element(),
        "contribution {expected}, tracked {got}: {what}"
    );
    assert!(technique != Technique::Hit || passed <= 1.0 + TOLERANCE_F32, "more than is sent passes: {what}");
}

#[test]
fn weights_and_contributions_are_the_oracles() {
    for (name, scene) in scenes::all() {
        let mut seen = [0; Technique::COUNT];
        for heuristic in [Heuristic::Balance, Heuristic::Power(2.0), Heuristic::Power(1.3)] {
            for techniques in TechniqueSet::connections() {
                let result = check(name, &scene, &settings(techniques, heuristic), 1);
                result.add_to(&mut seen);
            }
        }
        for technique in TechniqueSet::of_connections().iter() {
            assert!(
                seen[technique.index()] > 0 || scenes::without(name).contains(&technique),
                "{name} never exercised {technique:?}"
            );
        }
    }
}
