//! Meshes from files.

pub mod obj;
mod ply;
#[cfg(test)]
mod tests;

use super::mesh::TriangleMesh;
use crate::error::{Error, Result};
use crate::stage;
use std::path::Path;

impl TriangleMesh {
    /// Read a mesh from a Wavefront OBJ or a PLY file (ascii, or binary of either byte order), told apart by its
    /// extension. Polygons are split into fans of triangles, so they should be convex; materials and groups are not
    /// looked at. Triangles without area are left out: [`Self::dropped`] says how many.
    ///
    /// # Errors
    /// Where the file cannot be read or is no mesh: the message has the line where the format has lines.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let read = || {
            stage::begin(format!("reading {}", path.display()));
            std::fs::read(path).map_err(|e| Error::io(path, "read the mesh", &e))
        };
        match extension.as_deref() {
            Some("obj") => obj::parse(path, &read()?),
            Some("ply") => ply::parse(path, &read()?),
            _ => Err(Error::file(path, "unknown format of mesh: the name must end in .obj or .ply")),
        }
    }
}
