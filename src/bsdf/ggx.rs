//! The GGX distribution of microfacet normals with Smith's masking [Walter et al. 2007], [Heitz 2014], and sampling of
//! the normals that are visible from a direction [Heitz 2018], by spherical caps [Dupuy & Benyoub 2023].
//!
//! Functions here take directions in the upper hemisphere, or use |z|: callers flip. Formulas are written with
//! s(w) = √(z² + α²(x² + y²)), as Λ(w) = (s/|z| − 1)/2 and G₁(w) = 2|z|/(|z| + s) then never divide by a cosine.

use crate::math::trig;
use glam::{Vec2, Vec3A};
use std::f32::consts::FRAC_1_PI;

/// Below this α a surface is taken to be smooth: the lobe would be narrower than single precision can evaluate well.
pub const SMOOTH_BELOW: f32 = 1e-3;

/// How masking and shadowing of one microfacet go together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Masking {
    /// They share the facet's height: G₂ = 1/(1 + Λ_i + Λ_o) for reflection [Heitz 2014 (99)]. Transmission
    /// uses the separable form, as [Walter et al. 2007 (23)].
    #[default]
    Correlated,
    /// Independent: G₂ = G₁(i) G₁(o), as [Walter et al. 2007 (23)] and Mitsuba have it.
    Separable,
}

/// An isotropic rough surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    alpha: f32,
    masking: Masking,
}

impl Ggx {
    /// From the roughness α, 0 to 1. `Ok(None)`: below [`SMOOTH_BELOW`], so smooth.
    pub fn new(alpha: f32, masking: Masking) -> Result<Option<Self>, String> {
        if !(0.0..=1.0).contains(&alpha) {
            return Err(format!("alpha must be from 0 (smooth) to 1, found {alpha}"));
        }
        Ok((alpha >= SMOOTH_BELOW).then_some(Self { alpha, masking }))
    }

    /// The same with another form of masking.
    pub fn with_masking(self, masking: Masking) -> Self {
        Self { masking, ..self }
    }

    /// The roughness α.
    #[inline]
    pub fn alpha(&self) -> f32 {
        self.alpha
    }

    /// Density D(m) of facet normals, per solid angle and unit of surface: ∫ D(m) m_z dm = 1.
    #[inline]
    pub fn d(&self, m: Vec3A) -> f32 {
        // (x² + y²)/α² + z² rather than 1 + (α² − 1) z²: the latter cancels for small α.
        let a2 = self.alpha * self.alpha;
        let t = (m.x * m.x + m.y * m.y) / a2 + m.z * m.z;
        FRAC_1_PI / (a2 * t * t)
    }

    /// s(w), see the module.
    #[inline]
    fn s(&self, w: Vec3A) -> f32 {
        (w.z * w.z + self.alpha * self.alpha * (w.x * w.x + w.y * w.y)).sqrt()
    }

    /// G₁(w)/|cos θ_w|: the masking of one direction over its cosine.
    #[inline]
    pub fn g1_over_cos(&self, w: Vec3A) -> f32 {
        2.0 / (w.z.abs() + self.s(w))
    }

    /// G₂(a, b)/(|cos θ_a| |cos θ_b|) for reflection.
    #[inline]
    pub fn g2_reflect_over_cos(&self, a: Vec3A, b: Vec3A) -> f32 {
        match self.masking {
            // 1 + Λ_a + Λ_b = (s_a/c_a + s_b/c_b)/2.
            Masking::Correlated => 2.0 / (self.s(a) * b.z.abs() + self.s(b) * a.z.abs()),
            Masking::Separable => self.g1_over_cos(a) * self.g1_over_cos(b),
        }
    }

    /// G₂(a, b)/(|cos θ_a| |cos θ_b|) for transmission, where a and b are on opposite sides.
    #[inline]
    pub fn g2_transmit_over_cos(&self, a: Vec3A, b: Vec3A) -> f32 {
        self.g1_over_cos(a) * self.g1_over_cos(b)
    }

    /// Density D(m) G₁(w) |w·m|/|cos θ_w| per solid angle of the normals that w sees, for w·m > 0.
    #[inline]
    pub fn visible_pdf(&self, w: Vec3A, m: Vec3A) -> f32 {
        self.g1_over_cos(w) * w.dot(m).abs() * self.d(m)
    }

    /// A normal that `w` (z > 0) sees, with density [`Self::visible_pdf`].
    ///
    /// In the space where the surface's ellipsoids are spheres, the directions that a mirror sphere reflects w
    /// into are uniform over the cap z > −w_z; the normal is halfway [Dupuy & Benyoub 2023].
    #[inline]
    pub fn sample_visible(&self, w: Vec3A, u: Vec2) -> Vec3A {
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

/// `v` at length 1. `None` where it is too short to have a direction: two grazing directions opposite each other.
#[inline]
pub(super) fn unit(v: Vec3A) -> Option<Vec3A> {
    let length2 = v.length_squared();
    (length2 > 1e-30).then(|| v / length2.sqrt())
}
