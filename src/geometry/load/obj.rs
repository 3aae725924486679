//! Wavefront OBJ.
//!
//! The file is cut into pieces at ends of lines, which are gone through in parallel twice: to count vertex data and lines,
//! so that every piece knows what comes before it, and to read them. So relative indices and the numbers of lines in
//! errors are known at once, and the time is little more than that of looking at each byte.

use super::super::mesh::TriangleMesh;
use crate::error::{Error, Result};
use crate::stage;
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

/// Bytes of a piece, about.
const PIECE: usize = 1 << 20;
/// Stands for an index that a corner does not have.
const NONE: u32 = u32::MAX;

/// A corner of a triangle: indices of its position, texture coordinates and normal; the latter two may be [`NONE`].
type Corner = [u32; 3];

/// The contents of an OBJ file: triangles in runs of one material.
#[derive(Debug, Default)]
pub struct Obj {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    triangles: Vec<[Corner; 3]>,
    /// Where a material begins, by triangle, and its name.
    runs: Vec<(usize, String)>,
    /// Files of materials, with the lines that name them.
    pub libraries: Vec<(usize, String)>,
}

/// The triangles of one material.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Its name; empty before any is named.
    pub material: String,
    runs: Vec<Range<usize>>,
}

/// A mesh from the bytes of an OBJ file; `path` is for messages.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<TriangleMesh> {
    let obj = Obj::parse(path, bytes)?;
    obj.mesh(std::slice::from_ref(&(0..obj.triangles.len()))).map_err(|message| Error::file(path, message))
}

impl Obj {
    /// From the bytes of a file; `path` is for messages. Polygons become fans of triangles.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self> {
        stage::begin(format!("parsing {}, {} MB", path.display(), bytes.len() / 1_000_000));
        let pieces = pieces(bytes);
        let counts: Vec<Counts> = pieces.par_iter().map(|piece| Counts::of(&bytes[piece.clone()])).collect();
        let mut before = Vec::with_capacity(pieces.len());
        let mut total = Counts::default();
        for count in &counts {
            before.push(total);
            total = total.plus(count);
        }
        if [total.positions, total.uvs, total.normals].iter().any(|n| *n >= NONE as usize) {
            return Err(Error::file(path, "more vertices than 32 bits can count"));
        }
        let read =
            |(piece, before): (&Range<usize>, &Counts)| Piece::read(&bytes[piece.clone()], *before, total);
        let read: Vec<Result<Piece, (usize, String)>> = pieces.par_iter().zip(&before).map(read).collect();
        let mut obj = Self::default();
        for piece in read {
            let piece = piece.map_err(|(line, message)| Error::at(path, line, 0, message))?;
            obj.append(piece);
        }
        Ok(obj)
    }

    fn append(&mut self, piece: Piece) {
        let first = self.triangles.len();
        self.runs.extend(piece.runs.into_iter().map(|(at, name)| (first + at, name)));
        self.positions.extend(piece.positions);
        self.uvs.extend(piece.uvs);
        self.normals.extend(piece.normals);
        self.triangles.extend(piece.triangles);
        self.libraries.extend(piece.libraries);
    }

    /// The triangles by material, in the order in which materials first have any.
    pub fn parts(&self) -> Vec<Part> {
        let mut parts: Vec<Part> = Vec::new();
        let mut add = |material: &str, run: Range<usize>| {
            if run.is_empty() {
                return;
            }
            match parts.iter_mut().find(|p| p.material == material) {
                Some(part) => part.runs.push(run),
                None => parts.push(Part { material: material.to_owned(), runs: vec![run] }),
            }
        };
        let first = self.runs.first().map_or(self.triangles.len(), |(at, _)| *at);
        add("", 0..first);
        for (i, (at, material)) in self.runs.iter().enumerate() {
            let end = self.runs.get(i + 1).map_or(self.triangles.len(), |(at, _)| *at);
            add(material, *at..end);
        }
        parts
    }

    /// The mesh of one material's triangles.
    pub fn part(&self, part: &Part) -> Result<TriangleMesh, String> {
        self.mesh(&part.runs)
    }

    /// The mesh of some triangles. Corners with the same indices share a vertex.
    fn mesh(&self, runs: &[Range<usize>]) -> Result<TriangleMesh, String> {
        let triangles = || runs.iter().flat_map(|run| &self.triangles[run.clone()]);
        let (any_uv, any_normal) = triangles()
            .flatten()
            .fold((false, false), |(uv, n), corner| (uv || corner[1] != NONE, n || corner[2] != NONE));
        // Vertices of the same position are a chain that starts at `first` and goes on by `next`.
        let mut first = vec![NONE; self.positions.len()];
        let mut vertices: Vec<(Corner, u32)> = Vec::new();
        let mut indices = Vec::with_capacity(runs.iter().map(ExactSizeIterator::len).sum());
        for triangle in triangles() {
            indices.push(triangle.map(|corner| {
                let start = &mut first[corner[0] as usize];
                let mut vertex = *start;
                while vertex != NONE && vertices[vertex as usize].0 != corner {
                    vertex = vertices[vertex as usize].1;
                }
                if vertex == NONE {
                    vertex = vertices.len() as u32;
                    vertices.push((corner, *start));
                    *start = vertex;
                }
                vertex
            }));
        }
        let positions = vertices.iter().map(|(c, _)| self.positions[c[0] as usize]).collect();
        // A normal of zero stands for none: the triangle is flat.
        let normal = |i: u32| self.normals.get(i as usize).copied().unwrap_or(Vec3::ZERO);
        let uv = |i: u32| self.uvs.get(i as usize).copied().unwrap_or(Vec2::ZERO);
        let normals = any_normal.then(|| vertices.iter().map(|(c, _)| normal(c[2])).collect());
        let uvs = any_uv.then(|| vertices.iter().map(|(c, _)| uv(c[1])).collect());
        TriangleMesh::new(positions, normals, uvs, indices)
    }
}

