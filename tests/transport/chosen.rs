//! What is chosen where settings leave it open: that it hangs on nothing but scene and settings, what may be left out, and
//! that the error which a pilot foretells is the one that renders have.

use crate::measure::runs;
use crate::merging::set;
use glam::UVec2;
use std::path::Path;
use std::sync::Arc;
use tyndall::math::Discrete;
use tyndall::scene::Scene;
use tyndall::scene::file::{Overrides, load};
use tyndall::transport::merge::auto::{Chosen, resolve};
use tyndall::transport::merge::cost;
use tyndall::transport::merge::evidence::{Counts, Evidence};
use tyndall::transport::merge::pilot::Pilot;
use tyndall::transport::merge::{MERGES, MergeSettings, PathCount, Radius};
use tyndall::transport::thinning::Thinning;
use tyndall::transport::{LightStarts, Settings, Technique, TechniqueSet};

fn scene(name: &str, size: UVec2) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    load(&path, &Overrides { size: Some(size) }).unwrap_or_else(|e| panic!("{e}"))
}

fn upbp() -> Settings {
    Settings { max_length: 12, ..Settings::new(set("upbp")) }
}

/// What hangs on the choice.
fn chosen(chosen: &Chosen) -> String {
    format!("{:?} {:?} {:?} {:?}", chosen.gathers, chosen.left_out, chosen.thinning, chosen.starts)
}

#[test]
fn the_choice_hangs_on_neither_seed_nor_threads() {
    let scene = scene("smoke-plume", UVec2::new(40, 30));
    let settings = Settings { light_starts: LightStarts::Pilot, ..upbp() };
    let first = resolve(&scene, &settings);
    // Nothing of it is a bound that any pilot would run into.
    let pilot = |number| {
        let by_power = scene.lights.by_power();
        let pilot = Pilot::run(&scene, &settings, &first.thinning, by_power, &first.gathers, number);
        format!("{:?}", pilot.of_lights)
    };
    assert_ne!(pilot(0), pilot(77));
    let by_evidence = first.starts.as_ref().expect("there are two lights").pdf(0);
    assert!((0.05..0.95).contains(&by_evidence), "{by_evidence}");
    let first = chosen(&first);
    assert_eq!(first, chosen(&resolve(&scene, &Settings { seed: 77, ..settings })), "another seed");
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        assert_eq!(first, pool.install(|| chosen(&resolve(&scene, &settings))), "{threads} threads");
    }
}

#[test]
fn pinned_settings_choose_nothing_and_are_the_same() {
    for name in ["medium-balls", "candle", "fog-cornell"] {
        let scene = scene(name, UVec2::new(32, 32));
        let settings = Settings { light_starts: LightStarts::Pilot, ..upbp() };
        let pinned = settings.pinned(&scene);
        let (free, fixed) = (resolve(&scene, &settings), resolve(&scene, &pinned));
        let shares = |starts: &Option<Arc<Discrete>>| -> Vec<f32> {
            starts.iter().flat_map(|q| (0..q.len()).map(|i| q.pdf(i))).collect()
        };
        assert_eq!(shares(&free.starts), shares(&fixed.starts), "{name}");
        assert_eq!(free.starts.is_some(), scene.lights.lights().len() > 1, "{name}");
        assert_eq!(free.left_out, fixed.left_out, "{name}");
        assert_eq!(free.gathers, fixed.gathers, "{name}");
        let now = |thinning: &Thinning| {
            let media = 0..scene.media.len() as u32;
            let continuations: Vec<f32> = media.map(|m| thinning.continuation(m)).collect();
            (continuations, thinning.shares.clone(), thinning.only_hit)
        };
        assert_eq!(now(&free.thinning), now(&fixed.thinning), "{name}");
        let image = |settings: &Settings| runs(&scene, settings, 1, 2).remove(0).pixels;
        assert_eq!(image(&settings), image(&pinned), "{name}");
    }
}

#[test]
fn only_what_is_open_in_a_large_set_is_left_out() {
    let scene = scene("fog-cornell", UVec2::new(48, 48));
    let left_out = |settings: &Settings| resolve(&scene, settings).left_out;
    assert!(!left_out(&upbp()).is_empty(), "fog lit by a lamp has techniques that are not worth their cost");
    let even = MergeSettings { efficient: false, ..MergeSettings::default() };
    assert!(left_out(&Settings { merging: even, ..upbp() }).is_empty(), "an even choice");
    let named = Settings { techniques: set("bpt,surf,pb2d,bb1d"), ..upbp() };
    assert!(left_out(&named).is_empty(), "a set that is named for what is in it");
    let mut asked = upbp();
    for gather in &mut asked.merging.of {
        gather.radius = Radius::Footprint(1.0);
    }
    assert!(left_out(&asked).is_empty(), "radii are given");
}

/// Radii and light subpaths that the test of the foretold error starts from.
fn start(scene: &Scene, settings: &Settings) -> Settings {
    let even = MergeSettings { efficient: false, ..settings.merging };
    let mut start = Settings { merging: even, ..*settings }.pinned(scene);
    start.merging.of.iter_mut().for_each(|gather| gather.alpha = 1.0);
    start
}

/// What is chosen with these settings, and a pilot with it.
fn piloted(scene: &Scene, settings: &Settings) -> (Chosen, Pilot) {
    let chosen = resolve(scene, settings);
    let starts = scene.lights.by_power();
    let pilot = Pilot::run(scene, settings, &chosen.thinning, starts, &chosen.gathers, 0);
    (chosen, pilot)
}

