//! Rung 7 in media: what changes nothing. Free flight draws its numbers once an edge, whatever the edge crosses, so that
//! scenes that mean the same have the same picture sample by sample, but for rounding.

use crate::measure::render;
use crate::scenes;
use tyndall::film::Image;
use tyndall::scene::Scene;
use tyndall::transport::{Settings, TechniqueSet};

fn picture(scene: &Scene, min_length: u32, max_length: u32) -> Image {
    let settings =
        Settings { min_length, max_length, seed: 5, ..Settings::new(TechniqueSet::of_connections()) };
    render(scene, &settings, 4).image()
}

/// Pictures of the same samples. A rounding can send a path another way, at an edge or a reflection: a pixel in 20 may
/// differ, the mean by 1%.
pub fn assert_same_samples(what: &str, a: &Image, b: &Image) {
    let near = |x: f32, y: f32| (x - y).abs() <= 1e-3 * y.abs().max(1e-4);
    let values = || a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    let other = values().filter(|(x, y)| !near(**x, **y)).count();
    let all = values().count();
    assert!(other * 20 <= all, "{what}: {other} of {all} values differ");
    let sum = |image: &Image| image.pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    let (a, b) = (sum(a), sum(b));
    assert!(a > 0.0 && (a / b - 1.0).abs() < 0.01, "{what}: {a} and {b}");
}

#[test]
fn lengths_add_up_in_fog() {
    for name in ["fog", "drink"] {
        let scene = scenes::load(name);
        let (whole, short, long) = (picture(&scene, 1, 9), picture(&scene, 1, 3), picture(&scene, 4, 9));
        for ((w, s), l) in
            whole.pixels.iter().flatten().zip(short.pixels.iter().flatten()).zip(long.pixels.iter().flatten())
        {
            assert!((w - (s + l)).abs() <= 1e-5 * w.max(1e-3), "{name}: {w} is not {s} + {l}");
        }
    }
}

/// An index-matched box with nothing in it, in empty space and across a fog that goes on within it.
#[test]
fn a_wall_of_nothing_changes_nothing() {
    let wall = |interior: &str| {
        format!(
            "[material.nothing]\nnull = {{}}\n[[shape]]\nbox = {{ min = [-0.9, -0.45, -0.8], max = [0.85, 0.7, 0.75] }}\n\
             material = 'nothing'\n{interior}\n[[shape]]"
        )
    };
    let once = |name: &str, interior: &str| {
        // Before the first shape of all.
        let text = scenes::text(name).replacen("[[shape]]", &wall(interior), 1);
        picture(&scenes::of(&text), 1, 8)
    };
    for (name, interior) in [("surfaces", ""), ("lights", ""), ("fog", "interior = 'fog'")] {
        assert_same_samples(name, &once(name, interior), &picture(&scenes::load(name), 1, 8));
    }
}

/// A medium cut in two by an index-matched wall of the same medium; in the furnace the outer solid is opaque, and in
/// the ball it is index-matched.
#[test]
fn a_medium_can_be_cut_in_two() {
    let inner = |centre: &str, medium: &str| {
        format!(
            "[[shape]]\nsphere = {{ center = {centre}, radius = 0.3 }}\nmaterial = 'nothing'\ninterior = '{medium}'\n[[shape]]"
        )
    };
    let whole = picture(&scenes::load("furnace_fog"), 1, 12);
    let null = "[material.nothing]\nnull = {}\n";
    let cut = format!("{null}{}", inner("[0.2, 0, -0.3]", "fog"));
    let text = scenes::text("furnace_fog").replacen("[[shape]]", &cut, 1);
    assert_same_samples("furnace", &picture(&scenes::of(&text), 1, 12), &whole);
    let whole = picture(&scenes::load("balls"), 1, 12);
    let text = scenes::text("balls").replacen("[[shape]]", &inner("[-0.2, -0.2, 0.1]", "coloured"), 1);
    assert_same_samples("balls", &picture(&scenes::of(&text), 1, 12), &whole);
}

