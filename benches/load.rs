//! A large OBJ: time to read the file, and to have its mesh.
//!
//!     cargo bench --bench load
//!
//! TYNDALL_FACES is the number of faces, default 7 million, of a bumpy square with normals and texture coordinates.

use std::io::Write;
use std::time::Instant;
use tyndall::geometry::TriangleMesh;

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
        drop(bytes);
        let start = Instant::now();
        let mesh = TriangleMesh::load(&path).expect("a mesh");
        let loaded = start.elapsed().as_secs_f64();
        println!(
            "{} faces, {:.0} MB, {lines} lines: read {read:.2} s, bytes seen {seen:.2} s, mesh {loaded:.2} s",
            mesh.indices().len(),
            size as f64 / 1e6
        );
    }
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
