//! The film against sums made here, sample by sample, from single subpaths: which pixel, which partner, which layer.

use crate::measure::render;
use crate::scenes;
use glam::UVec2;
use std::collections::HashMap;
use tyndall::film::{Film, Image, ImageKind, Sample};
use tyndall::math::Rgb;
use tyndall::scene::Scene;
use tyndall::transport::camera_path::Partners;
use tyndall::transport::merge::store::Stored;
use tyndall::transport::sink::{Joint, Sink};
use tyndall::transport::{
    IterationStats, Layers, Renderer, Settings, Technique, TechniqueSet, camera_path, light_path,
};

const SIZE: [u32; 2] = [44, 36];
const CROP: [u32; 4] = [3, 5, 37, 31];
const ITERATIONS: u64 = 3;

/// Samples with the full-frame pixel that they fall on.
struct Falls {
    pixel: UVec2,
    samples: Vec<(UVec2, Sample)>,
}

impl Sink for Falls {
    fn record(&mut self, sample: &Sample, joint: &Joint) {
        let pixel = if let Joint::Lens(_, pixel) = joint { *pixel } else { self.pixel };
        self.samples.push((pixel, *sample));
    }
}

/// Per-pixel sums of one image over the crop window.
type Sums = Vec<[f64; 3]>;

/// What a film should hold.
#[derive(Default)]
struct Expected {
    layers: HashMap<String, Sums>,
    /// Sum of the weights and number of the samples that carry anything.
    weights: HashMap<Technique, Vec<[f64; 2]>>,
    /// The combined image of each iteration.
    frames: Vec<Sums>,
}

fn pixels() -> usize {
    ((CROP[2] - CROP[0]) * (CROP[3] - CROP[1])) as usize
}

impl Expected {
    fn add(&mut self, pixel: UVec2, sample: &Sample) {
        let inside = (CROP[0]..CROP[2]).contains(&pixel.x) && (CROP[1]..CROP[3]).contains(&pixel.y);
        if !inside {
            return;
        }
        let i = ((pixel.y - CROP[1]) * (CROP[2] - CROP[0]) + pixel.x - CROP[0]) as usize;
        let (technique, s, t) = (sample.technique, sample.s, sample.t);
        let put = |sums: &mut Sums, value: Rgb| {
            for (sum, v) in sums[i].iter_mut().zip(value.to_array()) {
                *sum += f64::from(v);
            }
        };
        for weighted in [true, false] {
            let value = if weighted { sample.contribution * sample.weight } else { sample.contribution };
            for kind in [ImageKind::Family { technique, weighted }, ImageKind::Pair { s, t, weighted }] {
                let sums = self.layers.entry(kind.name()).or_insert_with(|| vec![[0.0; 3]; pixels()]);
                put(sums, value);
            }
        }
        if sample.contribution != Rgb::ZERO {
            let sums = self.weights.entry(technique).or_insert_with(|| vec![[0.0; 2]; pixels()]);
            sums[i] = [sums[i][0] + f64::from(sample.weight), sums[i][1] + 1.0];
        }
        put(self.frames.last_mut().expect("an iteration"), sample.contribution * sample.weight);
    }
}

/// All subpaths of the full frame, one by one; a pixel's partner is the light subpath of the pixel's number.
fn expect(scene: &Scene, settings: &Settings) -> Expected {
    let mut expected = Expected::default();
    let renderer = Renderer::new(scene, *settings).expect("sensible");
    for iteration in 0..ITERATIONS {
        let pass = renderer.pass(iteration);
        expected.frames.push(vec![[0.0; 3]; pixels()]);
        for index in 0..SIZE[0] * SIZE[1] {
            let pixel = UVec2::new(index % SIZE[0], index / SIZE[0]);
            let mut falls = Falls { pixel, samples: Vec::new() };
            let mut store = Stored::default();
            light_path::trace(scene, &pass, index.into(), &mut store, &mut falls);
            let partners = Partners { vertices: &store.vertices, photons: None };
            camera_path::trace(scene, &pass, pixel, partners, &mut falls);
            for (pixel, sample) in &falls.samples {
                expected.add(*pixel, sample);
            }
        }
    }
    expected
}

