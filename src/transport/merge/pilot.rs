//! A pilot: some light subpaths, merged and connected with some camera subpaths that go on by the albedo, and what came of it,
//! counted.

use super::gather::Gathers;
use super::photons::Photons;
use super::settings::{MERGES, place_of};
use super::store::{CHUNK, Stored};
use crate::film::Sample;
use crate::math::Discrete;
use crate::scene::Scene;
use crate::transport::camera_path::{self, Partners};
use crate::transport::light_path;
use crate::transport::pass::Pass;
use crate::transport::settings::Settings;
use crate::transport::sink::{Joint, Sink, Start};
use crate::transport::technique::Technique;
use crate::transport::thinning::Thinning;
use crate::transport::walk::{Place, Vertex};
use glam::{UVec2, Vec3A};
use rayon::prelude::*;
use std::sync::Arc;

/// Rays that look for footprints lie on a grid of so many a side.
pub const GRID: u32 = 32;
/// The pilot's camera subpaths lie on a grid of so many a side.
const SIDE: u32 = 48;
/// Light subpaths of the pilot.
const PATHS: u64 = 8192;
/// … or as few, where more would make more samples a camera subpath than [`MOST_SEEN`].
const LEAST_PATHS: u64 = 64;
/// Samples a camera subpath at most, on average.
const MOST_SEEN: f64 = 800.0;
/// That is found out from one camera subpath of so many.
const FEW: usize = 23;
/// The pilot's random numbers are those of an iteration that no render comes to.
pub const PILOT: u64 = u64::MAX;
/// Stands for no medium.
pub const NO_MEDIUM: u32 = u32::MAX;

/// What a camera subpath did at its start or at one of its vertices, and along the edge that it left it by.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The medium of a collision; [`NO_MEDIUM`] on a surface and on the lens.
    pub medium: u32,
    /// Whether it is a vertex on a surface.
    pub on_surface: bool,
    /// The probability with which the pilot went on from a collision; 1 elsewhere.
    pub goes_on: f32,
    /// Merges here, and along the edge from here where the technique has a camera beam; in the order of [`MERGES`].
    pub merges: [u32; MERGES.len()],
    /// Connections here that were not blocked.
    pub connections: u32,
    /// Connections that are tried here on average, next-event estimation among them.
    pub tried: f32,
    /// 1 where next-event estimation is tried.
    pub next_event: f32,
    /// Cells of a grid along the edge to a collision.
    pub cells: f32,
}

impl Step {
    const LENS: Self = Self {
        medium: NO_MEDIUM,
        on_surface: false,
        goes_on: 1.0,
        merges: [0; MERGES.len()],
        connections: 0,
        tried: 0.0,
        next_event: 0.0,
        cells: 0.0,
    };
}

/// The subpath that made a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Maker {
    /// The camera subpath of this pixel.
    Camera(UVec2),
    /// The light subpath with this number, by way of the lens.
    Light(u64),
}

/// A sample that the pilot made.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The subpath that recorded it.
    pub maker: Maker,
    /// Its number among those of the subpath.
    pub ordinal: u32,
    /// The pixel that it adds to.
    pub pixel: UVec2,
    /// What it adds there: the mean of the channels, weighted.
    pub value: f32,
    /// Its technique.
    pub technique: Technique,
    /// Vertices of the light subpath.
    pub s: u32,
    /// Vertices of the camera subpath.
    pub t: u32,
    /// Whether it was joined at a camera subpath's vertex on a surface.
    pub on_surface: bool,
}

/// What the light subpaths that started on one light did.
#[derive(Clone, Copy, Debug, Default)]
pub struct OfLight {
    /// How many there were.
    pub paths: f64,
    /// Their vertices.
    pub vertices: f64,
    /// Cells along the edges to their collisions.
    pub cells: f64,
    /// Connections to the lens that were not blocked.
    pub lens: f64,
    /// Photons that are stored of them.
    pub photons: f64,
    /// Beams that are stored of them.
    pub beams: f64,
    /// Merges with them, in the order of [`MERGES`].
    pub merges: [f64; MERGES.len()],
    /// Connections with them that were tried.
    pub tried: f64,
}

