//! Sampling toward a reference point: densities and irradiance.

use super::*;
use crate::math::Stream;
use crate::math::testing::{Cap, assert_mean, stream};
use std::f64::consts::PI;

fn toward(lights: &Lights, geometry: &Geometry, from: Vec3A, s: &mut Stream) -> Option<LightSample> {
    let u = s.next_1d();
    lights.sample_toward(geometry, from, u, s.next_2d())
}

#[test]
fn what_a_sample_says_is_what_the_functions_say() {
    for (name, light) in every_light() {
        let other = Light::Point(PointLight::new(Vec3A::splat(9.0), Rgb::ONE).unwrap());
        let geometry = scene();
        let lights = Lights::new(vec![other, light], &geometry).unwrap();
        let mut s = stream(11);
        let mut seen = 0;
        for _ in 0..20_000 {
            let from = Vec3A::new(s.next_1d(), s.next_1d(), s.next_1d()) * 4.0 - 2.0;
            let Some(l) = toward(&lights, &geometry, from, &mut s) else { continue };
            seen += u32::from(l.point.light == 1);
            assert!(
                l.pdf_nee > 0.0 && same(l.pdf_nee, lights.pdf_toward(&geometry, &l.point, from)),
                "{name}: {l:?}"
            );
            assert_eq!(l.radiance, lights.emitted(&l.point, -l.dir), "{name}");
            assert!((l.dir.length() - 1.0).abs() < 1e-5, "{name}");
            let starts = lights.by_power();
            assert_eq!(l.pdf_position(starts), lights.pdf_position(starts, &l.point), "{name}");
            assert_eq!(l.end.pdf_direction, lights.pdf_direction(&l.point, -l.dir), "{name}");
            assert_eq!(l.end.cosine, lights.cos_at_light(&l.point, -l.dir), "{name}");
            assert_eq!(l.end.infinite, lights.is_infinite(&l.point), "{name}");
            assert_eq!(l.end.hittable, lights.is_hittable(&l.point), "{name}");
            if lights.is_infinite(&l.point) {
                assert!(l.inverse_distance == 0.0 && l.point.n == l.dir, "{name}");
            } else {
                assert!((from + l.dir / l.inverse_distance).distance(l.point.p) < 1e-5, "{name}");
            }
            if let (true, Light::Area(_)) = (l.point.light == 1, &lights.lights()[1]) {
                assert!(
                    l.point.n.dot(l.dir) < 0.0,
                    "{name}: the normal is on the side of the reference point"
                );
                let cos = lights.cos_at_light(&l.point, l.dir);
                assert!((cos + l.point.n.dot(l.dir)).abs() < 1e-6, "{name}");
            } else {
                assert_eq!(lights.cos_at_light(&l.point, l.dir), 1.0);
            }
        }
        assert!(seen > 100, "{name}: {seen}");
    }
}

#[test]
fn points_on_a_sphere_follow_the_density_toward_the_reference() {
    let (geometry, lights) = alone(area(0, false));
    let centre = Vec3A::new(1.0, 2.0, 0.0);
    for (name, from) in [("near", Vec3A::new(1.2, 1.3, 0.1)), ("far", Vec3A::new(-3.0, 4.0, 5.0))] {
        let to_from = (from - centre).normalize();
        let sin = 0.5 / f64::from(from.distance(centre));
        let cap = Cap { axis: to_from, cos_min: sin };
        let at = |n: Vec3A| LightPoint { p: centre + 0.5 * n, n, light: 0, prim: 0 };
        let pdf = |n: Vec3A| 0.25 * lights.pdf_toward(&geometry, &at(n), from);
        let sample = |s: &mut Stream| toward(&lights, &geometry, from, s).map(|l| l.point.n);
        cap.assert_sampler(name, 300_000, sample, pdf);
    }
}

