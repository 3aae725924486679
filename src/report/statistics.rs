//! What the numbers of several runs allow one to say: which estimator is best, and by how much.

use crate::experiment::results::Interval;
use crate::experiment::statistics::{Summary, mean, ratio_of_means, sidak, welch_t_test};

/// Significance of everything that the page calls different: 5% for each table column or ratio.
const ALPHA: f64 = 0.05;

/// What can be said about who is best.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Best {
    /// This one differs from every other at the stated significance, shared out over the comparisons (Šidák).
    One(usize),
    /// The first has the smallest mean, but the others listed cannot be told from it.
    Among(Vec<usize>),
    /// Fewer than two estimators or runs, or a value that is not finite.
    Unknown,
}

/// Which of several sets of runs has the smallest mean.
pub(super) fn best(sets: &[Vec<f64>]) -> Best {
    let several = |s: &Vec<f64>| Summary::of(s).filter(|s| s.count > 1 && s.variance.is_finite());
    let summaries: Option<Vec<Summary>> = sets.iter().map(several).collect();
    let Some(all) = summaries.filter(|s| s.len() > 1) else { return Best::Unknown };
    let order = |a: &usize, b: &usize| all[*a].mean.total_cmp(&all[*b].mean);
    let Some(first) = (0..all.len()).min_by(order) else { return Best::Unknown };
    let alpha = sidak(ALPHA, all.len() - 1);
    let mut among = vec![first];
    for other in (0..all.len()).filter(|i| *i != first) {
        if welch_t_test(&all[first], &all[other]).is_none_or(|t| t.p > alpha) {
            among.push(other);
        }
    }
    if among.len() == 1 { Best::One(first) } else { Best::Among(among) }
}

/// A ratio of means, and what is known of where it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ratio {
    /// A single run on a side: no interval.
    Bare(f64),
    /// With its 95% interval, which has no upper end where the denominator may be 0.
    Known(f64, Option<Interval>),
}

/// Mean of `a` over mean of `b`, both positive; `None` where a mean is not.
pub(crate) fn ratio(a: &[f64], b: &[f64]) -> Option<Ratio> {
    let value = mean(a)? / mean(b)?;
    if !(value.is_finite() && value > 0.0) {
        return None;
    }
    if a.len() < 2 || b.len() < 2 {
        return Some(Ratio::Bare(value));
    }
    let interval = ratio_of_means(&Summary::of(a)?, &Summary::of(b)?, 1.0 - ALPHA).map(|r| r.interval);
    // Fieller's interval knows nothing of errors being positive: below 0 no ratio of theirs can be.
    let interval = interval.map(|i| Interval { low: i.low.max(0.0), ..i });
    Some(Ratio::Known(value, interval))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_is_named_only_when_it_differs() {
        let (low, near, high) =
            (vec![1.0, 1.1, 0.9, 1.0], vec![1.05, 1.15, 0.95, 1.0], vec![9.0, 9.1, 8.9, 9.0]);
        assert_eq!(best(&[high.clone(), low.clone()]), Best::One(1));
        assert_eq!(best(&[high, near, low.clone()]), Best::Among(vec![2, 1]));
        assert_eq!(best(std::slice::from_ref(&low)), Best::Unknown);
        assert_eq!(best(&[vec![1.0], vec![2.0]]), Best::Unknown);
        assert_eq!(best(&[low, vec![f64::NAN, 1.0]]), Best::Unknown);
    }

    #[test]
    fn ratios_with_and_without_an_interval() {
        assert_eq!(ratio(&[2.0], &[1.0]), Some(Ratio::Bare(2.0)));
        assert_eq!(ratio(&[1.0], &[0.0]), None);
        assert_eq!(ratio(&[], &[1.0]), None);
        assert_eq!(ratio(&[1.0, 2.0], &[0.1, 2.9]), Some(Ratio::Known(1.0, None)), "unbounded");
        let Some(Ratio::Known(value, Some(interval))) = ratio(&[4.0, 4.1, 4.2], &[2.0, 2.05, 2.1]) else {
            panic!("there is an interval")
        };
        assert!((value - 2.0).abs() < 1e-12 && interval.contains(2.0) && !interval.contains(1.0));
        let Some(Ratio::Known(_, Some(wide))) = ratio(&[0.1, 1.0, 8.0], &[1.0, 1.1, 1.2]) else {
            panic!("as well")
        };
        assert!(wide.low == 0.0 && wide.high > 5.0, "{wide:?}");
    }
}
