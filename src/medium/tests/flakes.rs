//! Media of flakes: all that is asked along a ray is what the coefficients at its points, times what is seen of them from the
//! ray's direction, come to.

use super::grid::{Case, KINDS};
use crate::math::testing::{assert_mean, stream};
use crate::math::{Rgb, Stream, warp};
use crate::medium::height::HeightFog;
use crate::medium::phase::{HenyeyGreenstein, Mixture, Sggx};
use crate::medium::varying::{Density, Emission, Extinction, Scattering};
use crate::medium::{Homogeneous, Medium, Phase, Varying};
use glam::{DVec3, UVec3, Vec3A};

const AXIS: Vec3A = Vec3A::new(0.3, 1.0, -0.2);
const ROUGHNESS: f32 = 0.2;
/// Of what shines, over the extinction.
const GLOW: Rgb = Rgb::new(1.0, 0.25, 3.0);
const SIGMA_T: Rgb = Rgb::new(1.2, 0.4, 3.0);
const ALBEDO: Rgb = Rgb::new(0.9, 0.5, 0.8);

fn fibres() -> Phase {
    Phase::Sggx(Sggx::new(AXIS, ROUGHNESS, true).expect("fibres"))
}

/// Three parts of fibres and one of dust.
fn dusty() -> Phase {
    let dust = Phase::HenyeyGreenstein(HenyeyGreenstein::new(0.3).expect("a phase function"));
    Phase::Mixture(Mixture::new(vec![(3.0, fibres()), (1.0, dust)]).expect("a mixture"))
}

/// What is seen of the fibres, by the angle to their axis.
fn seen(dir: Vec3A) -> f64 {
    let cos = f64::from(dir.dot(AXIS.normalize()));
    let r = f64::from(ROUGHNESS);
    (1.0 - cos * cos + r * r * cos * cos).sqrt()
}

/// Each kind of medium on grids in the unit cube, all with emission that is `GLOW` times the extinction.
fn media(s: &mut Stream, phase: &Phase) -> Vec<(String, Medium)> {
    let built = Homogeneous::with_albedo(SIGMA_T, ALBEDO, SIGMA_T * GLOW, phase.clone());
    let mut media = vec![("homogeneous".to_owned(), Medium::Homogeneous(built.expect("a medium")))];
    let mut add = |name: String, extinction, emission| {
        let medium = Varying::new(extinction, Scattering::Albedo(ALBEDO), emission, phase.clone());
        media.push((name, Medium::Varying(Box::new(medium.expect("a medium")))));
    };
    for kind in KINDS {
        let case = Case::noise(s, UVec3::new(7, 6, 9), kind);
        let grid = Box::new(case.placed());
        let density = || Density::Grid(grid.clone());
        add(
            format!("{kind:?}, with the density"),
            Extinction::Scaled(density(), SIGMA_T),
            Emission::WithDensity(SIGMA_T * GLOW),
        );
        let grey = Rgb::splat(1.1);
        add(
            format!("{kind:?}, grey"),
            Extinction::Scaled(density(), grey),
            Emission::Scaled(grid.clone(), grey * GLOW),
        );
        let colours = Box::new(Case::together(&[case.clone(), case.clone().scaled(0.5), case.scaled(2.0)]));
        add(
            format!("{kind:?}, colours"),
            Extinction::Colored(colours.clone()),
            Emission::Colored(colours, GLOW),
        );
    }
    let haze = Density::Height(HeightFog::new(Vec3A::new(0.2, 1.0, 0.1), 0.3, 0.4).expect("haze"));
    add("haze".into(), Extinction::Scaled(haze, SIGMA_T), Emission::WithDensity(SIGMA_T * GLOW));
    media
}

