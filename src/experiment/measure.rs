//! From the numbers of single runs to numbers over the runs, with their intervals.

use super::results::{Checkpoint, Curve, CurvePoint, Estimate, Run};
use super::statistics::{fit_power_law, mean, mean_interval};

/// The confidence of every interval in the results.
pub const CONFIDENCE: f64 = 0.95;

/// Points that a slope needs.
const LEAST_POINTS: usize = 3;

/// Mean and interval of one value a run; none for no values.
pub fn estimate(values: &[f64]) -> Option<Estimate> {
    Some(Estimate { mean: mean(values)?, interval: mean_interval(values, CONFIDENCE) })
}

/// How a metric falls, from the checkpoints that all runs have, and from their ends, which differ where time ends them.
pub fn curve(metric: &str, runs: &[Run]) -> Option<Curve> {
    let value = |c: &Checkpoint| c.metrics.get(metric).copied();
    let mut points = Vec::new();
    for Checkpoint { spp, .. } in &runs.first()?.checkpoints {
        let same: Option<Vec<_>> =
            runs.iter().map(|r| r.checkpoints.iter().find(|c| c.spp == *spp)).collect();
        points.extend(same.and_then(|same| point(&same, value)));
    }
    let ends: Option<Vec<_>> = runs.iter().map(|r| r.checkpoints.last()).collect();
    let end = ends.and_then(|ends| point(&ends, value));
    points.extend(end.filter(|end| points.last().is_none_or(|p| end.spp > p.spp)));
    let over = |x: fn(&Run, &Checkpoint) -> f64| {
        slope(runs.iter().map(|r| r.checkpoints.iter().filter_map(|c| Some((x(r, c), value(c)?))).collect()))
    };
    let slope_spp = over(|_, c| c.spp as f64);
    Some(Curve {
        metric: metric.to_owned(),
        points,
        slope_spp,
        slope_seconds: over(|r, c| c.seconds - r.setup),
    })
}

/// The mean of a checkpoint of each run; none where one has no value.
fn point(same: &[&Checkpoint], value: impl Fn(&Checkpoint) -> Option<f64>) -> Option<CurvePoint> {
    let values: Option<Vec<f64>> = same.iter().map(|c| value(c)).collect();
    let over = |x: fn(&Checkpoint) -> f64| same.iter().map(|c| x(c)).sum::<f64>() / same.len() as f64;
    let spp = over(|c| c.spp as f64).round() as u64;
    Some(CurvePoint { spp, seconds: over(|c| c.seconds), value: estimate(&values?)? })
}

/// The mean slope over the runs, each fitted on its own, with the interval of that mean; a single run has none, as its
/// points share samples and are not independent.
fn slope(runs: impl Iterator<Item = Vec<(f64, f64)>>) -> Option<Estimate> {
    let mut fits = Vec::new();
    for points in runs {
        let positive: Vec<(f64, f64)> = points.into_iter().filter(|(x, y)| *x > 0.0 && *y > 0.0).collect();
        if positive.len() < LEAST_POINTS {
            return None;
        }
        fits.push(fit_power_law(&positive, CONFIDENCE)?);
    }
    estimate(&fits.iter().map(|f| f.slope).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

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
            waited: 0.0,
            rendered: None,
            merges: BTreeMap::new(),
            relmse: None,
            mse: None,
            camera_paths: 0,
            light_paths: 0,
            dropped: BTreeMap::new(),
            partial: false,
            mean: [0.0; 3],
            metrics: BTreeMap::new(),
            measured: BTreeMap::new(),
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
        assert_eq!(spps, [1, 2, 4, 8], "of ends that differ, their mean");
        let end = curve.points.last().unwrap();
        assert!((end.value.mean - 0.5 * (1.0 / 7.0 + 0.375)).abs() < 1e-12 && end.value.interval.is_some());
        assert_eq!(end.seconds, 3.75);
        assert_eq!(curve.points[1].value.mean, 1.0);
        assert_eq!(curve.points[1].seconds, 1.0);
        for slope in [curve.slope_spp.unwrap(), curve.slope_seconds.unwrap()] {
            assert!((slope.mean + 1.0).abs() < 1e-9, "{slope:?}");
        }
        // A pilot of 3 s, after which the error falls with each second as it does with each sample.
        let mut late = runs.clone();
        for r in &mut late {
            r.setup = 3.0;
            r.checkpoints.iter_mut().for_each(|c| c.seconds += 3.0);
        }
        let late = super::curve("mse", &late).unwrap();
        assert!((late.slope_seconds.unwrap().mean + 1.0).abs() < 1e-9, "{:?}", late.slope_seconds);
        assert_eq!(late.points[0].seconds, 3.5, "the points have all of the time");
        let alone = super::curve("mse", &runs[..1]).unwrap().slope_spp.unwrap();
        assert!((alone.mean + 1.0).abs() < 1e-9 && alone.interval.is_none());
        let short = [run(&[(1, 1.0), (2, 0.5)])];
        assert!(super::curve("mse", &short).unwrap().slope_spp.is_none());
        assert!(super::curve("mse", &[]).is_none());
    }
}