/// Two balls that overlap: which comes first in the file is nothing to the one with the higher priority; and one that
/// lies wholly inside of another with a higher priority is not there.
#[test]
fn priority_orders_media() {
    let ball = |x: f64, radius: f64, medium: &str, priority: i32| {
        format!(
            "[[shape]]\nsphere = {{ center = [{x}, 0, 0], radius = {radius} }}\nmaterial = 'nothing'\n\
             interior = '{medium}'\npriority = {priority}\n"
        )
    };
    let scene = |balls: &[String]| {
        scenes::of(&format!(
            "[film]\nwidth = 24\nheight = 24\n[camera]\norigin = [0, 0.2, 2.5]\ntarget = [0, 0, 0]\nfov = 40\n\
             [medium.a]\nsigma_a = [0.1, 1, 2]\nsigma_s = 2\n[medium.b]\nsigma_a = [2, 0.5, 0]\nsigma_s = [1, 2, 3]\n\
             [material.nothing]\nnull = {{}}\n{}[[light]]\nenvironment = {{ radiance = [1, 2, 3] }}\n",
            balls.concat()
        ))
    };
    let of = |balls: &[String]| picture(&scene(balls), 1, 12);
    let first = of(&[ball(-0.2, 0.5, "a", 2), ball(0.2, 0.5, "b", 1)]);
    assert_same_samples("the file's order", &first, &of(&[ball(0.2, 0.5, "b", 1), ball(-0.2, 0.5, "a", 2)]));
    let other = of(&[ball(-0.2, 0.5, "a", 1), ball(0.2, 0.5, "b", 2)]);
    let differ = first.pixels.iter().zip(&other.pixels).filter(|(a, b)| a != b).count();
    assert!(differ > 60, "the other order is seen, in {differ} pixels");
    let hidden = of(&[ball(0.0, 0.6, "a", 2), ball(0.1, 0.3, "b", 1)]);
    assert_same_samples("hidden", &hidden, &of(&[ball(0.0, 0.6, "a", 0)]));
}

/// A scene a thousand times as large, with coefficients a thousandth, is the same picture.
#[test]
fn size_is_nothing() {
    let scene = |s: f64| {
        let v = |v: [f64; 3]| format!("{:?}", v.map(|x| x * s));
        let c = |v: [f64; 3]| format!("{:?}", v.map(|x| x / s));
        scenes::of(&format!(
            "[film]\nwidth = 24\nheight = 24\n[camera]\norigin = {}\ntarget = [0, 0, 0]\nfov = 45\n\
             [world]\nmedium = 'mist'\n[medium.mist]\nsigma_a = 0\nsigma_s = {}\n\
             [medium.milk]\nsigma_a = {}\nsigma_s = {}\nphase = {{ hg = 0.6 }}\n\
             [material.white]\ndiffuse = {{ reflectance = 0.7 }}\n[material.glass]\ndielectric = {{ ior = 1.4 }}\n\
             [[shape]]\nrectangle = {{ corner = {}, u = {}, v = {} }}\nmaterial = 'white'\n\
             [[shape]]\nsphere = {{ radius = {} }}\nmaterial = 'glass'\ninterior = 'milk'\n\
             [[shape]]\nsphere = {{ center = {}, radius = {} }}\nemission = [20, 30, 40]\n",
            v([0.0, 0.5, 2.4]),
            c([0.1, 0.15, 0.2]),
            c([0.1, 0.4, 0.8]),
            c([4.0, 3.0, 2.0]),
            v([-2.0, -0.55, 2.0]),
            v([4.0, 0.0, 0.0]),
            v([0.0, 0.0, -4.0]),
            0.5 * s,
            v([-0.7, 0.9, 0.2]),
            0.2 * s,
        ))
    };
    assert_same_samples("size", &picture(&scene(1000.0), 1, 10), &picture(&scene(1.0), 1, 10));
}
