//! What an estimator's error is made of: variance, bias, and the noise of the reference itself.
//!
//! For runs x_1 … x_R against a reference r = μ + e of the true image μ, with D_i = x_i − r and ⟨ , ⟩ the mean of the product over
//! pixels and channels,
//!
//! ```text
//! E⟨D_i, D_i⟩ = bias² + variance + ⟨e, e⟩          E⟨D_i, D_j⟩ = bias² + ⟨e, e⟩
//! ```
//!
//! so that the products of different runs tell bias from variance without either being taken for the other, however few
//! runs there are; ⟨e, e⟩ is estimated by the reference's variance and taken off. Intervals are those of the jackknife over the
//! runs [Efron & Stein 1981], with what is not known of ⟨e, e⟩ and of its product with the bias added: the reference is the
//! same for all runs, which therefore cannot tell it. The jackknife never makes an interval too narrow on average; that of bias²
//! where there is no bias is too wide by a factor of about √2, as products of different runs are then uncorrelated.

use super::measure::CONFIDENCE;
use super::reference::Truth;
use super::results::{Estimate, Interval};
use super::statistics::two_sided_quantile;
use crate::film::Image;

/// Runs that the jackknife needs: one less still has a variance.
pub const LEAST_RUNS: usize = 3;

/// The parts of the mean squared error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Split {
    /// MSE less the reference's noise; with its interval from 3 runs on. None without a reference.
    pub mse: Option<Estimate>,
    /// Of one run. None for a single run.
    pub variance: Option<Estimate>,
    /// Squared bias, which may come out negative where there is none. None without a reference and for a single run.
    pub bias: Option<Estimate>,
}

/// A statistic of all runs, and of all but each one.
struct Jackknife {
    all: f64,
    without: Vec<f64>,
}

impl Jackknife {
    /// The estimate, where `more` is added to its variance.
    fn estimate(&self, more: f64) -> Estimate {
        let runs = self.without.len() as f64;
        let half = (self.without.len() >= LEAST_RUNS).then(|| {
            let center = self.without.iter().sum::<f64>() / runs;
            let squares: f64 = self.without.iter().map(|v| (v - center).powi(2)).sum();
            let variance = squares * (runs - 1.0) / runs;
            two_sided_quantile(CONFIDENCE, runs - 1.0).map(|t| t * (variance + more).sqrt())
        });
        let interval = half.flatten().filter(|h| h.is_finite());
        let interval = interval.map(|h| Interval { low: self.all - h, high: self.all + h });
        Estimate { mean: self.all, interval }
    }
}

/// ⟨D_i, D_i⟩ and ⟨D_i, S⟩ of each run, and ⟨S, S⟩, where S is the sum of the D_i: all that the parts need.
pub struct Products {
    own: Vec<f64>,
    with_sum: Vec<f64>,
    sum: f64,
}

impl Products {
    /// Of images against `center`.
    pub fn of(images: &[Image], center: &Image) -> Self {
        let pixels = center.pixels.len();
        let (mut own, mut with_sum, mut sum) = (vec![0.0; images.len()], vec![0.0; images.len()], 0.0);
        for i in 0..pixels {
            for c in 0..3 {
                let center = f64::from(center.pixels[i][c]);
                let total: f64 = images.iter().map(|x| f64::from(x.pixels[i][c]) - center).sum();
                for (run, image) in images.iter().enumerate() {
                    let difference = f64::from(image.pixels[i][c]) - center;
                    own[run] += difference * difference;
                    with_sum[run] += difference * total;
                }
                sum += total * total;
            }
        }
        let scale = 1.0 / (3 * pixels).max(1) as f64;
        own.iter_mut().chain(&mut with_sum).for_each(|v| *v *= scale);
        Self { own, with_sum, sum: sum * scale }
    }

