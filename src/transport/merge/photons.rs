//! What is kept of light subpaths, and the structures that merges find it by.

use super::gather::Gathers;
use super::settings::Beams;
use crate::bsdf::Mode;
use crate::film::Splat;
use crate::light::LightPoint;
use crate::medium::{Coefficients, Passage};
use crate::scene::{Scene, Stretch};
use crate::transport::merge::join::{Arm, is_negligible};
use crate::transport::pass::Pass;
use crate::transport::technique::Technique;
use crate::transport::walk::{Flight, Place, Vertex};
use glam::Vec3A;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use rayon::prelude::*;

/// Light subpaths in a chunk: the unit of parallel work on them. A constant, so that the order of sums never
/// depends on the threads.
pub const CHUNK: u64 = 1024;

/// Beams are cut for their tree into pieces of so many radii, or longer ones.
const PIECE_RADII: f32 = 10.0;
/// … of at least this part of the scene's bounding sphere's radius.
const PIECE_SCENE: f32 = 1.0 / 24.0;

/// A light subpath's edge, as far as it runs through one medium that scatters.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// The whole edge, from its start on.
    pub flight: Flight,
    /// Where this part starts.
    pub origin: Vec3A,
    /// Distance from the edge's start to there (metres).
    pub start: f32,
    /// Length of this part (metres).
    pub length: f32,
    /// From the edge's start to there.
    pub before: Passage,
    /// Index of the medium.
    pub medium: u32,
    /// Number of the light subpath in its iteration.
    pub path: u32,
    /// Index into [`Stored::starts`].
    pub light: u32,
}

/// Where a light subpath starts.
#[derive(Clone, Copy, Debug)]
pub struct LightStart {
    /// x_0.
    pub point: LightPoint,
    /// p_0.
    pub pdf: f32,
}

/// What is kept of a chunk of light subpaths.
#[derive(Debug, Default)]
pub struct Stored {
    /// Vertices that can be connected or merged.
    pub vertices: Vec<Vertex>,
    /// Where each subpath's vertices end.
    ends: Vec<u32>,
    /// Beams through media.
    pub beams: Vec<Beam>,
    /// Where each subpath's beams end.
    beam_ends: Vec<u32>,
    /// By subpath that has beams.
    pub starts: Vec<LightStart>,
    /// What falls on the film, by its band.
    pub splats: Vec<Vec<Splat>>,
}

impl Stored {
    /// Forgets everything and keeps the memory; for a film of so many bands.
    pub fn clear(&mut self, bands: usize) {
        self.vertices.clear();
        self.ends.clear();
        self.beams.clear();
        self.beam_ends.clear();
        self.starts.clear();
        self.splats.resize_with(bands, Vec::new);
        self.splats.iter_mut().for_each(Vec::clear);
    }

    /// A subpath is complete.
    pub fn end_path(&mut self) {
        self.ends.push(self.vertices.len() as u32);
        self.beam_ends.push(self.beams.len() as u32);
    }

    /// The vertices of the chunk's subpath `index`.
    pub fn path(&self, index: usize) -> &[Vertex] {
        let begin = if index == 0 { 0 } else { self.ends[index - 1] as usize };
        &self.vertices[begin..self.ends[index] as usize]
    }

    /// The first vertices, those of `paths` subpaths.
    fn first_vertices(&self, paths: usize) -> &[Vertex] {
        &self.vertices[..first(&self.ends, paths)]
    }

    /// The first beams, those of `paths` subpaths.
    fn first_beams(&self, paths: usize) -> &[Beam] {
        &self.beams[..first(&self.beam_ends, paths)]
    }
}

fn first(ends: &[u32], paths: usize) -> usize {
    match paths.min(ends.len()) {
        0 => 0,
        n => ends[n - 1] as usize,
    }
}

/// Names a vertex or a beam: chunk, and place in it.
type Id = (u32, u32);

/// Points in a kd-tree.
#[derive(Debug)]
pub struct Points {
    tree: Option<ImmutableKdTree<f32, 3>>,
    ids: Vec<Id>,
}

impl Points {
    fn build(positions: &[[f32; 3]], ids: Vec<Id>) -> Self {
        let tree = (!positions.is_empty())
            .then(|| ImmutableKdTree::new_from_slice(positions).expect("a kd-tree of finite points"));
        Self { tree, ids }
    }

    /// Calls `found` with each point within `radius` of `p`, and the square of its distance.
    #[inline]
    pub fn within(&self, p: Vec3A, radius: f32, mut found: impl FnMut(Id, f32)) {
        let Some(tree) = &self.tree else { return };
        tree.query(&p.to_array()).within::<SquaredEuclidean<f32>>(radius * radius).unsorted().visit(|hit| {
            found(self.ids[hit.item as usize], hit.distance);
        });
    }
}

