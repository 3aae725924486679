//! A pilot: a few light subpaths, merged and connected with a few camera subpaths, and what came of it, counted.

use super::gather::{GatherNow, Gathers};
use super::photons::Photons;
use super::settings::{MERGES, place_of};
use super::store::{CHUNK, Stored};
use crate::film::Sample;
use crate::scene::Scene;
use crate::transport::camera_path::{self, Partners};
use crate::transport::light_path;
use crate::transport::pass::Pass;
use crate::transport::settings::Settings;
use crate::transport::sink::{Joint, Sink};
use crate::transport::technique::Technique;
use crate::transport::thinning::Thinning;
use crate::transport::walk::{Place, Vertex};
use glam::UVec2;

/// The pilot's camera subpaths lie on a grid of so many a side.
pub const GRID: u32 = 32;
/// Light subpaths of the pilot.
const PATHS: u64 = 4096;
/// The pilot's random numbers are those of an iteration that no render comes to.
pub const PILOT: u64 = u64::MAX;

/// What a pilot counted.
#[derive(Clone, Debug)]
pub struct Pilot {
    /// How each technique gathered.
    pub gathers: Gathers,
    /// Merges a camera subpath, by technique.
    pub merges: [f64; MERGES.len()],
    /// Merges a vertex of camera subpaths: on surfaces for SURF, else in media.
    pub merges_a_vertex: [f64; MERGES.len()],
    /// By medium, the collisions there behind which light was found: the mean over what came from the first of them on; 0 where none did.
    pub depths: Vec<f64>,
    /// Connections a camera subpath that were not blocked.
    pub connections: f64,
    /// Photons that are stored a light subpath.
    pub photons: f64,
    /// Beams that are stored a light subpath.
    pub beams: f64,
}

/// Pixels spread over the frame, on a grid of `side` a side, or of all where there are fewer.
pub fn pixels(scene: &Scene, side: u32) -> impl Iterator<Item = UVec2> {
    let size = scene.camera.size();
    let side = UVec2::splat(side).min(size);
    (0..side.x * side.y).map(move |i| {
        let cell = UVec2::new(i % side.x, i / side.x);
        ((2 * cell + UVec2::ONE) * size) / (2 * side)
    })
}

#[derive(Default)]
struct Counter {
    merges: [u64; MERGES.len()],
    connections: u64,
    on_surfaces: u64,
    in_media: u64,
    /// By medium, collisions of the camera subpath so far.
    collisions: Vec<u32>,
    /// By medium, Σ C and Σ C n over contributions C behind n > 0 of its collisions.
    behind: Vec<[f64; 2]>,
}

impl Sink for Counter {
    fn record(&mut self, sample: &Sample, _joint: &Joint) {
        let contribution = f64::from(sample.contribution.element_sum() * sample.weight);
        let behind = self.collisions.iter().zip(&mut self.behind);
        for (n, [sum, weighted]) in behind.filter(|(n, _)| **n > 0 && contribution.is_finite()) {
            *sum += contribution;
            *weighted += contribution * f64::from(*n);
        }
        match place_of(sample.technique) {
            Some(i) => self.merges[i] += 1,
            None => self.connections += u64::from(sample.technique != Technique::Hit),
        }
    }

    fn vertex(&mut self, vertex: &Vertex) {
        match vertex.place {
            Place::Surface(_) => self.on_surfaces += 1,
            Place::Medium(collision) => {
                self.in_media += 1;
                if let Some(n) = self.collisions.get_mut(collision.medium as usize) {
                    *n += 1;
                }
            }
        }
    }
}

impl Pilot {
    /// Runs it where each technique gathers with the radii of `gathers` and media are thinned out as `thinning` says.
    pub fn run(scene: &Scene, settings: &Settings, thinning: &Thinning, gathers: &Gathers) -> Self {
        let size = scene.camera.size();
        let paths = PATHS.min(u64::from(size.x) * u64::from(size.y));
        let gathers = Gathers { of: gathers.of.map(|g| GatherNow { paths, ..g }) };
        // The seed is no part of it: independent runs shall have the same radii and counts.
        let pass = Pass::new(Settings { seed: 0, ..*settings }, PILOT, gathers, paths, thinning.clone());
        let (chunks, light) = walk_light(scene, &pass, paths);
        let photons = Photons::build(scene, &pass, &chunks);
        let connects = pass.on(Technique::Connect);
        let media = scene.media.len();
        let mut counter =
            Counter { collisions: vec![0; media], behind: vec![[0.0; 2]; media], ..Counter::default() };
        let mut camera_paths = 0u64;
        for (i, pixel) in pixels(scene, GRID).enumerate() {
            let partner = i % paths as usize;
            let chunk = &chunks[partner / CHUNK as usize];
            let vertices = if connects { chunk.path(partner % CHUNK as usize) } else { &[] };
            let partners = Partners { vertices, photons: Some(&photons) };
            camera_path::trace(scene, &pass, pixel, partners, &mut counter);
            camera_paths += 1;
            counter.collisions.fill(0);
        }
        let a_camera_path = |n: u64| n as f64 / camera_paths as f64;
        let a_light_path = |n: usize| n as f64 / paths as f64;
        let merges = counter.merges.map(a_camera_path);
        Self {
            gathers,
            merges,
            merges_a_vertex: std::array::from_fn(|i| {
                let on_surface = MERGES[i] == Technique::Surface;
                let vertices = if on_surface { counter.on_surfaces } else { counter.in_media };
                counter.merges[i] as f64 / vertices.max(1) as f64
            }),
            depths: counter.behind.iter().map(|[c, cn]| if *c > 0.0 { cn / c } else { 0.0 }).collect(),
            connections: a_camera_path(counter.connections) + light.connections as f64 / paths as f64,
            photons: a_light_path(chunks.iter().map(|c| c.photons.len()).sum()),
            beams: a_light_path(chunks.iter().map(|c| c.beams.len()).sum()),
        }
    }
}

/// The light subpaths, and what they made by themselves.
fn walk_light(scene: &Scene, pass: &Pass, paths: u64) -> (Vec<Stored>, Counter) {
    let (mut chunks, mut stored, mut counter) = (Vec::new(), Stored::default(), Counter::default());
    for path in 0..paths {
        light_path::trace(scene, pass, path, &mut stored, &mut counter);
        stored.end_path();
        if (path + 1) % CHUNK == 0 {
            chunks.push(std::mem::take(&mut stored));
        }
    }
    chunks.push(stored);
    (chunks, counter)
}
