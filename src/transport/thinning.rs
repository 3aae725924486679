//! Connections in media that scatter light many times: only a share of them is made.
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

use super::expression::Label;
use super::merge::Gathers;
use super::merge::pilot::{PILOT, pixels};
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
/// Longest paths of the pilot, the same whatever lengths a render counts: these change no random number.
const LENGTH: u32 = 256;
/// The pilot's rays lie on a grid of so many a side.
const GRID: u32 = 64;

/// g of each medium; empty where all are 1.
pub fn shares(scene: &Scene, settings: &Settings) -> Vec<f32> {
    let thinned = settings.connections == Connections::Thinned && settings.techniques.has(Technique::Connect);
    if !thinned || !scene.traits.scattering {
        return Vec::new();
    }
    let alone = Settings { techniques: TechniqueSet::of(&[Technique::Hit]), ..*settings };
    let pass = Pass::new(alone, PILOT, Gathers::default(), 0, Vec::new());
    let mut counter = Counter { now: vec![0; scene.media.len()], sums: vec![[0.0; 2]; scene.media.len()] };
    for (i, pixel) in pixels(scene, GRID).enumerate() {
        // The seed is no part of it: independent runs shall have the same techniques.
        let mut random = Stream::new(0, PILOT, StreamKind::Other, i as u64);
        let ray = scene.camera.sample_ray(pixel, random.next_2d(), random.next_2d());
        let flight = Flight::from_lens(scene, &pass, Ray::new(ray.origin, ray.dir), ray.pdf);
        walk::<false, _>(scene, &pass, LENGTH, flight, &mut random, &mut counter);
        counter.end_path();
    }
    let shares: Vec<f32> = counter
        .sums
        .iter()
        .map(
            |[sum, squares]| if *squares > BUNCH * sum { (BUNCH * sum / squares).sqrt() as f32 } else { 1.0 },
        )
        .collect();
    if shares.iter().all(|g| *g == 1.0) { Vec::new() } else { shares }
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
