//! Phase functions: how a collision changes the direction of light.
//!
//! Both directions are unit vectors and point away from the vertex, `wl` toward the light's side of the path and `wc`
//! toward the camera's: light that goes straight on has wl = −wc, and the cosine of the deflection is −wl·wc. All
//! phase functions here are reciprocal and are sampled exactly: the value is the density of a sample from either side,
//! per solid angle, and a sample's weight is 1.

pub mod henyey_greenstein;
pub mod isotropic;
pub mod mixture;
pub mod rayleigh;

pub use henyey_greenstein::HenyeyGreenstein;
pub use mixture::Mixture;

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
    /// Its value, 1/sr: also the density per solid angle with which `sample(wl)` gives wc, and `sample(wc)` wl.
    #[inline]
    pub fn evaluate(&self, wl: Vec3A, wc: Vec3A) -> f32 {
        match self {
            Self::Isotropic => isotropic::VALUE,
            Self::HenyeyGreenstein(p) => p.evaluate(wl, wc),
            Self::Rayleigh => rayleigh::evaluate(wl, wc),
            Self::Mixture(p) => p.evaluate(wl, wc),
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
        }
    }

    /// The densities per solid angle, at the point `p`, with which a walk that came from `wl` goes on to `wc`, and one from
    /// `wc` to `wl`. The latter is the value: light that is everywhere the same stays so.
    #[inline]
    pub fn densities(&self, _p: Vec3A, wl: Vec3A, wc: Vec3A) -> (f32, f32) {
        let value = self.evaluate(wl, wc);
        (value, value)
    }

    /// [`Self::sample`] at the point `p`, with the density of the way back.
    #[inline]
    pub fn sample_at(&self, _p: Vec3A, from: Vec3A, u: (f32, Vec2)) -> PhaseSample {
        let (to, pdf) = self.sample(from, u);
        PhaseSample { to, pdf, reverse: pdf }
    }

    /// Mean cosine of the deflection: 1 straight on, −1 straight back.
    pub fn mean_cosine(&self) -> f32 {
        match self {
            Self::Isotropic | Self::Rayleigh => 0.0,
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
