//! Rung 4 in media: what only absorbs or shines, whose radiance is a formula.

use crate::measure::{Means, render, runs};
use crate::scenes;
use glam::{UVec2, Vec2, Vec3A};
use tyndall::film::Image;
use tyndall::math::Rgb;
use tyndall::medium::{Homogeneous, Phase};
use tyndall::scene::Scene;
use tyndall::transport::{Settings, TechniqueSet};

fn set(names: &str) -> TechniqueSet {
    TechniqueSet::parse(names.split(',')).expect("known names")
}

/// The mean over each pixel of what `radiance` says of a ray, by 8x8 points (the camera is a pinhole).
pub fn expected(scene: &Scene, radiance: impl Fn(Vec3A) -> [f64; 3]) -> Image {
    const N: u32 = 8;
    let size = scene.camera.size();
    Image::from_fn(size.x as usize, size.y as usize, |x, y| {
        let mut sum = [0.0; 3];
        for i in 0..N * N {
            let u = (Vec2::new((i % N) as f32, (i / N) as f32) + 0.5) / N as f32;
            let dir = scene.camera.sample_ray(UVec2::new(x as u32, y as u32), u, Vec2::ZERO).dir;
            for (sum, value) in sum.iter_mut().zip(radiance(dir)) {
                *sum += value / f64::from(N * N);
            }
        }
        sum.map(|v| v as f32)
    })
}

const ABSORPTION: [f64; 3] = [0.25, 1.0, 3.0];

/// A lamp that fills the view, behind a slab of 0.5 m that absorbs; what else is in the scene in `more`.
fn slab(fov: f64, more: &str) -> Scene {
    slab_from(0.0, fov, more)
}

/// The same, with the camera's near plane so far ahead.
fn slab_from(near: f64, fov: f64, more: &str) -> Scene {
    scenes::of(&format!(
        "[film]\nwidth = 16\nheight = 16\n[camera]\norigin = [0, 0, 2]\ntarget = [0, 0, 0]\nfov = {fov}\nnear = {near}\n\
         [medium.smoked]\nsigma_a = {ABSORPTION:?}\nsigma_s = 0\n[material.nothing]\nnull = {{}}\n\
         [[shape]]\nrectangle = {{ corner = [-3, -3, -1], u = [6, 0, 0], v = [0, 6, 0] }}\nemission = [1, 2, 3]\n\
         [[shape]]\nbox = {{ min = [-4, -4, -0.3], max = [4, 4, 0.2] }}\nmaterial = 'nothing'\ninterior = 'smoked'\n{more}"
    ))
}

/// Beer and Lambert: nothing is sampled, so that path tracing is exact to the rounding of the film's points, and no
/// technique has more noise than in empty space. Through a narrow lens there is no noise at all.
#[test]
fn an_absorbing_slab_dims_exactly() {
    let scene = slab(0.01, "");
    let image = render(&scene, &Settings::new(set("hit")), 2).image();
    for pixel in &image.pixels {
        for c in 0..3 {
            let exact = (c + 1) as f64 * (-0.5 * ABSORPTION[c]).exp();
            assert!((f64::from(pixel[c]) / exact - 1.0).abs() < 1e-6, "{pixel:?}, channel {c}: {exact}");
        }
    }
    let scene = slab(50.0, "");
    let exact = through(&scene, 0.5);
    for (names, iterations, detectable) in [("pt", 16, 0.002), ("bpt", 48, 0.005), ("lt", 512, 0.01)] {
        let means = Means::of(&runs(&scene, &Settings::new(set(names)), 32, iterations));
        means.assert_same(&Means::known(&exact), &format!("absorbing slab, {names}"), detectable);
    }
}

/// What is to be seen of the lamp through so much of the slab (metres, straight through).
fn through(scene: &Scene, thickness: f64) -> Image {
    expected(scene, |dir| {
        let depth = thickness / f64::from(-dir.z);
        std::array::from_fn(|c| (c + 1) as f64 * (-depth * ABSORPTION[c]).exp())
    })
}

/// Rays begin at the near plane, within the slab: what they cross before it dims nothing, and a wall there hides nothing.
#[test]
fn what_is_before_the_near_plane_is_not_there() {
    let wall = "[material.black]\ndiffuse = { reflectance = 0 }\n[[shape]]\n\
                rectangle = { corner = [-1, -1, 1], u = [2, 0, 0], v = [0, 2, 0] }\nmaterial = 'black'\n";
    let scene = slab_from(2.0, 50.0, wall);
    let exact = through(&scene, 0.3);
    for (names, iterations, detectable) in [("hit", 16, 0.002), ("bpt", 48, 0.005), ("lens", 512, 0.01)] {
        let means = Means::of(&runs(&scene, &Settings::new(set(names)), 32, iterations));
        means.assert_same(&Means::known(&exact), &format!("from the near plane, {names}"), detectable);
    }
}

