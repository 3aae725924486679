//! Hypothesis tests of samplers against their densities, for the tests of lights, camera and media.
//!
//! The whole of these modules' statistical tests fails a correct implementation with the probability 1%; that is
//! shared out [Šidák] over at most [`COMPARISONS`] of them.

use super::{Frame, Stream, StreamKind};
use glam::Vec3A;
use proptest::test_runner::{Config, RngSeed};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};
use std::f64::consts::PI;

/// Upper bound of the number of statistical comparisons in `light`, `camera` and `medium`.
const COMPARISONS: f64 = 350.0;

/// Significance of one comparison.
pub fn significance() -> f64 {
    1.0 - 0.99f64.powf(1.0 / COMPARISONS)
}

/// The tests' stream number `index`.
pub fn stream(index: u64) -> Stream {
    Stream::new(2024, 0, StreamKind::Other, index)
}

/// How a parser is fed with spoilt files: always with the same `cases`, and with a hundred times as many where
/// `TYNDALL_STUDY` is set.
pub fn fuzz(cases: u32) -> Config {
    let study = std::env::var_os("TYNDALL_STUDY").is_some();
    Config {
        cases: if study { 100 * cases } else { cases },
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(2024),
        ..Config::default()
    }
}

/// Pearson's test of counts against expected counts; cells that expect fewer than 10 are pooled.
pub fn assert_chi_square(name: &str, counts: &[f64], expected: &[f64]) {
    let (mut chi2, mut cells, mut pooled) = (0.0, 0, (0.0, 0.0));
    for (&c, &e) in counts.iter().zip(expected) {
        if e < 10.0 {
            pooled = (pooled.0 + c, pooled.1 + e);
        } else {
            chi2 += (c - e).powi(2) / e;
            cells += 1;
        }
    }
    if pooled.1 >= 10.0 {
        chi2 += (pooled.0 - pooled.1).powi(2) / pooled.1;
        cells += 1;
    }
    assert!(cells >= 4, "{name}: only {cells} cells");
    let p = ChiSquared::new(f64::from(cells - 1)).unwrap().sf(chi2);
    assert!(p > significance(), "{name}: chi² {chi2:.1} over {cells} cells, p = {p:.2e}");
}

/// Part of the sphere about an axis that a sampler can reach, cut into equal solid angles.
pub struct Cap {
    /// Axis of the part.
    pub axis: Vec3A,
    /// Smallest cosine to the axis.
    pub cos_min: f64,
}

impl Cap {
    /// Whole sphere.
    pub const SPHERE: Self = Self { axis: Vec3A::Y, cos_min: -1.0 };
    const Z: usize = 16;
    const PHI: usize = 24;
    const FINE: usize = 48;

    fn direction(&self, frame: &Frame, z01: f64, phi01: f64) -> Vec3A {
        let z = self.cos_min + (1.0 - self.cos_min) * z01;
        let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let (sin, cos) = (2.0 * PI * phi01).sin_cos();
        frame.to_world(Vec3A::new((r * cos) as f32, (r * sin) as f32, z as f32))
    }

    fn cell(&self, frame: &Frame, d: Vec3A) -> usize {
        let local = frame.to_local(d).as_dvec3();
        let z01 = (local.z - self.cos_min) / (1.0 - self.cos_min);
        assert!(z01 > -1e-4, "a direction outside the cap: {local}");
        let phi01 = (local.y.atan2(local.x) / (2.0 * PI)).rem_euclid(1.0);
        let z = ((z01.max(0.0) * Self::Z as f64) as usize).min(Self::Z - 1);
        z * Self::PHI + ((phi01 * Self::PHI as f64) as usize).min(Self::PHI - 1)
    }

