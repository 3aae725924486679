//! Rung 2 for merges: weights and contributions of merges, and of connections beside them, are those of the oracle.

use crate::collect::{Traced, starts, thinning, trace_all_merges, trace_merges};
use crate::merging::set;
use crate::oracle::{FullPath, judge};
use crate::scenes;
use glam::{UVec2, Vec3A};
use tyndall::math::{Stream, StreamKind};
use tyndall::scene::Scene;
use tyndall::transport::merge::settings::Continuation;
use tyndall::transport::merge::{Beams, GatherNow, Gathers, MergeSettings};
use tyndall::transport::pass::Pass;
use tyndall::transport::technique::PRESETS;
use tyndall::transport::walk::Place;
use tyndall::transport::{Heuristic, Settings, Technique, TechniqueSet};

/// Largest relative difference that f32 arithmetic explains: directions of edges of a few centimetres enter several times.
const TOLERANCE: f64 = 2e-3;

/// Light subpaths; each technique uses another number of them, and another radius.
const PATHS: [u64; 5] = [2000, 1750, 1500, 1250, 1000];
const RADII: [f32; 5] = [0.12, 0.2, 0.15, 0.13, 0.1];

pub fn gathers() -> Gathers {
    Gathers { of: std::array::from_fn(|i| GatherNow { radius: RADII[i], paths: PATHS[i] }) }
}

/// Whether all edges of a path are longer than this (metres): f32 rounds the directions of shorter ones too coarsely.
pub fn edges_are_longer(scene: &Scene, path: &FullPath, least: f32) -> bool {
    let first = usize::from(scene.lights.is_infinite(&path.light));
    (first..path.interior.len() + 1).all(|i| position(path, i).distance(position(path, i + 1)) > least)
}

fn position(path: &FullPath, i: usize) -> Vec3A {
    match i {
        0 => path.light.p,
        i if i == path.interior.len() + 1 => path.lens,
        i => path.interior[i - 1].position(),
    }
}

/// Whether all edges are 5 cm long, and beams that pass each other do so at more than 3 degrees.
fn clear(scene: &Scene, traced: &Traced) -> bool {
    let path = &traced.path;
    let infinite = scene.lights.is_infinite(&path.light);
    let position = |i| position(path, i);
    let long = edges_are_longer(scene, path, 0.05);
    let Some((i, light)) = &path.merged else { return long };
    let here = light.position();
    let before = if *i == 1 && infinite { path.light.n } else { position(i - 1) - here };
    let after = position(i + 1) - position(*i);
    long && before.length() > 0.05 && before.normalize().cross(after.normalize()).length() > 0.05
}

#[derive(Default)]
pub struct Seen([usize; Technique::COUNT]);

impl Seen {
    /// Merges by a technique.
    pub fn of(&self, technique: Technique) -> usize {
        self.0[technique.index()]
    }
}

pub fn check(name: &str, scene: &Scene, settings: Settings, seen: &mut Seen) {
    let beta = match settings.heuristic {
        Heuristic::Balance => 1.0,
        Heuristic::Power(beta) => f64::from(beta),
    };
    let size = scene.camera.size();
    let pixels = u64::from(size.x * size.y);
    let pass = Pass::new(settings, 3, gathers(), pixels, thinning(scene), starts(scene));
    let pixels: Vec<UVec2> =
        (0..size.y).step_by(5).flat_map(|y| (0..size.x).step_by(5).map(move |x| UVec2::new(x, y))).collect();
    for traced in trace_merges(scene, &pass, &pixels) {
        if !clear(scene, &traced) {
            continue;
        }
        let (sample, made_by) = (&traced.sample, traced.made_by());
        let verdict = judge(scene, &pass, &traced.path, made_by);
        let what = || {
            format!(
                "{name} {} {:?}\n{sample:?}\n{verdict:?}\n{:?}",
                settings.techniques, settings.merging, traced.path
            )
        };
        let sum: f64 = verdict.techniques().map(|t| verdict.weight(t, beta)).sum();
        assert!((sum - 1.0).abs() < 1e-9, "weights sum to {sum}: {}", what());
        let weight = verdict.weight(made_by, beta);
        let difference = (f64::from(sample.weight) - weight).abs();
        assert!(difference <= TOLERANCE * weight, "weight {weight}: {}", what());
        let expected = verdict.contribution / verdict.density(made_by);
        let difference = (sample.contribution.as_dvec3() - expected).abs().max_element();
        assert!(difference <= TOLERANCE * expected.max_element(), "contribution {expected}: {}", what());
        seen.0[sample.technique.index()] += 1;
    }
}

