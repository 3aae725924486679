//! Delta and ratio tracking: the oracle's weights, exact renders, equilibrium, and what holds to the bit.

use crate::measure::{Means, render, sharp_runs};
use crate::merging::set;
use crate::scenes;
use glam::{Affine3A, UVec3, Vec3A};
use tyndall::film::{Image, ImageKind};
use tyndall::math::{Rgb, Stream, StreamKind};
use tyndall::medium::grid::{Interpolation, Lattice, Placed};
use tyndall::medium::phase::HenyeyGreenstein;
use tyndall::medium::varying::{Density, Emission, Extinction, Scattering};
use tyndall::medium::{Medium, Phase, Varying, volume};
use tyndall::scene::{Scene, Traits};
use tyndall::transport::technique::PRESETS;
use tyndall::transport::{Heuristic, Layers, Settings, Technique, TechniqueSet, Tracking};

fn settings(names: &str, tracking: Tracking) -> Settings {
    Settings { tracking, max_length: 12, seed: 21, ..Settings::new(set(names)) }
}

/// Survival of what is tracked is 1 for the oracle too; all else on the same edges has its own.
#[test]
fn tracked_weights_are_the_oracles() {
    let scene = scenes::load("smoke");
    assert_eq!(scene.media.iter().filter(|m| m.is_tracked()).count(), 1);
    let mut seen = [0; Technique::COUNT];
    for (i, names) in ["pt", "pt", "hit", "nee"].into_iter().enumerate() {
        let heuristic = [Heuristic::Balance, Heuristic::Power(2.0)][i % 2];
        let settings =
            Settings { tracking: Tracking::Delta, ..crate::weights::settings(set(names), heuristic) };
        let result = crate::weights::check("smoke", &scene, &settings, 4);
        result.add_to(&mut seen);
    }
    for technique in [Technique::Hit, Technique::NextEvent] {
        assert!(seen[technique.index()] > 100, "{technique:?}: {seen:?}");
    }
}

/// Smoke in coloured fog with milk in it and soot beside it, by each set; and with nothing about the smoke.
#[test]
fn tracked_is_exact_on_average() {
    let study = std::env::var_os("TYNDALL_STUDY").is_some();
    let detectable = if study { 0.004 } else { 0.02 };
    let alone = scenes::load_with("smoke", "interior = \"fog\"", "");
    for (what, scene) in [("in fog", scenes::load("smoke")), ("alone", alone)] {
        for names in ["pt", "hit", "nee"] {
            if names == "hit" && what == "alone" {
                continue;
            }
            let means = |tracking, seed| {
                let settings = Settings { seed, ..settings(names, tracking) };
                Means::of(&sharp_runs(&scene, &settings, detectable, if study { 20_000 } else { 400 }))
            };
            let (delta, exact) = (means(Tracking::Delta, 21), means(Tracking::Exact, 22));
            println!("{names} {what}: delta is off by {:.5}", delta.difference(&exact));
            delta.assert_same(&exact, &format!("{names} {what}, tracked"), 1.2 * detectable);
        }
    }
}

/// Both techniques matter in that scene: either alone has other weights.
#[test]
fn hits_and_next_events_share_the_smoke() {
    let scene = scenes::load("smoke");
    let picture = |names| render(&scene, &settings(names, Tracking::Delta), 8).image();
    assert_ne!(picture("pt").pixels, picture("nee").pixels);
    let layers = Settings { layers: Layers::Families, ..settings("pt", Tracking::Delta) };
    let film = render(&scene, &layers, 8);
    let sum = |image: &Image| image.pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    let share = |technique: Technique| {
        let wanted = ImageKind::Family { technique, weighted: true };
        sum(&film.layers_where(|kind| *kind == wanted)[0].1) / sum(&film.image())
    };
    for technique in [Technique::Hit, Technique::NextEvent] {
        assert!(share(technique) > 0.1, "{technique:?}: {}", share(technique));
    }
}

/// A grey grid of noise with holes, turned against the axes; `shining`: with σ_a for its emission.
fn smoke(density: f32, albedo: f32, g: f32, shining: bool, seed: u64) -> Medium {
    let mut random = Stream::new(78, 0, StreamKind::Other, seed);
    let size = UVec3::new(26, 19, 23);
    let numbers: Vec<f32> = (0..size.element_product())
        .map(|_| {
            let u = random.next_1d();
            if u < 0.3 { 0.0 } else { 3.0 * u * u }
        })
        .collect();
    let place = Affine3A::from_axis_angle(glam::Vec3::new(1.0, 2.0, 0.5).normalize(), 0.7)
        * volume::cube(Vec3A::splat(-2.2), Vec3A::splat(2.2));
    let kind = [Interpolation::Trilinear, Interpolation::Constant][seed as usize % 2];
    let lattice = Lattice::new(size, &numbers, kind).expect("a grid");
    let grid = Density::Grid(Box::new(Placed::new(lattice, place).expect("a place")));
    let extinction = Extinction::Scaled(grid, Rgb::splat(density));
    let emission =
        if shining { Emission::WithDensity(Rgb::splat(density * (1.0 - albedo))) } else { Emission::None };
    let phase = Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).expect("a phase function"));
    let medium = Varying::new(extinction, Scattering::Albedo(Rgb::splat(albedo)), emission, phase);
    let medium = Medium::Varying(Box::new(medium.expect("a medium")));
    assert!(medium.is_tracked());
    medium
}

