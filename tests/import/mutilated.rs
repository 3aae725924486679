//! Mutations of valid files are read or refused; nothing panics.

use crate::scene_path;
use proptest::prelude::*;
use std::path::Path;
use tyndall::scene::file::{Overrides, from_import};
use tyndall::scene::import::Format;

/// What is done to a file: bytes replaced, cut out, doubled, or swapped for pieces that parsers trip over.
#[derive(Clone, Debug)]
enum Cut {
    Byte(usize, u8),
    Remove(usize, usize),
    Double(usize, usize),
    Insert(usize, &'static str),
    End(usize),
}

const PIECES: [&str; 16] = [
    "-1",
    "0",
    "1e39",
    "nan",
    "99999999999999999999",
    "\"",
    "<",
    "/>",
    "$",
    "{",
    "}",
    "[",
    "]",
    "\n",
    "/",
    "\u{fffd}",
];

fn cut() -> impl Strategy<Value = Cut> {
    prop_oneof![
        (any::<usize>(), any::<u8>()).prop_map(|(at, b)| Cut::Byte(at, b)),
        (any::<usize>(), 1..40usize).prop_map(|(at, n)| Cut::Remove(at, n)),
        (any::<usize>(), 1..200usize).prop_map(|(at, n)| Cut::Double(at, n)),
        (any::<usize>(), 0..PIECES.len()).prop_map(|(at, i)| Cut::Insert(at, PIECES[i])),
        any::<usize>().prop_map(Cut::End),
    ]
}

fn mutilate(mut bytes: Vec<u8>, cuts: &[Cut]) -> Vec<u8> {
    for cut in cuts {
        if bytes.is_empty() {
            break;
        }
        let len = bytes.len();
        match *cut {
            Cut::Byte(at, b) => bytes[at % len] = b,
            Cut::Remove(at, n) => drop(bytes.drain(at % len..(at % len + n).min(len))),
            Cut::Double(at, n) => {
                let piece = bytes[at % len..(at % len + n).min(len)].to_vec();
                drop(bytes.splice(at % len..at % len, piece));
            }
            Cut::Insert(at, text) => drop(bytes.splice(at % len..at % len, text.bytes())),
            Cut::End(at) => bytes.truncate(at % len),
        }
    }
    bytes
}

/// Reads the file `name` of a folder, one file of which is mutilated.
fn survives(folder: &Path, name: &str, mutilated: &str, original: &[u8], cuts: &[Cut]) {
    std::fs::write(folder.join(mutilated), mutilate(original.to_vec(), cuts)).expect("a file");
    let path = folder.join(name);
    let format = Format::of(&path).expect("a foreign format");
    if let Ok(imported) = format.read(&path) {
        // A picture of a billion pixels is a valid request, but not one to make here.
        let _ = from_import(&imported, &Overrides { size: Some(glam::UVec2::splat(8)) });
    }
}

/// A temporary copy of the files of the scenes.
fn copy(names: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in names {
        let to = folder.path().join(name);
        std::fs::create_dir_all(to.parent().expect("a folder")).expect("a folder");
        std::fs::copy(scene_path(name), to).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
    folder
}

fn runs(cases: u32) -> ProptestConfig {
    // TYNDALL_STUDY=1 runs a hundred times as many.
    let study = std::env::var_os("TYNDALL_STUDY").is_some();
    ProptestConfig {
        cases: if study { 100 * cases } else { cases },
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

fn fuzz(names: &[&str], name: &str, mutilated: &str, cases: u32) {
    let folder = copy(names);
    let original = std::fs::read(scene_path(mutilated)).expect("a file");
    let mut runner = proptest::test_runner::TestRunner::new_with_rng(
        runs(cases),
        proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
    );
    let cuts = proptest::collection::vec(cut(), 1..6);
    let result = runner.run(&cuts, |cuts| {
        survives(folder.path(), name, mutilated, &original, &cuts);
        Ok(())
    });
    result.unwrap_or_else(|e| panic!("{mutilated}: {e}"));
}

#[test]
fn mutilated_mitsuba_never_panics() {
    let files = ["lights.xml", "picture.png", "octahedron.ply", "media.xml"];
    fuzz(&files, "lights.xml", "lights.xml", 400);
    fuzz(&files, "media.xml", "media.xml", 400);
}

#[test]
fn mutilated_grids_of_mitsuba_never_panic() {
    let files = ["grids.xml", "density.vol", "extinction.vol", "albedo.vol", "share.vol"];
    for name in ["grids.xml", "density.vol", "albedo.vol", "share.vol"] {
        fuzz(&files, "grids.xml", name, 400);
    }
}

#[test]
fn mutilated_smallupbp_never_panics() {
    let files = ["goblet.obj", "goblet.mtl", "goblet.obj.aux", "sky.exr"];
    fuzz(&files, "goblet.obj", "goblet.obj", 300);
    fuzz(&files, "goblet.obj", "goblet.mtl", 300);
    fuzz(&files, "goblet.obj", "goblet.obj.aux", 400);
}

#[test]
fn mutilated_gltf_never_panics() {
    fuzz(&["table.gltf"], "table.gltf", "table.gltf", 500);
    fuzz(&["table.glb"], "table.glb", "table.glb", 500);
}
