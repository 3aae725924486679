//! A point that emits in a cone with a soft edge.

use super::{check_colour, check_direction, check_position};
use crate::math::{Frame, Rgb};
use glam::{Vec2, Vec3A};
use std::f32::consts::PI;

/// A spot light. Its intensity is the given one up to the inner angle, 0 from the cutoff angle on, and between them
/// t²(3 − 2t) of it with t = (cos θ − cos cutoff) / (cos inner − cos cutoff), or (cutoff − θ)/(cutoff − inner). Directions are sampled with a density
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
    falloff: Falloff,
    /// The inner angle and the cutoff, in radians.
    angles: [f64; 2],
    /// ∫ falloff dω.
    integral: f32,
}

/// How the intensity falls from the inner angle to the cutoff.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Falloff {
    /// A smooth step of the cosine.
    #[default]
    Smooth,
    /// In proportion to the angle.
    Linear,
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
        // The smooth step has the mean 1/2.
        let integral = (std::f64::consts::PI * (h_inner + h_cutoff)) as f32;
        Ok(Self {
            position,
            axis,
            intensity,
            h_inner: h_inner as f32,
            h_cutoff: h_cutoff as f32,
            falloff: Falloff::Smooth,
            angles: [inner, cutoff].map(|a| f64::from(a).to_radians()),
            integral,
        })
    }

    /// The same with another falloff.
    pub fn with_falloff(mut self, falloff: Falloff) -> Self {
        let [inner, cutoff] = self.angles;
        let edge = match falloff {
            Falloff::Smooth => 0.5 * f64::from(self.h_cutoff - self.h_inner),
            Falloff::Linear => linear_edge(inner, cutoff, cutoff),
        };
        self.falloff = falloff;
        self.integral = (2.0 * std::f64::consts::PI * (f64::from(self.h_inner) + edge)) as f32;
        self
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
            match self.falloff {
                Falloff::Smooth => {
                    let t = (self.h_cutoff - h) / (self.h_cutoff - self.h_inner);
                    t * t * (3.0 - 2.0 * t)
                }
                Falloff::Linear => {
                    let [inner, cutoff] = self.angles;
                    // h = 2 sin²(θ/2).
                    let angle = 2.0 * (0.5 * f64::from(h)).sqrt().min(1.0).asin();
                    ((cutoff - angle) / (cutoff - inner)).clamp(0.0, 1.0) as f32
                }
            }
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
        let edge = match self.falloff {
            Falloff::Smooth => 0.5 * (self.h_cutoff - self.h_inner),
            Falloff::Linear => self.integral / (2.0 * PI) - self.h_inner,
        };
        let x = u.x * (self.h_inner + edge);
        let h = if x < self.h_inner {
            x
        } else if self.falloff == Falloff::Linear {
            inverse_linear_edge(self.angles, f64::from(x - self.h_inner))
        } else {
            let t = inverse_smooth_step_integral(((x - self.h_inner) / edge).min(1.0));
            self.h_inner + (1.0 - t) * (self.h_cutoff - self.h_inner)
        };
        let r = (h * (2.0 - h)).max(0.0).sqrt();
        let (sin, cos) = (2.0 * PI * u.y).sin_cos();
        Frame::from_normal(self.axis).to_world(Vec3A::new(r * cos, r * sin, 1.0 - h))
    }
}

/// ∫ (cutoff − t)/(cutoff − inner) sin t dt from the inner angle to `angle`.
fn linear_edge(inner: f64, cutoff: f64, angle: f64) -> f64 {
    if cutoff <= inner {
        return 0.0;
    }
    let parts = (cutoff - inner) * inner.cos() - (cutoff - angle) * angle.cos() - (angle.sin() - inner.sin());
    parts / (cutoff - inner)
}

/// 1 − cos of the angle up to which [`linear_edge`] is `integral`: by halving, as it grows with the angle.
fn inverse_linear_edge([inner, cutoff]: [f64; 2], integral: f64) -> f32 {
    let (mut low, mut high) = (inner, cutoff);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if linear_edge(inner, cutoff, middle) < integral { low = middle } else { high = middle }
    }
    (2.0 * (0.25 * (low + high)).sin().powi(2)) as f32
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
