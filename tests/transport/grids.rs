//! Media that vary: the oracle, homogeneous media as constant grids, equilibrium whatever the grid, and grids turned with all
//! about them.

use crate::measure::{Means, render, runs, sharp_runs};
use crate::media_invariants::assert_same_samples;
use crate::merging::{gathers, set, variant};
use crate::scenes;
use glam::{Affine3A, UVec3, Vec3A};
use tyndall::math::{Rgb, Stream, StreamKind};
use tyndall::medium::grid::{Interpolation, Lattice, Placed};
use tyndall::medium::phase::HenyeyGreenstein;
use tyndall::medium::varying::{Density, Emission, Extinction, Scattering};
use tyndall::medium::{Medium, Phase, Varying, volume};
use tyndall::scene::{Scene, Traits};
use tyndall::transport::merge::MergeSettings;
use tyndall::transport::technique::PRESETS;
use tyndall::transport::{Connections, Heuristic, Settings, Technique, TechniqueSet, Tracking};

/// Every preset that connects, and every single technique, either heuristic.
#[test]
fn weights_and_contributions_are_the_oracles() {
    let scene = scenes::load("clouds");
    let mut seen = [0; Technique::COUNT];
    for (i, names) in ["pt", "bpt", "lt,hit", "hit,connect", "hit,nee,lens"].into_iter().enumerate() {
        let heuristic = [Heuristic::Balance, Heuristic::Power(2.0)][i % 2];
        let result =
            crate::weights::check("clouds", &scene, &crate::weights::settings(set(names), heuristic), 4);
        result.add_to(&mut seen);
    }
    for technique in TechniqueSet::of_connections().iter() {
        assert!(seen[technique.index()] > 25, "{technique:?}: {seen:?}");
    }
}

/// Presets that merge, with short and long beams.
#[test]
fn weights_and_contributions_of_merges_are_the_oracles() {
    crate::merges::check_presets("clouds");
}

/// The medium as a grid in which all values are the same; `kind` of several forms that all mean it.
fn as_grid(medium: &Medium, kind: usize) -> Medium {
    let summary = medium.summary();
    let place = volume::cube(Vec3A::splat(-9.0), Vec3A::splat(11.0));
    let size = UVec3::new(7, 9, 5);
    let count = size.element_product() as usize;
    let interpolation = [Interpolation::Trilinear, Interpolation::Constant][kind % 2];
    let scattering = Scattering::Albedo(summary.albedo);
    let extinction = if kind < 2 {
        let lattice = Lattice::new(size, &vec![2.0; count], interpolation).expect("a grid");
        let grid = Placed::new(lattice, place).expect("a place");
        Extinction::Scaled(Density::Grid(Box::new(grid)), summary.sigma_t * 0.5)
    } else {
        let numbers: Vec<f32> = (0..3 * count).map(|i| summary.sigma_t[i % 3]).collect();
        let lattice = Lattice::new(size, &numbers, interpolation).expect("a grid");
        Extinction::Colored(Box::new(Placed::new(lattice, place).expect("a place")))
    };
    let phase = medium.phase().clone();
    Medium::Varying(Box::new(Varying::new(extinction, scattering, Emission::None, phase).expect("a medium")))
}

fn with_media(mut scene: Scene, media: Vec<Medium>) -> Scene {
    scene.media = media;
    scene.traits = Traits::of(&scene.media);
    scene
}

