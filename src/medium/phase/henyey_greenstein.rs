//! The phase function of [Henyey & Greenstein 1941]: one lobe, given by its mean cosine g,
//! (1 − g²) / (4π (1 + g² − 2 g cos θ)^(3/2)).
//!
//! Near the lobe's middle the bracket is a difference of nearly equal numbers. It is (1 − |g|)² + 2|g| v, with v the
//! versine 1 − cos of the angle to the lobe's middle; between unit vectors a and b, v = |a − b|²/2.

use super::about;
use glam::{Vec2, Vec3A};
use std::f32::consts::FRAC_1_PI;

/// A lobe forward (g > 0) or backward (g < 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HenyeyGreenstein {
    g: f32,
    /// 1 − |g|.
    width: f32,
    /// (1 − g²)/(4π).
    scale: f32,
}

impl HenyeyGreenstein {
    /// With the mean cosine `g`, −1 < g < 1.
    ///
    /// # Errors
    /// Where it is not.
    pub fn new(g: f32) -> Result<Self, String> {
        if g.abs() < 1.0 {
            let width = 1.0 - g.abs();
            Ok(Self { g, width, scale: 0.25 * FRAC_1_PI * width * (1.0 + g.abs()) })
        } else {
            Err(format!(
                "the mean cosine g of a phase function must lie between -1 and 1, without them, found {g}"
            ))
        }
    }

    #[inline]
    pub(super) fn evaluate(&self, wl: Vec3A, wc: Vec3A) -> f32 {
        // The lobe's middle is at wc = −wl, or for g < 0 at wc = wl.
        let off = wl + wc * 1f32.copysign(self.g);
        let bracket = self.width * self.width + self.g.abs() * off.length_squared();
        self.scale / (bracket * bracket.sqrt())
    }

    /// With q = 1 + |g| − 2|g|ξ, the versine is 2 (1 − |g|)² ξ (1 + |g| − |g|ξ)/q², without a quotient by g, and the
    /// square root of the bracket is (1 − g²)/q.
    #[inline]
    pub(super) fn sample(&self, from: Vec3A, u: Vec2) -> (Vec3A, f32) {
        let g = self.g.abs();
        let q = self.width + 2.0 * g * (1.0 - u.x);
        let narrow = self.width / q;
        let versine = (2.0 * narrow * narrow * u.x * (1.0 + g * (1.0 - u.x))).min(2.0);
        let root = narrow * (1.0 + g);
        let to = about(from * -1f32.copysign(self.g), versine, u.y);
        (to, self.scale / (root * root * root))
    }

    pub(super) fn mean_cosine(&self) -> f32 {
        self.g
    }

    pub(super) fn describe(&self) -> String {
        format!("Henyey-Greenstein with g = {}", self.g)
    }
}
