//! Relative mean squared error [Rousselle et al. 2011]: the mean over pixels and channels of
//! (x − r)² / (r² + ε), with the reference's own channel in the denominator.
//!
//! The constant keeps black pixels in the mean: an error of 0.1 in one counts 1.

/// ε, in the square of the image's unit.
pub const EPSILON: f64 = 1e-2;

/// The relative squared error of one channel.
pub fn error(x: f64, r: f64) -> f64 {
    (x - r) * (x - r) / (r * r + EPSILON)
}
