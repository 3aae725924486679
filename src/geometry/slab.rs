//! A line against four boxes at a time.

use super::aabb::Aabb;
use glam::{Vec3A, Vec4};

/// Four boxes: for each axis, their lower and their upper bounds. One that is inside out is never met.
pub(crate) type FourBoxes = [[Vec4; 2]; 3];

/// What of a line the tests of boxes need.
///
/// A box is entered through its near planes and left through its far ones. Each set has an origin of its own, moved
/// apart by `pad`, which widens all boxes by a bound on (a) how far a triangle test moves corners by rounding (a few
/// ulps of their distance) and (b) the rounding of the box test itself. So the boxes lose no hit that the triangle test
/// would find, and lines along a box's face, with zeros of either sign in their direction, need no special case.
pub(crate) struct Line {
    near: [Vec4; 3],
    far: [Vec4; 3],
    inverse: [Vec4; 3],
    /// Which of a box's two bounds is the near one.
    sign: [usize; 3],
}

impl Line {
    /// From `origin` in the unit direction `dir`, through boxes within `bounds`.
    #[inline(always)]
    pub(crate) fn new(origin: Vec3A, dir: Vec3A, bounds: &Aabb) -> Self {
        let reach = (bounds.max - origin).abs().max((bounds.min - origin).abs()).max_element();
        let pad = 2f32.powi(-20) * reach + 2f32.powi(-22) * origin.abs().max_element();
        // A component of (nearly) zero: a slab is crossed at once, or never.
        let inverse = dir.to_array().map(|d| if d.abs() > 1e-20 { 1.0 / d } else { 1e20f32.copysign(d) });
        let origin = origin.to_array();
        let moved = inverse.map(|i| pad.copysign(i));
        Self {
            near: std::array::from_fn(|a| Vec4::splat(origin[a] + moved[a])),
            far: std::array::from_fn(|a| Vec4::splat(origin[a] - moved[a])),
            inverse: inverse.map(Vec4::splat),
            sign: inverse.map(|i| usize::from(i < 0.0)),
        }
    }

    /// Where between 0 and `length` the line enters and leaves each box; it meets those that it enters no later than it
    /// leaves them.
    #[inline(always)]
    pub(crate) fn through(&self, boxes: &FourBoxes, length: f32) -> (Vec4, Vec4) {
        let (mut t0, mut t1) = (Vec4::ZERO, Vec4::splat(length));
        for (axis, bounds) in boxes.iter().enumerate() {
            let s = self.sign[axis] & 1;
            t0 = t0.max((bounds[s] - self.near[axis]) * self.inverse[axis]);
            t1 = t1.min((bounds[s ^ 1] - self.far[axis]) * self.inverse[axis]);
        }
        (t0, t1)
    }
}
