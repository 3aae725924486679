//! PLY, through ply-rs-bw.

use super::super::mesh::TriangleMesh;
use crate::error::{Error, Result};
use glam::{Vec2, Vec3};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult};
use std::path::Path;

#[derive(Default)]
struct Vertex {
    position: Vec3,
    normal: Vec3,
    uv: Vec2,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let place = match name {
            "x" => &mut self.position.x,
            "y" => &mut self.position.y,
            "z" => &mut self.position.z,
            "nx" => &mut self.normal.x,
            "ny" => &mut self.normal.y,
            "nz" => &mut self.normal.z,
            "u" | "s" | "texture_u" => &mut self.uv.x,
            "v" | "t" | "texture_v" => &mut self.uv.y,
            _ => return PropertyAccessResult::Ignored,
        };
        match property.to_f32_lossy() {
            Some(number) => *place = number,
            None => return PropertyAccessResult::UnsupportedType,
        }
        PropertyAccessResult::Set
    }
}

/// A polygon.
#[derive(Default)]
struct Face(Vec<u32>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !matches!(name, "vertex_indices" | "vertex_index") {
            return PropertyAccessResult::Ignored;
        }
        match property.to_u32_list() {
            Some(indices) => self.0 = indices,
            None => return PropertyAccessResult::UnsupportedType,
        }
        PropertyAccessResult::Set
    }
}

/// An element that is read over.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

/// A mesh from the bytes of a PLY file; `path` is for messages.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<TriangleMesh> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Skipped>::new().read_header(&mut reader).map_err(|e| failed(path, &e, true))?;
    let ascii = header.encoding == Encoding::Ascii;
    let failed = |e: ParseError| failed(path, &e, ascii);
    let mut vertices = None;
    let mut faces = Vec::new();
    for element in header.elements.values() {
        // Each element takes a byte at least; a header that promises more would only fill the memory.
        if element.count > bytes.len() {
            let message = format!("the header promises {} of `{}`", element.count, element.name);
            return Err(Error::file(path, format!("{message}, more than the file has bytes")));
        }
        match element.name.as_str() {
            "vertex" => {
                let read = Parser::<Vertex>::new().read_payload_for_element(&mut reader, element, &header);
                vertices = Some((element, read.map_err(failed)?));
            }
            "face" => {
                let read = Parser::<Face>::new().read_payload_for_element(&mut reader, element, &header);
                faces = read.map_err(failed)?;
            }
            _ => {
                Parser::<Skipped>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(failed)?;
            }
        }
    }
    let Some((element, vertices)) = vertices else {
        return Err(Error::file(path, "the file has no element `vertex`"));
    };
    mesh(element, &vertices, &faces).map_err(|message| Error::file(path, message))
}

fn mesh(element: &ElementDef, vertices: &[Vertex], faces: &[Face]) -> Result<TriangleMesh, String> {
    let has = |names: &[&str]| names.iter().all(|name| element.properties.contains_key(*name));
    if !has(&["x", "y", "z"]) {
        return Err("the vertices lack x, y or z".into());
    }
    let mut indices = Vec::with_capacity(faces.len());
    for (i, Face(corners)) in faces.iter().enumerate() {
        if let Some(index) = corners.iter().find(|c| **c as usize >= vertices.len()) {
            return Err(format!("face {i} has index {index}, but there are {} vertices", vertices.len()));
        }
        if corners.len() < 3 {
            return Err(format!("face {i} has {} corners; it needs three", corners.len()));
        }
        indices.extend((2..corners.len()).map(|c| [corners[0], corners[c - 1], corners[c]]));
    }
    let normals = has(&["nx", "ny", "nz"]).then(|| vertices.iter().map(|v| v.normal).collect());
    let uvs = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]].iter().any(|names| has(names));
    let uvs = uvs.then(|| vertices.iter().map(|v| v.uv).collect());
    TriangleMesh::new(vertices.iter().map(|v| v.position).collect(), normals, uvs, indices)
}

/// What went wrong, on one line; with its place where the file has lines.
fn failed(path: &Path, error: &ParseError, has_lines: bool) -> Error {
    let text = error.to_string();
    let text = match error.line() {
        Some(line) => text.strip_prefix(&format!("Line {line}: ")).unwrap_or(&text),
        None => &text,
    };
    let text: String = text.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(240).collect();
    let message = format!("not a readable PLY file: {text}");
    match error.line() {
        Some(line) if has_lines => Error::at(path, line, 0, message),
        _ => Error::file(path, message),
    }
}
