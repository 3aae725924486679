//! Independent runs, and tests of hypotheses on their means.

use statrs::distribution::{ContinuousCDF, StudentsT};
use std::ops::Range;
use std::time::Instant;
use tyndall::film::{Film, Image};
use tyndall::scene::Scene;
use tyndall::transport::{Renderer, Settings};

/// Chance that a correct renderer fails anywhere in the suite: half of it for images, half for tiles, shared out over
/// as many comparisons as the suite makes of each at most (Šidák).
const SIGNIFICANCE: f64 = 1e-3;
/// Comparisons of whole images in the suite, at most.
const IMAGES: f64 = 400.0;
/// Comparisons of tiles in the suite, at most.
const TILES: f64 = 10_000.0;
/// Chance with which a bias of the stated smallest size is seen.
const POWER: f64 = 0.9;
/// Side of the squares over which pixels are averaged.
const TILE: usize = 8;

fn level(comparisons: f64) -> f64 {
    1.0 - (1.0 - SIGNIFICANCE / 2.0).powf(1.0 / comparisons)
}

/// Independent runs that go on.
pub struct Runs<'s> {
    runs: Vec<(Renderer<'s>, Film)>,
    /// Iterations that each run has.
    pub iterations: u64,
    /// Seconds that these took.
    pub seconds: f64,
}

impl<'s> Runs<'s> {
    pub fn new(scene: &'s Scene, settings: &Settings, count: u64) -> Self {
        let start = |run| {
            let settings = Settings { seed: (settings.seed << 16) + run, ..*settings };
            let renderer = Renderer::new(scene, settings).expect("settings that make sense");
            (renderer, Film::new(&scene.camera, &settings))
        };
        Self { runs: (0..count).map(start).collect(), iterations: 0, seconds: 0.0 }
    }

    pub fn extend(&mut self, to: u64) {
        let clock = Instant::now();
        for (renderer, film) in &mut self.runs {
            iterate(renderer, film, self.iterations..to);
            assert_eq!(film.dropped().total(), 0, "samples that are not finite");
        }
        self.iterations = self.iterations.max(to);
        self.seconds += clock.elapsed().as_secs_f64();
    }

    /// The mean image of each run.
    pub fn images(&self) -> Vec<Image> {
        self.runs.iter().map(|(_, film)| film.image()).collect()
    }
}

/// The mean image of each of `count` independent runs of `iterations` iterations.
pub fn runs(scene: &Scene, settings: &Settings, count: u64, iterations: u64) -> Vec<Image> {
    let mut runs = Runs::new(scene, settings, count);
    runs.extend(iterations);
    runs.images()
}

/// Independent runs, 32, with as many iterations as are needed to see a relative bias of `detectable` of the image's mean
/// beside another mean of the same error; at most `most` iterations. How many that are only the variance says, never the
/// mean.
pub fn sharp_runs(scene: &Scene, settings: &Settings, detectable: f64, most: u64) -> Vec<Image> {
    const RUNS: u64 = 32;
    const PILOT: u64 = 4;
    // No run of the suite has a seed as large as this.
    let pilot = Settings { seed: settings.seed + (1 << 20), ..*settings };
    let seen = |images: &[Image]| {
        let image = Means::of(images).image;
        2f64.sqrt() * image.detectable() / image.mean
    };
    let needed = PILOT as f64 * (seen(&runs(scene, &pilot, RUNS, PILOT)) / detectable).powi(2);
    let mut iterations = ((1.25 * needed).ceil() as u64).clamp(PILOT, most);
    loop {
        let images = runs(scene, settings, RUNS, iterations);
        if iterations == most || seen(&images) <= detectable {
            return images;
        }
        // The pilot's variance was too small.
        iterations = (iterations * 3 / 2).min(most);
    }
}

/// A film with `iterations` iterations on it.
pub fn render(scene: &Scene, settings: &Settings, iterations: u64) -> Film {
    let mut film = Film::new(&scene.camera, settings);
    let mut renderer = Renderer::new(scene, *settings).expect("settings that make sense");
    iterate(&mut renderer, &mut film, 0..iterations);
    film
}

fn iterate(renderer: &mut Renderer, film: &mut Film, iterations: Range<u64>) {
    for i in iterations {
        renderer.iteration(i, film);
    }
}

