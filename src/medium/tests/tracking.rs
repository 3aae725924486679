//! Delta and ratio tracking [Woodcock et al. 1965; Novák et al. 2014]: unbiased estimates of transmittance and of where
//! collisions are, from nothing but the coefficients at points. No part of the renderer, as their densities are not known from the far
//! end of an edge: another road to the same numbers.

use super::varying::Random;
use crate::math::Stream;
use crate::math::testing::{assert_chi_square, assert_mean, stream};

/// A ray through a medium, and a majorant of one channel of it.
struct Tracker<'a> {
    random: &'a Random,
    channel: usize,
    /// A tenth above the largest value, so that nothing hangs on its being tight.
    majorant: f64,
}

impl<'a> Tracker<'a> {
    fn new(random: &'a Random, channel: usize) -> Self {
        Self { random, channel, majorant: 1.1 * random.largest(channel) }
    }

    /// The next tentative collision after `t`, and the share of those there that are real; none before the ray's end.
    fn next(&self, t: f64, s: &mut Stream) -> Option<(f64, f64)> {
        let line = &self.random.line;
        let t = t - (1.0 - f64::from(s.next_1d())).ln() / self.majorant;
        (t < line.t1).then(|| {
            let at = self.random.medium.coefficients(line.origin + line.dir * t as f32);
            (t, f64::from(at.sigma_t[self.channel]) / self.majorant)
        })
    }

    /// Where a real collision is, by delta tracking.
    fn collision(&self, s: &mut Stream) -> Option<f64> {
        let mut t = self.random.line.t0;
        loop {
            let (next, share) = self.next(t, s)?;
            if f64::from(s.next_1d()) < share {
                return Some(next);
            }
            t = next;
        }
    }

    /// The transmittance, by ratio tracking.
    fn ratio(&self, s: &mut Stream) -> f64 {
        let (mut t, mut passed) = (self.random.line.t0, 1.0);
        while let Some((next, share)) = self.next(t, s) {
            passed *= 1.0 - share;
            t = next;
        }
        passed
    }

    /// What the exact depth says of the transmittance up to `t`.
    fn exact(&self, t: f64) -> f64 {
        (-f64::from(self.random.optical_depth(t)[self.channel])).exp()
    }
}

/// Grids of either kind, of one density and of colours; a bias of 1% is seen.
#[test]
fn tracking_finds_the_exact_transmittance_and_collisions() {
    for kind in 0..4 {
        let random = Random::new(&mut stream(990 + kind as u64), kind, 0.7);
        let tracker = Tracker::new(&random, 0);
        let (t0, t1) = (random.line.t0, random.line.t1);
        let exact = tracker.exact(t1);
        assert_mean(&format!("ratio tracking, {kind}"), exact, 300_000, |s| tracker.ratio(s));
        assert_mean(&format!("delta tracking, {kind}"), exact, 300_000, |s| {
            if tracker.collision(s).is_none() { 1.0 } else { 0.0 }
        });
        let (n, cells) = (300_000, 24);
        let passed: Vec<f64> =
            (0..=cells).map(|i| tracker.exact(t0 + (t1 - t0) * i as f64 / cells as f64)).collect();
        let mut s = stream(995 + kind as u64);
        let mut counts = vec![0.0; cells + 1];
        for _ in 0..n {
            let cell = match tracker.collision(&mut s) {
                Some(t) => (((t - t0) / (t1 - t0) * cells as f64) as usize).min(cells - 1),
                None => cells,
            };
            counts[cell] += 1.0;
        }
        let mut expected: Vec<f64> = passed.windows(2).map(|b| (b[0] - b[1]) * f64::from(n)).collect();
        expected.push(passed[cells] * f64::from(n));
        assert_chi_square(&format!("delta tracking's collisions, {kind}"), &counts, &expected);
    }
}
