//! Lambertian reflection: f = ρ/π on both sides.

use super::{BsdfSample, BsdfValue, GRAZING, grazing};
use crate::math::{Rgb, RgbExt, warp};
use crate::texture::Texture;
use glam::{Vec2, Vec3A};
use std::f32::consts::FRAC_1_PI;

/// A diffuse surface.
#[derive(Clone, Debug)]
pub struct Diffuse {
    reflectance: Texture,
}

impl Diffuse {
    /// With the share of light that is reflected, 0 to 1 in each channel.
    pub fn new(reflectance: Texture) -> Result<Self, String> {
        reflectance.check_reflectance("reflectance")?;
        Ok(Self { reflectance })
    }

    #[inline]
    pub(super) fn evaluate(&self, uv: Vec2, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        self.evaluate_cosines(uv, wl.z, wc.z)
    }

    /// Of the directions only their cosines with the normal count.
    #[inline(always)]
    pub(super) fn evaluate_cosines(&self, uv: Vec2, cos_l: f32, cos_c: f32) -> BsdfValue {
        if cos_l * cos_c <= 0.0 || cos_l.abs() < GRAZING || cos_c.abs() < GRAZING {
            return BsdfValue::ZERO;
        }
        BsdfValue {
            f: self.reflectance.eval(uv) * FRAC_1_PI,
            pdf_lc: warp::cosine_hemisphere_pdf(cos_c.abs()),
            pdf_cl: warp::cosine_hemisphere_pdf(cos_l.abs()),
        }
    }

    #[inline]
    pub(super) fn sample(&self, uv: Vec2, from: Vec3A, u: Vec2) -> Option<BsdfSample> {
        let mut to = warp::cosine_hemisphere(u);
        let weight = self.reflectance.eval(uv);
        if grazing(to) || grazing(from) || weight.is_black() {
            return None;
        }
        let pdf = warp::cosine_hemisphere_pdf(to.z);
        let pdf_rev = warp::cosine_hemisphere_pdf(from.z.abs());
        to.z = to.z.copysign(from.z);
        Some(BsdfSample { to, weight, pdf, pdf_rev, specular: false })
    }

    /// [`Self::sample`] of unit directions in world space about the unit normal `ns`.
    #[inline(always)]
    pub(super) fn sample_world(&self, uv: Vec2, ns: Vec3A, from: Vec3A, u: Vec2) -> Option<BsdfSample> {
        let cos_from = from.dot(ns);
        let side = 1f32.copysign(cos_from);
        let to = warp::cosine_about(ns * side, u);
        let (cos_to, cos_from) = (to.dot(ns) * side, cos_from.abs());
        let weight = self.reflectance.eval(uv);
        (cos_to >= GRAZING && cos_from >= GRAZING && !weight.is_black()).then(|| BsdfSample {
            to,
            weight,
            pdf: warp::cosine_hemisphere_pdf(cos_to),
            pdf_rev: warp::cosine_hemisphere_pdf(cos_from),
            specular: false,
        })
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
