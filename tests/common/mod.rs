//! A folder with a small scene in it, and the program run there.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// A box with a lamp, a diffuse floor and a glass ball: every technique has something to do.
const SCENE: &str = r#"
name = "Small"

[film]
width = 24
height = 16

[camera]
origin = [0, 0.4, 3]
target = [0, 0, 0]
fov = 50

[render]
max_length = 6

[material.white]
diffuse = { reflectance = 0.7 }
[material.glass]
dielectric = { ior = 1.5 }

[[shape]]
rectangle = { corner = [-2, -0.5, 2], u = [4, 0, 0], v = [0, 0, -4] }
material = "white"

[[shape]]
rectangle = { corner = [-2, -0.5, -2], u = [4, 0, 0], v = [0, 3, 0] }
material = "white"

[[shape]]
sphere = { center = [0, 0, 0], radius = 0.4 }
material = "glass"

[[shape]]
rectangle = { corner = [-0.5, 2, -0.5], u = [1, 0, 0], v = [0, 0, 1] }
emission = 5
"#;

/// An experiment in that scene.
pub const EXPERIMENT: &str = r#"
title = "A small experiment"
budget = { spp = 4 }
runs = 3
metrics = ["relmse", "mse", "flip"]

[reference]
preset = "bpt"
spp = 24

[[scene]]
file = "small"
exposure = 0.5
crops = [{ name = "ball", x = 8, y = 4, width = 8, height = 8 }]

[[estimator]]
preset = "pt"

[[estimator]]
name = "all"
techniques = ["hit", "nee", "connect", "lens"]
heuristic = "power"
layers = "families"
"#;

/// A folder of its own for a test.
pub struct Bench {
    dir: TempDir,
}

impl Bench {
    /// With `small/scene.toml` and `experiment.toml`.
    pub fn new() -> Self {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let bench = Self { dir };
        std::fs::create_dir(bench.path("small")).expect("a folder");
        bench.write("small/scene.toml", SCENE);
        bench.write("experiment.toml", EXPERIMENT);
        bench
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Writes a file.
    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("a file");
    }

    /// The program with these arguments, to be run in the folder.
    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tyndall"));
        command.current_dir(self.dir.path()).args(line.split_whitespace());
        command
    }

    /// Runs the program.
    pub fn run(&self, line: &str) -> Output {
        self.command(line).output().expect("the program starts")
    }

    /// Runs the program, which has to succeed; what it says on the standard output and error.
    #[track_caller]
    pub fn succeed(&self, line: &str) -> (String, String) {
        let output = self.run(line);
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let (out, err) = (text(&output.stdout), text(&output.stderr));
        assert!(output.status.success(), "tyndall {line}: {:?}\n{out}{err}", output.status);
        (out, err)
    }

    /// Runs the program, which has to refuse with exit code 2, one message with all of `parts` on the standard
    /// error, and nothing on the standard output.
    #[track_caller]
    pub fn refuse(&self, line: &str, parts: &[&str]) {
        let before = self.files();
        let output = self.run(line);
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "tyndall {line}: {err}");
        assert!(output.stdout.is_empty(), "tyndall {line}");
        assert_eq!(err.matches("error:").count(), 1, "tyndall {line}: {err}");
        for part in parts {
            assert!(err.contains(part), "tyndall {line}: '{part}' is not in: {err}");
        }
        assert_eq!(self.files(), before, "tyndall {line}: no file is left behind");
    }

    /// All files in the folder, sorted.
    pub fn files(&self) -> Vec<PathBuf> {
        let mut found = Vec::new();
        collect(self.dir.path(), &mut found);
        found.sort();
        found
    }
}

fn collect(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).expect("a folder").flatten() {
        if entry.path().is_dir() {
            collect(&entry.path(), found);
        } else {
            found.push(entry.path());
        }
    }
}