/// Every preset: the media of a scene, and constant grids in their place. Sample by sample where nothing merges; where a path that
/// rounding sends elsewhere is merged with in many pixels, by the means of all tiles.
#[test]
fn a_constant_grid_is_a_homogeneous_medium() {
    for (s, name) in ["balls", "drink", "furnace_fog"].into_iter().enumerate() {
        for (i, preset) in PRESETS.iter().enumerate() {
            // Each scene every third preset, all of them somewhere.
            if i % 3 != s {
                continue;
            }
            // The drink's caustics are too rare for a few runs to see a difference of what merges.
            let merges = TechniqueSet::of(preset.techniques).merges();
            let name = if name == "drink" && merges { "balls" } else { name };
            let scene = scenes::load(name);
            let merging = variant(i, gathers([0.05, 0.1, 0.06, 0.06, 0.04], [600, 500, 400, 300, 200]));
            let merging = MergeSettings { first: preset.first, ..merging };
            let techniques = TechniqueSet::of(preset.techniques);
            // Thinning and what a merge finds hang on every path of a pilot or of an iteration.
            let connections = Connections::All;
            let settings = Settings {
                max_length: 6,
                merging,
                connections,
                tracking: Tracking::Exact,
                ..Settings::new(techniques)
            };
            // Of several seeds, below each other: in the drink rounding sends one path of light in 25 elsewhere, give or take some.
            let picture = |scene: &Scene| {
                let images = (5..9).map(|seed| render(scene, &Settings { seed, ..settings }, 2).image());
                images
                    .reduce(|mut all, image| {
                        all.height += image.height;
                        all.pixels.extend(image.pixels);
                        all
                    })
                    .expect("seeds")
            };
            let media: Vec<Medium> =
                scene.media.iter().enumerate().map(|(m, medium)| as_grid(medium, (i + m) % 4)).collect();
            let grids = with_media(scenes::load(name), media);
            let what = format!("{name}, {}", preset.key);
            if merges {
                let means = |scene: &Scene| Means::of(&runs(scene, &settings, 32, 6));
                let (grids, scene) = (means(&grids), means(&scene));
                println!("{what}: detectable {:.4}", grids.detectable(&scene));
                grids.assert_same(&scene, &what, f64::INFINITY);
            } else {
                assert_same_samples(&what, &picture(&grids), &picture(&scene));
            }
        }
    }
}

/// A medium on such a grid that does not shine.
fn wild(density: f32, albedo: f32, phase: Phase, coloured: bool) -> Medium {
    scattering(noise(density, coloured), albedo, Emission::None, phase)
}

fn scattering(extinction: Extinction, albedo: f32, emission: Emission, phase: Phase) -> Medium {
    let scattering = Scattering::Albedo(Rgb::splat(albedo));
    Medium::Varying(Box::new(Varying::new(extinction, scattering, emission, phase).expect("a medium")))
}

/// A grid of noise with holes, many times as dense in some places as in others, turned against the axes.
fn noise(density: f32, coloured: bool) -> Extinction {
    let mut random = Stream::new(77, 0, StreamKind::Other, 0);
    let size = UVec3::new(6, 5, 7);
    let count = size.element_product() as usize;
    let mut number = |_: usize| {
        let u = random.next_1d();
        if u < 0.3 { 0.0 } else { 3.0 * u * u }
    };
    let place = Affine3A::from_axis_angle(glam::Vec3::new(1.0, 2.0, 0.5).normalize(), 0.7)
        * volume::cube(Vec3A::splat(-2.2), Vec3A::splat(2.2));
    let interpolation = if coloured { Interpolation::Constant } else { Interpolation::Trilinear };
    if coloured {
        // Dense media without absorption must have channels that are alike.
        let mut numbers = Vec::new();
        for i in 0..count {
            let value = density * number(i);
            numbers.extend([0.8 * value, value, 1.1 * value]);
        }
        let lattice = Lattice::new(size, &numbers, interpolation).expect("a grid");
        Extinction::Colored(Box::new(Placed::new(lattice, place).expect("a place")))
    } else {
        let numbers: Vec<f32> = (0..count).map(number).collect();
        let lattice = Lattice::new(size, &numbers, interpolation).expect("a grid");
        let grid = Placed::new(lattice, place).expect("a place");
        Extinction::Scaled(Density::Grid(Box::new(grid)), Rgb::new(0.9, 1.0, 1.1) * density)
    }
}

fn lobe(g: f32) -> Phase {
    Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).expect("a phase function"))
}

