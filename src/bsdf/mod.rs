//! How surfaces scatter light.
//!
//! All directions are unit vectors, point away from the surface and are local to the shading frame: z = n_s, z > 0
//! outside. `wl` is on the side of the path where the light is, `wc` on the side of the camera; `from` is the side
//! that a walk comes from, `to` the side that it goes on to. f(wl → wc) is the radiance that leaves along wc, per
//! irradiance that arrives from wl: for refraction it has the factor (η_c/η_l)², since L/η² is what a boundary
//! conserves, and f(wl → wc)/η_c² = f(wc → wl)/η_l² [Veach 1997, 5.2]. A light walk needs no correction of its own,
//! because the arguments of f say where the light is, and not where the walk comes from.
//!
//! A smooth lobe can be evaluated, and so be used by connections; a specular one (a Dirac) can only be sampled.
//! Opaque materials look the same from both sides.

pub mod beckmann;
pub mod conductor;
pub mod dielectric;
pub mod diffuse;
pub mod fresnel;
pub mod ggx;
pub mod layered;
pub mod metals;
pub mod microfacet;
pub mod mirror;
pub mod null;
pub mod phong;
pub mod plastic;
pub mod sided;
#[cfg(test)]
mod tests;
pub mod thin;

pub use beckmann::Beckmann;
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use ggx::Ggx;
pub use layered::Layered;
pub use microfacet::{Masking, Microfacets, NormalDistribution, Rough};
pub use mirror::Mirror;
pub use phong::Phong;
pub use plastic::{Plastic, PlasticSettings};
pub use sided::Sided;
pub use thin::Thin;

use crate::math::{Frame, Rgb, renormalized};
use glam::{Vec2, Vec3A};

/// What a walk carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// A camera walk, which gathers radiance: `from` is the camera's side.
    Radiance,
    /// A light walk, which carries importance-weighted power: `from` is the light's side.
    Importance,
}

impl Mode {
    /// (wl, wc) of a walk that comes from `from` and goes on to `to`.
    #[inline]
    pub fn order(self, from: Vec3A, to: Vec3A) -> (Vec3A, Vec3A) {
        match self {
            Self::Radiance => (to, from),
            Self::Importance => (from, to),
        }
    }
}

/// A point of a material: where on it, and what is around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Texture coordinates.
    pub uv: Vec2,
    /// Index of refraction of what is outside of the boundary here; 0 where it is what the material itself says.
    /// Only dielectrics ask: a solid may stand in air, in water or in glass.
    pub outside: f32,
}

impl From<Vec2> for Site {
    #[inline]
    fn from(uv: Vec2) -> Self {
        Self { uv, outside: 0.0 }
    }
}

/// The smooth lobes of a material for one pair of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfValue {
    /// f(wl → wc), 1/sr, without any cosine.
    pub f: Rgb,
    /// Density per solid angle with which `sample(from = wl)` gives wc.
    pub pdf_lc: f32,
    /// Density per solid angle with which `sample(from = wc)` gives wl.
    pub pdf_cl: f32,
}

impl BsdfValue {
    /// Nothing is scattered, and nothing sampled.
    pub const ZERO: Self = Self { f: Rgb::ZERO, pdf_lc: 0.0, pdf_cl: 0.0 };

    /// The densities as (forward, reverse) of a walk in `mode`.
    #[inline]
    pub fn pdfs(&self, mode: Mode) -> (f32, f32) {
        match mode {
            Mode::Radiance => (self.pdf_cl, self.pdf_lc),
            Mode::Importance => (self.pdf_lc, self.pdf_cl),
        }
    }
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Where the walk goes on to.
    pub to: Vec3A,
    /// f·|cos θ_to| / pdf, over all lobes of the same kind (smooth or specular) that could have made it.
    pub weight: Rgb,
    /// Smooth: density per solid angle of `to`. Specular: the discrete probability of the choice.
    pub pdf: f32,
    /// Smooth: density per solid angle of `from`, as seen from `to`. Specular: the discrete probability of the
    /// reverse choice times dω_to/dω_from, so that pdf_rev/pdf is the ratio of the densities in one measure.
    pub pdf_rev: f32,
    /// True for a Dirac.
    pub specular: bool,
}

impl BsdfSample {
    /// A smooth sample of `value`, made in `mode` from `from` to `to`. `None` where the density is 0.
    #[inline]
    fn smooth(value: &BsdfValue, mode: Mode, to: Vec3A) -> Option<Self> {
        let (pdf, pdf_rev) = value.pdfs(mode);
        if pdf > 0.0 {
            let weight = value.f * (to.z.abs() / pdf);
            Some(Self { to, weight, pdf, pdf_rev, specular: false })
        } else {
            None
        }
    }
}

