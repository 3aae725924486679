//! Lights: where light subpaths start, and what camera subpaths connect to.
//!
//! Measures. x₀, the first vertex of a path, is measured
//!   - per area on an area light;
//!   - per solid angle (of the direction toward the light) on an environment light;
//!   - by the discrete probability of having been selected, on a point, spot or directional light: the rest of its
//!     density is a Dirac that meets itself in every quotient.
//!
//! The density of the ray that leaves x₀ is per solid angle for finite lights and per area of the disc that covers
//! the scene, 1/(πR²), for infinite ones. Every density of x₀ contains the probability of selecting the light.
//!
//! Units: radiance in W/(sr m²) for area and environment lights, intensity in W/sr for point and spot lights,
//! irradiance perpendicular to the rays in W/m² for directional lights; linear Rec. 709 each channel.

pub mod area;
pub mod directional;
pub mod environment;
pub mod lights;
pub mod point;
mod reach;
pub mod spot;

#[cfg(test)]
mod tests;

pub use area::AreaLight;
pub use directional::DirectionalLight;
pub use environment::EnvironmentLight;
pub use lights::Lights;
pub use point::PointLight;
pub use spot::{Falloff, SpotLight};

use crate::geometry::Footing;
use crate::math::{Discrete, Rgb};
use glam::Vec3A;

/// One light, of any kind.
#[derive(Clone, Debug)]
pub enum Light {
    /// A shape that emits.
    Area(AreaLight),
    /// A point that emits alike in all directions.
    Point(PointLight),
    /// A point that emits in a cone.
    Spot(SpotLight),
    /// Parallel rays from infinity.
    Directional(DirectionalLight),
    /// Radiance from all directions at infinity.
    Environment(EnvironmentLight),
}

impl Light {
    /// The light's kind as scene files name it.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Area(_) => "area",
            Self::Point(_) => "point",
            Self::Spot(_) => "spot",
            Self::Directional(_) => "directional",
            Self::Environment(_) => "environment",
        }
    }
}

/// A vertex x₀ on a light.
#[derive(Clone, Copy, Debug)]
pub struct LightPoint {
    /// Position. Infinite lights have none: zero.
    pub p: Vec3A,
    /// Area light: unit normal on the side that emits (of a two-sided light: on the side that was sampled; the
    /// outside where the point was found by a ray). Infinite light: unit direction from the scene toward the light.
    /// Point and spot light: zero.
    pub n: Vec3A,
    /// Index of the light.
    pub light: u32,
    /// Area light: the global index of the primitive. Else `u32::MAX`.
    pub prim: u32,
}

impl LightPoint {
    /// The surface that the point lies on, for rays from and to it; `None` but for area lights.
    #[inline(always)]
    pub fn footing(&self) -> Option<Footing> {
        (self.prim != u32::MAX).then_some(Footing { normal: self.n, prim: self.prim })
    }
}

/// The start of a light subpath.
#[derive(Clone, Copy, Debug)]
pub struct EmissionSample {
    /// x₀.
    pub point: LightPoint,
    /// Where the ray starts, before any offset off the surface; for infinite lights on the disc that covers the scene.
    pub origin: Vec3A,
    /// Unit, into the scene.
    pub dir: Vec3A,
    /// Density of x₀ with the probability of the selection: per area, per solid angle (environment), or the
    /// probability of the selection alone (point, spot, directional).
    pub pdf_pos: f32,
    /// Density of the ray after x₀: per solid angle, or for infinite lights per area on the disc.
    pub pdf_dir: f32,
    /// Radiance along the ray; intensity of a point or spot light; irradiance of a directional light.
    pub radiance: Rgb,
}

/// A point x₀ sampled for a connection to a reference point (next-event estimation).
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// x₀.
    pub point: LightPoint,
    /// Unit, from the reference point to the light.
    pub dir: Vec3A,
    /// 1 over the distance (1/m); 0 for infinite lights.
    pub inverse_distance: f32,
    /// Radiance toward the reference point; intensity of a point or spot light; irradiance of a directional light.
    pub radiance: Rgb,
    /// Density of x₀ in its own measure with the probability of the selection (as [`EmissionSample::pdf_pos`], but of
    /// the sampling toward the reference point).
    pub pdf_nee: f32,
    /// What the weights need of x₀: here, where the light is at hand, so that nothing looks it up again.
    pub end: LightEnd,
}

impl LightSample {
    /// [`Lights::pdf_position`] of x₀.
    #[inline(always)]
    pub fn pdf_position(&self, starts: &Discrete) -> f32 {
        starts.pdf(self.point.light as usize) * self.end.pdf_place
    }
}

/// The light's end of the edge of a [`LightSample`].
#[derive(Clone, Copy, Debug)]
pub struct LightEnd {
    /// D₀, see [`Lights::cos_at_light`].
    pub cosine: f32,
    /// [`Lights::pdf_direction`] of the edge.
    pub pdf_direction: f32,
    /// [`Lights::pdf_position`] of x₀, given that its light was selected.
    pub pdf_place: f32,
    /// [`Lights::is_infinite`].
    pub infinite: bool,
    /// [`Lights::is_hittable`].
    pub hittable: bool,
}

/// Refuses what cannot be a radiance, intensity or irradiance.
fn check_colour(kind: &str, what: &str, value: Rgb) -> Result<(), String> {
    if value.is_finite() && value.cmpge(Vec3A::ZERO).all() {
        Ok(())
    } else {
        Err(format!("{kind} light: the {what} {value} must be finite and not negative"))
    }
}

/// Refuses what cannot be a position.
fn check_position(kind: &str, p: Vec3A) -> Result<(), String> {
    if p.is_finite() { Ok(()) } else { Err(format!("{kind} light: the position {p} must be finite")) }
}

/// The unit vector along `d`, or why there is none.
fn check_direction(kind: &str, d: Vec3A) -> Result<Vec3A, String> {
    d.try_normalize().ok_or_else(|| format!("{kind} light: the direction {d} must be finite and not zero"))
}
