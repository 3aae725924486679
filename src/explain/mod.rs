//! Replays the samples of a pixel, and tells of a path who could have made it and why it weighs what it does.
//!
//! Random numbers are a function of seed, iteration, kind of subpath and index, so that an iteration is walked again as it was:
//! all its light subpaths, as any of them may be merged with or fall on the pixel, and the one camera subpath of the
//! pixel. The weights come from three sides: what the renderer gave, the recursion of its weights run over the whole path in f64, and the
//! oracle's densities ([`crate::oracle`]).

mod largest;
mod replay;
mod words;

pub use largest::{Largest, command, largest};
pub use replay::{Found, Replay};
pub use words::text;

use crate::oracle::{MadeBy, Verdict};
use crate::transport::settings::Heuristic;
use crate::transport::technique::Technique;

/// A technique that could have made a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Which.
    pub made_by: MadeBy,
    /// Its density, times its number of samples a pixel.
    pub density: f64,
    /// Its weight by the recursion.
    pub recursion: f64,
    /// Its weight by the oracle: its density over the sum of all, raised where the heuristic says so.
    pub oracle: f64,
}

/// The exponent of a heuristic.
pub fn exponent(heuristic: Heuristic) -> f64 {
    match heuristic {
        Heuristic::Balance => 1.0,
        Heuristic::Power(beta) => beta.into(),
    }
}

/// Every technique that could have made a path, with its weight both ways.
pub fn candidates(verdict: &Verdict, beta: f64) -> Vec<Candidate> {
    let weights = Recursion::new(verdict, beta);
    let possible = verdict.techniques().filter(|t| verdict.log_density(*t) > f64::NEG_INFINITY);
    let candidate = |made_by| Candidate {
        made_by,
        density: verdict.density(made_by),
        recursion: weights.weight(made_by),
        oracle: verdict.weight(made_by, beta),
    };
    possible.map(candidate).collect()
}

/// W_i and V_i of a whole path, by one loop along it from each end:
///
/// ```text
/// W_i = r_i (M_i + (c_i + W_{i-1}) / p_i)        V_i = p_i (M_i + (c_{i+1} + V_{i+1}) / r_i)
/// ```
///
/// The renderer has the same line, in f32 and from vertex to vertex.
struct Recursion {
    p: Vec<f64>,
    r: Vec<f64>,
    c: Vec<f64>,
    /// M_i,v.
    merges: Vec<(Technique, usize, f64)>,
    /// M_i.
    m: Vec<f64>,
    w: Vec<f64>,
    v: Vec<f64>,
}

impl Recursion {
    fn new(verdict: &Verdict, beta: f64) -> Self {
        let raise = |values: &[f64]| -> Vec<f64> { values.iter().map(|x| x.powf(beta)).collect() };
        let (p, r, c) = (raise(&verdict.p), raise(&verdict.r), raise(&verdict.c));
        let count = p.len();
        let merges: Vec<_> = verdict.merges.iter().map(|(t, i, m)| (*t, *i, m.powf(beta))).collect();
        let mut m = vec![0.0; count];
        merges.iter().for_each(|(_, i, value)| m[*i] += value);
        let (mut w, mut v) = (vec![0.0; count], vec![0.0; count]);
        let over = |a: f64, b: f64| if a == 0.0 { 0.0 } else { a / b };
        for i in 0..count {
            let before = if i > 0 { w[i - 1] } else { 0.0 };
            w[i] = r[i] * (m[i] + over(c[i] + before, p[i]));
        }
        for i in (0..count).rev() {
            let (after, beside) = if i + 1 < count { (v[i + 1], c[i + 1]) } else { (0.0, 0.0) };
            v[i] = p[i] * (m[i] + over(beside + after, r[i]));
        }
        Self { p, r, c, merges, m, w, v }
    }

    fn weight(&self, made_by: MadeBy) -> f64 {
        let before = |i: usize| if i > 0 { self.w[i - 1] } else { 0.0 };
        let after = |i: usize| self.v.get(i).copied().unwrap_or(0.0);
        match made_by {
            MadeBy::Connection(s) => self.c[s] / (self.c[s] + before(s) + after(s)),
            MadeBy::Merge(technique, i) => {
                let own =
                    self.merges.iter().find(|(t, at, _)| (*t, *at) == (technique, i)).map_or(0.0, |m| m.2);
                let next = self.c.get(i + 1).copied().unwrap_or(0.0);
                own / (self.m[i] + (self.c[i] + before(i)) / self.p[i] + (next + after(i + 1)) / self.r[i])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn verdict() -> Verdict {
        let p: Vec<f64> = vec![2.0, 0.5, 3.0, 0.25, 1.5];
        let r: Vec<f64> = vec![0.2, 4.0, 1.5, 0.7, 1.0];
        let c = vec![1.0, 0.3, 0.0, 1.0, 1.0];
        let merges = vec![(Technique::Surface, 1, 0.4), (Technique::Surface, 3, 2.0)];
        Verdict { contribution: DVec3::ONE, merges, p, r, c }
    }

    #[test]
    fn recursion_and_oracle_agree_and_sum_to_one() {
        for beta in [1.0, 2.0] {
            let all = candidates(&verdict(), beta);
            assert_eq!(all.len(), 6, "one connection is impossible");
            for candidate in &all {
                assert!((candidate.recursion - candidate.oracle).abs() < 1e-12, "{candidate:?}");
            }
            assert!((all.iter().map(|c| c.recursion).sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}
