use crate::math::testing::{Cap, assert_chi_square, assert_mean, stream};
use crate::medium::grid::{Interpolation, Lattice, Placed};
use crate::medium::phase::{ByPlace, Draine, HenyeyGreenstein, Mixture, Phase, Sggx, Tabulated, droplets};
use glam::{Vec2, Vec3A};

fn lobe(g: f32) -> Phase {
    Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).expect("|g| < 1"))
}

fn mixture() -> Phase {
    let lobes = vec![(1.5, lobe(0.7)), (0.5, lobe(-0.4)), (1.0, Phase::Rayleigh)];
    Phase::Mixture(Mixture::new(lobes).expect("positive weights"))
}

/// Each kind, none of them too narrow for cells all over the sphere.
fn wide() -> Vec<Phase> {
    let lobes = [0.0, 1e-6, -1e-3, 0.3, 0.8, -0.6].map(lobe);
    let draine = [(0.5, 0.0), (0.4, 20.0), (0.7, 3.0)]
        .map(|(g, alpha)| Phase::Draine(Draine::new(g, alpha).expect("a phase function")));
    let simple = [Phase::Isotropic, Phase::Rayleigh, mixture(), Phase::Tabulated(table())];
    simple.into_iter().chain(draine).chain(lobes).collect()
}

/// With nothing between two cosines, and a value of 0 at the end.
fn table() -> Tabulated {
    let entries = [(-1.0, 2.0), (-0.5, 0.5), (-0.25, 0.0), (0.0, 0.0), (0.7, 1.0), (0.9, 4.0), (1.0, 0.0)];
    Tabulated::new(&entries).expect("a table")
}

fn random_direction(i: u64) -> Vec3A {
    crate::math::warp::uniform_sphere(stream(i).next_2d())
}

#[test]
fn samples_follow_the_value_as_their_density() {
    for (i, phase) in wide().iter().enumerate() {
        let from = random_direction(i as u64);
        Cap::SPHERE.assert_sampler(
            &phase.describe(),
            200_000,
            |s| Some(phase.sample(from, (s.next_1d(), s.next_2d())).0),
            |to| phase.evaluate(from, to),
        );
    }
}

#[test]
fn the_density_of_a_sample_is_the_value() {
    let narrow =
        [lobe(0.99), lobe(0.999), lobe(-0.99), droplets(5.0).expect("5"), droplets(50.0).expect("50")];
    for (i, phase) in wide().iter().chain(&narrow).enumerate() {
        let mut s = stream(100 + i as u64);
        for _ in 0..20_000 {
            let from = crate::math::warp::uniform_sphere(s.next_2d());
            let (to, pdf) = phase.sample(from, (s.next_1d(), s.next_2d()));
            let value = phase.evaluate(from, to);
            // In the middle of the narrowest lobe 1e-7 of a direction is 1e-3 of its width.
            assert!((to.length() - 1.0).abs() < 1e-5, "{phase:?}: {to}");
            assert!(pdf > 0.0 && (pdf / value - 1.0).abs() < 2e-3, "{phase:?}: {pdf} for {value}");
            assert_eq!(value.to_bits(), phase.evaluate(to, from).to_bits(), "{phase:?} is reciprocal");
        }
    }
}

/// Henyey's and Greenstein's formula as it stands in the paper, in f64.
fn formula(g: f64, cos: f64) -> f64 {
    (1.0 - g * g) / (4.0 * std::f64::consts::PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5))
}

#[test]
fn values_are_those_of_the_formulas() {
    for angle in [0.0f64, 1e-4, 1e-3, 0.01, 0.3, 1.0, 2.0, 3.0, 3.13, std::f64::consts::PI] {
        let wl = Vec3A::new(0.0, 0.0, -1.0);
        let wc = Vec3A::new(angle.sin() as f32, 0.0, angle.cos() as f32);
        for g in [0.0f32, 1e-7, 0.5, -0.5, 0.9, 0.99, 0.999, -0.999] {
            let (value, expected) = (lobe(g).evaluate(wl, wc), formula(f64::from(g), angle.cos()));
            assert!((f64::from(value) / expected - 1.0).abs() < 1e-3, "{g} {angle}: {value} for {expected}");
        }
        let rayleigh = 3.0 / (16.0 * std::f64::consts::PI) * (1.0 + angle.cos().powi(2));
        assert!((f64::from(Phase::Rayleigh.evaluate(wl, wc)) / rayleigh - 1.0).abs() < 1e-6);
    }
    assert!(lobe(0.8).evaluate(-Vec3A::X, Vec3A::X) > 3.0, "g > 0 goes straight on");
    assert!(lobe(-0.8).evaluate(Vec3A::X, Vec3A::X) > 3.0, "g < 0 goes straight back");
}

