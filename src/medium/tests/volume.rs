//! Files of grids. Those of `tests/grids` were written by OpenVDB 10, all of one grid: 60 single voxels, a leaf, a tile and
//! an inactive voxel with a value; packed by zlib so that they are small.

use crate::medium::grid::{Interpolation, Placed};
use crate::medium::volume::{self, Volume, own, vol};
use glam::{Affine3A, UVec3, Vec3, Vec3A};
use proptest::prelude::*;
use std::io::Read;
use std::path::{Path, PathBuf};

fn vdb_bytes(name: &str) -> Vec<u8> {
    let packed = std::fs::read(Path::new("tests/grids").join(format!("{name}.vdb.zz"))).expect("a fixture");
    let mut bytes = Vec::new();
    flate2::read::ZlibDecoder::new(&packed[..]).read_to_end(&mut bytes).expect("it is packed");
    bytes
}

fn parse(ending: &str, bytes: &[u8], name: Option<&str>) -> Result<Volume, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let path: PathBuf = folder.path().join(format!("a.{ending}"));
    std::fs::write(&path, bytes).expect("it can be written");
    volume::read(&path, name).map_err(|e| e.to_string())
}

/// Means over voxels of the index space, as the program that made the files counted.
fn check_vdb(name: &str, exact: bool) {
    let volume = parse("vdb", &vdb_bytes(name), Some("density")).unwrap_or_else(|e| panic!("{name}: {e}"));
    // All that is not 0 is within -9..23, -6..15, -11..17, and a layer of nothing is about it.
    assert_eq!(volume.size, UVec3::new(35, 24, 31), "{name}");
    let (mut sum, mut count) = (0.0f64, 0);
    for (i, v) in volume.numbers.iter().enumerate() {
        let i = i as u32;
        let p = UVec3::new(i % 35, i / 35 % 24, i / 35 / 24).as_dvec3() - glam::DVec3::new(10.0, 7.0, 12.0);
        sum += f64::from(*v) * (1.0 + 0.01 * p.x + 0.02 * p.y + 0.05 * p.z);
        count += usize::from(*v != 0.0);
    }
    assert_eq!(count, 1084, "{name}");
    let tolerance = if exact { 1e-4 } else { 0.2 };
    assert!((sum - 1227.8575).abs() < tolerance, "{name}: {sum}");
}

#[test]
fn openvdb_files_of_every_compression_are_read() {
    for name in ["none", "zip", "blosc", "mask", "half", "affine"] {
        // Multiples of a sixteenth are half floats, too.
        check_vdb(name, true);
    }
}

#[test]
fn values_of_an_openvdb_grid_are_at_its_indices() {
    let placed = |name: &str| -> Placed<f32> {
        let volume = parse("vdb", &vdb_bytes(name), Some("density")).expect("a grid");
        let place = volume.from_unit.expect("a transform");
        volume.place(place, Interpolation::Trilinear, 1.0).expect("a place")
    };
    // Voxels of a quarter, from (1, 2, 3) on; in the leaf at (16, 0, 0) values are 0.5 + ((3x + 5y + 7z) mod 11) / 16.
    let grid = placed("zip");
    for [x, y, z] in [[16, 0, 0], [17, 3, 5], [23, 7, 7]] {
        let at = Vec3A::new(x as f32, y as f32, z as f32) * 0.25 + Vec3A::new(1.0, 2.0, 3.0);
        let expected = 0.5 + ((3 * x + 5 * y + 7 * z) % 11) as f32 / 16.0;
        assert!((grid.value(at) - expected).abs() < 1e-4, "{x} {y} {z}: {} for {expected}", grid.value(at));
    }
    assert!((grid.value(Vec3A::new(1.75, 2.75, 3.75)) - 2.0).abs() < 1e-4, "the inactive voxel (3, 3, 3)");
    assert!((grid.value(Vec3A::new(2.0, 5.0, 4.0)) - 0.75).abs() < 1e-4, "the tile about (4, 12, 4)");
    // Turned: where OpenVDB puts (16, 0, 0).
    let turned = placed("affine");
    let at = Vec3A::new(6.642_692, 0.0, -0.364_161_65);
    assert!((turned.value(at) - 0.75).abs() < 1e-4, "{}", turned.value(at));
}

#[test]
fn grids_of_an_openvdb_file_have_names() {
    let bytes = vdb_bytes("none");
    assert!(parse("vdb", &bytes, None).is_ok(), "the only float grid");
    let message = parse("vdb", &bytes, Some("vel")).expect_err("vectors");
    assert!(message.contains("`vel` is a Tree_vec3s_5_4_3"), "{message}");
    let message = parse("vdb", &bytes, Some("fuel")).expect_err("no such grid");
    assert!(message.contains("no grid `fuel`") && message.contains("`density`"), "{message}");
}

fn small(channels: usize) -> Volume {
    let numbers = (0..2 * 3 * 4 * channels).map(|i| 0.5 * i as f32).collect();
    let from_unit = volume::cube(Vec3A::new(-1.0, 0.0, 2.0), Vec3A::new(1.0, 0.5, 3.0));
    Volume { size: UVec3::new(2, 3, 4), channels, numbers, from_unit: Some(from_unit) }
}

#[test]
fn what_is_written_is_read() {
    for channels in [1, 3] {
        let volume = small(channels);
        assert_eq!(parse("grid", &own::encode(&volume), None).as_ref(), Ok(&volume));
        assert_eq!(parse("vol", &vol::encode(&volume), None).as_ref(), Ok(&volume));
        let nowhere = Volume { from_unit: None, ..volume };
        assert_eq!(parse("grid", &own::encode(&nowhere), None).as_ref(), Ok(&nowhere));
    }
}

