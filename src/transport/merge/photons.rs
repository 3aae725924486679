//! All light subpaths of an iteration, and the structures that merges find them by.
//!
//! Memory is linear in what is stored. Bytes a light vertex: a [`Photon`], 64, twice (as it was walked, and in the
//! array that names go into), and an [`Entry`], 16, for each of P-P3D or SURF that uses it, and for P-B2D 16 and a box in
//! a tree, about 64. Bytes a beam: a [`Beam`], 128 at most, twice, and 48 and a box for each [`Piece`]. Vertices that are
//! connected are kept beside these.

use super::boxes::{Boxes, widened};
use super::gather::Gathers;
use super::grid::{Entry, Points};
use super::join::{Arm, is_negligible};
use super::settings::Beams;
use super::store::{Beam, CHUNK, LightStart, Photon, Stored};
use crate::bsdf::Mode;
use crate::geometry::Aabb;
use crate::medium::Coefficients;
use crate::scene::{Scene, Stretch};
use crate::transport::pass::Pass;
use crate::transport::technique::Technique;
use crate::transport::walk::Flight;
use glam::{Vec3, Vec3A};
use rayon::prelude::*;

/// Beams are cut for their tree into pieces of so many radii, or longer ones.
const PIECE_RADII: f32 = 10.0;
/// … of at least this part of the scene's bounding sphere's radius.
const PIECE_SCENE: f32 = 1.0 / 24.0;

/// A piece of a beam: between two distances from the start of its part, the first included. Each point of a beam has one
/// owner. It has all that tells whether it is passed.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Where the beam's part starts.
    pub origin: Vec3,
    /// The beam's unit direction.
    pub dir: Vec3,
    /// From here on.
    pub from: f32,
    /// Up to here.
    pub to: f32,
    /// The beam.
    pub id: u32,
    /// Index of the medium.
    pub medium: u32,
}

/// All light subpaths of an iteration with the structures over them.
pub struct Photons {
    photons: Vec<Photon>,
    beams: Vec<Beam>,
    /// Depths along beams, see [`Medium::depths_along`](crate::medium::Medium::depths_along).
    depths: Vec<f32>,
    starts: Vec<LightStart>,
    /// Vertices on surfaces.
    pub surface: Points,
    /// Collisions, for P-P3D.
    pub collisions: Points,
    /// Balls about collisions, for P-B2D.
    pub balls: Boxes<Entry>,
    /// Pieces of beams, for B-P2D.
    pub beams_for_points: Boxes<Piece>,
    /// Pieces of beams, for B-B1D.
    pub beams_for_beams: Boxes<Piece>,
}

impl Photons {
    /// Builds what the techniques that are on need.
    pub fn build(scene: &Scene, pass: &Pass, chunks: &[Stored]) -> Self {
        let gathers = &pass.gathers;
        let on_surface = |p: &Photon| p.medium().is_none();
        let in_medium = |p: &Photon| p.medium().is_some();
        let grid = |t: Technique, which: fn(&Photon) -> bool| {
            let radius = gathers.of(t).radius;
            Points::build(&entries(pass, gathers, chunks, t, which), radius)
        };
        let both = || {
            rayon::join(|| grid(Technique::Surface, on_surface), || grid(Technique::PointPoint, in_medium))
        };
        let boxes = || {
            rayon::join(
                || balls(&entries(pass, gathers, chunks, Technique::PointBeam, in_medium), gathers),
                || {
                    rayon::join(
                        || {
                            let (boxes, pieces) = pieces(scene, pass, chunks, Technique::BeamPoint);
                            Boxes::build(&boxes, &pieces)
                        },
                        || {
                            let (boxes, pieces) = pieces(scene, pass, chunks, Technique::BeamBeam);
                            Boxes::build(&boxes, &pieces)
                        },
                    )
                },
            )
        };
        let ((surface, collisions), (balls, (beams_for_points, beams_for_beams))) = rayon::join(both, boxes);
        let mut all = Self {
            photons: Vec::with_capacity(chunks.iter().map(|c| c.photons.len()).sum()),
            beams: Vec::with_capacity(chunks.iter().map(|c| c.beams.len()).sum()),
            depths: Vec::with_capacity(chunks.iter().map(|c| c.depths.len()).sum()),
            starts: Vec::with_capacity(chunks.iter().map(|c| c.starts.len()).sum()),
            surface,
            collisions,
            balls,
            beams_for_points,
            beams_for_beams,
        };
        for chunk in chunks {
            let first = all.starts.len() as u32;
            all.photons.extend_from_slice(&chunk.photons);
            let depths = all.depths.len() as u32;
            all.beams.extend(chunk.beams.iter().map(|b| b.moved(first, depths)));
            all.depths.extend_from_slice(&chunk.depths);
            all.starts.extend_from_slice(&chunk.starts);
        }
        all
    }

    /// A photon by its name.
    #[inline]
    pub fn photon(&self, id: u32) -> &Photon {
        &self.photons[id as usize]
    }

    /// A beam by its name.
    #[inline]
    pub fn beam(&self, id: u32) -> &Beam {
        &self.beams[id as usize]
    }