/// Red irradiance at `p` with the normal `n`, without occlusion: a draw of its estimator.
fn irradiance(lights: &Lights, geometry: &Geometry, p: Vec3A, n: Vec3A, s: &mut Stream) -> f64 {
    toward(lights, geometry, p, s).map_or(0.0, |l| {
        let cos = l.dir.dot(n).max(0.0);
        let falloff = if l.inverse_distance > 0.0 {
            lights.cos_at_light(&l.point, l.dir) * l.inverse_distance.powi(2)
        } else {
            1.0
        };
        f64::from(l.radiance.x * cos * falloff) / f64::from(l.pdf_nee)
    })
}

#[test]
fn irradiance_is_the_closed_form() {
    let centre = Vec3A::new(1.0, 2.0, 0.0);
    let d = tilted();
    let spot_at = |degrees: f32, distance: f32| {
        let side = spot_axis().any_orthonormal_vector();
        let (s, c) = degrees.to_radians().sin_cos();
        Vec3A::new(0.3, 2.0, 0.4) + distance * (c * spot_axis() + s * side)
    };
    let back = |p: Vec3A, q: Vec3A| (q - p).normalize();
    let spot_position = Vec3A::new(0.3, 2.0, 0.4);
    let environment = image();
    let t = {
        let c = |a: f64| a.to_radians().cos();
        (c(30.0) - c(35.0)) / (c(20.0) - c(35.0))
    };
    let sun = Vec3A::new(-1.0, 2.0, -0.5).normalize();
    let far = Vec3A::new(-3.0, 4.0, 5.0);
    let near = Vec3A::new(1.0, 1.4, 0.0);
    let (aside, across) = (Vec3A::new(0.9, 0.8, -0.2), Vec3A::new(-0.8, -0.1, 0.6).normalize());
    // Light, where, normal, irradiance of the red channel (3 units).
    let rows: Vec<(&str, Light, Vec3A, Vec3A, f64)> = vec![
        // A sphere of radius r at the distance d: π L (r/d)².
        (
            "sphere far",
            area(0, false),
            far,
            back(far, centre),
            PI * 0.25 / f64::from(far.distance_squared(centre)),
        ),
        ("sphere near", area(0, false), near, Vec3A::Y, PI * 0.25 / 0.36),
        ("sphere at 60 degrees", area(0, false), Vec3A::new(1.0, 0.0, 0.0), tilt60(), 0.5 * PI * 0.25 / 4.0),
        // From the middle of a sphere that emits inwards: π L.
        ("inside a sphere", area(0, true), centre, Vec3A::X, PI),
        // A disc of radius r on the axis at the height h: π L r² / (r² + h²).
        ("disc", area(1, false), d * 1.5, -d, PI * 0.49 / (0.49 + 2.25)),
        ("disc close", area(1, false), d * 0.5, -d, PI * 0.49 / (0.49 + 0.25)),
        ("disc's back", area(1, true), d * -1.5, d, PI * 0.49 / (0.49 + 2.25)),
        ("disc aside", area(1, false), aside, across, disc_by_quadrature(aside, across)),
        // From under the corner of a rectangle, parallel to it.
        (
            "rectangle",
            area(3, false),
            Vec3A::new(-2.0, 1.0, -2.0),
            Vec3A::Y,
            corner_of_rectangle(0.8, 0.5, 1.0),
        ),
        ("point", point(), Vec3A::new(-1.0, -1.0, 0.5), Vec3A::Y, 1.0 / 4.0),
        ("spot's axis", spot(20.0, 35.0), spot_at(0.0, 2.0), -spot_axis(), 1.0 / 4.0),
        (
            "spot's inner",
            spot(20.0, 35.0),
            spot_at(19.9, 3.0),
            back(spot_at(19.9, 3.0), spot_position),
            1.0 / 9.0,
        ),
        (
            "spot's edge",
            spot(20.0, 35.0),
            spot_at(30.0, 3.0),
            back(spot_at(30.0, 3.0), spot_position),
            t * t * (3.0 - 2.0 * t) / 9.0,
        ),
        ("directional", directional(), Vec3A::ZERO, Vec3A::Y, f64::from(sun.y)),
        ("constant", constant(), Vec3A::ONE, Vec3A::Y, PI),
        (
            "image",
            Light::Environment(image()),
            Vec3A::ONE,
            d,
            over_sphere(|w| f64::from(environment.radiance(w).x * w.dot(d).max(0.0))) / 3.0,
        ),
    ];
    for (name, light, p, n, expected) in rows {
        let (geometry, lights) = alone(light);
        assert_mean(name, 3.0 * expected, 400_000, |s| irradiance(&lights, &geometry, p, n, s));
    }
}

