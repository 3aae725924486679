//! What the constructors refuse, and what materials say of themselves.

use super::table::*;
use crate::bsdf::*;
use crate::math::Rgb;
use crate::texture::Texture;
use glam::Vec2;

fn refused<T>(result: Result<T, String>, word: &str) {
    match result {
        Ok(_) => panic!("taken, though {word} is wrong"),
        Err(message) => assert!(message.contains(word), "{message:?} does not say {word:?}"),
    }
}

#[test]
fn parameters_out_of_range_are_refused_by_name() {
    for bad in [-0.1, 1.01, f32::NAN, f32::INFINITY] {
        refused(Diffuse::new(grey(bad)), "reflectance");
        refused(Diffuse::new(rgb(0.5, bad, 0.5)), "reflectance");
        refused(Mirror::new(grey(bad)), "reflectance");
        refused(Conductor::metal("gold", bad, grey(1.0)), "alpha");
        refused(Conductor::metal("gold", 0.1, grey(bad)), "reflectance");
        refused(Conductor::without_fresnel(bad, grey(1.0)), "alpha");
        refused(Dielectric::new(1.5, 1.0, bad, grey(1.0), grey(1.0)), "alpha");
        refused(Dielectric::new(1.5, 1.0, 0.0, grey(bad), grey(1.0)), "reflectance");
        refused(Dielectric::new(1.5, 1.0, 0.0, grey(1.0), grey(bad)), "transmittance");
        refused(Phong::new(grey(bad), grey(0.1), 10.0), "diffuse");
        refused(Phong::new(grey(0.1), grey(bad), 10.0), "specular");
    }
    for bad in [-1.0, 0.0, f32::NAN, f32::INFINITY] {
        refused(Conductor::new(Rgb::new(1.0, bad, 1.0), Rgb::ONE, 0.1, grey(1.0)), "eta");
        refused(Dielectric::new(bad, 1.0, 0.0, grey(1.0), grey(1.0)), "int_ior");
        refused(Dielectric::new(1.0, bad, 0.0, grey(1.0), grey(1.0)), "ext_ior");
    }
    for bad in [-1.0, f32::NAN, f32::INFINITY] {
        refused(Conductor::new(Rgb::ONE, Rgb::new(1.0, 1.0, bad), 0.1, grey(1.0)), "k must");
        refused(Phong::new(grey(0.1), grey(0.1), bad), "exponent");
        refused(Layered::new(vec![(0.5, mirror(1.0)), (bad, mirror(1.0))]), "weight 2");
    }
    refused(Dielectric::new(1.5, 1.5, 0.2, grey(1.0), grey(1.0)), "different indices");
    refused(Dielectric::new(1e30, 1e-30, 0.0, grey(1.0), grey(1.0)), "too far apart");
    refused(Layered::new(vec![]), "at least one");
    refused(Layered::new(vec![(1.0, Material::Null)]), "null");
    refused(Layered::new(vec![(1.0, layered(vec![(1.0, mirror(1.0))]))]), "layered");
    refused(Texture::checker(Rgb::ONE, Rgb::ZERO, Vec2::new(0.0, 1.0), glam::Affine2::IDENTITY), "scale");
}

#[test]
fn metals_are_found_by_name_and_symbol() {
    for name in metals::names() {
        let metal = metals::find(name).unwrap();
        assert!(metal.name == name || metal.symbol == name);
        assert_eq!(metals::find(&name.to_uppercase()).unwrap().symbol, metal.symbol);
        let reflectance = fresnel::conductor(1.0, metal.eta.into(), metal.k.into());
        assert!(
            reflectance.min_element() > 0.35 && reflectance.max_element() < 0.99,
            "{name}: {reflectance}"
        );
    }
    assert_eq!(metals::names().count(), 2 * metals::METALS.len());
    let message = metals::find("goldd").unwrap_err();
    assert!(message.contains("Did you mean `gold`?") && message.contains("tungsten (W)"), "{message}");
    assert!(!metals::find("unobtainium").unwrap_err().contains("mean"));
}

#[test]
fn metals_have_their_colours() {
    let colour = |name: &str| {
        let m = metals::find(name).unwrap();
        fresnel::conductor(1.0, m.eta.into(), m.k.into())
    };
    let (gold, copper, silver, aluminium) = (colour("Au"), colour("Cu"), colour("Ag"), colour("Al"));
    assert!(gold.x > 0.9 && gold.y < 0.85 && gold.z < 0.45, "{gold}");
    assert!(copper.x > copper.y && copper.y > copper.z && copper.x > 0.85, "{copper}");
    assert!(silver.min_element() > 0.97, "{silver}");
    assert!(aluminium.min_element() > 0.9 && aluminium.max_element() < 0.93, "{aluminium}");
}

#[test]
fn going_on_depends_on_the_point() {
    let checker =
        Texture::checker(Rgb::splat(0.2), Rgb::new(0.1, 0.9, 0.3), Vec2::splat(2.0), glam::Affine2::IDENTITY)
            .unwrap();
    let material = Material::Diffuse(Diffuse::new(checker).unwrap());
    assert_eq!(material.continuation(Vec2::new(0.1, 0.1)), 0.2);
    assert_eq!(material.continuation(Vec2::new(0.6, 0.1)), 0.9);
    assert_eq!(glass(1.5, 0.0).continuation(UV), 1.0);
    assert_eq!(tinted_glass(0.2).continuation(UV), 0.9);
    assert!((phong(10.0).continuation(UV) - 0.65).abs() < 1e-6);
    let f0 = metal("gold", 0.2).continuation(UV);
    assert!(f0 > 0.9 && f0 < 1.0);
    let both = layered(vec![(0.5, diffuse(0.2, 0.4, 0.6)), (0.25, mirror(1.0))]);
    assert!((both.continuation(UV) - 0.55).abs() < 1e-6);
}

#[test]
fn more_than_all_light_is_seen_before_rendering() {
    let phong = Phong::new(grey(0.7), grey(0.6), 10.0).unwrap();
    assert!((Material::Phong(phong).albedo_bound() - 1.3).abs() < 1e-6);
    let sum = layered(vec![(0.8, diffuse(1.0, 0.5, 0.5)), (0.4, glass(1.5, 0.0))]);
    assert!((sum.albedo_bound() - 1.2).abs() < 1e-6);
    assert_eq!(sum.continuation(UV), 1.0, "the probability stays one");
}

#[test]
fn black_components_are_never_chosen() {
    let material =
        layered(vec![(0.0, mirror(1.0)), (1.0, diffuse(0.0, 0.0, 0.0)), (0.5, diffuse(0.5, 0.5, 0.5))]);
    let from = direction(0.5, 0.0);
    let v = material.evaluate(UV, from, direction(0.7, 1.0));
    assert!((v.pdf_lc - 0.7 * std::f32::consts::FRAC_1_PI).abs() < 1e-6, "only the last has a density");
    let mut s = stream(30);
    for _ in 0..1000 {
        let b = material.sample(UV, from, Mode::Radiance, (s.next_1d(), s.next_2d())).unwrap();
        assert!(!b.specular && (b.weight - 0.25).abs().max_element() < 1e-6);
    }
    let black = layered(vec![(1.0, diffuse(0.0, 0.0, 0.0))]);
    assert!(black.sample(UV, from, Mode::Radiance, (0.5, Vec2::splat(0.5))).is_none());
    assert_eq!(black.continuation(UV), 0.0);
}

#[test]
fn a_material_stays_small() {
    assert!(size_of::<Material>() <= 64, "{}", size_of::<Material>());
    assert_eq!(size_of::<Texture>(), 16);
}
