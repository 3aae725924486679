//! The small scenes that the tests run in.

use glam::{UVec3, Vec3A};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use tyndall::film::Image;
use tyndall::film::exr::{self, LayeredImage};
use tyndall::math::{Stream, StreamKind};
use tyndall::medium::{Homogeneous, Medium, volume};
use tyndall::scene::file::source::Source;
use tyndall::scene::{Scene, Traits};
use tyndall::transport::Technique;

/// An environment of a smooth sky with a small bright sun in it, made here so that no binary is in the repository.
fn sky() -> Image {
    let (width, height) = (32, 16);
    let pixel = |x: usize, y: usize| {
        let up = 1.0 - y as f32 / height as f32;
        let sun = if (10..12).contains(&x) && (3..5).contains(&y) { 20.0 } else { 0.0 };
        [0.2 + 0.3 * up + sun, 0.3 + 0.3 * up + 0.8 * sun, 0.3 + 0.6 * up + 0.5 * sun]
    };
    let pixels = (0..width * height).map(|i| pixel(i % width, i / width)).collect();
    Image { width, height, pixels }
}

/// A folder with the scene files and the images that they name.
static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes");
    for entry in std::fs::read_dir(source).expect("tests/scenes is there") {
        let path = entry.expect("it can be listed").path();
        std::fs::copy(&path, folder.path().join(path.file_name().expect("a file")))
            .expect("it can be copied");
    }
    let sky = LayeredImage::new(sky());
    exr::write(folder.path().join("sky.exr"), &sky).expect("it can be written");
    let write = |name: &str, size: UVec3, channels: usize, box_: (f32, f32)| {
        let from_unit = volume::cube(Vec3A::splat(box_.0), Vec3A::splat(box_.1));
        let grid =
            volume::Volume { size, channels, numbers: noise(size, channels), from_unit: Some(from_unit) };
        std::fs::write(folder.path().join(name), volume::own::encode(&grid)).expect("it can be written");
    };
    write("colours.grid", UVec3::new(4, 3, 5), 3, (-0.5, 0.5));
    write("density.grid", UVec3::new(9, 7, 8), 1, (-0.6, 0.6));
    folder
});

/// Numbers from 0 to 1, some of them 0.
fn noise(size: UVec3, channels: usize) -> Vec<f32> {
    let mut random = Stream::new(3, 0, StreamKind::Other, channels as u64);
    let count = size.element_product() as usize * channels;
    (0..count).map(|_| (1.2 * random.next_1d() - 0.2).max(0.0)).collect()
}

/// Path of a test scene's file.
fn path(name: &str) -> PathBuf {
    FOLDER.path().join(name).with_extension("toml")
}

/// The text of a test scene's file.
pub fn text(name: &str) -> String {
    std::fs::read_to_string(path(name)).expect("a test scene")
}

/// A test scene.
pub fn load(name: &str) -> Scene {
    load_with(name, "\0", "")
}

/// A test scene in whose file a text is replaced by another.
pub fn load_with(name: &str, old: &str, new: &str) -> Scene {
    let path = path(name);
    let text = text(name).replace(old, new);
    match tyndall::scene::file::from_source(&Source::from_text(path, text), &Default::default()) {
        Ok(scene) => scene,
        Err(error) => panic!("{error}"),
    }
}

/// A scene of a text in the form of a scene file.
pub fn of(text: &str) -> Scene {
    match tyndall::scene::file::from_source(&Source::from_text(path("inline"), text), &Default::default()) {
        Ok(scene) => scene,
        Err(error) => panic!("{error}\n{text}"),
    }
}

/// The scene with another medium in the place of its first.
pub fn refilled(mut scene: Scene, medium: Homogeneous) -> Scene {
    scene.media[0] = Medium::Homogeneous(medium);
    scene.traits = Traits::of(&scene.media);
    scene
}

/// Those in which every technique makes paths and hardly an edge is too short for the oracle.
pub fn all() -> impl Iterator<Item = (&'static str, Scene)> {
    ["surfaces", "glass", "lights", "environment", "furnace", "fog", "balls", "drink", "furnace_fog"]
        .into_iter()
        .map(|name| (name, load(name)))
        .chain([("fog from the near plane", load_with("fog", "fov = 50", "fov = 50\nnear = 1.2"))])
}

/// Techniques that can make no path in a scene.
pub fn without(_name: &str) -> &'static [Technique] {
    &[]
}
