//! Wavefront OBJ, through tobj.
//!
//! tobj does not say where in the file an error is, and mixes up attributes where only some faces of a group have
//! them. So the file is first gone through line by line: each line is checked, and what tobj gets is vertices and
//! faces alone, with a group for each run of faces that have the same attributes.

use super::super::mesh::TriangleMesh;
use crate::error::{Error, Result};
use glam::{Vec2, Vec3};
use std::fmt::Write;
use std::path::Path;

/// A mesh from the bytes of an OBJ file; `path` is for messages.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<TriangleMesh> {
    // Comments and names may be in any encoding.
    let text = String::from_utf8_lossy(bytes);
    let clean = clean(&text).map_err(|(line, message)| Error::at(path, line, 0, message))?;
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ..tobj::LoadOptions::default() };
    let no_materials = |_: &Path| Err(tobj::LoadError::MaterialParseError);
    let (models, _) = tobj::load_obj_buf(&mut clean.as_bytes(), &options, no_materials)
        .map_err(|e| Error::file(path, format!("not a readable OBJ file: {e}")))?;
    merge(models).map_err(|message| Error::file(path, message))
}

/// How many of each kind of vertex data there are.
#[derive(Clone, Copy, Default)]
struct Counts {
    positions: usize,
    uvs: usize,
    normals: usize,
}

/// Vertices and faces alone, each checked; or the line that is wrong, and why.
fn clean(text: &str) -> Result<String, (usize, String)> {
    let lines = logical_lines(text);
    let mut total = Counts::default();
    for (_, line) in &lines {
        count(line, &mut total);
    }
    let mut so_far = Counts::default();
    let mut attributes = None;
    let mut out = String::with_capacity(text.len());
    for (number, line) in &lines {
        let at = |message: String| (*number, message);
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => check_numbers("v", words, 3).map_err(at)?,
            Some("vt") => check_numbers("vt", words, 2).map_err(at)?,
            Some("vn") => check_numbers("vn", words, 3).map_err(at)?,
            Some("f") => {
                let has = check_face(words, so_far, total).map_err(at)?;
                if attributes.replace(has).is_some_and(|before| before != has) {
                    out.push_str("g next\n");
                }
            }
            _ => continue,
        }
        count(line, &mut so_far);
        let _ = writeln!(out, "{line}");
    }
    Ok(out)
}

/// The lines with their numbers, without comments; those that end in a backslash joined to the next.
fn logical_lines(text: &str) -> Vec<(usize, std::borrow::Cow<'_, str>)> {
    let mut lines: Vec<(usize, std::borrow::Cow<'_, str>)> = Vec::new();
    let mut goes_on = false;
    for (i, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let (line, more) = line.strip_suffix('\\').map_or((line, false), |l| (l, true));
        match lines.last_mut() {
            Some((_, last)) if goes_on => {
                let last = last.to_mut();
                last.push(' ');
                last.push_str(line);
            }
            _ => lines.push((i + 1, line.into())),
        }
        goes_on = more;
    }
    lines
}

fn count(line: &str, counts: &mut Counts) {
    match line.split_whitespace().next() {
        Some("v") => counts.positions += 1,
        Some("vt") => counts.uvs += 1,
        Some("vn") => counts.normals += 1,
        _ => {}
    }
}

fn check_numbers<'a>(key: &str, words: impl Iterator<Item = &'a str>, at_least: usize) -> Result<(), String> {
    let mut found = 0;
    for word in words {
        let number: f32 = word.parse().map_err(|_| format!("`{word}` is not a number, after `{key}`"))?;
        if !number.is_finite() {
            return Err(format!("`{word}` is not a finite number, after `{key}`"));
        }
        found += 1;
    }
    if found < at_least {
        return Err(format!("{found} numbers after `{key}`, where {at_least} are needed"));
    }
    Ok(())
}

/// Check a face; whether its corners have texture coordinates, and normals.
fn check_face<'a>(
    words: impl Iterator<Item = &'a str>,
    so_far: Counts,
    total: Counts,
) -> Result<(bool, bool), String> {
    let mut corners = 0;
    let mut attributes = None;
    for word in words {
        let mut parts = word.split('/');
        let kinds = [
            ("vertices", so_far.positions, total.positions),
            ("texture coordinates", so_far.uvs, total.uvs),
            ("normals", so_far.normals, total.normals),
        ];
        let mut given = [false; 3];
        for (i, (kind, so_far, total)) in kinds.into_iter().enumerate() {
            let part = parts.next().unwrap_or_default();
            if part.is_empty() && i > 0 {
                continue;
            }
            let index: i64 = part.parse().map_err(|_| format!("`{word}` is not a corner of a face"))?;
            let range = -(so_far as i64)..=total as i64;
            if index == 0 || !range.contains(&index) {
                return Err(format!(
                    "index {index} is out of range: the file has {total} {kind}, {so_far} up to here"
                ));
            }
            given[i] = true;
        }
        if parts.next().is_some() {
            return Err(format!("`{word}` has more than three indices"));
        }
        let has = (given[1], given[2]);
        if attributes.replace(has).is_some_and(|before| before != has) {
            return Err("some corners of the face have texture coordinates or normals, others not".into());
        }
        corners += 1;
    }
    if corners < 3 {
        return Err(format!("a face of {corners} corners; it needs three"));
    }
    Ok(attributes.unwrap_or_default())
}

/// One mesh of all groups.
fn merge(models: Vec<tobj::Model>) -> Result<TriangleMesh, String> {
    let (mut positions, mut normals, mut uvs) = (Vec::<Vec3>::new(), Vec::<Vec3>::new(), Vec::<Vec2>::new());
    let mut indices = Vec::new();
    let (mut any_normals, mut any_uvs) = (false, false);
    for tobj::Model { mesh, .. } in models {
        let first = positions.len() as u32;
        positions.extend(mesh.positions.chunks_exact(3).map(Vec3::from_slice));
        normals.extend(mesh.normals.chunks_exact(3).map(Vec3::from_slice));
        uvs.extend(mesh.texcoords.chunks_exact(2).map(Vec2::from_slice));
        any_normals |= !mesh.normals.is_empty();
        any_uvs |= !mesh.texcoords.is_empty();
        // A normal of zero stands for none: the triangle is flat.
        normals.resize(positions.len(), Vec3::ZERO);
        uvs.resize(positions.len(), Vec2::ZERO);
        indices.extend(mesh.indices.chunks_exact(3).map(|t| [first + t[0], first + t[1], first + t[2]]));
    }
    TriangleMesh::new(positions, any_normals.then_some(normals), any_uvs.then_some(uvs), indices)
}