/// Ranges of about the same size that end where a line ends which does not go on.
fn pieces(bytes: &[u8]) -> Vec<Range<usize>> {
    let mut pieces = Vec::new();
    let mut start = 0;
    while start < bytes.len() {
        let mut end = (start + PIECE).min(bytes.len());
        loop {
            let line = memchr::memrchr(b'\n', &bytes[start..end]).map_or(start, |i| start + i + 1);
            end = memchr::memchr(b'\n', &bytes[end..]).map_or(bytes.len(), |i| end + i + 1);
            if end == bytes.len() || continues(&bytes[line..end]).is_none() {
                break;
            }
        }
        pieces.push(start..end);
        start = end;
    }
    pieces
}

/// The lines, with their ends.
fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let ends = memchr::memchr_iter(b'\n', bytes).map(|i| i + 1);
    let last = (bytes.last().is_some_and(|b| *b != b'\n')).then_some(bytes.len());
    ends.chain(last).scan(0, move |start, end| {
        let line = &bytes[*start..end];
        *start = end;
        Some(line)
    })
}

/// How many lines and how many of each kind of vertex data there are.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    lines: usize,
    positions: usize,
    uvs: usize,
    normals: usize,
}

impl Counts {
    fn of(bytes: &[u8]) -> Self {
        let mut counts = Self::default();
        let mut goes_on = false;
        for line in lines(bytes) {
            counts.lines += 1;
            let (line, more) = continues(line).map_or_else(|| (without_comment(line), false), |l| (l, true));
            if !goes_on && line.first() == Some(&b'v') {
                match key(line) {
                    b"v" => counts.positions += 1,
                    b"vt" => counts.uvs += 1,
                    b"vn" => counts.normals += 1,
                    _ => {}
                }
            }
            goes_on = more;
        }
        counts
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            lines: self.lines + other.lines,
            positions: self.positions + other.positions,
            uvs: self.uvs + other.uvs,
            normals: self.normals + other.normals,
        }
    }
}

/// The first word of a line.
fn key(line: &[u8]) -> &[u8] {
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    &line[..end]
}

/// A line without its comment, and without the backslash that makes the next one part of it; `None` where it ends.
fn continues(line: &[u8]) -> Option<&[u8]> {
    without_comment(line).strip_suffix(b"\\")
}

fn without_comment(line: &[u8]) -> &[u8] {
    let end = memchr::memchr(b'#', line).unwrap_or(line.len());
    line[..end].trim_ascii()
}

/// What was read of a part of the file.
#[derive(Debug, Default)]
struct Piece {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    triangles: Vec<[Corner; 3]>,
    runs: Vec<(usize, String)>,
    libraries: Vec<(usize, String)>,
}

