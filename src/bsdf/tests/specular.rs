//! Diracs: their geometry, their Jacobian, and the white furnace.

use super::table::*;
use crate::bsdf::*;
use crate::math::{Frame, Rgb};
use glam::{Vec2, Vec3A};

/// The refracted sample, if there is one.
fn refracted(material: &Material, from: Vec3A, mode: Mode) -> Option<BsdfSample> {
    let last = 1.0 - f32::EPSILON / 2.0;
    material.sample(UV, from, mode, (last, Vec2::ZERO)).filter(|b| b.to.z * from.z < 0.0)
}

/// dω_to/dω_from of the refraction at `from`, by central differences.
fn jacobian(material: &Material, from: Vec3A) -> f32 {
    let frame = Frame::from_normal(from);
    let h = 4e-3;
    let to = |d: Vec3A| refracted(material, (from + d).normalize(), Mode::Radiance).unwrap().to;
    let a = to(h * frame.s) - to(-h * frame.s);
    let b = to(h * frame.t) - to(-h * frame.t);
    a.cross(b).length() / (4.0 * h * h)
}

#[test]
fn the_reverse_density_has_the_jacobian_of_the_refraction() {
    for (material, eta) in [(glass(1.5, 0.0), 1.5), (glass(0.7, 0.0), 0.7), (tinted_glass(0.0), 1.6 / 1.2)] {
        for cos in [0.95, 0.9, 0.8f32] {
            for from in [direction(cos, 0.4), direction(-cos, 2.0)] {
                let there = refracted(&material, from, Mode::Radiance).unwrap();
                let back = refracted(&material, there.to, Mode::Radiance).unwrap();
                assert!((back.to - from).length() < 1e-5, "light retraces its path");
                let j = jacobian(&material, from);
                let ratio = there.pdf_rev / (back.pdf * j);
                assert!((ratio - 1.0).abs() < 2e-3, "η {eta}, from {from}: {ratio}");
                // There and back: the two Jacobians cancel.
                assert!((there.pdf_rev * back.pdf_rev / (there.pdf * back.pdf) - 1.0).abs() < 1e-4);
                // Snell's law, and in one plane with the normal.
                let across = if from.z > 0.0 { eta } else { 1.0 / eta };
                assert!((there.to * across + from).truncate().length() < 1e-5);
            }
        }
    }
}

#[test]
fn reflections_are_mirror_images_with_jacobian_one() {
    for material in [mirror(0.5), metal("gold", 0.0), glass(1.5, 0.0)] {
        for from in directions() {
            let b = material.sample(UV, from, Mode::Importance, (0.0, Vec2::ZERO)).unwrap();
            assert!(b.specular);
            assert_eq!(b.to, Vec3A::new(-from.x, -from.y, from.z));
            assert_eq!(b.pdf, b.pdf_rev);
        }
    }
}

/// Mean of weight as an energy, over the whole range of the lobe's uniform.
fn furnace(material: &Material, eta: f32, from: Vec3A, mode: Mode) -> Rgb {
    let n = 1 << 14;
    let mut sum = glam::DVec3::ZERO;
    for i in 0..n {
        let t = (i as f32 + 0.5) / n as f32;
        let u = Vec2::new((t * 127.0).fract(), (t * 911.0).fract());
        if let Some(b) = material.sample(UV, from, mode, (t, u)) {
            let scale = if mode == Mode::Radiance { radiance_to_energy(eta, from, b.to) } else { 1.0 };
            sum += (b.weight * scale).as_dvec3();
        }
    }
    (sum / f64::from(n)).as_vec3a()
}

#[test]
fn white_materials_return_all_light() {
    let bare = Material::Conductor(Conductor::without_fresnel(0.0, grey(1.0)).unwrap());
    let half = layered(vec![(0.5, diffuse(1.0, 1.0, 1.0)), (0.5, mirror(1.0))]);
    let rows = [
        (diffuse(1.0, 1.0, 1.0), 1.0),
        (mirror(1.0), 1.0),
        (bare, 1.0),
        (half, 1.0),
        (glass(1.5, 0.0), 1.5),
        (glass(0.7, 0.0), 0.7),
        (glass(1.0, 0.0), 1.0),
        (Material::Null, 1.0),
    ];
    for (material, eta) in rows {
        for from in directions().into_iter().chain([direction(1e-3, 0.0), direction(-1e-3, 0.0)]) {
            for mode in [Mode::Radiance, Mode::Importance] {
                let sum = furnace(&material, eta, from, mode);
                assert!((sum - 1.0).abs().max_element() < 2e-3, "{material:?} {mode:?} {from}: {sum}");
            }
        }
    }
}

#[test]
fn nothing_leaves_glass_beyond_the_critical_angle() {
    // sin θ = 1/1.5: cos θ = 0.745.
    for (cos, leaves) in [(-0.74, false), (-0.75, true)] {
        let from = direction(cos, 0.3);
        assert_eq!(refracted(&glass(1.5, 0.0), from, Mode::Radiance).is_some(), leaves);
        let b = glass(1.5, 0.0).sample(UV, from, Mode::Radiance, (0.0, Vec2::ZERO)).unwrap();
        assert_eq!(b.pdf == 1.0, !leaves);
    }
}

#[test]
fn matched_glass_is_not_there() {
    for from in directions() {
        let b = glass(1.0, 0.0).sample(UV, from, Mode::Radiance, (0.0, Vec2::ZERO)).unwrap();
        assert!((b.to + from).length() < 1e-6);
        assert_eq!((b.weight, b.pdf), (Rgb::ONE, 1.0));
        assert!((b.pdf_rev - 1.0).abs() < 1e-6);
    }
}

#[test]
fn specular_materials_cannot_be_evaluated() {
    for material in [mirror(1.0), metal("Al", 0.0), glass(1.5, 0.0), Material::Null] {
        let from = direction(0.5, 0.0);
        let b = material.sample(UV, from, Mode::Radiance, (0.0, Vec2::ZERO)).unwrap();
        assert_eq!(material.evaluate(UV, from, b.to), BsdfValue::ZERO);
        assert!(!material.has_smooth() && material.has_specular());
    }
}
