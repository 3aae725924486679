//! How light goes through space that is not empty.
//!
//! All that transport knows of a medium it asks [`Medium`]: what is at a point, how much of a stretch of a ray gets
//! through, where along it the next collision is, and where a collision sends it. Nothing outside this module may
//! assume that coefficients are constant: a medium is a function of the point.
//!
//! Lengths are metres, coefficients 1/m a colour channel each. A direction is a unit vector, and so a parameter along
//! a ray is a distance.
//!
//! Collisions are sampled only in media that scatter somewhere ([`Medium::scatters`]): a medium that only absorbs
//! ends no edge and dims what crosses it by its exact transmittance. [`free_flight`] says how distances are drawn
//! along an edge that crosses several media, and with what density.

mod decay;
pub mod free_flight;
pub mod homogeneous;
pub mod phase;
#[cfg(test)]
mod tests;

pub use free_flight::{Draw, Passage};
pub use homogeneous::Homogeneous;
pub use phase::Phase;

use crate::math::Rgb;
use glam::Vec3A;

/// What a medium does to light at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Extinction: absorption and scattering together, 1/m.
    pub sigma_t: Rgb,
    /// Scattering, 1/m; nowhere above the extinction.
    pub sigma_s: Rgb,
}

/// What fills a part of space.
#[derive(Clone, Debug)]
pub enum Medium {
    /// The same everywhere.
    Homogeneous(Homogeneous),
}

impl Medium {
    /// The coefficients at `p`.
    #[inline]
    pub fn coefficients(&self, p: Vec3A) -> Coefficients {
        match self {
            Self::Homogeneous(m) => m.coefficients(p),
        }
    }

    /// ∫ σ_t over `t0`..`t1` of `origin` + t·`dir`, a channel each. `t1` may be infinite: then the depth is infinite in
    /// channels in which the medium goes on for ever, and 0 in those in which there is none.
    #[inline]
    pub fn optical_depth(&self, origin: Vec3A, dir: Vec3A, t0: f32, t1: f32) -> Rgb {
        match self {
            Self::Homogeneous(m) => m.optical_depth(origin, dir, t0, t1),
        }
    }

    /// Whether collisions are sampled here: false for media that only absorb.
    #[inline]
    pub fn scatters(&self) -> bool {
        match self {
            Self::Homogeneous(m) => m.scatters(),
        }
    }

    /// Where the optical depth of `channel`, counted from `t0`, reaches `depth`.
    ///
    /// # Errors
    /// Where the stretch ends before that, the depth that is left over.
    #[inline]
    pub fn invert(
        &self,
        origin: Vec3A,
        dir: Vec3A,
        t0: f32,
        t1: f32,
        channel: usize,
        depth: f32,
    ) -> Result<f32, f32> {
        match self {
            Self::Homogeneous(m) => m.invert(origin, dir, t0, t1, channel, depth),
        }
    }

    /// How a collision changes the direction.
    #[inline]
    pub fn phase(&self) -> &Phase {
        match self {
            Self::Homogeneous(m) => m.phase(),
        }
    }

    /// Probability that a subpath goes on after a collision at a point with the coefficients `c`: a function of the
    /// point alone, so that it is known from both ends. The largest channel of σ_s/σ_t, at most 1; channels without
    /// extinction do not count.
    #[inline]
    pub fn continuation(&self, c: &Coefficients) -> f32 {
        let albedo = Rgb::select(c.sigma_t.cmpgt(Rgb::ZERO), c.sigma_s / c.sigma_t, Rgb::ZERO);
        albedo.max_element().min(1.0)
    }

    /// Whether it shines.
    #[inline]
    pub fn is_emissive(&self) -> bool {
        match self {
            Self::Homogeneous(m) => m.is_emissive(),
        }
    }

    /// Radiance that the stretch `t0`..`t1` of `origin` + t·`dir` itself sends back to `t0`: ∫ e(t) exp(−∫ σ_t) dt.
    /// `t1` may be infinite, see [`Self::shines_without_bound`].
    pub fn emitted(&self, origin: Vec3A, dir: Vec3A, t0: f32, t1: f32) -> Rgb {
        match self {
            Self::Homogeneous(m) => m.emitted(origin, dir, t0, t1),
        }
    }

    /// Whether an endless stretch of it would send back infinite radiance: it shines in a channel in which it does not
    /// absorb. Such a medium must not reach to infinity.
    pub fn shines_without_bound(&self) -> bool {
        match self {
            Self::Homogeneous(m) => m.shines_without_bound(),
        }
    }

    /// For people.
    pub fn summary(&self) -> MediumSummary {
        match self {
            Self::Homogeneous(m) => m.summary(),
        }
    }
}

/// What there is to tell of a medium; means are over its volume.
#[derive(Clone, Debug, PartialEq)]
pub struct MediumSummary {
    /// What kind of medium it is.
    pub kind: &'static str,
    /// Mean extinction, 1/m.
    pub sigma_t: Rgb,
    /// Mean scattering, 1/m.
    pub sigma_s: Rgb,
    /// Mean emission, W/(sr m³).
    pub emission: Rgb,
    /// Mean distance to a collision, 1/σ_t, in metres; infinite in channels without extinction.
    pub mean_free_path: Rgb,
    /// σ_s/σ_t; 0 in channels without extinction.
    pub albedo: Rgb,
    /// The phase function in words.
    pub phase: String,
    /// Mean cosine of the deflection.
    pub mean_cosine: f32,
}
