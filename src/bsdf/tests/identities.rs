//! What holds between a sample, the value and the densities, whatever the directions.

use super::table::*;
use crate::bsdf::*;
use crate::math::{Frame, Rgb, Stream};
use glam::{Vec2, Vec3A};

/// Equal up to `relative`, and to a millionth of the larger scale of things.
fn close(a: f32, b: f32, relative: f32) -> bool {
    (a - b).abs() <= relative * a.abs().max(b.abs()) + 1e-6
}

fn close_rgb(a: Rgb, b: Rgb, relative: f32) -> bool {
    (0..3).all(|i| close(a[i], b[i], relative))
}

fn uniforms(s: &mut Stream) -> (f32, Vec2) {
    (s.next_1d(), s.next_2d())
}

/// How exactly a row can be evaluated in single precision at directions that have been rounded themselves: a
/// narrow lobe magnifies the rounding of the half vector by 1/α.
fn tolerance(row: &Row) -> f32 {
    if row.name.contains("polished") || row.name.contains("narrow") { 2e-3 } else { 2e-4 }
}

/// As [`tolerance`], for light between two directions. At the critical angle a facet's transmittance goes by the root of
/// what the angle lacks, and so does what the rounding of a cosine makes of it.
fn tolerance_between(row: &Row, a: Vec3A, b: Vec3A) -> f32 {
    let (inside, reflected) = (a.z < 0.0, a.z * b.z > 0.0);
    let across = if inside { 1.0 / row.eta } else { row.eta };
    let sin2 = 0.25 * (a - b).length_squared();
    let critical = reflected && (sin2 - across * across).abs() < 1e-5;
    if critical { 0.02 } else { tolerance(row) }
}

#[test]
fn a_sample_says_what_evaluate_says() {
    for row in smooth() {
        let mut s = stream(1);
        let mut made = 0;
        for _ in 0..20_000 {
            let (from, u) = (any_direction(&mut s), uniforms(&mut s));
            for mode in [Mode::Radiance, Mode::Importance] {
                let Some(b) = row.material.sample(UV, from, mode, u).filter(|b| !b.specular) else {
                    continue;
                };
                made += 1;
                let (wl, wc) = mode.order(from, b.to);
                let value = row.material.evaluate(UV, wl, wc);
                let tolerance = tolerance_between(&row, from, b.to);
                let what = || format!("{} {mode:?} from {from} to {}: {b:?} {value:?}", row.name, b.to);
                assert!(b.to.is_normalized(), "{}", what());
                assert!(close_rgb(b.weight * b.pdf, value.f * b.to.z.abs(), tolerance), "{}", what());
                assert_eq!(value.pdfs(mode).0 > 0.0, b.pdf > 0.0, "{}", what());
                assert!(close(value.pdfs(mode).0, b.pdf, tolerance), "{}", what());
                assert!(close(value.pdfs(mode).1, b.pdf_rev, tolerance), "{}", what());
                // From the definitions: the density of the reverse is that of sampling from `to`.
                assert!(close(row.material.pdf(UV, from, b.to), b.pdf, tolerance), "{}", what());
                assert!(close(row.material.pdf(UV, b.to, from), b.pdf_rev, tolerance), "{}", what());
            }
        }
        assert!(made > 10_000, "{}: {made}", row.name);
    }
}

#[test]
fn a_sample_in_the_world_says_what_evaluate_says_there() {
    let frame = Frame::from_normal(tilted());
    for row in smooth() {
        let mut s = stream(11);
        let mut made = 0;
        for _ in 0..5000 {
            let (local, u) = (any_direction(&mut s), uniforms(&mut s));
            let from = frame.to_world(local);
            for mode in [Mode::Radiance, Mode::Importance] {
                let sample = row.material.sample_world(UV.into(), frame.n, from, mode, u);
                let Some(b) = sample.filter(|b| !b.specular) else { continue };
                made += 1;
                let (wl, wc) = mode.order(from, b.to);
                let value = row.material.evaluate_world(UV.into(), frame.n, wl, wc);
                let tolerance = tolerance_between(&row, local, frame.to_local(b.to));
                let what = || format!("{} {mode:?} from {from} to {}: {b:?} {value:?}", row.name, b.to);
                assert!(b.to.is_normalized(), "{}", what());
                let cosine = b.to.dot(frame.n).abs();
                assert!(close_rgb(b.weight * b.pdf, value.f * cosine, tolerance), "{}", what());
                assert!(close(value.pdfs(mode).0, b.pdf, tolerance), "{}", what());
                assert!(close(value.pdfs(mode).1, b.pdf_rev, tolerance), "{}", what());
            }
        }
        assert!(made > 2500, "{}: {made}", row.name);
    }
}