/// The error that a pilot foretells for a set, relative to that of `bpt`, beside the measured one.
fn foretold_and_measured(name: &str, techniques: &str) -> [f64; 2] {
    let scene = scene(name, UVec2::new(40, 40));
    let full = start(&scene, &Settings { techniques: set(techniques), ..upbp() });
    let bpt = Settings { techniques: set("bpt"), left_out: TechniqueSet::default(), ..full };
    let (chosen, pilot) = piloted(&scene, &full);
    let on = |t: Technique, set: TechniqueSet| if set.has(t) { 1.0 } else { 0.0 };
    let counts = |settings: &Settings| Counts {
        merges: MERGES.map(|t| on(t, settings.techniques)),
        continuations: if settings.techniques.merges() {
            chosen.thinning.continuations.clone()
        } else {
            vec![]
        },
        direct: true,
    };
    let evidence = Evidence::of(&scene, &pilot, &counts(&full));
    let foretold = evidence.errors(&counts(&full)).map(|error| error.sqrt()).into_iter().product::<f64>()
        / evidence.errors(&counts(&bpt)).map(|error| error.sqrt()).into_iter().product::<f64>();
    let measured = error(&scene, &full) / error(&scene, &bpt);
    [foretold, measured]
}

/// With the numbers that it was gathered for, all that is judged makes up both errors: a sample stands for those that were not drawn.
#[test]
fn what_is_judged_stands_for_all() {
    for name in ["medium-balls", "fog-cornell"] {
        let scene = scene(name, UVec2::new(40, 40));
        let full = start(&scene, &upbp());
        let (_, pilot) = piloted(&scene, &full);
        let on = |t: Technique| if full.techniques.has(t) { 1.0 } else { 0.0 };
        let counts = Counts { merges: MERGES.map(on), continuations: vec![], direct: true };
        let errors = Evidence::of(&scene, &pilot, &counts).errors(&counts);
        println!("{name}: {errors:?}");
        assert!(errors.iter().all(|e| (0.85..1.15).contains(e)), "{name}: {errors:?}");
    }
}

/// What merges cost goes with their number, and is no small part of the whole.
#[test]
fn merges_have_their_price() {
    let scene = scene("fog-cornell", UVec2::new(40, 40));
    let full = start(&scene, &upbp());
    let (_, pilot) = piloted(&scene, &full);
    for i in MERGES.iter().enumerate().filter(|(_, t)| full.techniques.has(**t)).map(|(i, _)| i) {
        let cost = |n: f64| {
            let mut merges = MERGES.map(|t| if full.techniques.has(t) { 1.0 } else { 0.0 });
            merges[i] = n;
            let counts = Counts { merges, continuations: vec![], direct: true };
            cost::mean(&scene, std::slice::from_ref(&pilot), &counts)
        };
        let (half, whole, twice) = (cost(0.5), cost(1.0), cost(2.0));
        assert!(whole > half * 1.001, "{:?}: {half} {whole}", MERGES[i]);
        let slope = (twice - whole) / (whole - half);
        assert!((slope - 2.0).abs() < 1e-6, "{:?}: {half} {whole} {twice}", MERGES[i]);
    }
}

/// The geometric mean of squared and relative squared error of an iteration, by the variance over runs.
fn error(scene: &Scene, settings: &Settings) -> f64 {
    const RUNS: u64 = 6;
    let images = runs(scene, &Settings { seed: 5, ..*settings }, RUNS, 24);
    let value = |image: usize, pixel: usize| -> f64 {
        images[image].pixels[pixel].iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0
    };
    let n = RUNS as f64;
    let pixels: Vec<[f64; 2]> = (0..images[0].pixels.len())
        .map(|pixel| {
            let mean = (0..images.len()).map(|i| value(i, pixel)).sum::<f64>() / n;
            let squares = (0..images.len()).map(|i| (value(i, pixel) - mean).powi(2)).sum::<f64>();
            [mean, squares / (n - 1.0)]
        })
        .collect();
    let overall = pixels.iter().map(|p| p[0]).sum::<f64>() / pixels.len() as f64;
    let relative = |[mean, variance]: &[f64; 2]| variance / (mean * mean + 0.01 * overall * overall);
    let absolute: f64 = pixels.iter().map(|p| p[1]).sum();
    (absolute * pixels.iter().map(relative).sum::<f64>()).sqrt()
}

#[test]
fn the_error_that_is_foretold_is_the_one_that_comes() {
    // Where merges help much, where they help little, and where beams do.
    for (name, techniques) in [
        ("medium-balls", "bpt,surf,pp3d"),
        ("layered-haze", "bpt,surf,pb2d"),
        ("fog-cornell", "bpt,surf,bb1d"),
    ] {
        let [foretold, measured] = foretold_and_measured(name, techniques);
        println!("{name}: {techniques} over bpt: foretold {foretold:.3}, measured {measured:.3}");
        let apart = (foretold / measured).ln().abs();
        assert!(apart < 1.6f64.ln(), "{name}: {techniques}: foretold {foretold}, measured {measured}");
    }
}

#[test]
fn what_a_pilot_needs_is_there_for_sets_without_connections() {
    let scene = scene("medium-balls", UVec2::new(24, 18));
    for name in ["hit,surf,pp3d", "hit,surf,bb1d", "surf,pb2d", "hit,surf,pp3d,pb2d,bp2d,bb1d"] {
        let settings = Settings { techniques: set(name), ..upbp() };
        let chosen = resolve(&scene, &settings);
        for technique in MERGES.into_iter().filter(|t| settings.techniques.has(*t)) {
            let gather = chosen.gathers.of(technique);
            assert!(gather.radius > 0.0 && gather.paths > 0, "{name}: {technique:?} {gather:?}");
            assert_eq!(settings.merging.of(technique).paths, PathCount::Auto);
        }
    }
}
