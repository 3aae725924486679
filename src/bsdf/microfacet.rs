//! What the distributions of microfacet normals share: how they are asked, and the choice between them.
//!
//! Functions here take directions in the upper hemisphere, or use |z|: callers flip. Formulas are written with
//! G₁(w)/|cos θ_w|, which is finite where its parts are not: nothing is then divided by a cosine.

use super::beckmann::Beckmann;
use super::ggx::Ggx;
use glam::{Vec2, Vec3A};

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

/// How the normals of facets are distributed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormalDistribution {
    /// [`Ggx`].
    #[default]
    Ggx,
    /// [`Beckmann`].
    Beckmann,
}

/// A distribution of facet normals with Smith's masking, and sampling of the normals that are visible from a direction.
pub trait Microfacets {
    /// Density D(m) of facet normals, per solid angle and unit of surface: ∫ D(m) m_z dm = 1.
    fn d(&self, m: Vec3A) -> f32;

    /// G₁(w)/|cos θ_w|: the masking of one direction over its cosine.
    fn g1_over_cos(&self, w: Vec3A) -> f32;

    /// G₂(a, b)/(|cos θ_a| |cos θ_b|) for reflection.
    fn g2_reflect_over_cos(&self, a: Vec3A, b: Vec3A) -> f32;

    /// G₂(a, b)/(|cos θ_a| |cos θ_b|) for transmission, where a and b are on opposite sides.
    #[inline]
    fn g2_transmit_over_cos(&self, a: Vec3A, b: Vec3A) -> f32 {
        self.g1_over_cos(a) * self.g1_over_cos(b)
    }

    /// Density D(m) G₁(w) |w·m|/|cos θ_w| per solid angle of the normals that w sees, for w·m > 0.
    #[inline]
    fn visible_pdf(&self, w: Vec3A, m: Vec3A) -> f32 {
        self.g1_over_cos(w) * w.dot(m).abs() * self.d(m)
    }

    /// A normal that `w` (z > 0) sees, with density [`Self::visible_pdf`].
    fn sample_visible(&self, w: Vec3A, u: Vec2) -> Vec3A;
}

/// An isotropic rough surface. Who evaluates it matches once and goes on with the one distribution, by generics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rough {
    /// With long tails.
    Ggx(Ggx),
    /// Of slopes with a normal distribution.
    Beckmann(Beckmann),
}

impl Rough {
    /// GGX with correlated masking, from the roughness α, 0 to 1. `Ok(None)`: below [`SMOOTH_BELOW`], so smooth.
    pub fn new(alpha: f32) -> Result<Option<Self>, String> {
        if !(0.0..=1.0).contains(&alpha) {
            return Err(format!("alpha must be from 0 (smooth) to 1, found {alpha}"));
        }
        Ok((alpha >= SMOOTH_BELOW).then(|| Self::Ggx(Ggx::new(alpha, Masking::default()))))
    }

    /// The roughness α, and the form of masking.
    fn settings(self) -> (f32, Masking) {
        match self {
            Self::Ggx(facets) => (facets.alpha(), facets.masking()),
            Self::Beckmann(facets) => (facets.alpha(), facets.masking()),
        }
    }

    /// The same with another form of masking.
    pub fn with_masking(self, masking: Masking) -> Self {
        let (alpha, _) = self.settings();
        match self {
            Self::Ggx(_) => Self::Ggx(Ggx::new(alpha, masking)),
            Self::Beckmann(_) => Self::Beckmann(Beckmann::new(alpha, masking)),
        }
    }

    /// The same roughness and masking with another distribution.
    pub fn with_distribution(self, distribution: NormalDistribution) -> Self {
        let (alpha, masking) = self.settings();
        match distribution {
            NormalDistribution::Ggx => Self::Ggx(Ggx::new(alpha, masking)),
            NormalDistribution::Beckmann => Self::Beckmann(Beckmann::new(alpha, masking)),
        }
    }
}

/// `v` at length 1. `None` where it is too short to have a direction: two grazing directions opposite each other.
#[inline]
pub(super) fn unit(v: Vec3A) -> Option<Vec3A> {
    let length2 = v.length_squared();
    (length2 > 1e-30).then(|| v / length2.sqrt())
}
