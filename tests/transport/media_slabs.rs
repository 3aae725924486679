//! Rung 4 in media: what plane layers reflect and let through.

use crate::measure::{Means, sharp_runs};
use crate::media_closed_forms::expected;
use crate::radiative::{chandrasekhar_h, layer};
use crate::scenes;
use tyndall::film::Image;
use tyndall::scene::Scene;
use tyndall::transport::{Settings, TechniqueSet};

const ALBEDO: [f64; 3] = [0.5, 0.9, 0.97];
/// Half the width of a layer, in mean free paths: nothing is seen of its edges.
const WIDE: f64 = 200.0;

/// A layer from y = −`thickness` to 0, with σ_t = 1 in all channels, from 5 above it under the cosine `mu`.
fn scene(thickness: f64, phase: &str, mu: f64, fov: f64, more: &str) -> Scene {
    let x = 5.0 * (1.0 / (mu * mu) - 1.0).sqrt();
    let sigma_s = ALBEDO;
    let sigma_a = ALBEDO.map(|a| 1.0 - a);
    scenes::of(&format!(
        "[film]\nwidth = 8\nheight = 8\n[camera]\norigin = [{x}, 5, 0]\ntarget = [0, 0, 0]\nup = [0, 0, 1]\nfov = {fov}\n\
         [medium.layer]\nsigma_a = {sigma_a:?}\nsigma_s = {sigma_s:?}\n{phase}\n\
         [material.nothing]\nnull = {{}}\n[material.black]\ndiffuse = {{ reflectance = 0 }}\n\
         [[shape]]\nbox = {{ min = [-{WIDE}, -{thickness}, -{WIDE}], max = [{WIDE}, 0, {WIDE}] }}\n\
         material = 'nothing'\ninterior = 'layer'\n{more}"
    ))
}

fn even(radiance: [f64; 3]) -> Image {
    Image::from_fn(8, 8, |_, _| radiance.map(|v| v as f32))
}

fn compare(what: &str, scene: &Scene, exact: &Image, sets: &[&str]) {
    for names in sets {
        let set = TechniqueSet::parse(names.split(',')).expect("known");
        let settings = Settings { max_length: 400, ..Settings::new(set) };
        let images = sharp_runs(scene, &settings, 0.0097 * 2f64.sqrt(), 4000);
        // A width of 200 mean free paths and single precision at such distances are not quite a layer without end.
        Means::of(&images).assert_near(exact, 3e-4, &format!("{what}, {names}"), 0.01);
    }
}

const SKY: &str = "[[light]]\nenvironment = { radiance = 1 }\n";

/// The half-space of isotropic scattering, lit by the sun or by an even sky [Chandrasekhar 1960]: the radiance is
/// E ϖ/(4π) μ_0/(μ + μ_0) H(μ) H(μ_0) with E across the sun's direction, or 1 − √(1 − ϖ) H(μ).
#[test]
fn a_half_space_reflects_as_chandrasekhar_says() {
    for (mu, mu0) in [(1.0, 0.5), (0.4, 0.8)] {
        let across = (1.0f64 - mu0 * mu0).sqrt();
        let sun =
            format!("[[light]]\ndirectional = {{ direction = [0, -{mu0}, {across}], irradiance = 2 }}\n");
        let lit = scene(200.0, "", mu, 20.0, &sun);
        let h: Vec<_> = ALBEDO.iter().map(|a| (*a, chandrasekhar_h(*a, mu0))).collect();
        // H is smooth: by a table of the cosine.
        let table: Vec<Vec<f64>> = (0..=200)
            .map(|i| ALBEDO.iter().map(|a| chandrasekhar_h(*a, i as f64 / 200.0)).collect())
            .collect();
        let at = |c: usize, mu: f64| {
            let (i, rest) = ((mu * 200.0).floor().min(199.0), mu * 200.0);
            let share = rest - i;
            table[i as usize][c] * (1.0 - share) + table[i as usize + 1][c] * share
        };
        let exact = expected(&lit, |dir| {
            let mu = f64::from(-dir.y);
            std::array::from_fn(|c| {
                let (albedo, h0) = h[c];
                2.0 * albedo / (4.0 * std::f64::consts::PI) * mu0 / (mu + mu0) * at(c, mu) * h0
            })
        });
        compare(&format!("half-space under the sun, μ = {mu}, μ0 = {mu0}"), &lit, &exact, &["pt"]);
        let lit = scene(200.0, "", mu, 20.0, SKY);
        let exact = expected(&lit, |dir| {
            std::array::from_fn(|c| 1.0 - (1.0 - ALBEDO[c]).sqrt() * at(c, f64::from(-dir.y)))
        });
        compare(&format!("half-space under a sky, μ = {mu}"), &lit, &exact, &["pt", "hit"]);
    }
}

/// Layers under an even sky, before a black floor (what they reflect) and with the sky on the other side too (what they
/// reflect and let through), against the adding method.
#[test]
fn layers_reflect_and_transmit_as_by_doubling() {
    let floor = "[[shape]]\nrectangle = { corner = [-1e3, -9, 1e3], u = [2e3, 0, 0], v = [0, 0, -2e3] }\n\
                 material = 'black'\n";
    for (thickness, g, mu) in [(0.5, 0.0, 1.0), (2.0, 0.0, 0.3), (2.0, 0.7, 0.8), (8.0, -0.5, 0.6)] {
        let phase = if g == 0.0 { String::new() } else { format!("phase = {{ hg = {g} }}") };
        let layers = ALBEDO.map(|albedo| layer(thickness, albedo, g, mu));
        let what = |kind: &str| format!("layer of {thickness}, g = {g}, μ = {mu}, {kind}");
        let dark = scene(thickness, &phase, mu, 0.01, &format!("{SKY}{floor}"));
        compare(&what("reflected"), &dark, &even(layers.map(|l| l.reflected)), &["pt", "hit,connect"]);
        let open = scene(thickness, &phase, mu, 0.01, SKY);
        compare(&what("all"), &open, &even(layers.map(|l| l.reflected + l.transmitted)), &["pt", "bpt"]);
    }
}
