//! Rung 3 on the scenes of `scenes/`: pt = bpt, on the mean of the image and of each tile.
//!
//! The two are compared run by run, each pair with the same seed: a camera walk draws the same numbers whatever is joined to
//! it, so the noise that both have (of lamps that are hit by chance, say) is not in the difference.
//!
//! A short run is part of the suite. `TYNDALL_STUDY=1` asks for the long one (scripts/README.md), in which every scene
//! gets as many iterations as are needed to see a bias of 0.5% of the image mean, in [`MOST`] seconds at most, or in
//! `TYNDALL_STUDY_SECONDS`; `TYNDALL_STUDY=candle` for the cases whose name begins so, and no others.

use crate::measure::{Differences, Means, Runs};
use glam::UVec2;
use std::path::Path;
use tyndall::scene::Scene;
use tyndall::scene::file::{Overrides, load};
use tyndall::transport::{Settings, TechniqueSet};

/// A scene and the sets that must agree on it.
struct Case {
    scene: &'static str,
    sets: [&'static str; 2],
    /// What is changed in the scene file.
    variant: Option<Variant>,
    /// Whether differences of a short run say something. Where they are made by paths that few runs of it meet, their mean and its
    /// error are both too small, and the short run compares the means with all their noise.
    told_soon: bool,
}

/// A word for a change of a scene, and what it puts in the place of which pieces of the file.
type Variant = (&'static str, &'static [[&'static str; 2]]);

impl Case {
    const fn new(scene: &'static str, sets: [&'static str; 2]) -> Self {
        Self { scene, sets, variant: None, told_soon: true }
    }

    fn load(&self) -> Scene {
        let mut path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(self.scene);
        let folder = tempfile::tempdir().expect("a folder");
        if let Some((_, changes)) = self.variant {
            let mut text = std::fs::read_to_string(path.join("scene.toml")).expect("a scene file");
            for [from, to] in changes {
                assert_eq!(text.matches(from).count(), 1, "{}: {from}", self.scene);
                text = text.replace(from, to);
            }
            path = folder.path().join("scene.toml");
            std::fs::write(&path, text).expect("a copy of the scene");
        }
        load(&path, &Overrides { size: Some(UVec2::new(32, 24)) }).unwrap_or_else(|e| panic!("{e}"))
    }

    fn name(&self) -> String {
        let variant = self.variant.map_or(String::new(), |(word, _)| format!(", {word}"));
        format!("{}{variant}: {} and {}", self.scene, self.sets[0], self.sets[1])
    }
}

/// The lamp of mirror-caustic is so small that camera paths all but never find it through the glass, which is what the
/// scene is for, but also why a short run tells next to nothing of it. So there is a variant in which the lamp has 49 times
/// the area and the same power.
const LARGE_LAMP: Variant = (
    "large lamp",
    &[
        ["radius = 0.035", "radius = 0.245"],
        ["emission = [1400, 1230, 1000]", "emission = [28.57, 25.1, 20.41]"],
    ],
);

/// In a volume 1/d² has an infinite variance: the spot's fog is rarely met by camera paths, the lens' by light paths. With an
/// empty bubble about it, either set can do without the other's technique.
const BUBBLE_AT_SPOT: Variant = (
    "empty about the spot",
    &[[
        "[[light]]",
        "[material.nothing]\nnull = {}\n[[shape]]\nsphere = { center = [2.25, 3.9, -0.55], radius = 0.5 }\nmaterial = 'nothing'\n[[light]]",
    ]],
);
const BUBBLE_AT_LENS: Variant = (
    "empty about the lens",
    &[[
        "[[light]]",
        "[material.nothing]\nnull = {}\n[[shape]]\nsphere = { center = [0.9, 1.5, 8.2], radius = 2 }\nmaterial = 'nothing'\n[[light]]",
    ]],
);

/// In our scenes no light that is a point or a direction shines straight on glass or a mirror, so path tracing can
/// make every path.
const CASES: [Case; 21] = [
    Case::new("cornell", ["pt", "bpt"]),
    Case { variant: Some(LARGE_LAMP), ..Case::new("mirror-caustic", ["pt", "bpt"]) },
    Case::new("furnace", ["pt", "bpt"]),
    Case::new("furnace", ["lt", "bpt"]),
    Case::new("veach-room", ["pt", "bpt"]),
    Case::new("vessels", ["pt", "bpt"]),
    Case::new("lights", ["pt", "bpt"]),
    Case { told_soon: false, ..Case::new("mirror-caustic", ["pt", "bpt"]) },
    Case::new("fog-cornell", ["pt", "bpt"]),
    Case::new("fog-cornell", ["lt", "bpt"]),
    Case::new("medium-balls", ["pt", "bpt"]),
    Case::new("iced-drink", ["pt", "bpt"]),
    Case::new("street-lamp", ["pt,lens", "bpt"]),
    Case { variant: Some(BUBBLE_AT_SPOT), ..Case::new("street-lamp", ["pt", "bpt"]) },
    Case { variant: Some(BUBBLE_AT_LENS), ..Case::new("street-lamp", ["lt", "bpt"]) },
    Case::new("candle", ["pt", "bpt"]),
    Case::new("still-life", ["pt", "bpt"]),
    Case::new("smoke-plume", ["pt", "bpt"]),
    Case::new("cloud", ["pt", "bpt"]),
    Case::new("layered-haze", ["pt", "bpt"]),
    Case::new("fogbow", ["pt", "bpt"]),
];

/// The bias of the image mean that the long study shall see.
const SMALLEST: f64 = 0.005;

/// Seconds that the long study gives a scene, at most, on all threads, unless it is told. One that would need more is told by
/// what can be seen after them.
const MOST: f64 = 3600.0;

/// How far the study foresees: a variance tells little of one by this many times as many iterations, since few of them miss
/// the rare paths that rule it.
const FORESIGHT: f64 = 6.0;

const RUNS: u64 = 24;

/// Iterations of the short run.
const PILOT: u64 = 16;

#[test]
fn our_scenes_agree() {
    let study = std::env::var("TYNDALL_STUDY").ok();
    let wanted =
        |case: &Case| study.as_ref().is_some_and(|part| part == "1" || case.name().starts_with(part));
    // All of them, whatever one says: the long study takes hours.
    let fails = |case: &&Case| std::panic::catch_unwind(|| case.agrees(wanted(case))).is_err();
    let failed = CASES.iter().filter(|case| study.is_none() || wanted(case)).filter(fails).count();
    assert_eq!(failed, 0, "scenes that failed");
}

impl Case {
    /// Both sets go by the same seeds, see [`Differences`].
    fn runs<'s>(&self, scene: &'s Scene, set: &str) -> Runs<'s> {
        let set = TechniqueSet::parse(set.split(',')).expect("known names");
        Runs::new(scene, &Settings { max_length: 16, seed: 1, ..Settings::new(set) }, RUNS)
    }

    fn agrees(&self, study: bool) {
        let scene = self.load();
        let mut pair = self.sets.map(|set| self.runs(&scene, set));
        pair.iter_mut().for_each(|runs| runs.extend(PILOT));
        if self.told_soon {
            self.compare(&pair, f64::INFINITY);
        } else {
            let [a, b] = [0, 1].map(|which| Means::of(&pair[which].images()));
            a.assert_same(&b, &self.name(), f64::INFINITY);
        }
        if study {
            let told =
                std::env::var("TYNDALL_STUDY_SECONDS").map(|text| text.parse().expect("a number of seconds"));
            let sharp = sharpen(&self.name(), &mut pair, told.unwrap_or(MOST));
            self.compare(&pair, if sharp { SMALLEST } else { f64::INFINITY });
        }
    }

    fn compare(&self, pair: &[Runs; 2], detectable: f64) {
        let differences = differences(pair);
        let what = format!("{}, {} and {} iterations", self.name(), pair[0].iterations, pair[1].iterations);
        let seconds = pair[0].seconds + pair[1].seconds;
        let (off, seen) = (differences.image(), differences.detectable());
        println!("{what}, {seconds:.0} s: {off:+.5}, detectable {seen:.5}");
        differences.assert_none(&what, detectable);
    }
}

fn differences(pair: &[Runs; 2]) -> Differences {
    let [a, b] = [0, 1].map(|which| pair[which].images());
    Differences::of(&a, &b)
}

/// Extends both until they tell a bias of [`SMALLEST`], or `most` seconds have gone: says whether they do. How far
/// each goes only the variances and the costs say. Prints what they have come to tell after each part.
fn sharpen(name: &str, pair: &mut [Runs; 2], most: f64) -> bool {
    loop {
        let seen = differences(pair).detectable();
        let spent = pair[0].seconds + pair[1].seconds;
        let left = most - spent;
        println!(
            "{name}, {spent:.0} s, {} and {} iterations: detectable {seen:.5}",
            pair[0].iterations, pair[1].iterations
        );
        if seen <= SMALLEST || left <= 0.0 {
            return seen <= SMALLEST;
        }
        let (ways, seconds) = ways(pair, (SMALLEST / seen).powi(2) / 1.1);
        // What may be spent of what is wanted.
        let share = (left / (seconds - spent).max(1e-9)).min(1.0);
        for (runs, way) in pair.iter_mut().zip(ways) {
            let had = runs.iterations as f64;
            let to = had + ((way - had) * share).max(1.0);
            runs.extend(to.min(FORESIGHT * had).ceil() as u64);
        }
    }
}

/// The iterations of each set after which the variance of their difference is this share of what it is, and the seconds that
/// they take in all: as many of both, so that the noise they have in common goes out; or, if that is cheaper, as if none were
/// common.
fn ways(pair: &[Runs; 2], share: f64) -> ([f64; 2], f64) {
    let had = [0, 1].map(|k| pair[k].iterations as f64);
    let cost = [0, 1].map(|k| pair[k].seconds / had[k]);
    let [a, b] = [0, 1].map(|k| Means::of(&pair[k].images()).variance());
    let together = differences(pair).variance();
    let allowed = together * share;
    let seconds = |n: [f64; 2]| n[0] * cost[0] + n[1] * cost[1];
    // Of the sum of the variances v / n for n c seconds, the least is where n ∝ √(v / c).
    let roots = [(a * had[0] * cost[0]).sqrt(), (b * had[1] * cost[1]).sqrt()];
    let apart = [0, 1].map(|k| roots[k] / cost[k] * (roots[0] + roots[1]) / allowed);
    // Var(a - b) = v_a / n_a + v_b / n_b - 2 v_ab / max(n_a, n_b)
    let most = had[0].max(had[1]);
    let common = (a + b - together) * most;
    let equal = [(a * had[0] + b * had[1] - common).max(0.0) / allowed; 2];
    let best = if seconds(equal) < seconds(apart) { equal } else { apart };
    (best, seconds(best))
}
