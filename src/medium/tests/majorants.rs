//! Majorants, and what is sampled by them, against the slow grids in f64.

use super::grid::{Case, KINDS, Line};
use crate::math::testing::{assert_chi_square, significance, stream};
use crate::math::{Rgb, Stream};
use crate::medium::grid::Interpolation;
use crate::medium::height::HeightFog;
use crate::medium::varying::{Density, Emission, Extinction, Scattering};
use crate::medium::{Medium, Phase, Varying};
use glam::{UVec3, Vec3A};
use statrs::distribution::{ContinuousCDF, Normal};

/// At random points of random grids anywhere, skewed and scaled, and over all of the ray: where no block is, nothing is.
#[test]
fn no_value_is_above_its_majorant() {
    for kind in KINDS {
        let mut s = stream(960);
        let (mut points, mut tight, mut empty) = (0, 0, 0);
        for _ in 0..200 {
            let case = Case::random(&mut s, kind);
            let grid = case.placed();
            for _ in 0..20 {
                let Line { origin, dir, t0, t1 } = Line::through(&mut s, &case);
                let mut end = t0;
                let mut in_gap = |from: f64, to: f64| {
                    // Gaps of rounding alone hold no point.
                    if to - from > 1e-4 {
                        let p = origin + dir * (0.5 * (from + to)) as f32;
                        assert_eq!(grid.value(p), 0.0, "a block is left out in which something is");
                        empty += 1;
                    }
                };
                grid.majorants(origin, dir, (t0 as f32, t1 as f32), |majorant, a, b| {
                    in_gap(end, a);
                    end = b;
                    assert!(majorant > 0.0 && majorant < 5.0001);
                    // A ray that cuts a corner off may, by rounding, be beside it.
                    for _ in 0..if b - a > 1e-3 { 8 } else { 0 } {
                        // Within: where constant values meet, rounding may tell a point to the other one.
                        let t = a + (b - a) * f64::from(0.001 + 0.998 * s.next_1d());
                        let value = grid.value(origin + dir * t as f32);
                        assert!(value <= majorant, "{value} above {majorant}");
                        points += 1;
                        tight += usize::from(value > 0.8 * majorant);
                    }
                });
                in_gap(end, t1);
            }
        }
        assert!(points > 30_000 && tight > 1000 && empty > 300, "{points} {tight} {empty}");
    }
}

/// A grid of several blocks an axis with holes, a ray through it, and the factor of the value with which its depth is `depth`.
fn dense(s: &mut Stream, kind: Interpolation, depth: f64) -> (Case, Line, f32) {
    loop {
        let case = Case::random(s, kind);
        let line = Line::through(s, &case);
        let (t0, t1) = line.ends();
        let Some((t0, t1)) = case.placed().crossing(line.origin, line.dir, t0, t1) else { continue };
        // From before the grid to beyond it.
        let line = Line { t0: f64::from(t0), t1: f64::from(t0 + 1.05 * (t1 - t0)), ..line };
        let along = case.integral(&line);
        if along > 0.5 {
            return (case, line, (depth / along) as f32);
        }
    }
}

/// 400,000 distances a grid in 24 cells: a rate that is 1% off is seen.
#[test]
fn tracked_distances_follow_the_transmittance_integral() {
    for index in 0..6 {
        let mut s = stream(970 + index);
        let (case, line, sigma) =
            dense(&mut s, KINDS[index as usize % 2], [0.5, 1.5, 4.0][index as usize / 2]);
        let (grid, n, cells) = (case.placed(), 400_000, 24);
        let Line { origin, dir, t0, t1 } = line;
        let bound = |i: usize| t0 + (t1 - t0) * i as f64 / cells as f64;
        let passed = |t: f64| {
            if t > t0 { (-f64::from(sigma) * case.integral(&Line { t1: t, ..line })).exp() } else { 1.0 }
        };
        let none: Vec<f64> = (0..=cells).map(|i| passed(bound(i))).collect();
        let mut counts = vec![0.0; cells + 1];
        for _ in 0..n {
            let cell = match grid.track(origin, dir, (t0 as f32, t1 as f32), sigma, &mut s) {
                Some(t) => (((f64::from(t) - t0) / (t1 - t0) * cells as f64) as usize).min(cells - 1),
                None => cells,
            };
            counts[cell] += 1.0;
        }
        let mut expected: Vec<f64> = none.windows(2).map(|b| (b[0] - b[1]) * f64::from(n)).collect();
        expected.push(none[cells] * f64::from(n));
        assert_chi_square(&format!("tracked in grid {index}"), &counts, &expected);
    }
}

