//! A diffuse base under a clear dielectric coat, smooth or rough, as Mitsuba has it.
//!
//! The coat reflects R; what enters it, T, is scattered by the base and leaves through the coat again, or is thrown back
//! to the base, any number of times:
//!
//! f = f_coat + ρ/π · T(θ_l) T(θ_c) / (η² (1 − ρ' R_i)),
//!
//! where η is the coat's index over that outside, R_i the share of diffuse light from within that the coat throws back, and
//! ρ' = ρ where the base colours that light too (`nonlinear`), else 1. A smooth coat has T = 1 − F. For a rough one T is
//! the share that is transmitted in all directions by the facets, which is tabulated by the cosine; light that meets
//! a second facet is lost, as in every model of single scattering.

use super::microfacet::{self, Masking, Microfacets, NormalDistribution, Rough};
use super::{BsdfSample, BsdfValue, Mode, fresnel, reflect_z, same_side};
use crate::math::{Rgb, warp};
use crate::texture::Texture;
use glam::{Vec2, Vec3A};
use std::f32::consts::FRAC_1_PI;

/// Entries of a table of transmittance, at cosines that are evenly spread from 0 to 1.
const ENTRIES: usize = 64;
/// Steps a side of the quadrature for an entry.
const STEPS: usize = 48;

/// A coated diffuse surface, the same from both sides.
#[derive(Clone, Debug)]
pub struct Plastic {
    diffuse: Texture,
    specular: Texture,
    /// η of the coat over η outside.
    eta: f32,
    nonlinear: bool,
    /// R_i.
    internal: f32,
    rough: Option<Coat>,
    /// The largest channels of the mean tints: how the choice between coat and base is weighted.
    shares: Vec2,
}

/// A rough coat.
#[derive(Clone, Debug)]
struct Coat {
    facets: Rough,
    transmittance: Box<[f32; ENTRIES]>,
}

/// All that makes a coated surface.
#[derive(Clone, Debug)]
pub struct PlasticSettings {
    /// The base's reflectance.
    pub diffuse: Texture,
    /// Multiplies what the coat reflects.
    pub specular: Texture,
    /// Index of the coat.
    pub ior: f32,
    /// Index outside.
    pub exterior_ior: f32,
    /// α of the coat, 0 to 1; smooth below [`super::microfacet::SMOOTH_BELOW`].
    pub roughness: f32,
    /// How the normals of a rough coat are distributed.
    pub distribution: NormalDistribution,
    /// How masking and shadowing of a rough coat go together.
    pub masking: Masking,
    /// Whether the base colours the light that the coat throws back to it.
    pub nonlinear: bool,
}

impl Plastic {
    /// A message where a number is out of its range.
    pub fn new(settings: PlasticSettings) -> Result<Self, String> {
        let PlasticSettings { diffuse, specular, ior, exterior_ior, nonlinear, .. } = settings;
        diffuse.check_reflectance("diffuse reflectance")?;
        specular.check_reflectance("specular reflectance")?;
        for (name, ior) in [("ior", ior), ("exterior_ior", exterior_ior)] {
            if !(ior.is_finite() && ior > 0.0) {
                return Err(format!("{name} must be positive, found {ior}"));
            }
        }
        let eta = ior / exterior_ior;
        if !(eta.is_normal() && eta >= 1.0) {
            return Err(format!("the coat's ior {ior} must not be below the exterior_ior {exterior_ior}"));
        }
        let facets = Rough::new(settings.roughness).map_err(|e| e.replace("alpha", "roughness"))?;
        let facets = facets
            .map(|facets| facets.with_distribution(settings.distribution).with_masking(settings.masking));
        let (internal, rough) = match facets {
            None => (diffuse_reflectance(|cos| fresnel::dielectric(cos, 1.0 / eta).reflectance), None),
            Some(facets) => {
                let shares = |cos, eta| match &facets {
                    Rough::Ggx(facets) => directional(facets, cos, eta),
                    Rough::Beckmann(facets) => directional(facets, cos, eta),
                };
                let internal = diffuse_reflectance(|cos| shares(cos, 1.0 / eta).0);
                let table =
                    std::array::from_fn(|i| shares((i as f32 / (ENTRIES - 1) as f32).max(1e-4), eta).1);
                (internal, Some(Coat { facets, transmittance: Box::new(table) }))
            }
        };
        let shares = Vec2::new(specular.average().max_element(), diffuse.average().max_element());
        Ok(Self { diffuse, specular, eta, nonlinear, internal, rough, shares })
    }