/// From one side of the unit cube to the opposite one.
fn ray(s: &mut Stream) -> (Vec3A, Vec3A, f32) {
    let mut end = |z: f32| Vec3A::new(s.next_1d(), s.next_1d(), z);
    let (a, b) = (end(0.0), end(1.0));
    let turn = |p: Vec3A, i: usize| [p, Vec3A::new(p.y, p.z, p.x), Vec3A::new(p.z, p.x, p.y)][i];
    let i = (3.0 * s.next_1d()) as usize % 3;
    let (a, b) = (turn(a, i), turn(b, i));
    (a, (b - a).normalize(), (b - a).length())
}

fn quadrature(medium: &Medium, (origin, dir, length): (Vec3A, Vec3A, f32)) -> DVec3 {
    const N: usize = 20_000;
    let at = |i: usize| origin + dir * (length * (i as f32 + 0.5) / N as f32);
    let sum: DVec3 = (0..N).map(|i| medium.coefficients(at(i)).sigma_t.as_dvec3()).sum();
    sum * f64::from(length) / N as f64
}

#[test]
fn depths_flights_and_glow_go_with_what_is_seen() {
    for (phase, share) in [(fibres(), 1.0), (dusty(), 0.75)] {
        let mut s = stream(1100);
        for (name, medium) in media(&mut s, &phase) {
            let (mut least, mut most) = (f64::INFINITY, 0.0f64);
            for _ in 0..12 {
                let (origin, dir, length) = ray(&mut s);
                let area = share * seen(dir) + 1.0 - share;
                (least, most) = (least.min(area), most.max(area));
                let depth = |t0, t1| medium.optical_depth(origin, dir, t0, t1).as_dvec3();
                let near = |a: DVec3, b: DVec3, e: f64, what: &str| {
                    let off = (a - b).abs().max_element();
                    assert!(off < e * (0.05 + b.max_element()), "{name}, {what}: {a} for {b}");
                };
                let whole = depth(0.0, length);
                near(whole, quadrature(&medium, (origin, dir, length)) * area, 2e-3, "depth");
                let back = medium.optical_depth(origin + dir * length, -dir, 0.0, length).as_dvec3();
                near(back, whole, 1e-4, "from the far end");
                for channel in 0..3 {
                    for part in [0.1, 0.5, 0.9] {
                        let wanted = (part * whole[channel]) as f32;
                        let t = medium.invert(origin, dir, 0.0, length, channel, wanted).expect("on the ray");
                        let found = depth(0.0, t)[channel];
                        assert!((found - f64::from(wanted)).abs() < 1e-4 * (1.0 + found), "{name}: {found}");
                        let (end, passed) = medium.fly(origin, dir, length, channel, wanted);
                        assert!((end.expect("on the ray") - t).abs() < 1e-5, "{name}");
                        near(passed.as_dvec3(), depth(0.0, t), 1e-4, "flown");
                    }
                    let beyond = whole[channel] as f32 + 0.5;
                    for left in [
                        medium.invert(origin, dir, 0.0, length, channel, beyond),
                        medium.fly(origin, dir, length, channel, beyond).0,
                    ] {
                        assert!((left.expect_err("it ends before") - 0.5).abs() < 1e-4, "{name}");
                    }
                }
                let least_depth = (0.5 * whole.min_element()) as f32;
                let reached = medium.reach(origin, dir, length, least_depth);
                let found = depth(0.0, reached).min_element();
                assert!((found - f64::from(least_depth)).abs() < 1e-4 * (1.0 + found), "{name}: reach");
                let mut kept = Vec::new();
                medium.depths_along(origin, dir, length, &mut kept);
                for t in [0.1 * length, 0.8 * length] {
                    let found = medium.depth_along(&kept, (origin, dir, length), t).as_dvec3();
                    near(found, depth(0.0, t), 1e-4, "kept");
                }
                // ∫ e exp(−a ∫ σ) with e = g σ.
                let glow = medium.emitted(origin, dir, 0.0, length).as_dvec3();
                let expected = GLOW.as_dvec3() * (DVec3::ONE - (-whole).exp()) / area;
                near(glow, expected, 1e-3, "glow");
            }
            assert!(most > 1.5 * least, "{name}: rays that see more and less of it");
        }
    }
}