impl OfLight {
    fn add(&mut self, other: &Self) {
        self.paths += other.paths;
        self.vertices += other.vertices;
        self.cells += other.cells;
        self.lens += other.lens;
        self.photons += other.photons;
        self.beams += other.beams;
        self.merges.iter_mut().zip(other.merges).for_each(|(sum, n)| *sum += n);
        self.tried += other.tried;
    }
}

/// Sums `other` up, light by light.
fn add_all(sums: &mut [OfLight], other: &[OfLight]) {
    sums.iter_mut().zip(other).for_each(|(sum, of)| sum.add(of));
}

/// What a pilot counted.
pub struct Pilot {
    /// Its constants.
    pub pass: Pass,
    /// How many light subpaths there were: the first ones of an iteration.
    pub paths: u64,
    /// The light subpaths.
    chunks: Vec<Stored>,
    /// What merges find them by.
    structures: Photons,
    /// By camera subpath, its steps.
    pub tracks: Vec<Vec<Step>>,
    /// What was recorded.
    pub seen: Vec<Seen>,
    /// The light that each light subpath started on.
    starts: Vec<u32>,
    /// What light subpaths did, by that light.
    pub of_lights: Vec<OfLight>,
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

/// The pixels of a pilot's camera subpaths.
pub fn tracked(scene: &Scene) -> impl Iterator<Item = UVec2> {
    pixels(scene, SIDE)
}

/// Watches one subpath.
struct Watch<'a> {
    scene: &'a Scene,
    pass: &'a Pass,
    maker: Maker,
    /// Connections with light subpaths that a vertex on a surface tries on average, and the light that those start on.
    partners: (f32, u32),
    /// The light that each light subpath starts on, as far as that is known.
    starts: &'a [u32],
    /// What it has to do with the light subpaths of each light.
    of_lights: Vec<OfLight>,
    /// Of a light subpath: the light that it starts on.
    light: Option<u32>,
    ordinal: u32,
    /// Where the subpath was last.
    last: Option<Vec3A>,
    steps: Vec<Step>,
    seen: Vec<Seen>,
}

impl<'a> Watch<'a> {
    fn of(scene: &'a Scene, pass: &'a Pass, maker: Maker, partners: (f32, u32), starts: &'a [u32]) -> Self {
        Self {
            scene,
            pass,
            maker,
            partners,
            starts,
            of_lights: vec![OfLight::default(); scene.lights.lights().len()],
            light: None,
            ordinal: 0,
            last: None,
            steps: vec![Step::LENS],
            seen: Vec::new(),
        }
    }
}

impl Sink for Watch<'_> {
    fn record(&mut self, sample: &Sample, joint: &Joint) {
        let pixel = match (joint, self.maker) {
            (Joint::Lens(_, pixel), _) => *pixel,
            (_, Maker::Camera(pixel)) => pixel,
            _ => unreachable!("a light subpath records what falls on the lens"),
        };
        let value = sample.contribution.element_sum() / 3.0 * sample.weight;
        let step = self.steps.last_mut().expect("the first one is there from the start");
        let on_surface = step.on_surface;
        match place_of(sample.technique) {
            Some(i) => {
                step.merges[i] += 1;
                if let Joint::Merge(meeting) = joint {
                    let light = self.starts[meeting.path as usize];
                    self.of_lights[light as usize].merges[i] += 1.0;
                }
            }
            None => step.connections += u32::from(sample.technique != Technique::Hit),
        }
        let known = !matches!(joint, Joint::Glow) && value.is_finite() && value > 0.0;
        if known {
            let Sample { technique, s, t, .. } = *sample;
            self.seen.push(Seen {
                maker: self.maker,
                ordinal: self.ordinal,
                pixel,
                value,
                technique,
                s,
                t,
                on_surface,
            });
        }
        self.ordinal += 1;
    }

    fn vertex(&mut self, vertex: &Vertex) {
        let next_event = if self.pass.on(Technique::NextEvent) { 1.0 } else { 0.0 };
        let connects = vertex.is_connectible(self.scene);
        let (partners, light) = self.partners;
        let joined = if connects { partners * self.pass.share(&vertex.place) } else { 0.0 };
        if joined > 0.0 {
            self.of_lights[light as usize].tried += f64::from(joined);
        }
        let next_event = if connects { next_event } else { 0.0 };
        let tried = next_event + joined;
        self.steps.push(match &vertex.place {
            Place::Surface(_) => Step { on_surface: true, tried, next_event, ..Step::LENS },
            Place::Medium(collision) => {
                let medium = &self.scene.media[collision.medium as usize];
                let goes_on = medium.continuation(&collision.coefficients);
                let length = self.last.map_or(0.0, |p| p.distance(collision.p));
                let cells = if length.is_finite() { medium.cells(length) } else { 0.0 };
                Step { medium: collision.medium, goes_on, tried, next_event, cells, ..Step::LENS }
            }
        });
        self.last = Some(vertex.place.position());
    }

    fn start(&mut self, start: &Start) {
        self.last = Some(match start {
            Start::Light(light) => {
                self.light = Some(light.light);
                light.p
            }
            Start::Lens(p) => *p,
        });
    }
}

