//! The ladder of radii, inside: light from a point that is scattered once, on its way to a camera that looks along a single ray.
//!
//! A merge blurs. What it comes to at a radius r is an integral over the kernel, known by quadrature from the definition of
//! each technique: so an estimator is held to its own expectation at each radius, and the expectation to the order of its
//! bias, r² with either kernel. Sets of techniques are held to the sum of theirs, with the balance heuristic's weights at the pair of
//! points that is merged, which converges to the light that is scattered once.

use crate::measure::{Means, runs};
use crate::merging::{around, gathers, image_means, integral, mean_and_error, set, variant};
use crate::scenes;
use std::f64::consts::PI;
use tyndall::scene::Scene;
use tyndall::transport::merge::{Beams, Kernel, MERGES, MergeSettings};
use tyndall::transport::{Heuristic, Settings, Technique, TechniqueSet};

const SIGMA_S: f64 = 0.8;
const SIGMA_T: f64 = 1.0;
const G: f64 = 0.5;
const INTENSITY: f64 = 3.0;
/// The ray passes the light at this distance, so far from the camera.
const H: f64 = 0.6;
const A: f64 = 1.0;
/// The rungs, in metres.
const RADII: [f64; 2] = [0.4, 0.2];
/// Light subpaths by technique, in the order of `MERGES`.
const PATHS: [u64; 5] = [1500, 2000, 1200, 1000, 500];

fn transmittance(d: f64) -> f64 {
    (-SIGMA_T * d).exp()
}

/// An endless medium about a point light; all pixels look along nearly the same ray.
fn scene(pixels: u32) -> Scene {
    scenes::of(&format!(
        "[film]\nwidth = {pixels}\nheight = {pixels}\n[camera]\norigin = [0, 0, 2]\ntarget = [0, 0, 0]\nfov = 0.1\n\
         [world]\nmedium = 'haze'\n[medium.haze]\nsigma_a = {}\nsigma_s = {SIGMA_S}\nphase = {{ hg = {G} }}\n\
         [[light]]\npoint = {{ position = [0, {H}, {}], intensity = {INTENSITY} }}\n",
        SIGMA_T - SIGMA_S,
        2.0 - A
    ))
}

/// The pair of points at which a light and a camera subpath meet, as their edges are: lengths, and the cosine and sine of the
/// angle between the ways that light and camera ray go.
struct Pair {
    light: f64,
    camera: f64,
    cos: f64,
    sin: f64,
}

impl Pair {
    /// The light's point is `y` = (along, toward the light, across) from where the camera's point `x` along the ray is seen.
    fn of(y: [f64; 3], camera: f64) -> Self {
        let w = [y[0] - A, y[1] - H, y[2]];
        let light = w.iter().map(|v| v * v).sum::<f64>().sqrt();
        let cos = w[0] / light;
        Self { light, camera, cos, sin: (1.0 - cos * cos).max(0.0).sqrt() }
    }

    /// σ_s · phase: the deflection is from the light's way to the opposite of the camera ray.
    fn scattering(&self) -> f64 {
        let base = 1.0 + G * G + 2.0 * G * self.cos;
        SIGMA_S * (1.0 - G * G) / (4.0 * PI * base.powf(1.5))
    }

    /// Both transmittances with the scattering and the light's intensity, no 1/d².
    fn through(&self) -> f64 {
        INTENSITY * transmittance(self.light) * transmittance(self.camera) * self.scattering()
    }
}

/// A set of techniques, how it merges, and the radius of all of them.
struct Model {
    techniques: TechniqueSet,
    merging: MergeSettings,
    radius: f64,
    beta: f64,
}

