//! FLIP: the difference that an observer perceives when two images are flipped in place.
//!
//! LDR-FLIP [Andersson et al. 2020] compares what a display shows: colours as far as the eye resolves them, and
//! edges and points. HDR-FLIP [Andersson et al. 2021] takes the worst of it over the exposures at which the
//! reference shows something, each through the ACES curve. A pixel's value is in [0, 1]. The viewing condition
//! is the paper's: a display 0.7 m wide with 3840 pixels, from 0.7 m away.
//!
//! Where the papers define nothing: negative light is black; the median luminance of a reference of which more
//! than half is black is that of its other pixels; the exposures of a wholly black reference are those of the
//! image. Against the official implementation: `scripts/check_flip.py`.

mod color;
mod filter;

use crate::film::png::aces;
use crate::film::{Image, ScalarImage};
use filter::{Features, Plane, Sensitivity, Size};
use rayon::prelude::*;

/// Distance 0.7 m · 3840 pixels / 0.7 m · radians a degree.
const PIXELS_PER_DEGREE: f32 = 3840.0 * std::f32::consts::PI / 180.0;

/// The exposures of HDR-FLIP, in stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    /// The darkest: the brightest pixel of the reference comes to 0.85 of the display's white.
    pub start: f64,
    /// The brightest: the median pixel does.
    pub stop: f64,
    /// How many, evenly spaced, both ends among them.
    pub count: usize,
}

/// The LDR-FLIP error map of linear RGB images, clamped to [0, 1]. Both have the same size, at least one pixel,
/// and finite values, as [`Metric::measure`](super::Metric::measure) makes sure.
pub fn ldr(image: &Image, reference: &Image) -> ScalarImage {
    let flip = Flip::new(reference);
    flip.map(flip.errors(image, reference, &|v| v.clamp(0.0, 1.0)))
}

/// The HDR-FLIP error map; images as for [`ldr`].
pub fn hdr(image: &Image, reference: &Image) -> ScalarImage {
    let flip = Flip::new(reference);
    let Some(Exposures { start, stop, count }) = exposures(reference).or_else(|| exposures(image)) else {
        return flip.map(vec![0.0; reference.pixels.len()]);
    };
    let mut worst = vec![0.0f32; reference.pixels.len()];
    for i in 0..count {
        // In f64, since the gain of a very dark reference overflows f32.
        let stops = start + i as f64 * (stop - start) / (count - 1) as f64;
        let gain = 0.6 * stops.exp2();
        let errors = flip.errors(image, reference, &|v| aces((gain * f64::from(v)) as f32));
        worst.iter_mut().zip(errors).for_each(|(w, e)| *w = w.max(e));
    }
    flip.map(worst)
}

/// The exposures for this reference [Andersson et al. 2021 (section 3)]; `None` where nothing in it is brighter
/// than black.
pub fn exposures(reference: &Image) -> Option<Exposures> {
    let luminance = |p: &[f32; 3]| {
        let [r, g, b] = p.map(|v| f64::from(v.max(0.0)));
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let mut values: Vec<f64> = reference.pixels.iter().map(luminance).collect();
    values.sort_unstable_by(f64::total_cmp);
    let lit = &values[values.partition_point(|v| *v <= 0.0)..];
    let brightest = *lit.last()?;
    let middle = |sorted: &[f64]| sorted[sorted.len() / 2];
    let median = if middle(&values) > 0.0 { middle(&values) } else { middle(lit) };
    let target = luminance_shown_at(0.85);
    let (start, stop) = ((target / brightest).log2(), (target / median).log2());
    let count = ((stop - start).ceil() as usize).max(2);
    Some(Exposures { start, stop, count })
}

/// The luminance that [`aces`] after its factor 0.6 maps to `shown`: the positive root of a quadratic.
fn luminance_shown_at(shown: f64) -> f64 {
    let (a, b, c) = (2.51 - shown * 2.43, 0.03 - shown * 0.59, -shown * 0.14);
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a) / 0.6
}

/// Filters and constants for images of one size.
struct Flip {
    size: Size,
    sensitivity: [Sensitivity; 3],
    features: Features,
    /// The largest colour difference there is, compressed.
    largest: f32,
}

/// What of an image is compared.
struct Seen {
    lab: Vec<[f32; 3]>,
    edges: Plane,
    points: Plane,
}

/// The exponent that compresses large colour differences.
const COLOR_EXPONENT: f32 = 0.7;

impl Flip {
    fn new(reference: &Image) -> Self {
        let green = color::to_hunt_lab([0.0, 1.0, 0.0]);
        let blue = color::to_hunt_lab([0.0, 0.0, 1.0]);
        Self {
            size: Size { width: reference.width, height: reference.height },
            sensitivity: Sensitivity::channels(PIXELS_PER_DEGREE),
            features: Features::new(PIXELS_PER_DEGREE),
            largest: color::hyab(green, blue).powf(COLOR_EXPONENT),
        }
    }

    fn map(&self, values: Plane) -> ScalarImage {
        ScalarImage { width: self.size.width, height: self.size.height, values }
    }

