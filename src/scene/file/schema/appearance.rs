//! What things look like: emission, textures, materials and lights.

use super::StepDef;
use crate::scene::file::choice::choice;
use crate::scene::file::values::*;
use serde::Deserialize;
use toml::Spanned;

/// `emission = [r, g, b]` or `emission = { radiance = [r, g, b], two_sided = true }`, in W/(sr m²).
#[derive(Debug)]
pub struct EmissionDef {
    /// The same in every direction, W/(sr m²).
    pub radiance: Color,
    /// Whether the back emits too; default: only the outside.
    pub two_sided: bool,
}

/// A colour that varies over a surface: a colour, the name of a texture, or a texture itself. Constant colours
/// have each channel from 0 to 1.
#[derive(Debug)]
pub enum Albedo {
    /// `0.5` or `[0.8, 0.2, 0.1]`.
    Constant(Color<Fraction>),
    /// `"bricks"`: see `[texture.bricks]`.
    Named(String),
    /// `{ checker = {…} }`.
    Inline(Box<TextureDef>),
}

choice! {
    /// `[texture.NAME]`.
    pub enum TextureDef {
        /// One colour, each channel from 0 to 1.
        "constant" => Constant(Color<Fraction>),
        /// A picture.
        "image" => Image(ImageDef),
        /// Squares of two colours.
        "checker" => Checker(CheckerDef),
    }
}

/// `image = { file, encoding, wrap, tint, uv }`. v = 0 is the lower edge of the picture.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct ImageDef {
    /// A PNG, JPEG, EXR or HDR file.
    pub file: Spanned<String>,
    /// How the numbers of a PNG or JPEG file are meant; EXR and HDR files are always linear. Default `srgb`.
    #[serde(default)]
    pub encoding: Encoding,
    /// What lies outside of the unit square of texture coordinates; default `repeat`.
    #[serde(default)]
    pub wrap: Wrap,
    /// Multiplies the picture's colours; default 1.
    pub tint: Option<Color<Fraction>>,
    /// What becomes of texture coordinates first: `[[a, b, c], [d, e, f]]` takes (u, v) to (a u + b v + c, d u + e v + f).
    pub uv: Option<[Triple; 2]>,
}

/// `checker = { even, odd, squares, uv }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct CheckerDef {
    /// Colour of the square at (0, 0) and every second one.
    pub even: Color<Fraction>,
    /// Colour of the others.
    pub odd: Color<Fraction>,
    /// Squares along u and v; default `[8, 8]`.
    pub squares: Option<Spanned<Pair>>,
    /// What becomes of texture coordinates first: `[[a, b, c], [d, e, f]]` takes (u, v) to (a u + b v + c, d u + e v + f).
    pub uv: Option<[Triple; 2]>,
}

/// How the numbers of an image file are meant.
#[derive(Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// sRGB's curve, as photographs and paintings have it.
    #[default]
    Srgb,
    /// Proportional to light.
    Linear,
}

/// What lies outside of the unit square of texture coordinates.
#[derive(Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The nearest texel of the edge.
    Clamp,
}

choice! {
    /// `[material.NAME]`.
    pub enum MaterialDef {
        /// Lambertian reflection.
        "diffuse" => Diffuse(DiffuseDef),
        /// A perfect mirror.
        "mirror" => Mirror(MirrorDef),
        /// A metal; smooth or rough.
        "conductor" => Conductor(ConductorDef),
        /// Glass, water; smooth or rough.
        "dielectric" => Dielectric(DielectricDef),
        /// A diffuse base and a Phong lobe about the mirror direction.
        "phong" => Phong(PhongDef),
        /// A sum of materials by fixed weights.
        "layered" => Layered(LayeredDef),
        /// A thin pane of glass: it reflects, and lets through straight on what it does not.
        "thin" => Thin(ThinDef),
        /// A diffuse base under a clear coat; smooth or rough.
        "plastic" => Plastic(PlasticDef),
        /// One opaque material on the outside, another one inside.
        "sided" => Sided(SidedDef),
        /// No surface at all: a boundary that light crosses unchanged.
        "null" => Null(NullDef),
    }
}

