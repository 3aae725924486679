//! What is kept of light subpaths: records as small as merges allow.
//!
//! A [`Photon`] is one cache line and a [`Beam`] less than two; they are read in random order, once a merge that is
//! near enough. What decides whether it is lies in the structures that they are found by, see [`super::grid`] and
//! [`super::boxes`].

use super::join::Arm;
use crate::film::Splat;
use crate::geometry::Ray;
use crate::light::LightPoint;
use crate::math::Rgb;
use crate::medium::Passage;
use crate::scene::{Inside, Stretch};
use crate::transport::mis::{Link, Pending};
use crate::transport::walk::{Flight, Place, Vertex};
use glam::Vec3;
use std::ops::Range;

/// Light subpaths in a chunk: the unit of parallel work on them. A constant, so that the order of sums never
/// depends on the threads.
pub const CHUNK: u64 = 1024;

/// A light vertex as merges see it.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Where.
    pub p: Vec3,
    /// Unit direction to the vertex before.
    pub to_previous: Vec3,
    throughput: Vec3,
    link: Link,
    beam: f32,
    /// Number of the light subpath in its iteration.
    pub path: u32,
    /// What the light path expression needs of the vertices before this one.
    pub trail: u32,
    length: u16,
    medium: u16,
}

const _: () = assert!(size_of::<Photon>() == 64);

/// Stands for no medium: the photon lies on a surface.
const ON_SURFACE: u16 = u16::MAX;

impl Photon {
    /// Of a light vertex of the subpath `path`.
    pub fn new(vertex: &Vertex, path: u32) -> Self {
        Self {
            p: vertex.place.position().into(),
            to_previous: vertex.to_previous.into(),
            throughput: vertex.throughput.into(),
            link: vertex.link,
            beam: vertex.beam,
            path,
            trail: vertex.trail,
            length: vertex.length as u16,
            medium: match &vertex.place {
                Place::Surface(_) => ON_SURFACE,
                Place::Medium(collision) => narrow(collision.medium),
            },
        }
    }

    /// Index of the medium; `None` on a surface.
    #[inline]
    pub fn medium(&self) -> Option<u32> {
        (self.medium != ON_SURFACE).then_some(self.medium.into())
    }

    /// Edges of the subpath.
    #[inline]
    pub fn length(&self) -> u32 {
        self.length.into()
    }

    /// The subpath as it arrives here.
    #[inline]
    pub fn arm(&self) -> Arm {
        Arm {
            back: self.to_previous.into(),
            throughput: self.throughput.into(),
            link: self.link,
            beam: self.beam,
            length: self.length.into(),
            trail: self.trail,
        }
    }
}

/// The index of a medium in two bytes: solids have no more, and each has one medium at most.
fn narrow(medium: u32) -> u16 {
    u16::try_from(medium).expect("fewer media than solids can be numbered")
}

/// A light subpath's edge, as far as it runs through one medium that scatters.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Where this part starts.
    pub origin: Vec3,
    /// Unit direction.
    pub dir: Vec3,
    /// Length of this part (metres).
    pub length: f32,
    /// Distance from the edge's start to there (metres).
    pub start: f32,
    /// From the edge's start to there: what is left of the light, and of the subpaths.
    before: [Vec3; 2],
    rate: Vec3,
    throughput: Vec3,
    sum: Pending,
    pdf: f32,
    cosine: f32,
    /// g at the edge's start.
    share: f32,
    /// Number of the light subpath in its iteration.
    pub path: u32,
    /// Index of the subpath's start, in [`Stored::starts`] or among those of all chunks.
    pub light: u32,
    /// Where its depths begin, in [`Stored::depths`] or among those of all chunks.
    first_depth: u32,
    /// What the light path expression needs of the vertices up to the edge's start.
    pub trail: u32,
    depths: u16,
    edges: u16,
    medium: u16,
    infinite: bool,
    /// Whether the edge's start was sampled by a specular lobe.
    pub specular: bool,
}

const _: () = assert!(size_of::<Beam>() <= 128);