    /// Integral of `pdf` over each cell of the cap.
    fn integrate(&self, frame: &Frame, pdf: impl Fn(Vec3A) -> f32) -> Vec<f64> {
        let solid_angle = 2.0 * PI * (1.0 - self.cos_min) / (Self::Z * Self::PHI) as f64;
        let fine = Self::FINE;
        let mut cells = Vec::with_capacity(Self::Z * Self::PHI);
        for z in 0..Self::Z {
            for phi in 0..Self::PHI {
                let mut sum = 0.0;
                for i in 0..fine * fine {
                    let zf = (z as f64 + ((i / fine) as f64 + 0.5) / fine as f64) / Self::Z as f64;
                    let pf = (phi as f64 + ((i % fine) as f64 + 0.5) / fine as f64) / Self::PHI as f64;
                    sum += f64::from(pdf(self.direction(frame, zf, pf)));
                }
                cells.push(sum * solid_angle / (fine * fine) as f64);
            }
        }
        cells
    }

    /// Asserts that `pdf` integrates to 1 over the cap (to 0.2%), that `n` samples follow it, in all cells and in either
    /// marginal, and that it is positive at each of them. A sampler that returns `None` fails.
    pub fn assert_sampler(
        &self,
        name: &str,
        n: u32,
        mut sample: impl FnMut(&mut Stream) -> Option<Vec3A>,
        pdf: impl Fn(Vec3A) -> f32,
    ) {
        let frame = Frame::from_normal(self.axis);
        let expected = self.integrate(&frame, &pdf);
        let total: f64 = expected.iter().sum();
        assert!((total - 1.0).abs() < 2e-3, "{name}: the density integrates to {total}");
        let mut counts = vec![0.0; expected.len()];
        let mut s =
            stream(name.bytes().fold(0u64, |h, b| h.wrapping_mul(31).wrapping_add(u64::from(b))) % 1_000_003);
        for _ in 0..n {
            let d = sample(&mut s).unwrap_or_else(|| panic!("{name}: a sample failed"));
            assert!((d.length() - 1.0).abs() < 1e-4, "{name}: {d} is not unit");
            assert!(pdf(d) > 0.0, "{name}: a sample {d} where the density is 0");
            counts[self.cell(&frame, d)] += 1.0;
        }
        let scale = f64::from(n) / total;
        let expected: Vec<f64> = expected.iter().map(|e| e * scale).collect();
        assert_chi_square(name, &counts, &expected);
        // A small error of a marginal drowns in the many cells; alone it is seen.
        let rings =
            |cells: &[f64]| cells.chunks(Self::PHI).map(|ring| ring.iter().sum()).collect::<Vec<f64>>();
        assert_chi_square(&format!("{name} (cosines)"), &rings(&counts), &rings(&expected));
        let sectors = |cells: &[f64]| {
            (0..Self::PHI).map(|i| cells.iter().skip(i).step_by(Self::PHI).sum()).collect::<Vec<f64>>()
        };
        assert_chi_square(&format!("{name} (azimuths)"), &sectors(&counts), &sectors(&expected));
    }
}

/// Mean of `n` draws of an estimator against what it should be, by a z-test; also asserts that a bias of 1% would
/// have been seen (the acceptance interval is narrower than that).
pub fn assert_mean(name: &str, expected: f64, n: u32, mut draw: impl FnMut(&mut Stream) -> f64) {
    let mut s =
        stream(name.bytes().fold(7u64, |h, b| h.wrapping_mul(31).wrapping_add(u64::from(b))) % 1_000_003);
    let (mut mean, mut m2) = (0.0, 0.0);
    for i in 1..=n {
        let x = draw(&mut s);
        let d = x - mean;
        mean += d / f64::from(i);
        m2 += d * (x - mean);
    }
    let error = (m2 / f64::from(n - 1) / f64::from(n)).sqrt();
    let z_max = Normal::standard().inverse_cdf(1.0 - 0.5 * significance());
    // An estimator without variance still has f32's rounding.
    let tolerance = z_max * error + 2e-5 * expected.abs();
    assert!(tolerance < 0.01 * expected.abs(), "{name}: ±{tolerance:.2e} does not see 1% of {expected:.4e}");
    assert!(
        (mean - expected).abs() < tolerance,
        "{name}: {mean:.6e} for {expected:.6e}, {:.1} standard errors off",
        (mean - expected) / error
    );
}
