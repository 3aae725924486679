//! Discrete and piecewise-constant distributions.

use glam::Vec2;

/// Entries from which on a search begins at a guide: with fewer, bisection takes a few steps.
const GUIDED: usize = 17;

/// A discrete distribution over 0..n, sampled by inversion of its cumulative sums. Where there are many, the search for
/// a number begins at a guide to its bucket, the n-th part of [0, 1) that it lies in, and looks at one entry or two in
/// the mean [Chen & Asau 1974].
#[derive(Clone, Debug)]
pub struct Discrete {
    /// Cumulative probabilities, `cdf[0] = 0`, `cdf[n] = 1`.
    cdf: Vec<f32>,
    /// How many of `cdf[1..]` lie in buckets before the k-th, k = 0..=n; empty where there are few.
    guide: Vec<u32>,
    probability: Vec<f32>,
    total: f64,
}

/// The bucket of `u` among `n`. It never falls as `u` grows, whatever the rounding, and that is all a search needs.
#[inline]
fn bucket(u: f32, n: usize) -> usize {
    ((u * n as f32) as usize).min(n - 1)
}

/// See [`Discrete::guide`].
fn guide(ends: &[f32]) -> Vec<u32> {
    let n = ends.len();
    if n < GUIDED {
        return Vec::new();
    }
    let mut guide = vec![0; n + 1];
    ends.iter().for_each(|c| guide[bucket(*c, n) + 1] += 1);
    for k in 0..n {
        guide[k + 1] += guide[k];
    }
    guide
}

impl Discrete {
    /// From non-negative weights, one an entry. `None` where no weight is positive or one is not finite.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let weights: Vec<f64> = weights.into_iter().collect();
        let total: f64 = weights.iter().sum();
        if !(total.is_finite() && total > 0.0) || weights.iter().any(|w| *w < 0.0) {
            return None;
        }
        let mut sum = 0.0;
        let mut cdf = Vec::with_capacity(weights.len() + 1);
        cdf.push(0.0);
        for w in &weights {
            sum += w;
            cdf.push((sum / total) as f32);
        }
        // Rounding must not leave a gap above the last entry that can be sampled.
        let last = weights.iter().rposition(|w| *w > 0.0).expect("the sum is positive");
        cdf[last + 1..].fill(1.0);
        let probability = weights.iter().map(|w| (w / total) as f32).collect();
        let guide = guide(&cdf[1..]);
        Some(Self { cdf, guide, probability, total })
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.probability.len()
    }

    /// Always false: an empty distribution cannot be made.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Sum of the weights it was made from.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Probability of entry `i`.
    #[inline]
    pub fn pdf(&self, i: usize) -> f32 {
        self.probability[i]
    }

    /// An entry and what is left of `u`, uniform in [0, 1) again. `u` in [0, 1).
    #[inline(always)]
    pub fn sample(&self, u: f32) -> (usize, f32) {
        if self.probability.len() == 1 { (0, u) } else { self.sample_of_many(u) }
    }

    fn sample_of_many(&self, u: f32) -> (usize, f32) {
        // The first entry whose upper end lies above u has positive probability.
        let ends = &self.cdf[1..];
        let i = match ends {
            [first, _] => usize::from(*first <= u),
            _ => self.search(u, ends).min(ends.len() - 1),
        };
        let (lo, hi) = (self.cdf[i], self.cdf[i + 1]);
        let rest = if hi > lo { (u - lo) / (hi - lo) } else { 0.0 };
        (i, rest.clamp(0.0, 1.0 - f32::EPSILON / 2.0))
    }

    /// How many of `ends` do not lie above `u`.
    #[inline]
    fn search(&self, u: f32, ends: &[f32]) -> usize {
        // What lies in a bucket before u's lies below u, and what lies in one after it above.
        let (from, to) = match self.guide[..] {
            [] => (0, ends.len()),
            _ => {
                let k = bucket(u, ends.len());
                (self.guide[k] as usize, self.guide[k + 1] as usize)
            }
        };
        from + ends[from..to].partition_point(|c| *c <= u)
    }
}

/// A density on the unit square, constant on each cell of a grid.
#[derive(Clone, Debug)]
pub struct Piecewise2d {
    width: usize,
    rows: Discrete,
    columns: Vec<Option<Discrete>>,
}

impl Piecewise2d {
    /// From `width * height` non-negative cell weights, row by row. `None` where none is positive.
    pub fn new(weights: &[f64], width: usize, height: usize) -> Option<Self> {
        assert_eq!(weights.len(), width * height, "a weight a cell");
        let columns: Vec<_> = weights.chunks(width).map(|row| Discrete::new(row.iter().copied())).collect();
        let rows = Discrete::new(weights.chunks(width).map(|row| row.iter().sum()))?;
        Some(Self { width, rows, columns })
    }