#[test]
fn values_are_where_the_file_says() {
    let volume = small(1);
    let place = volume.from_unit.expect("a box");
    let grid: Placed<f32> = volume.place(place, Interpolation::Constant, 2.0).expect("a place");
    // Voxel (1, 2, 3), the last.
    assert_eq!(grid.value(Vec3A::new(0.9, 0.45, 2.9)), 23.0);
    assert_eq!(grid.value(Vec3A::new(-0.9, 0.05, 2.1)), 0.0);
    assert_eq!(grid.value(Vec3A::new(0.9, 0.05, 2.1)), 1.0);
    assert_eq!(grid.value(Vec3A::new(0.9, 0.05, 3.1)), 0.0, "outside");
    let three: Placed<Vec3> = volume.place(place, Interpolation::Constant, 1.0).expect("grey");
    assert_eq!(three.value(Vec3A::new(0.9, 0.45, 2.9)), Vec3A::splat(11.5));
    assert!(small(3).place::<f32>(Affine3A::IDENTITY, Interpolation::Constant, 1.0).is_err());
}

#[test]
fn bad_files_are_one_clear_error() {
    let own = |text: &str, numbers: &[f32]| {
        let mut bytes = text.as_bytes().to_vec();
        bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
        parse("grid", &bytes, None).expect_err(text)
    };
    let mut short = vol::encode(&small(1));
    short.truncate(short.len() - 5);
    let mut long = vol::encode(&small(1));
    long.push(0);
    let mut halves = vol::encode(&small(1));
    halves[4] = 2;
    let mut nan = vol::encode(&small(1));
    let last = nan.len() - 4;
    nan[last..].copy_from_slice(&f32::NAN.to_le_bytes());
    let vol = |bytes: &[u8]| parse("vol", bytes, None).expect_err("a bad file");
    for (message, word) in [
        (own("tyndall grid 2\n", &[]), "first line"),
        (own("tyndall grid 1\nsize 1 1 1\n", &[1.0]), "no line `data`"),
        (own("tyndall grid 1\nsize 1 1\ndata\n", &[1.0]), "line 2 of the header"),
        (own("tyndall grid 1\nsize 1 1 1\nchannels 2\ndata\n", &[1.0]), "line 3 of the header"),
        (own("tyndall grid 1\nsise 1 1 1\ndata\n", &[1.0]), "`sise 1 1 1`"),
        (own("tyndall grid 1\nsize 1 x 1\ndata\n", &[1.0]), "`x` is not a number"),
        (own("tyndall grid 1\ndata\n", &[1.0]), "does not say the size"),
        (own("tyndall grid 1\nsize 2 1 1\ndata\n", &[1.0]), "promises 2 numbers, and the file has 1"),
        (own("tyndall grid 1\nsize 1 1 1\ndata\n", &[1.0, 2.0]), "4 bytes follow"),
        (own("tyndall grid 1\nsize 1 0 1\ndata\n", &[]), "must be from 1 up"),
        (own("tyndall grid 1\nsize 9999999 9999999 9999999\ndata\n", &[]), "too large"),
        (own("tyndall grid 1\nsize 1 1 1\nbox 0 0 0 1 -1 1\ndata\n", &[1.0]), "the box"),
        (own("tyndall grid 1\nsize 2 1 1\ndata\n", &[1.0, -2.0]), "(1, 0, 0) is -2"),
        (vol(&short), "promises 24 numbers, and the file has 22"),
        (vol(&long), "1 bytes follow"),
        (vol(&halves), "encoding of the Mitsuba grid is 2"),
        (vol(&nan), "(1, 2, 3) is NaN"),
        (vol(b"VOX"), "cut short"),
        (vol(b"VOX\x03"), "begin with `VOL`"),
        (parse("txt", b"", None).expect_err("an ending"), "use .grid, .vol or .vdb"),
        (parse("vdb", b"VDB", None).expect_err("no grid"), "not an OpenVDB file"),
    ] {
        assert!(message.contains(word), "{message} has no `{word}`");
        assert!(!message.contains('\n'), "{message}");
    }
}

/// Files of all formats with bytes changed, cut or added.
fn spoilt() -> impl Strategy<Value = (usize, Vec<(prop::sample::Index, u8)>, Option<prop::sample::Index>)> {
    let changes = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6);
    (0usize..6, changes, prop::option::of(any::<prop::sample::Index>()))
}

proptest! {
    #![proptest_config(crate::math::testing::fuzz(200))]
    /// Whatever is in a file, it is a grid or an error.
    #[test]
    fn no_file_panics((which, changes, cut) in spoilt()) {
        let (ending, mut bytes) = match which {
            0 => ("grid", own::encode(&small(3))),
            1 => ("vol", vol::encode(&small(1))),
            2 => ("vdb", vdb_bytes("zip")),
            3 => ("vdb", vdb_bytes("blosc")),
            4 => ("vdb", vdb_bytes("half")),
            _ => ("vdb", vdb_bytes("affine")),
        };
        // Most of an OpenVDB file are masks of nothing; what matters is at its ends.
        for (place, byte) in changes {
            let edge = 600.min(bytes.len() / 2);
            let i = place.index(2 * edge);
            let i = if i < edge { i } else { bytes.len() - 1 - (i - edge) * 7 % bytes.len() };
            bytes[i] = byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(volume) = parse(ending, &bytes, None) {
            prop_assert!(volume.numbers.iter().all(|x| x.is_finite() && *x >= 0.0));
        }
    }
}