/// A mean and its standard error over runs.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    mean: f64,
    error: f64,
    degrees: f64,
}

impl Estimate {
    fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self { mean, error: (variance / n).sqrt(), degrees: n - 1.0 }
    }

    /// The difference of two independent means, with Welch and Satterthwaite's degrees of freedom.
    fn minus(self, other: Self) -> Self {
        let (a, b) = (self.error.powi(2), other.error.powi(2));
        let degrees = if a + b > 0.0 {
            (a + b).powi(2) / (a * a / self.degrees + b * b / other.degrees)
        } else {
            self.degrees
        };
        Self { mean: self.mean - other.mean, error: (a + b).sqrt(), degrees }
    }

    /// Standard errors that a true zero stays within.
    fn critical(self, comparisons: f64) -> f64 {
        student(self.degrees).inverse_cdf(1.0 - level(comparisons) / 2.0)
    }

    /// The smallest bias that is seen with probability [`POWER`].
    fn detectable(self) -> f64 {
        (self.critical(IMAGES) + student(self.degrees).inverse_cdf(POWER)) * self.error
    }

    /// Fails unless the mean is zero, as far as the runs can tell. What has no variance at all is held to the
    /// rounding of f32.
    fn assert_zero(self, what: &str, scale: f64, comparisons: f64) {
        let bound = self.critical(comparisons) * self.error + 2e-6 * scale;
        assert!(self.mean.abs() <= bound, "{what}: off by {:e}, bound {bound:e} at {scale:e}", self.mean);
    }
}

fn student(degrees: f64) -> StudentsT {
    StudentsT::new(0.0, 1.0, degrees).expect("positive degrees of freedom")
}

/// Means over runs: of each tile and channel, and of the whole image.
pub struct Means {
    tiles: Vec<Estimate>,
    image: Estimate,
}

impl Means {
    /// Of independent runs, at least two.
    pub fn of(images: &[Image]) -> Self {
        let (width, height) = (images[0].width, images[0].height);
        let mut tiles = Vec::new();
        for y in (0..height).step_by(TILE) {
            for x in (0..width).step_by(TILE) {
                for channel in 0..3 {
                    let values: Vec<f64> =
                        images.iter().map(|image| tile_mean(image, x, y, channel)).collect();
                    tiles.push(Estimate::of(&values));
                }
            }
        }
        let whole: Vec<f64> = images.iter().map(image_mean).collect();
        Self { tiles, image: Estimate::of(&whole) }
    }

    /// What is known without any error.
    pub fn known(image: &Image) -> Self {
        Self::of(&[image.clone(), image.clone()])
    }

    /// Fails unless every tile and the image as a whole have the mean `expected`; or if the test could not see a
    /// relative bias of `detectable` of the image.
    pub fn assert_mean(&self, what: &str, expected: f64, detectable: f64) {
        let exact = Estimate { mean: expected, error: 0.0, degrees: 1.0 };
        let less = |e: Estimate| Estimate { mean: e.mean - exact.mean, ..e };
        for (i, tile) in self.tiles.iter().enumerate() {
            less(*tile).assert_zero(&format!("{what}, tile {i}"), expected, TILES);
        }
        less(self.image).assert_zero(what, expected, IMAGES);
        self.assert_sharp(what, self.image, expected, detectable);
    }

    /// Fails unless both have the same mean in every tile and as a whole; or if the test could not see a relative
    /// bias of `detectable` of the image.
    pub fn assert_same(&self, other: &Self, what: &str, detectable: f64) {
        for (i, (a, b)) in self.tiles.iter().zip(&other.tiles).enumerate() {
            a.minus(*b).assert_zero(&format!("{what}, tile {i}"), b.mean, TILES);
        }
        let difference = self.image.minus(other.image);
        difference.assert_zero(what, other.image.mean, IMAGES);
        self.assert_sharp(what, difference, other.image.mean, detectable);
    }

