//! Linear RGB with Rec. 709 primaries.

use glam::Vec3A;

/// Linear RGB: radiance, throughput, reflectance or a coefficient of a medium, a channel each.
pub type Rgb = Vec3A;

/// What a colour can be asked beyond vector arithmetic.
pub trait RgbExt: Copy {
    /// Relative luminance (Rec. 709 weights).
    fn luminance(self) -> f32;
    /// True where every channel is zero.
    fn is_black(self) -> bool;
}

impl RgbExt for Rgb {
    #[inline]
    fn luminance(self) -> f32 {
        self.dot(Vec3A::new(0.212_671, 0.715_160, 0.072_169))
    }

    #[inline]
    fn is_black(self) -> bool {
        self == Vec3A::ZERO
    }
}
