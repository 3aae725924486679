//! Free flight, both ends of an edge, and emission in random grids, against the slow grids in f64.

use super::grid::{Case, KINDS, Line};
use crate::math::testing::{assert_chi_square, stream};
use crate::math::{Rgb, Stream};
use crate::medium::varying::{Density, Emission, Extinction, Scattering};
use crate::medium::{Draw, Medium, Passage, Phase, Varying};
use glam::DVec3;

/// A medium on a random grid, trilinear or constant, of one density or of colours, with a ray through it.
pub struct Random {
    pub medium: Medium,
    pub line: Line,
    /// The extinction a channel, in units of `sigma_t`.
    cases: [Case; 3],
    sigma_t: DVec3,
    extinction: Extinction,
}

impl Random {
    /// Channels differ by a factor of ten; the depth of the first along the ray is about `depth` where it is one density.
    pub fn new(s: &mut Stream, kind: usize, depth: f64) -> Self {
        loop {
            let case = Case::random(s, KINDS[kind % 2]);
            let line = Line::through(s, &case);
            // Most of the ray in the grid, and a little out of it at the far end.
            let (t0, t1) = line.ends();
            let Some((t0, t1)) = case.placed().crossing(line.origin, line.dir, t0, t1) else { continue };
            let line = Line { t0: t0.into(), t1: f64::from(t0 + 1.05 * (t1 - t0)), ..line };
            let along = case.integral(&line);
            // Rays that only touch the grid, or cross the hole in it, show little.
            if along < 0.5 {
                continue;
            }
            let sigma = (depth / along) as f32;
            let coloured = kind >= 2;
            let (cases, sigma_t, extinction) = if coloured {
                let cases = [case.clone(), case.varied(s), case.varied(s)].map(|c| c.scaled(sigma));
                let grid = Case::together(&cases);
                (cases, DVec3::ONE, Extinction::Colored(Box::new(grid)))
            } else {
                let sigma_t = Rgb::new(sigma, 0.3 * sigma, 3.0 * sigma);
                let grid = Density::Grid(Box::new(case.placed()));
                ([case.clone(), case.clone(), case], sigma_t.as_dvec3(), Extinction::Scaled(grid, sigma_t))
            };
            let medium = of(extinction.clone(), Emission::None);
            return Self { medium, line, cases, sigma_t, extinction };
        }
    }

    /// From the start of the ray to `t`, by the slow grids.
    pub fn depth(&self, t: f64) -> DVec3 {
        let line = Line { t1: t, ..self.line };
        if t <= line.t0 {
            return DVec3::ZERO;
        }
        DVec3::from_array([0, 1, 2].map(|c| self.cases[c].integral(&line))) * self.sigma_t
    }

    fn rate(&self, t: f64) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|c| self.cases[c].value(self.line.at(t)))) * self.sigma_t
    }

    /// The largest extinction of a channel anywhere.
    pub fn largest(&self, channel: usize) -> f64 {
        self.cases[channel].largest() * self.sigma_t[channel]
    }

    /// From the start of the ray to `t`, by the medium.
    pub fn optical_depth(&self, t: f64) -> Rgb {
        let (t0, _) = self.line.ends();
        self.medium.optical_depth(self.line.origin, self.line.dir, t0, t as f32)
    }
}

fn of(extinction: Extinction, emission: Emission) -> Medium {
    let scattering = Scattering::Albedo(Rgb::splat(0.8));
    let medium = Varying::new(extinction, scattering, emission, Phase::Isotropic).expect("a medium");
    Medium::Varying(Box::new(medium))
}

/// 400,000 distances a medium in 24 cells: a rate that is 1% off is seen.
#[test]
fn distances_in_grids_follow_the_transmittance_integral() {
    for kind in 0..4 {
        for index in 0..2 {
            let mut s = stream(910 + 10 * kind as u64 + index);
            let random = Random::new(&mut s, kind, 1.5);
            let Line { origin, dir, t0, t1 } = random.line;
            let (from, to) = random.line.ends();
            let (n, cells) = (400_000, 24);
            let bound = |i: usize| t0 + (t1 - t0) * i as f64 / cells as f64;
            let none: Vec<f64> =
                (0..=cells).map(|i| (-random.depth(bound(i))).exp().element_sum() / 3.0).collect();
            let mut counts = vec![0.0; cells + 1];
            for _ in 0..n {
                let Draw { channel, depth } = Draw::new(s.next_2d());
                let cell = match random.medium.invert(origin, dir, from, to, channel, depth) {
                    Ok(t) => (((f64::from(t) - t0) / (t1 - t0) * cells as f64) as usize).min(cells - 1),
                    Err(_) => cells,
                };
                counts[cell] += 1.0;
            }
            let mut expected: Vec<f64> = none.windows(2).map(|b| (b[0] - b[1]) * f64::from(n)).collect();
            expected.push(none[cells] * f64::from(n));
            assert_chi_square(&format!("grid {kind}, {index}"), &counts, &expected);
        }
    }
}

