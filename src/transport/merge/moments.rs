//! What each sample of a pilot adds to the second moment of its pixel: the weights of [`super::evidence`].
//!
//! What is judged is the geometric mean of two errors: the squared one, which the brightest parts of the image decide, and the one relative to the
//! square of the brightness of a part of the image. Two things are more than the formula has: a technique that makes one sample a camera subpath has its own mean squared taken off, so that light that comes nearly
//! without noise does not count as noise; and no sample counts for more than a part of all, so that a single firefly of the pilot does not decide.
//!
//! Samples of one camera subpath are not independent: all merges at a vertex are there at once or not at all, and where a subpath rarely
//! comes to a place with many photons, as near a lamp in fog, they come in a bunch. So to the moment of a sample its products with
//! the others of the same vertex (or the same edge, of beams) are added, less the square of their mean, for which their product with those
//! of the next pixel is taken: with n' for n, the product
//! of v and v' becomes
//!
//! ```text
//! q' v v' (n'_t / n_t) (n'_t' / n_t') (Σ n p / Σ n' p)²
//! ```
//!
//! where q' is by how much rarer the camera subpath comes there, and the sums of the other sample, of a path much the same, are taken for those of this one.

use super::evidence::Counts;
use super::pilot::{Maker, Pilot, Seen, tracked};
use super::settings::{Beams, MERGES, has_camera_beam, place_of};
use crate::scene::Scene;
use crate::transport::technique::Technique;
use glam::UVec2;
use std::collections::{HashMap, HashSet};

/// Parts of the image a side.
const PARTS: u32 = 8;
/// ε of the relative error: of the image's mean squared.
const EPSILON: f64 = 0.01;
/// No sample counts for more than this part of all.
const MOST: f64 = 0.01;

/// What names a maker in a table.
pub type Key = (bool, u64);

/// The name of a maker.
pub fn key(maker: Maker) -> Key {
    match maker {
        Maker::Camera(pixel) => (true, u64::from(pixel.y) << 32 | u64::from(pixel.x)),
        Maker::Light(path) => (false, path),
    }
}

/// Merges by technique, and all that does not merge.
pub const KINDS: usize = MERGES.len() + 1;

/// What a sample adds to the second moment of its pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moment {
    /// Its own square.
    pub square: f64,
    /// Its products with the others of its vertex or edge, by what made those.
    pub products: [f64; KINDS],
    /// Its own kind.
    pub kind: usize,
    /// Of a light as the lens sees it, connected with it: how often a camera subpath misses it by a collision. It is all the noise that
    /// is left of what only camera subpaths find.
    pub misses: Option<f64>,
    /// What the absolute and the relative error multiply these by.
    pub of: [f64; 2],
}

impl Moment {
    /// With other numbers of samples, where the path has `density` times Σ n p, and camera subpaths come to where it was joined `reached` times as often.
    pub fn with(&self, counts: &Counts, density: f64, reached: f64) -> f64 {
        let over = |x: f64, by: f64| if x > 0.0 { x / by } else { 0.0 };
        let [square, products] = self.terms(counts, reached);
        over(square, density) + over(products, density * density)
    }

    /// What of it is divided by the density, and what by its square.
    pub fn terms(&self, counts: &Counts, reached: f64) -> [f64; 2] {
        let times = |kind: usize| counts.merges.get(kind).copied().unwrap_or(1.0);
        let products: f64 = self.products.iter().enumerate().map(|(kind, p)| p * times(kind)).sum();
        let square = self.square * if counts.direct { 1.0 } else { self.misses.unwrap_or(1.0) };
        [square, reached * times(self.kind) * products]
    }
}

/// A vertex of a subpath that samples share, or the edge before it: the subpath, its vertices, whether it is the edge.
type Spot = (Key, u32, bool);

fn spot(seen: &Seen) -> Spot {
    (key(seen.maker), seen.t, has_camera_beam(seen.technique))
}

fn is_merge(seen: &Seen) -> bool {
    place_of(seen.technique).is_some()
}

/// Of which kind of [`KINDS`] a sample is.
fn kind(seen: &Seen) -> usize {
    place_of(seen.technique).unwrap_or(KINDS - 1)
}

