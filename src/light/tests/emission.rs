//! Emission: directions, positions and power.

use super::*;
use crate::math::testing::{Cap, assert_chi_square, assert_mean, stream};
use crate::math::{Frame, RgbExt, Stream};
use std::f64::consts::PI;

#[test]
fn directions_follow_their_density() {
    let fixed = Vec2::new(0.3, 0.8);
    for (name, light) in every_light() {
        let infinite = matches!(light, Light::Directional(_) | Light::Environment(_));
        if infinite {
            continue;
        }
        let (geometry, lights) = alone(light);
        let at = lights.sample_emission(&geometry, lights.by_power(), 0.5, fixed, fixed).unwrap().point;
        let one_sided = matches!(name, "sphere" | "disc" | "mesh");
        let cap = match name {
            "spot" | "linear spot" => Cap { axis: spot_axis(), cos_min: 35f64.to_radians().cos() },
            "hard spot" | "linear hard spot" => Cap { axis: spot_axis(), cos_min: 50f64.to_radians().cos() },
            "soft wide spot" => Cap { axis: spot_axis(), cos_min: 0.0 },
            _ if one_sided => Cap { axis: at.n, cos_min: 0.0 },
            "point" => Cap::SPHERE,
            _ => Cap { axis: at.n, cos_min: -1.0 },
        };
        let sample = |s: &mut Stream| {
            let u = s.next_1d();
            let e = lights.sample_emission(&geometry, lights.by_power(), u, fixed, s.next_2d())?;
            assert!(e.point.p == at.p && e.origin == at.p);
            if at.n != Vec3A::ZERO {
                assert!(e.dir.dot(e.point.n) > 0.0, "{name}: emission is on the side of the normal");
            }
            Some(e.dir)
        };
        cap.assert_sampler(name, 1_000_000, sample, |d| lights.pdf_direction(&at, d));
    }
}

#[test]
fn environment_directions_follow_their_density() {
    for (name, light) in [("constant", constant()), ("image", Light::Environment(image()))] {
        let (geometry, lights) = alone(light);
        let sample = |s: &mut Stream| emit(&lights, &geometry, s).map(|e| e.point.n);
        let at = |n| LightPoint { n, ..lights.infinite_toward(n).unwrap() };
        Cap::SPHERE.assert_sampler(name, 400_000, sample, |n| lights.pdf_position(lights.by_power(), &at(n)));
    }
}

#[test]
fn sphere_positions_follow_their_density() {
    let (geometry, lights) = alone(area(0, false));
    let sample =
        |s: &mut Stream| emit(&lights, &geometry, s).map(|e| (e.point.p - Vec3A::new(1.0, 2.0, 0.0)) / 0.5);
    let at = emit(&lights, &geometry, &mut stream(1)).unwrap().point;
    let per_solid_angle = lights.pdf_position(lights.by_power(), &at) * 0.25;
    Cap::SPHERE.assert_sampler("sphere positions", 300_000, sample, |_| per_solid_angle);
}

/// Counts points by (r/R)² and angle in the plane through `centre` across `n`; each cell is as likely as another.
fn assert_uniform_on_disc(
    name: &str,
    centre: Vec3A,
    n: Vec3A,
    radius: f32,
    mut sample: impl FnMut(&mut Stream) -> Vec3A,
) {
    let frame = Frame::from_normal(n);
    let (rings, sectors, draws) = (10usize, 16usize, 200_000);
    let mut counts = vec![0.0; rings * sectors];
    let mut s = stream(5);
    for _ in 0..draws {
        let p = frame.to_local(sample(&mut s) - centre) / radius;
        let r2 = p.x * p.x + p.y * p.y;
        assert!(r2 < 1.0 + 1e-4, "{name}: outside the disc");
        let sector =
            ((f64::from(p.y).atan2(f64::from(p.x)) / (2.0 * PI)).rem_euclid(1.0) * sectors as f64) as usize;
        let ring = ((r2 * rings as f32) as usize).min(rings - 1);
        counts[ring * sectors + sector.min(sectors - 1)] += 1.0;
    }
    let expected = vec![f64::from(draws) / counts.len() as f64; counts.len()];
    assert_chi_square(name, &counts, &expected);
}

