//! Parallel rays from infinity.

use super::{check_colour, check_direction};
use crate::math::Rgb;
use glam::Vec3A;

/// A directional light, such as the sun if it were a point.
#[derive(Clone, Debug)]
pub struct DirectionalLight {
    /// Unit, from the scene toward the light.
    pub(super) toward: Vec3A,
    pub(super) irradiance: Rgb,
}

impl DirectionalLight {
    /// Rays that travel along `direction` (of any length), with `irradiance` \[W/m²\] on a surface that they meet
    /// perpendicularly.
    ///
    /// # Errors
    /// Where the direction is zero or a number is negative or not finite.
    pub fn new(direction: Vec3A, irradiance: Rgb) -> Result<Self, String> {
        let toward = -check_direction("directional", direction)?;
        check_colour("directional", "irradiance", irradiance)?;
        Ok(Self { toward, irradiance })
    }
}