impl Pilot {
    /// Runs it with the radii and counts of `gathers` and light subpaths that start as `starts` says, though with no more light subpaths than it needs: where these are fewer
    /// than a technique has, each merge stands for as many more. Pilots of different `number` share no random numbers.
    pub fn run(
        scene: &Scene,
        settings: &Settings,
        thinning: &Thinning,
        starts: &Arc<Discrete>,
        gathers: &Gathers,
        number: u64,
    ) -> Self {
        let size = scene.camera.size();
        let partners = u64::from(size.x) * u64::from(size.y);
        // The render's seed is no part of it: independent runs shall have the same radii and counts.
        let settings = Settings { seed: number, ..*settings };
        let thinning = Thinning { continuations: Vec::new(), ..thinning.clone() };
        let pass = Pass::new(settings, PILOT, *gathers, partners, thinning, starts.clone());
        let needed = if settings.needs_partners() { partners } else { 0 }.max(pass.merged_paths());
        let all: Vec<UVec2> = tracked(scene).collect();
        let some: Vec<UVec2> = all.iter().step_by(FEW).copied().collect();
        let mut paths = PATHS.min(needed);
        loop {
            let mut pilot = Self::walk_light(scene, pass.clone(), paths);
            let seen: usize = pilot.watch(scene, &some).iter().map(|watched| watched.seen.len()).sum();
            let too_many = seen as f64 / (some.len() as f64 * MOST_SEEN);
            if too_many <= 1.0 || paths <= LEAST_PATHS {
                for watched in pilot.watch(scene, &all) {
                    pilot.tracks.push(watched.steps);
                    pilot.seen.extend(watched.seen);
                    add_all(&mut pilot.of_lights, &watched.of_lights);
                }
                return pilot;
            }
            paths = ((paths as f64 / too_many) as u64).clamp(LEAST_PATHS, paths - 1);
        }
    }

    /// With so many light subpaths, and no camera subpaths yet.
    fn walk_light(scene: &Scene, pass: Pass, paths: u64) -> Self {
        let walked: Vec<Walked> =
            (0..paths.div_ceil(CHUNK)).into_par_iter().map(|c| walk_chunk(scene, &pass, c, paths)).collect();
        let (mut seen, mut chunks, mut starts) = (Vec::new(), Vec::new(), Vec::new());
        let mut of_lights = vec![OfLight::default(); scene.lights.lights().len()];
        for chunk in walked {
            seen.extend(chunk.seen);
            starts.extend(chunk.starts);
            add_all(&mut of_lights, &chunk.of_lights);
            chunks.push(chunk.stored);
        }
        let structures = Photons::build(scene, &pass, &chunks);
        Self { pass, paths, chunks, structures, tracks: Vec::new(), seen, starts, of_lights }
    }