#[test]
fn disc_positions_are_uniform() {
    let (geometry, lights) = alone(area(1, true));
    let at = emit(&lights, &geometry, &mut stream(1)).unwrap().point;
    assert!(same(lights.pdf_position(lights.by_power(), &at), (1.0 / (PI * 0.49)) as f32));
    assert_uniform_on_disc("disc", Vec3A::ZERO, tilted(), 0.7, |s| {
        emit(&lights, &geometry, s).unwrap().point.p
    });
}

#[test]
fn infinite_rays_cover_the_scene_from_outside() {
    for (name, light) in [("directional", directional()), ("image", Light::Environment(image()))] {
        let (geometry, lights) = alone(light);
        let (centre, radius) = (geometry.bounding_sphere().0, lights.disc_radius());
        assert!(radius >= geometry.bounding_sphere().1);
        let u_dir = Vec2::new(0.6, 0.7);
        let first =
            lights.sample_emission(&geometry, lights.by_power(), 0.1, Vec2::splat(0.5), u_dir).unwrap();
        let n = first.point.n;
        assert_uniform_on_disc(name, centre, n, radius, |s| {
            let u = s.next_1d();
            let e = lights.sample_emission(&geometry, lights.by_power(), u, s.next_2d(), u_dir).unwrap();
            assert!(e.dir == -n && e.point.n == n);
            assert!(same(e.pdf_dir, 1.0 / (std::f32::consts::PI * radius * radius)));
            assert!((e.origin - centre).dot(n) > 0.9999 * radius, "rays start outside the bounding sphere");
            e.origin
        });
    }
}

#[test]
fn what_a_sample_says_is_what_the_functions_say() {
    let geometry = scene();
    let mut lights: Vec<Light> = every_light().into_iter().map(|l| l.1).collect();
    // One light a shape and one environment: the first two of the names are of the same shape.
    lights.retain(|l| !matches!(l, Light::Area(a) if !a.two_sided));
    lights.retain(|l| !matches!(l, Light::Environment(e) if e.pdf(Vec3A::X) == e.pdf(Vec3A::Y)));
    assert_eq!(lights.len(), 10);
    let lights = Lights::new(lights, &geometry).unwrap();
    let mut s = stream(6);
    let mut seen = [0; 10];
    for _ in 0..100_000 {
        let Some(e) = emit(&lights, &geometry, &mut s) else { continue };
        seen[e.point.light as usize] += 1;
        assert!(same(e.pdf_pos, lights.pdf_position(lights.by_power(), &e.point)), "{e:?}");
        assert!(same(e.pdf_dir, lights.pdf_direction(&e.point, e.dir)), "{e:?}");
        assert_eq!(e.radiance, lights.emitted(&e.point, e.dir), "{e:?}");
        assert!(e.pdf_pos > 0.0 && e.pdf_dir > 0.0 && (e.dir.length() - 1.0).abs() < 1e-4);
    }
    assert!(seen.iter().all(|n| *n > 0), "{seen:?}");
}

