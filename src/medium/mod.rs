//! How light goes through space that is not empty.
//!
//! All that transport knows of a medium it asks [`Medium`]: what is at a point, how much of a stretch of a ray gets
//! through, where along it the next collision is, and where a collision sends it. Nothing outside this module may
//! assume that coefficients are constant: a medium is a function of the point.
//!
//! Extinction may go with the direction, too, as it does where flakes are seen edge on: the coefficients at a point are those
//! of light that meets what is there where most of it is seen, and those of light along ω are [`Medium::area`] of ω times as
//! much. That is one factor along the whole of a ray; optical depths and all that is sampled by them have it.
//!
//! Lengths are metres, coefficients 1/m a colour channel each. A direction is a unit vector, and so a parameter along
//! a ray is a distance.
//!
//! Collisions are sampled only in media that scatter somewhere ([`Medium::scatters`]): a medium that only absorbs
//! ends no edge and dims what crosses it by its exact transmittance. [`free_flight`] says how distances are drawn
//! along an edge that crosses several media, and with what density.

mod decay;
pub mod free_flight;
pub mod grid;
pub mod height;
pub mod homogeneous;
pub mod phase;
pub mod procedural;
#[cfg(test)]
mod tests;
pub mod varying;
pub mod volume;

pub use free_flight::{Draw, Passage};
pub use homogeneous::Homogeneous;
pub use phase::{Phase, PhaseDensities, PhaseSample};
pub use varying::Varying;

use crate::math::{Rgb, Stream};
use glam::{Vec2, Vec3A};

/// What a medium does to light at a point, where it goes in a direction in which [`Medium::area`] is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Extinction: absorption and scattering together, 1/m.
    pub sigma_t: Rgb,
    /// Scattering, 1/m; nowhere above the extinction.
    pub sigma_s: Rgb,
}

impl Coefficients {
    /// The largest channel of σ_s/σ_t, at most 1; channels without extinction do not count.
    #[inline]
    fn continuation(&self) -> f32 {
        let albedo = Rgb::select(self.sigma_t.cmpgt(Rgb::ZERO), self.sigma_s / self.sigma_t, Rgb::ZERO);
        albedo.max_element().min(1.0)
    }
}

/// What fills a part of space.
#[derive(Clone, Debug)]
pub enum Medium {
    /// The same everywhere.
    Homogeneous(Homogeneous),
    /// A function of the place.
    Varying(Box<Varying>),
}

impl Medium {
    /// The coefficients at `p`; of light along ω times [`Self::area`] of ω.
    #[inline(always)]
    pub fn coefficients(&self, p: Vec3A) -> Coefficients {
        match self {
            Self::Homogeneous(m) => m.coefficients(p),
            Self::Varying(m) => m.coefficients(p),
        }
    }

    /// What coefficients are multiplied by for light along the unit direction `dir`, or the opposite one: above 0, 1 at most, and 1 in
    /// all directions but where there are flakes.
    #[inline(always)]
    pub fn area(&self, dir: Vec3A) -> f32 {
        match self {
            Self::Homogeneous(m) => m.area(dir),
            Self::Varying(m) => m.phase().area(dir),
        }
    }

    /// ∫ σ_t, as it is along `dir`, over `t0`..`t1` of `origin` + t·`dir`, a channel each. `t1` may be infinite: then the depth is infinite in
    /// channels in which the medium goes on for ever, and 0 in those in which there is none.
    #[inline(always)]
    pub fn optical_depth(&self, origin: Vec3A, dir: Vec3A, t0: f32, t1: f32) -> Rgb {
        match self {
            Self::Homogeneous(m) => m.optical_depth(origin, dir, t0, t1),
            Self::Varying(m) => m.optical_depth(origin, dir, t0, t1),
        }
    }

