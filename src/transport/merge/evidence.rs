//! What a pilot's samples tell of settings that it did not have.
//!
//! Under the balance heuristic the second moment of a pixel is
//!
//! ```text
//! Σ_t n_t ∫ (w_t f / (n_t p_t))² p_t = ∫ f² / Σ_t n_t p_t
//! ```
//!
//! with the densities p_t of all techniques and their numbers of samples n_t. A sample of the pilot has the value v = f / Σ n p; so the
//! second moment that other numbers n' would have is the mean of
//!
//! ```text
//! v² · Σ n p / Σ n' p
//! ```
//!
//! over the same samples [Grittmann et al. 2022, "Efficiency-aware multiple importance sampling for bidirectional rendering algorithms"].
//! It needs no sample that only the others would make, and what a technique is needed for shows before it is gone: paths that it alone makes
//! are among the samples, and weigh heavily where it is off. Who else could have made a path is asked of the oracle
//! ([`crate::oracle`]), for some of the samples, drawn in proportion to their second moments.
//!
//! The continuation of camera subpaths from collisions is a factor of their densities, and counts as any other n.
//!
//! How much each sample adds, and what of it is no noise, is said in [`super::moments`].

use super::moments::{Key, Moment, key, moments};
use super::pilot::{Maker, NO_MEDIUM, Pilot};
use super::settings::{MERGES, place_of};
use crate::oracle::collect::{Recorder, whole_path};
use crate::oracle::{MadeBy, judge};
use crate::scene::Scene;
use crate::transport::sink::Joint;
use crate::transport::walk::Place;
use rayon::prelude::*;
use std::collections::HashMap;

/// Samples that are judged.
const JUDGED: u32 = 3000;
/// Numbers of samples, relative to the pilot's.
#[derive(Clone, Debug, PartialEq)]
pub struct Counts {
    /// N times the measure of the kernel, by technique in the order of [`MERGES`]; 0 where it is off.
    pub merges: [f64; MERGES.len()],
    /// By medium, the probability with which camera subpaths go on from a collision at most.
    pub continuations: Vec<f32>,
    /// Whether lights are connected with the lens as they are seen directly.
    pub direct: bool,
}

impl Counts {
    /// By how much rarer a camera subpath goes on from a collision in `medium` than by the albedo, `goes_on`.
    #[inline]
    pub fn rarer(&self, medium: u32, goes_on: f32) -> f64 {
        match self.continuations.get(medium as usize) {
            Some(most) if *most < goes_on => f64::from(most / goes_on),
            _ => 1.0,
        }
    }
}

/// One vertex of a judged path: shares of Σ n p.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    /// Of the connection that has so many light vertices.
    pub connection: f64,
    /// Of the merges here.
    merges: [f64; MERGES.len()],
    /// The medium of a collision; [`NO_MEDIUM`] elsewhere.
    medium: u32,
    /// The probability of going on from the collision by the albedo.
    goes_on: f32,
}

impl Point {
    pub const NOTHING: Self =
        Self { connection: 0.0, merges: [0.0; MERGES.len()], medium: NO_MEDIUM, goes_on: 1.0 };
}

/// A judged path: what its sample adds to the second moments, and its vertices from the light to the lens.
#[derive(Clone, Debug)]
pub(super) struct Judged {
    pub moment: Moment,
    /// The light that it starts on.
    pub light: usize,
    /// Whether the sample is of a light subpath, whose start was drawn among the lights.
    pub started: bool,
    /// Where the subpaths were joined: i of a merge, s of a connection.
    pub joined: usize,
    pub points: Vec<Point>,
}

/// Σ n' p / Σ n p of a judged path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Density {
    /// Of what has no light subpath: hits, and lights that are sampled from a vertex.
    pub without: f64,
    /// Of what starts with a light subpath.
    pub started: f64,
    /// By how much rarer camera subpaths come to where it was joined.
    pub reached: f64,
}

/// Whether a connection with `s` light vertices, of a path with so many in all, is of a light subpath: not where a light is hit or sampled
/// from a vertex.
fn has_light_subpath(s: usize, vertices: usize) -> bool {
    s > 1 || (s == 1 && vertices == 2)
}

