//! Radii and counts that the settings leave open, chosen from the scene, and with them how far camera subpaths go on.
//!
//! What is chosen is how many merges a camera subpath has of each technique. [`choice`](super::choice) looks for the numbers that give
//! the least error for what they cost, from an even start: [`MERGES_A_CONNECTION`] times as many merges as connections,
//! shared out evenly among the techniques (which is what is taken where `efficient` is off). Of a set with three or more techniques that merge
//! in media, as `upbp` is, those of them are left out that are not worth what they cost. What they come to in radii and counts follows from
//!
//! ```text
//! merges(N, r) = merges(N_p, r_p) · N / N_p · (r / r_p)^d
//! ```
//!
//! with d the dimension of the kernel and the numbers that a [`Pilot`] has seen. Where there are to be fewer than these, first the radius is made
//! smaller, as that costs variance no more than fewer paths do (N · measure is the same) and makes the blur less, but not below
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

use super::choice::{self, Open};
use super::cost::Work;
use super::evidence::{Counts, Evidence};
use super::gather::{Gathers, dimension};
use super::pilot::{self, PILOT, Pilot};
use super::settings::{MERGES, PathCount, Radius, place_of};
use super::starts;
use crate::geometry::Ray;
use crate::math::{Discrete, Stream, StreamKind};
use crate::scene::Scene;
use crate::transport::settings::Settings;
use crate::transport::technique::{Technique, TechniqueSet};
use crate::transport::thinning::Thinning;
use glam::Vec2;
use std::sync::Arc;

/// Merges of all techniques together that it starts from, for each connection.
const MERGES_A_CONNECTION: f64 = 0.25;
/// … and at least so many a camera subpath.
const LEAST_MERGES: f64 = 3.0;
/// The probability with which camera subpaths go on from a collision at most, where it starts.
const GOES_ON: f32 = 0.9;
/// With so many techniques that merge in media, one can be left out.
const UNIFIED: usize = 3;
/// No radius in a medium is above so many mean free paths.
const MEAN_FREE_PATHS: f32 = 0.25;
/// No radius that is chosen is below so many footprints, unless a mean free path is.
const LEAST_FOOTPRINTS: f32 = 0.5;
/// Pilots that are asked: what a single one happens to see would decide too much.
const PILOTS: u64 = 2;
/// As many light subpaths as are merged with at least.
const LEAST_PATHS: u64 = 64;

/// What was chosen.
#[derive(Clone, Debug, Default)]
pub struct Chosen {
    /// Radii and counts of the first iteration.
    pub gathers: Gathers,
    /// Light subpaths that were asked for and are not merged with, as there would be more photons or beams than are
    /// allowed; in the order of [`MERGES`].
    pub no_room: [u64; MERGES.len()],
    /// Techniques that were asked for and are not worth what they cost.
    pub left_out: TechniqueSet,
    /// What is thinned out in each medium.
    pub thinning: Thinning,
    /// The share of the light subpaths that starts on each light; `None` where it goes by power.
    pub starts: Option<Arc<Discrete>>,
}

impl Chosen {
    /// What light subpaths start by.
    pub fn starts<'a>(&'a self, scene: &'a Scene) -> &'a Arc<Discrete> {
        self.starts.as_ref().unwrap_or(scene.lights.by_power())
    }
}

/// What the settings leave open, chosen.
pub fn resolve(scene: &Scene, settings: &Settings) -> Chosen {
    let thinning = Thinning::of(scene, settings);
    let mut chosen = Chosen { thinning, left_out: settings.left_out, ..Chosen::default() };
    chosen.starts = starts::asked(scene, settings);
    let open_starts = starts::is_open(scene, settings);
    if !settings.active().merges() && !open_starts {
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
    let active = Settings { techniques: settings.active(), ..settings.with_tracking() };
    let pilots = |starts: &Arc<Discrete>, first: u64, chosen: &Chosen| -> Vec<Pilot> {
        let run = |n| Pilot::run(scene, &active, &chosen.thinning, starts, &chosen.gathers, n);
        (first..first + PILOTS).map(run).collect()
    };
    if open_starts {
        let even = starts::even(&scene.lights);
        let pilots = pilots(&even, PILOTS, &chosen);
        let counts = open(scene, &active, &pilots[0], &chosen).counts;
        chosen.starts = starts::choose(scene, &pilots, &counts, &even);
    }
    if !active.techniques.merges() {
        chosen.gathers = Gathers::default();
        return chosen;
    }
    if needs_pilot(scene, settings) {
        let pilots = pilots(chosen.starts(scene), 0, &chosen);
        choose(scene, &active, &pilots, footprint, &mut chosen);
        bound(&active, &pilots[0], &mut chosen);
    }
    chosen
}

fn needs_pilot(scene: &Scene, settings: &Settings) -> bool {
    let merging = &settings.merging;
    let open = |t: Technique| {
        let gather = merging.of(t);
        matches!(gather.radius, Radius::Auto | Radius::Nearest(_)) || gather.paths == PathCount::Auto
    };
    let bounded = merging.most_photons.is_some() || merging.most_beams.is_some();
    bounded
        || Thinning::is_open(scene, settings)
        || Thinning::is_direct_open(settings)
        || MERGES.into_iter().any(|t| settings.active().has(t) && open(t))
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
            false,
            &mut random,
        );
        if arrival.place.is_some() {
            footprints.push(arrival.distance / (ray.pdf * pixels).sqrt());
        }
    }
    footprints.sort_by(f32::total_cmp);
    footprints.get(footprints.len() / 2).copied()
}