impl Model {
    /// The weight of `technique` for a pair: densities relative to P_2 r_1 (transport.md, 3).
    fn weight(&self, technique: Technique, pair: &Pair) -> f64 {
        let b = |beams: Beams, d: f64| match beams {
            Beams::Long => 1.0 / (SIGMA_T * transmittance(d)),
            Beams::Short => 1.0 / SIGMA_T,
        };
        let light = b(self.merging.photon_beams, pair.light);
        let camera = b(self.merging.camera_beams, pair.camera);
        let r = self.radius;
        let density = |t: Technique| {
            let n = MERGES.iter().position(|m| *m == t).map_or(0.0, |i| PATHS[i] as f64);
            match t {
                // c_1 / p_1, with c_1 = 1 and p_1 = σ_t T / (4π d²)
                Technique::NextEvent => 4.0 * PI * pair.light.powi(2) / (SIGMA_T * transmittance(pair.light)),
                Technique::PointPoint => n * 4.0 / 3.0 * PI * r.powi(3),
                Technique::PointBeam => n * PI * r * r * camera,
                Technique::BeamPoint => n * PI * r * r * light,
                Technique::BeamBeam => n * 2.0 * r * pair.sin * light * camera,
                _ => 0.0,
            }
        };
        let all: f64 = self.techniques.iter().map(|t| density(t).powf(self.beta)).sum();
        density(technique).powf(self.beta) / all
    }

    /// The kernel at the distance `d` in `dimension` dimensions.
    fn kernel(&self, dimension: i32, d: f64) -> f64 {
        let r = self.radius;
        let (measure, peak) = match dimension {
            1 => (2.0 * r, 1.5),
            2 => (PI * r * r, 2.0),
            _ => (4.0 / 3.0 * PI * r.powi(3), 2.5),
        };
        match self.merging.kernel {
            Kernel::Constant => 1.0 / measure,
            Kernel::Epanechnikov => peak * (1.0 - d * d / (r * r)) / measure,
        }
    }

    /// What a technique brings to the image, weighted.
    fn expectation(&self, technique: Technique) -> f64 {
        match technique {
            Technique::PointPoint => along_ray(|t| self.point_point(t)),
            Technique::PointBeam => along_ray(|t| self.point_beam(t)),
            Technique::BeamPoint => along_ray(|t| self.beam_point(t)),
            Technique::BeamBeam => self.beam_beam(),
            Technique::NextEvent => along_ray(|t| {
                let pair = Pair::of([t, 0.0, 0.0], t);
                pair.through() / pair.light.powi(2) * self.weight(technique, &pair)
            }),
            _ => 0.0,
        }
    }

    fn total(&self) -> f64 {
        self.techniques.iter().map(|t| self.expectation(t)).sum()
    }

    /// Light points y in a ball about the camera's point.
    fn point_point(&self, t: f64) -> f64 {
        integral(16, 0.0, self.radius, |u| {
            let shell = integral(24, -1.0, 1.0, |z| {
                around(16, |phi| {
                    let rho = u * (1.0 - z * z).max(0.0).sqrt();
                    let pair = Pair::of([t + u * z, rho * phi.cos(), rho * phi.sin()], t);
                    pair.through() / pair.light.powi(2) * self.weight(Technique::PointPoint, &pair)
                })
            });
            2.0 * PI * u * u * self.kernel(3, u) * shell
        })
    }

    /// Light points y on a disc across the ray.
    fn point_beam(&self, t: f64) -> f64 {
        integral(16, 0.0, self.radius, |u| {
            let ring = around(16, |phi| {
                let pair = Pair::of([t, u * phi.cos(), u * phi.sin()], t);
                pair.through() / pair.light.powi(2) * self.weight(Technique::PointBeam, &pair)
            });
            2.0 * PI * u * self.kernel(2, u) * ring
        })
    }

    /// Directions from the light that pass the camera's point x at less than r. With D its distance and u = D sin α:
    /// dω = u du dβ / (D² cos α), and the foot lies D cos α from the light.
    fn beam_point(&self, t: f64) -> f64 {
        let to = [t - A, -H];
        let distance = (to[0] * to[0] + to[1] * to[1]).sqrt();
        let (x, y) = (to[0] / distance, to[1] / distance);
        integral(16, 0.0, self.radius, |u| {
            let (sin, cos) = (u / distance, (1.0 - (u / distance).powi(2)).sqrt());
            let ring = around(16, |beta| {
                // Along the ray: the axis (x, y, 0) tilted by α toward β, from the in-plane normal (−y, x, 0).
                let cosine = x * cos - y * sin * beta.cos();
                let pair = Pair {
                    light: distance * cos,
                    camera: t,
                    cos: cosine,
                    sin: (1.0 - cosine * cosine).max(0.0).sqrt(),
                };
                pair.through() * self.weight(Technique::BeamPoint, &pair)
            });
            2.0 * PI * u * self.kernel(2, u) / (distance * distance * cos) * ring
        })
    }

