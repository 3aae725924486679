//! Rung 7: what holds to the bit.

use crate::measure::render;
use crate::scenes;
use tyndall::film::{Film, ImageKind};
use tyndall::transport::expression::Expression;
use tyndall::transport::{Layers, Renderer, Settings, TechniqueSet};

fn bpt() -> Settings {
    Settings { max_length: 8, ..Settings::new(TechniqueSet::of_connections()) }
}

fn bits(film: &Film) -> Vec<u32> {
    film.image().pixels.iter().flatten().map(|v| v.to_bits()).collect()
}

#[test]
fn threads_do_not_change_a_bit() {
    for (_, scene) in scenes::all() {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| bits(&render(&scene, &bpt(), 3)))
        };
        let one = on(1);
        assert_eq!(one, on(2));
        assert_eq!(one, on(7));
    }
}

#[test]
fn seeds_and_iterations_share_nothing() {
    let scene = scenes::load("surfaces");
    let a = bits(&render(&scene, &bpt(), 1));
    let b = bits(&render(&scene, &Settings { seed: 1, ..bpt() }, 1));
    let mut film = Film::new(&scene.camera, &bpt());
    Renderer::new(&scene, bpt()).expect("sensible").iteration(1, &mut film);
    let c = bits(&film);
    let same = |x: &[u32], y: &[u32]| x.iter().zip(y).filter(|(x, y)| x == y && **x != 0).count();
    assert_eq!(same(&a, &b), 0);
    assert_eq!(same(&a, &c), 0);
}

#[test]
fn weighted_layers_sum_to_the_image() {
    let scene = scenes::load("glass");
    let settings = Settings { layers: Layers::All, pyramid: 8, ..bpt() };
    let film = render(&scene, &settings, 4);
    let layers = film.layers();
    let image = film.image();
    let families: Vec<_> =
        layers.iter().filter(|(k, _)| matches!(k, ImageKind::Family { weighted: true, .. })).collect();
    let pairs: Vec<_> =
        layers.iter().filter(|(k, _)| matches!(k, ImageKind::Pair { weighted: true, .. })).collect();
    for (i, pixel) in image.pixels.iter().enumerate() {
        for c in 0..3 {
            // The sums are kept in f64 and are the image to the bit; what is read here has been rounded to f32 once a
            // layer.
            let sum = |l: &[&(ImageKind, tyndall::film::Image)]| {
                l.iter().map(|(_, image)| f64::from(image.pixels[i][c])).sum::<f64>()
            };
            let bound = 1e-6 * f64::from(pixel[c]) + 1e-12;
            assert!((sum(&families) - f64::from(pixel[c])).abs() <= bound);
            assert!((sum(&pairs) - f64::from(pixel[c])).abs() <= bound);
        }
    }
    // Keeping layers does not change the picture.
    assert_eq!(bits(&film), bits(&render(&scene, &bpt(), 4)));
}

#[test]
fn lengths_add_up() {
    let scene = scenes::load("surfaces");
    let of = |min_length, max_length| {
        render(&scene, &Settings { min_length, max_length, ..bpt() }, 2).image().pixels
    };
    let whole = of(1, 8);
    // The subpaths are the same whatever the lengths that count, since a length changes no random number: the parts
    // add up sample by sample.
    let (short, long) = (of(1, 3), of(4, 8));
    for ((w, s), l) in whole.iter().flatten().zip(short.iter().flatten()).zip(long.iter().flatten()) {
        assert!((w - (s + l)).abs() <= 1e-5 * w.max(1e-3), "{w} is not {s} + {l}");
    }
}

#[test]
fn a_crop_window_is_the_crop_of_the_full_frame() {
    for name in ["surfaces", "lights"] {
        let full = render(&scenes::load(name), &bpt(), 2);
        let crop = [5u32, 3, 17, 20];
        let scene = scenes::load_with(
            name,
            "height = 24",
            &format!(
                "height = 24
crop = {crop:?}"
            ),
        );
        let part = render(&scene, &bpt(), 2).image();
        let image = full.image();
        assert_eq!((part.width, part.height), (12, 17));
        for (i, pixel) in part.pixels.iter().enumerate() {
            let (x, y) = (i % part.width + crop[0] as usize, i / part.width + crop[1] as usize);
            assert_eq!(pixel, &image.pixels[y * image.width + x], "{name} at {x}, {y}");
        }
    }
}

#[test]
fn variance_is_that_of_the_mean() {
    let scene = scenes::load("surfaces");
    let settings = Settings::new(TechniqueSet::parse(["pt"]).expect("known"));
    // The film's own estimate, averaged over the image, against the spread of independent runs.
    let images = crate::measure::runs(&scene, &settings, 64, 16);
    let estimate = {
        let variance = render(&scene, &Settings { seed: 99, ..settings }, 1024).variance();
        let sum: f64 = variance.pixels.iter().flatten().map(|v| f64::from(*v)).sum();
        sum / (3 * variance.pixels.len()) as f64 * 1024.0 / 16.0
    };
    let n = images.len() as f64;
    let mut spread = 0.0;
    for i in 0..images[0].pixels.len() {
        for c in 0..3 {
            let values: Vec<f64> = images.iter().map(|m| f64::from(m.pixels[i][c])).collect();
            let mean = values.iter().sum::<f64>() / n;
            spread += values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        }
    }
    spread /= 3.0 * images[0].pixels.len() as f64;
    let ratio = estimate / spread;
    assert!((0.9..1.1).contains(&ratio), "the film's variance is {ratio} of the runs'");
}

/// Paths through no medium and paths with a collision are all paths, sample by sample; and of the latter, those that enter
/// a medium before they meet anything that is not specular are some.
#[test]
fn paths_by_expression_add_up() {
    let scene = scenes::load("balls");
    let of = |paths: &str| {
        let paths = Expression::parse(paths).expect("an expression");
        render(&scene, &Settings { paths, ..bpt() }, 2).image().pixels
    };
    let whole = of("all");
    let (surfaces, early, late) = (of("surfaces"), of("ES*M.*L"), of("ES*D.*M.*L"));
    let sum = |pixels: &[[f32; 3]]| pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    for part in [&surfaces, &early, &late] {
        assert!(sum(part) > 1e-3 * sum(&whole), "a part is black");
    }
    for i in 0..whole.len() {
        for c in 0..3 {
            let parts = surfaces[i][c] + early[i][c] + late[i][c];
            assert!((whole[i][c] - parts).abs() <= 1e-5 * whole[i][c].max(1e-3), "{} {parts}", whole[i][c]);
        }
    }
}