/// As many rays as show 1% of the transmittance with nine chances in ten, and no fewer than show an error of 0.001.
#[test]
fn ratio_tracking_is_right_on_average() {
    let normal = Normal::new(0.0, 1.0).unwrap();
    let bound = normal.inverse_cdf(1.0 - 0.5 * significance());
    for index in 0..6 {
        let mut s = stream(980 + index);
        let depth = [0.3, 1.5, 3.0][index as usize / 2];
        let (case, line, sigma) = dense(&mut s, KINDS[index as usize % 2], depth);
        let (grid, expected) = (case.placed(), (-f64::from(sigma) * case.integral(&line)).exp());
        let (t0, t1) = line.ends();
        let (mut n, mut sum, mut squares) = (0f64, 0.0, 0.0);
        loop {
            for _ in 0..100_000 {
                let passed = f64::from(grid.ratio(line.origin, line.dir, (t0, t1), sigma, &mut s));
                assert!((0.0..=1.0).contains(&passed));
                sum += passed;
                squares += passed * passed;
            }
            n += 1e5;
            let error = ((squares / n - (sum / n).powi(2)) / n).sqrt();
            if (bound + normal.inverse_cdf(0.9)) * error < 0.01 * expected || n > 4e6 {
                let off = sum / n - expected;
                println!(
                    "depth {depth}: {expected:.5}, off by {:.2} errors of {:.2e}",
                    off / error,
                    error / expected
                );
                assert!((bound + normal.inverse_cdf(0.9)) * error < 0.01 * expected, "too few rays");
                assert!(off.abs() <= bound * error, "grid {index}: {} for {expected}", sum / n);
                break;
            }
        }
    }
}

/// A stretch's end is an end, and an endless one is the grid's.
#[test]
fn tracking_stays_in_its_stretch() {
    let mut s = stream(990);
    let (case, line, sigma) = dense(&mut s, Interpolation::Trilinear, 6.0);
    let grid = case.placed();
    let (t0, t1) = line.ends();
    let middle = 0.5 * (t0 + t1);
    let mut seen = 0;
    for _ in 0..20_000 {
        if let Some(t) = grid.track(line.origin, line.dir, (t0, middle), sigma, &mut s) {
            assert!(t >= t0 && t < middle);
            seen += 1;
        }
        if let Some(t) = grid.track(line.origin, line.dir, (t0, f32::INFINITY), sigma, &mut s) {
            assert!(t.is_finite());
        }
    }
    assert!(seen > 1000);
    // Behind it there is nothing.
    for t0 in [1e3, f32::MAX] {
        assert_eq!(grid.track(line.origin, line.dir, (t0, f32::INFINITY), sigma, &mut s), None);
        assert_eq!(grid.ratio(line.origin, line.dir, (t0, f32::INFINITY), sigma, &mut s), 1.0);
    }
}

/// Grey densities on grids that are not too dense; nothing else.
#[test]
fn what_is_tracked() {
    let mut s = stream(991);
    let case = Case::noise(&mut s, UVec3::splat(9), Interpolation::Trilinear);
    let of = |extinction, albedo: f32| {
        let scattering = Scattering::Albedo(Rgb::new(albedo, 0.5 * albedo, 0.0));
        let medium =
            Varying::new(extinction, scattering, Emission::None, Phase::Isotropic).expect("a medium");
        Medium::Varying(Box::new(medium))
    };
    let grid = |sigma: Rgb| Extinction::Scaled(Density::Grid(Box::new(case.placed())), sigma);
    // Values go up to 5, and a voxel is a ninth.
    assert!(of(grid(Rgb::splat(1.0)), 0.9).is_tracked(), "the albedo may be coloured");
    assert!(!of(grid(Rgb::new(1.0, 1.0, 0.9)), 0.9).is_tracked(), "coloured extinction");
    assert!(!of(grid(Rgb::splat(1.0)), 0.0).is_tracked(), "no scattering");
    assert!(!of(grid(Rgb::splat(2.0)), 0.9).is_tracked(), "a voxel is deeper than 1");
    let same = Case::together(&[case.clone(), case.clone(), case.clone()]);
    assert!(!of(Extinction::Colored(Box::new(same)), 0.9).is_tracked(), "a grid of colours");
    let haze = Density::Height(HeightFog::new(Vec3A::Y, 0.0, 1.0).expect("haze"));
    assert!(!of(Extinction::Scaled(haze, Rgb::ONE), 0.9).is_tracked(), "haze");
    assert!(!super::medium([1.0; 3], 0.9).is_tracked(), "the same everywhere");
}

/// Majorants take a five-hundredth of the values' memory.
#[test]
fn majorants_take_little_memory() {
    let mut s = stream(992);
    for (size, interpolation) in [(128, KINDS[0]), (128, KINDS[1]), (100, KINDS[0])] {
        let case = Case::noise(&mut s, UVec3::splat(size), interpolation);
        let bytes = case.placed().lattice().bytes() as f64;
        let floats = 4.0 * f64::from(size).powi(3);
        assert!(bytes < 1.3 * floats, "{bytes} for {floats}");
    }
}