/// What a surface is made of.
#[derive(Clone, Debug)]
pub enum Material {
    /// Lambertian reflection.
    Diffuse(Diffuse),
    /// Perfect reflection of a fixed colour.
    Mirror(Mirror),
    /// A metal, smooth or rough.
    Conductor(Conductor),
    /// Glass, water and the like, smooth or rough.
    Dielectric(Dielectric),
    /// A diffuse base with a Phong lobe.
    Phong(Phong),
    /// A sum of the others by fixed weights.
    Layered(Layered),
    /// A thin pane, or a share of nothing.
    Thin(Thin),
    /// A diffuse base under a clear coat.
    Plastic(Box<Plastic>),
    /// One material outside, another one inside.
    Sided(Sided),
    /// An index-matched boundary: not there for light.
    Null,
}

impl Material {
    /// f(wl → wc) and both densities, of the smooth lobes. Not to be asked of Null, which scatters nothing.
    #[inline]
    pub fn evaluate(&self, site: impl Into<Site>, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        let site = site.into();
        match self {
            Self::Diffuse(m) => m.evaluate(site.uv, wl, wc),
            Self::Conductor(m) => m.evaluate(site.uv, wl, wc),
            Self::Dielectric(m) => m.evaluate(site, wl, wc),
            Self::Phong(m) => m.evaluate(site.uv, wl, wc),
            Self::Layered(m) => m.evaluate(site, wl, wc),
            Self::Plastic(m) => m.evaluate(site.uv, wl, wc),
            Self::Sided(m) => m.evaluate(site, wl, wc),
            Self::Mirror(_) | Self::Thin(_) | Self::Null => BsdfValue::ZERO,
        }
    }

    /// As [`Self::evaluate`], of unit directions in world space about the unit shading normal `ns`.
    #[inline(always)]
    pub fn evaluate_world(&self, site: Site, ns: Vec3A, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        match self {
            // The commonest, without a call.
            Self::Diffuse(m) => m.evaluate_cosines(site.uv, wl.dot(ns), wc.dot(ns)),
            other => other.evaluate_rarer(site, ns, wl, wc),
        }
    }

    #[inline(never)]
    fn evaluate_rarer(&self, site: Site, ns: Vec3A, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        let frame = Frame::from_normal(ns);
        self.evaluate(site, frame.to_local(wl), frame.to_local(wc))
    }

    /// Density per solid angle with which the smooth lobes give `to` when sampled from `from`. It is the same in both
    /// modes: sampling does not depend on the mode, only the weight does.
    #[inline]
    pub fn pdf(&self, site: impl Into<Site>, from: Vec3A, to: Vec3A) -> f32 {
        self.evaluate(site, from, to).pdf_lc
    }

    /// A direction to go on to. `u`: uniforms in [0, 1), for the lobe and for the direction. `None` where the
    /// sample scatters nothing: below the horizon, grazing, or black.
    pub fn sample(
        &self,
        site: impl Into<Site>,
        from: Vec3A,
        mode: Mode,
        u: (f32, Vec2),
    ) -> Option<BsdfSample> {
        let site = site.into();
        match self {
            Self::Diffuse(m) => m.sample(site.uv, from, u.1),
            Self::Mirror(m) => m.sample(site.uv, from),
            Self::Conductor(m) => m.sample(site.uv, from, mode, u.1),
            Self::Dielectric(m) => m.sample(site, from, mode, u),
            Self::Phong(m) => m.sample(site.uv, from, mode, u),
            Self::Layered(m) => m.sample(site, from, mode, u),
            Self::Thin(m) => m.sample(site.uv, from, u.0),
            Self::Plastic(m) => m.sample(site.uv, from, mode, u),
            Self::Sided(m) => m.sample(site, from, mode, u),
            Self::Null => Some(null::pass(from)),
        }
    }

    /// As [`Self::sample`], of unit directions in world space about the unit shading normal `ns`.
    #[inline(always)]
    pub fn sample_world(
        &self,
        site: Site,
        ns: Vec3A,
        from: Vec3A,
        mode: Mode,
        u: (f32, Vec2),
    ) -> Option<BsdfSample> {
        match self {
            // The commonest, without a call and without a frame.
            Self::Diffuse(m) => m.sample_world(site.uv, ns, from, u.1),
            other => other.sample_rarer(site, ns, from, mode, u),
        }
    }

    #[inline(never)]
    fn sample_rarer(
        &self,
        site: Site,
        ns: Vec3A,
        from: Vec3A,
        mode: Mode,
        u: (f32, Vec2),
    ) -> Option<BsdfSample> {
        let frame = Frame::from_normal(ns);
        let sample = self.sample(site, frame.to_local(from), mode, u)?;
        Some(BsdfSample { to: renormalized(frame.to_world(sample.to)), ..sample })
    }

    /// An estimate of the share of light that is scattered at `uv`, a channel each: exact for diffuse and mirror, at
    /// normal incidence for conductors, the tints for dielectrics. It depends on the point alone.
    pub fn albedo(&self, uv: Vec2) -> Rgb {
        match self {
            Self::Diffuse(m) => m.albedo(uv),
            Self::Mirror(m) => m.albedo(uv),
            Self::Conductor(m) => m.albedo(uv),
            Self::Dielectric(m) => m.albedo(uv),
            Self::Phong(m) => m.albedo(uv),
            Self::Layered(m) => m.albedo(uv),
            Self::Thin(m) => m.albedo(uv),
            Self::Plastic(m) => m.albedo(uv),
            Self::Sided(m) => m.albedo(uv),
            Self::Null => Rgb::ONE,
        }
    }

