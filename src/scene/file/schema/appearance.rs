//! What things look like: emission, textures, materials and lights.

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

/// `image = { file, encoding, wrap }`. v = 0 is the lower edge of the picture.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct ImageDef {
    /// A PNG, EXR or HDR file.
    pub file: Spanned<String>,
    /// How the numbers of a PNG file are meant; EXR and HDR files are always linear. Default `srgb`.
    #[serde(default)]
    pub encoding: Encoding,
    /// What lies outside of the unit square of texture coordinates; default `repeat`.
    #[serde(default)]
    pub wrap: Wrap,
}

/// `checker = { even, odd, squares }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct CheckerDef {
    /// Colour of the square at (0, 0) and every second one.
    pub even: Color<Fraction>,
    /// Colour of the others.
    pub odd: Color<Fraction>,
    /// Squares along u and v; default `[8, 8]`.
    pub squares: Option<Spanned<Pair>>,
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
        /// A metal; smooth or rough (GGX).
        "conductor" => Conductor(ConductorDef),
        /// Glass, water; smooth or rough (GGX).
        "dielectric" => Dielectric(DielectricDef),
        /// A diffuse base and a Phong lobe about the mirror direction.
        "phong" => Phong(PhongDef),
        /// A sum of materials by fixed weights.
        "layered" => Layered(LayeredDef),
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

/// `conductor = { metal, roughness, masking, reflectance }`, or with `eta` and `k` instead of `metal`; with
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
    /// GGX's α, from 0 to 1; default 0: smooth.
    pub roughness: Option<Checked<Fraction>>,
    /// With roughness: how masking and shadowing go together; default `correlated`.
    #[serde(default)]
    pub masking: MaskingKind,
    /// Multiplies what is reflected; default 1.
    pub reflectance: Option<Spanned<Albedo>>,
}

/// `dielectric = { ior, exterior_ior, roughness, masking, reflectance, transmittance }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct DielectricDef {
    /// Index of refraction inside; default 1.5.
    pub ior: Option<Positive>,
    /// Index of refraction outside; default 1.
    pub exterior_ior: Option<Positive>,
    /// GGX's α, from 0 to 1; default 0: smooth.
    pub roughness: Option<Checked<Fraction>>,
    /// With roughness: how masking and shadowing go together; default `correlated`.
    #[serde(default)]
    pub masking: MaskingKind,
    /// Multiplies what is reflected; default 1, which is physical.
    pub reflectance: Option<Spanned<Albedo>>,
    /// Multiplies what is transmitted; default 1, which is physical.
    pub transmittance: Option<Spanned<Albedo>>,
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

/// `spot = { position, target, intensity, inner, cutoff }`.
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

/// `environment = { radiance }` or `environment = { image, scale, rotation }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentDef {
    /// The same from every direction, W/(sr m²).
    pub radiance: Option<Color>,
    /// A latitude-longitude picture, PNG, EXR or HDR.
    pub image: Option<Spanned<String>>,
    /// What the picture is multiplied by; default 1.
    pub scale: Option<NonNegative>,
    /// Turn about the y axis, in degrees; default 0.
    pub rotation: Option<Number>,
}
