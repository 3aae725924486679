//! Kernels: how a merge counts pairs by their distance.

use serde::{Deserialize, Serialize};

/// The shape of a kernel, the same in one, two and three dimensions.
///
/// Weights take the constant kernel's density whatever the estimator's kernel: M_i,v must be known without the pair at hand,
/// and the balance heuristic is unbiased for any weights that sum to 1 [Křivánek et al. 2014, 4.3].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kernel {
    /// All pairs within the radius count alike.
    #[default]
    Constant,
    /// 1 − d²/r²: less blur for the same radius, more noise.
    Epanechnikov,
}

impl Kernel {
    /// The kernel relative to the constant one on a segment, where `q` = d²/r² ≤ 1.
    #[inline]
    pub fn line(self, q: f32) -> f32 {
        self.shape(q, 1.5)
    }

    /// The same on a disc.
    #[inline]
    pub fn disc(self, q: f32) -> f32 {
        self.shape(q, 2.0)
    }

    /// The same in a ball.
    #[inline]
    pub fn ball(self, q: f32) -> f32 {
        self.shape(q, 2.5)
    }

    #[inline]
    fn shape(self, q: f32, peak: f32) -> f32 {
        match self {
            Self::Constant => 1.0,
            Self::Epanechnikov => peak * (1.0 - q),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ K = 1 by the midpoint rule, in each dimension.
    #[test]
    fn kernels_integrate_to_one() {
        let n = 2000;
        for kernel in [Kernel::Constant, Kernel::Epanechnikov] {
            let (mut line, mut disc, mut ball) = (0.0, 0.0, 0.0);
            for i in 0..n {
                let x = (i as f64 + 0.5) / n as f64;
                let q = (x * x) as f32;
                line += f64::from(kernel.line(q));
                disc += f64::from(kernel.disc(q)) * 2.0 * x;
                ball += f64::from(kernel.ball(q)) * 3.0 * x * x;
            }
            for integral in [line, disc, ball] {
                assert!((integral / n as f64 - 1.0).abs() < 1e-5, "{kernel:?}: {integral}");
            }
        }
    }
}