fn with_media(mut scene: Scene, media: Vec<Medium>) -> Scene {
    scene.media = media;
    scene.traits = Traits::of(&scene.media);
    scene
}

/// The conservative sphere: radiance 1 whatever the grid; and with what absorbs and emits σ_a of the radiance 1.
#[test]
fn the_furnace_is_one_by_tracking() {
    let study = std::env::var_os("TYNDALL_STUDY").is_some();
    let detectable = if study { 0.005 } else { 0.015 };
    let text = "sigma_a = 0\nsigma_s = 1";
    for (i, (names, shining)) in
        [("pt", false), ("pt", false), ("hit", false), ("pt", true), ("hit", true)].into_iter().enumerate()
    {
        let furnace = crate::media_furnace::furnace(text, "interior = 'fog'", crate::media_furnace::BUBBLE);
        let albedo = if shining { 0.6 } else { 1.0 };
        let medium = smoke([0.8, 1.4, 1.2][i % 3], albedo, [0.6, -0.4, 0.0][i % 3], shining, i as u64);
        let heuristic = if i % 2 == 1 { Heuristic::Power(2.0) } else { Heuristic::Balance };
        let settings = Settings {
            heuristic,
            tracking: Tracking::Delta,
            max_length: 96,
            seed: 310 + i as u64,
            ..Settings::new(set(names))
        };
        let images =
            sharp_runs(&with_media(furnace, vec![medium]), &settings, detectable * 2f64.sqrt(), 1000);
        Means::of(&images).assert_mean(&format!("tracked furnace {i}, {names}"), 1.0, detectable);
    }
}

#[test]
fn threads_do_not_change_a_bit_of_what_is_tracked() {
    let scene = scenes::load("smoke");
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| render(&scene, &settings("pt", Tracking::Delta), 3).image().pixels)
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(7));
    assert_ne!(one, render(&scene, &settings("pt", Tracking::Exact), 3).image().pixels);
}

/// The shortest paths that count change no random number: images of disjoint lengths add up to that of all.
#[test]
fn lengths_change_no_tracked_path() {
    let scene = scenes::load("smoke");
    let of = |min_length, max_length| {
        let settings = Settings { min_length, max_length, ..settings("pt", Tracking::Delta) };
        render(&scene, &settings, 2).image().pixels
    };
    let (all, short, long) = (of(1, 8), of(1, 3), of(4, 8));
    for ((all, short), long) in all.iter().zip(&short).zip(&long) {
        for c in 0..3 {
            assert!((all[c] - short[c] - long[c]).abs() <= 1e-5 * all[c], "{all:?} {short:?} {long:?}");
        }
    }
}

/// What `auto` comes to, and which sets forbid `delta`: the error names just the techniques that do.
#[test]
fn sets_that_need_densities_are_not_tracked() {
    let (smoke, fog) = (scenes::load("smoke"), scenes::load("fog"));
    for preset in &PRESETS {
        let techniques = TechniqueSet::of(preset.techniques);
        let with = |tracking| Settings { tracking, ..Settings::new(techniques) };
        let fits = preset.key == "pt";
        assert_eq!(with(Tracking::Auto).tracks(), fits, "{}", preset.key);
        assert!(!with(Tracking::Exact).tracks());
        assert!(with(Tracking::Exact).validate().is_ok());
        assert_eq!(with(Tracking::Delta).validate().is_ok(), fits, "{}", preset.key);
    }
    let forbidden = Settings { tracking: Tracking::Delta, ..Settings::new(set("pt,lens,pb2d")) };
    let message = forbidden.validate().unwrap_err().to_string();
    assert_eq!(
        message,
        "tracking by `delta` is for hit and nee alone: lens, pb2d must know the density of a flight from its far end"
    );
    for (scene, expected) in [(&smoke, Tracking::Delta), (&fog, Tracking::Exact)] {
        assert_eq!(Settings::new(set("pt")).pinned(scene).tracking, expected);
        assert_eq!(Settings::new(set("bpt")).pinned(scene).tracking, Tracking::Exact);
    }
    // What is left out leaves no room for it.
    let settings = Settings { left_out: set("surf"), ..Settings::new(set("pt,surf")) };
    assert!(!settings.tracks());
}
