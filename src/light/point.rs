//! A point that emits alike in all directions.

use super::{check_colour, check_position};
use crate::math::Rgb;
use glam::Vec3A;
use std::f32::consts::PI;

/// A point light. Directions are sampled uniformly.
#[derive(Clone, Debug)]
pub struct PointLight {
    pub(super) position: Vec3A,
    pub(super) intensity: Rgb,
}

impl PointLight {
    /// Where it is.
    pub fn position(&self) -> Vec3A {
        self.position
    }

    /// At `position`, with `intensity` \[W/sr\].
    ///
    /// # Errors
    /// Where a number is not finite or the intensity is negative.
    pub fn new(position: Vec3A, intensity: Rgb) -> Result<Self, String> {
        check_position("point", position)?;
        check_colour("point", "intensity", intensity)?;
        Ok(Self { position, intensity })
    }

    /// Power in W.
    pub fn power(&self) -> Rgb {
        self.intensity * (4.0 * PI)
    }
}