/// `diffuse = { reflectance }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct DiffuseDef {
    /// Default 0.5.
    pub reflectance: Option<Spanned<Albedo>>,
}

/// `mirror = { reflectance }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct MirrorDef {
    /// Default 1.
    pub reflectance: Option<Spanned<Albedo>>,
}

/// `conductor = { metal, roughness, distribution, masking, reflectance }`, or with `eta` and `k` instead of `metal`; with
/// `reflectance` alone it reflects that from every direction, without Fresnel's formula.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct ConductorDef {
    /// A metal by its name or symbol, such as `gold` or `Au`.
    pub metal: Option<Spanned<String>>,
    /// The real part of the index of refraction, relative to the outside.
    pub eta: Option<Color<AboveZero>>,
    /// The imaginary part of the index of refraction, relative to the outside.
    pub k: Option<Color>,
    /// α of the facets, from 0 to 1; default 0: smooth.
    pub roughness: Option<Checked<Fraction>>,
    /// With roughness: how the facets' normals are distributed; default `ggx`.
    #[serde(default)]
    pub distribution: DistributionKind,
    /// With roughness: how masking and shadowing go together; default `correlated`.
    #[serde(default)]
    pub masking: MaskingKind,
    /// Multiplies what is reflected; default 1.
    pub reflectance: Option<Spanned<Albedo>>,
}

/// `dielectric = { ior, exterior_ior, roughness, distribution, masking, reflectance, transmittance }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct DielectricDef {
    /// Index of refraction inside; default 1.5.
    pub ior: Option<Positive>,
    /// Index of refraction outside; default 1.
    pub exterior_ior: Option<Positive>,
    /// α of the facets, from 0 to 1; default 0: smooth.
    pub roughness: Option<Checked<Fraction>>,
    /// With roughness: how the facets' normals are distributed; default `ggx`.
    #[serde(default)]
    pub distribution: DistributionKind,
    /// With roughness: how masking and shadowing go together; default `correlated`.
    #[serde(default)]
    pub masking: MaskingKind,
    /// Multiplies what is reflected; default 1, which is physical.
    pub reflectance: Option<Spanned<Albedo>>,
    /// Multiplies what is transmitted; default 1, which is physical.
    pub transmittance: Option<Spanned<Albedo>>,
}

/// How the normals of a rough surface's facets are distributed.
#[derive(Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum DistributionKind {
    /// With long tails, as of ground glass.
    #[default]
    Ggx,
    /// Of slopes that are distributed normally.
    Beckmann,
}

/// How masking and shadowing of a rough surface's facets go together.
#[derive(Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum MaskingKind {
    /// By the facet's height, which they share.
    #[default]
    Correlated,
    /// Independently, as other renderers have it; for comparison with them.
    Separable,
}

/// `phong = { diffuse, specular, exponent }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct PhongDef {
    /// The base's reflectance; default 0.
    pub diffuse: Option<Spanned<Albedo>>,
    /// The lobe's reflectance at normal incidence; default 0.
    pub specular: Option<Spanned<Albedo>>,
    /// The lobe's exponent.
    pub exponent: NonNegative,
}

/// `layered = { layers = [{ material, weight }, …] }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct LayeredDef {
    /// At least one.
    pub layers: Spanned<Vec<LayerDef>>,
}

/// `thin = { ior, exterior_ior, reflectance, transmittance }`. With `ior = 1` it is a share of nothing, which only lets
/// through.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct ThinDef {
    /// Index of refraction of the pane; default 1.5.
    pub ior: Option<Positive>,
    /// Index of refraction on both sides of it; default 1.
    pub exterior_ior: Option<Positive>,
    /// Multiplies what is reflected; default 1.
    pub reflectance: Option<Spanned<Albedo>>,
    /// Multiplies what is let through; default 1.
    pub transmittance: Option<Spanned<Albedo>>,
}

