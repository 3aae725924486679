//! An index-matched boundary: between media of the same index of refraction, or a shape that is only there to bound a
//! medium. Light passes straight through. It is no vertex of a path; whoever walks through it does not count it.

use super::BsdfSample;
use crate::math::Rgb;
use glam::Vec3A;

/// Straight on, with nothing lost.
#[inline]
pub fn pass(from: Vec3A) -> BsdfSample {
    BsdfSample { to: -from, weight: Rgb::ONE, pdf: 1.0, pdf_rev: 1.0, specular: true }
}
