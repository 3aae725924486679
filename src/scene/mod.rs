//! The runtime scene: what transport asks.

pub mod file;
pub mod info;

use crate::bsdf::Material;
use crate::camera::Camera;
use crate::geometry::Geometry;
use crate::light::Lights;
use crate::medium::Medium;
use std::path::PathBuf;

/// Everything that is rendered. Immutable once made; shared by all threads.
#[derive(Debug)]
pub struct Scene {
    /// Name for people: the scene's folder.
    pub name: String,
    /// The camera with its film size and crop window.
    pub camera: Camera,
    /// All shapes.
    pub geometry: Geometry,
    /// All materials.
    pub materials: Vec<Material>,
    /// Index into `materials`, by shape.
    pub shape_materials: Vec<u32>,
    /// Names for people, by shape.
    pub shape_names: Vec<String>,
    /// All lights.
    pub lights: Lights,
    /// All media.
    pub media: Vec<Medium>,
    /// What looks odd but can be rendered.
    pub warnings: Vec<String>,
    /// Every file that was read: what the picture depends on.
    pub dependencies: Vec<PathBuf>,
    /// What the scene file says that light does not ask for.
    pub notes: SceneNotes,
}

/// What a scene file says that light does not ask for: names for people and defaults.
#[derive(Clone, Debug, Default)]
pub struct SceneNotes {
    /// A sentence or two.
    pub description: String,
    /// Names of the materials, by index; empty for the black of lamps without a material.
    pub material_names: Vec<String>,
    /// Names of the media, by index.
    pub medium_names: Vec<String>,
    /// Names of the lights, by index.
    pub light_names: Vec<String>,
    /// Memory of the textures' images, in bytes.
    pub texture_bytes: usize,
    /// What a render does unless told otherwise.
    pub defaults: RenderDefaults,
}

/// What a render of a scene does unless the command line or an experiment says otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RenderDefaults {
    /// Shortest paths, in segments.
    pub min_length: Option<u32>,
    /// Longest paths, in segments.
    pub max_length: Option<u32>,
}

impl Scene {
    /// The material of a shape.
    #[inline]
    pub fn material(&self, shape: u32) -> &Material {
        &self.materials[self.shape_materials[shape as usize] as usize]
    }
}
