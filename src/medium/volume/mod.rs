//! Grids in files.
//!
//! | ending | format |
//! |---|---|
//! | `.grid` | our own: a few lines of text, then numbers; see [`mod@own`] |
//! | `.vol` | Mitsuba's, version 3 with 32-bit floats; see [`vol`] |
//! | `.vdb` | OpenVDB's float grids; see [`vdb`] |

pub mod own;
pub mod vdb;
pub mod vol;

use super::grid::{Interpolation, Lattice, Placed, Texel};
use crate::error::{Error, Result};
use glam::{Affine3A, UVec3, Vec3, Vec3A};
use std::borrow::Cow;
use std::path::Path;

/// The numbers of a grid, and where its file says that it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    /// Values along each axis.
    pub size: UVec3,
    /// Numbers a value: 1 or 3.
    pub channels: usize,
    /// x fastest, then y, then z; those of one value are together.
    pub numbers: Vec<f32>,
    /// From the box, as the unit cube, to the grid's own space; `None` where the file does not say it.
    pub from_unit: Option<Affine3A>,
}

/// Endings of files that can be read.
pub const ENDINGS: [&str; 3] = [".grid", ".vol", ".vdb"];

/// Reads a file by its ending, in any case. `name`: which grid of a `.vdb` with more than one.
///
/// # Errors
/// A file that is not there, of another kind, damaged or cut short, with what is wrong in it.
pub fn read(path: &Path, name: Option<&str>) -> Result<Volume> {
    decode(path, name, || std::fs::read(path).map_err(|e| Error::io(path, "read the grid", &e)))
}

/// The same of what is not on disk: the bytes of a file that would have this path.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(path: &Path, name: Option<&str>, bytes: &[u8]) -> Result<Volume> {
    decode(path, name, || Ok(bytes))
}

fn decode<B: AsRef<[u8]>>(
    path: &Path,
    name: Option<&str>,
    bytes: impl FnOnce() -> Result<B>,
) -> Result<Volume> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let parse: fn(&[u8], Option<&str>) -> Result<Volume, String> = match ending.as_str() {
        "grid" => own::parse,
        "vol" => vol::parse,
        "vdb" => vdb::parse,
        _ => {
            return Err(Error::file(path, "not a kind of grid that can be read; use .grid, .vol or .vdb"));
        }
    };
    let volume = parse(bytes()?.as_ref(), name).map_err(|message| Error::file(path, message))?;
    volume.check().map_err(|message| Error::file(path, message))?;
    Ok(volume)
}

/// The box `min` … `max` as the unit cube's image.
pub fn cube(min: Vec3A, max: Vec3A) -> Affine3A {
    Affine3A::from_translation(min.into()) * Affine3A::from_scale(Vec3::from(max - min))
}

impl Volume {
    fn check(&self) -> Result<(), String> {
        match self.channels {
            1 => Lattice::<f32>::check(self.size, &self.numbers),
            3 => Lattice::<Vec3>::check(self.size, &self.numbers),
            n => Err(format!("the grid has {n} numbers a value: 1 and 3 can be read")),
        }
    }

    /// The grid where `from_unit` puts its box, with values of the kind `T` times `scale`: one number fills all channels.
    ///
    /// # Errors
    /// More numbers a value than `T` has, or what [`Lattice::new`] and [`Placed::new`] refuse.
    pub fn place<T: Texel>(
        &self,
        from_unit: Affine3A,
        interpolation: Interpolation,
        scale: f32,
    ) -> Result<Placed<T>, String> {
        let scaled = |x: &f32| x * scale;
        let numbers: Cow<[f32]> = match (self.channels, T::CHANNELS) {
            // A large grid is not to be copied for nothing.
            (a, b) if a == b && scale == 1.0 => Cow::Borrowed(&self.numbers),
            (a, b) if a == b => self.numbers.iter().map(scaled).collect(),
            (1, n) => self.numbers.iter().flat_map(|x| std::iter::repeat_n(scaled(x), n)).collect(),
            (a, _) => return Err(format!("the grid has {a} numbers a value where one is expected")),
        };
        Placed::new(Lattice::new(self.size, &numbers, interpolation)?, from_unit)
    }
}

/// Takes a file apart.
#[derive(Clone)]
struct Bytes<'a> {
    rest: &'a [u8],
    whole: usize,
}

impl<'a> Bytes<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, whole: bytes.len() }
    }

    /// The next bytes.
    pub fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        match self.rest.split_at_checked(count) {
            Some((taken, rest)) => {
                self.rest = rest;
                Ok(taken)
            }
            None => Err(format!(
                "the file is cut short: at byte {} it should go on for {count}, and has {} left",
                self.whole - self.rest.len(),
                self.rest.len()
            )),
        }
    }

    pub fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        Ok(self.take(N)?.try_into().expect("as many as asked for"))
    }

    /// From the byte `start` on.
    pub fn after(bytes: &'a [u8], start: u64) -> Result<Self, String> {
        let mut all = Self::new(bytes);
        all.take(usize::try_from(start).unwrap_or(usize::MAX))?;
        Ok(all)
    }

    pub fn u8(&mut self) -> Result<u8, String> {
        self.array().map(|[b]| b)
    }

    pub fn u32(&mut self) -> Result<u32, String> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Result<u64, String> {
        self.array().map(u64::from_le_bytes)
    }

    pub fn f64(&mut self) -> Result<f64, String> {
        self.array().map(f64::from_le_bytes)
    }

    /// Its length, and then the text.
    pub fn string(&mut self) -> Result<String, String> {
        let length = self.u32()?;
        self.take(length as usize).map(|b| String::from_utf8_lossy(b).into_owned())
    }

    pub fn i32(&mut self) -> Result<i32, String> {
        self.array().map(i32::from_le_bytes)
    }

    pub fn f32(&mut self) -> Result<f32, String> {
        self.array().map(f32::from_le_bytes)
    }

    /// So many numbers, which must be in what is left.
    pub fn f32s(&mut self, count: usize) -> Result<Vec<f32>, String> {
        let bytes = self.take(count.checked_mul(4).ok_or("the grid is too large")?)?;
        Ok(bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
    }

    pub fn left(&self) -> usize {
        self.rest.len()
    }
}

/// How many values a grid of this size has; an error where that is none or too many to count.
fn count(size: [i64; 3], channels: usize) -> Result<usize, String> {
    let shown = format!("{} x {} x {}", size[0], size[1], size[2]);
    if size.iter().any(|n| *n < 1 || *n > i64::from(u32::MAX)) {
        return Err(format!("the size {shown} is none: each must be from 1 up"));
    }
    let all = size.iter().try_fold(channels as i64, |n, s| n.checked_mul(*s));
    all.and_then(|n| usize::try_from(n).ok()).ok_or(format!("the grid is too large: {shown}"))
}
