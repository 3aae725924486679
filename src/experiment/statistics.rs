//! Means, intervals, tests and fits over independent runs.
//!
//! What does not exist (a variance of one value, an interval of zero degrees of freedom) is `None`, never NaN.
//! Observations are taken to be independent and their means to be normally distributed.

pub use super::results::Interval;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

impl Interval {
    /// Whether `value` lies between the ends, or at one.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    fn around(center: f64, half_width: f64) -> Self {
        Self { low: center - half_width, high: center + half_width }
    }
}

/// Number, mean and variance of observations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// How many observations there are.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Their sample variance, with count − 1 in the denominator; 0 for a single one.
    pub variance: f64,
}

impl Summary {
    /// Of `values`; `None` where there is none or one is not finite.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mean = mean(values).filter(|m| m.is_finite())?;
        Some(Self { count: values.len(), mean, variance: variance(values).unwrap_or(0.0) })
    }

    /// The squared standard error of the mean.
    pub fn variance_of_mean(&self) -> f64 {
        self.variance / self.count as f64
    }

    /// Student's interval for the mean, at `confidence` in (0, 1); `None` for a single observation.
    pub fn interval(&self, confidence: f64) -> Option<Interval> {
        let quantile = two_sided_quantile(confidence, self.count as f64 - 1.0)?;
        Some(Interval::around(self.mean, quantile * self.variance_of_mean().sqrt()))
    }
}

/// The mean; `None` for no values.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The sample variance, with n − 1 in the denominator; `None` for fewer than two values.
pub fn variance(values: &[f64]) -> Option<f64> {
    let center = mean(values).filter(|_| values.len() > 1)?;
    // About the mean in a second pass: the one-pass formula cancels for values far from zero.
    let squares: f64 = values.iter().map(|v| (v - center).powi(2)).sum();
    Some(squares / (values.len() - 1) as f64)
}

/// Student's interval for the mean of the population, at `confidence` such as 0.95; `None` for fewer than two
/// values.
pub fn mean_interval(values: &[f64], confidence: f64) -> Option<Interval> {
    Summary::of(values)?.interval(confidence)
}

/// The t with P(|T| ≤ t) = `confidence`; `None` unless confidence lies in (0, 1) and there is freedom.
pub fn two_sided_quantile(confidence: f64, freedom: f64) -> Option<f64> {
    if !(confidence > 0.0 && confidence < 1.0) {
        return None;
    }
    Some(students(freedom)?.inverse_cdf(0.5 + 0.5 * confidence))
}

fn students(freedom: f64) -> Option<StudentsT> {
    if !(freedom > 0.0 && freedom.is_finite()) {
        return None;
    }
    StudentsT::new(0.0, 1.0, freedom).ok()
}

/// What a t-test finds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TTest {
    /// The difference of the means in standard errors.
    pub t: f64,
    /// Degrees of freedom; not an integer in Welch's test.
    pub freedom: f64,
    /// The probability of a |t| at least as large where the means are equal.
    pub p: f64,
}

/// Welch's test of whether two populations have the same mean, whatever their variances; the degrees of freedom
/// are those of [`welch_satterthwaite`]. Where neither sample varies, p is 1 for equal means and 0 otherwise.
/// `None` where a sample has fewer than two values.
pub fn welch_t_test(a: &Summary, b: &Summary) -> Option<TTest> {
    if a.count < 2 || b.count < 2 {
        return None;
    }
    let (var_a, var_b) = (a.variance_of_mean(), b.variance_of_mean());
    test(a.mean - b.mean, var_a + var_b, welch_satterthwaite(&[(var_a, a.count - 1), (var_b, b.count - 1)]))
}

/// The paired test of whether the mean of the differences a − b is zero; `None` for samples of different lengths
/// or fewer than two pairs.
pub fn paired_t_test(a: &[f64], b: &[f64]) -> Option<TTest> {
    if a.len() != b.len() || a.len() < 2 {
        return None;
    }
    let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    let summary = Summary::of(&differences)?;
    test(summary.mean, summary.variance_of_mean(), summary.count as f64 - 1.0)
}

fn test(difference: f64, variance_of_mean: f64, freedom: f64) -> Option<TTest> {
    if variance_of_mean == 0.0 {
        let equal = difference == 0.0;
        let t = if equal { 0.0 } else { f64::MAX.copysign(difference) };
        return Some(TTest { t, freedom, p: if equal { 1.0 } else { 0.0 } });
    }
    let t = difference / variance_of_mean.sqrt();
    Some(TTest { t, freedom, p: (2.0 * students(freedom)?.cdf(-t.abs())).min(1.0) })
}

/// The effective degrees of freedom of a sum of independent variance estimates [Welch 1947; Satterthwaite 1946]:
/// (Σ v)² / Σ v²/f for estimates v (the weights of a linear combination included) with f degrees of freedom
/// each. Where all are 0, the sum of the f.
pub fn welch_satterthwaite(estimates: &[(f64, usize)]) -> f64 {
    let sum: f64 = estimates.iter().map(|(v, _)| v).sum();
    if sum == 0.0 {
        return estimates.iter().map(|(_, f)| *f as f64).sum();
    }
    // Relative to the sum, since squares of small variances would underflow.
    1.0 / estimates.iter().map(|(v, f)| (v / sum).powi(2) / *f as f64).sum::<f64>()
}

