//! From the numbers of single runs to numbers over the runs, with their intervals.

use super::results::{Checkpoint, Curve, CurvePoint, Estimate, Interval, Run};
use super::statistics::{fit_power_law, mean, mean_interval};
use crate::film::Image;

/// The confidence of every interval in the results.
pub const CONFIDENCE: f64 = 0.95;

/// Points that a slope needs.
const LEAST_POINTS: usize = 3;

/// Mean and interval of one value a run; none for no values.
pub fn estimate(values: &[f64]) -> Option<Estimate> {
    Some(Estimate { mean: mean(values)?, interval: mean_interval(values, CONFIDENCE) })
}

/// 1/(error · seconds) from one error and one time a run. The interval is that of the mean of the products, taken
/// to the logarithm by the delta method, so that it is positive; none where the products vanish.
pub fn efficiency(errors: &[f64], seconds: &[f64]) -> Option<Estimate> {
    let products: Vec<f64> = errors.iter().zip(seconds).map(|(e, s)| e * s).collect();
    let cost = estimate(&products)?;
    if !(cost.mean > 0.0 && cost.mean.is_finite()) {
        return None;
    }
    let interval = cost.interval.map(|interval| {
        let spread = ((interval.high - cost.mean) / cost.mean).exp();
        Interval { low: 1.0 / (cost.mean * spread), high: spread / cost.mean }
    });
    let finite = interval.filter(|i| i.low > 0.0 && i.high.is_finite());
    Some(Estimate { mean: 1.0 / cost.mean, interval: finite })
}

/// What each run says of the variance of one run: the mean over pixels and channels of its squared difference from
/// the mean of all runs, times R/(R−1). Their mean is the unbiased estimate; empty for fewer than two runs.
pub fn run_variances(images: &[Image]) -> Vec<f64> {
    let runs = images.len() as f64;
    let Some(first) = images.first().filter(|_| images.len() > 1) else { return Vec::new() };
    let mut sums = vec![0.0; images.len()];
    for i in 0..first.pixels.len() {
        for c in 0..3 {
            let mean = images.iter().map(|m| f64::from(m.pixels[i][c])).sum::<f64>() / runs;
            for (sum, image) in sums.iter_mut().zip(images) {
                *sum += (f64::from(image.pixels[i][c]) - mean).powi(2);
            }
        }
    }
    let scale = runs / (runs - 1.0) / (3 * first.pixels.len()) as f64;
    sums.iter().map(|s| s * scale).collect()
}

/// How a metric falls, from the checkpoints that all runs have.
pub fn curve(metric: &str, runs: &[Run]) -> Option<Curve> {
    let value = |c: &Checkpoint| c.metrics.get(metric).copied();
    let (first, others) = runs.split_first()?;
    let mut points = Vec::new();
    for checkpoint in &first.checkpoints {
        let mut same = vec![checkpoint];
        same.extend(others.iter().filter_map(|r| r.checkpoints.iter().find(|c| c.spp == checkpoint.spp)));
        let values: Option<Vec<f64>> = same.iter().map(|c| value(c)).collect();
        let Some(value) = values.filter(|v| v.len() == runs.len()).and_then(|v| estimate(&v)) else {
            continue;
        };
        let seconds = same.iter().map(|c| c.seconds).sum::<f64>() / runs.len() as f64;
        points.push(CurvePoint { spp: checkpoint.spp, seconds, value });
    }
    let over = |x: fn(&Checkpoint) -> f64| {
        slope(runs.iter().map(|r| r.checkpoints.iter().filter_map(|c| Some((x(c), value(c)?))).collect()))
    };
    let (slope_spp, slope_seconds) = (over(|c| c.spp as f64), over(|c| c.seconds));
    Some(Curve { metric: metric.to_owned(), points, slope_spp, slope_seconds })
}

