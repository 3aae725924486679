//! The runtime scene: what transport asks.

pub mod file;
pub mod import;
pub mod info;
pub mod inside;
pub mod passage;
pub mod solids;

pub use inside::Inside;
pub use passage::{Arrival, Collision, Place, Stretch};
pub use solids::{Solid, Solids};

use crate::bsdf::Material;
use crate::camera::Camera;
use crate::geometry::Geometry;
use crate::light::{Light, LightPoint, Lights};
use crate::medium::Medium;
use glam::Vec3A;
use std::path::PathBuf;
use std::sync::Arc;

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
    pub materials: Vec<Arc<Material>>,
    /// Index into `materials`, by shape.
    pub shape_materials: Vec<u32>,
    /// By shape its material: what walks look up at each vertex, and with one index.
    by_shape: Vec<Arc<Material>>,
    /// Names for people, by shape.
    pub shape_names: Vec<String>,
    /// All lights.
    pub lights: Lights,
    /// All media.
    pub media: Vec<Medium>,
    /// Which shapes have something in them.
    pub solids: Solids,
    /// The solids that the camera is in.
    pub camera_inside: Inside,
    /// By light, the solids that it is in, its own apart; `None` where that differs from point to point.
    pub light_inside: Vec<Option<Inside>>,
    /// What the media have between them.
    pub traits: Traits,
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

/// What the media of a scene have between them: what need not be asked for where it is not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traits {
    /// Whether some medium scatters.
    pub scattering: bool,
    /// Whether some medium shines.
    pub emissive: bool,
}

impl Traits {
    /// Of these media.
    pub fn of(media: &[Medium]) -> Self {
        Self {
            scattering: media.iter().any(Medium::scatters),
            emissive: media.iter().any(Medium::is_emissive),
        }
    }
}

impl Scene {
    /// The solids that light leaves `point` of a light into, in the direction `dir`.
    #[inline]
    pub fn inside_at_light(&self, point: &LightPoint, dir: Vec3A) -> Inside {
        let constant = self.light_inside[point.light as usize];
        let Light::Area(light) = &self.lights.lights()[point.light as usize] else {
            return constant.unwrap_or(Inside::NOTHING);
        };
        let own = self.solids.of_shape(light.shape());
        let around = match constant {
            Some(inside) => inside,
            None => self.solids.at(&self.geometry, point.p).without(own),
        };
        let inward =
            own != Inside::NONE && self.geometry.outward(light.shape(), point.prim, point.p).dot(dir) < 0.0;
        if inward { around.with(own) } else { around }
    }

    /// The material of a shape.
    #[inline]
    pub fn material(&self, shape: u32) -> &Material {
        &self.by_shape[shape as usize]
    }
}