/// `plastic = { diffuse, specular, ior, exterior_ior, roughness, distribution, masking, nonlinear }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct PlasticDef {
    /// The base's reflectance; default 0.5.
    pub diffuse: Option<Spanned<Albedo>>,
    /// Multiplies what the coat reflects; default 1.
    pub specular: Option<Spanned<Albedo>>,
    /// Index of refraction of the coat; default 1.5.
    pub ior: Option<Positive>,
    /// Index of refraction outside; default 1.
    pub exterior_ior: Option<Positive>,
    /// α of the coat's facets, from 0 to 1; default 0: smooth.
    pub roughness: Option<Checked<Fraction>>,
    /// With roughness: how the facets' normals are distributed; default `ggx`.
    #[serde(default)]
    pub distribution: DistributionKind,
    /// With roughness: how masking and shadowing go together; default `correlated`.
    #[serde(default)]
    pub masking: MaskingKind,
    /// Whether the base's colour deepens by light that the coat throws back to it; default false: as if the base were
    /// white for that light.
    #[serde(default)]
    pub nonlinear: bool,
}

/// `sided = { front, back }`: names of opaque materials, each neither layered nor sided itself; a side without one
/// reflects nothing.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct SidedDef {
    /// On the outside.
    pub front: Option<Spanned<String>>,
    /// On the inside.
    pub back: Option<Spanned<String>>,
}

/// `null = {}`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct NullDef {}

/// One addend of a layered material.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct LayerDef {
    /// The name of a material that is neither layered nor null.
    pub material: Spanned<String>,
    /// What it is multiplied by. Weights that add up to more than 1 can make light, and are warned about.
    pub weight: NonNegative,
}

/// `[[light]]`: exactly one of the kinds.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct LightDef {
    /// For `tyndall info`; default: its kind and number.
    pub name: Option<String>,
    /// From one point in all directions.
    pub point: Option<Spanned<PointDef>>,
    /// From one point into a cone.
    pub spot: Option<Spanned<SpotDef>>,
    /// From one direction everywhere.
    pub directional: Option<Spanned<DirectionalDef>>,
    /// From all directions; at most one a scene.
    pub environment: Option<Spanned<EnvironmentDef>>,
}

/// `point = { position, intensity }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct PointDef {
    /// Where it is.
    pub position: Triple,
    /// W/sr.
    pub intensity: Color,
}

/// `spot = { position, target, intensity, inner, cutoff, falloff }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct SpotDef {
    /// Where it is.
    pub position: Triple,
    /// A point on its axis.
    pub target: Triple,
    /// On the axis, W/sr.
    pub intensity: Color,
    /// Half angle of the cone of full intensity, degrees; default: three quarters of the cutoff.
    pub inner: Option<Spanned<NonNegative>>,
    /// Half angle outside of which there is no light, degrees, at most 90; default 30.
    pub cutoff: Option<Spanned<Positive>>,
    /// How the intensity falls between the two; default `smooth`.
    #[serde(default)]
    pub falloff: FalloffKind,
}

/// How a spot's intensity falls from its inner angle to its cutoff.
#[derive(Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum FalloffKind {
    /// A smooth step of the cosine.
    #[default]
    Smooth,
    /// In proportion to the angle.
    Linear,
}

/// `directional = { direction, irradiance }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct DirectionalDef {
    /// Where the light travels to, of any length.
    pub direction: Triple,
    /// On a surface across it, W/m².
    pub irradiance: Color,
}

/// `environment = { radiance }` or `environment = { image, scale, rotation, transform }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentDef {
    /// The same from every direction, W/(sr m²).
    pub radiance: Option<Color>,
    /// A latitude-longitude picture, PNG, JPEG, EXR or HDR.
    pub image: Option<Spanned<String>>,
    /// What the picture is multiplied by; default 1.
    pub scale: Option<NonNegative>,
    /// Turn about the y axis, in degrees; default 0.
    pub rotation: Option<Number>,
    /// Steps after that turn, which have to come to a rotation, or one with a reflection; default: none.
    #[serde(default)]
    pub transform: Vec<Spanned<StepDef>>,
}
