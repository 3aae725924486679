//! Expected values by scipy 1.x where nothing else is said.

use super::*;
use crate::math::{Stream, StreamKind};

fn near(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} instead of {expected}");
}

const A: [f64; 15] =
    [27.5, 21.0, 19.0, 23.6, 17.0, 17.9, 16.9, 20.1, 21.9, 22.6, 23.1, 19.6, 19.0, 21.7, 21.4];
const B: [f64; 14] = [27.1, 22.0, 20.8, 23.4, 23.4, 23.5, 25.8, 22.0, 24.8, 20.2, 21.9, 22.1, 22.9, 30.5];

fn summaries() -> (Summary, Summary) {
    (Summary::of(&A).unwrap(), Summary::of(&B).unwrap())
}

#[test]
fn mean_variance_and_interval() {
    near(mean(&A).unwrap(), 20.82, 1e-12);
    near(variance(&A).unwrap(), 7.867_428_571_428_571, 1e-12);
    let interval = mean_interval(&A, 0.95).unwrap();
    near(interval.low, 19.266_701_652_451_24, 1e-7);
    near(interval.high, 22.373_298_347_548_754, 1e-7);
    assert!(interval.contains(20.82) && !interval.contains(19.2));
}

#[test]
fn variance_does_not_cancel_far_from_zero() {
    near(variance(&[1e9 + 4.0, 1e9 + 7.0, 1e9 + 13.0, 1e9 + 16.0]).unwrap(), 30.0, 1e-9);
}

#[test]
fn quantiles_of_students_distribution() {
    for (freedom, at_975, at_9995) in [
        (1.0, 12.706_204_736_174_694, 636.619_248_768_789_7),
        (2.0, 4.302_652_729_749_462, 31.599_054_576_445_365),
        (3.7, 2.867_520_707_191_189_5, 9.474_240_137_124_664),
        (30.0, 2.042_272_456_301_237_8, 3.645_958_635_042_062),
        (1000.0, 1.962_339_080_826_408_3, 3.300_282_648_423_944),
    ] {
        near(two_sided_quantile(0.95, freedom).unwrap() / at_975, 1.0, 1e-6);
        near(two_sided_quantile(0.999, freedom).unwrap() / at_9995, 1.0, 1e-6);
    }
}

#[test]
fn welch_and_paired_tests() {
    let (a, b) = summaries();
    let welch = welch_t_test(&a, &b).unwrap();
    near(welch.t, -2.707_777_779_103_321, 1e-9);
    near(welch.freedom, 26.952_746_503_270_294, 1e-9);
    near(welch.p, 0.011_616_192_002_630_83, 1e-8);
    let paired = paired_t_test(&A[..14], &B).unwrap();
    near(paired.t, -2.984_601_155_708_391_6, 1e-9);
    near(paired.p, 0.010_546_597_024_794_713, 1e-8);
    assert_eq!(paired_t_test(&A, &B), None);
}

#[test]
fn samples_that_do_not_vary_are_decided() {
    let constant = |mean| Summary { count: 3, mean, variance: 0.0 };
    assert_eq!(welch_t_test(&constant(2.0), &constant(2.0)).unwrap().p, 1.0);
    assert_eq!(welch_t_test(&constant(2.0), &constant(2.1)).unwrap().p, 0.0);
}

#[test]
fn degrees_of_freedom_of_equal_variances_add_up_and_one_variance_keeps_its_own() {
    near(welch_satterthwaite(&[(2.0, 9), (2.0, 9)]), 18.0, 1e-12);
    near(welch_satterthwaite(&[(2.0, 9), (0.0, 5)]), 9.0, 1e-12);
    near(welch_satterthwaite(&[(1e-200, 9), (1e-200, 9)]), 18.0, 1e-12);
    near(welch_satterthwaite(&[(0.0, 9), (0.0, 5)]), 14.0, 1e-12);
}

#[test]
fn sidak_shares_a_significance_out() {
    near(sidak(0.05, 1), 0.05, 1e-15);
    near(1.0 - (1.0 - sidak(0.05, 20)).powi(20), 0.05, 1e-14);
    near(sidak(1e-3, 1_000_000) / 1.000_500_333_583_5e-9, 1.0, 1e-9);
}

#[test]
fn smallest_detectable_difference() {
    // Equal variances and 16 runs each: 30 degrees of freedom, scipy's t at 0.975 and at 0.8.
    let runs = Summary { count: 16, mean: 1.0, variance: 0.04 };
    let expected = (2.042_272_456_301_237_8 + 0.853_767_261_471_297_9) * (2.0f64 * 0.04 / 16.0).sqrt();
    near(detectable_difference(&runs, &runs, 0.05, 0.8).unwrap(), expected, 1e-7);
    assert_eq!(detectable_difference(&runs, &runs, 0.05, 1.0), None);
}

#[test]
fn ratio_by_fieller() {
    // The ends by bisection of Fieller's condition in Python.
    let (a, b) = summaries();
    let found = ratio_of_means(&a, &b, 0.95).unwrap();
    near(found.ratio, 0.882_203_389_830_508_4, 1e-12);
    near(found.interval.low, 0.801_337_750_890_283_8, 1e-7);
    near(found.interval.high, 0.970_164_742_171_530_7, 1e-7);
    let near_zero = Summary { count: 5, mean: 0.1, variance: 1.0 };
    assert_eq!(ratio_of_means(&a, &near_zero, 0.95), None);
}