/// Densities and probabilities of passing, of edges between any two points of a grid, from either end by the renderer's own
/// functions: those of the definitions, and so those of each other.
#[test]
fn both_ends_of_an_edge_in_a_grid_know_its_densities() {
    for kind in 0..4 {
        let mut s = stream(950 + kind as u64);
        let mut in_grids = 0;
        for _ in 0..40 {
            let random = Random::new(&mut s, kind, 2.0);
            let Line { origin, dir, t0, t1 } = random.line;
            for _ in 0..20 {
                let mut point = || (t0 + (t1 - t0) * f64::from(s.next_1d())) as f32;
                let (a, b) = (point(), point());
                let (a, b) = (a.min(b), a.max(b));
                let there = random.medium.optical_depth(origin, dir, a, b);
                let far = origin + dir * b;
                let back = random.medium.optical_depth(far, -dir, 0.0, b - a);
                let exact = random.depth(b.into()) - random.depth(a.into());
                let survival = (-exact).exp();
                let densities = |depth: Rgb, t: f32| {
                    let passage = Passage::CLEAR.then(depth, true);
                    let rate = random.medium.coefficients(origin + dir * t).sigma_t;
                    (passage.density(rate), passage.density(Rgb::ONE))
                };
                // From a the edge ends in b, from b in a.
                for (what, depth, end) in [("there", there, b), ("back", back, a)] {
                    let (density, through) = densities(depth, end);
                    let rate = random.rate(end.into());
                    let expected = survival.dot(rate) / 3.0;
                    let close = |found: f32, expected: f64| {
                        // Places are rounded: to 1e-4 of a voxel, see `assert_near` of the grids.
                        let off = (f64::from(found) - expected).abs();
                        assert!(off < 1e-3 * expected + 2e-4, "{kind} {what}: {found} for {expected}");
                    };
                    close(through, survival.element_sum() / 3.0);
                    // At a voxel's face the rate may be that of either side.
                    let jump =
                        (random.rate(f64::from(end) - 1e-4) - random.rate(f64::from(end) + 1e-4)).length();
                    if jump < 1e-2 * rate.length() {
                        close(density, expected);
                        in_grids += usize::from(expected > 0.01);
                    }
                }
                assert!((there - back).abs().max_element() < 1e-4 * (1.0 + there.max_element()));
            }
        }
        assert!(in_grids > 500, "{in_grids}");
    }
}

/// ∫ e exp(−τ) by Simpson's rule on 32 parts of every piece between planes of either grid, in f64.
fn slow_emission(line: &Line, glow: &[Case; 3], color: DVec3, random: &Random) -> DVec3 {
    let mut cuts = glow[0].cuts(line);
    cuts.extend(random.cases[0].cuts(line));
    cuts.sort_by(f64::total_cmp);
    let mut sum = DVec3::ZERO;
    for pair in cuts.windows(2).filter(|pair| pair[1] - pair[0] > 1e-12) {
        let width = (pair[1] - pair[0]) / 32.0;
        // Just within: at its ends the functions may jump.
        let within = |t: f64| t.clamp(pair[0] + 1e-9 * width, pair[1] - 1e-9 * width);
        for i in 0..32 {
            let a = pair[0] + width * f64::from(i);
            let f = |t: f64| {
                let e = DVec3::from_array([0, 1, 2].map(|c| glow[c].value(line.at(within(t)))));
                e * color * (-random.depth(t)).exp()
            };
            sum += (f(a) + 4.0 * f(a + 0.5 * width) + f(a + width)) * width / 6.0;
        }
    }
    sum
}