/// Irradiance by a unit radiance from the scene's tilted disc, by midpoints of equal areas.
fn disc_by_quadrature(p: Vec3A, n: Vec3A) -> f64 {
    let (rings, sectors) = (400, 800);
    let x = tilted().any_orthonormal_vector().as_dvec3();
    let y = tilted().as_dvec3().cross(x);
    let mut sum = 0.0;
    for i in 0..rings {
        let r = 0.7 * ((f64::from(i) + 0.5) / f64::from(rings)).sqrt();
        for j in 0..sectors {
            let (s, c) = (2.0 * PI * (f64::from(j) + 0.5) / f64::from(sectors)).sin_cos();
            let to = r * (c * x + s * y) - p.as_dvec3();
            let cosines = to.dot(n.as_dvec3()).max(0.0) * (-to.dot(tilted().as_dvec3())).max(0.0);
            sum += cosines / to.length_squared().powi(2);
        }
    }
    sum * PI * 0.49 / f64::from(rings * sectors)
}

/// Irradiance by a unit radiance from an a × b rectangle at the height h over the point, with a corner right above.
fn corner_of_rectangle(a: f64, b: f64, h: f64) -> f64 {
    let side = |a: f64, b: f64| a / a.hypot(h) * (b / a.hypot(h)).atan();
    0.5 * (side(a, b) + side(b, a))
}

/// A normal at 60 degrees to the way from (1, 0, 0) up to the sphere's centre.
fn tilt60() -> Vec3A {
    let (s, c) = 60f32.to_radians().sin_cos();
    Vec3A::new(s, c, 0.0)
}

#[test]
fn all_lights_together_add_up() {
    let d = tilted();
    let p = d * 1.5;
    let geometry = scene();
    let list = vec![area(0, false), area(1, false), point(), spot(20.0, 35.0), directional()];
    let alone: f64 = list
        .iter()
        .map(|l| {
            let lights = Lights::new(vec![l.clone()], &geometry).unwrap();
            let mut s = stream(12);
            (0..400_000).map(|_| irradiance(&lights, &geometry, p, Vec3A::X, &mut s)).sum::<f64>() / 400_000.0
        })
        .sum();
    let lights = Lights::new(list, &geometry).unwrap();
    assert_mean("together", alone, 4_000_000, |s| irradiance(&lights, &geometry, p, Vec3A::X, s));
}

#[test]
fn nothing_comes_from_the_back() {
    let d = tilted();
    let (geometry, lights) = alone(area(1, false));
    let mut s = stream(13);
    for _ in 0..1000 {
        assert!(toward(&lights, &geometry, d * -1.5, &mut s).is_none());
    }
    let hit = geometry.sample_area(1, Vec2::splat(0.3));
    let lp = lights.at_surface(&hit).unwrap();
    assert_eq!(lights.emitted(&lp, -d), Rgb::ZERO);
    assert_eq!(lights.pdf_direction(&lp, -d), 0.0);
    assert_eq!(lights.emitted(&lp, d), colour());
    let (geometry, lights) = alone(spot(20.0, 35.0));
    assert!(lights.sample_toward(&geometry, Vec3A::new(0.3, 3.0, 0.4), 0.5, Vec2::ZERO).is_none());
    assert!(lights.sample_toward(&geometry, Vec3A::new(0.3, 2.0, 0.4), 0.5, Vec2::ZERO).is_none());
}