    /// Directions ω = (cos ε cos φ, −cos ε sin φ, sin ε) from the light, where tan ε = k sin φ: they pass the ray at the
    /// distance H k / √(1 + k²), at A + H cot φ / (1 + k²) along it, with sin θ = cos ε sin φ √(1 + k²) and
    /// dω = cos³ε sin φ dk dφ.
    fn beam_beam(&self) -> f64 {
        let widest = self.radius / (H * H - self.radius.powi(2)).sqrt();
        integral(24, -widest, widest, |k| {
            let k2 = 1.0 + k * k;
            let distance = (H * k / k2.sqrt()).abs().min(self.radius);
            // From φ far along the ray to that at the camera.
            let last = PI - (H / (A * k2)).atan();
            let first = (H / (60.0 * k2)).atan();
            let fan = integral(200, first, last, |phi| {
                let cos_e = 1.0 / (1.0 + (k * phi.sin()).powi(2)).sqrt();
                let sin = cos_e * phi.sin() * k2.sqrt();
                let pair = Pair {
                    light: H / (phi.sin() * cos_e * k2),
                    camera: A + H * phi.cos() / (phi.sin() * k2),
                    cos: cos_e * phi.cos(),
                    sin,
                };
                cos_e * cos_e * pair.through() * self.weight(Technique::BeamBeam, &pair)
            });
            self.kernel(1, distance) / k2.sqrt() * fan
        })
    }
}

/// ∫ f(t) dt along the ray, with t = A + H tan θ.
fn along_ray(f: impl Fn(f64) -> f64) -> f64 {
    integral(160, -(A / H).atan(), (40.0 / H).atan(), |theta| {
        f(A + H * theta.tan()) * H / theta.cos().powi(2)
    })
}

/// The light that is scattered once, without any blur.
fn exact() -> f64 {
    along_ray(|t| {
        let pair = Pair::of([t, 0.0, 0.0], t);
        pair.through() / pair.light.powi(2)
    })
}

fn model(
    techniques: TechniqueSet,
    variant_of: usize,
    heuristic: Heuristic,
    radius: f64,
) -> (Model, Settings) {
    let merging = variant(variant_of, gathers([radius; 5], PATHS));
    let beta = match heuristic {
        Heuristic::Balance => 1.0,
        Heuristic::Power(beta) => f64::from(beta),
    };
    let settings = Settings {
        merging,
        heuristic,
        max_length: 2,
        min_length: 2,
        seed: 70 + variant_of as u64,
        ..Settings::new(techniques)
    };
    (Model { techniques, merging, radius, beta }, settings)
}