/// The conservative sphere: radiance 1 whatever the grid, for every set of connections that makes all paths.
#[test]
fn the_furnace_is_one_with_any_grid() {
    let study = std::env::var_os("TYNDALL_STUDY").is_some();
    let bubble = crate::media_furnace::BUBBLE;
    let scene = |medium| {
        with_media(
            crate::media_furnace::furnace("sigma_a = 0\nsigma_s = 1", "interior = 'fog'", bubble),
            vec![medium],
        )
    };
    let mut i = 0;
    for techniques in TechniqueSet::connections() {
        if !(techniques.has(Technique::Hit) || techniques.has(Technique::Lens)) {
            continue;
        }
        i += 1;
        let medium = wild(0.8, 1.0, lobe([0.6, -0.4, 0.0][i % 3]), i % 2 == 0);
        let heuristic = if i % 3 == 2 { Heuristic::Power(2.0) } else { Heuristic::Balance };
        let settings = Settings { heuristic, max_length: 64, seed: 300, ..Settings::new(techniques) };
        let detectable = if study { 0.01 } else { 0.04 };
        let images = sharp_runs(&scene(medium), &settings, detectable * 2f64.sqrt(), 1000);
        Means::of(&images).assert_mean(&format!("furnace with a grid, {techniques}"), 1.0, detectable);
    }
}

/// The same for sets that merge, with the other furnace behind the wall. What merges with points blurs σ_s itself, not only the
/// light that comes: so no radius here is above a tenth of a voxel.
#[test]
fn the_furnace_is_one_with_any_grid_for_sets_that_merge() {
    let study = std::env::var_os("TYNDALL_STUDY").is_some();
    let detectable = if study { 0.01 } else { 0.06 };
    for (i, (names, first)) in [
        ("pp3d", true),
        ("pb2d", true),
        ("bp2d", true),
        ("bb1d", true),
        ("upbp", false),
        ("upbp,bp2d", false),
        ("bpm", false),
        ("vcm", false),
    ]
    .into_iter()
    .enumerate()
    {
        let techniques = match first {
            true => TechniqueSet::of(PRESETS.iter().find(|p| p.key == names).expect("a preset").techniques),
            false => set(names),
        };
        let scene = crate::merge_furnace::furnace("sigma_s = 1", 16, true, "");
        let scene = with_media(scene, vec![wild(0.6, 1.0, lobe([0.5, 0.0, -0.4][i % 3]), false)]);
        let radii = if first { [0.2, 0.1, 0.06, 0.06, 0.04] } else { [0.05, 0.1, 0.06, 0.06, 0.04] };
        let merging = MergeSettings { first, ..variant(i, gathers(radii, [2000, 1800, 1600, 1400, 1000])) };
        let settings =
            Settings { merging, max_length: 96, seed: 400 + i as u64, ..Settings::new(techniques) };
        let images = if study {
            sharp_runs(&scene, &settings, detectable * 2f64.sqrt(), 4000)
        } else {
            runs(&scene, &settings, 64, if first { 10 } else { 4 })
        };
        println!("{names}: {:.4?}", crate::merging::mean_and_error(&crate::merging::image_means(&images)));
        Means::of(&images).assert_mean(&format!("{names} with a grid"), 1.0, detectable);
    }
}

/// What absorbs the share a of its collisions and emits σ_a of the radiance 1, place by place, is in equilibrium with the furnace:
/// emission that goes with the density, on a grid of its own, and on one of colours.
#[test]
fn emission_in_equilibrium_is_one_on_any_grid() {
    let study = std::env::var_os("TYNDALL_STUDY").is_some();
    let detectable = if study { 0.01 } else { 0.03 };
    let albedo = 0.6;
    for (kind, what) in ["with the density", "of a grid", "of colours"].into_iter().enumerate() {
        let extinction = noise(1.5, kind == 2);
        let emission = match &extinction {
            Extinction::Scaled(Density::Grid(grid), sigma_t) => {
                let sigma_a = *sigma_t * (1.0 - albedo);
                if kind == 0 {
                    Emission::WithDensity(sigma_a)
                } else {
                    Emission::Scaled(grid.clone(), sigma_a)
                }
            }
            Extinction::Colored(grid) => Emission::Colored(grid.clone(), Rgb::splat(1.0 - albedo)),
            Extinction::Scaled(..) => unreachable!("noise is on a grid"),
        };
        let medium = scattering(extinction, albedo, emission, lobe(0.5));
        for (i, name) in ["pt", "bpt", "upbp"].into_iter().enumerate() {
            let scene = crate::merge_furnace::furnace("sigma_s = 1", 16, true, "");
            let scene = with_media(scene, vec![medium.clone()]);
            let merging =
                variant(i + kind, gathers([0.05, 0.1, 0.06, 0.06, 0.04], [2000, 1800, 1600, 1400, 1000]));
            let settings = Settings { merging, max_length: 96, seed: 500, ..Settings::new(set(name)) };
            // As sharp relative to 1, whichever side of it the mean is on.
            let wanted = 0.97 * detectable * 2f64.sqrt();
            let images = sharp_runs(&scene, &settings, wanted, if study { 4000 } else { 48 });
            println!(
                "{what}, {name}: {:.4?}",
                crate::merging::mean_and_error(&crate::merging::image_means(&images))
            );
            Means::of(&images).assert_mean(&format!("equilibrium {what}, {name}"), 1.0, detectable);
        }
    }
}

