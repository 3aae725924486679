//! Perfect reflection of a fixed colour, on both sides.

use super::{BsdfSample, reflect_z};
use crate::math::{Rgb, RgbExt};
use crate::texture::Texture;
use glam::{Vec2, Vec3A};

/// A perfect mirror.
#[derive(Clone, Debug)]
pub struct Mirror {
    reflectance: Texture,
}

impl Mirror {
    /// With the share of light that is reflected, 0 to 1 in each channel, from all directions alike.
    pub fn new(reflectance: Texture) -> Result<Self, String> {
        reflectance.check_reflectance("reflectance")?;
        Ok(Self { reflectance })
    }

    #[inline]
    pub(super) fn sample(&self, uv: Vec2, from: Vec3A) -> Option<BsdfSample> {
        let weight = self.reflectance.eval(uv);
        if from.z == 0.0 || weight.is_black() {
            return None;
        }
        Some(BsdfSample { to: reflect_z(from), weight, pdf: 1.0, pdf_rev: 1.0, specular: true })
    }

    #[inline]
    pub(super) fn albedo(&self, uv: Vec2) -> Rgb {
        self.reflectance.eval(uv)
    }

    pub(super) fn mean_albedo(&self) -> Rgb {
        self.reflectance.average()
    }

    pub(super) fn albedo_bound(&self) -> f32 {
        self.reflectance.max().max_element()
    }
}
