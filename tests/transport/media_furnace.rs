//! Rung 4 in media: scenes in equilibrium, whose radiance is 1 everywhere whatever the media in them do.

use crate::measure::{Means, sharp_runs};
use crate::scenes;
use tyndall::math::Rgb;
use tyndall::medium::phase::{HenyeyGreenstein, Mixture};
use tyndall::medium::{Homogeneous, Phase};
use tyndall::scene::Scene;
use tyndall::transport::{Heuristic, Settings, Technique, TechniqueSet};

/// An empty bubble about the camera: without one, a set whose only technique for some paths is the connection to the
/// lens has an infinite variance, as 1/d² has in a volume.
pub const BUBBLE: &str =
    "\n[[shape]]\nsphere = { center = [0.3, 0.1, 0.2], radius = 0.25 }\nmaterial = 'nothing'\n";

/// A film and a camera for the middle of the scene, a medium of this text, and what to add.
fn text(medium: &str, more: &str) -> String {
    format!(
        "[film]\nwidth = 16\nheight = 16\n[camera]\norigin = [0.3, 0.1, 0.2]\ntarget = [0, 0, -1]\nfov = 70\n\
         [medium.fog]\n{medium}\n[material.grey]\ndiffuse = {{ reflectance = 0.5 }}\n[material.nothing]\nnull = {{}}\n\
         [material.glass]\ndielectric = {{ ior = 1.5 }}\n{more}"
    )
}

/// The diffuse sphere that reflects and emits a half, with `inside` among its keys.
pub fn furnace(medium: &str, inside: &str, more: &str) -> Scene {
    let sphere = "[[shape]]\nsphere = { radius = 1 }\nmaterial = 'grey'\n\
                  emission = { radiance = 0.5, two_sided = true }\n";
    scenes::of(&text(medium, &format!("{sphere}{inside}\n{more}")))
}

fn set(names: &str) -> TechniqueSet {
    TechniqueSet::parse(names.split(',')).expect("known names")
}

/// Radiance 1: in the long study (`TYNDALL_STUDY=1`) a bias of 1% is seen, of 1.5% by sets that are no preset; in the
/// suite three times that, at a ninth of the time.
fn is_one(what: &str, scene: &Scene, settings: &Settings) {
    let preset = settings.techniques == set("pt") || settings.techniques == set("bpt");
    let study = std::env::var_os("TYNDALL_STUDY").is_some();
    let detectable = if preset { 0.01 } else { 0.015 } * if study { 1.0 } else { 3.0 };
    let what = format!("{what}, {} {:?}", settings.techniques, settings.heuristic);
    // What is known has no error of its own.
    let images = sharp_runs(scene, settings, detectable * 2f64.sqrt(), 1000);
    Means::of(&images).assert_mean(&what, 1.0, detectable);
}

/// The channels of a dense medium without absorption must be alike: a walk's weights are products over its collisions, one
/// factor of up to 3 each.
const CHROMATIC: &str = "sigma_a = 0\nsigma_s = [0.4, 0.6, 0.8]\nphase = { hg = 0.6 }";

/// Every set that has a technique for each length, and either heuristic. Paths of more than 64 segments bring less
/// than 1e-4.
#[test]
fn the_foggy_furnace_is_one_for_every_set() {
    let scene = furnace(CHROMATIC, "interior = 'fog'", BUBBLE);
    for heuristic in [Heuristic::Balance, Heuristic::Power(2.0)] {
        for techniques in TechniqueSet::connections() {
            if !(techniques.has(Technique::Hit) || techniques.has(Technique::Lens)) {
                continue;
            }
            // The power heuristic with the sets that are used, and with the noisiest.
            let presets = [set("pt"), set("lt"), set("bpt"), set("hit,connect,lens")];
            if heuristic != Heuristic::Balance && !presets.contains(&techniques) {
                continue;
            }
            let settings = Settings { heuristic, max_length: 64, ..Settings::new(techniques) };
            is_one("furnace in fog", &scene, &settings);
        }
    }
}

/// From a medium that hardly scatters to one of five mean free paths a radius, and phase functions from back to far forward;
/// the camera is in it.
#[test]
fn the_furnace_is_one_at_any_density_and_phase() {
    for (i, (sigma, max_length)) in
        [("[0.05, 0.1, 0.2]", 48), ("[0.9, 1, 1.1]", 96), ("[5, 5, 5]", 600)].into_iter().enumerate()
    {
        for (j, g) in [-0.7, 0.0, 0.9].into_iter().enumerate() {
            let medium = format!("sigma_a = 0\nsigma_s = {sigma}\nphase = {{ hg = {g} }}");
            let scene = furnace(&medium, "interior = 'fog'", "");
            let heuristic = if (i + j) % 2 == 0 { Heuristic::Balance } else { Heuristic::Power(2.0) };
            for techniques in [set("pt"), set("bpt")] {
                let settings = Settings { heuristic, max_length, ..Settings::new(techniques) };
                is_one(&format!("furnace, σ_s = {sigma}, g = {g}"), &scene, &settings);
            }
        }
    }
}

