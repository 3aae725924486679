//! Phase functions: how a collision changes the direction of light.
//!
//! Both directions are unit vectors and point away from the vertex, `wl` toward the light's side of the path and `wc`
//! toward the camera's: light that goes straight on has wl = −wc, and the cosine of the deflection is −wl·wc. All
//! phase functions here are sampled exactly, and but for [`sggx`] they are reciprocal: the value is the density of a sample
//! from either side, per solid angle, and a sample's weight is 1.

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

/// A direction to go on to.
#[derive(Clone, Copy, Debug)]
pub struct PhaseSample {
    /// Unit direction, away from the vertex.
    pub to: Vec3A,
    /// Its density per solid angle, for a walk that came from where it came from.
    pub pdf: f32,
    /// Density per solid angle with which a walk that came from `to` goes on to where this one came from.
    pub reverse: f32,
}

impl Phase {
    /// Its value, 1/sr: also the density per solid angle with which `sample(wl)` gives wc, and `sample(wc)` wl, but for
    /// those of which [`Self::densities`] says something else. Of one that varies by place, at the origin.
    #[inline]
    pub fn evaluate(&self, wl: Vec3A, wc: Vec3A) -> f32 {
        match self {
            Self::Isotropic => isotropic::VALUE,
            Self::HenyeyGreenstein(p) => p.evaluate(wl, wc),
            Self::Rayleigh => rayleigh::evaluate(wl, wc),
            Self::Mixture(p) => p.evaluate(wl, wc),
            Self::Draine(p) => p.evaluate(wl, wc),
            Self::Tabulated(p) => p.evaluate(wl, wc),
            Self::Sggx(p) => p.densities(wl, wc).1,
            Self::ByPlace(p) => p.densities(Vec3A::ZERO, wl, wc).1,
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
                (to, p.densities(from, to).0)
            }
            Self::ByPlace(p) => {
                let sample = p.sample(Vec3A::ZERO, from, u);
                (sample.to, sample.pdf)
            }
        }
    }

    /// The densities per solid angle, at the point `p`, with which a walk that came from `wl` goes on to `wc`, and one from
    /// `wc` to `wl`. The latter is the value: light that is everywhere the same stays so.
    #[inline]
    pub fn densities(&self, p: Vec3A, wl: Vec3A, wc: Vec3A) -> (f32, f32) {
        match self {
            Self::Sggx(phase) => phase.densities(wl, wc),
            Self::ByPlace(phase) => phase.densities(p, wl, wc),
            _ => {
                let value = self.evaluate(wl, wc);
                (value, value)
            }
        }
    }

    /// [`Self::sample`] at the point `p`, with the density of the way back.
    #[inline]
    pub fn sample_at(&self, p: Vec3A, from: Vec3A, u: (f32, Vec2)) -> PhaseSample {
        match self {
            Self::Sggx(phase) => {
                let to = phase.sample(from, u.1);
                let (pdf, reverse) = phase.densities(from, to);
                PhaseSample { to, pdf, reverse }
            }
            Self::ByPlace(phase) => phase.sample(p, from, u),
            _ => {
                let (to, pdf) = self.sample(from, u);
                PhaseSample { to, pdf, reverse: pdf }
            }
        }
    }

    /// Mean cosine of the deflection: 1 straight on, −1 straight back.
    pub fn mean_cosine(&self) -> f32 {
        match self {
            // Of flakes it varies with the direction that light comes from; over all of them it is 0.
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
