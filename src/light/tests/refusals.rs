//! What constructors refuse, and how they say it.

use super::*;

fn refused<T>(what: Result<T, String>, words: &[&str]) {
    let message = what.err().unwrap_or_else(|| panic!("accepted: {words:?}"));
    for word in words {
        assert!(message.contains(word), "\"{message}\" does not say \"{word}\"");
    }
}

#[test]
fn lights_refuse_bad_numbers() {
    let (p, d, c) = (Vec3A::ONE, Vec3A::X, colour());
    let negative = Rgb::new(1.0, -0.1, 1.0);
    let nan = Vec3A::new(0.0, f32::NAN, 0.0);
    let infinite = Vec3A::splat(f32::INFINITY);
    refused(AreaLight::new(0, negative, false), &["area light", "radiance", "-0.1"]);
    refused(AreaLight::new(0, nan, false), &["area light", "radiance"]);
    refused(PointLight::new(nan, c), &["point light", "position"]);
    refused(PointLight::new(p, infinite), &["point light", "intensity"]);
    refused(SpotLight::new(nan, d, c, 10.0, 20.0), &["spot light", "position"]);
    refused(SpotLight::new(p, Vec3A::ZERO, c, 10.0, 20.0), &["spot light", "direction"]);
    refused(SpotLight::new(p, d, negative, 10.0, 20.0), &["spot light", "intensity"]);
    for cutoff in [0.0, -5.0, 90.1, f32::NAN] {
        refused(SpotLight::new(p, d, c, 0.0, cutoff), &["spot light", "cutoff"]);
    }
    for inner in [-1.0, 20.1, f32::NAN] {
        refused(SpotLight::new(p, d, c, inner, 20.0), &["spot light", "inner"]);
    }
    refused(DirectionalLight::new(Vec3A::ZERO, c), &["directional light", "direction"]);
    refused(DirectionalLight::new(nan, c), &["directional light", "direction"]);
    refused(DirectionalLight::new(d, negative), &["directional light", "irradiance"]);
    refused(EnvironmentLight::constant(nan), &["environment light", "radiance"]);
}

#[test]
fn images_refuse_bad_pixels() {
    let image = |pixels: Vec<[f32; 3]>, m, scale| EnvironmentLight::image(2, 2, pixels, m, scale);
    let good = vec![[1.0; 3]; 4];
    let with = |c: f32| {
        let mut pixels = good.clone();
        pixels[3][1] = c;
        pixels
    };
    let identity = Mat3A::IDENTITY;
    refused(image(vec![[1.0; 3]; 3], identity, 1.0), &["3 pixels", "2x2"]);
    refused(EnvironmentLight::image(0, 0, vec![], identity, 1.0), &["0x0"]);
    for c in [-1.0, f32::NAN, f32::INFINITY] {
        refused(image(with(c), identity, 1.0), &["column 1, row 1"]);
    }
    refused(image(with(1e38), identity, 1e3), &["column 1, row 1"]);
    for scale in [-1.0, f32::NAN, f32::INFINITY] {
        refused(image(good.clone(), identity, scale), &["scale"]);
    }
    refused(image(good.clone(), Mat3A::from_diagonal(glam::Vec3::new(1.0, 2.0, 1.0)), 1.0), &["rotation"]);
    refused(image(good.clone(), Mat3A::from_diagonal(glam::Vec3::NAN), 1.0), &["rotation"]);
    assert!(image(good, Mat3A::from_rotation_y(0.3), 1.0).is_ok());
}

#[test]
fn scenes_refuse_what_cannot_be_lit() {
    let geometry = scene();
    let new = |lights| Lights::new(lights, &geometry);
    refused(new(vec![]), &["no light"]);
    let black = Light::Point(PointLight::new(Vec3A::ZERO, Rgb::ZERO).unwrap());
    refused(new(vec![black]), &["power"]);
    let dark = EnvironmentLight::image(2, 2, vec![[1.0; 3]; 4], Mat3A::IDENTITY, 0.0).unwrap();
    refused(new(vec![Light::Environment(dark)]), &["power"]);
    refused(new(vec![area(9, false)]), &["no shape 9"]);
    refused(new(vec![area(0, false), area(0, true)]), &["shape 0", "two"]);
    refused(new(vec![constant(), constant()]), &["two environment lights"]);
    let bright = PointLight::new(Vec3A::ZERO, Rgb::splat(3e38)).unwrap();
    refused(new(vec![Light::Point(bright)]), &["light 0 (point)", "not finite"]);
}

#[test]
fn lights_without_power_are_not_found_by_rays() {
    let geometry = scene();
    let black = Light::Area(AreaLight::new(0, Rgb::ZERO, false).unwrap());
    let dark = Light::Environment(EnvironmentLight::constant(Rgb::ZERO).unwrap());
    let lights = Lights::new(vec![black, dark, point()], &geometry).unwrap();
    assert_eq!(lights.warnings().len(), 2);
    assert!(lights.infinite_toward(Vec3A::Y).is_none());
    assert!(lights.at_surface(&geometry.sample_area(0, Vec2::splat(0.5))).is_none());
    assert_eq!(lights.by_power().pdf(2), 1.0);
}
