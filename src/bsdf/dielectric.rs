//! Glass, water and the like: a boundary between two indices of refraction, smooth or rough.
//!
//! Outside (z > 0) the index is `ext_ior`, inside `int_ior`. A facet reflects Fresnel's share F and transmits the rest;
//! walks choose between the two in proportion to F r : (1 − F) t, where r and t are the tints' largest channels. F is the
//! same from both ends of a refracted path, so that the reverse walk makes the same choice with the same probability.

use super::microfacet::{self, Masking, Microfacets, NormalDistribution, Rough};
use super::{BsdfSample, BsdfValue, Mode, Site, flip_z, fresnel, grazing, reflect_z};
use crate::math::Rgb;
use crate::texture::Texture;
use glam::{Vec2, Vec3A};

/// A rough boundary whose indices are nearer to each other than this, relatively, is refused: the facet normal of two
/// directions, wl + (η_c/η_l) wc, then cancels.
pub const ROUGH_CONTRAST: f32 = 1e-3;

/// A boundary between two dielectrics.
#[derive(Clone, Debug)]
pub struct Dielectric {
    /// η_inside.
    inside: f32,
    /// η_inside/η_outside, unless a [`Site`] says what is outside.
    eta: f32,
    rough: Option<Rough>,
    reflectance: Texture,
    transmittance: Texture,
}

/// What happens at a facet, seen from one side.
struct Facet {
    reflectance: Rgb,
    transmittance: Rgb,
    /// Probability of reflection, and of transmission.
    p_reflect: f32,
    p_transmit: f32,
    /// Cosine of the refracted direction with the facet.
    cos: f32,
}

