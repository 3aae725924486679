//! Samples against densities: chi² over cells of the sphere.
//!
//! The chi² tests have a significance of 1e-3 together, shared out by Šidák over all comparisons. With 800,000 samples
//! over at most 64 cells, a density that is off by 1% (root mean square over the samples) is found with a probability above
//! 0.9, and one that is 1% too large everywhere always, by the total.

use super::table::*;
use crate::bsdf::*;
use crate::math::Frame;
use glam::{DVec2, DVec3, Vec2, Vec3A};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f32::consts::{PI, TAU};

const SAMPLES: usize = 800_000;
const SIGNIFICANCE: f64 = 1e-3;
/// Comparisons by chi² in this module: broad rows by directions, the narrow ones, and the skewed density's.
const COMPARISONS: f64 = (BROAD * 4 + 14 + 3) as f64;
/// Rows of [`broad`].
const BROAD: usize = 25;
const RINGS: usize = 8;
const SECTORS: usize = 8;

fn level() -> f64 {
    1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / COMPARISONS)
}

/// A cap of the sphere about an axis: (1 − cos α)/2 = limit·x^power with power = 2^halvings and x in [0, 1], in cells
/// of x and of azimuth.
struct Cap {
    frame: Frame,
    limit: f32,
    halvings: i32,
}

impl Cap {
    fn sphere() -> Self {
        Self { frame: Frame::from_normal(Vec3A::Z), limit: 1.0, halvings: 0 }
    }

    fn narrow(axis: Vec3A) -> Self {
        Self { frame: Frame::from_normal(axis), limit: 0.02, halvings: 2 }
    }

    fn cell(&self, w: Vec3A) -> Option<usize> {
        // |a − w|²/4 = (1 − cos α)/2, to full precision near the axis.
        let s = 0.25 * (w - self.frame.n).length_squared() / self.limit;
        let x = (0..self.halvings).fold(s, |x, _| x.sqrt());
        let ring = (x * RINGS as f32) as usize;
        // The octants that integrate() goes through, from −π on.
        let local = self.frame.to_local(w);
        let steep = local.y.abs() > local.x.abs();
        let sector = match (local.y < 0.0, local.x < 0.0) {
            (true, true) => usize::from(steep),
            (true, false) => 3 - usize::from(steep),
            (false, false) => 4 + usize::from(steep),
            (false, true) => 7 - usize::from(steep),
        };
        (ring < RINGS).then_some(ring * SECTORS + sector)
    }

    /// Integral of a density over each cell.
    fn integrate(&self, pdf: impl Fn(Vec3A) -> f32) -> Vec<f64> {
        let (limit, power) = (f64::from(self.limit), 1 << self.halvings);
        let at = |x: f64, phi: f64| {
            let s = limit * x.powi(power);
            let jacobian = 2.0 * limit * f64::from(power) * x.powi(power - 1);
            let sin = 2.0 * (s * (1.0 - s)).sqrt();
            let local = DVec3::new(sin * phi.cos(), sin * phi.sin(), 1.0 - 2.0 * s);
            f64::from(pdf(self.frame.to_world(local.as_vec3a()))) * jacobian
        };
        let size = DVec2::new(1.0 / RINGS as f64, f64::from(TAU) / SECTORS as f64);
        let corner = |i: usize| size * DVec2::new((i / SECTORS) as f64, (i % SECTORS) as f64);
        (0..RINGS * SECTORS).map(|i| refine(&at, corner(i) - DVec2::Y * f64::from(PI), size, 0)).collect()
    }
}

