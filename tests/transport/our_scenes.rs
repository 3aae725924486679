//! Rung 3 on the scenes of `scenes/`: pt = bpt, on the mean of the image and of each tile.
//!
//! A short run is part of the suite. `TYNDALL_STUDY=1` asks for the long one (scripts/README.md), in which every scene
//! gets as many iterations as a pilot says are needed to see a bias of 0.5% of the image mean.

use crate::measure::{Means, runs};
use glam::UVec2;
use std::path::Path;
use tyndall::scene::file::{Overrides, load};
use tyndall::transport::{Settings, TechniqueSet};

/// A scene and the sets that must agree on it.
struct Case {
    scene: &'static str,
    sets: [&'static str; 2],
}

/// In our scenes no light that is a point or a direction shines straight on glass or a mirror, so path tracing can
/// make every path.
const CASES: [Case; 7] = [
    Case { scene: "cornell", sets: ["pt", "bpt"] },
    Case { scene: "mirror-caustic", sets: ["pt", "bpt"] },
    Case { scene: "furnace", sets: ["pt", "bpt"] },
    Case { scene: "furnace", sets: ["lt", "bpt"] },
    Case { scene: "veach-room", sets: ["pt", "bpt"] },
    Case { scene: "vessels", sets: ["pt", "bpt"] },
    Case { scene: "lights", sets: ["pt", "bpt"] },
];

const RUNS: u64 = 24;

#[test]
fn our_scenes_agree() {
    let study = std::env::var_os("TYNDALL_STUDY").is_some();
    for case in &CASES {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(case.scene);
        let overrides = Overrides { size: Some(UVec2::new(32, 24)) };
        let scene = load(&folder, &overrides).unwrap_or_else(|e| panic!("{e}"));
        let means = |which: usize, seed, iterations| {
            let set = TechniqueSet::parse(case.sets[which].split(',')).expect("known names");
            let settings = Settings { max_length: 16, seed, ..Settings::new(set) };
            Means::of(&runs(&scene, &settings, RUNS, iterations))
        };
        let pilot = 16;
        let (a, b) = (means(0, 1, pilot), means(1, 2, pilot));
        let what = format!("{}: {} and {}", case.scene, case.sets[0], case.sets[1]);
        a.assert_same(&b, &what, f64::INFINITY);
        let seen = a.detectable(&b);
        if study {
            // A third more than the pilot's variance asks for.
            let iterations = (pilot as f64 * (seen / 0.005).powi(2) * 1.33).ceil() as u64;
            let (a, b) = (means(0, 3, iterations), means(1, 4, iterations));
            a.assert_same(&b, &what, 0.005);
            println!(
                "{what}: {:+.5}, detectable {:.5}, {iterations} iterations",
                a.difference(&b),
                a.detectable(&b)
            );
        } else {
            println!("{what}: {:+.4}, detectable {seen:.4}", a.difference(&b));
        }
    }
}