    /// A statistic from the number of runs, the mean of ⟨D_i, D_i⟩ and that of ⟨D_i, D_j⟩, i ≠ j.
    fn jackknife(&self, statistic: impl Fn(f64, f64) -> f64) -> Jackknife {
        let total: f64 = self.own.iter().sum();
        let of = |runs: f64, own: f64, sum: f64| {
            let different = if runs > 1.0 { (sum - own) / (runs * (runs - 1.0)) } else { 0.0 };
            statistic(own / runs, different)
        };
        let runs = self.own.len() as f64;
        let without =
            |i: usize| of(runs - 1.0, total - self.own[i], self.sum - 2.0 * self.with_sum[i] + self.own[i]);
        let without =
            if self.own.len() > 1 { (0..self.own.len()).map(without).collect() } else { Vec::new() };
        Jackknife { all: of(runs, total, self.sum), without }
    }
}

/// The parts of the error of several runs.
pub fn split(images: &[Image], truth: Option<&Truth>) -> Split {
    let Some(first) = images.first() else { return Split::default() };
    let several = images.len() > 1;
    let products = Products::of(images, truth.map_or(first, |t| &t.image));
    let variance = several.then(|| products.jackknife(|own, different| own - different).estimate(0.0));
    let Some(truth) = truth else { return Split { variance, ..Split::default() } };
    let noise = truth.variance.as_ref().map_or(0.0, |v| v.mean().iter().sum::<f64>() / 3.0);
    let unknown = noise_variance(images, truth, |_| 1.0);
    let mse = products.jackknife(|own, _| own - noise).estimate(unknown);
    let bias = several.then(|| products.jackknife(|_, different| different - noise).estimate(unknown));
    Split { mse: Some(mse), variance, bias }
}

/// The variance of what the reference's noise adds to a mean of w(r) (x − r)² over pixels and channels: of w e² about its
/// mean, and of 2 w e times the bias. Normal noise is taken, independent between pixels and the same in the channels
/// of one.
pub fn noise_variance(images: &[Image], truth: &Truth, weight: impl Fn(f64) -> f64) -> f64 {
    let Some(variance) = &truth.variance else { return 0.0 };
    let runs = images.len().max(1) as f64;
    let mut sum = 0.0;
    for (i, pixel) in truth.image.pixels.iter().enumerate() {
        let (mut squares, mut cross) = (0.0, 0.0);
        for (c, r) in pixel.iter().enumerate() {
            let r = f64::from(*r);
            let (w, v) = (weight(r), f64::from(variance.pixels[i][c]));
            let values = images.iter().map(|x| f64::from(x.pixels[i][c]));
            let mean = values.clone().sum::<f64>() / runs;
            // Of the mean over the runs; a single one knows of none.
            let own = values.map(|x| (x - mean).powi(2)).sum::<f64>() / (runs * (runs - 1.0).max(1.0));
            let bias = ((mean - r).powi(2) - own - v).max(0.0);
            squares += w * v;
            cross += w * (bias * v).sqrt();
        }
        sum += 2.0 * squares * squares + 4.0 * cross * cross;
    }
    sum / (3 * truth.image.pixels.len()).max(1).pow(2) as f64
}

/// 1/(error · seconds): from the error over the runs with its interval, and the runs' times. None where the error is not
/// told from 0; the interval is taken to the logarithm by the delta method, so that it is positive.
pub fn efficiency(error: Option<Estimate>, seconds: &Estimate) -> Option<Estimate> {
    let error = error.filter(|e| e.mean > 0.0 && e.mean.is_finite())?;
    let mean = 1.0 / (error.mean * seconds.mean);
    let relative = |e: &Estimate| e.interval.map(|i| 0.5 * (i.high - i.low) / e.mean);
    let interval = relative(&error).zip(relative(seconds)).map(|(a, b)| {
        let spread = a.hypot(b).exp();
        Interval { low: mean / spread, high: mean * spread }
    });
    let finite = interval.filter(|i| i.low > 0.0 && i.high.is_finite());
    mean.is_finite().then_some(Estimate { mean, interval: finite })
}

#[cfg(test)]
#[path = "split_tests.rs"]
mod tests;