    /// Whether collisions are sampled here: false for media that only absorb.
    #[inline(always)]
    pub fn scatters(&self) -> bool {
        match self {
            Self::Homogeneous(m) => m.scatters(),
            Self::Varying(m) => m.scatters(),
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
            Self::Varying(m) => m.invert(origin, dir, t0, t1, channel, depth),
        }
    }

    /// [`Self::invert`] from 0 to `t1`, and the [`Self::optical_depth`] up to there, or over all of it where it ends before that.
    #[inline(always)]
    pub fn fly(
        &self,
        origin: Vec3A,
        dir: Vec3A,
        t1: f32,
        channel: usize,
        depth: f32,
    ) -> (Result<f32, f32>, Rgb) {
        match self {
            Self::Homogeneous(m) => {
                let end = m.invert(origin, dir, 0.0, t1, channel, depth);
                (end, m.optical_depth(origin, dir, 0.0, end.unwrap_or(t1)))
            }
            Self::Varying(m) => m.fly(origin, dir, 0.0, t1, channel, depth),
        }
    }

    /// Whether [`Self::track`] and [`Self::ratio`] may take the place of [`Self::fly`] and [`Self::optical_depth`] here: it scatters, its
    /// extinction varies and is the same in all channels, and is a density on a grid that is not too dense for its voxels.
    #[inline]
    pub fn is_tracked(&self) -> bool {
        match self {
            Self::Homogeneous(_) => false,
            Self::Varying(m) => m.is_tracked(),
        }
    }

    /// The next collision on `origin` + t·`dir`, 0 < t < `t1`, by delta tracking; none where there is none. Only where
    /// [`Self::is_tracked`].
    #[inline]
    pub fn track(&self, origin: Vec3A, dir: Vec3A, t1: f32, random: &mut Stream) -> Option<f32> {
        match self {
            Self::Homogeneous(_) => None,
            Self::Varying(m) => m.track(origin, dir, t1, random),
        }
    }

    /// An estimate of the transmittance from 0 to `t1`, the same in all channels, by ratio tracking. Only where
    /// [`Self::is_tracked`].
    #[inline]
    pub fn ratio(&self, origin: Vec3A, dir: Vec3A, t1: f32, random: &mut Stream) -> f32 {
        match self {
            Self::Homogeneous(_) => 1.0,
            Self::Varying(m) => m.ratio(origin, dir, t1, random),
        }
    }

    /// Where on `origin` + t·`dir`, 0 < t < `t1`, the depth has reached `depth` in all channels, or beyond which there is
    /// nothing any more; `t1` where that is not before it.
    #[inline]
    pub fn reach(&self, origin: Vec3A, dir: Vec3A, t1: f32, depth: f32) -> f32 {
        match self {
            Self::Homogeneous(_) => {
                let end = |channel| self.invert(origin, dir, 0.0, t1, channel, depth).unwrap_or(t1);
                end(0).max(end(1)).max(end(2))
            }
            Self::Varying(m) => m.reach(origin, dir, t1, depth),
        }
    }

    /// Adds to `depths` what [`Self::depth_along`] needs of the beam `origin` + t·`dir`, 0 < t < `length`: nothing where
    /// depths are in closed form. Else the depths at places that are four voxels apart, or as far as 512 places allow.
    #[inline]
    pub fn depths_along(&self, origin: Vec3A, dir: Vec3A, length: f32, depths: &mut Vec<f32>) {
        match self {
            Self::Homogeneous(_) => {}
            Self::Varying(m) => m.depths_along(origin, dir, length, depths),
        }
    }

    /// The optical depth from the beam's start to `t` on it, where `depths` is what [`Self::depths_along`] added for it. What
    /// is between the places is integrated as anywhere: so it is as exact as [`Self::optical_depth`], and the time that it
    /// takes is bounded whatever the beam's length.
    #[inline]
    pub fn depth_along(&self, depths: &[f32], (origin, dir, length): (Vec3A, Vec3A, f32), t: f32) -> Rgb {
        match self {
            Self::Homogeneous(m) => m.optical_depth(origin, dir, 0.0, t),
            Self::Varying(m) => m.depth_along(depths, (origin, dir, length), t),
        }
    }

