//! Radii and counts that the settings leave open, chosen from the scene.
//!
//! A merge costs about as much as a connection and is worth no more than one, and beyond the first few a camera subpath gains little by
//! more (measured: half or twice as many change variance times time by 10% on most scenes). So what is open is chosen such that a
//! camera subpath has [`MERGES_A_CONNECTION`] times as many merges as connections, shared out evenly among the techniques.
//! How many there would be a [`Pilot`] counts, and the numbers for other radii follow from
//!
//! ```text
//! merges(N, r) = merges(N_p, r_p) · N / N_p · (r / r_p)^d
//! ```
//!
//! with d the dimension of the kernel. Where there would be too many, first the radius is made smaller, as that costs
//! variance no more than fewer paths do (N · measure is the same) and makes the blur less, but not below
//! [`LEAST_FOOTPRINTS`] pixels; then the number of light subpaths. The widest radii are a few footprints of a pixel at what
//! it sees first, and in media a part of the mean free path, over which the light changes. The relative bias of
//! a kernel of the radius r is of the order of r² times the light's relative curvature over the kernel: by that estimate some
//! 1% where the light changes over ten radii. It has not been measured for the radii that are chosen.
//!
//! `nearest = k` is a radius of the whole pass, not of a vertex: the weight of a path holds M_i of all its vertices, and
//! a radius that depended on the photons about x_i would not be known from x_{i-1}, x_i, x_{i+1} alone, and would be
//! correlated with what is merged. So r is the radius with which k photons are within it on average, over the
//! camera subpaths' vertices:
//!
//! ```text
//! r = r_p · (k · N_p / (N · merges a vertex))^(1/d)
//! ```

use super::gather::Gathers;
use super::pilot::{self, PILOT, Pilot};
use super::settings::{MERGES, PathCount, Radius, place_of};
use crate::geometry::Ray;
use crate::math::{Stream, StreamKind};
use crate::scene::{End, Scene};
use crate::transport::settings::Settings;
use crate::transport::technique::Technique;
use crate::transport::thinning::Thinning;
use glam::Vec2;

/// Merges of all techniques together that are aimed at, for each connection.
const MERGES_A_CONNECTION: f64 = 0.25;
/// … and at least so many a camera subpath.
const LEAST_MERGES: f64 = 3.0;
/// No radius in a medium is above so many mean free paths.
const MEAN_FREE_PATHS: f32 = 0.25;
/// No radius that is chosen is below so many footprints, unless a mean free path is.
const LEAST_FOOTPRINTS: f32 = 0.5;
/// As many light subpaths as are merged with at least.
const LEAST_PATHS: u64 = 64;

/// What was chosen.
#[derive(Clone, Copy, Debug, Default)]
pub struct Chosen {
    /// Radii and counts of the first iteration.
    pub gathers: Gathers,
    /// Light subpaths that were asked for and are not merged with, as there would be more photons or beams than are
    /// allowed; in the order of [`MERGES`].
    pub left_out: [u64; MERGES.len()],
}

/// What the settings leave open, chosen.
pub fn resolve(scene: &Scene, settings: &Settings) -> Chosen {
    resolve_with(scene, settings, &mut Thinning::of(scene, settings))
}

/// The same where it is known already what is thinned out, but for what is left to a pilot.
pub fn resolve_with(scene: &Scene, settings: &Settings, thinning: &mut Thinning) -> Chosen {
    let mut chosen = Chosen::default();
    if !settings.techniques.merges() {
        return chosen;
    }
    let pixels = u64::from(scene.camera.size().element_product());
    let (_, scene_radius) = scene.geometry.bounding_sphere();
    let footprint = footprint(scene).unwrap_or(1e-3 * scene_radius.max(1e-6));
    for (gather, technique) in chosen.gathers.of.iter_mut().zip(MERGES) {
        let asked = settings.merging.of(technique);
        gather.radius = match asked.radius {
            Radius::Absolute(r) => r,
            Radius::Scene(share) => share * scene_radius,
            Radius::Footprint(n) => n * footprint,
            Radius::Nearest(_) | Radius::Auto => widest(scene, technique, footprint),
        };
        gather.paths = match asked.paths {
            PathCount::Absolute(n) => n,
            PathCount::PerPixel(n) => ((pixels as f64 * f64::from(n)).round() as u64).max(1),
            PathCount::Auto => pixels,
        };
    }
    if Thinning::is_open(scene, settings) {
        let pilot = Pilot::run(scene, settings, thinning, &chosen.gathers);
        thinning.go_on(&pilot.depths);
    }
    if needs_pilot(settings) {
        let pilot = Pilot::run(scene, settings, thinning, &chosen.gathers);
        choose(settings, &pilot, footprint, &mut chosen.gathers);
        bound(settings, &pilot, &mut chosen);
    }
    chosen
}