    /// The error of each pixel of the images after `tone`, which maps to [0, 1].
    fn errors(&self, image: &Image, reference: &Image, tone: &(dyn Fn(f32) -> f32 + Sync)) -> Plane {
        let (x, r) = (self.seen(image, tone), self.seen(reference, tone));
        (0..x.lab.len())
            .into_par_iter()
            .map(|i| {
                let color = self.color_error(color::hyab(x.lab[i], r.lab[i]));
                let edge = (x.edges[i] - r.edges[i]).abs();
                let point = (x.points[i] - r.points[i]).abs();
                let feature = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt().min(1.0);
                color.powf(1.0 - feature)
            })
            .collect()
    }

    fn seen(&self, image: &Image, tone: &(dyn Fn(f32) -> f32 + Sync)) -> Seen {
        let opponent: Vec<[f32; 3]> = image.pixels.par_iter().map(|p| color::to_ycxcz(p.map(tone))).collect();
        let plane = |c: usize| -> Plane { opponent.iter().map(|p| p[c]).collect() };
        let luminance: Plane = opponent.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
        let (edges, points) = self.features.strengths(&luminance, self.size);
        let [y, cx, cz] = [0, 1, 2].map(|c| self.sensitivity[c].apply(&plane(c), self.size));
        let lab = (0..y.len())
            .into_par_iter()
            .map(|i| color::to_hunt_lab(color::from_ycxcz([y[i], cx[i], cz[i]]).map(|v| v.clamp(0.0, 1.0))));
        Seen { lab: lab.collect(), edges, points }
    }

    /// A colour difference to [0, 1]: the lower 40% of the range take up 95% of it [Andersson et al. 2020 (section 4.1.4)].
    fn color_error(&self, difference: f32) -> f32 {
        const KNEE: f32 = 0.4;
        const AT_KNEE: f32 = 0.95;
        let power = difference.powf(COLOR_EXPONENT);
        let knee = KNEE * self.largest;
        if power < knee {
            return AT_KNEE / knee * power;
        }
        (AT_KNEE + (power - knee) / (self.largest - knee) * (1.0 - AT_KNEE)).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A smooth reference with a bright disc, and the same with a noise of ±20%; scripts/check_flip.py makes the
    /// same images for the official implementation.
    fn images(scale: f64) -> (Image, Image) {
        let reference = |x: usize, y: usize, c: usize| {
            let (fx, fy, fc) = (x as f64, y as f64, c as f64);
            let wave = 0.5 + 0.45 * (0.3 * fx + fc).sin() * (0.2 * fy).cos();
            let disc = (fx - 30.0).powi(2) + (fy - 12.0).powi(2) < 36.0;
            wave * scale * if disc { 8.0 } else { 1.0 }
        };
        let noise =
            |x: usize, y: usize, c: usize| 0.8 + 0.4 * ((x * 73 + y * 179 + c * 283) % 101) as f64 / 101.0;
        let make = |f: &dyn Fn(usize, usize, usize) -> f64| {
            Image::from_fn(48, 40, |x, y| [0, 1, 2].map(|c| f(x, y, c) as f32))
        };
        (make(&|x, y, c| reference(x, y, c) * noise(x, y, c)), make(&reference))
    }

    #[test]
    fn agrees_with_the_official_implementation() {
        // flip-evaluator 1.7, by scripts/check_flip.py.
        let (x, r) = images(1.0);
        assert!((hdr(&x, &r).mean() - 0.053_352).abs() < 2e-5, "{}", hdr(&x, &r).mean());
        let found = exposures(&r).unwrap();
        assert!((found.start + 1.753_537).abs() < 1e-5 && (found.stop - 2.051_412).abs() < 1e-5, "{found:?}");
        assert_eq!(found.count, 4);
        let (x, r) = images(0.7);
        assert!((ldr(&x, &r).mean() - 0.052_095).abs() < 2e-5, "{}", ldr(&x, &r).mean());
    }

    #[test]
    fn the_largest_difference_is_one() {
        let plain = |rgb: [f32; 3]| Image::from_fn(32, 32, |_, _| rgb);
        let map = ldr(&plain([0.0, 1.0, 0.0]), &plain([0.0, 0.0, 1.0]));
        assert!(map.values.iter().all(|v| (v - 1.0).abs() < 1e-5));
    }

    #[test]
    fn exposures_need_no_light_in_the_median_nor_in_the_reference() {
        let lamp = Image::from_fn(8, 8, |x, y| if x + y < 2 { [4.0; 3] } else { [0.0; 3] });
        let found = exposures(&lamp).unwrap();
        assert!(found.start == found.stop && found.count == 2, "{found:?}");
        let black = Image::new(8, 8);
        assert_eq!(exposures(&black), None);
        let map = hdr(&lamp, &black);
        assert!(map.values[0] > 0.5 && map.values.iter().all(|v| (0.0..=1.0).contains(v)));
    }

    #[test]
    fn any_finite_image_has_an_error_between_zero_and_one() {
        let value = |i: usize| f32::from_bits((i as u32).wrapping_mul(2_654_435_769));
        let wild = |seed: usize| {
            Image::from_fn(16, 16, |x, y| {
                [0, 1, 2].map(|c| {
                    Some(value(seed + 3 * (16 * y + x) + c)).filter(|v| v.is_finite()).unwrap_or(0.0)
                })
            })
        };
        for map in [hdr(&wild(1), &wild(10_000)), ldr(&wild(1), &wild(10_000))] {
            assert!(map.values.iter().all(|v| (0.0..=1.0).contains(v)));
        }
    }
}