/// The slope of log |bias| over log r.
fn order(radii: &[f64], biases: &[f64]) -> f64 {
    let points: Vec<(f64, f64)> = radii.iter().zip(biases).map(|(r, b)| (r.ln(), b.abs().ln())).collect();
    let n = points.len() as f64;
    let (x, y) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let xy: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    xy / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

/// Pixels a side and iterations a run: where camera subpaths end in a collision, or short beams do, many of them are
/// needed.
fn effort(technique: Technique, variant_of: usize) -> (u32, u64) {
    match technique {
        Technique::BeamBeam if variant_of & 2 == 2 => (2, 25),
        Technique::BeamBeam => (6, 60),
        Technique::PointBeam => (6, 40),
        _ => (8, 40),
    }
}

/// Independent runs of a rung.
const RUNS: u64 = 64;

const MEDIA: [Technique; 4] =
    [Technique::PointPoint, Technique::PointBeam, Technique::BeamPoint, Technique::BeamBeam];

/// The expectation of each technique, and of sets of them, differs from the light that is scattered once by what falls as
/// r², with either kernel, short or long beams: no statistics here. In a set the weights of merges fall with r, too.
#[test]
fn the_expected_bias_is_of_second_order() {
    let radii = [0.1, 0.05];
    let exact = exact();
    for technique in MEDIA {
        for v in 0..8 {
            let bias = radii
                .map(|r| model(TechniqueSet::of(&[technique]), v, Heuristic::Balance, r).0.total() - exact);
            let order = order(&radii, &bias);
            assert!((order - 2.0).abs() < 0.06, "{technique:?} {v}: r^{order}, {bias:?}");
        }
    }
    for names in ["upbp", "nee,pp3d,pb2d,bp2d,bb1d"] {
        let bias = radii.map(|r| model(set(names), 3, Heuristic::Balance, r).0.total() / exact - 1.0);
        assert!(order(&radii, &bias) > 2.0 && bias[1].abs() < 4e-3, "{names}: {bias:?}");
    }
}

/// The order of the bias that was measured, by rungs and runs, with its standard error (jackknife over the runs).
fn measured_order(runs: &[Vec<f64>], exact: f64) -> (f64, f64) {
    let count = runs[0].len();
    let without = |left_out: usize| {
        let bias: Vec<f64> = runs
            .iter()
            .map(|rung| {
                let kept = rung.iter().enumerate().filter(|(i, _)| *i != left_out).map(|(_, v)| v);
                let n = if left_out < count { count - 1 } else { count };
                kept.sum::<f64>() / n as f64 - exact
            })
            .collect();
        order(&RADII, &bias)
    };
    let parts: Vec<f64> = (0..count).map(without).collect();
    let (_, error) = mean_and_error(&parts);
    (without(count), error * (count - 1) as f64)
}

/// Each technique alone has its own expectation at each radius, and the bias that was measured falls as its order says.
/// Rungs share their random numbers.
#[test]
fn each_technique_is_its_expectation_at_every_radius() {
    let exact = exact();
    for (i, technique) in MEDIA.into_iter().enumerate() {
        // Two of the eight variants each, so that all pairs of beams and both kernels come.
        for v in [i, 7 - i] {
            let (pixels, iterations) = effort(technique, v);
            let scene = scene(pixels);
            let (mut expected, mut measured) = (Vec::new(), Vec::new());
            for radius in RADII {
                let (model, settings) = model(TechniqueSet::of(&[technique]), v, Heuristic::Balance, radius);
                let what = format!("{technique:?} {v}, r = {radius}");
                let total = model.total();
                let images = runs(&scene, &settings, RUNS, iterations);
                println!(
                    "{what}: {:.5?} {total:.5}, exact {exact:.5}",
                    mean_and_error(&image_means(&images))
                );
                Means::of(&images).assert_mean(&what, total, 0.06);
                expected.push(total - exact);
                measured.push(image_means(&images));
            }
            let right = order(&RADII, &expected);
            let (slope, error) = measured_order(&measured, exact);
            println!("{technique:?} {v}: order {slope:.2} ± {error:.2}, expected {right:.2}");
            assert!((slope - right).abs() < 4.0 * error, "{technique:?} {v}: {slope} ± {error}, not {right}");
            assert!(error < 0.5, "{technique:?} {v}: {slope} ± {error}");
        }
    }
}

/// The same of sets with one weight over all, which take what next-event estimation leaves to merges.
#[test]
fn sets_are_their_expectation_at_every_radius() {
    let sets = ["upbp", "nee,pp3d,bp2d", "nee,pb2d,bb1d", "nee,pp3d,pb2d,bp2d,bb1d"];
    let exact = exact();
    for (i, names) in sets.into_iter().enumerate() {
        let heuristic = if i % 2 == 0 { Heuristic::Balance } else { Heuristic::Power(2.0) };
        let scene = scene(8);
        for radius in RADII {
            let (model, settings) = model(set(names), 2 * i + 1, heuristic, radius);
            let what = format!("{names} {heuristic:?}, r = {radius}");
            let total = model.total();
            let images = runs(&scene, &settings, RUNS, 16);
            println!("{what}: {:.5?} {total:.5}, exact {exact:.5}", mean_and_error(&image_means(&images)));
            Means::of(&images).assert_mean(&what, total, 0.06);
        }
    }
}
