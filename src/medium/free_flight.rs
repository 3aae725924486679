//! Free flight along an edge that may cross several media.
//!
//! One colour channel is picked uniformly, and the optical depth to the next collision is drawn in that channel alone.
//! The pick is made once an edge, and its probabilities (1/3 each) are the same in all media: so the density of a
//! collision is known from either end of an edge, does not depend on how the edge is cut into stretches, and no
//! channel's collisions are rarer than a third of what they should be, however different the channels are.
//!
//! Let κ be σ_t, of light along the edge, in media that scatter and 0 in those that only absorb, and K_c = exp(−∫ κ_c) over an edge. Then, with
//! w_c = 1/3, the free-flight factor of the edge is
//!
//!   - Σ w_c κ_c K_c, 1/m, where it ends at a collision, with κ as it is there;
//!   - Σ w_c K_c, a probability, where it ends on a surface, a light or the lens.
//!
//! Where flights are tracked ([`super::Medium::track`]), a stretch of such a medium counts as clear in both, and as estimated in the
//! transmittance of shadow rays.
//!
//! Transmittance over that factor, times σ_t at a collision, is at most 3 in every channel.

use super::decay::{decay, drawn_depth};
use crate::math::Rgb;
use glam::Vec2;

/// Probability of each channel.
const CHANNEL: f32 = 1.0 / 3.0;

/// What gets through an edge, or through a part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// exp(−∫ σ_t): what is left of the light.
    pub transmittance: Rgb,
    /// K = exp(−∫ κ): how probable it is that no collision was sampled, for each channel's draw.
    pub survival: Rgb,
}

impl Passage {
    /// Nothing in the way.
    pub const CLEAR: Self = Self { transmittance: Rgb::ONE, survival: Rgb::ONE };

    /// This, and then a stretch of the optical depth `depth` through a medium of which [`super::Medium::scatters`] says
    /// `scatters`.
    #[inline(always)]
    pub fn then(self, depth: Rgb, scatters: bool) -> Self {
        let passed = decay(depth);
        Self {
            transmittance: self.transmittance * passed,
            survival: if scatters { self.survival * passed } else { self.survival },
        }
    }

    /// This, and then a stretch in which flights are tracked and of which the share `passed` gets through.
    #[inline]
    pub fn then_tracked(self, passed: f32) -> Self {
        Self { transmittance: self.transmittance * passed, survival: self.survival }
    }

    /// The free-flight factor. `rate` is σ_t where the edge ends at a collision, and [`Rgb::ONE`] where it ends on
    /// a surface, a light or the lens.
    #[inline]
    pub fn density(&self, rate: Rgb) -> f32 {
        CHANNEL * rate.dot(self.survival)
    }

    /// True where nothing gets through.
    #[inline]
    pub fn is_black(&self) -> bool {
        self.transmittance == Rgb::ZERO
    }
}

/// Where the next collision of an edge shall be: drawn once an edge, used up stretch by stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draw {
    /// The colour channel in which distances are measured.
    pub channel: usize,
    /// The optical depth to the collision; above 0.
    pub depth: f32,
}

impl Draw {
    /// Of two uniforms in [0, 1).
    #[inline]
    pub fn new(u: Vec2) -> Self {
        let channel = ((u.x * 3.0) as usize).min(2);
        Self { channel, depth: drawn_depth(u.y) }
    }
}
