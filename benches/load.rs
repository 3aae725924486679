//! A large OBJ: time to read the file, to parse it word by word on one thread and keep nothing but numbers, to have its
//! mesh, to have a tree of it, and to see that it is open; and the most memory that was held.
//!
//!     cargo bench --bench load
//!
//! TYNDALL_FACES is the number of faces, default 7 million, of a bumpy square with normals and texture coordinates.

use std::io::Write;
use std::time::Instant;
use tyndall::geometry::{Geometry, ShapeDesc, ShapeStats, TriangleMesh};

fn main() {
    let faces: usize = std::env::var("TYNDALL_FACES").ok().and_then(|n| n.parse().ok()).unwrap_or(7_000_000);
    let side = ((faces / 2) as f64).sqrt().ceil() as usize;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("large.obj");
    write(&path, side).expect("room for a large file");
    let size = std::fs::metadata(&path).expect("the file").len();
    for _ in 0..3 {
        let start = Instant::now();
        let bytes = std::fs::read(&path).expect("the file");
        let read = start.elapsed().as_secs_f64();
        // Looked at, byte by byte, as the least that any parser does.
        let lines = bytes.iter().filter(|b| **b == b'\n').count();
        let seen = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let numbers = plainly(std::str::from_utf8(&bytes).expect("text"));
        let naive = start.elapsed().as_secs_f64();
        drop(bytes);
        let start = Instant::now();
        let mesh = TriangleMesh::load(&path).expect("a mesh");
        let loaded = start.elapsed().as_secs_f64();
        let faces = mesh.indices().len();
        let start = Instant::now();
        let shape = ShapeDesc::Mesh(mesh);
        assert!(!ShapeStats::of(&shape).closed);
        let stats = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let _geometry = Geometry::build(vec![shape]);
        let built = start.elapsed().as_secs_f64();
        println!(
            "{faces} faces, {:.0} MB, {lines} lines: read {read:.2} s, bytes seen {seen:.2} s, {numbers} numbers \
             word by word {naive:.2} s, mesh {loaded:.2} s, whether it is closed {stats:.2} s, tree {built:.2} s; {}",
            size as f64 / 1e6,
            peak()
        );
    }
}

/// What a parser does that takes no pains: how many numbers there are.
fn plainly(text: &str) -> usize {
    let (mut floats, mut integers) = (Vec::<f32>::new(), Vec::<u32>::new());
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("f") => {
                integers.extend(words.flat_map(|w| w.split('/')).filter_map(|w| w.parse::<u32>().ok()))
            }
            Some(_) => floats.extend(words.filter_map(|w| w.parse::<f32>().ok())),
            None => {}
        }
    }
    floats.len() + integers.len()
}

/// The most memory that the process has held, as Linux says it.
fn peak() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or("peak unknown").to_owned()
}

fn write(path: &std::path::Path, side: usize) -> std::io::Result<()> {
    let mut out = std::io::BufWriter::new(std::fs::File::create(path)?);
    for i in 0..=side {
        for j in 0..=side {
            let (x, y) = (i as f64 / side as f64, j as f64 / side as f64);
            let (p, q) = ((40.0 * x).sin(), (40.0 * y).cos());
            writeln!(
                out,
                "v {x:.6} {:.6} {y:.6}\nvt {x:.5} {y:.5}\nvn {:.5} 1.00000 {:.5}",
                0.01 * p * q,
                -0.4 * q,
                0.4 * p
            )?;
        }
    }
    let at = |i: usize, j: usize| i * (side + 1) + j + 1;
    for i in 0..side {
        for j in 0..side {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            writeln!(out, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}\nf {a}/{a}/{a} {c}/{c}/{c} {d}/{d}/{d}")?;
        }
    }
    out.flush()
}
