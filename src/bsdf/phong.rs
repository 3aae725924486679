//! A diffuse base with a Phong lobe about the mirror direction, as SmallVCM and SmallUPBP have it:
//! f = k_d/π + k_s (n + 2)/(2π) cosⁿα, where α is the angle between wc and the mirror direction of wl
//! [Lafortune & Willems 1994].

use super::{BsdfSample, BsdfValue, Mode, reflect_z, same_side};
use crate::math::{Frame, Rgb, warp};
use crate::texture::Texture;
use glam::{Vec2, Vec3A};
use std::f32::consts::{FRAC_1_PI, TAU};

/// The largest exponent that single precision can evaluate to 0.1%.
pub const MAX_EXPONENT: f32 = 1e5;

/// A Phong surface, the same from both sides.
#[derive(Clone, Debug)]
pub struct Phong {
    diffuse: Texture,
    specular: Texture,
    exponent: f32,
}

impl Phong {
    /// With the diffuse reflectance k_d, the lobe's k_s (its share at normal incidence; less elsewhere) and its
    /// exponent n, 0 to [`MAX_EXPONENT`]. k_d + k_s above 1 is not refused, see [`super::Material::albedo_bound`].
    pub fn new(diffuse: Texture, specular: Texture, exponent: f32) -> Result<Self, String> {
        diffuse.check_reflectance("diffuse reflectance")?;
        specular.check_reflectance("specular reflectance")?;
        if !(0.0..=MAX_EXPONENT).contains(&exponent) {
            return Err(format!("the Phong exponent must be from 0 to {MAX_EXPONENT}, found {exponent}"));
        }
        Ok(Self { diffuse, specular, exponent })
    }

    /// k_d, k_s and the probability of the diffuse base. It depends on the point alone, so both directions' densities
    /// have it in common.
    #[inline]
    fn lobes(&self, uv: Vec2) -> (Rgb, Rgb, f32) {
        let (kd, ks) = (self.diffuse.eval(uv), self.specular.eval(uv));
        let (d, s) = (kd.max_element(), ks.max_element());
        let share = if d + s > 0.0 { d / (d + s) } else { 1.0 };
        (kd, ks, share)
    }

    /// cosⁿα for the angle between the unit vectors `a` and `b`, 0 beyond 90°.
    #[inline]
    fn power(&self, a: Vec3A, b: Vec3A) -> f32 {
        // 1 − cos α = |a − b|²/2 keeps the digits that a·b near 1 loses, which large exponents bring up.
        let one_minus = 0.5 * (a - b).length_squared();
        if one_minus < 1.0 { (self.exponent * (-one_minus).ln_1p()).exp() } else { 0.0 }
    }

    #[inline]
    pub(super) fn evaluate(&self, uv: Vec2, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        if !same_side(wl, wc) {
            return BsdfValue::ZERO;
        }
        let (kd, ks, share) = self.lobes(uv);
        let lobe = self.power(reflect_z(wl), wc) / TAU;
        let pdf_lobe = (1.0 - share) * (self.exponent + 1.0) * lobe;
        BsdfValue {
            f: kd * FRAC_1_PI + ks * ((self.exponent + 2.0) * lobe),
            pdf_lc: share * warp::cosine_hemisphere_pdf(wc.z.abs()) + pdf_lobe,
            pdf_cl: share * warp::cosine_hemisphere_pdf(wl.z.abs()) + pdf_lobe,
        }
    }

    #[inline]
    pub(super) fn sample(&self, uv: Vec2, from: Vec3A, mode: Mode, u: (f32, Vec2)) -> Option<BsdfSample> {
        let (_, _, share) = self.lobes(uv);
        let side = Vec3A::new(1.0, 1.0, 1f32.copysign(from.z));
        let upper = if u.0 < share {
            warp::cosine_hemisphere(u.1)
        } else {
            // cos α = v^(1/(n+1)) has density (n+1)/(2π) cosⁿα. By way of its logarithm, so that sin α keeps its
            // digits where cos α is near 1. v is in (0, 1].
            let log = (1.0 - u.1.x).ln() / (self.exponent + 1.0);
            let sin = (-(2.0 * log).exp_m1()).max(0.0).sqrt();
            let (s, c) = (TAU * u.1.y).sin_cos();
            Frame::from_normal(reflect_z(from * side)).to_world(Vec3A::new(sin * c, sin * s, log.exp()))
        };
        let to = upper * side;
        if !same_side(from, to) {
            return None;
        }
        let (wl, wc) = mode.order(from, to);
        BsdfSample::smooth(&self.evaluate(uv, wl, wc), mode, to)
    }

    #[inline]
    pub(super) fn albedo(&self, uv: Vec2) -> Rgb {
        self.diffuse.eval(uv) + self.specular.eval(uv)
    }

    pub(super) fn mean_albedo(&self) -> Rgb {
        self.diffuse.average() + self.specular.average()
    }

    pub(super) fn albedo_bound(&self) -> f32 {
        (self.diffuse.max() + self.specular.max()).max_element()
    }
}