/// Emission that goes with the density, on a grid of its own elsewhere, and on one of colours.
#[test]
fn emission_of_grids_is_its_integral() {
    let color = Rgb::new(1.0, 0.25, 3.0);
    for kind in 0..4 {
        let mut s = stream(970 + kind as u64);
        let mut seen = 0.0;
        for _ in 0..4 {
            let random = Random::new(&mut s, kind, 1.5);
            let one = random.cases[0].beside(&mut s);
            let three = [one.clone(), one.varied(&mut s), one.varied(&mut s)];
            let same = |case: &Case| [case.clone(), case.clone(), case.clone()];
            let mut emissions = vec![
                (Emission::Scaled(Box::new(one.placed()), color), same(&one)),
                (Emission::Colored(Box::new(Case::together(&three)), color), three),
            ];
            if kind < 2 {
                emissions.push((Emission::WithDensity(color), same(&random.cases[0])));
            }
            for (emission, glow) in emissions {
                let what = format!(
                    "{kind} {}",
                    match &emission {
                        Emission::WithDensity(_) => "with the density",
                        Emission::Scaled(..) => "of a grid",
                        _ => "of a grid of colours",
                    }
                );
                let medium = of(random.extinction.clone(), emission);
                assert!(medium.is_emissive() && !medium.shines_without_bound());
                let (t0, t1) = random.line.ends();
                let found = medium.emitted(random.line.origin, random.line.dir, t0, t1).as_dvec3();
                let expected = slow_emission(&random.line, &glow, color.as_dvec3(), &random);
                let off = (found - expected).abs() / (expected + 0.01);
                assert!(off.max_element() < 3e-4, "{what}: {found} for {expected}");
                seen += expected.x;
            }
        }
        assert!(seen > 2.0, "{seen}");
    }
}

/// The relative error of depths of 50 places on each of ten beams through a grid, by the depths that are kept and
/// integrated from the beam's start: of each the mean and the largest.
fn depth_errors(case: &Case, s: &mut Stream) -> [(f64, f64); 2] {
    let sigma_t = Rgb::new(1.0, 0.3, 2.0);
    let grid = Density::Grid(Box::new(case.placed()));
    let medium = of(Extinction::Scaled(grid, sigma_t), Emission::None);
    let mut errors = [(0.0, 0.0); 2];
    for _ in 0..10 {
        let mut end = |z: f32| glam::Vec3A::new(s.next_1d(), s.next_1d(), z);
        let (origin, to) = (end(0.0), end(1.0));
        let (dir, length) = ((to - origin).normalize(), (to - origin).length());
        let mut kept = Vec::new();
        medium.depths_along(origin, dir, length, &mut kept);
        for _ in 0..50 {
            // From a hundredth on: where the depth is next to nothing, so is what an error of it does.
            let t = length * (0.01 + 0.99 * s.next_1d());
            let line = Line { origin, dir, t0: 0.0, t1: t.into() };
            let exact = case.integral(&line);
            let found = [
                medium.depth_along(&kept, (origin, dir, length), t),
                medium.optical_depth(origin, dir, 0.0, t),
            ];
            for (error, found) in errors.iter_mut().zip(found) {
                assert!((found.z - 2.0 * found.x).abs() < 1e-6 * found.z, "channels are multiples: {found}");
                let off = f64::from(found.x) / exact - 1.0;
                *error = (error.0 + off / 500.0, f64::max(error.1, off.abs()));
            }
        }
    }
    errors
}

/// Depths by look-up are as exact as integrals from the beam's start, in few voxels, in many, and in so many that the places at
/// which depths are kept are further apart.
#[test]
fn depths_kept_along_beams_are_exact() {
    for (i, size) in [[7, 7, 7], [90, 90, 90], [3, 4, 5000]].into_iter().enumerate() {
        for kind in KINDS {
            let mut s = stream(1000 + i as u64);
            let case = Case::noise(&mut s, size.into(), kind);
            let [kept, integrated] = depth_errors(&case, &mut s);
            println!(
                "{size:?} {kind:?}: kept {:+.1e} on average, {:.1e} at most; integrated {:+.1e}, {:.1e}",
                kept.0, kept.1, integrated.0, integrated.1
            );
            assert!(kept.1 < 1e-5 && kept.0.abs() < 1e-6, "{size:?} {kind:?}: {kept:?}");
            assert!(integrated.1 < 1e-5 && integrated.0.abs() < 1e-6, "{size:?} {kind:?}: {integrated:?}");
        }
    }
}
