//! What a grid can hold: one number or three a node.

use glam::{DVec3, Vec3, Vec3A, Vec4};
use std::ops::{Add, Mul};

/// A value of a grid.
pub trait Texel: Copy + PartialEq + Send + Sync + std::fmt::Debug + 'static {
    /// What values are computed with.
    type Wide: Copy + Add<Output = Self::Wide> + Mul<f32, Output = Self::Wide> + std::fmt::Debug;
    /// What integrals are summed up in.
    type Sum: Copy + PartialEq + std::fmt::Debug;
    /// Numbers a value has.
    const CHANNELS: usize;
    /// Nothing.
    const ZERO: Self;
    /// Nothing.
    const NONE: Self::Wide;
    /// Nothing.
    const EMPTY: Self::Sum;
    /// Of the numbers of a file.
    fn of(numbers: &[f32]) -> Self;
    /// To compute with.
    fn wide(self) -> Self::Wide;
    /// The trilinear mean of the values at a cell's corners, numbered x + 2y + 4z, at a point of the cell in [0, 1]³. No
    /// mean of what is not negative is negative.
    fn mean(corners: &[Self; 8], at: Vec3A) -> Self::Wide;
    /// The largest number.
    fn largest(self) -> f32;
    /// One of the numbers; the same for every channel where there is but one.
    fn channel(wide: Self::Wide, channel: usize) -> f32;
    /// One of the numbers of a sum.
    fn channel_of_sum(sum: Self::Sum, channel: usize) -> f64;
    /// A sum with one more term.
    fn add(sum: Self::Sum, term: Self::Wide) -> Self::Sum;
    /// A sum as numbers to compute with.
    fn rounded(sum: Self::Sum) -> Vec3A;
}

/// Weights of the four edges of a cell along x.
#[inline(always)]
fn edges(at: Vec3A) -> Vec4 {
    let (y, z) = (at.y, at.z);
    let (v, w) = (1.0 - y, 1.0 - z);
    Vec4::new(v * w, y * w, v * z, y * z)
}

impl Texel for f32 {
    type Wide = f32;
    type Sum = f64;
    const CHANNELS: usize = 1;
    const ZERO: Self = 0.0;
    const NONE: f32 = 0.0;
    const EMPTY: f64 = 0.0;

    fn of(numbers: &[f32]) -> Self {
        numbers[0]
    }

    #[inline(always)]
    fn wide(self) -> f32 {
        self
    }

    #[inline(always)]
    fn mean(v: &[f32; 8], at: Vec3A) -> f32 {
        let (low, high) = (Vec4::new(v[0], v[2], v[4], v[6]), Vec4::new(v[1], v[3], v[5], v[7]));
        (low * (1.0 - at.x) + high * at.x).dot(edges(at))
    }

    fn largest(self) -> f32 {
        self
    }

    #[inline(always)]
    fn channel(wide: f32, _: usize) -> f32 {
        wide
    }

    #[inline(always)]
    fn channel_of_sum(sum: f64, _: usize) -> f64 {
        sum
    }

    #[inline(always)]
    fn add(sum: f64, term: f32) -> f64 {
        sum + f64::from(term)
    }

    #[inline(always)]
    fn rounded(sum: f64) -> Vec3A {
        Vec3A::splat(sum as f32)
    }
}

impl Texel for Vec3 {
    type Wide = Vec3A;
    type Sum = DVec3;
    const CHANNELS: usize = 3;
    const ZERO: Self = Vec3::ZERO;
    const NONE: Vec3A = Vec3A::ZERO;
    const EMPTY: DVec3 = DVec3::ZERO;

    fn of(numbers: &[f32]) -> Self {
        Self::from_slice(numbers)
    }

    #[inline(always)]
    fn wide(self) -> Vec3A {
        self.into()
    }

    #[inline(always)]
    fn mean(v: &[Vec3; 8], at: Vec3A) -> Vec3A {
        let edge = |i: usize| Vec3A::from(v[i]) * (1.0 - at.x) + Vec3A::from(v[i + 1]) * at.x;
        let weights = edges(at);
        edge(0) * weights.x + edge(2) * weights.y + edge(4) * weights.z + edge(6) * weights.w
    }

    fn largest(self) -> f32 {
        self.max_element()
    }

    #[inline(always)]
    fn channel(wide: Vec3A, channel: usize) -> f32 {
        wide[channel]
    }

    #[inline(always)]
    fn channel_of_sum(sum: DVec3, channel: usize) -> f64 {
        sum[channel]
    }

    #[inline(always)]
    fn add(sum: DVec3, term: Vec3A) -> DVec3 {
        sum + term.as_dvec3()
    }

    #[inline(always)]
    fn rounded(sum: DVec3) -> Vec3A {
        sum.as_vec3a()
    }
}
