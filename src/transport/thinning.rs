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
//! takes most of the time, and in fog adds little; but where few light subpaths get to what is seen, as to the dark side of a
//! cloud or the foot of a candle, the two subpaths have to share the way. So it goes on from a collision with a probability q
//! at most, which is chosen for each medium with the radii and counts of merges: see [`super::merge::auto`].
//!
//! A light that is seen directly can be hit by the camera's ray, or connected with the lens. In clear air the ray finds it in each
//! pixel and each iteration, and what light subpaths add is only noise: the balance heuristic takes as many samples for as good, but theirs fall on pixels at
//! random. In fog most rays do not get there, and the connections do. Where something merges, that is chosen too.

use super::expression::Label;
use super::merge::pilot::{PILOT, pixels};
use super::merge::settings::Continuation;
use super::merge::{Gathers, MERGES};
use super::pass::Pass;
use super::settings::{Connections, Settings};
use super::technique::{Technique, TechniqueSet};
use super::walk::{Flight, Place, Vertex, Visitor, walk};
use crate::bsdf::Mode;
use crate::math::{Stream, StreamKind};
use crate::medium::Passage;
use crate::scene::Scene;

/// b: so many collisions of a subpath in a medium may be connected on average before they are thinned out.
const BUNCH: f64 = 2.0;
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
    /// Whether lights as they are seen directly are left to camera subpaths that hit them, and not connected with the lens.
    pub only_hit: bool,
}

impl Thinning {
    /// As the settings say. How far camera subpaths go on is open where they do not.
    pub fn of(scene: &Scene, settings: &Settings) -> Self {
        let hits = settings.techniques.has(Technique::Hit);
        let only_hit = hits && settings.merging.direct == Some(false);
        if !scene.traits.scattering {
            return Self { only_hit, ..Self::default() };
        }
        let thins =
            settings.connections == Connections::Thinned && settings.techniques.has(Technique::Connect);
        let asked = settings.merging.camera_continuation.of(scene.media.len()).filter(|_| stops(settings));
        Self {
            shares: if thins { known(shares(scene, settings)) } else { Vec::new() },
            continuations: asked.map_or_else(Vec::new, known),
            only_hit,
        }
    }

    /// Whether how far camera subpaths go on is to be chosen.
    pub fn is_open(scene: &Scene, settings: &Settings) -> bool {
        scene.traits.scattering
            && stops(settings)
            && settings.merging.camera_continuation == Continuation::Auto
    }

    /// Whether it is to be chosen if lights as they are seen directly are connected with the lens.
    pub fn is_direct_open(settings: &Settings) -> bool {
        let on = |t| settings.techniques.has(t);
        settings.merging.direct.is_none()
            && on(Technique::Hit)
            && on(Technique::Lens)
            && settings.techniques.merges()
    }

    /// Whether lights are connected with the lens, where that technique is on.
    #[inline]
    pub fn direct(&self) -> bool {
        !self.only_hit
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

/// Whether camera subpaths may end earlier than by the albedo.
fn stops(settings: &Settings) -> bool {
    let merges = MERGES.into_iter().any(|t| t != Technique::Surface && settings.techniques.has(t));
    merges && !settings.merging.first
}

/// g of each medium.
fn shares(scene: &Scene, settings: &Settings) -> Vec<f32> {
    let alone = Settings { techniques: TechniqueSet::of(&[Technique::Hit]), ..settings.with_tracking() };
    let starts = scene.lights.by_power().clone();
    let pass = Pass::new(alone, PILOT, Gathers::default(), 0, Thinning::default(), starts);
    let mut counter = Counter { now: vec![0; scene.media.len()], sums: vec![[0.0; 2]; scene.media.len()] };
    for (i, pixel) in pixels(scene, GRID).enumerate() {
        // The seed is no part of it: independent runs shall have the same techniques.
        let mut random = Stream::new(0, PILOT, StreamKind::Other, i as u64);
        let ray = scene.camera.sample_ray(pixel, random.next_2d(), random.next_2d());
        let flight = Flight::from_lens(scene, &pass, &ray);
        walk::<false, _>(scene, &pass, LENGTH, flight, &mut random, &mut counter);
        counter.end_path();
    }
    counter
        .sums
        .iter()
        .map(
            |[sum, squares]| if *squares > BUNCH * sum { (BUNCH * sum / squares).sqrt() as f32 } else { 1.0 },
        )
        .collect()
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
    const ALONE: bool = false;
    const MODE: Mode = Mode::Radiance;

    fn count(&self, _: &Flight, _: &Place) -> f32 {
        0.0
    }

    fn vertex(&mut self, vertex: &Vertex, _: &Flight, _: &mut Stream) {
        if let Place::Medium(collision) = &vertex.place {
            self.now[collision.medium as usize] += 1;
        }
    }

    fn escaped(&mut self, _: &Flight, _: Passage) {}

    fn extend(&self, trail: u32, _: Label) -> u32 {
        trail
    }
}