#[test]
fn flakes_are_tracked_by_what_is_seen() {
    let mut s = stream(1101);
    let mut tracked = 0;
    for (name, medium) in media(&mut s, &fibres()) {
        if !medium.is_tracked() {
            continue;
        }
        tracked += 1;
        let (origin, dir, length) = loop {
            let found = ray(&mut s);
            if (0.4..0.6).contains(&seen(found.1)) {
                break (found.0, found.1, 0.5 * found.2);
            }
        };
        let passed = (-quadrature(&medium, (origin, dir, length)) * seen(dir)).exp().x;
        assert!(passed > 0.1 && passed < 0.8, "{passed}");
        let none = |s: &mut Stream| medium.track(origin, dir, length, s).is_none();
        assert_mean(&format!("delta tracking, {name}"), passed, 500_000, |s| f64::from(u8::from(none(s))));
        assert_mean(&format!("ratio tracking, {name}"), passed, 500_000, |s| {
            f64::from(medium.ratio(origin, dir, length, s))
        });
    }
    assert_eq!(tracked, 2);
}

/// σ_s(ω) p(ω→ω') = σ_s(ω') p(ω'→ω), which is what a collision brings, and what a sample's weight has.
#[test]
fn scattering_is_reciprocal_with_its_rate() {
    for phase in [fibres(), dusty()] {
        let mut s = stream(1102);
        let (_, medium) = media(&mut s, &phase).swap_remove(0);
        let mut factors = 0;
        for _ in 0..2000 {
            let [wl, wc] = [0, 1].map(|_| warp::uniform_sphere(s.next_2d()));
            let found = medium.phase_densities(Vec3A::ZERO, wl, wc);
            let sides = [found.light * medium.area(wl), found.camera * medium.area(wc)];
            for side in sides {
                assert!((side / found.value - 1.0).abs() < 1e-5, "{sides:?} {found:?}");
            }
            let ratio = found.light / found.camera;
            factors += usize::from(!(0.8..1.25).contains(&ratio));
            let sample = medium.sample_phase(Vec3A::ZERO, wl, (s.next_1d(), s.next_2d()));
            let value = medium.phase_densities(Vec3A::ZERO, wl, sample.to).value;
            assert!((sample.pdf * sample.weight / value - 1.0).abs() < 2e-3, "{sample:?} {value}");
        }
        assert!(factors > 400, "{factors}");
    }
}

/// Means over directions, by directions, of what the same media are without flakes.
#[test]
fn what_is_told_of_flakes_is_the_mean_of_all_directions() {
    for phase in [fibres(), dusty()] {
        let mut s = stream(1103);
        let n = 100_000;
        let sum: f64 = (0..n).map(|_| f64::from(phase.area(warp::uniform_sphere(s.next_2d())))).sum();
        let mean = (sum / f64::from(n)) as f32;
        let of = |phase| media(&mut stream(1104), phase);
        for ((name, medium), (_, even)) in of(&phase).into_iter().zip(of(&Phase::Isotropic)) {
            let near = |a: Rgb, b: Rgb| (a / b - Rgb::ONE).abs().max_element() < 5e-3;
            let (typical, even_typical) = (medium.typical_extinction(), even.typical_extinction());
            let (summary, even) = (medium.summary(), even.summary());
            assert!(summary.is_directional && !even.is_directional);
            assert!(near(summary.sigma_t, even.sigma_t * mean), "{name}: {}", summary.sigma_t);
            assert!(near(summary.sigma_s, even.sigma_s * mean), "{name}: {}", summary.sigma_s);
            assert!(near(summary.mean_free_path, even.mean_free_path / mean), "{name}");
            assert!(near(summary.albedo, even.albedo) && summary.emission == even.emission, "{name}");
            assert!(near(typical, even_typical * mean), "{name}: {typical} for {even_typical}");
        }
    }
}