/// What the light emits in W, red, from formulas that share nothing with the lights' own.
fn analytic_power(name: &str, disc_radius: f32) -> f64 {
    let disc = PI * f64::from(disc_radius).powi(2);
    // ∫ falloff dω by its definition, over cosines.
    let cone = |inner: f64, cutoff: f64| {
        let (ci, cc) = (inner.to_radians().cos(), cutoff.to_radians().cos());
        let n = 100_000;
        let edge = (0..n)
            .map(|i| (f64::from(i) + 0.5) / f64::from(n))
            .map(|t| t * t * (3.0 - 2.0 * t) * (ci - cc) / f64::from(n))
            .sum::<f64>();
        2.0 * PI * (1.0 - ci + edge)
    };
    // The same where it falls with the angle, over angles.
    let linear_cone = |inner: f64, cutoff: f64| {
        let n = 100_000;
        let at = |i: i32| cutoff * (f64::from(i) + 0.5) / f64::from(n);
        let falloff = |angle: f64| ((cutoff - angle) / (cutoff - inner)).min(1.0);
        2.0 * PI * (0..n).map(|i| falloff(at(i)) * at(i).sin() * cutoff / f64::from(n)).sum::<f64>()
    };
    3.0 * match name {
        "sphere" => PI * (4.0 * PI * 0.25),
        "sphere both sides" => 2.0 * PI * (4.0 * PI * 0.25),
        "disc" => PI * (PI * 0.49),
        "disc both sides" => 2.0 * PI * (PI * 0.49),
        "mesh" => PI * 0.4,
        "point" => 4.0 * PI,
        "spot" => cone(20.0, 35.0),
        "hard spot" | "linear hard spot" => cone(50.0, 50.0),
        "linear spot" => linear_cone(20f64.to_radians(), 35f64.to_radians()),
        "soft wide spot" => cone(0.0, 90.0),
        "directional" => disc,
        "constant" => 4.0 * PI * disc,
        "image" => {
            let environment = image();
            disc * over_sphere(|d| f64::from(environment.radiance(d).x)) / 3.0
        }
        _ => unreachable!("{name}"),
    }
}

/// Le · cos / (p₀ · p₁) of the red channel.
fn red_power(lights: &Lights, geometry: &Geometry, s: &mut Stream) -> f64 {
    emit(lights, geometry, s).map_or(0.0, |e| {
        let cos = lights.cos_at_light(&e.point, e.dir);
        f64::from(e.radiance.x) * f64::from(cos) / (f64::from(e.pdf_pos) * f64::from(e.pdf_dir))
    })
}

#[test]
fn emitted_power_is_the_analytic_power() {
    let geometry = scene();
    let mut sum = 0.0;
    let mut together = Vec::new();
    for (name, light) in every_light() {
        let lights = Lights::new(vec![light.clone()], &geometry).unwrap();
        let power = analytic_power(name, lights.disc_radius());
        assert!((f64::from(lights.power(0).x) / power - 1.0).abs() < 1e-3, "{name}: stated power");
        assert_mean(name, power, 200_000, |s| red_power(&lights, &geometry, s));
        if !name.contains("both") && name != "constant" {
            sum += power;
            together.push(light);
        }
    }
    let lights = Lights::new(together, &geometry).unwrap();
    assert_mean("all lights", sum, 200_000, |s| red_power(&lights, &geometry, s));
}

#[test]
fn lights_are_selected_by_power() {
    let geometry = scene();
    let list: Vec<Light> =
        vec![area(0, false), area(1, true), point(), spot(20.0, 35.0), directional(), constant()];
    let names = ["sphere", "disc both sides", "point", "spot", "directional", "constant"];
    let black = Light::Point(PointLight::new(Vec3A::ZERO, Rgb::ZERO).unwrap());
    let lights = Lights::new(list.into_iter().chain([black]).collect(), &geometry).unwrap();
    assert_eq!(lights.warnings().len(), 1);
    assert!(lights.warnings()[0].contains("light 6 (point)"), "{:?}", lights.warnings());
    let mut powers: Vec<f64> = names.iter().map(|n| analytic_power(n, lights.disc_radius())).collect();
    powers.push(0.0);
    let total: f64 = powers.iter().sum();
    let n = 500_000;
    let mut counts = [0.0; 7];
    let mut s = stream(8);
    for _ in 0..n {
        // The spot's edge and the like: what fails has been selected all the same, but is rare.
        if let Some(e) = emit(&lights, &geometry, &mut s) {
            counts[e.point.light as usize] += 1.0;
        }
    }
    assert_eq!(counts[6], 0.0, "a light without power is never selected");
    for (i, power) in powers.iter().enumerate() {
        assert!((f64::from(lights.by_power().pdf(i)) - power / total).abs() < 1e-5);
    }
    // The colour is the same for all, so that the luminance is in proportion to red.
    assert!(colour().luminance() > 0.0);
    let expected: Vec<f64> = powers.iter().map(|p| p / total * f64::from(n)).collect();
    assert_chi_square("selection", &counts, &expected);
}
