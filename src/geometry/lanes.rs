//! f32 in lanes: four, which every processor has, and eight, for those that have them.

use glam::{BVec4A, Vec3A, Vec4};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Sub};

/// f32 side by side, with which one is done as with each.
pub(super) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Lanes in which something holds.
    type Mask: Copy + BitOr<Output = Self::Mask> + BitAnd<Output = Self::Mask>;

    /// The same in all.
    fn splat(x: f32) -> Self;
    fn abs(self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn equals(self, other: Self) -> Self::Mask;
    fn below(self, other: Self) -> Self::Mask;
    /// A bit for each lane, the first the lowest.
    fn bits(mask: Self::Mask) -> u32;
}

/// A vector's coordinates, each the same in all lanes.
#[inline(always)]
pub(super) fn in_lanes<L: Lanes>(v: Vec3A) -> [L; 3] {
    [L::splat(v.x), L::splat(v.y), L::splat(v.z)]
}

/// The scalar product.
#[inline(always)]
pub(super) fn dot<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Lanes for Vec4 {
    type Mask = BVec4A;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self::splat(x)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.min(other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.max(other)
    }
    #[inline(always)]
    fn equals(self, other: Self) -> BVec4A {
        self.cmpeq(other)
    }
    #[inline(always)]
    fn below(self, other: Self) -> BVec4A {
        self.cmplt(other)
    }
    #[inline(always)]
    fn bits(mask: BVec4A) -> u32 {
        mask.bitmask()
    }
}

/// Eight in one register, of processors that have AVX2. What is done with them shall be inlined into functions that are
/// compiled for these, and that are called on these only, see [`eight::is_at_hand`]; values may be made and kept anywhere.
///
/// Nothing is inlined into such a function by way of one that is compiled for all processors and not always inlined, as
/// `array::map`: so there shall be no closures.
#[cfg(target_arch = "x86_64")]
pub(super) mod eight {
    use super::{Add, BitAnd, BitOr, Div, Lanes, Mul, Neg, Sub};
    use std::arch::x86_64::{
        __m256, _CMP_EQ_OQ, _CMP_LT_OS, _mm256_add_ps, _mm256_and_ps, _mm256_andnot_ps, _mm256_cmp_ps,
        _mm256_div_ps, _mm256_max_ps, _mm256_min_ps, _mm256_movemask_ps, _mm256_mul_ps, _mm256_or_ps,
        _mm256_set1_ps, _mm256_sub_ps, _mm256_xor_ps,
    };

    #[derive(Clone, Copy, Debug)]
    #[repr(transparent)]
    pub(in super::super) struct Eight(__m256);

    /// Whether this processor has them.
    pub(in super::super) fn is_at_hand() -> bool {
        std::arch::is_x86_feature_detected!("avx2")
    }

    /// Four, and four more.
    pub(in super::super) fn of(low: [f32; 4], high: [f32; 4]) -> Eight {
        // SAFETY: both are 32 bytes of eight f32.
        Eight(unsafe { std::mem::transmute::<[[f32; 4]; 2], __m256>([low, high]) })
    }

    /// An operation of the processor's with two operands.
    macro_rules! operation {
        ($class:ident, $name:ident, $intrinsic:ident) => {
            impl $class for Eight {
                type Output = Self;
                #[inline(always)]
                fn $name(self, other: Self) -> Self {
                    // SAFETY: run on processors with AVX2 only, see the module.
                    Self(unsafe { $intrinsic(self.0, other.0) })
                }
            }
        };
    }

    operation!(Add, add, _mm256_add_ps);
    operation!(Sub, sub, _mm256_sub_ps);
    operation!(Mul, mul, _mm256_mul_ps);
    operation!(Div, div, _mm256_div_ps);
    operation!(BitOr, bitor, _mm256_or_ps);
    operation!(BitAnd, bitand, _mm256_and_ps);

    impl Neg for Eight {
        type Output = Self;
        #[inline(always)]
        fn neg(self) -> Self {
            // SAFETY: as above.
            Self(unsafe { _mm256_xor_ps(self.0, _mm256_set1_ps(-0.0)) })
        }
    }

    impl Lanes for Eight {
        type Mask = Self;

        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: as above, also for what follows.
            Self(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            Self(unsafe { _mm256_min_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Self(unsafe { _mm256_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn equals(self, other: Self) -> Self {
            Self(unsafe { _mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn below(self, other: Self) -> Self {
            Self(unsafe { _mm256_cmp_ps::<_CMP_LT_OS>(self.0, other.0) })
        }
        #[inline(always)]
        fn bits(mask: Self) -> u32 {
            unsafe { _mm256_movemask_ps(mask.0) as u32 }
        }
    }
}

/// Of other processors nothing is known: never used there.
#[cfg(not(target_arch = "x86_64"))]
pub(super) mod eight {
    pub(in super::super) type Eight = glam::Vec4;

    /// Whether this processor has them.
    pub(in super::super) fn is_at_hand() -> bool {
        false
    }

    /// Not eight at all.
    pub(in super::super) fn of(low: [f32; 4], _high: [f32; 4]) -> Eight {
        Eight::from_array(low)
    }
}
