//! Whole paths with what the renderer said of them.

use crate::oracle::{FullPath, MadeBy};
use glam::{UVec2, Vec3A};
use tyndall::film::Sample;
use tyndall::light::LightPoint;
use tyndall::scene::Collision;
use tyndall::scene::Scene;
use tyndall::transport::camera_path::Partners;
use tyndall::transport::merge::{Gathers, MERGES};
use tyndall::transport::merge::{Photons, Stored};
use tyndall::transport::pass::Pass;
use tyndall::transport::sink::{Joint, Sink, Start};
use tyndall::transport::walk::{Place, Vertex};
use tyndall::transport::{Settings, Technique, camera_path, light_path};

/// A sample of the renderer and the whole path that it stands for.
#[derive(Clone, Debug)]
pub struct Traced {
    pub path: FullPath,
    pub sample: Sample,
}

/// Keeps everything.
#[derive(Default)]
struct Recorder {
    start: Option<Start>,
    vertices: Vec<Vertex>,
    samples: Vec<(Sample, Joint)>,
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

/// Collisions are connected in part, a different one in each medium.
pub fn shares(scene: &Scene) -> Vec<f32> {
    (0..scene.media.len()).map(|m| 0.8 / (m + 1) as f32).collect()
}

/// The constants of an iteration in which nothing merges.
pub fn pass(scene: &Scene, settings: &Settings, iteration: u64) -> Pass {
    let size = scene.camera.size();
    Pass::new(*settings, iteration, Gathers::default(), u64::from(size.x * size.y), shares(scene))
}

/// Traces light subpath and camera subpath of one pixel and gives every sample with its whole path.
pub fn trace_pixel(scene: &Scene, settings: &Settings, iteration: u64, pixel: UVec2) -> Vec<Traced> {
    let pass = pass(scene, settings, iteration);
    let mut light = Recorder::default();
    let mut camera = Recorder::default();
    let mut store = Stored::default();
    let index = u64::from(pixel.y * scene.camera.size().x + pixel.x);
    if settings.needs_light_paths() {
        light_path::trace(scene, &pass, index, &mut store, &mut light);
    }
    if settings.needs_camera_paths() {
        let partners = Partners { vertices: &store.vertices, photons: None };
        camera_path::trace(scene, &pass, pixel, partners, &mut camera);
    }
    let samples = light.samples.iter().chain(&camera.samples);
    let weighed = samples.filter(|(_, joint)| !matches!(joint, Joint::Glow));
    weighed.map(|(sample, joint)| whole_path(scene, &light, &camera, sample, joint)).collect()
}

/// Traces the light subpaths that merges use and the camera subpaths of `pixels`, and gives every sample of the latter
/// with its whole path.
pub fn trace_merges(scene: &Scene, pass: &Pass, pixels: &[UVec2]) -> Vec<Traced> {
    let mut store = Stored::default();
    let count = pass.merged_paths().max(pass.partners);
    let lights: Vec<Recorder> = (0..count)
        .map(|index| {
            let mut light = Recorder::default();
            light_path::trace(scene, pass, index, &mut store, &mut light);
            store.end_path();
            light
        })
        .collect();
    let chunks = [store];
    let photons = Photons::build(scene, pass, &chunks);
    let mut traced = Vec::new();
    for pixel in pixels {
        let partner = (pixel.y * scene.camera.size().x + pixel.x) as usize;
        let vertices = if pass.on(Technique::Connect) { chunks[0].path(partner) } else { &[] };
        let mut camera = Recorder::default();
        camera_path::trace(scene, pass, *pixel, Partners { vertices, photons: Some(&photons) }, &mut camera);
        for (sample, joint) in camera.samples.iter().filter(|(_, joint)| !matches!(joint, Joint::Glow)) {
            let light = match joint {
                Joint::Merge(meeting) => &lights[meeting.path as usize],
                _ => &lights[partner],
            };
            traced.push(whole_path(scene, light, &camera, sample, joint));
        }
    }
    traced
}

/// A collision at `p`, where the scene says what medium is there.
fn collision(scene: &Scene, p: Vec3A) -> Place {
    let medium = scene.solids.medium(&scene.solids.at(&scene.geometry, p));
    Place::Medium(Collision { p, coefficients: scene.media[medium as usize].coefficients(p), medium })
}

fn light_start(recorder: &Recorder) -> LightPoint {
    match recorder.start {
        Some(Start::Light(light)) => light,
        _ => panic!("a light subpath starts on a light"),
    }
}

fn whole_path(scene: &Scene, light: &Recorder, camera: &Recorder, sample: &Sample, joint: &Joint) -> Traced {
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
        let light_place =
            if point_of_light { light.vertices[s - 1].place } else { collision(scene, meeting.light) };
        let camera_place =
            if point_of_camera { camera.vertices[t - 2].place } else { collision(scene, meeting.camera) };
        interior = light.vertices[..s - 1].iter().map(|v| v.place).collect();
        interior.push(camera_place);
        interior.extend(camera.vertices[..t - 2].iter().rev().map(|v| v.place));
        merged = Some((s, light_place));
    }
    Traced { path: FullPath { light: x0, interior, lens, merged }, sample: *sample }
}
