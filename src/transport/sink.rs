//! Where samples go: the film in a render, a list in tests and explanations.

use super::walk::Vertex;
use crate::film::Sample;
use crate::light::LightPoint;
use glam::{UVec2, Vec3A};

/// How the two subpaths of a sample meet.
#[derive(Clone, Copy, Debug)]
pub enum Joint {
    /// The camera subpath found this point of a light.
    Hit(LightPoint),
    /// The camera subpath's last ray ran through media that shine.
    Glow,
    /// This point of a light was sampled for next-event estimation.
    NextEvent(LightPoint),
    /// A light vertex, by its number among those stored of its subpath, was connected.
    Connect(usize),
    /// The subpaths were merged.
    Merge(Meeting),
    /// The light subpath was connected to this point of the lens and falls on this pixel of the full frame.
    Lens(Vec3A, UVec2),
}

/// Where a light and a camera subpath are taken for joined.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// Number of the light subpath in its iteration.
    pub path: u32,
    /// x_i on the light subpath.
    pub light: Vec3A,
    /// x_i on the camera subpath.
    pub camera: Vec3A,
}

/// Where a subpath starts.
#[derive(Clone, Copy, Debug)]
pub enum Start {
    /// On a light.
    Light(LightPoint),
    /// On the lens.
    Lens(Vec3A),
}

/// Takes what the techniques make. The default methods cost nothing in a render.
pub trait Sink {
    /// A sample with the joint that made it.
    fn record(&mut self, sample: &Sample, joint: &Joint);
    /// A subpath starts.
    #[inline]
    fn start(&mut self, _start: &Start) {}
    /// The subpath reached a vertex, specular or not.
    #[inline]
    fn vertex(&mut self, _vertex: &Vertex) {}
}