#[test]
fn where_the_sphere_of_directions_touches_a_diffuse_surface_nothing_is_sampled() {
    let row =
        all().into_iter().find(|row| matches!(row.material, Material::Diffuse(_))).expect("it is listed");
    // u.x = 0 is the pole +z of the sphere, which touches what is seen from below, whichever way its normal points.
    let from = direction(-0.9, 0.3);
    for ns in [Vec3A::Z, -Vec3A::Z] {
        let sample = |u| row.material.sample_world(UV.into(), ns, from, Mode::Radiance, (0.5, u));
        assert_eq!(sample(Vec2::ZERO), None);
        let beside = sample(Vec2::new(1e-6, 0.3)).expect("a direction all but along the surface");
        assert!(beside.to.z < 0.0 && beside.to.z > -0.01 && beside.to.is_normalized(), "{beside:?}");
    }
}

#[test]
fn the_direction_does_not_depend_on_the_mode() {
    for row in all() {
        let mut s = stream(2);
        for _ in 0..2000 {
            let (from, u) = (any_direction(&mut s), uniforms(&mut s));
            let camera = row.material.sample(UV, from, Mode::Radiance, u);
            let light = row.material.sample(UV, from, Mode::Importance, u);
            let (Some(camera), Some(light)) = (camera, light) else {
                assert_eq!(camera, light, "{}", row.name);
                continue;
            };
            assert_eq!((camera.to, camera.specular), (light.to, light.specular), "{}", row.name);
            assert!(close(camera.pdf, light.pdf, 1e-4), "{}", row.name);
            // Smooth reflection and mixtures of both: the same weight, but for η² in what is refracted.
            let scale = radiance_to_energy(row.eta, from, camera.to);
            assert!(
                close_rgb(camera.weight * scale, light.weight, 2e-3),
                "{}: {camera:?} {light:?}",
                row.name
            );
        }
    }
}

#[test]
fn reciprocity_holds_with_eta_squared() {
    for row in smooth() {
        let mut s = stream(3);
        let mut positive = 0;
        for i in 0..20_000 {
            let a = any_direction(&mut s);
            // Half of the pairs are such as occur: sampled.
            let b = match row.material.sample(UV, a, Mode::Radiance, uniforms(&mut s)) {
                Some(sample) if i % 2 == 0 => sample.to,
                _ => any_direction(&mut s),
            };
            let (ab, ba) = (row.material.evaluate(UV, a, b), row.material.evaluate(UV, b, a));
            // f(a → b)/η_b² = f(b → a)/η_a².
            let scale = radiance_to_energy(row.eta, a, b);
            let tolerance = tolerance_between(&row, a, b);
            assert!(close_rgb(ab.f, ba.f * scale, tolerance), "{}: {a} {b} {ab:?} {ba:?}", row.name);
            assert!(close(ab.pdf_lc, ba.pdf_cl, tolerance), "{}: {a} {b}", row.name);
            assert!(close(ab.pdf_cl, ba.pdf_lc, tolerance), "{}: {a} {b}", row.name);
            positive += u32::from(ab.f.max_element() > 0.0);
        }
        assert!(positive > 5000, "{}: {positive}", row.name);
    }
}

/// Mean weight as an energy, a channel each, and its standard error.
fn energy(row: &Row, from: Vec3A, mode: Mode, n: usize, seed: u64) -> (Rgb, f32) {
    let mut s = stream(seed);
    let (mut sum, mut sum2) = (glam::DVec3::ZERO, glam::DVec3::ZERO);
    for _ in 0..n {
        if let Some(b) = row.material.sample(UV, from, mode, uniforms(&mut s)) {
            let scale = if mode == Mode::Radiance { radiance_to_energy(row.eta, from, b.to) } else { 1.0 };
            let w = (b.weight * scale).as_dvec3();
            sum += w;
            sum2 += w * w;
        }
    }
    let mean = sum / n as f64;
    let variance = (sum2 / n as f64 - mean * mean).max_element().max(0.0);
    (mean.as_vec3a(), (variance / n as f64).sqrt() as f32)
}

#[test]
fn no_material_makes_energy() {
    for (i, row) in all().iter().enumerate() {
        for (j, from) in directions().into_iter().chain([direction(0.002, 0.0)]).enumerate() {
            let limit = row.material.albedo_bound();
            assert!(limit <= 1.0, "{} is meant to conserve energy", row.name);
            for mode in [Mode::Radiance, Mode::Importance] {
                let (mean, error) = energy(row, from, mode, 20_000, (1000 + i * 20 + j) as u64);
                // 5 standard errors (3e-7 each) and rounding.
                let most = mean.max_element();
                assert!(most <= limit + 5.0 * error + 1e-4, "{} {mode:?} {from}: {most}", row.name);
                let may_be_black = matches!(row.material, Material::Sided(_)) && from.z < 0.0;
                assert!(most > 0.0 || may_be_black, "{} {mode:?} {from} is black", row.name);
            }
        }
    }
}

