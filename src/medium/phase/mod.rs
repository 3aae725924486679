//! Phase functions: how a collision changes the direction of light.
//!
//! Both directions are unit vectors and point away from the vertex, `wl` toward the light's side of the path and `wc`
//! toward the camera's: light that goes straight on has wl = −wc, and the cosine of the deflection is −wl·wc. All
//! phase functions here are sampled exactly.
//!
//! What collides with light may be seen from its direction ω with more or less area, σ(ω) relative to the largest, as flakes
//! are ([`sggx`]): [`Phase::area`]. σ_t and σ_s of light along ω are then a medium's coefficients at the place times σ(ω). That
//! factor is in a phase function's value, so that all are reciprocal: the value is σ(ω) times the density, per solid angle, of
//! a sample for a walk that came from ω, whichever of the two directions that is. What is no flake has σ = 1, and its value is the
//! density.

pub mod by_place;
pub mod droplets;
pub mod henyey_greenstein;
pub mod isotropic;
pub mod mixture;
pub mod rayleigh;
pub mod sggx;
pub mod tabulated;

pub use by_place::ByPlace;
pub use droplets::{Draine, droplets};
pub use henyey_greenstein::HenyeyGreenstein;
pub use mixture::Mixture;
pub use sggx::Sggx;
pub use tabulated::Tabulated;

use crate::math::{Frame, trig};
use glam::{Vec2, Vec3A};

/// A phase function.
#[derive(Clone, Debug, PartialEq)]
pub enum Phase {
    /// The same in all directions.
    Isotropic,
    /// One lobe forward or backward.
    HenyeyGreenstein(HenyeyGreenstein),
    /// Of particles much smaller than the wavelength.
    Rayleigh,
    /// A weighted mean of the others.
    Mixture(Mixture),
    /// A lobe forward with a rise at the back.
    Draine(Draine),
    /// By a table.
    Tabulated(Tabulated),
    /// Of fibres and flakes.
    Sggx(Sggx),
    /// A mixture of two that varies by place.
    ByPlace(Box<ByPlace>),
}

/// A phase function between two directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseDensities {
    /// The value, 1/sr: the same from either side.
    pub value: f32,
    /// Density per solid angle with which a light subpath goes on: the value over σ(wl).
    pub light: f32,
    /// Density per solid angle with which a camera subpath goes on: the value over σ(wc).
    pub camera: f32,
}

impl PhaseDensities {
    /// Of what looks alike from all sides: the value is the density of either.
    #[inline]
    const fn even(value: f32) -> Self {
        Self { value, light: value, camera: value }
    }
}

/// A direction to go on to.
#[derive(Clone, Copy, Debug)]
pub struct PhaseSample {
    /// Unit direction, away from the vertex.
    pub to: Vec3A,
    /// Its density per solid angle, for a walk that came from where it came from.
    pub pdf: f32,
    /// Density per solid angle with which a walk that came from `to` goes on to where this one came from.
    pub reverse: f32,
    /// The value over `pdf`: σ of where the walk came from.
    pub weight: f32,
}

impl PhaseSample {
    #[inline]
    const fn even(to: Vec3A, pdf: f32) -> Self {
        Self { to, pdf, reverse: pdf, weight: 1.0 }
    }
}

impl Phase {
    /// Whether what collides is seen from some directions more than from others.
    #[inline]
    pub fn is_directional(&self) -> bool {
        match self {
            Self::Sggx(_) => true,
            Self::Mixture(p) => p.is_directional(),
            _ => false,
        }
    }

    /// σ(`w`): how much of what collides is seen from the unit direction `w`, or from the opposite one, relative to where it is seen
    /// best. Coefficients of light along `w` are those of the place times this.
    #[inline]
    pub fn area(&self, w: Vec3A) -> f32 {
        match self {
            Self::Sggx(p) => p.area(w),
            Self::Mixture(p) => p.area(w),
            _ => 1.0,
        }
    }

    /// [`Self::area`], the mean over all directions.
    pub fn mean_area(&self) -> f32 {
        match self {
            Self::Sggx(p) => p.mean_area(),
            Self::Mixture(p) => p.mean_area(),
            _ => 1.0,
        }
    }

    /// Its value, 1/sr: also the density per solid angle with which `sample(wl)` gives wc, and `sample(wc)` wl, but where it
    /// [`Self::is_directional`]. Of one that varies by place, at the origin.
    #[inline]
    pub fn evaluate(&self, wl: Vec3A, wc: Vec3A) -> f32 {
        match self {
            Self::Isotropic => isotropic::VALUE,
            Self::HenyeyGreenstein(p) => p.evaluate(wl, wc),
            Self::Rayleigh => rayleigh::evaluate(wl, wc),
            Self::Mixture(p) => p.evaluate(wl, wc),
            Self::Draine(p) => p.evaluate(wl, wc),
            Self::Tabulated(p) => p.evaluate(wl, wc),
            Self::Sggx(p) => p.value(wl, wc),
            Self::ByPlace(p) => p.value(Vec3A::ZERO, wl, wc),
        }
    }

