//! Rung 3 in media: every set of techniques that can render a scene has the same mean image.
//!
//! In a volume 1/d² has an infinite variance: where a point light or the camera is in a medium, a set needs two techniques
//! for the paths that end there, or an empty bubble about it.

use crate::measure::{Means, sharp_runs};
use crate::scenes;
use tyndall::scene::Scene;
use tyndall::transport::{Heuristic, Settings, TechniqueSet};

/// The first set is the yardstick; the others, every second with the power heuristic, must not differ from it. With
/// `TYNDALL_STUDY=1` a bias of 1% is seen everywhere.
pub fn agree(name: &str, scene: &Scene, max_length: u32, detectable: f64, sets: &[&str]) {
    let study = std::env::var_os("TYNDALL_STUDY").is_some();
    let (detectable, most) = if study { (0.01, 100_000) } else { (detectable, 1200) };
    let mean = |i: usize| {
        let techniques = TechniqueSet::parse(sets[i].split(',')).expect("known names");
        let heuristic = if i % 3 == 2 { Heuristic::Power(2.0) } else { Heuristic::Balance };
        let settings = Settings { heuristic, max_length, seed: 1 + i as u64, ..Settings::new(techniques) };
        Means::of(&sharp_runs(scene, &settings, detectable, most))
    };
    let yardstick = mean(0);
    for i in 1..sets.len() {
        let what = format!("{name}: {} and {}", sets[i], sets[0]);
        mean(i).assert_same(&yardstick, &what, detectable);
    }
}

/// The camera and a point light are in the fog, in sight of each other: what `bpt` and `pt,lens` leave finite.
#[test]
fn endless_fog_agrees() {
    agree("fog", &scenes::load("fog"), 16, 0.03, &["bpt", "pt,lens", "pt,lens"]);
}

/// The same fog, which the camera sees from a plane before the lens on.
#[test]
fn fog_before_the_near_plane_is_not_there() {
    let near = "lens_radius = 0.05\nnear = 1.2";
    let scene = scenes::load_with("fog", "lens_radius = 0.05", near);
    agree("fog from the near plane", &scene, 16, 0.03, &["bpt", "pt,lens"]);
}

/// The same fog with empty bubbles about both: any set with next-event estimation, which alone finds the point light's fog
/// in the mirror.
#[test]
fn fog_with_bubbles_agrees() {
    let bubbles = "[material.nothing]\nnull = {}\n[[shape]]\nsphere = { center = [-0.6, 0.6, 0.6], radius = 0.2 }\n\
                   material = 'nothing'\n[[shape]]\nsphere = { center = [0, 0.5, 2.5], radius = 0.4 }\n\
                   material = 'nothing'\n[[light]]";
    let scene = scenes::load_with("fog", "[[light]]", bubbles);
    agree("fog with bubbles", &scene, 16, 0.03, &["pt", "bpt", "pt,connect", "pt,lens"]);
}

#[test]
fn balls_agree() {
    agree("balls", &scenes::load("balls"), 24, 0.03, &["pt", "bpt", "hit,connect", "hit,nee,lens"]);
}

#[test]
fn the_drink_agrees() {
    agree("drink", &scenes::load("drink"), 16, 0.05, &["pt", "bpt", "hit,lens", "hit,connect"]);
}

/// Every kind of light. What is a point or a direction cannot be hit.
#[test]
fn dusk_agrees() {
    agree("dusk", &scenes::load("dusk"), 12, 0.03, &["pt", "bpt", "pt,lens", "pt,connect"]);
}

#[test]
fn what_is_behind_the_window_agrees() {
    agree("window", &scenes::load("window"), 24, 0.05, &["pt", "bpt", "hit,connect", "hit,lens"]);
}
