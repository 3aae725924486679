use super::medium;
use crate::math::Rgb;
use crate::medium::{Homogeneous, Medium, Phase};
use glam::Vec3A;

const HERE: Vec3A = Vec3A::ZERO;
const AHEAD: Vec3A = Vec3A::X;

fn shining(sigma_t: [f32; 3], emission: [f32; 3]) -> Medium {
    let built = Homogeneous::new(sigma_t.into(), Rgb::ZERO, emission.into(), Phase::Isotropic);
    Medium::Homogeneous(built.expect("a medium"))
}

#[test]
fn depths_are_finite_or_infinite_but_never_nan() {
    let m = medium([0.0, 1e-8, 1e6], 0.5);
    assert_eq!(m.optical_depth(HERE, AHEAD, 0.0, f32::INFINITY), Rgb::new(0.0, f32::INFINITY, f32::INFINITY));
    assert_eq!(m.optical_depth(HERE, AHEAD, 1.0, 3.0), Rgb::new(0.0, 2e-8, 2e6));
    assert_eq!(m.optical_depth(HERE, AHEAD, 2.0, 2.0), Rgb::ZERO);
}

#[test]
fn inversion_finds_the_depth_or_what_is_left_of_it() {
    let m = medium([0.0, 0.25, 1e6], 0.5);
    assert_eq!(m.invert(HERE, AHEAD, 2.0, 10.0, 1, 1.0), Ok(6.0));
    assert_eq!(m.invert(HERE, AHEAD, 2.0, 10.0, 1, 3.0), Err(1.0));
    assert_eq!(m.invert(HERE, AHEAD, 2.0, 10.0, 1, 2.0), Err(0.0), "the end belongs to what comes after it");
    assert_eq!(m.invert(HERE, AHEAD, 2.0, f32::INFINITY, 0, 3.0), Err(3.0), "nothing, for ever");
    assert_eq!(m.invert(HERE, AHEAD, 2.0, f32::INFINITY, 1, 3.0), Ok(14.0));
    assert_eq!(m.invert(HERE, AHEAD, 2.0, 2.0, 2, 1e-8), Err(1e-8), "an empty stretch");
    for depth in [3e-8, 0.1, 0.9, 0.999_999] {
        // As long as one step of the parameter: rounding must not lead out of it.
        let (t0, t1) = (10.0, 10f32.next_up());
        let whole = m.optical_depth(HERE, AHEAD, t0, t1).z;
        let found = m.invert(HERE, AHEAD, t0, t1, 2, depth * whole).expect("inside");
        assert!(t0 <= found && found < t1, "{found}");
    }
}

/// ∫ e exp(−σt) dt over 0..d, by Simpson's rule in f64 over pieces that get longer.
fn by_quadrature(e: f64, sigma: f64, d: f64) -> f64 {
    let d = d.min(if sigma > 0.0 { 60.0 / sigma } else { f64::MAX });
    let n = 4000;
    let f = |i: usize| e * (-sigma * d * i as f64 / n as f64).exp();
    let weighted = (1..n).map(|i| f(i) * if i % 2 == 1 { 4.0 } else { 2.0 });
    (f(0) + weighted.sum::<f64>() + f(n)) * d / n as f64 / 3.0
}

#[test]
fn emission_is_the_integral_along_the_stretch() {
    for sigma in [0.0, 1e-8, 1e-3, 0.5, 1.0, 30.0, 1e6] {
        for d in [0.0, 1e-6, 0.1, 1.0, 2.0, 100.0, 1e8] {
            let m = shining([sigma, 2.0 * sigma, 0.3], [1.0, 0.25, 0.0]);
            let found = m.emitted(HERE, AHEAD, 0.0, d);
            for (channel, sigma, e) in [(0, sigma, 1.0), (1, 2.0 * sigma, 0.25)] {
                let expected = by_quadrature(e, f64::from(sigma), f64::from(d));
                let error = (f64::from(found[channel]) - expected).abs();
                assert!(error <= 1e-6 * expected, "σ {sigma}, d {d}: {} for {expected}", found[channel]);
            }
            assert_eq!(found.z, 0.0, "no emission");
        }
    }
    let m = shining([2.0, 4.0, 0.0], [1.0, 3.0, 0.0]);
    assert_eq!(m.emitted(HERE, AHEAD, 0.0, f32::INFINITY), Rgb::new(0.5, 0.75, 0.0));
    assert!(m.is_emissive() && !m.shines_without_bound());
    assert!(shining([2.0, 4.0, 0.0], [1.0, 3.0, 0.1]).shines_without_bound());
    assert!(!medium([1.0; 3], 0.5).is_emissive());
}