#[test]
fn power_laws() {
    let points = [(1.0, 1.0), (2.0, 0.55), (4.0, 0.24), (8.0, 0.13), (16.0, 0.06)];
    let fit = fit_power_law(&points, 0.95).unwrap();
    near(fit.slope, -1.019_870_737_349_070_3, 1e-12);
    near(fit.factor, 1.038_860_118_254_084_2, 1e-12);
    near(fit.slope_error, 0.028_244_797_673_186_53, 1e-12);
    let interval = fit.slope_interval.unwrap();
    near(interval.high - fit.slope, 0.089_887_551_998_518_33, 1e-7);
    near(fit.at(4.0), fit.factor * 4f64.powf(fit.slope), 0.0);
    let two = fit_power_law(&[(1.0, 3.0), (10.0, 0.3)], 0.95).unwrap();
    near(two.slope, -1.0, 1e-12);
    assert_eq!((two.slope_interval, two.slope_error), (None, 0.0));
}

#[test]
fn what_does_not_exist_is_none() {
    assert_eq!(mean(&[]), None);
    assert_eq!(variance(&[1.0]), None);
    assert_eq!(mean_interval(&[1.0], 0.95), None);
    assert_eq!(mean_interval(&[1.0, f64::NAN], 0.95), None);
    assert_eq!(mean_interval(&A, 1.0), None);
    assert_eq!(fit_power_law(&[(1.0, 1.0)], 0.95), None);
    assert_eq!(fit_power_law(&[(2.0, 1.0), (2.0, 3.0)], 0.95), None);
    assert_eq!(fit_power_law(&[(1.0, 1.0), (2.0, 0.0)], 0.95), None);
    let (a, _) = summaries();
    assert_eq!(welch_t_test(&a, &Summary::of(&[1.0]).unwrap()), None);
}

/// Normally distributed values by Box and Muller's transform.
struct Normal(Stream);

impl Normal {
    fn new(index: u64) -> Self {
        Self(Stream::new(2024, 0, StreamKind::Other, index))
    }

    fn sample(&mut self, mean: f64, deviation: f64) -> f64 {
        let u = (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let v = (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        mean + deviation * (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    fn samples(&mut self, count: usize, mean: f64, deviation: f64) -> Vec<f64> {
        (0..count).map(|_| self.sample(mean, deviation)).collect()
    }
}

/// The share of 4000 trials that hold; its standard error at 0.95 is 0.0034, so that 0.93..0.97 leaves nearly six.
fn assert_holds_in_95_percent(mut trial: impl FnMut(&mut Normal) -> bool, stream: u64) {
    let mut normal = Normal::new(stream);
    let share = (0..4000).filter(|_| trial(&mut normal)).count() as f64 / 4000.0;
    assert!((0.93..=0.97).contains(&share), "{share}");
}

#[test]
fn intervals_cover_the_mean_in_95_percent() {
    // A normal quantile instead of Student's would cover 88% at five values.
    let covers = |n: &mut Normal| mean_interval(&n.samples(5, 3.0, 2.0), 0.95).unwrap().contains(3.0);
    assert_holds_in_95_percent(covers, 1);
}

#[test]
fn welch_accepts_equal_means_in_95_percent() {
    let accepts = |n: &mut Normal| {
        let a = Summary::of(&n.samples(4, 1.0, 3.0)).unwrap();
        let b = Summary::of(&n.samples(16, 1.0, 0.5)).unwrap();
        welch_t_test(&a, &b).unwrap().p > 0.05
    };
    assert_holds_in_95_percent(accepts, 2);
}

#[test]
fn slopes_are_covered_in_95_percent() {
    let covers = |n: &mut Normal| {
        let points: Vec<(f64, f64)> = (0..5)
            .map(|i| {
                let x = 4f64.powi(i);
                (x, 2.0 / x * n.sample(0.0, 0.2).exp())
            })
            .collect();
        fit_power_law(&points, 0.95).unwrap().slope_interval.unwrap().contains(-1.0)
    };
    assert_holds_in_95_percent(covers, 3);
}

#[test]
fn ratios_are_covered_in_95_percent() {
    let covers = |n: &mut Normal| {
        let a = Summary::of(&n.samples(8, 6.0, 1.0)).unwrap();
        let b = Summary::of(&n.samples(8, 3.0, 1.0)).unwrap();
        ratio_of_means(&a, &b, 0.95).unwrap().interval.contains(2.0)
    };
    assert_holds_in_95_percent(covers, 4);
}

#[test]
fn the_detectable_difference_is_detected_as_often_as_said() {
    // Power 0.8 at the true variance; 4000 trials have a standard error of 0.0063.
    let truth = Summary { count: 16, mean: 0.0, variance: 1.0 };
    let difference = detectable_difference(&truth, &truth, 0.05, 0.8).unwrap();
    let mut normal = Normal::new(5);
    let mut detects = || {
        let a = Summary::of(&normal.samples(16, 0.0, 1.0)).unwrap();
        let b = Summary::of(&normal.samples(16, difference, 1.0)).unwrap();
        welch_t_test(&a, &b).unwrap().p < 0.05
    };
    let share = (0..4000).filter(|_| detects()).count() as f64 / 4000.0;
    assert!((0.77..=0.83).contains(&share), "{share}");
}