impl Beam {
    /// The part `stretch` of the edge `flight` of the subpath `path`, which starts at the light `light`; the depths along it
    /// are `depths`.
    pub fn new(flight: &Flight, stretch: &Stretch, path: u32, light: u32, depths: Range<usize>) -> Self {
        Self {
            origin: stretch.origin.into(),
            dir: stretch.dir.into(),
            length: stretch.length,
            start: stretch.start,
            before: [stretch.before.transmittance.into(), stretch.before.survival.into()],
            rate: flight.rate.into(),
            throughput: flight.throughput.into(),
            sum: flight.sum,
            pdf: flight.pdf,
            cosine: flight.cosine,
            share: flight.share,
            path,
            light,
            first_depth: depths.start as u32,
            trail: flight.trail,
            depths: depths.len() as u16,
            edges: flight.length as u16,
            medium: narrow(stretch.index),
            infinite: flight.infinite,
            specular: flight.specular,
        }
    }

    /// The same beam, where starts and depths before those of its chunk are so many.
    pub(super) fn moved(&self, starts: u32, depths: u32) -> Self {
        Self { light: self.light + starts, first_depth: self.first_depth + depths, ..*self }
    }

    /// The place of its depths.
    #[inline]
    pub(super) fn depths(&self) -> Range<usize> {
        self.first_depth as usize..self.first_depth as usize + usize::from(self.depths)
    }

    /// Index of the medium.
    #[inline]
    pub fn medium(&self) -> u32 {
        self.medium.into()
    }

    /// Edges of the subpath before this one.
    #[inline]
    pub fn edges(&self) -> u32 {
        self.edges.into()
    }

    /// From the edge's start to where this part starts.
    #[inline]
    pub fn before(&self) -> Passage {
        Passage { transmittance: self.before[0].into(), survival: self.before[1].into() }
    }

    /// The edge's flight, without what only a walk asks of it: where it starts and in what.
    #[inline]
    pub fn flight(&self) -> Flight {
        Flight {
            ray: Ray::new(self.origin.into(), self.dir.into()),
            from: self.origin.into(),
            skipped: 0.0,
            inside: Inside::NOTHING,
            rate: Rgb::from(self.rate),
            throughput: Rgb::from(self.throughput),
            pdf: self.pdf,
            cosine: self.cosine,
            infinite: self.infinite,
            specular: self.specular,
            share: self.share,
            sum: self.sum,
            length: self.edges.into(),
            trail: self.trail,
        }
    }
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
    /// Vertices that can be connected.
    pub vertices: Vec<Vertex>,
    /// Where each subpath's vertices end.
    ends: Vec<u32>,
    /// Vertices that can be merged.
    pub photons: Vec<Photon>,
    /// Where each subpath's photons end.
    photon_ends: Vec<u32>,
    /// Beams through media.
    pub beams: Vec<Beam>,
    /// Depths along the beams, see [`Medium::depths_along`](crate::medium::Medium::depths_along).
    pub depths: Vec<f32>,
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
        self.photons.clear();
        self.photon_ends.clear();
        self.beams.clear();
        self.depths.clear();
        self.beam_ends.clear();
        self.starts.clear();
        self.splats.resize_with(bands, Vec::new);
        self.splats.iter_mut().for_each(Vec::clear);
    }

    /// A subpath is complete.
    pub fn end_path(&mut self) {
        self.ends.push(self.vertices.len() as u32);
        self.photon_ends.push(self.photons.len() as u32);
        self.beam_ends.push(self.beams.len() as u32);
    }

    /// The vertices of the chunk's subpath `index`.
    pub fn path(&self, index: usize) -> &[Vertex] {
        let begin = if index == 0 { 0 } else { self.ends[index - 1] as usize };
        &self.vertices[begin..self.ends[index] as usize]
    }

    /// The first photons, those of `paths` subpaths.
    pub(super) fn first_photons(&self, paths: usize) -> &[Photon] {
        &self.photons[..first(&self.photon_ends, paths)]
    }

    /// The first beams, those of `paths` subpaths.
    pub(super) fn first_beams(&self, paths: usize) -> &[Beam] {
        &self.beams[..first(&self.beam_ends, paths)]
    }
}

fn first(ends: &[u32], paths: usize) -> usize {
    match paths.min(ends.len()) {
        0 => 0,
        n => ends[n - 1] as usize,
    }
}