/// What is open, and where its choice starts.
fn open(scene: &Scene, settings: &Settings, pilot: &Pilot, chosen: &Chosen) -> Open {
    let goes_on = Thinning::is_open(scene, settings);
    let continuations = match &chosen.thinning.continuations {
        _ if goes_on => vec![GOES_ON; scene.media.len()],
        asked => asked.clone(),
    };
    let mut open = Open {
        counts: Counts { merges: [0.0; MERGES.len()], continuations, direct: chosen.thinning.direct() },
        most: [1.0; MERGES.len()],
        merges: [false; MERGES.len()],
        may_leave: [false; MERGES.len()],
        continuations: goes_on,
        direct: Thinning::is_direct_open(settings),
    };
    start(settings, pilot, &mut open);
    open
}

/// What is open, by what the pilot saw.
fn choose(scene: &Scene, settings: &Settings, pilots: &[Pilot], footprint: f32, chosen: &mut Chosen) {
    let open = open(scene, settings, &pilots[0], chosen);
    let efficient = settings.merging.efficient && !settings.merging.first;
    let evidence =
        if efficient { Evidence::of_all(scene, pilots, &open.counts) } else { Evidence::default() };
    let found = if evidence.is_empty() {
        open.counts.clone()
    } else {
        choice::choose(scene, pilots, &evidence, &open)
    };
    for (i, technique) in MERGES.into_iter().enumerate().filter(|(_, t)| settings.techniques.has(*t)) {
        if found.merges[i] == 0.0 {
            chosen.left_out = chosen.left_out.with(technique);
        }
        let (asked, gather) = (settings.merging.of(technique), &mut chosen.gathers.of[i]);
        // Merges are to be so many times those with the radius and the paths as they are.
        let mut times = if found.merges[i] > 0.0 { found.merges[i] } else { open.most[i] };
        if let Radius::Auto | Radius::Nearest(_) = asked.radius {
            let by = if asked.radius == Radius::Auto { times } else { open.most[i] };
            let rescaled = f64::from(gather.radius) * by.powf(1.0 / dimension(technique));
            let least = match asked.radius {
                Radius::Auto => (LEAST_FOOTPRINTS * footprint).min(gather.radius),
                _ => 0.0,
            };
            let radius = (rescaled as f32).max(least);
            times /= f64::from(radius / gather.radius).powf(dimension(technique));
            gather.radius = radius;
        }
        if asked.paths == PathCount::Auto && times < 1.0 {
            gather.paths = ((gather.paths as f64 * times) as u64).max(LEAST_PATHS.min(gather.paths));
        }
    }
    if open.continuations {
        chosen.thinning.continuations = found.continuations;
    }
    chosen.thinning.only_hit = !found.direct;
}

/// Where the choice starts: what is asked, else as many merges of each technique.
fn start(settings: &Settings, pilot: &Pilot, open: &mut Open) {
    let work = Work::of(pilot, &open.counts);
    let on: Vec<Technique> = MERGES.into_iter().filter(|t| settings.techniques.has(*t)).collect();
    // A smaller set is named for what is in it, as to compare its techniques.
    let in_media = on.iter().filter(|t| **t != Technique::Surface).count();
    let unified = in_media >= UNIFIED;
    let connections = work.connections + pilot.a_light_path(|of| of.lens);
    let wanted = (MERGES_A_CONNECTION * connections).max(LEAST_MERGES) / on.len() as f64;
    for technique in on {
        let i = place_of(technique).expect("a merge");
        let (asked, merges) = (settings.merging.of(technique), work.merges[i]);
        let vertices = if technique == Technique::Surface { work.on_surfaces } else { work.in_media };
        open.most[i] = match asked.radius {
            Radius::Nearest(k) if merges > 0.0 => f64::from(k) * vertices / merges,
            _ => 1.0,
        };
        open.merges[i] = asked.radius == Radius::Auto || asked.paths == PathCount::Auto;
        // Caustics may be smaller than what a pilot sees.
        let robust = unified && technique != Technique::Surface;
        open.may_leave[i] = robust && asked.radius == Radius::Auto && asked.paths == PathCount::Auto;
        let even = if open.merges[i] && merges > 0.0 { wanted / merges } else { f64::INFINITY };
        open.counts.merges[i] = even.min(open.most[i]);
    }
}

/// No more light subpaths than bring as many photons and beams as are allowed. Weights and estimators take the
/// number that is merged with, so that what is not stored is not counted.
fn bound(settings: &Settings, pilot: &Pilot, chosen: &mut Chosen) {
    for technique in MERGES.into_iter().filter(|t| settings.techniques.has(*t)) {
        let i = place_of(technique).expect("a merge");
        let (most, a_path) = match technique {
            Technique::BeamPoint | Technique::BeamBeam => {
                (settings.merging.most_beams, pilot.a_light_path(|of| of.beams))
            }
            _ => (settings.merging.most_photons, pilot.a_light_path(|of| of.photons)),
        };
        let Some(most) = most else { continue };
        let gather = &mut chosen.gathers.of[i];
        let paths = ((most as f64 / a_path.max(1e-9)) as u64).clamp(1, gather.paths);
        chosen.no_room[i] = gather.paths - paths;
        gather.paths = paths;
    }
}