fn assert_close(what: &str, image: &Image, expected: impl Fn(usize, usize) -> f64, relative: f64) {
    let size = [(CROP[2] - CROP[0]) as usize, (CROP[3] - CROP[1]) as usize];
    assert_eq!([image.width, image.height], size, "{what}");
    for (i, pixel) in image.pixels.iter().enumerate() {
        for c in 0..3 {
            let (got, expected) = (f64::from(pixel[c]), expected(i, c));
            let bound = relative * expected.abs() + 1e-12;
            assert!((got - expected).abs() <= bound, "{what}, pixel {i}: {got} for {expected}");
        }
    }
}

fn scene() -> Scene {
    scenes::load_with(
        "lights",
        "width = 24\nheight = 24",
        &format!("width = {}\nheight = {}\ncrop = {CROP:?}", SIZE[0], SIZE[1]),
    )
}

/// Bugs that this keeps out: a splat on the wrong pixel of a crop window, a partner from the neighbouring subpath or
/// from the wrong chunk of them (the frame has more light subpaths than a chunk), a weighted layer in the place of an
/// unweighted one, a frame that is not cleared between iterations, a variance divided by the wrong number.
#[test]
fn the_film_holds_what_the_subpaths_made() {
    let scene = scene();
    let settings = Settings {
        max_length: 6,
        seed: 3,
        layers: Layers::All,
        pyramid: 6,
        ..Settings::new(TechniqueSet::of_connections())
    };
    let film = render(&scene, &settings, ITERATIONS);
    let expected = expect(&scene, &settings);
    let n = ITERATIONS as f64;
    let mut used = 0;
    for (kind, image) in film.layers() {
        if let ImageKind::Weight { technique } = kind {
            let sums = &expected.weights[&technique];
            let mean = |i: usize, _| if sums[i][1] > 0.0 { sums[i][0] / sums[i][1] } else { 0.0 };
            assert_close(&kind.name(), &image, mean, 1e-6);
            assert!(image.pixels.iter().all(|p| p[0] == p[1] && p[1] == p[2] && p[0] <= 1.0));
            continue;
        }
        let sums = expected.layers.get(&kind.name());
        used += usize::from(sums.is_some());
        assert_close(&kind.name(), &image, |i, c| sums.map_or(0.0, |s| s[i][c] / n), 1e-6);
    }
    assert_eq!(used, expected.layers.len(), "a layer for all that was recorded");
    let mean = |i: usize, c: usize| expected.frames.iter().map(|f| f[i][c]).sum::<f64>() / n;
    assert_close("the image", &film.image(), mean, 1e-6);
    let variance = |i: usize, c: usize| {
        expected.frames.iter().map(|f| (f[i][c] - mean(i, c)).powi(2)).sum::<f64>() / (n - 1.0) / n
    };
    assert_close("the variance", &film.variance(), variance, 1e-5);
}

#[test]
fn an_iteration_says_what_it_did() {
    let scene = scene();
    let settings = Settings { max_length: 6, ..Settings::new(TechniqueSet::of_connections()) };
    let mut film = Film::new(&scene.camera, &settings);
    let mut renderer = Renderer::new(&scene, settings).expect("sensible");
    let stats = renderer.iteration(7, &mut film);
    let pass = renderer.pass(7);
    let mut vertices = 0;
    for index in 0..SIZE[0] * SIZE[1] {
        let mut falls = Falls { pixel: UVec2::ZERO, samples: Vec::new() };
        let mut store = Stored::default();
        light_path::trace(&scene, &pass, index.into(), &mut store, &mut falls);
        vertices += store.vertices.len() as u64;
    }
    assert_eq!(stats.light_paths, u64::from(SIZE[0] * SIZE[1]), "those of the full frame");
    assert_eq!(stats.camera_paths, pixels() as u64, "those of the crop window");
    assert_eq!(stats.light_vertices, vertices);
}

