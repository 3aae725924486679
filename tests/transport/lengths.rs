//! Every technique makes the paths of every length that is asked for, and no others.

use crate::collect::trace_all_merges;
use crate::measure::{Means, render, runs};
use crate::merges::gathers;
use crate::scenes;
use tyndall::transport::expression::Expression;
use tyndall::transport::merge::{Beams, MERGES, MergeSettings};
use tyndall::transport::{Settings, Technique, TechniqueSet};

/// The shortest path that a technique makes.
fn shortest(technique: Technique) -> u32 {
    match technique {
        Technique::Hit | Technique::Lens => 1,
        Technique::NextEvent => 2,
        _ => 3,
    }
}

/// In the furnace, paths of k segments bring 2^-k. The bug that this keeps out: a bound on the length that is off by
/// one somewhere loses the longest or the shortest paths, a part per thousand of a picture with ten segments, but all of
/// it here.
#[test]
fn each_technique_makes_each_length() {
    let scene = scenes::load("furnace");
    for length in 1..=4 {
        for technique in TechniqueSet::of_connections().iter() {
            let what = format!("{technique:?} at {length} segments");
            let settings = Settings {
                min_length: length,
                max_length: length,
                ..Settings::new(TechniqueSet::of(&[technique]))
            };
            if length < shortest(technique) {
                let image = render(&scene, &settings, 2).image();
                assert!(image.pixels.iter().flatten().all(|v| *v == 0.0), "{what}: there is no such path");
            } else {
                // Light tracing is the noisiest; a bound that is off loses all there is.
                let means = Means::of(&runs(&scene, &settings, 16, 64));
                means.assert_mean(&what, 0.5f64.powi(length as i32), 0.2);
            }
        }
    }
}

/// A bound on the length lets no path through that is shorter or longer.
#[test]
fn no_other_length_is_recorded() {
    let scene = scenes::load("lights");
    let settings = Settings { min_length: 2, max_length: 4, ..Settings::new(TechniqueSet::of_connections()) };
    let mut seen = [0; 5];
    for pixel in 0..576u32 {
        let pixel = glam::UVec2::new(pixel % 24, pixel / 24);
        for traced in crate::collect::trace_pixel(&scene, &settings, 0, pixel) {
            let length = traced.sample.s + traced.sample.t - 1;
            assert!((2..=4).contains(&length), "{:?}", traced.sample);
            seen[length as usize] += 1;
        }
    }
    assert!(seen[2..].iter().all(|n| *n > 100), "{seen:?}");
}

/// The same of merges, of which the shortest make a path of two segments: with short and with long beams, each technique
/// finds paths of every length that is asked for and records no other.
#[test]
fn merges_record_no_other_length() {
    let scene = scenes::load("fog");
    for (beams, [shortest, longest]) in
        [(Beams::Short, [2, 6]), (Beams::Short, [3, 4]), (Beams::Long, [2, 3]), (Beams::Long, [4, 4])]
    {
        let settings = Settings {
            min_length: shortest,
            max_length: longest,
            merging: MergeSettings { photon_beams: beams, camera_beams: beams, ..MergeSettings::default() },
            ..Settings::new(TechniqueSet::all())
        };
        let mut seen = [[0; 7]; Technique::COUNT];
        for traced in trace_all_merges(&scene, settings, 0, gathers()) {
            let length = traced.sample.s + traced.sample.t - 1;
            assert!((shortest..=longest).contains(&length), "{beams:?} {:?}", traced.sample);
            seen[traced.sample.technique.index()][length as usize] += 1;
        }
        for technique in TechniqueSet::all().iter().filter(|t| MERGES.contains(t)) {
            let seen = &seen[technique.index()];
            let all = seen[shortest as usize..=longest as usize].iter().all(|n| *n > 5);
            assert!(all, "{technique:?} {beams:?}: {seen:?}");
        }
    }
}

/// Merges make the paths of an expression and no others, whatever either subpath has met: those through media alone, and
/// those with one surface on the way.
#[test]
fn merges_keep_to_an_expression() {
    let scene = scenes::load("fog");
    for (beams, expression, surfaces) in [
        (Beams::Short, "EM*L", 0),
        (Beams::Short, "EM*(S|D)M*L", 1),
        (Beams::Long, "EM*L", 0),
        (Beams::Long, "EM*(S|D)M*L", 1),
    ] {
        let settings = Settings {
            max_length: 6,
            paths: Expression::parse(expression).expect("an expression"),
            merging: MergeSettings { photon_beams: beams, camera_beams: beams, ..MergeSettings::default() },
            ..Settings::new(TechniqueSet::all())
        };
        let mut seen = [0; Technique::COUNT];
        for traced in trace_all_merges(&scene, settings, 1, gathers()) {
            let met = traced.path.interior.iter().filter(|place| place.surface().is_some()).count();
            assert_eq!(met, surfaces, "{expression} {beams:?} {:?}", traced.sample);
            seen[traced.sample.technique.index()] += 1;
        }
        for technique in TechniqueSet::all().iter().filter(|t| MERGES.contains(t)) {
            let possible = surfaces == 1 || technique != Technique::Surface;
            assert_eq!(
                seen[technique.index()] > 20,
                possible,
                "{expression} {technique:?} {beams:?}: {seen:?}"
            );
        }
    }
}
