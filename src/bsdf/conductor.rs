//! Metals: reflection by Fresnel's equations with a complex index of refraction, smooth or rough.

use super::microfacet::{self, Masking, Microfacets, NormalDistribution, Rough};
use super::{BsdfSample, BsdfValue, Mode, fresnel, metals, reflect_z, same_side};
use crate::math::{Rgb, RgbExt};
use crate::texture::Texture;
use glam::{Vec2, Vec3, Vec3A};

/// What a facet reflects.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Facet {
    /// Fresnel reflection with a complex index η + ik, relative to the medium in front.
    Index { eta: Vec3, k: Vec3 },
    /// Everything.
    Perfect,
}

/// A metal surface, the same from both sides.
#[derive(Clone, Debug)]
pub struct Conductor {
    facet: Facet,
    rough: Option<Rough>,
    tint: Texture,
}

impl Conductor {
    /// With the complex index `eta` + i `k` a channel (relative to the medium in front), the roughness `alpha` (0 to
    /// 1; smooth below [`super::microfacet::SMOOTH_BELOW`]) and a reflectance `tint` that multiplies Fresnel's.
    pub fn new(eta: Rgb, k: Rgb, alpha: f32, tint: Texture) -> Result<Self, String> {
        if !(eta.is_finite() && eta.min_element() > 0.0) {
            return Err(format!("eta must be positive in each channel, found {eta}"));
        }
        if !(k.is_finite() && k.min_element() >= 0.0) {
            return Err(format!("k must not be negative in any channel, found {k}"));
        }
        Self::with(Facet::Index { eta: eta.into(), k: k.into() }, alpha, tint)
    }

    /// A named metal, see [`metals`]. An unknown name is an error that names the nearest one and all that are known.
    pub fn metal(name: &str, alpha: f32, tint: Texture) -> Result<Self, String> {
        let metal = metals::find(name)?;
        Self::new(metal.eta.into(), metal.k.into(), alpha, tint)
    }

    /// Without Fresnel: each facet reflects `tint` (1: everything) from every direction.
    pub fn without_fresnel(alpha: f32, tint: Texture) -> Result<Self, String> {
        Self::with(Facet::Perfect, alpha, tint)
    }

    fn with(facet: Facet, alpha: f32, tint: Texture) -> Result<Self, String> {
        tint.check_reflectance("reflectance")?;
        Ok(Self { facet, rough: Rough::new(alpha)?, tint })
    }

    /// The same with another form of masking, for comparison with other renderers. Of no effect where it is smooth.
    pub fn with_masking(mut self, masking: Masking) -> Self {
        self.rough = self.rough.map(|rough| rough.with_masking(masking));
        self
    }

    /// The same with another distribution of facet normals. Of no effect where it is smooth.
    pub fn with_distribution(mut self, distribution: NormalDistribution) -> Self {
        self.rough = self.rough.map(|rough| rough.with_distribution(distribution));
        self
    }

    /// True where it can be evaluated.
    #[inline]
    pub fn is_rough(&self) -> bool {
        self.rough.is_some()
    }

    /// Reflectance of a facet at the cosine `cos`, without the tint.
    #[inline]
    fn fresnel(&self, cos: f32) -> Rgb {
        match self.facet {
            Facet::Index { eta, k } => fresnel::conductor(cos, eta.into(), k.into()),
            Facet::Perfect => Rgb::ONE,
        }
    }

    #[inline]
    pub(super) fn evaluate(&self, uv: Vec2, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        match &self.rough {
            Some(Rough::Ggx(facets)) if same_side(wl, wc) => self.evaluate_rough(facets, uv, wl, wc),
            Some(Rough::Beckmann(facets)) if same_side(wl, wc) => self.evaluate_rough(facets, uv, wl, wc),
            _ => BsdfValue::ZERO,
        }
    }

    /// [Walter et al. 2007 (20)] and the density of the visible normals over the Jacobian 4|w·m| [(14)].
    #[inline]
    fn evaluate_rough(&self, rough: &impl Microfacets, uv: Vec2, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        // |m_z| is all that D wants: no need to turn m to the outside.
        let Some(m) = microfacet::unit(wl + wc) else { return BsdfValue::ZERO };
        let d = 0.25 * rough.d(m);
        BsdfValue {
            f: self.tint.eval(uv) * self.fresnel(wl.dot(m).abs()) * (d * rough.g2_reflect_over_cos(wl, wc)),
            pdf_lc: d * rough.g1_over_cos(wl),
            pdf_cl: d * rough.g1_over_cos(wc),
        }
    }

    #[inline]
    pub(super) fn sample(&self, uv: Vec2, from: Vec3A, mode: Mode, u: Vec2) -> Option<BsdfSample> {
        if from.z == 0.0 {
            return None;
        }
        match &self.rough {
            None => self.sample_smooth(uv, from),
            Some(Rough::Ggx(facets)) => self.sample_rough(facets, uv, from, mode, u),
            Some(Rough::Beckmann(facets)) => self.sample_rough(facets, uv, from, mode, u),
        }
    }

    #[inline]
    fn sample_smooth(&self, uv: Vec2, from: Vec3A) -> Option<BsdfSample> {
        let weight = self.tint.eval(uv) * self.fresnel(from.z.abs());
        let to = reflect_z(from);
        (!weight.is_black()).then_some(BsdfSample { to, weight, pdf: 1.0, pdf_rev: 1.0, specular: true })
    }

    #[inline]
    fn sample_rough(
        &self,
        rough: &impl Microfacets,
        uv: Vec2,
        from: Vec3A,
        mode: Mode,
        u: Vec2,
    ) -> Option<BsdfSample> {
        let side = Vec3A::new(1.0, 1.0, 1f32.copysign(from.z));
        let upper = from * side;
        let m = rough.sample_visible(upper, u);
        let to = 2.0 * upper.dot(m) * m - upper;
        if !same_side(upper, to) {
            return None;
        }
        let to = to * side;
        let (wl, wc) = mode.order(from, to);
        BsdfSample::smooth(&self.evaluate_rough(rough, uv, wl, wc), mode, to)
    }

    #[inline]
    pub(super) fn albedo(&self, uv: Vec2) -> Rgb {
        self.tint.eval(uv) * self.fresnel(1.0)
    }

    pub(super) fn mean_albedo(&self) -> Rgb {
        self.tint.average() * self.fresnel(1.0)
    }

    pub(super) fn albedo_bound(&self) -> f32 {
        // Fresnel's reflectance reaches 1 at grazing incidence.
        self.tint.max().max_element()
    }
}
