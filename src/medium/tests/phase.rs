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

/// Both densities integrate to 1, samples follow the first, and the value, D(h) / 4, is the same from both sides.
#[test]
fn flakes_are_sampled_by_what_is_seen_of_them() {
    let axis = |i: u64| random_direction(30 + i);
    for (i, phase) in [
        flakes(axis(0), 0.3, true),
        flakes(axis(1), 0.3, false),
        flakes(axis(2), 1.0, false),
        flakes(axis(3), 0.6, true),
        yarn(),
    ]
    .into_iter()
    .enumerate()
    {
        for from in [random_direction(40 + i as u64), random_direction(50 + i as u64)] {
            Cap::SPHERE.assert_sampler(
                &format!("{} {from}", phase.describe()),
                200_000,
                |s| Some(phase.sample_at(Vec3A::ZERO, from, (s.next_1d(), s.next_2d())).to),
                |to| phase.densities(Vec3A::ZERO, from, to).light,
            );
            let mut s = stream(60);
            for _ in 0..1000 {
                let sample = phase.sample_at(Vec3A::ZERO, from, (s.next_1d(), s.next_2d()));
                let there = phase.densities(Vec3A::ZERO, from, sample.to);
                let near = |a: f32, b: f32| (a / b - 1.0).abs() < 1e-3;
                assert!(near(sample.pdf, there.light) && near(sample.reverse, there.camera));
                assert!(near(sample.pdf * sample.weight, there.value));
                let back = phase.densities(Vec3A::ZERO, sample.to, from);
                assert!(near(back.light, there.camera) && near(back.camera, there.light));
                assert_eq!(back.value.to_bits(), there.value.to_bits());
            }
        }
    }
    assert!(Sggx::new(Vec3A::ZERO, 0.5, true).expect_err("no axis").contains("no length"));
    assert!(Sggx::new(Vec3A::X, 0.0, true).expect_err("too smooth").contains("roughness"));
}

fn flakes(axis: Vec3A, roughness: f32, fibre: bool) -> Phase {
    Phase::Sggx(Sggx::new(axis, roughness, fibre).expect("flakes"))
}

/// Fibres one way and flakes another, with dust between.
fn yarn() -> Phase {
    let lobes = vec![
        (0.5, flakes(random_direction(35), 0.3, true)),
        (0.2, lobe(0.3)),
        (0.3, flakes(random_direction(36), 0.4, false)),
    ];
    Phase::Mixture(Mixture::new(lobes).expect("positive weights"))
}

/// ∫ f(ω, m) over the hemisphere of m about `w`, times ⟨ω, m⟩, by the midpoint rule in the cosine's square and in the angle.
fn seen(w: Vec3A, f: impl Fn(Vec3A) -> f64) -> f64 {
    const N: usize = 500;
    let frame = crate::math::Frame::from_normal(w);
    let mut sum = 0.0;
    for i in 0..N {
        let c2 = (i as f64 + 0.5) / N as f64;
        let (cos, sin) = (c2.sqrt() as f32, (1.0 - c2).sqrt() as f32);
        for j in 0..N {
            let (y, x) = (std::f32::consts::TAU * (j as f32 + 0.5) / N as f32).sin_cos();
            sum += f(frame.to_world(Vec3A::new(sin * x, sin * y, cos)));
        }
    }
    sum * std::f64::consts::PI / (N * N) as f64
}

/// What is seen of flakes from a direction is their projected area, by its definition ∫ ⟨ω, m⟩ D(m) dm; of any phase function it is
/// what collides, whatever way it goes on: ∫ of the value over all directions, which by dω' = 4 ⟨ω, m⟩ dm is the same integral with
/// four times the value in the place of D. It is even, 1 where most is seen, and has the mean that is said.
#[test]
fn what_is_seen_is_the_projected_area() {
    for (i, phase) in [
        flakes(Vec3A::new(0.3, 1.0, -0.2), 0.2, true),
        flakes(Vec3A::new(0.3, 1.0, -0.2), 0.25, false),
        flakes(Vec3A::X, 1.0, true),
        yarn(),
        lobe(0.3),
    ]
    .into_iter()
    .enumerate()
    {
        let (mut least, mut most) = (f32::INFINITY, 0.0f32);
        for k in 0..40 {
            let w = random_direction(200 + k);
            let (area, name) = (phase.area(w), phase.describe());
            let value = |m: Vec3A| f64::from(phase.evaluate(w, m * (2.0 * w.dot(m)) - w));
            let expected = 4.0 * seen(w, value);
            assert!((f64::from(area) / expected - 1.0).abs() < 1e-4, "{name} {w}: {area} for {expected}");
            assert!((area / phase.area(-w) - 1.0).abs() < 1e-6, "{name} is seen alike from behind");
            (least, most) = (least.min(area), most.max(area));
        }
        assert_eq!(phase.is_directional(), [true, true, true, true, false][i]);
        // Factors, or none.
        assert!(if [0, 1, 3].contains(&i) { most > 1.5 * least } else { (most - least).abs() < 1e-6 });
        let mut s = stream(61);
        let n = 200_000;
        let mean: f64 = (0..n)
            .map(|_| f64::from(phase.area(crate::math::warp::uniform_sphere(s.next_2d()))))
            .sum::<f64>()
            / f64::from(n);
        assert!((mean - f64::from(phase.mean_area())).abs() < 3e-3, "{i}: {mean}, {}", phase.mean_area());
    }
    let axis = Vec3A::new(0.3, 1.0, -0.2).normalize();
    let across = axis.any_orthonormal_vector();
    for (phase, best, worst) in
        [(flakes(axis, 0.2, true), across, axis), (flakes(axis, 0.2, false), axis, across)]
    {
        assert!((phase.area(best) - 1.0).abs() < 1e-5 && (phase.area(worst) - 0.2).abs() < 1e-5);
    }
    // A quarter of the surface of what is nearly a cylinder without ends, or a coin.
    for (fibre, mean) in [(true, std::f32::consts::FRAC_PI_4), (false, 0.5)] {
        assert!((flakes(axis, 0.01, fibre).mean_area() - mean).abs() < 6e-3);
    }
}

#[test]
fn by_place_is_one_here_and_another_there() {
    let lattice = Lattice::new([2, 1, 1].into(), &[0.0, 0.75], Interpolation::Constant).expect("a grid");
    let place = crate::medium::volume::cube(Vec3A::ZERO, Vec3A::ONE);
    let share = Placed::new(lattice, place).expect("a place");
    for part in [flakes(Vec3A::X, 0.3, true), yarn()] {
        let message = ByPlace::new(share.clone(), [lobe(0.7), part]).expect_err("flakes");
        assert!(message.contains("`mixture`") && message.contains("a solid of its own"), "{message}");
    }
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
        let found = phase.densities(p, from, to);
        assert!((found.value / value(to) - 1.0).abs() < 1e-5);
        assert!(found.light == found.value && found.camera == found.value);
    }
}