/// Iterations in one go give the film of as many one by one, to the bit, outliers and their numbers with it, whether the
/// set has light subpaths or not.
#[test]
fn many_iterations_in_one_go_change_nothing() {
    let scene = scene();
    for preset in ["pt", "bpt"] {
        let set = TechniqueSet::parse([preset]).unwrap();
        let settings = Settings { layers: Layers::All, ..Settings::new(set) };
        let film = |goes: &[u64]| {
            let mut film = Film::new(&scene.camera, &settings);
            let mut renderer = Renderer::new(&scene, settings).unwrap();
            let mut stats = IterationStats::default();
            for count in goes {
                let first = film.iterations();
                stats = stats + renderer.iterations(first..first + count, &mut film);
            }
            (film, stats)
        };
        let ((one, counted), (many, counted_many)) = (film(&[1; 7]), film(&[2, 5]));
        assert_eq!(counted, counted_many, "{preset}");
        assert_eq!((one.iterations(), many.iterations()), (7, 7));
        let all = |film: &Film| {
            let layers = film.layers().into_iter().map(|(_, image)| image);
            let bits =
                |image: Image| image.pixels.into_iter().flatten().map(f32::to_bits).collect::<Vec<_>>();
            [film.image(), film.variance(), film.outliers()]
                .into_iter()
                .chain(layers)
                .map(bits)
                .collect::<Vec<_>>()
        };
        assert_eq!(all(&one), all(&many), "{preset}");
        assert!(many.outliers().pixels.iter().any(|[_, iteration, _]| *iteration > 2.0), "{preset}");
    }
}

/// What is not finite is counted by its technique, never summed, and never silently lost.
#[test]
fn what_is_not_finite_is_counted() {
    let scene = scene();
    let settings = Settings { layers: Layers::Families, ..Settings::new(TechniqueSet::of_connections()) };
    let mut film = Film::new(&scene.camera, &settings);
    let sample = |technique, red: f32, weight| Sample {
        technique,
        s: 1,
        t: 2,
        contribution: Rgb::new(red, 2.0, 3.0),
        weight,
    };
    film.iterate(1, |band| {
        if band.index == 1 {
            band.record(2, &sample(Technique::NextEvent, f32::NAN, 0.5));
            band.record(2, &sample(Technique::NextEvent, f32::INFINITY, 0.0));
            band.record(2, &sample(Technique::Lens, 1.0, f32::NAN));
            band.record(2, &sample(Technique::Connect, 1.0, 0.5));
            band.settle(2);
        }
    });
    let count = |t: Technique| film.dropped().0[t.index()];
    assert_eq!(Technique::all().map(count).collect::<Vec<_>>(), [0, 2, 0, 1, 0, 0, 0, 0, 0]);
    assert_eq!(film.dropped().total(), 3);
    let sum: [f32; 3] =
        film.image().pixels.iter().fold([0.0; 3], |a, p| [a[0] + p[0], a[1] + p[1], a[2] + p[2]]);
    assert_eq!(sum, [0.5, 1.0, 1.5], "only what is finite is on the film");
    let all_finite = |image: &Image| image.pixels.iter().flatten().all(|v| v.is_finite());
    assert!(film.layers().iter().all(|(_, image)| all_finite(image)));
}

/// A mean weight counts samples: not what they carry, not those that carry nothing, not those that are dropped. Bugs that this
/// keeps out: the quotient of weighted and unweighted image, a mean over iterations, a black sample that counts.
#[test]
fn mean_weights_count_samples() {
    let scene = scene();
    let settings = Settings { layers: Layers::Families, ..Settings::new(TechniqueSet::of_connections()) };
    let mut film = Film::new(&scene.camera, &settings);
    let sample = |contribution, weight| Sample {
        technique: Technique::Connect,
        s: 2,
        t: 2,
        contribution: Rgb::splat(contribution),
        weight,
    };
    for iteration in 0..2 {
        film.iterate(1, |band| {
            if band.index == 0 && iteration == 0 {
                for (contribution, weight) in
                    [(100.0, 0.75), (1.0, 0.0), (1e-3, 0.75), (0.0, 1.0), (f32::NAN, 1.0)]
                {
                    band.record(3, &sample(contribution, weight));
                }
                band.settle(3);
            }
        });
    }
    let layers = film.layers();
    let of = |technique| &layers.iter().find(|(k, _)| *k == ImageKind::Weight { technique }).unwrap().1;
    assert_eq!(of(Technique::Connect).pixels[3], [0.5; 3], "(0.75 + 0 + 0.75) / 3");
    assert_eq!(of(Technique::Connect).pixels.iter().filter(|p| p[0] > 0.0).count(), 1);
    assert!(of(Technique::Hit).pixels.iter().all(|p| *p == [0.0; 3]), "0 where there is no sample");
    let sums = film.weights();
    let (kind, sums) = &sums[Technique::Connect.index()];
    assert_eq!((*kind, sums[3]), (ImageKind::Weight { technique: Technique::Connect }, [1.5, 3.0]));
}