impl Piece {
    /// Reads a piece that comes after `before`, of a file with `total`. An error has the number of its line.
    fn read(bytes: &[u8], before: Counts, total: Counts) -> Result<Self, (usize, String)> {
        let mut piece = Self::default();
        let mut corners = Vec::new();
        let mut number = before.lines;
        let mut lines = lines(bytes);
        while let Some(line) = lines.next() {
            number += 1;
            let first = number;
            let mut whole = Cow::Borrowed(without_comment(line));
            while let Some(start) = whole.strip_suffix(b"\\") {
                let Some(next) = lines.next() else {
                    whole = start.to_vec().into();
                    break;
                };
                number += 1;
                whole = [start, b" ", without_comment(next)].concat().into();
            }
            piece.line(&whole, before, total, first, &mut corners).map_err(|message| (first, message))?;
        }
        Ok(piece)
    }

    fn line(
        &mut self,
        line: &[u8],
        before: Counts,
        total: Counts,
        number: usize,
        corners: &mut Vec<Corner>,
    ) -> Result<(), String> {
        let key = key(line);
        let rest = &line[key.len()..];
        match key {
            b"v" => self.positions.push(Vec3::from_array(numbers("v", rest)?)),
            b"vt" => self.uvs.push(Vec2::from_array(numbers("vt", rest)?)),
            b"vn" => self.normals.push(Vec3::from_array(numbers("vn", rest)?)),
            b"f" => {
                let so_far = [
                    before.positions + self.positions.len(),
                    before.uvs + self.uvs.len(),
                    before.normals + self.normals.len(),
                ];
                face(rest, so_far, [total.positions, total.uvs, total.normals], corners)?;
                let fan = (2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]);
                self.triangles.extend(fan);
            }
            b"usemtl" => self.runs.push((self.triangles.len(), text(rest.trim_ascii()))),
            b"mtllib" => self.libraries.push((number, text(rest.trim_ascii()))),
            _ => {}
        }
        Ok(())
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn words(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    bytes.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// The first numbers after `key`; there may be more.
fn numbers<const N: usize>(key: &str, rest: &[u8]) -> Result<[f32; N], String> {
    let mut numbers = [0.0; N];
    let mut found = 0;
    for word in words(rest) {
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse::<f32>().ok());
        let number = number.ok_or_else(|| format!("`{}` is not a number, after `{key}`", text(word)))?;
        if !number.is_finite() {
            return Err(format!("`{}` is not a finite number, after `{key}`", text(word)));
        }
        if found < N {
            numbers[found] = number;
        }
        found += 1;
    }
    match found < N {
        true => Err(format!("{found} numbers after `{key}`, where {N} are needed")),
        false => Ok(numbers),
    }
}

/// The corners of a face; all of them have texture coordinates, or none, and the same for normals.
fn face(rest: &[u8], so_far: [usize; 3], total: [usize; 3], corners: &mut Vec<Corner>) -> Result<(), String> {
    corners.clear();
    for word in words(rest) {
        corners.push(corner(word, so_far, total)?);
    }
    if corners.len() < 3 {
        return Err(format!("a face of {} corners; it needs three", corners.len()));
    }
    let has = |corner: &Corner| (corner[1] == NONE, corner[2] == NONE);
    if corners.iter().any(|corner| has(corner) != has(&corners[0])) {
        return Err("some corners of the face have texture coordinates or normals, others not".into());
    }
    Ok(())
}

fn corner(word: &[u8], so_far: [usize; 3], total: [usize; 3]) -> Result<Corner, String> {
    let mut corner = [NONE; 3];
    for (i, part) in word.split(|b| *b == b'/').enumerate() {
        if i == 3 {
            return Err(format!("`{}` has more than three indices", text(word)));
        }
        if part.is_empty() && i > 0 {
            continue;
        }
        let index = integer(part).ok_or_else(|| format!("`{}` is not a corner of a face", text(word)))?;
        let range = -(so_far[i] as i64)..=total[i] as i64;
        if index == 0 || !range.contains(&index) {
            let kind = ["vertices", "texture coordinates", "normals"][i];
            return Err(format!(
                "index {index} is out of range: the file has {} {kind}, {} up to here",
                total[i], so_far[i]
            ));
        }
        corner[i] = if index > 0 { index - 1 } else { so_far[i] as i64 + index } as u32;
    }
    Ok(corner)
}

/// A whole number with a sign or without.
fn integer(digits: &[u8]) -> Option<i64> {
    let (negative, digits) = match digits {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, digits),
    };
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut value = 0i64;
    for digit in digits {
        value = value * 10 + i64::from(digit.checked_sub(b'0').filter(|d| *d < 10)?);
    }
    Some(if negative { -value } else { value })
}
