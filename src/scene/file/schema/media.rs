//! What fills space.

use crate::scene::file::choice::choice;
use crate::scene::file::values::*;
use serde::Deserialize;
use toml::Spanned;

/// `[medium.NAME]`: `sigma_a` and `sigma_s`, or `sigma_t` and `albedo`; the same everywhere.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct MediumDef {
    /// Absorption, 1/m.
    pub sigma_a: Option<Spanned<Color>>,
    /// Scattering, 1/m.
    pub sigma_s: Option<Spanned<Color>>,
    /// Extinction, that is absorption and scattering together, 1/m.
    pub sigma_t: Option<Spanned<Color>>,
    /// The share of the extinction that is scattering, from 0 to 1.
    pub albedo: Option<Spanned<Color<Fraction>>>,
    /// What the coefficients are multiplied by; default 1. Neither the albedo nor the emission is.
    pub scale: Option<NonNegative>,
    /// Radiance that a metre of it emits, W/(sr m³), the same in all directions; default 0. It is what is said,
    /// whatever the coefficients and their `scale`.
    pub emission: Option<Color>,
    /// How a collision changes the direction; default `"isotropic"`.
    #[serde(default)]
    pub phase: PhaseDef,
}

/// `phase = "isotropic"`, `"rayleigh"`, `{ hg = 0.8 }` or `{ mixture = [{ weight, phase }, …] }`.
#[derive(Debug, Default)]
pub enum PhaseDef {
    /// Alike in all directions.
    #[default]
    Isotropic,
    /// Of particles much smaller than the wavelength.
    Rayleigh,
    /// With numbers of its own.
    Table(PhaseTableDef),
}

choice! {
    /// A phase function that has numbers of its own.
    pub enum PhaseTableDef {
        /// Henyey's and Greenstein's, by its mean cosine: above -1 (straight back) and below 1 (straight on).
        "hg" => HenyeyGreenstein(Spanned<Number>),
        /// A weighted mean; the weights are divided by their sum.
        "mixture" => Mixture(Spanned<Vec<WeightedPhaseDef>>),
    }
}

/// One phase function of a mixture.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct WeightedPhaseDef {
    /// How often it is picked, relative to the others.
    pub weight: Positive,
    /// The phase function. A mixture within a mixture is the mixture of all its parts.
    pub phase: PhaseDef,
}
