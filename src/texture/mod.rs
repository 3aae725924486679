//! Colours that vary over a surface: constant, image, checker.
//!
//! Texture coordinates: u to the right, v upwards. v = 0 is the lower edge of an image (its last row in memory)
//! and v = 1 the upper edge, as OBJ files have it.

pub mod image;
pub mod load;
#[cfg(test)]
mod tests;

pub use image::{ImageTexture, Wrap};
pub use load::Encoding;

use crate::math::{Rgb, RgbExt};
use glam::{Affine2, Vec2, Vec3};
use std::sync::Arc;

/// A colour at each (u, v). Sixteen bytes, cheap to clone: an image is shared.
#[derive(Clone, Debug)]
pub enum Texture {
    /// The same everywhere. Stored in 12 bytes; see [`Texture::constant`].
    Constant(Vec3),
    /// An image, bilinearly interpolated.
    Image(Arc<ImageTexture>),
    /// Two colours in turn.
    Checker(Arc<Checker>),
}

/// Squares of two colours in turn.
#[derive(Clone, Debug, PartialEq)]
pub struct Checker {
    /// Colour of the square at the origin, 0 ≤ u·scale.x < 1 and 0 ≤ v·scale.y < 1.
    pub even: Vec3,
    /// Colour of its neighbours.
    pub odd: Vec3,
    /// Squares per unit of u and of v.
    pub scale: Vec2,
    /// What becomes of texture coordinates first.
    pub uv: Affine2,
}

impl Texture {
    /// The colour `value` everywhere.
    pub fn constant(value: Rgb) -> Self {
        Self::Constant(Vec3::from(value))
    }

    /// The grey `value` everywhere.
    pub fn grey(value: f32) -> Self {
        Self::Constant(Vec3::splat(value))
    }

    /// An image as a texture.
    pub fn image(image: ImageTexture) -> Self {
        Self::Image(Arc::new(image))
    }

    /// Squares of `even` and `odd` in turn, `scale` of them per unit of u and of v (positive and finite), of texture
    /// coordinates that go through `uv` first.
    pub fn checker(even: Rgb, odd: Rgb, scale: Vec2, uv: Affine2) -> Result<Self, String> {
        if !(scale.is_finite() && scale.min_element() > 0.0) {
            return Err(format!(
                "checker scale must be positive and finite, found [{}, {}]",
                scale.x, scale.y
            ));
        }
        Ok(Self::Checker(Arc::new(Checker { even: even.into(), odd: odd.into(), scale, uv })))
    }

    /// The colour at `uv`.
    #[inline(always)]
    pub fn eval(&self, uv: Vec2) -> Rgb {
        match self {
            Self::Constant(value) => Rgb::from(*value),
            Self::Image(_) | Self::Checker(_) => self.eval_at(uv),
        }
    }

    /// The colour at `uv` where it varies; apart, so that constants are inlined.
    #[inline(never)]
    fn eval_at(&self, uv: Vec2) -> Rgb {
        match self {
            Self::Constant(value) => Rgb::from(*value),
            Self::Image(image) => image.eval(uv),
            Self::Checker(checker) => checker.eval(uv),
        }
    }

    /// Mean over the unit square of (u, v), or over a whole period where that is not the unit square.
    pub fn average(&self) -> Rgb {
        match self {
            Self::Constant(value) => Rgb::from(*value),
            Self::Image(image) => image.average(),
            Self::Checker(checker) => 0.5 * Rgb::from(checker.even + checker.odd),
        }
    }

    /// The largest value of each channel anywhere.
    pub fn max(&self) -> Rgb {
        match self {
            Self::Constant(value) => Rgb::from(*value),
            Self::Image(image) => image.max(),
            Self::Checker(checker) => checker.even.max(checker.odd).into(),
        }
    }

    /// The smallest value of each channel anywhere.
    pub fn min(&self) -> Rgb {
        match self {
            Self::Constant(value) => Rgb::from(*value),
            Self::Image(image) => image.min(),
            Self::Checker(checker) => checker.even.min(checker.odd).into(),
        }
    }

    /// True where every value is a finite number.
    pub fn is_finite(&self) -> bool {
        match self {
            Self::Constant(value) => value.is_finite(),
            Self::Image(_) => true,
            Self::Checker(checker) => checker.even.is_finite() && checker.odd.is_finite(),
        }
    }

    /// True where the texture is black everywhere.
    pub fn is_black(&self) -> bool {
        self.max().is_black() && self.min().is_black()
    }

    /// Checks that the texture can be a reflectance or transmittance called `name`: finite, each channel in 0 to 1.
    pub fn check_reflectance(&self, name: &str) -> Result<(), String> {
        if !self.is_finite() {
            return Err(format!("{name} must be finite numbers from 0 to 1"));
        }
        let (low, high) = (self.min().min_element(), self.max().max_element());
        if low < 0.0 {
            return Err(format!("{name} must be from 0 to 1 in each channel, found {low}"));
        }
        if high > 1.0 {
            return Err(format!("{name} must be from 0 to 1 in each channel, found {high}"));
        }
        Ok(())
    }
}

impl From<Rgb> for Texture {
    fn from(value: Rgb) -> Self {
        Self::constant(value)
    }
}

impl Checker {
    /// The colour at `uv`.
    #[inline]
    pub fn eval(&self, uv: Vec2) -> Rgb {
        let cell = (self.uv.transform_point2(uv) * self.scale).floor();
        // Parity in floating point: exact up to 2^24, and no overflow beyond it.
        let odd = (cell.x + cell.y).rem_euclid(2.0) >= 1.0;
        Rgb::from(if odd { self.odd } else { self.even })
    }
}