    /// T at this cosine.
    #[inline]
    fn transmittance(&self, cos: f32) -> f32 {
        match &self.rough {
            None => fresnel::dielectric(cos, self.eta).transmittance,
            Some(rough) => {
                let x = cos.min(1.0) * (ENTRIES - 1) as f32;
                let i = (x as usize).min(ENTRIES - 2);
                let (a, b) = (rough.transmittance[i], rough.transmittance[i + 1]);
                a + (b - a) * (x - i as f32)
            }
        }
    }

    /// Probability of the coat for a walk that comes at this cosine, of which `transmittance` enters.
    #[inline]
    fn coat_share(&self, transmittance: f32) -> f32 {
        let (coat, base) = ((1.0 - transmittance) * self.shares.x, transmittance * self.shares.y);
        if coat + base > 0.0 { coat / (coat + base) } else { 1.0 }
    }

    #[inline]
    pub(super) fn evaluate(&self, uv: Vec2, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        if !same_side(wl, wc) {
            return BsdfValue::ZERO;
        }
        let (cos_l, cos_c) = (wl.z.abs(), wc.z.abs());
        let (into, out) = (self.transmittance(cos_l), self.transmittance(cos_c));
        let (coat_l, coat_c) = (self.coat_share(into), self.coat_share(out));
        let base = self.diffuse.eval(uv);
        let between = if self.nonlinear { base * self.internal } else { Rgb::splat(self.internal) };
        let scale = FRAC_1_PI * into * out / (self.eta * self.eta);
        let mut value = BsdfValue {
            f: base * scale / (Rgb::ONE - between),
            pdf_lc: (1.0 - coat_l) * warp::cosine_hemisphere_pdf(cos_c),
            pdf_cl: (1.0 - coat_c) * warp::cosine_hemisphere_pdf(cos_l),
        };
        match self.rough.as_ref().map(|coat| &coat.facets) {
            None => {}
            Some(Rough::Ggx(facets)) => self.add_coat(facets, &mut value, uv, (wl, wc), (coat_l, coat_c)),
            Some(Rough::Beckmann(facets)) => {
                self.add_coat(facets, &mut value, uv, (wl, wc), (coat_l, coat_c))
            }
        }
        value
    }

    /// Adds what a rough coat reflects, which is chosen with the probabilities `shares` from either end.
    #[inline]
    fn add_coat(
        &self,
        facets: &impl Microfacets,
        value: &mut BsdfValue,
        uv: Vec2,
        (wl, wc): (Vec3A, Vec3A),
        shares: (f32, f32),
    ) {
        let Some(m) = microfacet::unit(wl + wc) else { return };
        let d = 0.25 * facets.d(m);
        let reflected = fresnel::dielectric(wl.dot(m).abs(), self.eta).reflectance;
        value.f += self.specular.eval(uv) * (reflected * d * facets.g2_reflect_over_cos(wl, wc));
        value.pdf_lc += shares.0 * d * facets.g1_over_cos(wl);
        value.pdf_cl += shares.1 * d * facets.g1_over_cos(wc);
    }

    #[inline]
    pub(super) fn sample(&self, uv: Vec2, from: Vec3A, mode: Mode, u: (f32, Vec2)) -> Option<BsdfSample> {
        if from.z == 0.0 {
            return None;
        }
        let transmittance = self.transmittance(from.z.abs());
        let coat = self.coat_share(transmittance);
        let side = Vec3A::new(1.0, 1.0, 1f32.copysign(from.z));
        let to = if u.0 >= coat {
            warp::cosine_hemisphere(u.1) * side
        } else {
            match &self.rough {
                None => {
                    // The same cosine on both ends, hence the same choice.
                    let weight = self.specular.eval(uv) * ((1.0 - transmittance) / coat);
                    let to = reflect_z(from);
                    return Some(BsdfSample { to, weight, pdf: coat, pdf_rev: coat, specular: true });
                }
                Some(Coat { facets, .. }) => {
                    let upper = from * side;
                    let m = match facets {
                        Rough::Ggx(facets) => facets.sample_visible(upper, u.1),
                        Rough::Beckmann(facets) => facets.sample_visible(upper, u.1),
                    };
                    (2.0 * upper.dot(m) * m - upper) * side
                }
            }
        };
        if !same_side(from, to) {
            return None;
        }
        let (wl, wc) = mode.order(from, to);
        BsdfSample::smooth(&self.evaluate(uv, wl, wc), mode, to)
    }