    /// σ_t as a collision finds it on average, over all directions, 1/m: what the width of kernels goes by.
    pub fn typical_extinction(&self) -> Rgb {
        match self {
            Self::Homogeneous(_) => self.summary().sigma_t,
            Self::Varying(m) => m.typical(),
        }
    }

    /// The phase function at `p` between two directions: its value, which times σ_s of [`Self::coefficients`] is what a path's
    /// contribution has, and the densities per solid angle with which a light subpath that came from `wl` goes on to `wc`, and
    /// a camera subpath from `wc` to `wl`.
    #[inline(always)]
    pub fn phase_densities(&self, p: Vec3A, wl: Vec3A, wc: Vec3A) -> PhaseDensities {
        self.phase().densities(p, wl, wc)
    }

    /// A direction to go on to from a collision at `p`; see [`Phase::sample_at`].
    #[inline(always)]
    pub fn sample_phase(&self, p: Vec3A, from: Vec3A, u: (f32, Vec2)) -> PhaseSample {
        self.phase().sample_at(p, from, u)
    }

    /// How a collision changes the direction.
    #[inline(always)]
    pub fn phase(&self) -> &Phase {
        match self {
            Self::Homogeneous(m) => m.phase(),
            Self::Varying(m) => m.phase(),
        }
    }

    /// Probability that a subpath goes on after a collision at a point with the coefficients `c`: a function of the
    /// point alone, so that it is known from both ends.
    #[inline(always)]
    pub fn continuation(&self, c: &Coefficients) -> f32 {
        match self {
            Self::Homogeneous(m) => m.continuation(),
            Self::Varying(_) => c.continuation(),
        }
    }

    /// Whether it shines.
    #[inline]
    pub fn is_emissive(&self) -> bool {
        match self {
            Self::Homogeneous(m) => m.is_emissive(),
            Self::Varying(m) => m.is_emissive(),
        }
    }

    /// Radiance that the stretch `t0`..`t1` of `origin` + t·`dir` itself sends back to `t0`: ∫ e(t) exp(−∫ σ_t) dt, where e is the
    /// same in all directions.
    /// `t1` may be infinite, see [`Self::shines_without_bound`].
    pub fn emitted(&self, origin: Vec3A, dir: Vec3A, t0: f32, t1: f32) -> Rgb {
        match self {
            Self::Homogeneous(m) => m.emitted(origin, dir, t0, t1),
            Self::Varying(m) => m.emitted(origin, dir, t0, t1),
        }
    }

    /// Whether an endless stretch of it would send back infinite radiance: it shines in a channel in which it does not
    /// absorb. Such a medium must not reach to infinity.
    pub fn shines_without_bound(&self) -> bool {
        match self {
            Self::Homogeneous(m) => m.shines_without_bound(),
            Self::Varying(m) => m.shines_without_bound(),
        }
    }

    /// How many cells of a grid lie along a way of this length (metres); 0 where it is the same everywhere.
    pub fn cells(&self, length: f32) -> f32 {
        match self {
            Self::Homogeneous(_) => 0.0,
            Self::Varying(m) => m.cells(length),
        }
    }

    /// For people.
    pub fn summary(&self) -> MediumSummary {
        match self {
            Self::Homogeneous(m) => m.summary(),
            Self::Varying(m) => m.summary(),
        }
    }
}

/// What there is to tell of a medium; means are over its volume and over all directions.
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
    /// Whether extinction goes with the direction: then there is more and less of it than `sigma_t`.
    pub is_directional: bool,
    /// σ_s/σ_t; 0 in channels without extinction.
    pub albedo: Rgb,
    /// The phase function in words.
    pub phase: String,
    /// Mean cosine of the deflection.
    pub mean_cosine: f32,
}
