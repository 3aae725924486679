//! Scenes of other programs: they render to what those make of them, and to the same pixels once written as scenes of ours;
//! and nothing in them makes a reader panic.

mod bits;
mod grids;
mod mutilated;
mod npz;
mod references;
mod refusals;

use std::path::{Path, PathBuf};
use tyndall::film::{Film, Image};
use tyndall::scene::Scene;
use tyndall::transport::merge::Radius;
use tyndall::transport::{Renderer, Settings, TechniqueSet};

/// Radii of merges, in footprints of a pixel: with them a kernel blurs less than what these tests see.
const FOOTPRINTS: f32 = 0.2;

/// A file beside these tests.
fn scene_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/import/scenes").join(name)
}

/// Where cases that are not in the repository may be.
fn shared() -> Option<PathBuf> {
    let folder = std::env::var_os("TYNDALL_SHARED").map_or_else(|| "../shared".into(), PathBuf::from);
    let cases = folder.join("cases");
    if !cases.is_dir() {
        println!("{} is not there: its cases are not looked at", cases.display());
        return None;
    }
    Some(cases)
}

/// A render by the techniques of a preset, of paths as long as the scene says.
fn render(scene: &Scene, preset: &str, seed: u64, iterations: u64) -> Image {
    let techniques = TechniqueSet::parse([preset]).expect("a known preset");
    let mut settings = Settings { seed, ..Settings::new(techniques) };
    for gather in &mut settings.merging.of {
        gather.radius = Radius::Footprint(FOOTPRINTS);
    }
    settings.max_length = scene.notes.defaults.max_length.unwrap_or(settings.max_length);
    let mut film = Film::new(&scene.camera, &settings);
    let mut renderer = Renderer::new(scene, settings).expect("settings that make sense");
    for i in 0..iterations {
        renderer.iteration(i, &mut film);
    }
    assert_eq!(film.dropped().total(), 0, "{}: samples that are not finite", scene.name);
    film.image()
}