    /// What neither is the coat's nor the base's alone lies between them: the larger of the two.
    #[inline]
    pub(super) fn albedo(&self, uv: Vec2) -> Rgb {
        self.diffuse.eval(uv).max(self.specular.eval(uv) * self.internal)
    }

    pub(super) fn mean_albedo(&self) -> Rgb {
        self.diffuse.average().max(self.specular.average() * self.internal)
    }

    pub(super) fn albedo_bound(&self) -> f32 {
        self.diffuse.max().max(self.specular.max()).max_element()
    }

    /// True where the coat is smooth.
    #[inline]
    pub(super) fn has_specular(&self) -> bool {
        self.rough.is_none()
    }
}

/// 2 ∫ R(μ) μ dμ: the share of diffuse light that is reflected.
fn diffuse_reflectance(reflectance: impl Fn(f32) -> f32) -> f32 {
    // Over μ², in which diffuse light is uniform.
    const N: usize = 512;
    let sum: f64 = (0..N).map(|i| f64::from(reflectance(((i as f32 + 0.5) / N as f32).sqrt()))).sum();
    (sum / N as f64) as f32
}

/// The shares that a rough boundary reflects and transmits of light at this cosine, of relative index `eta` on the far
/// side: means over the visible facets, of what their shadowing lets out.
fn directional(facets: &impl Microfacets, cos: f32, eta: f32) -> (f32, f32) {
    let w = Vec3A::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let (mut reflected, mut transmitted) = (0.0f64, 0.0f64);
    for i in 0..STEPS {
        for j in 0..STEPS {
            let u = Vec2::new(i as f32 + 0.5, j as f32 + 0.5) / STEPS as f32;
            let m = facets.sample_visible(w, u);
            let facing = w.dot(m);
            if facing <= 0.0 {
                continue;
            }
            let boundary = fresnel::dielectric(facing, eta);
            let up = 2.0 * facing * m - w;
            if up.z > 0.0 {
                let masked = facets.g2_reflect_over_cos(w, up) * up.z / facets.g1_over_cos(w);
                reflected += f64::from(boundary.reflectance * masked);
            }
            let down = (facing / eta - boundary.cos) * m - w / eta;
            if down.z < 0.0 {
                let masked = facets.g2_transmit_over_cos(w, down) * -down.z / facets.g1_over_cos(w);
                transmitted += f64::from(boundary.transmittance * masked);
            }
        }
    }
    let n = (STEPS * STEPS) as f64;
    ((reflected / n) as f32, (transmitted / n) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::Ggx;

    #[test]
    fn a_smooth_boundary_throws_back_what_is_known() {
        // The diffuse reflectance from within glass of index 1.5: 0.5964 [Duntley 1942], from outside 0.0918.
        let within = diffuse_reflectance(|cos| fresnel::dielectric(cos, 1.0 / 1.5).reflectance);
        let without = diffuse_reflectance(|cos| fresnel::dielectric(cos, 1.5).reflectance);
        assert!((within - 0.5964).abs() < 2e-3 && (without - 0.0918).abs() < 1e-3, "{within} {without}");
        // What enters from outside leaves from within, times η².
        assert!(((1.0 - without) - 2.25 * (1.0 - within)).abs() < 2e-3);
    }

    #[test]
    fn a_nearly_smooth_rough_coat_is_a_smooth_one() {
        let ggx = Ggx::new(0.002, Masking::Separable);
        for cos in [0.2, 0.5, 0.9] {
            let (r, t) = directional(&ggx, cos, 1.5);
            let smooth = fresnel::dielectric(cos, 1.5);
            assert!((r - smooth.reflectance).abs() < 1e-3, "{cos}: {r} {smooth:?}");
            assert!((t - smooth.transmittance).abs() < 1e-3, "{cos}: {t} {smooth:?}");
        }
    }
}
