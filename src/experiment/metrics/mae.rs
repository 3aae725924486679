//! Mean absolute error: the mean over pixels and channels of |x − r|.

/// The absolute error of one channel.
pub fn error(x: f64, r: f64) -> f64 {
    (x - r).abs()
}
