//! Fibres and flakes: specular microflakes [Jakob et al. 2010] whose normals have the distribution SGGX [Heitz et al. 2015].
//!
//! The distribution is that of the normals of an ellipsoid: with S the symmetric matrix of the squares of its projected areas,
//! a flake is seen from ω with the area σ(ω) = ∫ ⟨ω, m⟩ D(m) dm = sqrt(ωᵀ S ω), and light that comes from ω is sent to ω' with the
//! density D(h) / (4 σ(ω)), where h is the half vector. What is seen is what collides: so the extinction goes with σ(ω).
//! S is scaled such that σ is 1 where it is largest, across fibres and along the axis of flakes: a medium's coefficients
//! are those of light in such a direction, and σ_t σ(ω) and σ_s σ(ω) those of light along ω.
//!
//! The two densities of a pair of directions differ, σ(ω) ≠ σ(ω'); both enter the weights. The value, with the extinction's
//! factor in it, is D(h) / 4 from either side.

use crate::math::Frame;
use glam::{Mat3A, Vec2, Vec3A};
use std::f32::consts::{PI, TAU};

/// A distribution of flakes' normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sggx {
    s: Mat3A,
    inverse: Mat3A,
    /// 1 / (π sqrt(det S)), times what stands in D.
    scale: f32,
    roughness: f32,
    fibre: bool,
    /// σ, the mean over all directions.
    mean_area: f32,
}

impl Sggx {
    /// Fibres along `axis`, or flakes across it: `roughness` is σ along the axis of fibres, or across that of flakes, relative to
    /// the largest; above 0, where the flakes are all alike, up to 1, where they are turned anyhow.
    ///
    /// # Errors
    /// An axis of no length, or another roughness.
    pub fn new(axis: Vec3A, roughness: f32, fibre: bool) -> Result<Self, String> {
        let Some(axis) = axis.try_normalize() else { return Err("the axis of flakes has no length".into()) };
        if !(0.01..=1.0).contains(&roughness) {
            return Err(format!("the roughness of flakes must be from 0.01 to 1, found {roughness}"));
        }
        let small = roughness * roughness;
        // Seen along a fibre there is little of it; flakes are seen best along their axis.
        let (along, across) = if fibre { (small, 1.0) } else { (1.0, small) };
        let outer = Mat3A::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
        let s = Mat3A::IDENTITY * across + outer * (along - across);
        let determinant = along * across * across;
        Ok(Self {
            s,
            inverse: Mat3A::IDENTITY * across.recip() + outer * (along.recip() - across.recip()),
            scale: 1.0 / (PI * determinant.sqrt()),
            roughness,
            fibre,
            mean_area: mean_area(f64::from(roughness), fibre) as f32,
        })
    }

    /// σ(ω), from the roughness to 1; the same from either side.
    #[inline]
    pub(super) fn area(&self, w: Vec3A) -> f32 {
        w.dot(self.s * w).max(0.0).sqrt()
    }

    pub(super) fn mean_area(&self) -> f32 {
        self.mean_area
    }

    /// D [Heitz et al. 2015, (12)]: 1 / (π sqrt(det S) (ωᵀ S⁻¹ ω)²).
    #[inline]
    fn distribution(&self, h: Vec3A) -> f32 {
        let q = h.dot(self.inverse * h);
        self.scale / (q * q)
    }

    /// D(h) / 4: the density with which a walk that came from `a` goes on to `b`, times σ(a), and the other way round.
    #[inline]
    pub(super) fn value(&self, a: Vec3A, b: Vec3A) -> f32 {
        // Straight on the half vector is all rounding, any vector across; D is the same whatever its length but for that.
        (a + b).try_normalize().map_or(0.0, |h| 0.25 * self.distribution(h))
    }

    /// A direction for a walk that came from `from`: by a normal that is visible from there [Heitz et al. 2015, 4.2].
    pub(super) fn sample(&self, from: Vec3A, u: Vec2) -> Vec3A {
        let frame = Frame::from_normal(from);
        let axes = [Vec3A::X, Vec3A::Y, Vec3A::Z].map(|e| frame.to_world(e));
        let at = |i: usize, j: usize| axes[i].dot(self.s * axes[j]);
        let (kk, jj, ii) = (at(0, 0), at(1, 1), at(2, 2));
        let (kj, ki, ji) = (at(0, 1), at(0, 2), at(1, 2));
        // A direction of the hemisphere about z, its projection even on the disc.
        let (radius, angle) = (u.x.sqrt(), TAU * u.y);
        let (sin, cos) = angle.sin_cos();
        let (x, y) = (radius * cos, radius * sin);
        let z = (1.0 - u.x).max(0.0).sqrt();
        let root_ii = ii.sqrt();
        let determinant =
            (kk * jj * ii - kj * kj * ii - ki * ki * jj - ji * ji * kk + 2.0 * kj * ki * ji).abs().sqrt();
        let t = (jj * ii - ji * ji).max(0.0).sqrt();
        let m_k = Vec3A::new(determinant / t, 0.0, 0.0);
        let m_j = Vec3A::new(-(ki * ji - kj * ii) / t, t, 0.0) / root_ii;
        let m_i = Vec3A::new(ki, ji, ii) / root_ii;
        let normal = frame.to_world((m_k * x + m_j * y + m_i * z).normalize());
        (normal * (2.0 * normal.dot(from)) - from).normalize()
    }

    pub(super) fn describe(&self) -> String {
        let kind = if self.fibre { "fibres" } else { "flakes" };
        format!("specular {kind} (SGGX) of the roughness {}", self.roughness)
    }
}

/// The mean over all directions of sqrt(across sin² + along cos²), squares of areas: ∫ over the cosine from 0 to 1. By Cauchy, a
/// quarter of the surface of a spheroid with these areas.
fn mean_area(roughness: f64, fibre: bool) -> f64 {
    let e = (1.0 - roughness * roughness).sqrt();
    if e < 1e-3 {
        // Round, as far as f32 can tell: what is left of the quotients below is of the order e².
        return 1.0;
    }
    match fibre {
        true => 0.5 * (roughness + e.asin() / e),
        false => 0.5 * (1.0 + roughness * roughness * (e / roughness).asinh() / e),
    }
}