    /// A beam as it arrives at a point `t` from the start of its part, where the coefficients are `at`.
    #[inline]
    pub fn arm(&self, scene: &Scene, pass: &Pass, beam: &Beam, t: f32, at: &Coefficients) -> Option<Arm> {
        let medium = &scene.media[beam.medium() as usize];
        let flight = beam.flight();
        let line = (flight.ray.origin, flight.ray.dir, beam.length);
        let depth = medium.depth_along(&self.depths[beam.depths()], line, t);
        let passage = beam.before().then(depth, true);
        if is_negligible(&passage) {
            return None;
        }
        let count = if flight.specular {
            0.0
        } else if flight.length > 0 {
            if pass.on(Technique::Connect) {
                pass.raise(flight.share * pass.thinning.share(beam.medium()))
            } else {
                0.0
            }
        } else if pass.on(Technique::NextEvent) {
            let start = &self.starts[beam.light as usize];
            let position = flight.ray.at(t);
            let toward = scene.lights.pdf_toward(&scene.geometry, &start.point, position);
            pass.raise(toward / start.pdf)
        } else {
            0.0
        };
        let rate = at.sigma_t * medium.area(flight.ray.dir);
        flight.arm(pass, Mode::Importance, beam.start + t, &passage, rate, count)
    }
}

/// How many of the chunk's subpaths are among the first `paths` of all.
fn share(chunk: usize, paths: u64) -> usize {
    paths.saturating_sub(chunk as u64 * CHUNK).min(CHUNK) as usize
}

/// The photons that a technique merges with.
fn entries(
    pass: &Pass,
    gathers: &Gathers,
    chunks: &[Stored],
    technique: Technique,
    which: impl Fn(&Photon) -> bool,
) -> Vec<Entry> {
    let mut entries = Vec::new();
    if pass.on(technique) {
        let paths = gathers.of(technique).paths;
        let mut base = 0;
        for (c, chunk) in chunks.iter().enumerate() {
            for (i, photon) in chunk.first_photons(share(c, paths)).iter().enumerate() {
                if which(photon) {
                    entries.push(Entry { p: photon.p, id: base + i as u32 });
                }
            }
            base += chunk.photons.len() as u32;
        }
    }
    entries
}

fn balls(entries: &[Entry], gathers: &Gathers) -> Boxes<Entry> {
    let radius = gathers.of(Technique::PointBeam).radius;
    let boxes: Vec<Aabb> = entries.iter().map(|e| widened(e.p.into(), e.p.into(), radius)).collect();
    Boxes::build(&boxes, entries)
}

/// Boxes about pieces of the beams that a technique merges with, and the pieces; none where it is off.
fn pieces(scene: &Scene, pass: &Pass, chunks: &[Stored], technique: Technique) -> (Vec<Aabb>, Vec<Piece>) {
    if !pass.on(technique) {
        return (Vec::new(), Vec::new());
    }
    let gather = pass.gathers.of(technique);
    let (_, scene_radius) = scene.geometry.bounding_sphere();
    let longest = (PIECE_RADII * gather.radius).max(PIECE_SCENE * scene_radius);
    let bases: Vec<u32> = chunks
        .iter()
        .scan(0, |base, chunk| {
            let first = *base;
            *base += chunk.beams.len() as u32;
            Some(first)
        })
        .collect();
    let made: Vec<(Vec<Aabb>, Vec<Piece>)> = chunks
        .par_iter()
        .enumerate()
        .map(|(c, chunk)| {
            let (mut boxes, mut pieces) = (Vec::new(), Vec::new());
            for (b, beam) in chunk.first_beams(share(c, gather.paths)).iter().enumerate() {
                let n = (beam.length / longest).ceil().clamp(1.0, 4096.0);
                let at = |i: f32| if i == n { beam.length } else { beam.length * (i / n) };
                let (origin, dir) = (Vec3A::from(beam.origin), Vec3A::from(beam.dir));
                for i in 0..n as usize {
                    let (from, to) = (at(i as f32), at(i as f32 + 1.0));
                    boxes.push(widened(origin + dir * from, origin + dir * to, gather.radius));
                    let id = bases[c] + b as u32;
                    let (origin, dir, medium) = (beam.origin, beam.dir, beam.medium());
                    pieces.push(Piece { origin, dir, from, to, id, medium });
                }
            }
            (boxes, pieces)
        })
        .collect();
    let (boxes, pieces): (Vec<_>, Vec<_>) = made.into_iter().unzip();
    (boxes.concat(), pieces.concat())
}

/// Cuts an edge that a walk in `mode` has flown, or the whole ray where its beams are long, into its parts through
/// single media that scatter.
pub fn parts<'a>(
    scene: &'a Scene,
    pass: &Pass,
    mode: Mode,
    flight: &Flight,
    flown: f32,
    mut part: impl FnMut(&Stretch<'a>),
) {
    let known = match pass.beams_of(mode) {
        Beams::Long => None,
        Beams::Short => Some(flown),
    };
    scene.survey(&flight.ray, flight.inside, known, |stretch| {
        let Some(medium) = stretch.medium.filter(|m| m.scatters()) else { return };
        if is_negligible(&stretch.before) {
            return;
        }
        let end = medium.reach(stretch.origin, stretch.dir, stretch.length, DEEPEST);
        let (_, radius) = scene.geometry.bounding_sphere();
        let length = end.min(FARTHEST * radius.max(1.0));
        if length <= 0.0 {
            return;
        }
        part(&Stretch { start: stretch.start + flight.skipped, length, ..*stretch });
    });
}

/// Optical depth at which beams end: e^-17 = 4e-8 is less than f32 tells from nothing.
const DEEPEST: f32 = 17.0;
/// Where the scene has no end, beams have one at so many radii of the sphere about all shapes.
const FARTHEST: f32 = 1e3;