#[test]
fn the_modes_agree_on_the_energy() {
    // By reciprocity, the share that a camera walk finds is the share that a light walk carries, from any direction.
    for (i, row) in all().iter().enumerate() {
        for from in directions() {
            let (camera, e1) = energy(row, from, Mode::Radiance, 40_000, 2000 + i as u64);
            let (light, e2) = energy(row, from, Mode::Importance, 40_000, 3000 + i as u64);
            let error = (e1 * e1 + e2 * e2).sqrt();
            let difference = (camera - light).abs().max_element();
            // 5 standard errors of independent runs; 0.5% is seen everywhere.
            assert!(difference <= 5.0 * error + 1e-4, "{} {from}: {camera} {light}", row.name);
        }
    }
}

#[test]
fn a_layered_material_scatters_the_weighted_sum() {
    let parts = || vec![(0.5, diffuse(0.8, 0.2, 0.1)), (0.3, glass(1.5, 0.4)), (0.2, mirror(0.5))];
    let whole = Row { name: "layered".to_owned(), material: layered(parts()), eta: 1.5 };
    let from = direction(0.4, 1.0);
    let mut expected = Rgb::ZERO;
    for (weight, material) in parts() {
        let part = Row { name: "part".to_owned(), material, eta: 1.5 };
        expected += weight * energy(&part, from, Mode::Importance, 200_000, 20).0;
    }
    let (mean, error) = energy(&whole, from, Mode::Importance, 200_000, 21);
    // The parts' own errors are at most as large as the whole's.
    assert!((mean - expected).abs().max_element() < 7.0 * error, "{mean} {expected} {error}");
    assert!(error < 2e-3, "1% is seen");
}

#[test]
fn extreme_directions_give_numbers() {
    let cosines = [0.0, 1e-38, 1e-20, 1e-10, 1e-7, 1e-4, 0.3, 1.0 - 1e-7, 1.0];
    let mut directions = Vec::new();
    for c in cosines {
        for phi in [0.0, 1.5, std::f32::consts::PI] {
            directions.extend([direction(c, phi), direction(-c, phi)]);
        }
    }
    let tiny = [metal("Cu", 0.001), glass(1.5, 0.001), glass(1.0011, 0.3), glass(1e-3, 0.1), glass(1e3, 0.1)];
    let tiny = tiny.into_iter().map(|material| Row { name: "extreme".to_owned(), material, eta: 1.0 });
    for row in all().into_iter().chain(tiny) {
        for &a in &directions {
            for &b in &directions {
                let v = row.material.evaluate(UV, a, b);
                let numbers = v.f.is_finite() && v.pdf_lc.is_finite() && v.pdf_cl.is_finite();
                assert!(numbers && v.f.min_element() >= 0.0, "{}: {a:?} {b:?} {v:?}", row.name);
                assert!(v.pdf_lc >= 0.0 && v.pdf_cl >= 0.0, "{}: {a:?} {b:?} {v:?}", row.name);
            }
            for u in [0.0, 0.25, 0.5, 1.0 - f32::EPSILON / 2.0] {
                for v in [0.0, 1e-6, 0.5, 1.0 - f32::EPSILON / 2.0] {
                    for lobe in [0.0, 0.5, 1.0 - f32::EPSILON / 2.0] {
                        let sample = row.material.sample(UV, a, Mode::Radiance, (lobe, Vec2::new(u, v)));
                        let Some(s) = sample else { continue };
                        let numbers = s.weight.is_finite() && s.pdf.is_finite() && s.pdf_rev.is_finite();
                        assert!(numbers && s.pdf > 0.0 && s.pdf_rev >= 0.0, "{}: {a:?} {s:?}", row.name);
                        assert!((s.to.length() - 1.0).abs() < 1e-5, "{}: {a:?} {s:?}", row.name);
                        assert!(s.weight.min_element() >= 0.0, "{}: {a:?} {s:?}", row.name);
                    }
                }
            }
        }
    }
}

#[test]
fn opaque_materials_are_the_same_from_both_sides() {
    let one_way = |row: &&Row| !matches!(row.material, Material::Sided(_));
    for row in smooth().iter().filter(|r| r.eta == 1.0).filter(one_way) {
        let mut s = stream(5);
        for _ in 0..2000 {
            let (a, b, u) = (any_direction(&mut s), any_direction(&mut s), uniforms(&mut s));
            assert_eq!(
                row.material.evaluate(UV, a, b),
                row.material.evaluate(UV, flip_z(a), flip_z(b)),
                "{}",
                row.name
            );
            let above = row.material.sample(UV, a, Mode::Radiance, u).is_some();
            assert_eq!(
                above,
                row.material.sample(UV, flip_z(a), Mode::Radiance, u).is_some(),
                "{}",
                row.name
            );
            if a.z * b.z < 0.0 {
                assert_eq!(row.material.evaluate(UV, a, b), BsdfValue::ZERO, "{}", row.name);
            }
        }
    }
}
