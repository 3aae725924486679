//! A point that emits in a cone with a smooth edge.

use super::{check_colour, check_direction, check_position};
use crate::math::{Frame, Rgb};
use glam::{Vec2, Vec3A};
use std::f32::consts::PI;

/// A spot light. Its intensity is the given one up to the inner angle, 0 from the cutoff angle on, and between them
/// t²(3 − 2t) of it with t = (cos θ − cos cutoff) / (cos inner − cos cutoff). Directions are sampled with a density
/// in proportion to that.
///
/// Cosines are kept as h = 1 − cos, and that is computed as half the squared distance of two unit vectors, so that
/// narrow cones keep their precision.
#[derive(Clone, Debug)]
pub struct SpotLight {
    pub(super) position: Vec3A,
    axis: Vec3A,
    intensity: Rgb,
    /// 1 − cos of the inner angle.
    h_inner: f32,
    /// 1 − cos of the cutoff angle.
    h_cutoff: f32,
    /// ∫ falloff dω = 2π (h_inner + (h_cutoff − h_inner)/2), as the smooth step has the mean 1/2.
    integral: f32,
}

impl SpotLight {
    /// Where it is.
    pub fn position(&self) -> Vec3A {
        self.position
    }

    /// At `position`, along `direction` (of any length), with `intensity` \[W/sr\] on the axis; both angles are
    /// measured from the axis, in degrees, 0 ≤ `inner` ≤ `cutoff` ≤ 90 and `cutoff` positive.
    ///
    /// # Errors
    /// Where a number is out of its range or not finite.
    pub fn new(
        position: Vec3A,
        direction: Vec3A,
        intensity: Rgb,
        inner: f32,
        cutoff: f32,
    ) -> Result<Self, String> {
        check_position("spot", position)?;
        let axis = check_direction("spot", direction)?;
        check_colour("spot", "intensity", intensity)?;
        // A thousandth of a degree is where the rounding of directions would begin to show.
        if !(0.001..=90.0).contains(&cutoff) {
            return Err(format!("spot light: the cutoff angle must be in [0.001, 90] degrees, not {cutoff}"));
        }
        if !(0.0..=cutoff).contains(&inner) {
            return Err(format!("spot light: the inner angle must be in [0, {cutoff}] degrees, not {inner}"));
        }
        let h = |degrees: f32| 2.0 * (0.5 * f64::from(degrees).to_radians()).sin().powi(2);
        let (h_inner, h_cutoff) = (h(inner), h(cutoff));
        let integral = (std::f64::consts::PI * (h_inner + h_cutoff)) as f32;
        Ok(Self { position, axis, intensity, h_inner: h_inner as f32, h_cutoff: h_cutoff as f32, integral })
    }

    /// Power in W.
    pub fn power(&self) -> Rgb {
        self.intensity * self.integral
    }

    /// 1 on the axis, 0 outside the cone.
    #[inline]
    fn falloff(&self, dir_out: Vec3A) -> f32 {
        let h = 0.5 * (dir_out - self.axis).length_squared();
        if h <= self.h_inner {
            1.0
        } else if h >= self.h_cutoff {
            0.0
        } else {
            let t = (self.h_cutoff - h) / (self.h_cutoff - self.h_inner);
            t * t * (3.0 - 2.0 * t)
        }
    }

    /// Intensity along `dir_out`.
    #[inline]
    pub(super) fn emitted(&self, dir_out: Vec3A) -> Rgb {
        self.intensity * self.falloff(dir_out)
    }

    /// Density of [`Self::sample_direction`] per solid angle.
    #[inline]
    pub(super) fn pdf_direction(&self, dir_out: Vec3A) -> f32 {
        self.falloff(dir_out) / self.integral
    }

    /// A direction in the cone.
    #[inline]
    pub(super) fn sample_direction(&self, u: Vec2) -> Vec3A {
        // The part within the inner angle, and the edge, have these integrals over h.
        let edge = 0.5 * (self.h_cutoff - self.h_inner);
        let x = u.x * (self.h_inner + edge);
        let h = if x < self.h_inner {
            x
        } else {
            let t = inverse_smooth_step_integral(((x - self.h_inner) / edge).min(1.0));
            self.h_inner + (1.0 - t) * (self.h_cutoff - self.h_inner)
        };
        let r = (h * (2.0 - h)).max(0.0).sqrt();
        let (sin, cos) = (2.0 * PI * u.y).sin_cos();
        Frame::from_normal(self.axis).to_world(Vec3A::new(r * cos, r * sin, 1.0 - h))
    }
}

/// The t for which a share `1 − v` of the smooth step's integral over [0, 1] lies below t: 2t³ − t⁴ = 1 − v.
#[inline]
fn inverse_smooth_step_integral(v: f32) -> f32 {
    let share = 1.0 - v;
    // t³ ≤ t³(2 − t), so the cube root lies above the solution, and the integral is convex: Newton's steps come
    // down to it without passing it. Four are enough for f32.
    let mut t = share.cbrt();
    for _ in 0..4 {
        let slope = 2.0 * t * t * (3.0 - 2.0 * t);
        if slope <= 0.0 {
            break;
        }
        t -= (t * t * t * (2.0 - t) - share) / slope;
    }
    t.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_integral_is_inverted() {
        for i in 0..=1000 {
            let v = i as f32 / 1000.0;
            let t = inverse_smooth_step_integral(v);
            assert!((2.0 * t.powi(3) - t.powi(4) - (1.0 - v)).abs() < 1e-6, "{v} {t}");
        }
    }
}
