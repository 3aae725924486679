//! Symmetric mean absolute percentage error: the mean over pixels and channels of
//! |x − r| / ((|x| + |r|) / 2), where 0/0 is 0.
//!
//! Between 0 and 2; a pixel that is black in one image alone counts 2 however dark the other is.
//! [Vogels et al. 2018] divide by the sum instead of the mean of both, which halves the value.

/// The symmetric relative error of one channel.
pub fn error(x: f64, r: f64) -> f64 {
    let sum = x.abs() + r.abs();
    if sum == 0.0 { 0.0 } else { 2.0 * (x - r).abs() / sum }
}
