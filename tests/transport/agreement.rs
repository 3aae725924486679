//! Rung 3: every set of techniques that can render a scene has the same mean image.

use crate::measure::{Means, runs};
use crate::scenes;
use tyndall::transport::{Heuristic, LightStarts, Renderer, Settings, Technique, TechniqueSet};

fn set(names: &str) -> TechniqueSet {
    TechniqueSet::parse(names.split(',')).expect("known names")
}

/// Path tracing is the yardstick: the other sets, and the power heuristic, must not differ from it.
fn agree(name: &str, iterations: u64, detectable: f64, others: &[&str]) {
    let scene = scenes::load(name);
    let mean = |techniques: TechniqueSet, heuristic, seed| {
        let settings = Settings { heuristic, max_length: 16, seed, ..Settings::new(techniques) };
        Means::of(&runs(&scene, &settings, 24, iterations))
    };
    let yardstick = mean(set("pt"), Heuristic::Balance, 1);
    for (i, other) in others.iter().enumerate() {
        let heuristic = if i % 2 == 0 { Heuristic::Balance } else { Heuristic::Power(2.0) };
        let means = mean(set(other), heuristic, 2 + i as u64);
        means.assert_same(&yardstick, &format!("{name}: {other} {heuristic:?} and pt"), detectable);
    }
}

#[test]
fn surfaces_agree() {
    agree("surfaces", 96, 0.01, &["bpt", "hit,lens", "lens", "nee,lens,connect"]);
}

#[test]
fn glass_agrees() {
    agree("glass", 128, 0.02, &["bpt", "hit,connect", "hit,lens"]);
}

#[test]
fn environment_agrees() {
    agree("environment", 96, 0.015, &["bpt", "hit,lens,connect", "hit,nee,lens"]);
}

/// Lights at a point and from one direction are not hit: the sets have to do without s = 0 for them.
#[test]
fn lights_agree() {
    agree("lights", 96, 0.025, &["bpt", "pt,lens", "pt,connect"]);
}

/// The same where a pilot says on which lights light subpaths start.
#[test]
fn lights_agree_whatever_light_subpaths_start_on() {
    let scene = scenes::load("lights");
    let mean = |names: &str, light_starts, seed| {
        let settings = Settings { light_starts, max_length: 16, seed, ..Settings::new(set(names)) };
        let renderer = Renderer::new(&scene, settings).expect("settings that make sense");
        let shares = renderer.starts().map(|q| (0..q.len()).map(|i| q.pdf(i)).collect::<Vec<_>>());
        (shares, Means::of(&runs(&scene, &settings, 24, 96)))
    };
    let (nothing, yardstick) = mean("pt", LightStarts::Pilot, 11);
    assert_eq!(nothing, None, "no light subpaths, nothing to share out");
    for (names, seed) in [("bpt", 12), ("pt,lens", 13)] {
        let (shares, means) = mean(names, LightStarts::Pilot, seed);
        let shares = shares.expect("there are several lights");
        let by_power = scene.lights.by_power();
        assert!(
            shares.iter().enumerate().any(|(i, q)| (q - by_power.pdf(i)).abs() > 0.05),
            "{shares:?} are much the powers'"
        );
        assert_eq!(shares.iter().sum::<f32>(), 1.0);
        means.assert_same(&yardstick, &format!("{names} with lights by a pilot, and pt"), 0.025);
    }
}

/// Each technique alone, divided by its weight where it can make all paths of a class, agrees with the others on
/// that class: single-scattered light can be made by each family.
#[test]
fn single_techniques_agree_on_direct_light() {
    let scene = scenes::load("surfaces");
    let of_length = |technique: Technique, length, seed| {
        let settings = Settings {
            min_length: length,
            max_length: length,
            seed,
            ..Settings::new(TechniqueSet::of(&[technique]))
        };
        Means::of(&runs(&scene, &settings, 16, 768))
    };
    let nee = of_length(Technique::NextEvent, 2, 1);
    of_length(Technique::Hit, 2, 2).assert_same(&nee, "hit and nee, two segments", 0.02);
    of_length(Technique::Lens, 2, 3).assert_same(&nee, "lens and nee, two segments", 0.01);
    let nee = of_length(Technique::NextEvent, 3, 4);
    of_length(Technique::Lens, 3, 5).assert_same(&nee, "lens and nee, three segments", 0.04);
    // Alone, a connection's 1/d² has no finite variance where walls meet: how sharp this is, is the seed's luck.
    of_length(Technique::Connect, 3, 7).assert_same(&nee, "connect and nee, three segments", 0.04);
}