/// A grid that is turned and made larger with all about it is the same picture: camera, lamp and ball, by one similarity.
#[test]
fn a_grid_turns_with_its_scene() {
    let scene = |m: Affine3A, scale: f32| {
        let p = |x: f32, y: f32, z: f32| format!("{:?}", m.transform_point3a(Vec3A::new(x, y, z)).to_array());
        let v =
            |x: f32, y: f32, z: f32| format!("{:?}", m.transform_vector3a(Vec3A::new(x, y, z)).to_array());
        let c = m.to_cols_array();
        let rows = [0, 1, 2].map(|r| format!("[{}, {}, {}, {}]", c[r], c[3 + r], c[6 + r], c[9 + r]));
        scenes::of(&format!(
            "[film]\nwidth = 24\nheight = 24\n[camera]\norigin = {}\ntarget = {}\nup = {}\nfov = 45\n\
             [medium.cloud]\nsigma_t = {:?}\nalbedo = [0.9, 0.7, 0.5]\nphase = {{ hg = 0.3 }}\n\
             density = {{ grid = {{ file = 'density.grid', transform = [{{ matrix = [{}, {}, {}] }}] }} }}\n\
             [material.nothing]\nnull = {{}}\n[material.white]\ndiffuse = {{ reflectance = 0.7 }}\n\
             [[shape]]\nsphere = {{ center = {}, radius = {} }}\nmaterial = 'nothing'\ninterior = 'cloud'\n\
             [[shape]]\nrectangle = {{ corner = {}, u = {}, v = {} }}\nmaterial = 'white'\n\
             [[shape]]\nsphere = {{ center = {}, radius = {} }}\nemission = [20, 30, 40]\n",
            p(0.0, 0.2, 2.5),
            p(0.0, 0.0, 0.0),
            v(0.0, 1.0, 0.0),
            [6.0 / scale, 9.0 / scale, 12.0 / scale],
            rows[0],
            rows[1],
            rows[2],
            p(0.0, 0.0, 0.0),
            0.5 * scale,
            p(-2.0, -0.6, 2.0),
            v(4.0, 0.0, 0.0),
            v(0.0, 0.0, -4.0),
            p(-0.6, 0.6, 0.2),
            0.2 * scale,
        ))
    };
    let turned = Affine3A::from_translation(glam::Vec3::new(3.0, -5.0, 2.0))
        * Affine3A::from_axis_angle(glam::Vec3::new(2.0, -1.0, 1.0).normalize(), 1.1)
        * Affine3A::from_scale(glam::Vec3::splat(3.0));
    let (here, there) = (scene(Affine3A::IDENTITY, 1.0), scene(turned, 3.0));
    for name in ["pt", "bpt"] {
        let settings = Settings { max_length: 10, seed: 8, ..Settings::new(set(name)) };
        let means = |scene: &Scene| Means::of(&sharp_runs(scene, &settings, 0.02, 1200));
        means(&there).assert_same(&means(&here), &format!("turned, {name}"), 0.03);
    }
}

/// Every set has the same mean in front of clouds.
#[test]
fn clouds_agree() {
    crate::media_agreement::agree(
        "clouds",
        &scenes::load("clouds"),
        16,
        0.03,
        &["pt", "bpt", "hit,connect", "hit,nee,lens"],
    );
}
