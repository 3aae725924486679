//! Media that scatter light many times: only a share of the connections is made there, and camera subpaths that are
//! merged with go on for a part of their collisions only.
//!
//! In wax or milk a subpath has dozens to hundreds of vertices close to each other, and so a path can be made by as many
//! connections, all of about the same density. The balance heuristic takes them for independent samples and gives them
//! together nearly all of the weight; but they are not: where the two subpaths of a pixel come into the same solid at
//! all, which happens rarely, they can all be made at once, and come in a bunch that is as much too bright as it is
//! large. Path tracing alone then has much less variance than a set that contains it, and the connections of all with
//! all take most of the time.
//!
//! So a collision in a medium takes part in connections with the share g = min(1, sqrt(b/n)), where n is the number of
//! collisions in that medium of a subpath that collides there, as seen from one of them: E[n²]/E[n], counted by a pilot; and the connection
//! of two vertices is made with the probability c = g g', where g is 1 on surfaces. The share depends on the medium alone, so that
//! c is known from either end and enters the weights as the count that it is (transport.md, 3).
//!
//! Where something merges in media, light that is scattered many times comes by light subpaths as well, and these are merged
//! with at the first collisions and along the first edges that a camera subpath has. What it would look for further on
//! takes most of the time and adds little. So it goes on from a collision with the probability 1 − k/n at most, which takes it about
//! n/k collisions far, but at least with [`LEAST_CONTINUATION`]. How far that has to be grows with n: in fog light
//! subpaths get everywhere, but to the foot of a candle, through a dense medium of high albedo, only few do, and the two subpaths
//! have to share the way. (Measured with the same for all: at 0.4 fog was rendered twice as efficiently as at 1, but that
//! foot was left to rare bright samples.)

use super::expression::Label;
use super::merge::pilot::{PILOT, pixels};
use super::merge::{Gathers, MERGES};
use super::pass::Pass;
use super::settings::{Connections, Settings};
use super::technique::{Technique, TechniqueSet};
use super::walk::{Flight, Place, Vertex, Visitor, walk};
use crate::bsdf::Mode;
use crate::geometry::Ray;
use crate::math::{Stream, StreamKind};
use crate::scene::{Arrival, Scene};

/// b: so many collisions of a subpath in a medium may be connected on average before they are thinned out.
const BUNCH: f64 = 2.0;
/// k: into so many parts the collisions of a camera subpath are divided, of which it goes on for one.
const PARTS: f64 = 3.0;
/// A camera subpath goes on with this probability, or the albedo, at least.
const LEAST_CONTINUATION: f64 = 0.4;
/// Longest paths of the pilot, the same whatever lengths a render counts: these change no random number.
const LENGTH: u32 = 256;
/// The pilot's rays lie on a grid of so many a side.
const GRID: u32 = 64;

/// What is thinned out in each medium.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Thinning {
    /// g, the share with which its collisions are connected; empty where all are 1.
    pub shares: Vec<f32>,
    /// The probability with which a camera subpath goes on from a collision at most; empty where all are 1.
    pub continuations: Vec<f32>,
}

impl Thinning {
    /// As the settings say, and where they leave it open as a pilot's collisions suggest.
    pub fn of(scene: &Scene, settings: &Settings) -> Self {
        if !scene.traits.scattering {
            return Self::default();
        }
        let thins =
            settings.connections == Connections::Thinned && settings.techniques.has(Technique::Connect);
        let stops = merges_in_media(settings.techniques) && !settings.merging.first;
        let asked = settings.merging.camera_continuation;
        let all = |value: f32| vec![value; scene.media.len()];
        if !thins && (!stops || asked.is_some()) {
            return Self {
                shares: Vec::new(),
                continuations: known(if stops { all(asked.unwrap_or(1.0)) } else { Vec::new() }),
            };
        }
        let collisions = collisions(scene, settings);
        let share = |n: f64| if n > BUNCH { (BUNCH / n).sqrt() as f32 } else { 1.0 };
        let continuation = |n: f64| (1.0 - PARTS / n.max(PARTS)).max(LEAST_CONTINUATION) as f32;
        let by = |f: &dyn Fn(f64) -> f32| known(collisions.iter().map(|n| f(*n)).collect());
        Self {
            shares: if thins { by(&share) } else { Vec::new() },
            continuations: match (stops, asked) {
                (false, _) => Vec::new(),
                (true, Some(value)) => known(all(value)),
                (true, None) => by(&continuation),
            },
        }
    }

    /// g in a medium.
    #[inline]
    pub fn share(&self, medium: u32) -> f32 {
        self.shares.get(medium as usize).copied().unwrap_or(1.0)
    }

    /// The probability with which a camera subpath goes on from a collision in a medium at most.
    #[inline]
    pub fn continuation(&self, medium: u32) -> f32 {
        self.continuations.get(medium as usize).copied().unwrap_or(1.0)
    }
}

/// Nothing where all are 1.
fn known(values: Vec<f32>) -> Vec<f32> {
    if values.iter().all(|v| *v == 1.0) { Vec::new() } else { values }
}

fn merges_in_media(techniques: TechniqueSet) -> bool {
    MERGES.into_iter().any(|t| t != Technique::Surface && techniques.has(t))
}

/// n of each medium: of a camera subpath that collides there, as seen from one of its collisions; 0 where none does.
fn collisions(scene: &Scene, settings: &Settings) -> Vec<f64> {
    let alone = Settings { techniques: TechniqueSet::of(&[Technique::Hit]), ..*settings };
    let pass = Pass::new(alone, PILOT, Gathers::default(), 0, Thinning::default());
    let mut counter = Counter { now: vec![0; scene.media.len()], sums: vec![[0.0; 2]; scene.media.len()] };
    for (i, pixel) in pixels(scene, GRID).enumerate() {
        // The seed is no part of it: independent runs shall have the same techniques.
        let mut random = Stream::new(0, PILOT, StreamKind::Other, i as u64);
        let ray = scene.camera.sample_ray(pixel, random.next_2d(), random.next_2d());
        let flight = Flight::from_lens(scene, &pass, Ray::new(ray.origin, ray.dir), ray.pdf);
        walk::<false, _>(scene, &pass, LENGTH, flight, &mut random, &mut counter);
        counter.end_path();
    }
    counter.sums.iter().map(|[sum, squares]| if *sum > 0.0 { squares / sum } else { 0.0 }).collect()
}

/// Counts collisions by medium.
struct Counter {
    now: Vec<u32>,
    /// Σ n and Σ n² over subpaths.
    sums: Vec<[f64; 2]>,
}

impl Counter {
    fn end_path(&mut self) {
        for (now, sums) in self.now.iter_mut().zip(&mut self.sums) {
            let n = f64::from(std::mem::take(now));
            sums[0] += n;
            sums[1] += n * n;
        }
    }
}

impl Visitor for Counter {
    const MODE: Mode = Mode::Radiance;

    fn count(&self, _: &Flight, _: &Place) -> f32 {
        0.0
    }

    fn vertex(&mut self, vertex: &Vertex, _: &Flight, _: &mut Stream) {
        if let Place::Medium(collision) = &vertex.place {
            self.now[collision.medium as usize] += 1;
        }
    }

    fn escaped(&mut self, _: &Flight, _: &Arrival) {}

    fn extend(&self, trail: u32, _: Label) -> u32 {
        trail
    }
}