    /// [`Self::albedo`] averaged over the textures.
    pub fn mean_albedo(&self) -> Rgb {
        match self {
            Self::Diffuse(m) => m.mean_albedo(),
            Self::Mirror(m) => m.mean_albedo(),
            Self::Conductor(m) => m.mean_albedo(),
            Self::Dielectric(m) => m.mean_albedo(),
            Self::Phong(m) => m.mean_albedo(),
            Self::Layered(m) => m.mean_albedo(),
            Self::Thin(m) => m.mean_albedo(),
            Self::Plastic(m) => m.mean_albedo(),
            Self::Sided(m) => m.mean_albedo(),
            Self::Null => Rgb::ONE,
        }
    }

    /// An upper bound of the scattered share of light in any channel, over all points and directions. Above 1 the
    /// material can make light: whoever loads a scene should warn.
    pub fn albedo_bound(&self) -> f32 {
        match self {
            Self::Diffuse(m) => m.albedo_bound(),
            Self::Mirror(m) => m.albedo_bound(),
            Self::Conductor(m) => m.albedo_bound(),
            Self::Dielectric(m) => m.albedo_bound(),
            Self::Phong(m) => m.albedo_bound(),
            Self::Layered(m) => m.albedo_bound(),
            Self::Thin(m) => m.albedo_bound(),
            Self::Plastic(m) => m.albedo_bound(),
            Self::Sided(m) => m.albedo_bound(),
            Self::Null => 1.0,
        }
    }

    /// Probability that a subpath goes on from here: a function of the point alone, so that it is known from both
    /// ends. The albedo's largest channel, at most 1.
    #[inline(always)]
    pub fn continuation(&self, uv: Vec2) -> f32 {
        let albedo = match self {
            // The commonest, without a call.
            Self::Diffuse(m) => m.albedo(uv),
            other => other.albedo(uv),
        };
        albedo.max_element().min(1.0)
    }

    /// True for an index-matched boundary: not a vertex of any path.
    #[inline]
    pub fn is_null(&self) -> bool {
        matches!(self, Self::Null)
    }

    /// The indices of refraction inside and outside of what light passes into; `None` where it passes into nothing.
    pub fn refraction(&self) -> Option<(f32, f32)> {
        match self {
            Self::Dielectric(m) => Some((m.inside(), m.outside())),
            Self::Layered(m) => m.refraction(),
            Self::Diffuse(_) | Self::Mirror(_) | Self::Conductor(_) | Self::Phong(_) => None,
            Self::Thin(_) | Self::Plastic(_) | Self::Sided(_) | Self::Null => None,
        }
    }

    /// True where some lobe can be evaluated, and a connection can end here.
    #[inline(always)]
    pub fn has_smooth(&self) -> bool {
        // The commonest, without a look at a table.
        if let Self::Diffuse(_) = self {
            return true;
        }
        match self {
            Self::Diffuse(_) | Self::Phong(_) | Self::Plastic(_) => true,
            Self::Conductor(m) => m.is_rough(),
            Self::Dielectric(m) => m.is_rough(),
            Self::Layered(m) => m.has_smooth(),
            Self::Sided(m) => m.has_smooth(),
            Self::Mirror(_) | Self::Thin(_) | Self::Null => false,
        }
    }

    /// True where some lobe is a Dirac.
    #[inline]
    pub fn has_specular(&self) -> bool {
        match self {
            Self::Diffuse(_) | Self::Phong(_) => false,
            Self::Conductor(m) => !m.is_rough(),
            Self::Dielectric(m) => !m.is_rough(),
            Self::Layered(m) => m.has_specular(),
            Self::Plastic(m) => m.has_specular(),
            Self::Sided(m) => m.has_specular(),
            Self::Mirror(_) | Self::Thin(_) | Self::Null => true,
        }
    }
}

/// `w` mirrored at the surface: on the other side of it.
#[inline]
fn flip_z(w: Vec3A) -> Vec3A {
    w * Vec3A::new(1.0, 1.0, -1.0)
}

/// `w` reflected about the normal: on the same side.
#[inline]
fn reflect_z(w: Vec3A) -> Vec3A {
    w * Vec3A::new(-1.0, -1.0, 1.0)
}

/// Nearer to the surface than this, a direction is on neither side for a smooth lobe: its cosine is all rounding, and f,
/// which grows as its inverse, would overflow. 1e-14 of the hemisphere's projected solid angle is lost.
const GRAZING: f32 = 1e-7;

/// True for directions that a smooth lobe does not take.
#[inline]
fn grazing(w: Vec3A) -> bool {
    w.z.abs() < GRAZING
}

/// True where both directions lie clearly on the same side.
#[inline]
fn same_side(a: Vec3A, b: Vec3A) -> bool {
    a.z * b.z > 0.0 && !grazing(a) && !grazing(b)
}
