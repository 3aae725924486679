//! Files that a scene refers to without their being on disk under those names: what importers make and carry.

use crate::geometry::TriangleMesh;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// One such file.
#[derive(Clone, Debug)]
pub enum Asset {
    /// A file of another name.
    File(PathBuf),
    /// Its bytes.
    Bytes(Vec<u8>),
    /// A mesh: a PLY file that is not written yet.
    Mesh(TriangleMesh),
}

/// All of them by the names that the scene file uses, in alphabetical order.
pub type Assets = BTreeMap<String, Asset>;
