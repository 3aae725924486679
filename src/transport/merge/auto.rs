//! Radii and counts that the settings leave open, chosen from the scene.
//!
//! Radii: a few footprints of a pixel at what it sees first, so that the blur is below what the image shows; in media no
//! more than a part of the mean free path, over which the light changes. Counts: with every vertex on a surface and in a
//! ball all light subpaths, as such queries are cheap; with beams as many as give a camera subpath a fixed number
//! of merges, which a pilot counts: a merge costs about as much as a connection, and where there are many, further ones
//! add less than a new sample does.

use super::gather::{GatherNow, Gathers};
use super::photons::{Photons, Stored};
use super::settings::{MERGES, PathCount, Radius};
use crate::film::Sample;
use crate::geometry::Ray;
use crate::math::{Stream, StreamKind};
use crate::scene::{End, Scene};
use crate::transport::camera_path::{self, Partners};
use crate::transport::light_path;
use crate::transport::pass::Pass;
use crate::transport::settings::Settings;
use crate::transport::sink::{Joint, Sink};
use crate::transport::technique::{Technique, TechniqueSet};
use glam::{UVec2, Vec2};

/// The pilot's rays lie on a grid of so many a side.
const GRID: u32 = 32;
/// Light subpaths of the pilot.
const PILOT_PATHS: u64 = 4096;
/// The pilot's random numbers are those of an iteration that no render comes to.
const PILOT: u64 = u64::MAX;
/// Merges of a camera subpath that counts are chosen for, a technique with beams.
const MERGES_A_PATH: f64 = 3.0;
/// No radius in a medium is above so many mean free paths.
const MEAN_FREE_PATHS: f32 = 0.25;

/// Radii and counts of the first iteration.
pub fn resolve(scene: &Scene, settings: &Settings) -> Gathers {
    let mut gathers = Gathers::default();
    if !settings.techniques.merges() {
        return gathers;
    }
    let size = scene.camera.size();
    let pixels = u64::from(size.x) * u64::from(size.y);
    let (_, scene_radius) = scene.geometry.bounding_sphere();
    let footprint = footprint(scene, settings).unwrap_or(1e-3 * scene_radius.max(1e-6));
    for (gather, technique) in gathers.of.iter_mut().zip(MERGES) {
        let asked = settings.merging.of(technique);
        gather.radius = match asked.radius {
            Radius::Absolute(r) => r,
            Radius::Scene(share) => share * scene_radius,
            Radius::Footprint(n) => n * footprint,
            Radius::Auto => auto_radius(scene, technique, footprint),
        };
        gather.paths = match asked.paths {
            PathCount::Absolute(n) => n,
            PathCount::PerPixel(n) => ((pixels as f64 * f64::from(n)).round() as u64).max(1),
            PathCount::Auto => pixels,
        };
    }
    choose_counts(scene, settings, pixels, &mut gathers);
    gathers
}

fn auto_radius(scene: &Scene, technique: Technique, footprint: f32) -> f32 {
    let footprints = match technique {
        Technique::PointPoint => 4.0,
        Technique::BeamBeam => 1.5,
        _ => 2.5,
    };
    let radius = footprints * footprint;
    if technique == Technique::Surface {
        return radius;
    }
    // The densest medium that scatters, by its brightest channel's mean free path.
    let shortest = scene
        .media
        .iter()
        .filter(|m| m.scatters())
        .map(|m| m.summary().mean_free_path.max_element())
        .fold(f32::INFINITY, f32::min);
    radius.min((MEAN_FREE_PATHS * shortest).max(0.5 * footprint))
}

/// Median footprint of a pixel at what it sees first: distance times the square root of its solid angle. `None` where it
/// sees nothing.
fn footprint(scene: &Scene, settings: &Settings) -> Option<f32> {
    let camera = &scene.camera;
    let pixels = camera.size().as_vec2().element_product();
    let mut footprints = Vec::new();
    for (i, pixel) in pilot_pixels(scene).enumerate() {
        let mut random = Stream::new(settings.seed, PILOT, StreamKind::Other, i as u64);
        let ray = camera.sample_ray(pixel, Vec2::splat(0.5), random.next_2d());
        let arrival = scene.fly(&Ray::new(ray.origin, ray.dir), scene.camera_inside, &mut random);
        if !matches!(arrival.end, End::Open) {
            footprints.push(arrival.distance / (ray.pdf * pixels).sqrt());
        }
    }
    footprints.sort_by(f32::total_cmp);
    footprints.get(footprints.len() / 2).copied()
}

/// Pixels spread over the frame.
fn pilot_pixels(scene: &Scene) -> impl Iterator<Item = UVec2> {
    let size = scene.camera.size();
    let side = UVec2::splat(GRID).min(size);
    (0..side.x * side.y).map(move |i| {
        let cell = UVec2::new(i % side.x, i / side.x);
        ((2 * cell + UVec2::ONE) * size) / (2 * side)
    })
}

/// Counts merges.
#[derive(Default)]
struct Counter {
    merges: [u64; MERGES.len()],
}

impl Sink for Counter {
    fn record(&mut self, sample: &Sample, _joint: &Joint) {
        if let Some(i) = MERGES.iter().position(|t| *t == sample.technique) {
            self.merges[i] += 1;
        }
    }
}

/// For each technique with beams whose count is open: as many light subpaths as bring [`MERGES_A_PATH`].
fn choose_counts(scene: &Scene, settings: &Settings, pixels: u64, gathers: &mut Gathers) {
    let open = |t: Technique| {
        settings.techniques.has(t)
            && settings.merging.of(t).paths == PathCount::Auto
            && !matches!(t, Technique::Surface | Technique::PointPoint)
    };
    let techniques: Vec<Technique> = MERGES.into_iter().filter(|t| open(*t)).collect();
    if techniques.is_empty() {
        return;
    }
    let paths = PILOT_PATHS.min(pixels);
    let pilot_gathers = Gathers { of: gathers.of.map(|g| GatherNow { paths, ..g }) };
    // The merges of these techniques alone; lengths, paths and beams as in the render.
    let alone = Settings { techniques: TechniqueSet::of(&techniques), ..*settings };
    let pass = Pass::new(alone, PILOT, pilot_gathers, 0, Vec::new());
    let mut counter = Counter::default();
    let mut stored = Stored::default();
    let mut chunks = Vec::new();
    for path in 0..paths {
        light_path::trace(scene, &pass, path, &mut stored, &mut counter);
        stored.end_path();
        if (path + 1) % super::photons::CHUNK == 0 {
            chunks.push(std::mem::take(&mut stored));
        }
    }
    chunks.push(stored);
    let photons = Photons::build(scene, &pass, &chunks);
    let mut camera_paths = 0u64;
    for pixel in pilot_pixels(scene) {
        let partners = Partners { vertices: &[], photons: Some(&photons) };
        camera_path::trace(scene, &pass, pixel, partners, &mut counter);
        camera_paths += 1;
    }
    for technique in techniques {
        let i = super::settings::place_of(technique).expect("a merge");
        let merges = counter.merges[i] as f64 / camera_paths as f64;
        let wanted = paths as f64 * MERGES_A_PATH / merges.max(1e-9);
        gathers.of[i].paths = (wanted as u64).clamp(paths.min(64), pixels);
    }
}