    /// The mean over light subpaths of what is counted by their lights.
    pub fn a_light_path(&self, of: impl Fn(&OfLight) -> f64) -> f64 {
        self.of_lights.iter().map(of).sum::<f64>() / self.paths.max(1) as f64
    }

    /// What camera subpaths of these pixels do.
    fn watch(&self, scene: &Scene, pixels: &[UVec2]) -> Vec<Watched> {
        let of_pixel = |pixel: &UVec2| {
            let light = self.starts.get(self.partner(scene, *pixel) as usize).copied().unwrap_or(0);
            let partners = (self.share_of_partner(scene, *pixel), light);
            let mut watch = Watch::of(scene, &self.pass, Maker::Camera(*pixel), partners, &self.starts);
            self.trace_camera(scene, *pixel, &mut watch);
            Watched { steps: watch.steps, seen: watch.seen, of_lights: watch.of_lights }
        };
        pixels.par_iter().map(of_pixel).collect()
    }

    /// The number of the light subpath that a pixel's camera subpath is connected with.
    pub fn partner(&self, scene: &Scene, pixel: UVec2) -> u64 {
        let index = u64::from(pixel.y) * u64::from(scene.camera.size().x) + u64::from(pixel.x);
        index % self.paths.max(1)
    }

    /// The vertices that a pixel's camera subpath is connected with.
    fn partner_vertices(&self, scene: &Scene, pixel: UVec2) -> &[Vertex] {
        if !self.pass.on(Technique::Connect) {
            return &[];
        }
        let partner = self.partner(scene, pixel);
        self.chunks[(partner / CHUNK) as usize].path((partner % CHUNK) as usize)
    }

    fn share_of_partner(&self, scene: &Scene, pixel: UVec2) -> f32 {
        self.partner_vertices(scene, pixel).iter().map(|v| self.pass.share(&v.place)).sum()
    }

    /// Traces the camera subpath of a pixel.
    pub fn trace_camera<S: Sink>(&self, scene: &Scene, pixel: UVec2, sink: &mut S) {
        let vertices = self.partner_vertices(scene, pixel);
        let partners = Partners { vertices, photons: Some(&self.structures) };
        camera_path::trace(scene, &self.pass, pixel, partners, sink);
    }

    /// Of how many light subpaths of a technique one is here.
    pub fn stands_for(&self, technique: Technique) -> f64 {
        let paths = self.pass.gathers.of(technique).paths;
        paths as f64 / paths.min(self.paths).max(1) as f64
    }
}

/// What was seen of a camera subpath.
struct Watched {
    steps: Vec<Step>,
    seen: Vec<Seen>,
    of_lights: Vec<OfLight>,
}

/// The light subpaths of a chunk, where they started, and what they made by themselves.
struct Walked {
    stored: Stored,
    starts: Vec<u32>,
    seen: Vec<Seen>,
    of_lights: Vec<OfLight>,
}

fn walk_chunk(scene: &Scene, pass: &Pass, number: u64, paths: u64) -> Walked {
    let mut stored = Stored::default();
    let (mut seen, mut starts) = (Vec::new(), Vec::new());
    let mut of_lights = vec![OfLight::default(); scene.lights.lights().len()];
    for path in number * CHUNK..((number + 1) * CHUNK).min(paths) {
        let before = (stored.photons.len(), stored.beams.len());
        let mut watch = Watch::of(scene, pass, Maker::Light(path), (0.0, 0), &[]);
        light_path::trace(scene, pass, path, &mut stored, &mut watch);
        stored.end_path();
        // One that did not start has no place among any light's.
        let light = watch.light.unwrap_or(0);
        starts.push(light);
        of_lights[light as usize].add(&OfLight {
            paths: 1.0,
            vertices: (watch.steps.len() - 1) as f64,
            cells: watch.steps.iter().map(|s| f64::from(s.cells)).sum(),
            lens: f64::from(watch.ordinal),
            photons: (stored.photons.len() - before.0) as f64,
            beams: (stored.beams.len() - before.1) as f64,
            ..OfLight::default()
        });
        seen.extend(watch.seen);
    }
    Walked { stored, starts, seen, of_lights }
}
