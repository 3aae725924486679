//! A scene and what `import` writes of it render to the same pixels.

use crate::{render, scene_path, shared};
use std::path::Path;
use tyndall::scene::file::{Overrides, from_import, load};
use tyndall::scene::import::{Format, export};

fn assert_same_bits(path: &Path, presets: &[&str]) {
    let format = Format::of(path).expect("a foreign format");
    let imported = format.read(path).unwrap_or_else(|e| panic!("{e}"));
    let small = Overrides { size: Some(glam::UVec2::new(48, 32)) };
    let direct = from_import(&imported, &small).unwrap_or_else(|e| panic!("{e}"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("a scene.toml");
    let written = export(&imported, &out).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(written.last(), Some(&out));
    let ours = load(&out, &small).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(ours.name, direct.name);
    for preset in presets {
        let (a, b) = (render(&direct, preset, 1, 2), render(&ours, preset, 1, 2));
        let bits = |image: &tyndall::film::Image| -> Vec<[u32; 3]> {
            image.pixels.iter().map(|p| p.map(f32::to_bits)).collect()
        };
        assert!(a.pixels.iter().flatten().any(|x| *x > 0.0), "{}: {preset} is black", path.display());
        assert_eq!(bits(&a), bits(&b), "{}: {preset}", path.display());
    }
}

#[test]
fn mitsuba_scenes_keep_their_bits() {
    for name in ["surfaces.xml", "media.xml", "grids.xml", "lights.xml", "sky.xml"] {
        assert_same_bits(&scene_path(name), &["pt", "bpt"]);
    }
}

#[test]
fn a_smallupbp_scene_keeps_its_bits() {
    assert_same_bits(&scene_path("goblet.obj"), &["pt", "upbp"]);
}

#[test]
fn a_gltf_scene_keeps_its_bits() {
    assert_same_bits(&scene_path("table.gltf"), &["pt", "bpt"]);
}

/// Scenes that others made, where they are.
#[test]
fn shared_scenes_keep_their_bits() {
    let Some(cases) = shared() else { return };
    assert_same_bits(&cases.join("stilllife/stilllife.obj"), &["bpt", "upbp"]);
    for name in ["surface_box", "fog_box", "index_matched_ball"] {
        assert_same_bits(&cases.join("mitsuba").join(format!("{name}.xml")), &["bpt", "upbp"]);
    }
}

/// The same scene as text and as a binary.
#[test]
fn a_glb_scene_is_the_gltf_scene() {
    let [text, binary] = ["table.gltf", "table.glb"].map(|name| {
        load(&scene_path(name), &Overrides { size: Some(glam::UVec2::new(24, 16)) })
            .unwrap_or_else(|e| panic!("{e}"))
    });
    assert_eq!(render(&text, "pt", 1, 2).pixels, render(&binary, "pt", 1, 2).pixels);
}
