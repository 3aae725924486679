//! Whole paths with what the renderer said of them.

use crate::oracle::FullPath;
use glam::UVec2;
use tyndall::film::Sample;
use tyndall::light::LightPoint;
use tyndall::scene::Scene;
use tyndall::transport::sink::{Joint, Sink, Start};
use tyndall::transport::walk::Vertex;
use tyndall::transport::{Settings, camera_path, light_path};

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

/// Traces light subpath and camera subpath of one pixel and gives every sample with its whole path.
pub fn trace_pixel(scene: &Scene, settings: &Settings, iteration: u64, pixel: UVec2) -> Vec<Traced> {
    let mut light = Recorder::default();
    let mut camera = Recorder::default();
    let mut store = Vec::new();
    let index = u64::from(pixel.y * scene.camera.size().x + pixel.x);
    if settings.needs_light_paths() {
        light_path::trace(scene, settings, iteration, index, &mut store, &mut light);
    }
    if settings.needs_camera_paths() {
        camera_path::trace(scene, settings, iteration, pixel, &store, &mut camera);
    }
    let samples = light.samples.iter().chain(&camera.samples);
    let weighed = samples.filter(|(_, joint)| !matches!(joint, Joint::Glow));
    weighed.map(|(sample, joint)| whole_path(&light, &camera, sample, joint)).collect()
}

fn light_start(recorder: &Recorder) -> LightPoint {
    match recorder.start {
        Some(Start::Light(light)) => light,
        _ => panic!("a light subpath starts on a light"),
    }
}

fn whole_path(light: &Recorder, camera: &Recorder, sample: &Sample, joint: &Joint) -> Traced {
    let (s, t) = (sample.s as usize, sample.t as usize);
    let x0 = match joint {
        Joint::Hit(point) | Joint::NextEvent(point) => *point,
        Joint::Connect(_) | Joint::Lens(..) => light_start(light),
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
    let from_camera = if s == 0 { t - 2 } else { t - 1 };
    let mut interior: Vec<_> = light.vertices[..from_light].iter().map(|v| v.place).collect();
    interior.extend(camera.vertices[..from_camera].iter().rev().map(|v| v.place));
    Traced { path: FullPath { light: x0, interior, lens }, sample: *sample }
}