impl Judged {
    pub fn density(&self, counts: &Counts) -> Density {
        let mut reached = 1.0;
        let mut density = Density { without: 0.0, started: 0.0, reached: 1.0 };
        for (i, point) in self.points.iter().enumerate().rev() {
            let merges: f64 = point.merges.iter().zip(&counts.merges).map(|(share, n)| share * n).sum();
            // With two vertices, s = 1 is the light as the lens sees it.
            let off = !counts.direct && self.points.len() == 2 && i == 1;
            let connection = if off { 0.0 } else { point.connection };
            density.started += reached * merges;
            if has_light_subpath(i, self.points.len()) {
                density.started += reached * connection;
            } else {
                density.without += reached * connection;
            }
            if i == self.joined {
                density.reached = reached;
            }
            if point.medium != NO_MEDIUM {
                reached *= counts.rarer(point.medium, point.goes_on);
            }
        }
        density
    }
}

/// Samples of a pilot with all that could have made them.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    pub(super) judged: Vec<Judged>,
}

impl Evidence {
    /// Of what a pilot saw, for numbers of samples about `counts`.
    pub fn of(scene: &Scene, pilot: &Pilot, counts: &Counts) -> Self {
        let moments = moments(scene, pilot, counts);
        let mut by_maker: HashMap<Key, Vec<(u32, Moment)>> = HashMap::new();
        let mut order = Vec::new();
        let (mut sum, mut drawn) = (0.0, 0u32);
        for (seen, moment) in pilot.seen.iter().zip(&moments) {
            // In proportion to the sum of both errors, of which each is half of all.
            let part = 0.5 * moment.with(counts, 1.0, 1.0) * (moment.of[0] + moment.of[1]);
            sum += part * f64::from(JUDGED);
            let up_to = (sum + 0.5).floor() as u32;
            if up_to > drawn {
                let of_maker = by_maker.entry(key(seen.maker)).or_default();
                if of_maker.is_empty() {
                    order.push(seen.maker);
                }
                let stands_for = f64::from(up_to - drawn) / (part * f64::from(JUDGED));
                of_maker.push((seen.ordinal, Moment { of: moment.of.map(|of| of * stands_for), ..*moment }));
                drawn = up_to;
            }
        }
        let judged: Vec<Vec<Judged>> = order
            .par_iter()
            .map(|maker| {
                let recorder = match maker {
                    Maker::Camera(pixel) => {
                        let mut recorder = Recorder::default();
                        pilot.trace_camera(scene, *pixel, &mut recorder);
                        recorder
                    }
                    Maker::Light(path) => Recorder::of_light(scene, &pilot.pass, *path),
                };
                let chosen = by_maker[&key(*maker)].iter();
                chosen
                    .filter_map(|(ordinal, moment)| {
                        judged(scene, pilot, *maker, &recorder, *ordinal as usize, *moment)
                    })
                    .collect()
            })
            .collect();
        Self { judged: judged.concat() }
    }

    /// Of several pilots, with numbers of samples about `counts`: their mean.
    pub fn of_all(scene: &Scene, pilots: &[Pilot], counts: &Counts) -> Self {
        let each = 1.0 / pilots.len().max(1) as f64;
        let judged = pilots.iter().flat_map(|pilot| Self::of(scene, pilot, counts).judged);
        let scaled = judged.map(|mut judged| {
            judged.moment.of.iter_mut().for_each(|of| *of *= each);
            judged
        });
        Self { judged: scaled.collect() }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.judged.is_empty()
    }

    /// The error with other numbers of samples, up to a factor: the geometric mean of both [`Self::errors`].
    pub fn error(&self, counts: &Counts) -> f64 {
        let [absolute, relative] = self.errors(counts);
        (absolute * relative).sqrt()
    }

    /// The squared error and the relative one, each 1 with the numbers that it was gathered for where camera subpaths go on by the
    /// albedo; infinite where some path could not be made.
    pub fn errors(&self, counts: &Counts) -> [f64; 2] {
        let mut errors = [0.0; 2];
        for judged in &self.judged {
            let Density { without, started, reached } = judged.density(counts);
            let moment = judged.moment.with(counts, without + started, reached);
            for (error, of) in errors.iter_mut().zip(judged.moment.of).filter(|(_, of)| *of > 0.0) {
                *error += of * moment;
            }
        }
        errors
    }
}