fn needs_pilot(settings: &Settings) -> bool {
    let merging = &settings.merging;
    let open = |t: Technique| {
        let gather = merging.of(t);
        matches!(gather.radius, Radius::Auto | Radius::Nearest(_)) || gather.paths == PathCount::Auto
    };
    let bounded = merging.most_photons.is_some() || merging.most_beams.is_some();
    bounded || MERGES.into_iter().any(|t| settings.techniques.has(t) && open(t))
}

/// The widest radius that is chosen.
fn widest(scene: &Scene, technique: Technique, footprint: f32) -> f32 {
    let footprints = match technique {
        Technique::PointPoint => 4.0,
        Technique::BeamBeam => 1.5,
        _ => 2.5,
    };
    let radius = footprints * footprint;
    if technique == Technique::Surface {
        return radius;
    }
    // The densest medium that scatters, by its brightest channel's mean free path, where most of it is.
    let shortest = scene
        .media
        .iter()
        .filter(|m| m.scatters())
        .map(|m| m.typical_extinction().min_element().recip())
        .fold(f32::INFINITY, f32::min);
    radius.min((MEAN_FREE_PATHS * shortest).max(LEAST_FOOTPRINTS * footprint))
}

/// Median footprint of a pixel at what it sees first: distance times the square root of its solid angle. `None` where it
/// sees nothing.
fn footprint(scene: &Scene) -> Option<f32> {
    let camera = &scene.camera;
    let pixels = camera.size().as_vec2().element_product();
    let mut footprints = Vec::new();
    for (i, pixel) in pilot::pixels(scene, pilot::GRID).enumerate() {
        let mut random = Stream::new(0, PILOT, StreamKind::Other, i as u64);
        let ray = camera.sample_ray(pixel, Vec2::splat(0.5), random.next_2d());
        let arrival = scene.fly(
            &Ray::new(ray.origin + ray.dir * camera.skipped(ray.dir), ray.dir),
            scene.camera_inside,
            &mut random,
        );
        if !matches!(arrival.end, End::Open) {
            footprints.push(arrival.distance / (ray.pdf * pixels).sqrt());
        }
    }
    footprints.sort_by(f32::total_cmp);
    footprints.get(footprints.len() / 2).copied()
}

/// Dimension of a technique's kernel.
fn dimension(technique: Technique) -> f64 {
    match technique {
        Technique::PointPoint => 3.0,
        Technique::BeamBeam => 1.0,
        _ => 2.0,
    }
}

/// Radii and counts that are open, by what the pilot counted.
fn choose(settings: &Settings, pilot: &Pilot, footprint: f32, gathers: &mut Gathers) {
    let on: Vec<Technique> = MERGES.into_iter().filter(|t| settings.techniques.has(*t)).collect();
    let all = (MERGES_A_CONNECTION * pilot.connections).max(LEAST_MERGES);
    let wanted = all / on.len() as f64;
    for technique in on {
        let i = place_of(technique).expect("a merge");
        let (asked, d) = (settings.merging.of(technique), dimension(technique));
        let (gather, before) = (&mut gathers.of[i], &pilot.gathers.of[i]);
        let more_paths = gather.paths as f64 / before.paths as f64;
        // How many there are a vertex or a subpath, with the radius as it is now.
        let expect =
            |merges: f64, radius: f32| merges * more_paths * f64::from(radius / before.radius).powf(d);
        let rescale = |radius: f32, by: f64| (f64::from(radius) * by.powf(1.0 / d)) as f32;
        if let Radius::Nearest(k) = asked.radius {
            let now = expect(pilot.merges_a_vertex[i], gather.radius);
            if now > 0.0 {
                gather.radius = rescale(gather.radius, f64::from(k) / now);
            }
        }
        let too_many = expect(pilot.merges[i], gather.radius) / wanted;
        if asked.radius == Radius::Auto && too_many > 1.0 {
            let least = (LEAST_FOOTPRINTS * footprint).min(gather.radius);
            gather.radius = rescale(gather.radius, 1.0 / too_many).max(least);
        }
        let too_many = expect(pilot.merges[i], gather.radius) / wanted;
        if asked.paths == PathCount::Auto && too_many > 1.0 {
            gather.paths = ((gather.paths as f64 / too_many) as u64).max(LEAST_PATHS.min(gather.paths));
        }
    }
}

/// No more light subpaths than bring as many photons and beams as are allowed. Weights and estimators take the
/// number that is merged with, so that what is not stored is not counted.
fn bound(settings: &Settings, pilot: &Pilot, chosen: &mut Chosen) {
    for technique in MERGES.into_iter().filter(|t| settings.techniques.has(*t)) {
        let i = place_of(technique).expect("a merge");
        let (most, a_path) = match technique {
            Technique::BeamPoint | Technique::BeamBeam => (settings.merging.most_beams, pilot.beams),
            _ => (settings.merging.most_photons, pilot.photons),
        };
        let Some(most) = most else { continue };
        let gather = &mut chosen.gathers.of[i];
        let paths = ((most as f64 / a_path.max(1e-9)) as u64).clamp(1, gather.paths);
        chosen.left_out[i] = gather.paths - paths;
        gather.paths = paths;
    }
}
