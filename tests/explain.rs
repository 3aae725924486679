//! Replays of single pixels: they are what the render had, and the weights agree from all three sides.

mod common;

use common::Bench;
use glam::UVec2;
use std::path::Path;
use tyndall::explain::{Replay, candidates};
use tyndall::math::{Rgb, RgbExt};
use tyndall::oracle::judge;
use tyndall::render::{Budget, Job, Silent, Stop};
use tyndall::scene::Scene;
use tyndall::scene::file::{Overrides, load};
use tyndall::transport::technique::preset;
use tyndall::transport::{Settings, TechniqueSet, Tracking};

const ITERATIONS: u64 = 3;

fn scene(path: &Path, size: UVec2) -> Scene {
    load(path, &Overrides { size: Some(size) }).unwrap()
}

/// Every sample of some pixels is found again, their sum is the film's, and recursion, oracle and renderer agree on the weights.
fn check(scene: &Scene, name: &str, pixels: &[UVec2]) -> usize {
    let settings = Settings::new(TechniqueSet::of(preset(name).unwrap().techniques)).pinned(scene);
    let job = Job { scene, settings, budget: Budget::Spp(ITERATIONS), first: 0 };
    let film = job.run(&Stop::default(), &mut Silent, |_| Ok(())).unwrap().film;
    let (image, outliers) = (film.image(), film.outliers());
    let mut weighed = 0;
    for pixel in pixels {
        let replay = Replay::new(scene, settings, *pixel).unwrap();
        let mut sums = Vec::new();
        for iteration in 0..ITERATIONS {
            let found = replay.iteration(iteration);
            sums.push(found.iter().map(|f| f.luminance).sum::<f32>());
            for traced in found.iter().filter(|f| f.luminance > 0.0).filter_map(|f| f.traced.as_ref()) {
                let verdict = judge(scene, &replay.pass(iteration), &traced.path, traced.made_by());
                let all = candidates(&verdict, 1.0);
                let own = all.iter().find(|c| c.made_by == traced.made_by()).expect("it was made");
                let sum: f64 = all.iter().map(|c| c.recursion).sum();
                let weight = f64::from(traced.sample.weight);
                assert!(
                    (own.oracle - weight).abs() < 2e-3 * own.oracle + 1e-6,
                    "{name}, {pixel}: {own:?} {weight}"
                );
                assert!((own.recursion - own.oracle).abs() < 1e-6 * own.oracle, "{name}, {pixel}: {own:?}");
                assert!((sum - 1.0).abs() < 1e-6, "{name}, {pixel}: {all:?}");
                weighed += 1;
            }
        }
        let expected = Rgb::from_array(image.get(pixel.x as usize, pixel.y as usize)).luminance();
        let mean = sums.iter().sum::<f32>() / ITERATIONS as f32;
        assert!((mean - expected).abs() <= 1e-5 * expected, "{name}, {pixel}: {mean} and {expected}");
        let [largest, iteration, share] = outliers.get(pixel.x as usize, pixel.y as usize);
        let most = sums.iter().copied().fold(0.0, f32::max);
        assert!(
            (largest - most).abs() <= 1e-5 * most && (sums[iteration as usize] - most).abs() <= 1e-5 * most
        );
        assert!(most == 0.0 || (share - most / sums.iter().sum::<f32>()).abs() < 1e-4);
    }
    weighed
}

#[test]
fn replays_are_what_the_render_had() {
    let bench = Bench::new();
    let small = scene(&bench.path("small/scene.toml"), UVec2::new(24, 16));
    let pixels = [UVec2::new(3, 12), UVec2::new(12, 8), UVec2::new(20, 3)];
    for name in ["pt", "bpt", "vcm"] {
        assert!(check(&small, name, &pixels) > 5, "{name}");
    }
    // What is tracked has the weights of the oracle as well.
    let smoke = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes/smoke.toml");
    let smoke = scene(&smoke, UVec2::new(24, 24));
    let settings = Settings::new(TechniqueSet::of(preset("pt").unwrap().techniques));
    assert_eq!(settings.pinned(&smoke).tracking, Tracking::Delta);
    assert!(check(&smoke, "pt", &[UVec2::new(12, 11), UVec2::new(14, 14), UVec2::new(7, 12)]) > 20);
    let fog = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/fog-cornell/scene.toml");
    let fog = scene(&fog, UVec2::new(24, 24));
    let pixels = [UVec2::new(12, 6), UVec2::new(5, 18), UVec2::new(18, 12), UVec2::new(9, 20)];
    assert!(check(&fog, "upbp", &pixels) > 100);
}

#[test]
fn a_pixel_is_explained() {
    let bench = Bench::new();
    let (out, _) = bench.succeed("explain small --pixel 12,13 --spp 4 --most 3");
    for part in [
        "samples, of a luminance of",
        "iteration",
        "Number 1, iteration",
        "x_0   light",
        "weight by the\n",
        "recursion",
        "oracle",
    ] {
        assert!(out.contains(part), "'{part}' is not in {out}");
    }
    // The table's sum of weights is 1, both ways.
    let sum = out.lines().rfind(|l| l.trim_start().starts_with("sum")).unwrap();
    assert_eq!(sum.split_whitespace().collect::<Vec<_>>(), ["sum", "1.00000000", "1.00000000"]);
    let (again, _) = bench.succeed("explain small --pixel 12,13 --spp 4 --most 3 --threads 1");
    assert_eq!(out, again);
    // The iteration that the layer of outliers names holds the largest sample.
    bench.succeed("render small --spp 4 --layers families --out small.exr");
    let file = tyndall::film::exr::read_layers(bench.path("small.exr")).unwrap();
    let iteration = file.layer("outliers").unwrap().get(12, 13)[1];
    let (one, _) = bench.succeed(&format!("explain small --pixel 12,13 --sample {iteration} --path 2"));
    assert!(one.contains(&format!("Number 2, iteration {iteration}")), "{one}");
    for (line, parts) in [
        ("explain small --pixel 24,3", &["pixel 24,3", "columns 0 to 23"][..]),
        ("explain small --pixel 2,3 --out a.exr", &["--out", "no meaning"]),
        ("explain small --pixel 2", &["column and row"]),
    ] {
        bench.refuse(line, parts);
    }
}