/// Where the medium is said to be makes no difference: in the sphere, everywhere, in an index-matched ball of which the
/// camera is in or out, or about an empty one.
#[test]
fn the_furnace_is_one_wherever_the_medium_is() {
    let ball = "[[shape]]\nsphere = { center = [0.1, -0.1, -0.2], radius = 0.7 }\nmaterial = 'nothing'\n";
    let beside = "[[shape]]\nsphere = { center = [-0.2, 0, -0.5], radius = 0.4 }\nmaterial = 'nothing'\n";
    let filled = "interior = 'fog'\n";
    for (what, inside, more) in [
        ("in the world", "", "[world]\nmedium = 'fog'\n".to_owned()),
        ("in a ball about the camera", "", format!("{ball}{filled}")),
        ("in a ball beside the camera", "", format!("{beside}{filled}")),
        ("about an empty ball", "interior = 'fog'", ball.to_owned()),
    ] {
        let scene = furnace("sigma_a = 0\nsigma_s = [1.6, 2, 2.4]\nphase = { hg = -0.5 }", inside, &more);
        for techniques in [set("pt"), set("bpt")] {
            // Light that leaves the sphere to the outside goes on in the world without end, to no use.
            if what == "in the world" && techniques != set("pt") {
                continue;
            }
            let settings = Settings { max_length: 96, ..Settings::new(techniques) };
            is_one(&format!("furnace with a medium {what}"), &scene, &settings);
        }
    }
}

/// A body that absorbs nothing is invisible before a sky of radiance 1, whatever its boundary: light that goes to and
/// fro between the medium and the glass is not lost. 1000 segments cut less than 1e-4. (Rough glass is no white body: what
/// one facet sends to another is lost.)
#[test]
fn a_white_body_is_invisible_before_a_white_sky() {
    let sky = "[[light]]\nenvironment = { radiance = 1 }\n";
    for material in ["glass", "nothing"] {
        for (shape, density) in [
            ("sphere = { center = [0, 0, -1.2], radius = 0.7 }", "[0.8, 1, 1.2]"),
            ("box = { min = [-0.6, -0.6, -1.8], max = [0.6, 0.5, -0.9] }", "[4, 4, 4]"),
        ] {
            let medium = format!("sigma_a = 0\nsigma_s = {density}\nphase = {{ hg = 0.5 }}");
            let body = format!("[[shape]]\n{shape}\nmaterial = '{material}'\ninterior = 'fog'\n");
            let scene = scenes::of(&text(&medium, &format!("{sky}{body}")));
            for name in ["pt", "bpt"] {
                let settings = Settings { max_length: 1000, ..Settings::new(set(name)) };
                is_one(&format!("white {shape} of {material}"), &scene, &settings);
            }
        }
    }
}

/// What absorbs the share a of its collisions and emits σ_a of the radiance 1 is in equilibrium with what is about it
/// (Kirchhoff): the furnace and the sky stay 1, with any scattering between; in glass of the index n the equilibrium is at
/// n². This asks the emission of scattering media, along whole rays, for the right integral.
#[test]
fn emission_in_equilibrium_is_one() {
    let sky = "[[light]]\nenvironment = { radiance = 1 }\n";
    let body = "[[shape]]\nsphere = { center = [0, 0, -1.2], radius = 0.7 }\ninterior = 'fog'\n";
    let phase = |g: f32| Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).expect("a phase function"));
    let mixed = Mixture::new(vec![(1.0, Phase::Rayleigh), (2.0, phase(0.8)), (1.0, Phase::Isotropic)]);
    let media = [
        ("scattering", Rgb::new(0.3, 0.6, 1.2), Rgb::new(2.0, 1.0, 0.5), phase(0.6)),
        ("dense", Rgb::new(1.0, 0.5, 2.0), Rgb::splat(8.0), Phase::Mixture(mixed.expect("a mixture"))),
        ("absorbing", Rgb::new(0.5, 1.0, 5.0), Rgb::ZERO, Phase::Isotropic),
    ];
    for (what, sigma_a, sigma_s, phase) in media {
        for (place, radiance, scene) in [
            ("furnace", 1.0, furnace("sigma_a = 1\nsigma_s = 1", "interior = 'fog'", "")),
            (
                "matched ball",
                1.0,
                scenes::of(&text("sigma_a = 1\nsigma_s = 1", &format!("{sky}{body}material = 'nothing'"))),
            ),
            (
                "glass ball",
                2.25,
                scenes::of(&text("sigma_a = 1\nsigma_s = 1", &format!("{sky}{body}material = 'glass'"))),
            ),
        ] {
            let medium =
                Homogeneous::new(sigma_a, sigma_s, sigma_a * radiance, phase.clone()).expect("a medium");
            let scene = scenes::refilled(scene, medium);
            for techniques in [set("pt"), set("bpt")] {
                let settings = Settings { max_length: 300, ..Settings::new(techniques) };
                is_one(&format!("{what} medium in equilibrium, {place}"), &scene, &settings);
            }
        }
    }
}
