//! Whole paths with what the renderer said of them.

use glam::UVec2;
use std::sync::Arc;
use tyndall::math::Discrete;
pub use tyndall::oracle::collect::{Recorder, Traced, whole_path};
use tyndall::scene::Scene;
use tyndall::transport::camera_path::Partners;
use tyndall::transport::merge::Gathers;
use tyndall::transport::merge::{Photons, Stored};
use tyndall::transport::pass::Pass;
use tyndall::transport::sink::Joint;
use tyndall::transport::thinning::Thinning;
use tyndall::transport::{Settings, Technique, camera_path, light_path};

/// Collisions are connected in part, a different one in each medium, and camera subpaths end at some of them.
pub fn thinning(scene: &Scene) -> Thinning {
    let shares = (0..scene.media.len()).map(|m| 0.8 / (m + 1) as f32).collect();
    let continuations = (0..scene.media.len()).map(|m| 0.4 + 0.3 * (m % 2) as f32).collect();
    Thinning { shares, continuations, only_hit: false }
}

/// Light subpaths start on lights neither by their powers nor evenly.
pub fn starts(scene: &Scene) -> Arc<Discrete> {
    let by_power = scene.lights.by_power();
    let share = |i: usize| f64::from(by_power.pdf(i)).sqrt() * (i + 1) as f64;
    Arc::new(Discrete::new((0..by_power.len()).map(share)).expect("a light has power"))
}

/// The constants of an iteration in which nothing merges. Camera subpaths go on there, or lights would be hit too rarely.
pub fn pass(scene: &Scene, settings: &Settings, iteration: u64) -> Pass {
    let size = scene.camera.size();
    // With lights that are seen directly left to camera subpaths in every other one.
    let only_hit = iteration % 2 == 1 && settings.techniques.has(Technique::Hit);
    let thinning = Thinning { continuations: Vec::new(), only_hit, ..thinning(scene) };
    Pass::new(*settings, iteration, Gathers::default(), u64::from(size.x * size.y), thinning, starts(scene))
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
    weighed
        .map(|(sample, joint)| whole_path(scene, &light, &camera, sample, joint).expect("a path"))
        .collect()
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
            traced.push(whole_path(scene, light, &camera, sample, joint).expect("a path"));
        }
    }
    traced
}

/// The same of all pixels, for an iteration of `settings` that merges by `gathers`.
pub fn trace_all_merges(scene: &Scene, settings: Settings, iteration: u64, gathers: Gathers) -> Vec<Traced> {
    let size = scene.camera.size();
    let pixels: Vec<UVec2> = (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y))).collect();
    let pass = Pass::new(settings, iteration, gathers, pixels.len() as u64, thinning(scene), starts(scene));
    trace_merges(scene, &pass, &pixels)
}
