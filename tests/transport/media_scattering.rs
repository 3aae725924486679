//! Rung 4 in media: light that is scattered once, by quadrature.

use crate::measure::{Means, sharp_runs};
use crate::media_closed_forms::expected;
use crate::scenes;
use glam::{DVec3, Vec3A};
use std::f64::consts::PI;
use tyndall::math::Rgb;
use tyndall::medium::phase::{HenyeyGreenstein, Mixture};
use tyndall::medium::{Homogeneous, Phase};
use tyndall::scene::Scene;
use tyndall::transport::{Settings, TechniqueSet};

const SIGMA_S: [f64; 3] = [0.2, 0.5, 1.0];
const SIGMA_A: [f64; 3] = [0.1, 0.0, 0.4];
/// The camera looks from here along −z, out of an empty bubble of this radius.
const CAMERA: DVec3 = DVec3::new(0.0, 0.0, 2.0);
const BUBBLE: f64 = 0.3;

/// A phase function by its definition: `cos` is that of the deflection.
#[derive(Clone, Copy, Debug)]
enum Shape {
    Isotropic,
    Hg(f64),
    Rayleigh,
    Mixed,
}

impl Shape {
    fn value(self, cos: f64) -> f64 {
        let hg = |g: f64| (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5));
        match self {
            Self::Isotropic => 0.25 / PI,
            Self::Hg(g) => hg(g),
            Self::Rayleigh => 3.0 / (16.0 * PI) * (1.0 + cos * cos),
            Self::Mixed => 0.7 * hg(0.8) + 0.3 * hg(-0.4),
        }
    }

    fn phase(self) -> Phase {
        let hg = |g: f64| Phase::HenyeyGreenstein(HenyeyGreenstein::new(g as f32).expect("|g| < 1"));
        match self {
            Self::Isotropic => Phase::Isotropic,
            Self::Hg(g) => hg(g),
            Self::Rayleigh => Phase::Rayleigh,
            Self::Mixed => {
                Phase::Mixture(Mixture::new(vec![(0.7, hg(0.8)), (0.3, hg(-0.4))]).expect("positive weights"))
            }
        }
    }
}

/// A light by its text, its place, and its intensity toward a unit direction.
struct Lamp {
    text: String,
    position: DVec3,
    intensity: fn(DVec3) -> f64,
}

fn spot_axis() -> DVec3 {
    DVec3::new(-0.8, -0.9, -1.2).normalize()
}

fn lamps() -> [Lamp; 2] {
    let position = DVec3::new(0.8, 0.9, 0.4);
    let target = position + spot_axis();
    [
        Lamp {
            text: format!("point = {{ position = {:?}, intensity = 3 }}", position.to_array()),
            position,
            intensity: |_| 3.0,
        },
        Lamp {
            text: format!(
                "spot = {{ position = {:?}, target = {:?}, intensity = 3, inner = 20, cutoff = 40 }}",
                position.to_array(),
                target.to_array()
            ),
            position,
            intensity: |dir| {
                let (outer, inner) = (40f64.to_radians().cos(), 20f64.to_radians().cos());
                let t = ((dir.dot(spot_axis()) - outer) / (inner - outer)).clamp(0.0, 1.0);
                3.0 * t * t * (3.0 - 2.0 * t)
            },
        },
    ]
}

fn scene(lamp: &Lamp, shape: Shape) -> Scene {
    let scene = scenes::of(&format!(
        "[film]\nwidth = 16\nheight = 16\n[camera]\norigin = [0, 0, 2]\ntarget = [0, 0, 0]\nfov = 40\n\
         [world]\nmedium = 'haze'\n[medium.haze]\nsigma_a = 1\nsigma_s = 1\n[material.nothing]\nnull = {{}}\n\
         [[shape]]\nsphere = {{ center = [0, 0, 2], radius = {BUBBLE} }}\nmaterial = 'nothing'\n[[light]]\n{}\n",
        lamp.text
    ));
    let [a, s] = [SIGMA_A, SIGMA_S].map(|v| Rgb::from_array(v.map(|v| v as f32)));
    scenes::refilled(scene, Homogeneous::new(a, s, Rgb::ZERO, shape.phase()).expect("a medium"))
}

/// ∫ σ_s exp(−σ_t (t + d)) phase I/d² dt along a ray from the bubble's rim on, with d from the light to the point at t. The
/// substitution t − t_0 = h tan θ takes the 1/d² out (h: the light's distance from the ray): a smooth integrand, by
/// Simpson's rule.
fn single(lamp: &Lamp, shape: Shape, dir: Vec3A) -> [f64; 3] {
    const N: usize = 400;
    let dir = dir.as_dvec3().normalize();
    let toward = lamp.position - CAMERA;
    let middle = toward.dot(dir);
    let h = (toward - dir * middle).length();
    let (low, high) = (((BUBBLE - middle) / h).atan(), ((60.0 - middle) / h).atan());
    let mut sum = [0.0; 3];
    for i in 0..=N {
        let theta = low + (high - low) * i as f64 / N as f64;
        let t = middle + h * theta.tan();
        let from = CAMERA + dir * t - lamp.position;
        let d = from.length();
        let weight = if i == 0 || i == N { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
        // dt/d² = dθ/h
        let common = weight * (lamp.intensity)(from / d) / h * shape.value(from.dot(-dir) / d);
        for c in 0..3 {
            let depth = (SIGMA_S[c] + SIGMA_A[c]) * (t - BUBBLE + d);
            sum[c] += common * SIGMA_S[c] * (-depth).exp();
        }
    }
    sum.map(|v| v * (high - low) / (3 * N) as f64)
}

/// A point light out of the picture in an endless medium of several phase functions, and a spot in one. The bubble about the
/// camera keeps the variance of light tracing finite.
#[test]
fn light_that_is_scattered_once_is_its_quadrature() {
    let shapes = [Shape::Isotropic, Shape::Hg(0.8), Shape::Hg(-0.5), Shape::Rayleigh, Shape::Mixed];
    for (lamp, shapes) in lamps().iter().zip([&shapes[..], &shapes[1..2]]) {
        for shape in shapes.iter().copied() {
            let scene = scene(lamp, shape);
            let exact = Means::known(&expected(&scene, |dir| single(lamp, shape, dir)));
            // Light tracing, the noisiest, meets the camera too seldom by a narrow lobe or from a spot.
            let wide = matches!(shape, Shape::Isotropic) && lamp.text.starts_with("point");
            let sets: &[_] = if wide {
                &[("pt", 0.01), ("bpt", 0.01), ("lt", 0.02)]
            } else {
                &[("pt", 0.01), ("bpt", 0.01)]
            };
            for (names, detectable) in sets {
                let set = TechniqueSet::parse([*names]).expect("known");
                let settings = Settings { max_length: 2, ..Settings::new(set) };
                let images = sharp_runs(&scene, &settings, 1.2 * detectable, 4000);
                let kind = lamp.text.split(' ').next().expect("a word");
                let what = format!("scattered once, {shape:?}, {kind}, {names}");
                Means::of(&images).assert_same(&exact, &what, *detectable);
            }
        }
    }
}