/// Boxes in a binary tree, each with a name.
pub struct Boxes<T> {
    tree: Bvh2,
    items: Vec<T>,
}

impl<T: Copy> Boxes<T> {
    fn build(boxes: &[Aabb], items: &[T]) -> Self {
        if boxes.is_empty() {
            return Self { tree: Bvh2::default(), items: Vec::new() };
        }
        let tree = build_bvh2(boxes, BvhBuildParams::very_fast_build(), &mut Default::default());
        let items = tree.primitive_indices.iter().map(|i| items[*i as usize]).collect();
        Self { tree, items }
    }

    /// Calls `found` with what a segment may meet.
    #[inline]
    pub fn along(&self, origin: Vec3A, dir: Vec3A, length: f32, mut found: impl FnMut(&T)) {
        if self.items.is_empty() {
            return;
        }
        let ray = obvhs::ray::Ray::new(origin, dir, 0.0, length);
        self.tree.ray_traverse_anyhit(ray, |_, i| found(&self.items[i]));
    }

    /// Calls `found` with what may be about a point.
    #[inline]
    pub fn about(&self, point: Vec3A, mut found: impl FnMut(&T)) {
        if self.items.is_empty() {
            return;
        }
        self.tree.point_traverse(point, |tree, node| {
            let node = &tree.nodes[node as usize];
            for item in &self.items[node.first_index as usize..][..node.prim_count as usize] {
                found(item);
            }
            true
        });
    }
}

/// A piece of a beam: between two distances from the start of its part, the first included. Each point of a beam has one owner.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// The beam.
    pub id: Id,
    /// From here on.
    pub from: f32,
    /// Up to here.
    pub to: f32,
}

/// All light subpaths of an iteration with the structures over them.
pub struct Photons<'a> {
    chunks: &'a [Stored],
    /// Vertices on surfaces.
    pub surface: Points,
    /// Collisions, for P-P3D.
    pub collisions: Points,
    /// Balls about collisions, for P-B2D.
    pub balls: Boxes<Id>,
    /// Pieces of beams, for B-P2D.
    pub beams_for_points: Boxes<Piece>,
    /// Pieces of beams, for B-B1D.
    pub beams_for_beams: Boxes<Piece>,
}

impl<'a> Photons<'a> {
    /// Builds what the techniques that are on need.
    pub fn build(scene: &Scene, pass: &Pass, chunks: &'a [Stored]) -> Self {
        let gathers = &pass.gathers;
        let is_surface = |v: &Vertex| matches!(v.place, Place::Surface(_));
        let ((surface, collisions), (balls, (beams_for_points, beams_for_beams))) = rayon::join(
            || {
                rayon::join(
                    || points(pass, gathers, chunks, Technique::Surface, is_surface),
                    || points(pass, gathers, chunks, Technique::PointPoint, |v| !is_surface(v)),
                )
            },
            || {
                rayon::join(
                    || balls(pass, gathers, chunks),
                    || {
                        rayon::join(
                            || pieces(scene, pass, chunks, Technique::BeamPoint),
                            || pieces(scene, pass, chunks, Technique::BeamBeam),
                        )
                    },
                )
            },
        );
        Self { chunks, surface, collisions, balls, beams_for_points, beams_for_beams }
    }

    /// A vertex by its name.
    #[inline]
    pub fn vertex(&self, id: Id) -> &Vertex {
        &self.chunks[id.0 as usize].vertices[id.1 as usize]
    }

    /// A beam by its name.
    #[inline]
    pub fn beam(&self, id: Id) -> &Beam {
        &self.chunks[id.0 as usize].beams[id.1 as usize]
    }

    /// A beam as it arrives at a point `t` from the start of its part, where the coefficients are `at`.
    #[inline]
    pub fn arm(&self, scene: &Scene, pass: &Pass, id: Id, t: f32, at: &Coefficients) -> Option<Arm> {
        let beam = self.beam(id);
        let medium = &scene.media[beam.medium as usize];
        let depth = medium.optical_depth(beam.origin, beam.flight.ray.dir, 0.0, t);
        let passage = beam.before.then(depth, true);
        if is_negligible(&passage) {
            return None;
        }
        let count = if beam.flight.specular {
            0.0
        } else if beam.flight.length > 0 {
            if pass.on(Technique::Connect) {
                pass.raise(beam.flight.share * pass.share_in(beam.medium))
            } else {
                0.0
            }
        } else if pass.on(Technique::NextEvent) {
            let start = &self.chunks[id.0 as usize].starts[beam.light as usize];
            let position = beam.origin + beam.flight.ray.dir * t;
            let toward = scene.lights.pdf_toward(&scene.geometry, &start.point, position);
            pass.raise(toward / start.pdf)
        } else {
            0.0
        };
        beam.flight.arm(pass, Mode::Importance, beam.start + t, &passage, at.sigma_t, count)
    }
}