/// The significance of each of `count` independent tests, so that all together wrongly reject with probability
/// `family` [Šidák 1967]: 1 − (1 − family)^(1/count).
pub fn sidak(family: f64, count: usize) -> f64 {
    // By logarithms: 1 − x cancels for many tests.
    -((-family).ln_1p() / count.max(1) as f64).exp_m1()
}

/// The smallest difference of two means that Welch's test at `significance` (two-sided) finds with probability
/// `power`, given the two samples' variances: (t(1 − significance/2) + t(power)) standard errors of the
/// difference. `None` where a sample has fewer than two values, or for probabilities outside (0, 1).
pub fn detectable_difference(a: &Summary, b: &Summary, significance: f64, power: f64) -> Option<f64> {
    if a.count < 2 || b.count < 2 || !(power > 0.0 && power < 1.0) {
        return None;
    }
    let (var_a, var_b) = (a.variance_of_mean(), b.variance_of_mean());
    let freedom = welch_satterthwaite(&[(var_a, a.count - 1), (var_b, b.count - 1)]);
    let threshold = two_sided_quantile(1.0 - significance, freedom)?;
    let margin = students(freedom)?.inverse_cdf(power);
    Some((threshold + margin) * (var_a + var_b).sqrt())
}

/// A ratio of means with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ratio {
    /// The ratio of the sample means.
    pub ratio: f64,
    /// The confidence interval.
    pub interval: Interval,
}

/// The ratio of the means of two independent samples, with its interval by Fieller's theorem [Fieller 1954],
/// with Welch–Satterthwaite's degrees of freedom at the estimated ratio. `None` where the denominator's mean is
/// not significantly different from 0 at this confidence (the interval would be unbounded), or a sample has
/// fewer than two values.
pub fn ratio_of_means(numerator: &Summary, denominator: &Summary, confidence: f64) -> Option<Ratio> {
    if numerator.count < 2 || denominator.count < 2 || denominator.mean == 0.0 {
        return None;
    }
    let (var_n, var_d) = (numerator.variance_of_mean(), denominator.variance_of_mean());
    let ratio = numerator.mean / denominator.mean;
    let freedom =
        welch_satterthwaite(&[(var_n, numerator.count - 1), (ratio * ratio * var_d, denominator.count - 1)]);
    let t = two_sided_quantile(confidence, freedom)?;
    // Where (n − ρ d)² ≤ t² (var_n + ρ² var_d): between the roots in ρ.
    let g = t * t * var_d / (denominator.mean * denominator.mean);
    if g >= 1.0 {
        return None;
    }
    let root = ((1.0 - g) * var_n + ratio * ratio * var_d).sqrt() * t / denominator.mean.abs();
    let interval = Interval { low: (ratio - root) / (1.0 - g), high: (ratio + root) / (1.0 - g) };
    Some(Ratio { ratio, interval })
}

/// A straight line through points in log-log axes: y = `factor` · x^`slope`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PowerLaw {
    /// The exponent, i.e. the slope of the line.
    pub slope: f64,
    /// The value at x = 1.
    pub factor: f64,
    /// The standard error of the slope; 0 for two points.
    pub slope_error: f64,
    /// The interval of the slope; `None` for two points.
    pub slope_interval: Option<Interval>,
}

impl PowerLaw {
    /// The value at `x`.
    pub fn at(&self, x: f64) -> f64 {
        self.factor * x.powf(self.slope)
    }
}

/// Ordinary least squares of ln y over ln x, and Student's interval of the slope from the residuals. `None` for
/// fewer than two points, for a single x, or where a coordinate is not positive and finite.
pub fn fit_power_law(points: &[(f64, f64)], confidence: f64) -> Option<PowerLaw> {
    let positive = |v: f64| v > 0.0 && v.is_finite();
    if points.len() < 2 || !points.iter().all(|(x, y)| positive(*x) && positive(*y)) {
        return None;
    }
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let center_x = logs.iter().map(|p| p.0).sum::<f64>() / n;
    let center_y = logs.iter().map(|p| p.1).sum::<f64>() / n;
    let sxx: f64 = logs.iter().map(|p| (p.0 - center_x).powi(2)).sum();
    let sxy: f64 = logs.iter().map(|p| (p.0 - center_x) * (p.1 - center_y)).sum();
    if sxx <= n * (1e-12 * center_x.abs().max(1.0)).powi(2) {
        return None;
    }
    let slope = sxy / sxx;
    let residual = |p: &(f64, f64)| p.1 - center_y - slope * (p.0 - center_x);
    let freedom = n - 2.0;
    let residual_variance =
        if freedom > 0.0 { logs.iter().map(|p| residual(p).powi(2)).sum::<f64>() / freedom } else { 0.0 };
    let slope_error = (residual_variance / sxx).sqrt();
    let slope_interval =
        two_sided_quantile(confidence, freedom).map(|t| Interval::around(slope, t * slope_error));
    Some(PowerLaw { slope, factor: (center_y - slope * center_x).exp(), slope_error, slope_interval })
}

#[cfg(test)]
#[path = "statistics_tests.rs"]
mod tests;