#[test]
fn narrow_lobes_have_the_distribution_of_their_formula() {
    for g in [0.95f64, 0.99, 0.999, -0.99] {
        let phase = lobe(g as f32);
        let (n, cells) = (200_000, 64);
        let mut counts = vec![0.0; cells];
        let from = random_direction(7);
        let mut s = stream(71);
        for _ in 0..n {
            let (to, _) = phase.sample(from, (s.next_1d(), s.next_2d()));
            // The distribution function of the cosine; its argument by half angles, as the lobes are narrow.
            let (a, b) = (from.as_dvec3().normalize(), to.as_dvec3().normalize());
            let m = g.abs();
            let versine = 0.5 * (a + b * g.signum()).length_squared();
            let root = ((1.0 - m).powi(2) + 2.0 * m * versine).sqrt();
            // The probability of a larger versine.
            let beyond = (1.0 - m * m) / (2.0 * m) * (root.recip() - (1.0 + m).recip());
            counts[((beyond * cells as f64) as usize).min(cells - 1)] += 1.0;
        }
        let expected = vec![f64::from(n) / cells as f64; cells];
        assert_chi_square(&format!("lobe with g = {g}"), &counts, &expected);
    }
}

#[test]
fn mean_cosines_are_those_of_the_samples() {
    for (phase, mean) in
        [(lobe(0.6), 0.6), (lobe(-0.5), -0.5), (lobe(0.99), 0.99), (mixture(), (1.5 * 0.7 - 0.5 * 0.4) / 3.0)]
    {
        assert!((f64::from(phase.mean_cosine()) - mean).abs() < 1e-6, "{phase:?}");
        let from = random_direction(3);
        assert_mean(&format!("mean cosine of {}", phase.describe()), mean, 1_600_000, |s| {
            f64::from(-from.dot(phase.sample(from, (s.next_1d(), s.next_2d())).0))
        });
    }
    assert_eq!((Phase::Isotropic.mean_cosine(), Phase::Rayleigh.mean_cosine()), (0.0, 0.0));
}

#[test]
fn the_ends_of_the_uniforms_give_directions() {
    let ends = [0.0, 1.0 - 0.5f32.powi(24)];
    let narrow = [0.999_999_94, -0.999_999_94, 0.999].map(lobe);
    for phase in wide().iter().chain(&narrow) {
        for (u, v, w) in ends.iter().flat_map(|u| ends.map(|v| (*u, v, 1.0 - v))) {
            for from in [Vec3A::Z, -Vec3A::Z, random_direction(5)] {
                let (to, pdf) = phase.sample(from, (w, Vec2::new(u, v)));
                assert!(
                    (to.length() - 1.0).abs() < 1e-5 && pdf.is_finite() && pdf > 0.0,
                    "{phase:?} {to} {pdf}"
                );
                assert!(phase.evaluate(from, to).is_finite());
            }
        }
    }
}

#[test]
fn mixtures_are_weighted_means_and_take_mixtures_apart() {
    let (a, b) = (random_direction(11), random_direction(12));
    let expected =
        (1.5 * lobe(0.7).evaluate(a, b) + 0.5 * lobe(-0.4).evaluate(a, b) + Phase::Rayleigh.evaluate(a, b))
            / 3.0;
    assert!((mixture().evaluate(a, b) / expected - 1.0).abs() < 1e-6);
    let nested = Mixture::new(vec![(3.0, mixture()), (1.0, Phase::Isotropic)]).expect("positive weights");
    let nested = Phase::Mixture(nested);
    let expected = 0.75 * mixture().evaluate(a, b) + 0.25 * Phase::Isotropic.evaluate(a, b);
    assert!((nested.evaluate(a, b) / expected - 1.0).abs() < 1e-6);
    assert_eq!(nested.describe().matches(" + ").count(), 3, "{}", nested.describe());
}

#[test]
fn what_is_no_phase_function_is_refused() {
    for g in [1.0, -1.0, 1.5, f32::NAN, f32::INFINITY] {
        let message = HenyeyGreenstein::new(g).expect_err("|g| >= 1");
        assert!(message.contains("between -1 and 1") && message.contains(&g.to_string()), "{message}");
    }
    assert!(Mixture::new(vec![]).expect_err("empty").contains("at least one"));
    for weight in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let message =
            Mixture::new(vec![(1.0, Phase::Isotropic), (weight, Phase::Rayleigh)]).expect_err("a weight");
        assert!(message.contains("weight"), "{message}");
    }
}

#[test]
fn droplets_are_the_published_fit() {
    // (4) to (7) for 20 μm, by a calculator.
    let phase = droplets(20.0).expect("a diameter");
    let (g, h, alpha, w) = (0.994_610_f64, 0.593_791_f64, 27.113_69, 0.498_159);
    for cos in [-1.0f64, -0.6, 0.0, 0.5, 0.9] {
        let draine = formula(h, cos) * (1.0 + alpha * cos * cos) / (1.0 + alpha * (1.0 + 2.0 * h * h) / 3.0);
        let expected = (1.0 - w) * formula(g, cos) + w * draine;
        let to = Vec3A::new((1.0 - cos * cos).sqrt() as f32, 0.0, cos as f32);
        let found = f64::from(phase.evaluate(-Vec3A::Z, to));
        assert!((found / expected - 1.0).abs() < 2e-3, "{cos}: {found} for {expected}");
    }
    for d in [4.9, 50.1, f32::NAN] {
        assert!(droplets(d).expect_err("out of the fit").contains("5 to 50"));
    }
}