/// How many of the chunk's subpaths are among the first `paths` of all.
fn share(chunk: usize, paths: u64) -> usize {
    paths.saturating_sub(chunk as u64 * CHUNK).min(CHUNK) as usize
}

fn points(
    pass: &Pass,
    gathers: &Gathers,
    chunks: &[Stored],
    technique: Technique,
    which: impl Fn(&Vertex) -> bool,
) -> Points {
    let (mut positions, mut ids) = (Vec::new(), Vec::new());
    if pass.on(technique) {
        let paths = gathers.of(technique).paths;
        for (c, chunk) in chunks.iter().enumerate() {
            for (v, vertex) in chunk.first_vertices(share(c, paths)).iter().enumerate() {
                if which(vertex) {
                    positions.push(vertex.place.position().to_array());
                    ids.push((c as u32, v as u32));
                }
            }
        }
    }
    Points::build(&positions, ids)
}

fn balls(pass: &Pass, gathers: &Gathers, chunks: &[Stored]) -> Boxes<Id> {
    let (mut boxes, mut ids) = (Vec::new(), Vec::new());
    if pass.on(Technique::PointBeam) {
        let gather = gathers.of(Technique::PointBeam);
        // A little wider, so that the rounding of the boxes' test loses nothing.
        let half = Vec3A::splat(gather.radius * 1.0001);
        for (c, chunk) in chunks.iter().enumerate() {
            for (v, vertex) in chunk.first_vertices(share(c, gather.paths)).iter().enumerate() {
                if let Place::Medium(collision) = &vertex.place {
                    boxes.push(widened(collision.p, collision.p, half));
                    ids.push((c as u32, v as u32));
                }
            }
        }
    }
    Boxes::build(&boxes, &ids)
}

/// The box about two points and `half` more on each side, and a few ulps.
fn widened(a: Vec3A, b: Vec3A, half: Vec3A) -> Aabb {
    let (min, max) = (a.min(b), a.max(b));
    let slack = half + 4.0 * f32::EPSILON * min.abs().max(max.abs());
    Aabb::new(min - slack, max + slack)
}

fn pieces(scene: &Scene, pass: &Pass, chunks: &[Stored], technique: Technique) -> Boxes<Piece> {
    if !pass.on(technique) {
        return Boxes::build(&[], &[]);
    }
    let gather = pass.gathers.of(technique);
    let (_, scene_radius) = scene.geometry.bounding_sphere();
    let longest = (PIECE_RADII * gather.radius).max(PIECE_SCENE * scene_radius);
    let half = Vec3A::splat(gather.radius * 1.0001);
    let made: Vec<(Vec<Aabb>, Vec<Piece>)> = chunks
        .par_iter()
        .enumerate()
        .map(|(c, chunk)| {
            let (mut boxes, mut pieces) = (Vec::new(), Vec::new());
            for (b, beam) in chunk.first_beams(share(c, gather.paths)).iter().enumerate() {
                let n = (beam.length / longest).ceil().clamp(1.0, 4096.0);
                let at = |i: f32| if i == n { beam.length } else { beam.length * (i / n) };
                let dir = beam.flight.ray.dir;
                for i in 0..n as usize {
                    let (from, to) = (at(i as f32), at(i as f32 + 1.0));
                    boxes.push(widened(beam.origin + dir * from, beam.origin + dir * to, half));
                    pieces.push(Piece { id: (c as u32, b as u32), from, to });
                }
            }
            (boxes, pieces)
        })
        .collect();
    let (boxes, pieces): (Vec<_>, Vec<_>) = made.into_iter().unzip();
    Boxes::build(&boxes.concat(), &pieces.concat())
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
        let end = |channel| {
            let (origin, dir) = (stretch.origin, stretch.dir);
            medium.invert(origin, dir, 0.0, stretch.length, channel, DEEPEST).unwrap_or(stretch.length)
        };
        let (_, radius) = scene.geometry.bounding_sphere();
        let length = end(0).max(end(1)).max(end(2)).min(FARTHEST * radius.max(1.0));
        part(&Stretch { length, ..*stretch });
    });
}

/// Optical depth at which beams end: e^-17 = 4e-8 is less than f32 tells from nothing.
const DEEPEST: f32 = 17.0;
/// Where the scene has no end, beams have one at so many radii of the sphere about all shapes.
const FARTHEST: f32 = 1e3;