#[test]
fn a_point_tells_whether_paths_go_on() {
    let m = |sigma_a: [f32; 3], sigma_s: [f32; 3]| {
        let built = Homogeneous::new(sigma_a.into(), sigma_s.into(), Rgb::ZERO, Phase::Isotropic);
        let m = Medium::Homogeneous(built.expect("a medium"));
        let continuation = m.continuation(&m.coefficients(HERE));
        (m.scatters(), continuation)
    };
    assert_eq!(m([1.0, 3.0, 0.5], [1.0, 1.0, 1.5]), (true, 0.75));
    assert_eq!(m([1.0, 3.0, 0.0], [1.0, 1.0, 0.0]), (true, 0.5), "channels without extinction do not count");
    assert_eq!(m([0.0; 3], [1e-8, 1e6, 0.1]), (true, 1.0));
    assert_eq!(m([1.0; 3], [0.0; 3]), (false, 0.0));
    assert_eq!(m([0.0; 3], [0.0; 3]), (false, 0.0));
}

#[test]
fn both_forms_are_the_same_medium() {
    let absorbing =
        Homogeneous::new([1.0, 2.0, 0.0].into(), [3.0, 2.0, 0.0].into(), Rgb::ZERO, Phase::Rayleigh);
    let with_albedo =
        Homogeneous::with_albedo([4.0, 4.0, 0.0].into(), [0.75, 0.5, 1.0].into(), Rgb::ZERO, Phase::Rayleigh);
    let [a, b] = [absorbing, with_albedo].map(|m| Medium::Homogeneous(m.expect("a medium")).summary());
    assert_eq!(a, b);
    assert_eq!(a.mean_free_path, Rgb::new(0.25, 0.25, f32::INFINITY));
    assert_eq!((a.albedo, a.phase.as_str(), a.kind), (Rgb::new(0.75, 0.5, 0.0), "Rayleigh", "homogeneous"));
}

#[test]
fn what_is_no_medium_is_refused() {
    let new = |a: f32, s: f32, e: f32| {
        Homogeneous::new(Rgb::splat(a), Rgb::splat(s), Rgb::splat(e), Phase::Isotropic).map(|_| ())
    };
    let albedo = |t: f32, a: f32| {
        Homogeneous::with_albedo(Rgb::splat(t), Rgb::new(0.0, a, 1.0), Rgb::ZERO, Phase::Isotropic)
            .map(|_| ())
    };
    for (refused, word) in [
        (new(-1.0, 1.0, 0.0), "sigma_a"),
        (new(1.0, -1.0, 0.0), "sigma_s"),
        (new(f32::NAN, 1.0, 0.0), "sigma_a"),
        (new(1.0, f32::INFINITY, 0.0), "sigma_s"),
        (new(3e38, 3e38, 0.0), "sigma_a + sigma_s"),
        (new(1.0, 1.0, -0.1), "emission"),
        (new(1.0, 1.0, f32::NAN), "emission"),
        (albedo(-1.0, 0.5), "sigma_t"),
        (albedo(1.0, 1.001), "albedo must be at most 1"),
        (albedo(1.0, -0.5), "albedo"),
        (albedo(1.0, f32::NAN), "albedo"),
    ] {
        assert!(refused.expect_err(word).contains(word), "{word}");
    }
}
