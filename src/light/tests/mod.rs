//! Tests of all lights through [`Lights`], as transport sees them.

mod emission;
mod environment;
mod refusals;
mod toward;

use super::*;
use crate::geometry::{Geometry, ShapeDesc, TriangleMesh};
use glam::{Mat3A, Vec2, Vec3};

/// Shape 0: a sphere of radius 0.5 about (1, 2, 0). Shape 1: a disc of radius 0.7 about the origin that faces up, a
/// little tilted. Shape 2: a floor. Shape 3: a rectangle of 0.8 by 0.5 with a corner at (-2, 2, -2) that faces down.
pub fn scene() -> Geometry {
    let centre = Vec3A::new(1.0, 2.0, 0.0);
    let corner = Vec3::new(-2.0, 2.0, -2.0);
    let rectangle = TriangleMesh::parallelogram(corner, Vec3::X * 0.8, Vec3::Z * 0.5).unwrap();
    Geometry::build(vec![
        ShapeDesc::Sphere { centre, radius: 0.5 },
        ShapeDesc::Disc { centre: Vec3A::ZERO, normal: tilted(), radius: 0.7 },
        ShapeDesc::Disc { centre: Vec3A::new(0.0, -1.0, 0.0), normal: Vec3A::Y, radius: 4.0 },
        ShapeDesc::Mesh(rectangle),
    ])
}

/// Normal of the scene's tilted disc.
pub fn tilted() -> Vec3A {
    Vec3A::new(0.2, 1.0, -0.3).normalize()
}

pub fn colour() -> Rgb {
    Rgb::new(3.0, 2.0, 0.5)
}

pub fn area(shape: u32, two_sided: bool) -> Light {
    Light::Area(AreaLight::new(shape, colour(), two_sided).unwrap())
}

pub fn point() -> Light {
    Light::Point(PointLight::new(Vec3A::new(-1.0, 1.0, 0.5), colour()).unwrap())
}

pub fn spot(inner: f32, cutoff: f32) -> Light {
    let position = Vec3A::new(0.3, 2.0, 0.4);
    Light::Spot(SpotLight::new(position, spot_axis(), colour(), inner, cutoff).unwrap())
}

pub fn linear_spot(inner: f32, cutoff: f32) -> Light {
    match spot(inner, cutoff) {
        Light::Spot(light) => Light::Spot(light.with_falloff(crate::light::Falloff::Linear)),
        other => other,
    }
}

pub fn spot_axis() -> Vec3A {
    Vec3A::new(0.1, -1.0, 0.3).normalize()
}

pub fn directional() -> Light {
    Light::Directional(DirectionalLight::new(Vec3A::new(1.0, -2.0, 0.5), colour()).unwrap())
}

/// An image of 8×5 pixels with a bright one, dark ones and black ones, rotated.
pub fn image() -> EnvironmentLight {
    let mut pixels: Vec<[f32; 3]> =
        (0..40).map(|i| [0.1 + 0.02 * (i % 7) as f32, 0.3, 0.05 * (i % 3) as f32]).collect();
    pixels[11] = [9.0, 8.0, 5.0];
    for x in 0..4 {
        pixels[24 + x] = [0.0; 3];
        pixels[32 + x] = [0.0; 3];
    }
    EnvironmentLight::image(8, 5, pixels, Mat3A::from_rotation_x(0.4) * Mat3A::from_rotation_y(1.1), 1.5)
        .unwrap()
}

pub fn constant() -> Light {
    Light::Environment(EnvironmentLight::constant(colour()).unwrap())
}

/// The light alone in [`scene`].
pub fn alone(light: Light) -> (Geometry, Lights) {
    let geometry = scene();
    let lights = Lights::new(vec![light], &geometry).unwrap();
    (geometry, lights)
}

/// Each kind of light, by name.
pub fn every_light() -> Vec<(&'static str, Light)> {
    vec![
        ("sphere", area(0, false)),
        ("sphere both sides", area(0, true)),
        ("disc", area(1, false)),
        ("disc both sides", area(1, true)),
        ("mesh", area(3, false)),
        ("point", point()),
        ("spot", spot(20.0, 35.0)),
        ("hard spot", spot(50.0, 50.0)),
        ("soft wide spot", spot(0.0, 90.0)),
        ("linear spot", linear_spot(20.0, 35.0)),
        ("linear hard spot", linear_spot(50.0, 50.0)),
        ("directional", directional()),
        ("constant", constant()),
        ("image", Light::Environment(image())),
    ]
}

/// ∫ f dω over the sphere, by midpoints of equal solid angles.
pub fn over_sphere(f: impl Fn(Vec3A) -> f64) -> f64 {
    use std::f64::consts::PI;
    let (nz, nphi) = (800, 1600);
    let mut sum = 0.0;
    for i in 0..nz {
        let z = -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(nz);
        let r = (1.0 - z * z).sqrt();
        for j in 0..nphi {
            let (s, c) = (2.0 * PI * (f64::from(j) + 0.5) / f64::from(nphi)).sin_cos();
            sum += f(Vec3A::new((r * c) as f32, z as f32, (r * s) as f32));
        }
    }
    sum * 4.0 * PI / f64::from(nz * nphi)
}

/// A light point's two random pairs and selection, and the sample made of them.
pub fn emit(lights: &Lights, geometry: &Geometry, s: &mut crate::math::Stream) -> Option<EmissionSample> {
    let u = s.next_1d();
    lights.sample_emission(geometry, lights.by_power(), u, s.next_2d(), s.next_2d())
}

/// Relative agreement of two densities.
pub fn same(a: f32, b: f32) -> bool {
    (a - b).abs() <= 2e-4 * a.abs().max(b.abs())
}

#[test]
fn a_light_point_is_small() {
    assert!(size_of::<LightPoint>() <= 48);
}

#[test]
fn light_points_know_their_kind() {
    let rows = [
        (area(0, false), false, true, false, false),
        (point(), false, false, true, false),
        (spot(1.0, 2.0), false, false, true, false),
        (directional(), true, false, false, true),
        (constant(), true, true, false, false),
    ];
    for (light, infinite, hittable, position, direction) in rows {
        let kind = light.kind();
        let (geometry, lights) = alone(light);
        let mut s = crate::math::testing::stream(1);
        let lp = emit(&lights, &geometry, &mut s).unwrap().point;
        assert_eq!(lights.is_infinite(&lp), infinite, "{kind}");
        assert_eq!(lights.is_hittable(&lp), hittable, "{kind}");
        assert_eq!(lights.is_delta_position(&lp), position, "{kind}");
        assert_eq!(lights.is_delta_direction(&lp), direction, "{kind}");
        assert_eq!(lights.infinite_toward(Vec3A::Y).is_some(), kind == "environment");
        assert_eq!(lp.footing().is_some(), kind == "area");
        let s = geometry.sample_area(0, Vec2::new(0.2, 0.7));
        assert_eq!(lights.at_surface(&s).is_some(), kind == "area");
    }
}