/// The path behind a sample; `None` where the oracle makes nothing of it (points on a wall, by rounding).
fn judged(
    scene: &Scene,
    pilot: &Pilot,
    maker: Maker,
    recorder: &Recorder,
    ordinal: usize,
    moment: Moment,
) -> Option<Judged> {
    let (sample, joint) = recorder.samples.get(ordinal)?;
    let nobody = Recorder::default();
    let walked_again = |path: u64| Recorder::of_light(scene, &pilot.pass, path);
    let traced = match (joint, maker) {
        (Joint::Merge(meeting), _) => {
            whole_path(scene, &walked_again(meeting.path.into()), recorder, sample, joint)?
        }
        (Joint::Connect(_), Maker::Camera(pixel)) => {
            whole_path(scene, &walked_again(pilot.partner(scene, pixel)), recorder, sample, joint)?
        }
        (_, Maker::Light(_)) => whole_path(scene, recorder, &nobody, sample, joint)?,
        _ => whole_path(scene, &nobody, recorder, sample, joint)?,
    };
    let verdict = judge(scene, &pilot.pass, &traced.path, traced.made_by());
    let beta = crate::explain::exponent(pilot.pass.settings.heuristic);
    let all: Vec<(MadeBy, f64)> = verdict.techniques().map(|t| (t, verdict.log_density(t))).collect();
    let largest = all.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = all.iter().map(|(_, log)| (log - largest).exp()).sum();
    if !(largest.is_finite() && sum.is_finite()) {
        return None;
    }
    // In f32 a grazing direction or a far vertex can be another one than the oracle finds: then it says nothing of this sample.
    let own = (verdict.log_density(traced.made_by()) - largest).exp() / sum;
    let given = if beta == 1.0 { f64::from(sample.weight) } else { own };
    if !(own > 0.0 && (own - given).abs() < 0.05 * given) {
        return None;
    }
    let mut points = vec![Point::NOTHING; traced.path.interior.len() + 2];
    for (point, place) in points[1..].iter_mut().zip(&traced.path.interior) {
        if let Place::Medium(collision) = place {
            point.medium = collision.medium;
            point.goes_on =
                scene.media[collision.medium as usize].continuation(&collision.coefficients).max(1e-6);
        }
    }
    for (made_by, log) in all {
        let share = (log - largest).exp() / sum;
        match made_by {
            MadeBy::Connection(s) => points[s].connection = share,
            MadeBy::Merge(technique, i) => points[i].merges[place_of(technique)?] = share,
        }
    }
    let (joined, started) = match traced.made_by() {
        MadeBy::Connection(s) => (s, has_light_subpath(s, points.len())),
        MadeBy::Merge(_, i) => (i, true),
    };
    Some(Judged { moment, light: traced.path.light.light as usize, started, joined, points })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::merge::moments::KINDS;

    fn point(connection: f64, surface: f64, medium: u32) -> Point {
        let mut point = Point { connection, medium, goes_on: 0.8, ..Point::NOTHING };
        point.merges[0] = surface;
        point
    }

    /// One path, merged on a surface at x_2.
    fn evidence(points: Vec<Point>, products: [f64; KINDS]) -> Evidence {
        let moment = Moment { square: 1.0, products, kind: 0, misses: None, of: [1.0; 2] };
        Evidence { judged: vec![Judged { moment, light: 0, started: true, joined: 2, points }] }
    }

    #[test]
    fn moments_follow_from_shares() {
        // x_0, a collision x_1 in medium 0, a surface x_2 with a merge, the lens.
        let points = vec![
            point(0.1, 0.0, NO_MEDIUM),
            point(0.2, 0.0, 0),
            point(0.3, 0.4, NO_MEDIUM),
            point(0.0, 0.0, NO_MEDIUM),
        ];
        let evidence = evidence(points, [0.0; KINDS]);
        let moment = |surface: f64, most: f32| {
            let mut merges = [1.0; MERGES.len()];
            merges[0] = surface;
            evidence.error(&Counts { merges, continuations: vec![most], direct: true })
        };
        assert!((moment(1.0, 1.0) - 1.0).abs() < 1e-12, "the pilot's own");
        assert!((moment(0.0, 1.0) - 1.0 / 0.6).abs() < 1e-12, "what merges is missing");
        // Only the connection at x_0 has camera subpaths that went on from the collision.
        assert!((moment(1.0, 0.4) - 1.0 / 0.95).abs() < 1e-7);
    }

    #[test]
    fn what_no_one_makes_is_infinite() {
        let evidence = evidence(vec![point(0.0, 1.0, NO_MEDIUM)], [0.0; KINDS]);
        let off = Counts { merges: [0.0; MERGES.len()], continuations: Vec::new(), direct: true };
        assert!(evidence.error(&off).is_infinite());
    }
}
