//! A thin pane between two equal sides: it reflects, and lets through straight on what it does not.
//!
//! Of a slab whose interfaces reflect R each, with all interreflection between them, R' = 2R/(1 + R) is reflected and
//! 1 − R' goes through, without a change of direction, as the slab is thin. With the index of what is around it nothing
//! is reflected, and the pane is a share of nothing at all: as a layer it makes another material partly transparent.

use super::{BsdfSample, fresnel, reflect_z};
use crate::math::Rgb;
use crate::texture::Texture;
use glam::{Vec2, Vec3A};

/// A thin pane, the same from both sides.
#[derive(Clone, Debug)]
pub struct Thin {
    /// η of the pane over η around it.
    eta: f32,
    reflectance: Texture,
    transmittance: Texture,
}

impl Thin {
    /// With the indices of the pane and of what is around it, and tints that multiply what is reflected and what goes
    /// through.
    pub fn new(ior: f32, around: f32, reflectance: Texture, transmittance: Texture) -> Result<Self, String> {
        for (name, ior) in [("ior", ior), ("exterior_ior", around)] {
            if !(ior.is_finite() && ior > 0.0) {
                return Err(format!("{name} must be positive, found {ior}"));
            }
        }
        reflectance.check_reflectance("reflectance")?;
        transmittance.check_reflectance("transmittance")?;
        let eta = ior / around;
        if !eta.is_normal() {
            return Err(format!("ior {ior} and exterior_ior {around} are too far apart"));
        }
        Ok(Self { eta, reflectance, transmittance })
    }

    /// The cosine is the same on all sides of both directions, so that either choice has one probability from both ends.
    #[inline]
    pub(super) fn sample(&self, uv: Vec2, from: Vec3A, u: f32) -> Option<BsdfSample> {
        if from.z == 0.0 {
            return None;
        }
        let once = fresnel::dielectric(from.z.abs(), self.eta).reflectance;
        let share = 2.0 * once / (1.0 + once);
        let reflectance = self.reflectance.eval(uv) * share;
        let transmittance = self.transmittance.eval(uv) * (1.0 - share);
        let (r, t) = (reflectance.max_element(), transmittance.max_element());
        if r + t <= 0.0 {
            return None;
        }
        let p = r / (r + t);
        let (to, scattered, pdf) =
            if u < p { (reflect_z(from), reflectance, p) } else { (-from, transmittance, 1.0 - p) };
        (pdf > 0.0).then(|| BsdfSample { to, weight: scattered / pdf, pdf, pdf_rev: pdf, specular: true })
    }

    #[inline]
    pub(super) fn albedo(&self, uv: Vec2) -> Rgb {
        self.reflectance.eval(uv).max(self.transmittance.eval(uv))
    }

    pub(super) fn mean_albedo(&self) -> Rgb {
        self.reflectance.average().max(self.transmittance.average())
    }

    pub(super) fn albedo_bound(&self) -> f32 {
        self.reflectance.max().max(self.transmittance.max()).max_element()
    }
}
