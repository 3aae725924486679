//! The GGX distribution of microfacet normals with Smith's masking [Walter et al. 2007], [Heitz 2014], and sampling of
//! the normals that are visible from a direction [Heitz 2018], by spherical caps [Dupuy & Benyoub 2023].
//!
//! Formulas are written with s(w) = √(z² + α²(x² + y²)), as Λ(w) = (s/|z| − 1)/2 and G₁(w) = 2|z|/(|z| + s) then never
//! divide by a cosine.

use super::microfacet::{Masking, Microfacets};
use crate::math::trig;
use glam::{Vec2, Vec3A};
use std::f32::consts::FRAC_1_PI;

/// An isotropic rough surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    alpha: f32,
    masking: Masking,
}

impl Ggx {
    /// From the roughness α, from [`super::microfacet::SMOOTH_BELOW`] to 1.
    pub fn new(alpha: f32, masking: Masking) -> Self {
        Self { alpha, masking }
    }

    /// The roughness α.
    #[inline]
    pub fn alpha(&self) -> f32 {
        self.alpha
    }

    /// How masking and shadowing go together.
    pub fn masking(&self) -> Masking {
        self.masking
    }

    /// s(w), see the module.
    #[inline]
    fn s(&self, w: Vec3A) -> f32 {
        (w.z * w.z + self.alpha * self.alpha * (w.x * w.x + w.y * w.y)).sqrt()
    }
}

impl Microfacets for Ggx {
    #[inline]
    fn d(&self, m: Vec3A) -> f32 {
        // (x² + y²)/α² + z² rather than 1 + (α² − 1) z²: the latter cancels for small α.
        let a2 = self.alpha * self.alpha;
        let t = (m.x * m.x + m.y * m.y) / a2 + m.z * m.z;
        FRAC_1_PI / (a2 * t * t)
    }

    #[inline]
    fn g1_over_cos(&self, w: Vec3A) -> f32 {
        2.0 / (w.z.abs() + self.s(w))
    }

    #[inline]
    fn g2_reflect_over_cos(&self, a: Vec3A, b: Vec3A) -> f32 {
        match self.masking {
            // 1 + Λ_a + Λ_b = (s_a/c_a + s_b/c_b)/2.
            Masking::Correlated => 2.0 / (self.s(a) * b.z.abs() + self.s(b) * a.z.abs()),
            Masking::Separable => self.g1_over_cos(a) * self.g1_over_cos(b),
        }
    }

    /// In the space where the surface's ellipsoids are spheres, the directions that a mirror sphere reflects w
    /// into are uniform over the cap z > −w_z; the normal is halfway [Dupuy & Benyoub 2023].
    #[inline]
    fn sample_visible(&self, w: Vec3A, u: Vec2) -> Vec3A {
        let stretch = Vec3A::new(self.alpha, self.alpha, 1.0);
        let w = (w * stretch).normalize();
        // z + w_z = (1 − u)(1 + w_z) is kept as it is, positive even where z and w_z cancel.
        let h = 1.0 + w.z;
        let sum_z = (1.0 - u.y) * h;
        // 1 − z² = (1 − z)(1 + z) with 1 − z = u h.
        let sin = (u.y * h * (2.0 - u.y * h)).max(0.0).sqrt();
        let (s, c) = trig::sin_cos_turns(u.x);
        let m = Vec3A::new(sin * c + w.x, sin * s + w.y, sum_z);
        (m * stretch).normalize()
    }
}
