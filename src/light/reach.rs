//! Which light is asked for light at a point: by what each would bring there if nothing were in the way.
//!
//! A lamp of the power Φ at the distance d brings about Φ / (4π d²), and what is infinitely far away about Φ / (4 A), where A is the disc
//! that the power is measured through. Of the probability a part stays with the powers alone, as what is near can be hidden.

use crate::math::Rgb;
use crate::math::{Discrete, RgbExt};
use glam::Vec3A;

/// More lights than so many are selected by their power alone: each is looked at for each selection.
const MOST: usize = 16;
/// The part of the probability that goes by the powers alone.
const BY_POWER: f32 = 0.25;

/// A light as it is seen from afar.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    /// The middle of it.
    pub centre: Vec3A,
    /// Half of its extent; no point is taken to be nearer than this. (metres)
    pub radius: f32,
    /// Whether it is infinitely far away.
    pub infinite: bool,
}

/// What lights bring to points.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    lights: Vec<Entry>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    centre: Vec3A,
    /// Square of the least distance.
    least2: f32,
    /// Φ / 4π of a lamp.
    near: f32,
    /// Φ / 4A of what is infinitely far away.
    far: f32,
    /// Probability by power.
    by_power: f32,
}

impl Reach {
    /// `None` where the powers alone have to do. `disc`: A (m²).
    pub fn new(sources: &[Source], powers: &[Rgb], selection: &Discrete, disc: f32) -> Option<Self> {
        let some = |(i, source): (usize, &Source)| {
            let power = powers[i].luminance();
            let (near, far) = if source.infinite {
                (0.0, 0.25 * power / disc)
            } else {
                (power / (4.0 * std::f32::consts::PI), 0.0)
            };
            // Of a point light no point is nearer than a thousandth of the scene.
            let least2 = (source.radius * source.radius).max(1e-6 * disc);
            Entry { centre: source.centre, least2, near, far, by_power: selection.pdf(i) }
        };
        let lights: Vec<Entry> = sources.iter().enumerate().map(some).collect();
        (2..=MOST).contains(&lights.len()).then_some(Self { lights })
    }

    /// What a light brings to `from`.
    #[inline]
    fn brought(light: &Entry, from: Vec3A) -> f32 {
        light.far + light.near / light.centre.distance_squared(from).max(light.least2)
    }

    /// What all bring; above 0.
    #[inline]
    fn all(&self, from: Vec3A) -> f32 {
        self.lights.iter().map(|light| Self::brought(light, from)).sum()
    }

    /// The probability of a light toward `from`, where all bring `all`.
    #[inline]
    fn probability(light: &Entry, from: Vec3A, all: f32) -> f32 {
        BY_POWER * light.by_power + (1.0 - BY_POWER) * (Self::brought(light, from) / all)
    }

    /// The probability with which light `i` is selected toward `from`.
    #[inline]
    pub fn pdf(&self, i: usize, from: Vec3A) -> f32 {
        Self::probability(&self.lights[i], from, self.all(from))
    }

    /// A light toward `from`, and its probability.
    #[inline]
    pub fn sample(&self, from: Vec3A, u: f32) -> (usize, f32) {
        let all = self.all(from);
        let mut left = u;
        let mut last = (0, 0.0);
        for (i, light) in self.lights.iter().enumerate() {
            let probability = Self::probability(light, from, all);
            if probability > 0.0 {
                last = (i, probability);
                if left < probability {
                    break;
                }
                left -= probability;
            }
        }
        last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reach() -> Reach {
        let lamp = |x: f32| Source { centre: Vec3A::new(x, 0.0, 0.0), radius: 0.1, infinite: false };
        let sky = Source { centre: Vec3A::ZERO, radius: 0.0, infinite: true };
        let powers = [Rgb::splat(3.0), Rgb::splat(3.0), Rgb::splat(6.0), Rgb::ZERO];
        let selection = Discrete::new(powers.iter().map(|p| f64::from(p.luminance()))).unwrap();
        Reach::new(&[lamp(-5.0), lamp(5.0), sky, lamp(0.0)], &powers, &selection, 10.0).unwrap()
    }

    #[test]
    fn probabilities_sum_to_one_and_the_dark_has_none() {
        let reach = reach();
        for x in [-5.0, -1.0, 0.0, 4.9, 80.0] {
            let from = Vec3A::new(x, 0.3, 0.0);
            let sum: f32 = (0..4).map(|i| reach.pdf(i, from)).sum();
            assert!((sum - 1.0).abs() < 1e-5, "{sum}");
            assert_eq!(reach.pdf(3, from), 0.0);
            for u in [0.0, 0.2, 0.5, 0.8, 0.99999] {
                let (i, pdf) = reach.sample(from, u);
                assert_eq!(pdf, reach.pdf(i, from));
                assert!(pdf > 0.0);
            }
        }
    }

    #[test]
    fn what_is_near_is_selected_more_often_and_nothing_is_forgotten() {
        let reach = reach();
        let pdf = |i: usize, x: f32| reach.pdf(i, Vec3A::new(x, 0.0, 0.0));
        assert!(pdf(0, -4.5) > 0.7 && pdf(1, 4.5) > 0.7, "{} {}", pdf(0, -4.5), pdf(1, 4.5));
        assert!(pdf(2, 500.0) > 0.8, "far from the lamps there is the sky: {}", pdf(2, 500.0));
        assert!(pdf(1, -4.9) > 0.05 && pdf(2, -4.9) > 0.1, "by their powers alone");
    }

    #[test]
    fn many_lights_go_by_their_power() {
        let lamp = Source { centre: Vec3A::ZERO, radius: 0.0, infinite: false };
        for (count, there) in [(1, false), (2, true), (MOST, true), (MOST + 1, false)] {
            let powers = vec![Rgb::ONE; count];
            let selection = Discrete::new((0..count).map(|_| 1.0)).unwrap();
            assert_eq!(Reach::new(&vec![lamp; count], &powers, &selection, 1.0).is_some(), there, "{count}");
        }
    }
}