/// What the samples of a pilot are, part by part of the image.
struct Parts<'a> {
    pilot: &'a Pilot,
    counts: &'a Counts,
    size: UVec2,
    /// Camera subpaths of each.
    tracks: Vec<f64>,
    /// The mean brightness of each.
    mean: Vec<f64>,
    /// The share of each's camera subpaths whose first edge ends in no collision.
    passes: Vec<f64>,
    /// Sums over the samples of a spot, by their kind.
    spots: HashMap<Spot, [f64; KINDS]>,
    /// By part and spot of a camera subpath: the mean square of a spot's sum S, and the mean of S S' with the next pixel's.
    squares: HashMap<(usize, u32, bool), [f64; 2]>,
}

impl<'a> Parts<'a> {
    const COUNT: usize = (PARTS * PARTS) as usize;

    fn of(scene: &Scene, pilot: &'a Pilot, counts: &'a Counts) -> Self {
        let zeros = || vec![0.0; Self::COUNT];
        let size = scene.camera.size();
        let (tracks, mean, passes) = (zeros(), zeros(), zeros());
        let (spots, squares) = (HashMap::new(), HashMap::new());
        let mut parts = Self { pilot, counts, size, tracks, mean, passes, spots, squares };
        for (pixel, track) in tracked(scene).zip(&pilot.tracks) {
            let part = parts.part(pixel);
            parts.tracks[part] += 1.0;
            parts.passes[part] += if track.get(1).is_none_or(|step| step.on_surface) { 1.0 } else { 0.0 };
        }
        parts.passes.iter_mut().zip(&parts.tracks).for_each(|(passed, all)| *passed /= f64::max(*all, 1.0));
        for seen in &pilot.seen {
            let value = parts.stands_for(seen) * f64::from(seen.value);
            let part = parts.part(seen.pixel);
            parts.mean[part] += parts.rate(seen) * value;
            parts.spots.entry(spot(seen)).or_default()[kind(seen)] += value;
        }
        parts.compare_with_next(&tracked(scene).collect::<Vec<_>>());
        parts
    }

    /// The part that a pixel is in.
    fn part(&self, pixel: UVec2) -> usize {
        let at = (pixel * PARTS / self.size).min(UVec2::splat(PARTS - 1));
        (at.y * PARTS + at.x) as usize
    }

    /// How many such subpaths a pixel of the part has, for one that is here.
    fn rate(&self, seen: &Seen) -> f64 {
        match seen.maker {
            Maker::Light(_) => {
                Self::COUNT as f64 / self.pilot.paths.min(self.pilot.pass.partners).max(1) as f64
            }
            Maker::Camera(_) => 1.0 / f64::max(self.tracks[self.part(seen.pixel)], 1.0),
        }
    }

    /// Of how many samples one is here.
    fn stands_for(&self, seen: &Seen) -> f64 {
        if is_merge(seen) { self.pilot.stands_for(seen.technique) } else { 1.0 }
    }

    /// The sum of a spot with the numbers of samples that are asked about.
    fn sum(&self, spot: &Spot) -> f64 {
        let times = |kind: usize| self.counts.merges.get(kind).copied().unwrap_or(1.0);
        self.spots.get(spot).map_or(0.0, |sums| sums.iter().enumerate().map(|(k, s)| s * times(k)).sum())
    }

    /// What of a spot's sums is noise shows against the next pixel's, which has about the same mean.
    fn compare_with_next(&mut self, tracked: &[UVec2]) {
        let next: HashMap<Key, UVec2> = tracked
            .windows(2)
            .filter(|w| w[0].y == w[1].y && self.part(w[0]) == self.part(w[1]))
            .map(|w| (key(Maker::Camera(w[0])), w[1]))
            .collect();
        let mut pairs = vec![0.0; Self::COUNT];
        let has_next = |p: &&UVec2| next.contains_key(&key(Maker::Camera(**p)));
        tracked.iter().filter(has_next).for_each(|p| pairs[self.part(*p)] += 1.0);
        let mut counted = HashSet::new();
        for seen in self.pilot.seen.iter().filter(|s| matches!(s.maker, Maker::Camera(_))) {
            let (spot, part) = (spot(seen), self.part(seen.pixel));
            if !counted.insert(spot) {
                continue;
            }
            let (sum, rate) = (self.sum(&spot), self.rate(seen));
            let beside =
                next.get(&spot.0).map_or(0.0, |p| self.sum(&(key(Maker::Camera(*p)), spot.1, spot.2)));
            let squares = self.squares.entry((part, spot.1, spot.2)).or_default();
            squares[0] += rate * sum * sum;
            squares[1] += sum * beside / f64::max(pairs[part], 1.0);
        }
    }

