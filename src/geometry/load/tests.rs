//! Meshes from files: right ones, wrong ones, and mutilated ones.

use super::super::{ShapeDesc, ShapeStats, TriangleMesh};
use super::{obj, ply};
use crate::error::Error;
use glam::{Vec2, Vec3};
use proptest::prelude::*;
use std::path::Path;

/// A unit cube with quads, normals, texture coordinates, indices from both ends, a continued line and a comment that
/// is not UTF-8.
fn cube_obj() -> Vec<u8> {
    let mut text = b"# W\xfcrfel\nmtllib none.mtl\no cube\n".to_vec();
    for i in 0..8 {
        text.extend(format!("v {} {} {}\n", i & 1, i >> 1 & 1, i >> 2 & 1).bytes());
    }
    text.extend(b"vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 -1\nvn 0 0 1\nusemtl steel\n");
    text.extend(b"f 1/1/1 3/2/1 4/3/1 2/4/1\n");
    text.extend(b"f 5/1/2 6/2/2 \\\n 8/3/2 7/4/2\ns off\ng sides\n");
    text.extend(b"f 1 2 6 5\nf 3/1 7/2 8/3 4/4\nf -8 -4 -2 -6\nf 2 4 8 6 # last\n");
    text
}

fn header(format: &str, vertices: usize, faces: usize) -> Vec<u8> {
    format!(
        "ply\nformat {format} 1.0\ncomment a cube\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property double z\nproperty float s\nproperty float t\nelement face {faces}\nproperty uchar flags\n\
         property list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes()
}

const QUADS: [[i32; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

/// The cube as PLY: "ascii", "binary_little_endian" or "binary_big_endian".
fn cube_ply(format: &str) -> Vec<u8> {
    let mut out = header(format, 8, 6);
    let big = format.contains("big");
    let f32s = |v: f32| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    let f64s = |v: f64| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    let i32s = |v: i32| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    for i in 0..8u8 {
        let [x, y, z] = [i & 1, i >> 1 & 1, i >> 2 & 1].map(f32::from);
        if format == "ascii" {
            out.extend(format!("{x} {y} {z} {} 0.5\n", 0.25 * x).bytes());
        } else {
            out.extend([f32s(x), f32s(y)].concat());
            out.extend(f64s(z.into()));
            out.extend([f32s(0.25 * x), f32s(0.5)].concat());
        }
    }
    for [a, b, c, d] in QUADS {
        if format == "ascii" {
            out.extend(format!("7 4 {a} {b} {c} {d}\n").bytes());
        } else {
            out.extend([7, 4]);
            out.extend([a, b, c, d].map(i32s).concat());
        }
    }
    out
}

fn load_obj(bytes: &[u8]) -> Result<TriangleMesh, Error> {
    obj::parse(Path::new("mesh.obj"), bytes)
}

fn load_ply(bytes: &[u8]) -> Result<TriangleMesh, Error> {
    ply::parse(Path::new("mesh.ply"), bytes)
}

fn assert_unit_cube(mesh: TriangleMesh) {
    let stats = ShapeStats::of(&ShapeDesc::Mesh(mesh));
    assert_eq!(stats.primitives, 12);
    assert!(stats.closed, "all faces turn the same way");
    assert!((stats.volume.unwrap() - 1.0).abs() < 1e-12 && (stats.area - 6.0).abs() < 1e-12);
    assert_eq!((stats.bounds.min, stats.bounds.max), (glam::Vec3A::ZERO, glam::Vec3A::ONE));
}

#[test]
fn an_obj_of_mixed_faces_is_read() {
    let mesh = load_obj(&cube_obj()).unwrap();
    for (t, corners) in mesh.indices().iter().map(|t| (t, t.map(|i| mesh.positions()[i as usize]))) {
        let ng = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        for (corner, i) in corners.iter().zip(t) {
            let n = mesh.normals().unwrap()[*i as usize];
            // Only the faces towards ±z have normals; the others must not have theirs.
            assert_eq!(n, if ng.z.abs() > 0.5 { ng } else { Vec3::ZERO });
            let uv = mesh.uvs().unwrap()[*i as usize];
            if ng.z > 0.5 {
                assert_eq!(uv, Vec2::new(corner.x, corner.y));
            } else if ng.y.abs() < 0.5 && ng.z.abs() < 0.5 {
                assert_eq!(uv, Vec2::ZERO);
            }
        }
    }
    assert_unit_cube(mesh);
}

#[test]
fn ply_is_read_in_all_encodings() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let mesh = load_ply(&cube_ply(format)).unwrap_or_else(|e| panic!("{format}: {e}"));
        assert_eq!(mesh.uvs().unwrap()[1], Vec2::new(0.25, 0.5));
        assert!(mesh.normals().is_none());
        assert_unit_cube(mesh);
    }
}

#[test]
fn errors_of_obj_name_the_line() {
    let cases = [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "mesh.obj:4: index 4 is out of range"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "mesh.obj:4: index 0 is out of range"),
        ("v 0 0 0\nf -1 -2 -1\n", "mesh.obj:2: index -2 is out of range"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n", "mesh.obj:4: index 1 is out of range"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//1 2//1 3//-9\n", "mesh.obj:4: index 1 is out of range"),
        ("v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", "mesh.obj:2: `nan` is not a finite number"),
        ("v 0 0 0\nv 1 zero 0\n", "mesh.obj:2: `zero` is not a number"),
        ("v 0 0 0\n\n# c\nv 1 0\n", "mesh.obj:4: 2 numbers after `v`"),
        ("v 0 0 0\nv 1 0 0\nf 1 2\n", "mesh.obj:3: a face of 2 corners"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n", "mesh.obj:4: `x` is not a corner"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2 3\n", "mesh.obj:5: some corners"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/1/1 2 3\n", "mesh.obj:4: index 1 is out of range"),
        ("", "mesh.obj: the mesh has no triangle"),
        (
            "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n",
            "mesh.obj: the mesh has no triangle with an area (1 without)",
        ),
    ];
    for (text, expected) in cases {
        let message = load_obj(text.as_bytes()).unwrap_err().to_string();
        assert!(message.starts_with(expected), "{message:?} is not {expected:?}");
    }
}

#[test]
fn errors_of_ply_say_what_is_wrong() {
    let ascii = String::from_utf8(cube_ply("ascii")).unwrap();
    let cases = [
        (ascii.replace("4 0 2 3 1", "4 0 2 3 8"), "mesh.ply: face 0 has index 8, but there are 8 vertices"),
        (ascii.replace("4 0 2 3 1", "4 0 2 3 -1"), "mesh.ply:"),
        (ascii.replace("4 0 2 3 1", "2 0 2"), "mesh.ply: face 0 has 2 corners"),
        (ascii.replace("1 0 0 0.25 0.5", "1 nan 0 0.25 0.5"), "mesh.ply:15: not a readable PLY file"),
        (ascii.replace("1 0 0 0.25 0.5", "1 zero 0 0.25 0.5"), "mesh.ply:15: not a readable PLY file"),
        (ascii.replace("face 6", "face 600"), "mesh.ply: the header promises 600 of `face`"),
        (ascii.replace("face 6", "face 9"), "mesh.ply:"),
        (ascii.replace("element vertex", "element corner"), "mesh.ply: the file has no element `vertex`"),
        (ascii.replace("float x", "float w"), "mesh.ply: the vertices lack x, y or z"),
        (ascii.replace("element face", "element edge"), "mesh.ply: the mesh has no triangle"),
        (String::new(), "mesh.ply"),
        ("solid stl".into(), "mesh.ply"),
    ];
    for (text, expected) in cases {
        let message = load_ply(text.as_bytes()).unwrap_err().to_string();
        assert!(message.starts_with(expected), "{message:?} is not {expected:?}");
        assert_eq!(message.lines().count(), 1, "{message:?}");
    }
    let cut = &cube_ply("binary_little_endian")[..400];
    assert!(load_ply(cut).unwrap_err().to_string().starts_with("mesh.ply: not a readable PLY file"));
}

#[test]
fn files_are_found_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("cube.OBJ");
    std::fs::write(&path, cube_obj()).unwrap();
    assert_unit_cube(TriangleMesh::load(&path).unwrap());
    let missing = TriangleMesh::load(dir.path().join("none.ply")).unwrap_err().to_string();
    assert!(missing.contains("none.ply: cannot read the mesh"), "{missing}");
    let unknown = TriangleMesh::load(dir.path().join("a.stl")).unwrap_err().to_string();
    assert!(unknown.contains(".obj or .ply"), "{unknown}");
}

