//! Scenes that others made, read as they are: Mitsuba 3's XML, SmallUPBP's OBJ with its `.aux`, glTF 2.0.
//!
//! An importer translates a file into the text of a scene file of ours, as a person would write it, with the meshes and
//! pictures that the text refers to ([`Imported`]). Rendering takes that text through the very reader that takes ours, so
//! names, numbers and solids are checked once, in one place; and since [`export`] writes the same text and the same
//! meshes, what it wrote renders to the same pixels. Every part of the text knows which place of which foreign file it
//! comes from, so that errors and warnings point there.

mod document;
mod export;
pub mod gltf;
pub mod mitsuba;
mod numbers;
pub mod smallupbp;

pub use document::{Document, Place};
pub use export::export;

use crate::error::Result;
use crate::scene::file::assets::Assets;
use crate::scene::file::source::Source;
use std::path::{Path, PathBuf};

/// A translated scene.
#[derive(Debug)]
pub struct Imported {
    /// The text of a scene file of ours, which knows where its parts come from.
    pub source: Source,
    /// The files that it refers to.
    pub assets: Assets,
    /// Every file that was read.
    pub files: Vec<PathBuf>,
    /// What could not be taken over and does not change the picture, or only as is said.
    pub warnings: Vec<String>,
}

/// The formats of others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Mitsuba 3's XML.
    Mitsuba,
    /// SmallUPBP's OBJ, with its `.aux`.
    SmallUpbp,
    /// glTF 2.0, as text or binary.
    Gltf,
}

impl Format {
    /// The endings of all formats, for messages.
    pub const ENDINGS: &str = ".xml, .obj (with .obj.aux), .gltf or .glb";

    /// The format of a file, by the ending of its name; `None` for ours.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        match ending.as_str() {
            "xml" => Some(Self::Mitsuba),
            "obj" => Some(Self::SmallUpbp),
            "gltf" | "glb" => Some(Self::Gltf),
            _ => None,
        }
    }

    /// Translates a file.
    ///
    /// # Errors
    /// With file, line and column of what cannot be understood, or not be rendered as it is meant.
    pub fn read(self, path: &Path) -> Result<Imported> {
        match self {
            Self::Mitsuba => mitsuba::read(path),
            Self::SmallUpbp => smallupbp::read(path),
            Self::Gltf => gltf::read(path),
        }
    }
}