#[test]
fn draines_lobe_is_normalised_and_has_its_mean() {
    for (g, alpha) in [(0.3, 1.0), (0.6, 30.0), (0.95, 5.0)] {
        let phase = Phase::Draine(Draine::new(g, alpha).expect("a phase function"));
        let from = random_direction(21);
        assert_mean(
            &format!("mean cosine of {}", phase.describe()),
            phase.mean_cosine().into(),
            1_600_000,
            |s| f64::from(-from.dot(phase.sample(from, (s.next_1d(), s.next_2d())).0)),
        );
    }
}

#[test]
fn tables_are_linear_between_their_entries() {
    let phase = Phase::Tabulated(table());
    let at = |cos: f32| phase.evaluate(-Vec3A::Z, Vec3A::new((1.0 - cos * cos).sqrt(), 0.0, cos));
    assert!((at(0.8) / at(0.7) - 2.5).abs() < 1e-3 && at(-0.1) == 0.0, "{} {}", at(0.8), at(0.7));
    let lambert = Tabulated::new(&[(-1.0, 1.0), (1.0, 1.0)]).expect("a table");
    assert!(
        (Phase::Tabulated(lambert).evaluate(Vec3A::X, Vec3A::Y) * 4.0 * std::f32::consts::PI - 1.0).abs()
            < 1e-6
    );
    for (entries, word) in [
        (&[][..], "empty"),
        (&[(-1.0, 1.0)], "rise from -1 to 1"),
        (&[(-1.0, 1.0), (0.5, 1.0)], "rise from -1 to 1"),
        (&[(-1.0, 1.0), (0.5, 1.0), (0.5, 1.0), (1.0, 1.0)], "rise from -1 to 1"),
        (&[(-1.0, 1.0), (1.0, -1.0)], "not negative"),
        (&[(-1.0, f32::NAN), (1.0, 1.0)], "not negative"),
        (&[(-1.0, 0.0), (1.0, 0.0)], "all 0"),
    ] {
        assert!(Tabulated::new(entries).expect_err(word).contains(word), "{word}");
    }
}

/// Both densities integrate to 1, samples follow the first, and D h / 4 is the same from both sides.
#[test]
fn flakes_are_sampled_by_what_is_seen_of_them() {
    for (i, (roughness, fibre)) in
        [(0.3, true), (0.3, false), (1.0, false), (0.6, true)].into_iter().enumerate()
    {
        let axis = random_direction(30 + i as u64);
        let phase = Phase::Sggx(Sggx::new(axis, roughness, fibre).expect("flakes"));
        for from in [random_direction(40 + i as u64), random_direction(50 + i as u64)] {
            Cap::SPHERE.assert_sampler(
                &format!("{} {from}", phase.describe()),
                200_000,
                |s| Some(phase.sample_at(Vec3A::ZERO, from, (0.5, s.next_2d())).to),
                |to| phase.densities(Vec3A::ZERO, from, to).0,
            );
            let mut s = stream(60);
            for _ in 0..1000 {
                let sample = phase.sample_at(Vec3A::ZERO, from, (0.5, s.next_2d()));
                let (there, back) = phase.densities(Vec3A::ZERO, from, sample.to);
                assert!(
                    (sample.pdf / there - 1.0).abs() < 1e-3 && (sample.reverse / back - 1.0).abs() < 1e-3
                );
                let swapped = phase.densities(Vec3A::ZERO, sample.to, from);
                assert!((swapped.0 / back - 1.0).abs() < 1e-3 && (swapped.1 / there - 1.0).abs() < 1e-3);
            }
        }
    }
    assert!(Sggx::new(Vec3A::ZERO, 0.5, true).expect_err("no axis").contains("no length"));
    assert!(Sggx::new(Vec3A::X, 0.0, true).expect_err("too smooth").contains("roughness"));
}

#[test]
fn by_place_is_one_here_and_another_there() {
    let lattice = Lattice::new([2, 1, 1].into(), &[0.0, 0.75], Interpolation::Constant).expect("a grid");
    let place = crate::medium::volume::cube(Vec3A::ZERO, Vec3A::ONE);
    let share = Placed::new(lattice, place).expect("a place");
    let phase = ByPlace::new(share, [lobe(0.7), lobe(-0.4)]).expect("a phase function");
    let phase = Phase::ByPlace(Box::new(phase));
    let from = random_direction(70);
    for (x, share) in [(0.25, 0.0), (0.75, 0.75), (1.5, 0.0)] {
        let p = Vec3A::new(x, 0.5, 0.5);
        let value = |to| lobe(0.7).evaluate(from, to) * (1.0 - share) + lobe(-0.4).evaluate(from, to) * share;
        Cap::SPHERE.assert_sampler(
            &format!("by place at {x}"),
            200_000,
            |s| Some(phase.sample_at(p, from, (s.next_1d(), s.next_2d())).to),
            value,
        );
        let to = random_direction(71);
        let (a, b) = phase.densities(p, from, to);
        assert!((a / value(to) - 1.0).abs() < 1e-5 && a == b);
    }
}
