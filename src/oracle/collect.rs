//! Whole paths with what the renderer said of them.

use super::{FullPath, MadeBy};
use crate::film::Sample;
use crate::light::LightPoint;
use crate::scene::{Collision, Scene};
use crate::transport::light_path;
use crate::transport::merge::{MERGES, Stored};
use crate::transport::pass::Pass;
use crate::transport::sink::{Joint, Sink, Start};
use crate::transport::walk::{Place, Vertex};
use glam::Vec3A;

/// A sample of the renderer and the whole path that it stands for.
#[derive(Clone, Debug)]
pub struct Traced {
    /// The path.
    pub path: FullPath,
    /// The sample.
    pub sample: Sample,
}

/// Keeps everything that a subpath tells.
#[derive(Debug, Default)]
pub struct Recorder {
    /// Where the subpath starts.
    pub start: Option<Start>,
    /// Its vertices, in order.
    pub vertices: Vec<Vertex>,
    /// What techniques made of it.
    pub samples: Vec<(Sample, Joint)>,
}

impl Recorder {
    /// Of a light subpath, walked again: its random numbers are a function of iteration and number.
    pub fn of_light(scene: &Scene, pass: &Pass, path: u64) -> Self {
        let mut recorder = Self::default();
        light_path::trace(scene, pass, path, &mut Stored::default(), &mut recorder);
        recorder
    }
}

impl Sink for Recorder {
    fn record(&mut self, sample: &Sample, joint: &Joint) {
        self.samples.push((*sample, *joint));
    }
    fn start(&mut self, start: &Start) {
        self.start = Some(*start);
    }
    fn vertex(&mut self, vertex: &Vertex) {
        self.vertices.push(*vertex);
    }
}

impl Traced {
    /// The technique that made the path.
    pub fn made_by(&self) -> MadeBy {
        match &self.path.merged {
            Some((i, _)) => MadeBy::Merge(self.sample.technique, *i),
            None => MadeBy::Connection(self.sample.s as usize),
        }
    }
}

/// A collision at `p`, where the scene says what medium is there, with the coefficients at `of`; `None` where there is none.
fn collision(scene: &Scene, p: Vec3A, of: Vec3A) -> Option<Place> {
    let medium = scene.solids.medium(&scene.solids.at(&scene.geometry, p));
    let coefficients = scene.media.get(medium as usize)?.coefficients(of);
    Some(Place::Medium(Collision { p, coefficients, medium }))
}

fn light_start(recorder: &Recorder) -> LightPoint {
    match recorder.start {
        Some(Start::Light(light)) => light,
        _ => panic!("a light subpath starts on a light"),
    }
}

/// The whole path that a sample stands for, from the light and the camera subpath that made it. `None` where a merge along a beam
/// lies on a wall, so that by rounding no medium is there.
///
/// # Panics
/// Where they did not make it, or where a medium's glow did.
pub fn whole_path(
    scene: &Scene,
    light: &Recorder,
    camera: &Recorder,
    sample: &Sample,
    joint: &Joint,
) -> Option<Traced> {
    let (s, t) = (sample.s as usize, sample.t as usize);
    let x0 = match joint {
        Joint::Hit(point) | Joint::NextEvent(point) => *point,
        Joint::Connect(_) | Joint::Lens(..) | Joint::Merge(_) => light_start(light),
        Joint::Glow => panic!("no one weighs what shines in a medium"),
    };
    let lens = match (joint, camera.start) {
        (Joint::Lens(lens, _), _) => *lens,
        (_, Some(Start::Lens(lens))) => lens,
        _ => panic!("a camera subpath starts on the lens"),
    };
    // Interior vertices: s - 1 from the light subpath (x_0 is its start), the rest from the camera subpath.
    // With s = 0 the camera subpath's last vertex is x_0 itself.
    let from_light = s.saturating_sub(1);
    let from_camera = match joint {
        // x_i comes further below.
        Joint::Merge(_) => 0,
        _ if s == 0 => t - 2,
        _ => t - 1,
    };
    let mut interior: Vec<_> = light.vertices[..from_light].iter().map(|v| v.place).collect();
    interior.extend(camera.vertices[..from_camera].iter().rev().map(|v| v.place));
    let mut merged = None;
    if let Joint::Merge(meeting) = joint {
        // s light vertices come before x_i, which both subpaths have, or none where a beam passes it.
        let kind = MERGES.iter().position(|t| *t == sample.technique).expect("a merge");
        let (point_of_light, point_of_camera) = (kind < 3, kind < 2 || kind == 3);
        let light_place = if point_of_light {
            light.vertices[s - 1].place
        } else {
            collision(scene, meeting.light, meeting.camera)?
        };
        // See `transport::merge`: the coefficients are those of the point, where one of them is one.
        let of = if point_of_light { meeting.light } else { meeting.camera };
        let camera_place = if point_of_camera {
            camera.vertices[t - 2].place
        } else {
            collision(scene, meeting.camera, of)?
        };
        interior = light.vertices[..s - 1].iter().map(|v| v.place).collect();
        interior.push(camera_place);
        interior.extend(camera.vertices[..t - 2].iter().rev().map(|v| v.place));
        merged = Some((s, light_place));
    }
    Some(Traced { path: FullPath { light: x0, interior, lens, merged }, sample: *sample })
}