    /// Fails unless all means are those of `exact`, which is known to the relative error `uncertainty`; or if the test
    /// could not see a relative bias of `detectable` of the image.
    pub fn assert_near(&self, exact: &Image, uncertainty: f64, what: &str, detectable: f64) {
        let exact = Self::known(exact);
        let near = |a: &Estimate, b: &Estimate| {
            let difference = a.minus(*b);
            let forgiven = difference.mean.abs().min(uncertainty * b.mean).copysign(difference.mean);
            Estimate { mean: difference.mean - forgiven, ..difference }
        };
        for (i, (a, b)) in self.tiles.iter().zip(&exact.tiles).enumerate() {
            near(a, b).assert_zero(&format!("{what}, tile {i}"), b.mean, TILES);
        }
        near(&self.image, &exact.image).assert_zero(what, exact.image.mean, IMAGES);
        self.assert_sharp(what, self.image, exact.image.mean, detectable - uncertainty);
    }

    /// The smallest relative bias of the image mean that a comparison with `other` sees.
    pub fn detectable(&self, other: &Self) -> f64 {
        self.image.minus(other.image).detectable() / other.image.mean
    }

    /// The variance of the image mean.
    pub fn variance(&self) -> f64 {
        self.image.error.powi(2)
    }

    /// The relative difference of the image means.
    pub fn difference(&self, other: &Self) -> f64 {
        self.image.minus(other.image).mean / other.image.mean
    }

    fn assert_sharp(&self, what: &str, estimate: Estimate, scale: f64, detectable: f64) {
        let smallest = estimate.detectable() / scale;
        println!("{what}: sees a bias of {smallest:.5}");
        assert!(
            smallest <= detectable,
            "{what}: the test sees a bias of {smallest:.4} only, not {detectable}"
        );
    }
}

/// Means of the differences of runs with the same seeds by two sets of techniques. Such runs have most random numbers in
/// common and so most of their noise, which leaves far less of it in the difference than independent runs would.
pub struct Differences {
    means: Means,
    /// Those of the second set, which the differences are relative to.
    scale: Means,
}

impl Differences {
    /// Of runs that go by the same seeds, run by run; they may have different numbers of iterations.
    pub fn of(a: &[Image], b: &[Image]) -> Self {
        let minus = |a: &Image, b: &Image| {
            let pixels = a.pixels.iter().zip(&b.pixels);
            Image { pixels: pixels.map(|(a, b)| [0, 1, 2].map(|c| a[c] - b[c])).collect(), ..a.clone() }
        };
        let runs: Vec<Image> = a.iter().zip(b).map(|(a, b)| minus(a, b)).collect();
        Self { means: Means::of(&runs), scale: Means::of(b) }
    }

    /// Fails unless all are zero, as far as the runs can tell; or if they could not tell a relative bias of `detectable` of the
    /// image.
    pub fn assert_none(&self, what: &str, detectable: f64) {
        for (i, (tile, scale)) in self.means.tiles.iter().zip(&self.scale.tiles).enumerate() {
            tile.assert_zero(&format!("{what}, tile {i}"), scale.mean, TILES);
        }
        let (image, scale) = (self.means.image, self.scale.image.mean);
        image.assert_zero(what, scale, IMAGES);
        self.means.assert_sharp(what, image, scale, detectable);
    }

    /// That of the image means, relative to the second.
    pub fn image(&self) -> f64 {
        self.means.image.mean / self.scale.image.mean
    }

    /// The smallest relative bias of the image mean that is seen.
    pub fn detectable(&self) -> f64 {
        self.means.image.detectable() / self.scale.image.mean
    }

    /// The variance of the difference of the image means.
    pub fn variance(&self) -> f64 {
        self.means.variance()
    }
}

/// The images with one of their channels for all three.
pub fn channel(images: &[Image], channel: usize) -> Vec<Image> {
    let grey = |image: &Image| Image {
        pixels: image.pixels.iter().map(|pixel| [pixel[channel]; 3]).collect(),
        ..image.clone()
    };
    images.iter().map(grey).collect()
}

fn tile_mean(image: &Image, x: usize, y: usize, channel: usize) -> f64 {
    let (right, bottom) = ((x + TILE).min(image.width), (y + TILE).min(image.height));
    let mut sum = 0.0;
    for row in y..bottom {
        for column in x..right {
            sum += f64::from(image.pixels[row * image.width + column][channel]);
        }
    }
    sum / ((right - x) * (bottom - y)) as f64
}

fn image_mean(image: &Image) -> f64 {
    let sum: f64 = image.pixels.iter().flatten().map(|v| f64::from(*v)).sum();
    sum / (3 * image.pixels.len()) as f64
}