/// The product of two Gauss-Legendre rules of 4 points over a rectangle.
fn gauss(f: &impl Fn(f64, f64) -> f64, corner: DVec2, size: DVec2) -> f64 {
    const RULE: [(f64, f64); 4] = [
        (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
        (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
        (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
        (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
    ];
    let mut sum = 0.0;
    for (x, a) in RULE {
        for (y, b) in RULE {
            sum += a * b * f(corner.x + x * size.x, corner.y + y * size.y);
        }
    }
    sum * size.x * size.y
}

/// Integral over a rectangle, by quarters until they add up to the whole to 5e-7: less than half a sample.
fn refine(f: &impl Fn(f64, f64) -> f64, corner: DVec2, size: DVec2, depth: u32) -> f64 {
    let half = 0.5 * size;
    let quarters = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|q| corner + q * half);
    let sum: f64 = quarters.iter().map(|q| gauss(f, *q, half)).sum();
    // Twice at least, so that no narrow lobe slips between the points.
    if depth >= 2 && ((sum - gauss(f, corner, size)).abs() < 5e-7 || depth == 7) {
        return sum;
    }
    quarters.iter().map(|q| refine(f, *q, half, depth + 1)).sum()
}

/// The probability that samples which have this density differ from it at least as much as these do. What is in no
/// cell (other directions, Diracs, samples that scatter nothing) is a cell of its own, expected to make up 1.
fn p_value(material: &Material, from: Vec3A, cap: &Cap, pdf: impl Fn(Vec3A) -> f32, seed: u64) -> f64 {
    let mut expected = cap.integrate(pdf);
    let inside: f64 = expected.iter().sum();
    assert!(inside < 1.002, "a density integrates to {inside}");
    let mut counts = vec![0f64; RINGS * SECTORS];
    let mut s = stream(seed);
    // As walks sample: in the world, where the surface is tilted.
    let shading = Frame::from_normal(tilted());
    let world = shading.to_world(from);
    for _ in 0..SAMPLES {
        let u = (s.next_1d(), s.next_2d());
        let sample = material.sample_world(UV.into(), shading.n, world, Mode::Radiance, u);
        let to = sample.filter(|b| !b.specular).map(|b| shading.to_local(b.to));
        if let Some(cell) = to.and_then(|to| cap.cell(to)) {
            counts[cell] += 1.0;
        }
    }
    counts.push(SAMPLES as f64 - counts.iter().sum::<f64>());
    expected.push((1.0 - inside).max(0.0));
    let (mut chi2, mut cells) = (0.0, 0);
    let (mut rest_expected, mut rest_count) = (0.0, 0.0);
    for (count, probability) in counts.iter().zip(&expected) {
        let e = probability * SAMPLES as f64;
        if e < 25.0 {
            rest_expected += e;
            rest_count += count;
        } else {
            chi2 += (count - e).powi(2) / e;
            cells += 1;
        }
    }
    // The small cells together. Where even they are next to nothing, quadrature cannot tell them from nothing.
    if rest_expected > 25.0 {
        chi2 += (rest_count - rest_expected).powi(2) / rest_expected;
        cells += 1;
    } else {
        assert!(rest_count < 150.0, "{rest_count} samples where {rest_expected} are expected");
    }
    // A side that reflects nothing: all samples are in one cell.
    if cells == 1 {
        return f64::from(u8::from(chi2 == 0.0));
    }
    ChiSquared::new(f64::from(cells - 1)).unwrap().sf(chi2)
}

fn check(row: &Row, from: Vec3A, cap: &Cap, seed: u64) {
    let pdf = |to| row.material.pdf(UV, from, to);
    let p = p_value(&row.material, from, cap, pdf, seed);
    assert!(p > level(), "{}, from {from}: p = {p:e}", row.name);
}

/// Steep and grazing from outside, oblique from inside (in total internal reflection), and nearly the critical angle.
fn views() -> [Vec3A; 4] {
    [direction(0.9, 0.3), direction(0.07, -1.0), direction(-0.4, 0.7), direction(-0.8, -2.5)]
}

fn check_broad(part: std::ops::Range<usize>) {
    let rows = broad();
    assert_eq!(rows.len(), BROAD, "each row is in one of the parts");
    for (i, row) in rows.iter().enumerate().skip(part.start).take(part.len()) {
        for (j, from) in views().into_iter().enumerate() {
            check(row, from, &Cap::sphere(), (100 + i * 10 + j) as u64);
        }
    }
}

#[test]
fn opaque_materials_are_sampled_with_their_density() {
    check_broad(0..4);
}

#[test]
fn rough_glass_is_sampled_with_its_density() {
    check_broad(4..8);
}

#[test]
fn coats_and_sides_are_sampled_with_their_density() {
    check_broad(8..14);
}

#[test]
fn mixtures_are_sampled_with_their_density() {
    check_broad(14..17);
}

#[test]
fn beckmanns_metals_and_plastic_are_sampled_with_their_density() {
    check_broad(17..21);
}

#[test]
fn beckmanns_glass_is_sampled_with_its_density() {
    check_broad(21..BROAD);
}

#[test]
fn narrow_lobes_are_sampled_with_their_density() {
    let rows = smooth();
    let find = |name: &str| rows.iter().find(|r| r.name == name).unwrap();
    for (i, from) in [direction(0.8, 0.4), direction(-0.6, 2.0)].into_iter().enumerate() {
        let seed = 300 + i as u64 * 10;
        let (reflected, through) = (reflect_z(from), find_refracted(1.5, from));
        check(find("polished silver"), from, &Cap::narrow(reflected), seed);
        check(find("narrow phong"), from, &Cap::narrow(reflected), seed + 1);
        check(find("polished glass"), from, &Cap::narrow(reflected), seed + 2);
        check(find("polished glass"), from, &Cap::narrow(through), seed + 3);
        check(find("Beckmann's polished silver"), from, &Cap::narrow(reflected), seed + 4);
        check(find("Beckmann's polished glass"), from, &Cap::narrow(reflected), seed + 5);
        check(find("Beckmann's polished glass"), from, &Cap::narrow(through), seed + 6);
    }
}

fn find_refracted(eta: f32, from: Vec3A) -> Vec3A {
    let smooth = glass(eta, 0.0);
    smooth.sample(UV, from, Mode::Radiance, (0.999, Vec2::ZERO)).unwrap().to
}

#[test]
fn a_density_that_is_one_percent_off_is_found() {
    let (material, from) = (diffuse(0.5, 0.5, 0.5), direction(0.6, 2.0));
    let pdf = |to| material.pdf(UV, from, to);
    let cap = Cap::sphere();
    let skewed = |to: Vec3A| pdf(to) * if to.x > 0.0 { 1.01 } else { 0.99 };
    assert!(p_value(&material, from, &cap, skewed, 400) < level(), "1% to and fro");
    assert!(p_value(&material, from, &cap, |to| 0.99 * pdf(to), 400) < level(), "1% too small");
    assert!(p_value(&material, from, &cap, pdf, 400) > level(), "as it is");
    let too_large = std::panic::catch_unwind(|| p_value(&material, from, &cap, |to| 1.01 * pdf(to), 400));
    assert!(too_large.is_err(), "1% too large");
}

#[test]
fn diracs_come_with_their_probability() {
    let n = 400_000;
    for (i, row) in all().iter().enumerate().filter(|(_, row)| row.material.has_specular()) {
        let from = direction(0.7, 1.0);
        let mut s = stream(500 + i as u64);
        // Each Dirac is named by its direction and probability.
        let mut seen: Vec<(BsdfSample, f64)> = Vec::new();
        for _ in 0..n {
            let u = (s.next_1d(), s.next_2d());
            let Some(b) = row.material.sample(UV, from, Mode::Radiance, u).filter(|b| b.specular) else {
                continue;
            };
            match seen.iter_mut().find(|(x, _)| x.to == b.to && x.pdf == b.pdf) {
                Some((_, count)) => *count += 1.0,
                None => seen.push((b, 1.0)),
            }
        }
        assert!(!seen.is_empty() && seen.len() <= 2, "{}", row.name);
        for (b, count) in seen {
            let p = f64::from(b.pdf);
            let error = (count / f64::from(n) - p).abs();
            // 4.9 standard errors: 1e-6, for fewer than twenty comparisons. At p = 0.04 this is 4% of p.
            assert!(error <= 4.9 * (p * (1.0 - p) / f64::from(n)).sqrt() + 1e-7, "{}: {p} {error}", row.name);
        }
    }
}
