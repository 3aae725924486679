//! What is written about tyndall, against tyndall.
//!
//! After a change of what scene and experiment files may hold: `TYNDALL_BLESS=1 cargo test --test documents` writes the
//! pages about them again.

mod keys;

use std::path::Path;
use tyndall::experiment::plan;
use tyndall::scene::file::{Overrides, load};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn read(file: &str) -> String {
    std::fs::read_to_string(Path::new(ROOT).join(file)).expect("a file of the project")
}

/// The blocks of TOML in a text.
fn blocks(text: &str) -> Vec<&str> {
    text.split("```toml\n").skip(1).map(|rest| rest.split("```").next().expect("an end")).collect()
}

fn load_text(scene: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene).expect("a file");
    let scene = load(&path, &Overrides::default()).unwrap_or_else(|e| panic!("{e}"));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

fn plan_of(experiment: &str) -> plan::Plan {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("experiment.toml");
    let scenes = Path::new(ROOT).join("scenes");
    std::fs::write(&path, experiment.replace("../scenes", scenes.to_str().expect("a path in UTF-8")))
        .expect("a file");
    plan::read(&path, &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// What the README shows can be run: its scene and its experiment are read as they stand there, and what it names is there.
#[test]
fn the_readme_shows_what_can_be_read() {
    let readme = read("README.md");
    let [scene, experiment] = blocks(&readme)[..] else { panic!("a scene and an experiment") };
    load_text(scene);
    assert_eq!(plan_of(experiment).estimators.len(), 3);
    for name in readme.split('`').filter(|word| word.ends_with(".toml") && !word.contains([' ', '/'])) {
        assert!(Path::new(ROOT).join("experiments").join(name).is_file(), "there is no experiment {name}");
    }
    for link in readme.split("](").skip(1).map(|rest| rest.split(')').next().expect("an end")) {
        assert!(Path::new(ROOT).join(link).is_file(), "there is no {link}");
    }
}

#[test]
fn the_pages_about_files_show_what_can_be_read() {
    let (scenes, experiments) = (read("scenes/README.md"), read("experiments/README.md"));
    let [scene] = blocks(&scenes)[..] else { panic!("a scene") };
    load_text(scene);
    let [experiment] = blocks(&experiments)[..] else { panic!("an experiment") };
    assert_eq!(plan_of(experiment).estimators.len(), 2);
}