impl Dielectric {
    /// With the indices inside and outside, the roughness `alpha` (0 to 1; smooth below
    /// [`super::microfacet::SMOOTH_BELOW`]), and tints that multiply what is reflected and what is transmitted (1: glass).
    pub fn new(
        int_ior: f32,
        ext_ior: f32,
        alpha: f32,
        reflectance: Texture,
        transmittance: Texture,
    ) -> Result<Self, String> {
        for (name, ior) in [("int_ior", int_ior), ("ext_ior", ext_ior)] {
            if !(ior.is_finite() && ior > 0.0) {
                return Err(format!("{name} must be positive, found {ior}"));
            }
        }
        reflectance.check_reflectance("reflectance")?;
        transmittance.check_reflectance("transmittance")?;
        let rough = Rough::new(alpha)?;
        let eta = int_ior / ext_ior;
        if !eta.is_normal() {
            return Err(format!("int_ior {int_ior} and ext_ior {ext_ior} are too far apart"));
        }
        if rough.is_some() && (eta - 1.0).abs() < ROUGH_CONTRAST {
            return Err(format!(
                "a rough dielectric needs different indices inside and outside, found int_ior {int_ior} and ext_ior \
                 {ext_ior}; use alpha 0, or a null material"
            ));
        }
        Ok(Self { inside: int_ior, eta, rough, reflectance, transmittance })
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

    /// η_inside/η_outside, unless a [`Site`] says what is outside.
    #[inline]
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// η_inside.
    #[inline]
    pub fn inside(&self) -> f32 {
        self.inside
    }

    /// η_outside, unless a [`Site`] says what is outside.
    pub fn outside(&self) -> f32 {
        self.inside / self.eta
    }

    /// True where it can be evaluated.
    #[inline]
    pub fn is_rough(&self) -> bool {
        self.rough.is_some()
    }

    /// η of the other side over η of the side of `from`.
    #[inline]
    fn eta_across(&self, site: Site, from: Vec3A) -> f32 {
        let eta = if site.outside > 0.0 { self.inside / site.outside } else { self.eta };
        if from.z > 0.0 { eta } else { 1.0 / eta }
    }

    /// What happens at `uv` to light at a facet with this share of reflection.
    #[inline]
    fn facet(&self, uv: Vec2, refraction: fresnel::Refraction) -> Facet {
        let reflectance = self.reflectance.eval(uv) * refraction.reflectance;
        let transmittance = self.transmittance.eval(uv) * refraction.transmittance;
        let (r, t) = (reflectance.max_element(), transmittance.max_element());
        let scale = if r + t > 0.0 { 1.0 / (r + t) } else { 0.0 };
        Facet { reflectance, transmittance, p_reflect: r * scale, p_transmit: t * scale, cos: refraction.cos }
    }

    #[inline]
    pub(super) fn evaluate(&self, site: Site, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        match &self.rough {
            None => BsdfValue::ZERO,
            Some(Rough::Ggx(facets)) => self.evaluate_rough(facets, site, wl, wc),
            Some(Rough::Beckmann(facets)) => self.evaluate_rough(facets, site, wl, wc),
        }
    }

    #[inline]
    fn evaluate_rough(&self, rough: &impl Microfacets, site: Site, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        if grazing(wl) || grazing(wc) {
            BsdfValue::ZERO
        } else if (wl.z > 0.0) == (wc.z > 0.0) {
            self.evaluate_reflection(rough, site, wl, wc)
        } else {
            self.evaluate_transmission(rough, site, wl, wc)
        }
    }

    /// [Walter et al. 2007 (20)].
    #[inline]
    fn evaluate_reflection(&self, rough: &impl Microfacets, site: Site, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        let Some(m) = microfacet::unit(wl + wc) else { return BsdfValue::ZERO };
        let facet = self.facet(site.uv, fresnel::dielectric(wl.dot(m), self.eta_across(site, wl)));
        let d = 0.25 * rough.d(m);
        BsdfValue {
            f: facet.reflectance * (d * rough.g2_reflect_over_cos(wl, wc)),
            pdf_lc: facet.p_reflect * d * rough.g1_over_cos(wl),
            pdf_cl: facet.p_reflect * d * rough.g1_over_cos(wc),
        }
    }

    /// [Walter et al. 2007 (21)], with e = η_c/η_l and the half vector h = wl + e wc (times η_l: (16)):
    /// f = |wl·m| |wc·m| e² (1 − F) G D / (|cos θ_l| |cos θ_c| |h|²), since wl·m + e wc·m = ±|h|. The Jacobians
    /// dω_m/dω_to (17) are e²|wc·m|/|h|² from wl and |wl·m|/|h|² from wc.
    #[inline]
    fn evaluate_transmission(&self, rough: &impl Microfacets, site: Site, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        let e = self.eta_across(site, wl);
        let h = wl + e * wc;
        let Some(mut m) = microfacet::unit(h) else { return BsdfValue::ZERO };
        if m.z * wl.z < 0.0 {
            m = -m;
        }
        let (l, c) = (wl.dot(m), -wc.dot(m));
        // A facet that shows its back to either side does not connect them.
        if l <= 0.0 || c <= 0.0 {
            return BsdfValue::ZERO;
        }
        let facet = self.facet(site.uv, fresnel::between(l, c, e));
        let common = rough.d(m) * l * c / h.length_squared();
        let pdf = common * facet.p_transmit;
        BsdfValue {
            f: facet.transmittance * (common * e * e * rough.g2_transmit_over_cos(wl, wc)),
            pdf_lc: pdf * e * e * rough.g1_over_cos(wl),
            pdf_cl: pdf * rough.g1_over_cos(wc),
        }
    }

    #[inline]
    pub(super) fn sample(&self, site: Site, from: Vec3A, mode: Mode, u: (f32, Vec2)) -> Option<BsdfSample> {
        if from.z == 0.0 {
            return None;
        }
        match &self.rough {
            None => self.sample_smooth(site, from, mode, u.0),
            Some(Rough::Ggx(facets)) => self.sample_rough(facets, site, from, mode, u),
            Some(Rough::Beckmann(facets)) => self.sample_rough(facets, site, from, mode, u),
        }
    }

    #[inline]
    fn sample_smooth(&self, site: Site, from: Vec3A, mode: Mode, u: f32) -> Option<BsdfSample> {
        let eta = self.eta_across(site, from);
        let cos = from.z.abs();
        let facet = self.facet(site.uv, fresnel::dielectric(cos, eta));
        if u < facet.p_reflect {
            let (pdf, weight) = (facet.p_reflect, facet.reflectance / facet.p_reflect);
            return Some(BsdfSample { to: reflect_z(from), weight, pdf, pdf_rev: pdf, specular: true });
        }
        if facet.p_transmit <= 0.0 || facet.cos <= 0.0 {
            return None;
        }
        // Snell's law: the tangential part shrinks by η. η² cos θ dω is conserved, which gives the Jacobian.
        let to = Vec3A::new(-from.x / eta, -from.y / eta, (-facet.cos).copysign(-from.z));
        let pdf = facet.p_transmit;
        let pdf_rev = pdf * cos / (eta * eta * facet.cos);
        let weight = facet.transmittance * (self.radiance_scale(mode, eta) / pdf);
        Some(BsdfSample { to, weight, pdf, pdf_rev, specular: true })
    }

    /// (η_c/η_l)² for a camera walk from c to l, where `eta` = η_to/η_from = η_l/η_c; 1 for a light walk, since
    /// power needs no such factor.
    #[inline]
    fn radiance_scale(&self, mode: Mode, eta: f32) -> f32 {
        match mode {
            Mode::Radiance => 1.0 / (eta * eta),
            Mode::Importance => 1.0,
        }
    }

    #[inline]
    fn sample_rough(
        &self,
        rough: &impl Microfacets,
        site: Site,
        from: Vec3A,
        mode: Mode,
        u: (f32, Vec2),
    ) -> Option<BsdfSample> {
        if grazing(from) {
            return None;
        }
        let eta = self.eta_across(site, from);
        let upper = if from.z > 0.0 { from } else { flip_z(from) };
        let m = rough.sample_visible(upper, u.1);
        let cos = upper.dot(m);
        if cos <= 0.0 {
            return None;
        }
        let facet = self.facet(site.uv, fresnel::dielectric(cos, eta));
        let reflected = u.0 < facet.p_reflect;
        let to = if reflected {
            2.0 * cos * m - upper
        } else {
            ((cos / eta - facet.cos) * m - upper / eta).normalize()
        };
        // Past the horizon: the light would meet another facet, which this model leaves out.
        if (to.z > 0.0) != reflected || grazing(to) {
            return None;
        }
        let to = if from.z > 0.0 { to } else { flip_z(to) };
        let (wl, wc) = mode.order(from, to);
        let value = if reflected {
            self.evaluate_reflection(rough, site, wl, wc)
        } else {
            self.evaluate_transmission(rough, site, wl, wc)
        };
        BsdfSample::smooth(&value, mode, to)
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
