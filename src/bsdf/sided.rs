//! One opaque material on the outside and another one, or nothing that reflects, on the inside.

use super::{BsdfSample, BsdfValue, Material, Mode, Site};
use crate::math::{Rgb, RgbExt};
use glam::{Vec2, Vec3A};

/// A surface with two faces.
#[derive(Clone, Debug)]
pub struct Sided {
    /// For z > 0 and z < 0; `None` reflects nothing.
    faces: Box<[Option<Material>; 2]>,
}

impl Sided {
    /// With the materials of the outside and of the inside: opaque ones, neither layered nor sided.
    pub fn new(front: Option<Material>, back: Option<Material>) -> Result<Self, String> {
        for material in [&front, &back].into_iter().flatten() {
            match material {
                Material::Diffuse(_)
                | Material::Mirror(_)
                | Material::Conductor(_)
                | Material::Phong(_)
                | Material::Plastic(_) => {}
                _ => {
                    return Err(
                        "a side has to be of a diffuse, mirror, conductor, phong or plastic material".into(),
                    );
                }
            }
        }
        Ok(Self { faces: Box::new([front, back]) })
    }

    #[inline]
    fn face(&self, w: Vec3A) -> Option<&Material> {
        self.faces[usize::from(w.z < 0.0)].as_ref()
    }

    /// Light that goes through finds nothing: both faces are opaque.
    #[inline]
    pub(super) fn evaluate(&self, site: Site, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        match self.face(wl) {
            Some(material) if wl.z * wc.z > 0.0 => material.evaluate(site, wl, wc),
            _ => BsdfValue::ZERO,
        }
    }

    #[inline]
    pub(super) fn sample(&self, site: Site, from: Vec3A, mode: Mode, u: (f32, Vec2)) -> Option<BsdfSample> {
        self.face(from)?.sample(site, from, mode, u)
    }

    fn faces(&self) -> impl Iterator<Item = &Material> {
        self.faces.iter().flatten()
    }

    /// Of the brighter face, in each channel: it must not depend on the side.
    pub(super) fn albedo(&self, uv: Vec2) -> Rgb {
        self.faces().fold(Rgb::ZERO, |most, m| most.max(m.albedo(uv)))
    }

    pub(super) fn mean_albedo(&self) -> Rgb {
        self.faces().fold(Rgb::ZERO, |most, m| most.max(m.mean_albedo()))
    }

    pub(super) fn albedo_bound(&self) -> f32 {
        self.faces().fold(0.0, |most, m| most.max(m.albedo_bound()))
    }

    #[inline]
    pub(super) fn has_smooth(&self) -> bool {
        self.faces().any(Material::has_smooth)
    }

    #[inline]
    pub(super) fn has_specular(&self) -> bool {
        self.faces().any(Material::has_specular)
    }

    /// True where neither face reflects anything.
    pub fn is_black(&self) -> bool {
        self.mean_albedo().is_black()
    }
}