/// The mean slope over the runs, each fitted on its own. For a single run the interval is that of its fit, for
/// several that of the mean of their slopes: points of one run share samples and are not independent.
fn slope(runs: impl Iterator<Item = Vec<(f64, f64)>>) -> Option<Estimate> {
    let mut fits = Vec::new();
    for points in runs {
        let positive: Vec<(f64, f64)> = points.into_iter().filter(|(x, y)| *x > 0.0 && *y > 0.0).collect();
        if positive.len() < LEAST_POINTS {
            return None;
        }
        fits.push(fit_power_law(&positive, CONFIDENCE)?);
    }
    let slopes: Vec<f64> = fits.iter().map(|f| f.slope).collect();
    match &fits[..] {
        [only] => Some(Estimate { mean: only.slope, interval: only.slope_interval }),
        _ => estimate(&slopes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::{Stream, StreamKind};
    use std::collections::BTreeMap;

    #[test]
    fn efficiency_is_the_reciprocal_of_the_mean_cost() {
        let e = efficiency(&[2.0, 4.0], &[1.0, 1.0]).unwrap();
        assert!((e.mean - 1.0 / 3.0).abs() < 1e-12);
        let interval = e.interval.unwrap();
        assert!(0.0 < interval.low && interval.low < e.mean && e.mean < interval.high);
        assert!(efficiency(&[0.0, 0.0], &[1.0, 1.0]).is_none(), "no error at all");
        assert!(efficiency(&[2.0], &[0.5]).unwrap().interval.is_none());
    }

    #[test]
    fn variance_over_runs_is_unbiased() {
        // Uniforms have the variance 1/12; 8 runs of 3000 channels see it to a standard error of
        // sqrt((1/80 - 1/144) / 24000) or so: five of them are 0.0024.
        let mut stream = Stream::new(3, 0, StreamKind::Other, 0);
        let images: Vec<Image> =
            (0..8).map(|_| Image::from_fn(1000, 1, |_, _| [0; 3].map(|_| stream.next_1d()))).collect();
        let values = run_variances(&images);
        let mean = values.iter().sum::<f64>() / 8.0;
        assert!((mean - 1.0 / 12.0).abs() < 0.0024, "{mean}");
        assert!(run_variances(&images[..1]).is_empty());
    }

    fn run(checkpoints: &[(u64, f64)]) -> Run {
        let checkpoint = |&(spp, error): &(u64, f64)| Checkpoint {
            spp,
            seconds: spp as f64 * 0.5,
            metrics: BTreeMap::from([("mse".into(), error)]),
        };
        Run {
            index: 0,
            seed: 0,
            spp: 8,
            seconds: 4.0,
            setup: 0.0,
            merges: BTreeMap::new(),
            relmse: None,
            camera_paths: 0,
            light_paths: 0,
            dropped: BTreeMap::new(),
            partial: false,
            mean: [0.0; 3],
            metrics: BTreeMap::new(),
            checkpoints: checkpoints.iter().map(checkpoint).collect(),
            exr: String::new(),
        }
    }

    #[test]
    fn curves_have_the_points_of_all_runs_and_the_slope_of_each() {
        let runs = [
            run(&[(1, 1.0), (2, 0.5), (4, 0.25), (7, 1.0 / 7.0)]),
            run(&[(1, 3.0), (2, 1.5), (4, 0.75), (8, 0.375)]),
        ];
        let curve = curve("mse", &runs).unwrap();
        let spps: Vec<u64> = curve.points.iter().map(|p| p.spp).collect();
        assert_eq!(spps, [1, 2, 4], "the ends differ");
        assert_eq!(curve.points[1].value.mean, 1.0);
        assert_eq!(curve.points[1].seconds, 1.0);
        for slope in [curve.slope_spp.unwrap(), curve.slope_seconds.unwrap()] {
            assert!((slope.mean + 1.0).abs() < 1e-9, "{slope:?}");
        }
        let short = [run(&[(1, 1.0), (2, 0.5)])];
        assert!(super::curve("mse", &short).unwrap().slope_spp.is_none());
        assert!(super::curve("mse", &[]).is_none());
    }
}