/// Some bytes changed, and the end cut off.
fn mutilated(whole: Vec<u8>) -> impl Strategy<Value = Vec<u8>> {
    let length = whole.len();
    let changes = proptest::collection::vec((0..length, any::<u8>()), 0..6);
    (changes, length / 2..=length * 5 / 4).prop_map(move |(changes, cut)| {
        let mut bytes = whole.clone();
        for (place, byte) in changes {
            bytes[place] = byte;
        }
        bytes.truncate(cut);
        bytes
    })
}

fn assert_sound(mesh: Result<TriangleMesh, Error>) {
    let Ok(mesh) = mesh else { return };
    let count = mesh.positions().len() as u32;
    assert!(mesh.indices().iter().flatten().all(|i| *i < count) && !mesh.indices().is_empty());
    assert!(mesh.positions().iter().all(|p| p.is_finite()));
}

proptest! {
    #![proptest_config(crate::math::testing::fuzz(1500))]

    #[test]
    fn mutilated_obj_never_panics(bytes in mutilated(cube_obj())) {
        assert_sound(load_obj(&bytes));
    }

    #[test]
    fn mutilated_ascii_ply_never_panics(bytes in mutilated(cube_ply("ascii"))) {
        assert_sound(load_ply(&bytes));
    }

    #[test]
    fn mutilated_binary_ply_never_panics(
        bytes in prop_oneof![
            mutilated(cube_ply("binary_little_endian")),
            mutilated(cube_ply("binary_big_endian")),
        ]
    ) {
        assert_sound(load_ply(&bytes));
    }
}
