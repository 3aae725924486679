//! What fills space.

use super::StepDef;
use crate::scene::file::choice::choice;
use crate::scene::file::values::*;
use serde::Deserialize;
use toml::Spanned;

/// `[medium.NAME]`: `sigma_a` and `sigma_s`, or `sigma_t` and `albedo`; the same everywhere, or times a `density`. Or
/// coefficients by place, as grids.
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
    /// What the coefficients are multiplied by, those of grids too; default 1. Neither the albedo nor the emission is.
    pub scale: Option<NonNegative>,
    /// Radiance that a metre of it emits, W/(sr m³), the same in all directions; default 0. It is what is said,
    /// whatever the coefficients and their `scale`; where there is a `density`, it is multiplied by it, and where there is an
    /// `emission_grid`, by that one alone.
    pub emission: Option<Color>,
    /// How a collision changes the direction; default `"isotropic"`.
    #[serde(default)]
    pub phase: PhaseDef,
    /// By place, what the coefficients are multiplied by; nothing is outside of it.
    pub density: Option<Spanned<DensityDef>>,
    /// The albedo by place, instead of `albedo`; beside `sigma_t` with a `density`, or `sigma_t_grid`.
    pub albedo_grid: Option<Spanned<GridDef>>,
    /// Extinction by place, 1/m, instead of `sigma_t`.
    pub sigma_t_grid: Option<Spanned<GridDef>>,
    /// Absorption by place, 1/m; beside `sigma_s_grid`, of the same size and place.
    pub sigma_a_grid: Option<Spanned<GridDef>>,
    /// Scattering by place, 1/m.
    pub sigma_s_grid: Option<Spanned<GridDef>>,
    /// What the `emission` is multiplied by, by place.
    pub emission_grid: Option<Spanned<GridDef>>,
}

choice! {
    /// A density by place.
    pub enum DensityDef {
        /// On a grid of one number a value.
        "grid" => Grid(GridDef),
        /// Haze that thins out with height.
        "height" => Height(HeightDef),
        /// A round cloud of noise.
        "puff" => Puff(PuffDef),
        /// A column of smoke.
        "plume" => Plume(PlumeDef),
        /// Noise in a box.
        "noise" => Noise(NoiseDef),
    }
}

/// A grid from a file.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct GridDef {
    /// A `.grid`, `.vol` or `.vdb` file, relative to the scene file.
    pub file: Spanned<String>,
    /// Which grid of a `.vdb` file with more than one.
    pub name: Option<String>,
    /// What is between the values; default `"trilinear"`.
    #[serde(default)]
    pub interpolation: InterpolationDef,
    /// What the values are multiplied by; default 1.
    pub scale: Option<NonNegative>,
    /// A corner of the grid's box, instead of what the file says; the unit cube where neither does.
    pub min: Option<Spanned<Triple>>,
    /// The opposite corner.
    pub max: Option<Spanned<Triple>>,
    /// Steps that the box is then put to its place by; default: none.
    #[serde(default)]
    pub transform: Vec<Spanned<StepDef>>,
}

/// What is between the values of a grid.
#[derive(Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum InterpolationDef {
    /// Means of the eight about.
    #[default]
    Trilinear,
    /// Each value fills its voxel.
    Constant,
}

/// `height = { level, scale }`: 1 up to a level, and e times less every `scale` metres above it.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct HeightDef {
    /// Height of the level along `up`; default 0.
    pub level: Option<Number>,
    /// In metres.
    pub scale: Positive,
    /// Default `[0, 1, 0]`.
    pub up: Option<Triple>,
}

/// `puff = { center, radius }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct PuffDef {
    /// Default: the origin.
    pub center: Option<Triple>,
    /// Of the sphere that it does not leave.
    pub radius: Positive,
    /// How frayed it is; default 0.7.
    pub roughness: Option<Number>,
    /// Another number is another puff; default 1.
    pub seed: Option<Count<0>>,
    /// Of the noise; default 5.
    pub octaves: Option<Count<1>>,
    /// Voxels along an edge; default 64.
    pub resolution: Option<Count<1>>,
}

/// `plume = { base, height, radius }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct PlumeDef {
    /// Where it rises from; default: the origin.
    pub base: Option<Triple>,
    /// How high, along the y axis.
    pub height: Positive,
    /// How wide it is at the top, about.
    pub radius: Positive,
    /// Another number is another plume; default 1.
    pub seed: Option<Count<0>>,
    /// Of the noise; default 5.
    pub octaves: Option<Count<1>>,
    /// Voxels along the longest edge; default 96.
    pub resolution: Option<Count<1>>,
}

/// `noise = { min, max, size }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct NoiseDef {
    /// A corner of the box.
    pub min: Triple,
    /// The opposite corner.
    pub max: Triple,
    /// Of the largest features, in metres.
    pub size: Positive,
    /// The share of the density that is the same everywhere, from 0 to 1; default 0.
    pub base: Option<Number>,
    /// Another number is another noise; default 1.
    pub seed: Option<Count<0>>,
    /// Default 5.
    pub octaves: Option<Count<1>>,
    /// Voxels along the longest edge; default 64.
    pub resolution: Option<Count<1>>,
}

/// `phase = "isotropic"`, `"rayleigh"`, or a table with one key, such as `{ hg = 0.8 }`.
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
        /// A weighted mean; the weights are divided by their sum. With fibres or flakes extinction is the weighted sum of what is seen of each.
        "mixture" => Mixture(Spanned<Vec<WeightedPhaseDef>>),
        /// Droplets of water, by their diameter in micrometres: 5 to 50.
        "droplets" => Droplets(Spanned<Number>),
        /// Pairs [cosine of the deflection, value], from -1 (straight back) to 1 (straight on); linear between them.
        "table" => Tabulated(Spanned<Vec<Pair>>),
        /// Fibres: the way they lie, and how unlike they lie. Extinction goes with how much of them is seen: the medium's is that across them.
        "fibres" => Fibres(Spanned<FlakesDef>),
        /// Flakes: the way that most of them face. Extinction goes with how much of them is seen: the medium's is that along this way.
        "flakes" => Flakes(Spanned<FlakesDef>),
        /// Two phase functions, neither with fibres or flakes in it, and a grid of the share of the second.
        "by_place" => ByPlace(Box<Spanned<ByPlaceDef>>),
    }
}

/// `flakes = { axis, roughness }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct FlakesDef {
    /// Of any length.
    pub axis: Triple,
    /// From 0.01, all alike, to 1, turned anyhow.
    pub roughness: Positive,
}

/// `by_place = { first, second, share }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct ByPlaceDef {
    /// Where the share is 0.
    pub first: PhaseDef,
    /// Where the share is 1.
    pub second: PhaseDef,
    /// From 0 to 1.
    pub share: Spanned<GridDef>,
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