    /// A point of the unit square (x along a row, y across rows) and its density per unit area.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (y, v) = self.rows.sample(u.y);
        let row = self.columns[y].as_ref().expect("a row that is sampled has weight");
        let (x, w) = row.sample(u.x);
        let size = Vec2::new(self.width as f32, self.rows.len() as f32);
        let p = (Vec2::new(x as f32 + w, y as f32 + v) / size).min(Vec2::splat(1.0 - f32::EPSILON / 2.0));
        (p, row.pdf(x) * self.rows.pdf(y) * size.x * size.y)
    }

    /// Density of [`Self::sample`] at `p` in the unit square.
    #[inline]
    pub fn pdf(&self, p: Vec2) -> f32 {
        let height = self.rows.len();
        let x = ((p.x * self.width as f32) as usize).min(self.width - 1);
        let y = ((p.y * height as f32) as usize).min(height - 1);
        self.columns[y]
            .as_ref()
            .map_or(0.0, |row| row.pdf(x) * self.rows.pdf(y) * (self.width * height) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Stream, StreamKind};

    #[test]
    fn discrete_frequencies_match_probabilities() {
        let d = Discrete::new([0.0, 3.0, 0.0, 1.0, 4.0, 0.0]).unwrap();
        let mut counts = [0f64; 6];
        let n = 100_000;
        let mut s = Stream::new(1, 0, StreamKind::Other, 0);
        for _ in 0..n {
            counts[d.sample(s.next_1d()).0] += 1.0;
        }
        let chi2: f64 = [1usize, 3, 4]
            .iter()
            .map(|&i| {
                let e = f64::from(d.pdf(i)) * f64::from(n);
                (counts[i] - e).powi(2) / e
            })
            .sum();
        assert_eq!(counts[0] + counts[2] + counts[5], 0.0, "entries without weight are never drawn");
        assert!(chi2 < 18.4, "chi² with 2 degrees of freedom at 1e-4: {chi2}");
        assert_eq!(d.sample(1.0 - f32::EPSILON / 2.0).0, 4, "the last entry with weight takes the top end");
    }

    proptest::proptest! {
        #[test]
        fn a_guided_search_finds_what_a_scan_finds(
            sparse in proptest::collection::vec((0.0..1.0f64, -30..30i32, proptest::bool::ANY), 1..300),
            numbers in proptest::collection::vec(0.0..1.0f32, 20),
        ) {
            let weights = sparse.iter().map(|&(w, k, on)| if on { w * f64::from(k).exp2() } else { 0.0 });
            let Some(d) = Discrete::new(weights) else { return Ok(()) };
            proptest::prop_assert_eq!(d.guide.is_empty(), d.len() < GUIDED);
            let ends = d.cdf.iter().flat_map(|&c| [c.next_down(), c, c.next_up()]);
            for u in ends.chain(numbers).filter(|u| (0.0..1.0).contains(u)) {
                let scanned = d.cdf[1..].iter().position(|c| *c > u).unwrap();
                proptest::prop_assert_eq!(d.sample(u).0, if d.len() == 1 { 0 } else { scanned }, "at {}", u);
            }
        }
    }

    #[test]
    fn no_weight_makes_no_distribution() {
        assert!(Discrete::new([0.0, 0.0]).is_none());
        assert!(Discrete::new([]).is_none());
        assert!(Discrete::new([f64::NAN, 1.0]).is_none());
        assert!(Discrete::new([-1.0, 2.0]).is_none());
    }

    #[test]
    fn piecewise_density_matches_cells() {
        let w = [1.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0, 4.0, 0.0];
        let d = Piecewise2d::new(&w, 3, 3).unwrap();
        let mut counts = [0f64; 9];
        let n = 100_000;
        let mut s = Stream::new(2, 0, StreamKind::Other, 0);
        for _ in 0..n {
            let (p, pdf) = d.sample(s.next_2d());
            let cell = (p.y * 3.0) as usize * 3 + (p.x * 3.0) as usize;
            assert!((pdf - w[cell] as f32 / 10.0 * 9.0).abs() < 1e-4);
            assert!((d.pdf(p) - pdf).abs() < 1e-4);
            counts[cell] += 1.0;
        }
        let chi2: f64 = w
            .iter()
            .zip(counts)
            .filter(|(w, _)| **w > 0.0)
            .map(|(w, c)| (c - w / 10.0 * f64::from(n)).powi(2) / (w / 10.0 * f64::from(n)))
            .sum();
        assert!(chi2 < 21.2, "chi² with 3 degrees of freedom at 1e-4: {chi2}");
    }
}