/// The camera in the medium, which reaches to the lamp's side of the slab by a second solid that overlaps the first.
#[test]
fn an_absorbing_slab_dims_from_where_the_camera_is() {
    let behind = "[[shape]]\nbox = { min = [-5, -5, 0.1], max = [5, 5, 3] }\nmaterial = 'nothing'\ninterior = 'smoked'\n";
    // From the camera at z = 2 to the slab's far end at -0.3; the two overlap from 0.1 to 0.2.
    let scene = slab(0.01, behind);
    let image = render(&scene, &Settings::new(set("pt")), 2).image();
    for pixel in &image.pixels {
        for c in 0..3 {
            let exact = (c + 1) as f64 * (-2.3 * ABSORPTION[c]).exp();
            assert!((f64::from(pixel[c]) / exact - 1.0).abs() < 2e-6, "{pixel:?}, channel {c}: {exact}");
        }
    }
}

const EMISSION: [f64; 3] = [0.5, 2.0, 0.7];

/// What a medium of the absorption σ emits along d metres: e (1 − exp(−σd))/σ.
fn shine(c: usize, sigma: f64, d: f64) -> f64 {
    if sigma > 0.0 { EMISSION[c] * -(-sigma * d).exp_m1() / sigma } else { EMISSION[c] * d }
}

/// A slab that shines before a lamp, from outside and from 0.2 m into it; one channel is clear. Every edge gathers the whole
/// ray, so that there is no noise.
#[test]
fn a_shining_slab_is_its_integral() {
    let sigma = [0.0, 1.5, 40.0];
    let medium = |sigma: [f64; 3]| {
        Homogeneous::new(
            Rgb::from_array(sigma.map(|v| v as f32)),
            Rgb::ZERO,
            Rgb::from_array(EMISSION.map(|v| v as f32)),
            Phase::Isotropic,
        )
        .expect("a medium")
    };
    let behind = "[[shape]]\nbox = { min = [-5, -5, 0.1], max = [5, 5, 3] }\nmaterial = 'nothing'\ninterior = 'smoked'\n";
    for (more, d) in [("", 0.5), (behind, 2.3)] {
        let scene = scenes::refilled(slab(0.01, more), medium(sigma));
        let image = render(&scene, &Settings::new(set("pt")), 2).image();
        for pixel in &image.pixels {
            for c in 0..3 {
                let exact = shine(c, sigma[c], d) + (c + 1) as f64 * (-d * sigma[c]).exp();
                assert!((f64::from(pixel[c]) / exact - 1.0).abs() < 2e-6, "{pixel:?}, channel {c}: {exact}");
            }
        }
    }
    // A ball about the camera's axis: the chord of each ray, averaged over the pixel.
    let ball = |origin: f64| {
        scenes::of(&format!(
            "[film]\nwidth = 16\nheight = 16\n[camera]\norigin = [0, 0, {origin}]\ntarget = [0, 0, -9]\nfov = 50\n\
             [medium.ember]\nsigma_a = 1\nsigma_s = 0\n[material.nothing]\nnull = {{}}\n\
             [[shape]]\nsphere = {{ radius = 0.8 }}\nmaterial = 'nothing'\ninterior = 'ember'\n\
             [[light]]\npoint = {{ position = [0, 5, 0], intensity = 1e-9 }}"
        ))
    };
    for (origin, detectable) in [(2.0, 0.005), (0.5, 0.005)] {
        let scene = scenes::refilled(ball(origin), medium(sigma));
        let exact = expected(&scene, |dir| {
            let (b, c) = (-origin * f64::from(dir.z), origin * origin - 0.64);
            let root = (b * b - c).max(0.0).sqrt();
            let chord = (b + root).max(0.0) - (b - root).max(0.0);
            std::array::from_fn(|c| shine(c, sigma[c], chord))
        });
        for names in ["pt", "bpt"] {
            let means = Means::of(&runs(&scene, &Settings::new(set(names)), 32, 64));
            // The points of a pixel meet the ball's edge differently: a tile's mean is known to 1e-3 only.
            means.assert_near(&exact, 2e-3, &format!("shining ball from z = {origin}, {names}"), detectable);
        }
    }
}
