//! Each technique that merges, alone, makes all paths that have a place for it: it agrees with connections on them.

use crate::measure::{Means, runs};
use crate::merge_furnace::furnace;
use crate::merging::{gathers, image_means, mean_and_error, set, variant};
use tyndall::transport::expression::Expression;
use tyndall::transport::{Settings, TechniqueSet};

/// Paths of up to eight segments with a vertex in the medium.
#[test]
fn each_technique_alone_is_bpt_on_the_paths_that_it_makes() {
    let scene = furnace("sigma_s = 1.2\nphase = { hg = 0.4 }", 16, true, "");
    let mean = |techniques: TechniqueSet, paths: &str, v: usize, iterations: u64| {
        let settings = Settings {
            merging: variant(v, gathers([0.05, 0.08, 0.05, 0.05, 0.03], [2000, 2500, 2000, 1500, 800])),
            paths: Expression::parse(paths).expect("an expression"),
            min_length: 2,
            max_length: 8,
            seed: 150,
            ..Settings::new(techniques)
        };
        let images = runs(&scene, &settings, 64, iterations);
        println!("{techniques} {paths} {v}: {:.5?}", mean_and_error(&image_means(&images)));
        Means::of(&images)
    };
    let media = ["pp3d", "pb2d", "bp2d", "bb1d"];
    // The last number is the smallest bias that is seen.
    let classes = [("E.*M.*L", &media[..], 0.05)];
    for (i, (paths, techniques, detectable)) in classes.into_iter().enumerate() {
        let bpt = mean(set("bpt"), paths, 0, 6);
        for (j, names) in techniques.iter().enumerate() {
            mean(set(names), paths, i * 5 + j, 11).assert_same(
                &bpt,
                &format!("{names} of {paths}"),
                detectable,
            );
        }
    }
}
