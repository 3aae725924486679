//! The oracle on paths that the few samples of `weights` seldom hold: over shading normals far from the real ones, and
//! through Diracs to a light.

use crate::collect::{Traced, pass, trace_pixel};
use crate::oracle::judge;
use crate::scenes;
use glam::UVec2;
use tyndall::scene::Scene;
use tyndall::transport::{Heuristic, Settings, Technique, TechniqueSet};

/// Largest relative difference that f32 arithmetic explains, where no direction is near a surface.
const TOLERANCE: f64 = 2e-3;

/// How many paths of each kind there were.
#[derive(Debug, Default)]
struct Seen {
    /// The light subpath goes on from a vertex with a shading normal of its own.
    bent_light: u32,
    /// The same of the camera subpath.
    bent_camera: u32,
    /// A connection ends at such a vertex, by the light's side.
    bent_connection: u32,
    /// The camera subpath finds a light by way of a Dirac.
    hit_after_dirac: u32,
    /// A light subpath goes through a Dirac.
    dirac_light: u32,
}

impl Seen {
    fn count(&mut self, scene: &Scene, traced: &Traced) {
        let (surfaces, s) = (traced.path.surfaces(), traced.sample.s as usize);
        // x_i is surfaces[i - 1]; the light subpath goes on from x_1 … x_{s-2}, the camera subpath from x_{s+1} on.
        let bent = |i: usize| surfaces[i - 1].ns.dot(surfaces[i - 1].ng) < 0.99;
        let dirac = |i: usize| !scene.material(surfaces[i - 1].shape).has_smooth();
        let last = surfaces.len();
        let (light, camera) = (1..(s.max(1) - 1).max(1), s + 1..last + 1);
        self.bent_light += u32::from(light.clone().any(bent));
        self.bent_camera += u32::from(camera.clone().any(bent));
        let connected = traced.sample.technique == Technique::Connect;
        self.bent_connection += u32::from(connected && bent(s - 1));
        self.hit_after_dirac += u32::from(s == 0 && last > 0 && dirac(1));
        self.dirac_light += u32::from(light.clone().any(dirac));
    }
}

/// Whether all edges are 2 cm long and clear of the surfaces by 3 degrees: f32 rounds the directions of shorter ones, and
/// smaller cosines, too coarsely.
fn clear(scene: &Scene, traced: &Traced) -> bool {
    let path = &traced.path;
    let surfaces = path.surfaces();
    let position = |i: usize| if i == 0 { path.light.p } else { surfaces[i - 1].p };
    (1..=surfaces.len()).all(|i| {
        let point = &surfaces[i - 1];
        let next = surfaces.get(i).map_or(path.lens, |next| next.p);
        let before = if i == 1 && scene.lights.is_infinite(&path.light) {
            path.light.n
        } else {
            position(i - 1) - point.p
        };
        [before, next - point.p].iter().all(|w| {
            let (w, length) = w.normalize_and_length();
            length > 0.02 && w.dot(point.ng).abs().min(w.dot(point.ns).abs()) > 0.05
        })
    })
}

/// Bugs that this keeps out: a light walk without the adjoint of shading normals, a shading normal in a geometry term of a
/// connection, a count of next-event estimation where a Dirac led to the light.
#[test]
fn weights_and_contributions_of_rare_paths_are_the_oracles() {
    let mut seen = Seen::default();
    for name in ["bent", "glass"] {
        let scene = scenes::load(name);
        for (beta, heuristic) in [(1.0, Heuristic::Balance), (2.0, Heuristic::Power(2.0))] {
            let settings = Settings {
                heuristic,
                max_length: 7,
                seed: 31,
                ..Settings::new(TechniqueSet::of_connections())
            };
            let size = scene.camera.size();
            for index in 0..24 * size.x * size.y {
                let (iteration, pixel) = (index / (size.x * size.y), index % (size.x * size.y));
                let pixel = UVec2::new(pixel % size.x, pixel / size.x);
                for traced in trace_pixel(&scene, &settings, iteration.into(), pixel) {
                    if !clear(&scene, &traced) {
                        continue;
                    }
                    let sample = &traced.sample;
                    let pass = pass(&scene, &settings, iteration.into());
                    let verdict = judge(&scene, &pass, &traced.path, traced.made_by());
                    let what = || format!("{name} {sample:?}\n{verdict:?}\n{:?}", traced.path);
                    let weight = verdict.weight(traced.made_by(), beta);
                    let difference = (f64::from(sample.weight) - weight).abs();
                    assert!(difference <= TOLERANCE * weight, "weight {weight}: {}", what());
                    let expected = verdict.contribution / verdict.density(traced.made_by());
                    let difference = (sample.contribution.as_dvec3() - expected).abs().max_element();
                    assert!(
                        difference <= TOLERANCE * expected.max_element(),
                        "contribution {expected}: {}",
                        what()
                    );
                    seen.count(&scene, &traced);
                }
            }
        }
    }
    let Seen { bent_light, bent_camera, bent_connection, hit_after_dirac, dirac_light } = seen;
    let least = [bent_light, bent_camera, bent_connection, hit_after_dirac, dirac_light].into_iter().min();
    assert!(least > Some(100), "{seen:?}");
}
