//! A shape that emits the same radiance from all of its outside.

use super::check_colour;
use crate::math::{Frame, Rgb, warp};
use glam::{Vec2, Vec3A};
use std::f32::consts::PI;

/// A shape that emits. Directions are sampled by the cosine to the normal.
#[derive(Clone, Debug)]
pub struct AreaLight {
    /// Index of the shape.
    pub(super) shape: u32,
    /// Radiance.
    pub(super) radiance: Rgb,
    /// Emits from its inside too.
    pub(super) two_sided: bool,
}

impl AreaLight {
    /// The shape of index `shape` emits `radiance` \[W/(sr m²)\] from its outside, and from its inside too where
    /// `two_sided`.
    ///
    /// # Errors
    /// Where the radiance is negative or not finite.
    pub fn new(shape: u32, radiance: Rgb, two_sided: bool) -> Result<Self, String> {
        check_colour("area", "radiance", radiance)?;
        Ok(Self { shape, radiance, two_sided })
    }

    /// Index of the shape.
    pub fn shape(&self) -> u32 {
        self.shape
    }

    /// Power in W, given the shape's area in m².
    pub fn power(&self, area: f32) -> Rgb {
        self.radiance * (PI * area * if self.two_sided { 2.0 } else { 1.0 })
    }

    /// Radiance from a point with the normal `n` along `dir_out`.
    #[inline]
    pub(super) fn emitted(&self, n: Vec3A, dir_out: Vec3A) -> Rgb {
        self.emitted_at(n.dot(dir_out))
    }

    /// The same by the cosine of the direction to the normal.
    #[inline(always)]
    pub(super) fn emitted_at(&self, cos: f32) -> Rgb {
        if self.two_sided || cos > 0.0 { self.radiance } else { Rgb::ZERO }
    }

    /// A direction from a point whose outside is `ng`, the normal on its side, and its density per solid angle.
    #[inline]
    pub(super) fn sample_direction(&self, ng: Vec3A, mut u: Vec2) -> (Vec3A, Vec3A, f32) {
        let (mut n, mut side) = (ng, 1.0);
        if self.two_sided {
            side = 0.5;
            u.x *= 2.0;
            if u.x >= 1.0 {
                u.x -= 1.0;
                n = -ng;
            }
        }
        let local = warp::cosine_hemisphere(u);
        (Frame::from_normal(n).to_world(local), n, side * warp::cosine_hemisphere_pdf(local.z))
    }

    /// Density of [`Self::sample_direction`] per solid angle.
    #[inline]
    pub(super) fn pdf_direction(&self, n: Vec3A, dir_out: Vec3A) -> f32 {
        self.pdf_cosine(n.dot(dir_out))
    }

    /// The same by the cosine of the direction to the normal.
    #[inline(always)]
    pub(super) fn pdf_cosine(&self, cos: f32) -> f32 {
        if self.two_sided {
            0.5 * warp::cosine_hemisphere_pdf(cos.abs())
        } else {
            warp::cosine_hemisphere_pdf(cos)
        }
    }
}