    /// How much of the mean square of what a sample's spot has is noise.
    fn spread(&self, seen: &Seen) -> f64 {
        let (part, (_, t, along)) = (self.part(seen.pixel), spot(seen));
        let squares = self.squares.get(&(part, t, along));
        let spread = squares.map_or(1.0, |[squares, beside]| (1.0 - beside / squares).max(0.0));
        // What a pixel sees first is the same in each iteration, however it changes from pixel to pixel.
        let long = self.pilot.pass.settings.merging.camera_beams == Beams::Long;
        let sure = match seen {
            Seen { t: 2, technique, .. } if long && has_camera_beam(*technique) => 1.0,
            Seen { t: 2, technique, on_surface, .. } if *on_surface || has_camera_beam(*technique) => {
                self.passes[part]
            }
            _ if is_direct(seen) => self.passes[part],
            _ => 0.0,
        };
        f64::min(spread, 1.0 - sure)
    }

    fn moment(&self, seen: &Seen, overall: f64) -> Moment {
        let (part, value) = (self.part(seen.pixel), f64::from(seen.value));
        let often = self.rate(seen) * self.stands_for(seen);
        let of_light = matches!(seen.maker, Maker::Light(_));
        let spread = self.spread(seen);
        let mut products = [0.0; KINDS];
        if !of_light {
            products = self.spots[&spot(seen)];
            products[kind(seen)] -= self.stands_for(seen) * value;
            products.iter_mut().for_each(|p| *p = (*p * spread * often * value).max(0.0));
        }
        let alone = if is_merge(seen) || of_light { 1.0 } else { spread };
        let relative = 1.0 / (self.mean[part] * self.mean[part] + EPSILON * overall * overall);
        let direct = is_direct(seen);
        Moment {
            square: alone * often * value * value,
            products,
            kind: kind(seen),
            misses: (direct && seen.technique == Technique::Lens).then_some(1.0 - self.passes[part]),
            // Lights as they are seen directly are far brighter than their part of the image.
            of: [1.0, if direct { 0.0 } else { relative }],
        }
    }
}

/// Whether it is a light as the lens sees it.
fn is_direct(seen: &Seen) -> bool {
    seen.s + seen.t <= 2
}

/// What each sample of a pilot adds to the second moment of the image; in all 1, absolute and relative, with numbers of samples as in `counts`.
pub fn moments(scene: &Scene, pilot: &Pilot, counts: &Counts) -> Vec<Moment> {
    let parts = Parts::of(scene, pilot, counts);
    let overall = parts.mean.iter().sum::<f64>() / Parts::COUNT as f64;
    let mut moments: Vec<Moment> = pilot.seen.iter().map(|seen| parts.moment(seen, overall)).collect();
    for error in 0..2 {
        let of = |m: &Moment| m.of[error] * m.with(counts, 1.0, 1.0);
        let most = MOST * moments.iter().map(of).sum::<f64>();
        for moment in &mut moments {
            let now = of(moment);
            if now > most {
                moment.of[error] *= most / now;
            }
        }
        let all: f64 = moments.iter().map(of).sum();
        moments.iter_mut().for_each(|m| m.of[error] /= if all > 0.0 { all } else { 1.0 });
    }
    moments
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_go_by_the_density_and_products_by_its_square() {
        let mut products = [0.0; KINDS];
        products[0] = 3.0;
        products[KINDS - 1] = 5.0;
        let moment = Moment { square: 2.0, products, kind: 0, misses: None, of: [1.0; 2] };
        let mut merges = [1.0; MERGES.len()];
        merges[0] = 0.5;
        let counts = Counts { merges, continuations: Vec::new(), direct: true };
        // 2 / 4, and 0.25 of what a camera subpath reaches, times n of its own kind, times 3 n + 5, over 16.
        let expected = 2.0 / 4.0 + 0.25 * 0.5 * (3.0 * 0.5 + 5.0) / 16.0;
        assert!((moment.with(&counts, 4.0, 0.25) - expected).abs() < 1e-12);
    }
}
