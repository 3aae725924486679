//! Names the code that decides what is rendered by a hash of it, `TYNDALL_RENDERING`: references that another code made
//! are not taken for its own.

use std::path::{Path, PathBuf};

/// What decides the pixels of a render, beside the scene and the settings.
const CODE: [&str; 14] = [
    "Cargo.lock",
    "src/bsdf",
    "src/camera",
    "src/film/accumulator.rs",
    "src/film/layout.rs",
    "src/film/state.rs",
    "src/geometry",
    "src/light",
    "src/math",
    "src/medium",
    "src/render/job.rs",
    "src/scene",
    "src/texture",
    "src/transport",
];

fn main() {
    let mut files = Vec::new();
    for path in CODE {
        println!("cargo::rerun-if-changed={path}");
        gather(Path::new(path), &mut files);
    }
    // In an order that no file system decides.
    files.sort();
    let mut hash = 0xcbf2_9ce4_8422_2325;
    for path in files {
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        // Comments and blank lines make no pixels.
        let lines = text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with("//"));
        for line in std::iter::once(path.to_string_lossy().replace('\\', "/").as_str()).chain(lines) {
            hash = fnv(hash, line);
        }
    }
    println!("cargo::rustc-env=TYNDALL_RENDERING={hash:016x}");
}

/// The Rust files under a path, or the file itself.
fn gather(path: &Path, files: &mut Vec<PathBuf>) {
    if path.is_dir() {
        let entries = std::fs::read_dir(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        for entry in entries {
            gather(&entry.expect("a listing that goes on").path(), files);
        }
    } else if path.extension().is_some_and(|e| e == "rs" || e == "lock") {
        files.push(path.to_owned());
    }
}

/// FNV-1a of 64 bits, fed with a line and its end.
fn fnv(hash: u64, line: &str) -> u64 {
    line.bytes().chain([b'\n']).fold(hash, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3))
}
