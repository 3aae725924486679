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
use crate::scene::Scene;
use crate::scene::file::assets::Assets;
use crate::scene::file::source::Source;
use glam::Vec3A;
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
    /// Behind which distance the format's renderer sees no surfaces, where it has one. Ours sees all.
    pub far: Option<Far>,
}

/// A far clipping plane. Nothing is clipped here, so a scene has to end before it.
#[derive(Clone, Debug)]
pub struct Far {
    /// Distance from the camera, along its axis (metres).
    pub distance: f64,
    /// Where it stands, or what it is a default of.
    pub place: Place,
}

impl Far {
    /// Refuses a scene that it would clip.
    ///
    /// # Errors
    /// At its place, with how far the scene reaches.
    pub fn check(&self, scene: &Scene) -> Result<()> {
        let (camera, bounds) = (&scene.camera, scene.geometry.bounds());
        let corner = Vec3A::select(camera.forward().cmpgt(Vec3A::ZERO), bounds.max, bounds.min);
        let reach = f64::from((corner - camera.position()).dot(camera.forward()));
        if bounds.is_empty() || reach <= self.distance {
            return Ok(());
        }
        Err(self.place.error(format!(
            "the scene reaches {reach} from the sensor, behind its `far_clip` of {}: nothing is clipped away here; \
             say a `far_clip` that all of it is before",
            self.distance
        )))
    }
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