    /// A direction to go on to, away from the vertex, for a walk that came from the direction `from` (away from the
    /// vertex too), and its density per solid angle. `u`: uniforms in [0, 1), for the lobe and for the direction.
    #[inline]
    pub fn sample(&self, from: Vec3A, u: (f32, Vec2)) -> (Vec3A, f32) {
        match self {
            Self::Isotropic => isotropic::sample(u.1),
            Self::HenyeyGreenstein(p) => p.sample(from, u.1),
            Self::Rayleigh => rayleigh::sample(from, u.1),
            Self::Mixture(p) => p.sample(from, u),
            Self::Draine(p) => p.sample(from, u.1),
            Self::Tabulated(p) => p.sample(from, u.1),
            Self::Sggx(p) => {
                let to = p.sample(from, u.1);
                (to, p.value(from, to) / p.area(from))
            }
            Self::ByPlace(p) => {
                let sample = p.sample(Vec3A::ZERO, from, u);
                (sample.to, sample.pdf)
            }
        }
    }

    /// The value at the point `p`, and the densities of a light subpath that came from `wl` and goes on to `wc`, and of a camera
    /// subpath from `wc` to `wl`.
    #[inline(always)]
    pub fn densities(&self, p: Vec3A, wl: Vec3A, wc: Vec3A) -> PhaseDensities {
        match self {
            // The commonest, without a call.
            Self::Isotropic => PhaseDensities::even(isotropic::VALUE),
            Self::HenyeyGreenstein(phase) => PhaseDensities::even(phase.evaluate(wl, wc)),
            _ => self.rarer_densities(p, wl, wc),
        }
    }

    #[inline(never)]
    fn rarer_densities(&self, p: Vec3A, wl: Vec3A, wc: Vec3A) -> PhaseDensities {
        let value = match self {
            Self::Sggx(phase) => phase.value(wl, wc),
            Self::Mixture(phase) if phase.is_directional() => phase.evaluate(wl, wc),
            Self::ByPlace(phase) => return PhaseDensities::even(phase.value(p, wl, wc)),
            _ => return PhaseDensities::even(self.evaluate(wl, wc)),
        };
        PhaseDensities { value, light: value / self.area(wl), camera: value / self.area(wc) }
    }

    /// [`Self::sample`] at the point `p`, with the density of the way back.
    #[inline(always)]
    pub fn sample_at(&self, p: Vec3A, from: Vec3A, u: (f32, Vec2)) -> PhaseSample {
        let (to, pdf) = match self {
            // The commonest, without a call.
            Self::Isotropic => isotropic::sample(u.1),
            Self::HenyeyGreenstein(phase) => phase.sample(from, u.1),
            _ => return self.rarer_sample_at(p, from, u),
        };
        PhaseSample::even(to, pdf)
    }

    #[inline(never)]
    fn rarer_sample_at(&self, p: Vec3A, from: Vec3A, u: (f32, Vec2)) -> PhaseSample {
        match self {
            Self::ByPlace(phase) => phase.sample(p, from, u),
            _ => {
                let (to, pdf) = self.sample(from, u);
                if !self.is_directional() {
                    return PhaseSample::even(to, pdf);
                }
                let weight = self.area(from);
                PhaseSample { to, pdf, reverse: pdf * weight / self.area(to), weight }
            }
        }
    }

    /// Mean cosine of the deflection: 1 straight on, −1 straight back.
    pub fn mean_cosine(&self) -> f32 {
        match self {
            // Of flakes it varies with the direction that light comes from; over all of them, as often as they are met, it is 0.
            Self::Isotropic | Self::Rayleigh | Self::Sggx(_) => 0.0,
            Self::Draine(p) => p.mean_cosine(),
            Self::Tabulated(p) => p.mean_cosine(),
            Self::ByPlace(p) => p.mean_cosine(),
            Self::HenyeyGreenstein(p) => p.mean_cosine(),
            Self::Mixture(p) => p.mean_cosine(),
        }
    }

    /// In words.
    pub fn describe(&self) -> String {
        match self {
            Self::Isotropic => "isotropic".into(),
            Self::HenyeyGreenstein(p) => p.describe(),
            Self::Rayleigh => "Rayleigh".into(),
            Self::Mixture(p) => p.describe(),
            Self::Draine(p) => p.describe(),
            Self::Tabulated(p) => p.describe(),
            Self::Sggx(p) => p.describe(),
            Self::ByPlace(p) => p.describe(),
        }
    }
}

/// The direction at the cosine 1 − `versine` to `axis`, turned about it by `turn` of a full turn.
#[inline]
fn about(axis: Vec3A, versine: f32, turn: f32) -> Vec3A {
    let sin_theta = (versine * (2.0 - versine)).max(0.0).sqrt();
    let (sin, cos) = trig::sin_cos_turns(turn);
    Frame::from_normal(axis).to_world(Vec3A::new(sin_theta * cos, sin_theta * sin, 1.0 - versine))
}