/// Presets that merge, with short and long beams, in a scene of many media.
pub fn check_presets(name: &str) {
    let scene = scenes::load(name);
    let mut seen = Seen::default();
    for (i, names) in
        ["upbp", "pb2d", "bb1d", "upbp,bp2d", "bp2d", "pp3d", "upbp,bp2d", "bb1d"].into_iter().enumerate()
    {
        let kind = |bit: usize| if i >> bit & 1 == 0 { Beams::Short } else { Beams::Long };
        let merging = MergeSettings {
            photon_beams: kind(0),
            camera_beams: kind(1),
            camera_continuation: Continuation::All(0.4),
            ..MergeSettings::default()
        };
        let heuristic = if i % 3 == 2 { Heuristic::Power(2.0) } else { Heuristic::Balance };
        for seed in [7, 8] {
            let settings = Settings { heuristic, merging, max_length: 6, seed, ..Settings::new(set(names)) };
            check(name, &scene, settings, &mut seen);
        }
    }
    for technique in [Technique::PointPoint, Technique::PointBeam, Technique::BeamPoint, Technique::BeamBeam]
    {
        assert!(seen.of(technique) > 20, "{name}: {technique:?}");
    }
}

/// Every preset, and sets drawn at random, with short and long beams of either kind.
fn cases() -> Vec<(TechniqueSet, bool)> {
    let mut cases: Vec<_> = PRESETS.iter().map(|p| (TechniqueSet::of(p.techniques), p.first)).collect();
    cases.retain(|(set, _)| set.merges());
    let all: Vec<TechniqueSet> = TechniqueSet::subsets().filter(|s| s.merges()).collect();
    let mut random = Stream::new(17, 0, StreamKind::Other, 0);
    cases.extend((0..10).map(|_| (all[(random.next_1d() * all.len() as f32) as usize], false)));
    cases.push((TechniqueSet::all(), false));
    cases
}

#[test]
fn weights_and_contributions_of_merges_are_the_oracles() {
    for (name, scene) in scenes::all() {
        let mut seen = Seen::default();
        for (i, (techniques, first)) in cases().into_iter().enumerate() {
            let kind = |bit: usize| if i >> bit & 1 == 0 { Beams::Short } else { Beams::Long };
            let merging = MergeSettings {
                photon_beams: kind(0),
                camera_beams: kind(1),
                first,
                camera_continuation: Continuation::All(0.4),
                ..MergeSettings::default()
            };
            let heuristic = if i % 3 == 2 { Heuristic::Power(2.0) } else { Heuristic::Balance };
            for seed in [7, 8] {
                let settings =
                    Settings { heuristic, merging, max_length: 6, seed, ..Settings::new(techniques) };
                check(name, &scene, settings, &mut seen);
            }
        }
        let merged = |t: Technique| seen.0[t.index()];
        assert!(merged(Technique::Surface) > 8, "{name}: {:?}", seen.0);
        if scene.traits.scattering {
            for technique in
                [Technique::PointPoint, Technique::PointBeam, Technique::BeamPoint, Technique::BeamBeam]
            {
                assert!(merged(technique) > 20, "{name}: {:?}", seen.0);
            }
        }
    }
}

/// A ball of milk in fog, with kernels that reach from one into the other: what is merged is in one medium, on either side.
#[test]
fn nothing_is_merged_across_media() {
    let scene = scenes::of(
        "[film]\nwidth = 24\nheight = 24\n[camera]\norigin = [0, 0, 3]\ntarget = [0, 0, 0]\nfov = 40\n\
         [medium.fog]\nsigma_a = 0\nsigma_s = 1\n[medium.milk]\nsigma_a = 0\nsigma_s = 3\n[material.nothing]\nnull = {}\n\
         [[shape]]\nsphere = { radius = 1 }\nmaterial = 'nothing'\ninterior = 'fog'\n\
         [[shape]]\nsphere = { radius = 0.5 }\nmaterial = 'nothing'\ninterior = 'milk'\n\
         [[light]]\npoint = { position = [0, 2, 0], intensity = 1 }\n",
    );
    let wide = Gathers { of: std::array::from_fn(|_| GatherNow { radius: 0.3, paths: 1000 }) };
    let mut seen = [[0; 2]; Technique::COUNT];
    for beams in [Beams::Short, Beams::Long] {
        let merging = MergeSettings { photon_beams: beams, camera_beams: beams, ..MergeSettings::default() };
        let settings = Settings { merging, max_length: 5, ..Settings::new(TechniqueSet::all()) };
        for traced in trace_all_merges(&scene, settings, 0, wide) {
            let Some((i, Place::Medium(light))) = &traced.path.merged else { continue };
            let Place::Medium(camera) = &traced.path.interior[i - 1] else { panic!("{traced:?}") };
            assert_eq!(light.medium, camera.medium, "{:?} {beams:?}", traced.sample);
            seen[traced.sample.technique.index()][light.medium as usize] += 1;
        }
    }
    for technique in [Technique::PointPoint, Technique::PointBeam, Technique::BeamPoint, Technique::BeamBeam]
    {
        assert!(seen[technique.index()].iter().all(|n| *n > 100), "{technique:?}: {seen:?}");
    }
}
