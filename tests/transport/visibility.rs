//! What the renderer joins can see each other, and no light goes through what is opaque.

use crate::collect::{Traced, trace_pixel};
use crate::scenes;
use glam::{UVec2, Vec3A};
use tyndall::bsdf::Material;
use tyndall::geometry::Ray;
use tyndall::scene::Scene;
use tyndall::transport::{Settings, Technique, TechniqueSet};

fn paths(scene: &Scene, iterations: u64) -> impl Iterator<Item = Traced> {
    let settings = Settings { max_length: 6, seed: 21, ..Settings::new(TechniqueSet::of_connections()) };
    let size = scene.camera.size();
    (0..iterations).flat_map(move |iteration| {
        (0..size.x * size.y)
            .flat_map(move |i| trace_pixel(scene, &settings, iteration, UVec2::new(i % size.x, i / size.x)))
    })
}

/// The ends of the edge that joins the two subpaths, the camera's side first: a point and how to leave it.
fn joint(scene: &Scene, traced: &Traced) -> Option<(Ray, f32)> {
    let (path, s) = (&traced.path, traced.sample.s as usize);
    let k = path.interior.len() + 1;
    if traced.sample.technique == Technique::Hit {
        return None;
    }
    // x_{s-1} and x_s.
    let infinite = s == 1 && scene.lights.is_infinite(&path.light);
    let position = |i: usize| if i == 0 { path.light.p } else { path.interior[i - 1].position() };
    let start = if s == k { path.lens } else { position(s) };
    let (dir, distance) = if infinite {
        (path.light.n, f32::INFINITY)
    } else {
        (position(s - 1) - start).normalize_and_length()
    };
    let ray = if s == k { Ray::new(start, dir) } else { path.interior[s - 1].spawn(dir) };
    Some((ray, distance))
}

/// The bug that this keeps out: a technique that forgets its shadow ray, which a convex furnace never shows.
#[test]
fn what_is_joined_is_in_sight() {
    for (name, scene) in scenes::all() {
        let mut joined = [0; Technique::COUNT];
        for traced in paths(&scene, 6) {
            let Some((ray, distance)) = joint(&scene, &traced) else { continue };
            let (hit, cosine) = scene
                .geometry
                .intersect(&ray)
                .map_or((f32::INFINITY, 1.0), |hit| (hit.t, hit.point.ng.dot(ray.dir).abs()));
            // A ray that lies in a lamp's plane, all but for the rounding of positions, meets it anywhere.
            let rounding = 8.0 * f32::EPSILON / cosine;
            assert!(
                hit >= 0.999 * distance - rounding,
                "{name}: {:?} goes through a surface at {hit} of {distance}",
                traced.sample
            );
            joined[traced.sample.technique.index()] += 1;
        }
        assert!(joined[1..4].iter().all(|n| *n > 50), "{name}: {joined:?}");
    }
}

fn is_glass(material: &Material) -> bool {
    // The test scene's layered material has glass in it.
    matches!(material, Material::Dielectric(_) | Material::Layered(_))
}

/// Under a smooth shading normal, a direction can be above the shading surface and below the real one. The bug that
/// this keeps out: light that such a vertex lets through.
#[test]
fn opaque_surfaces_let_nothing_through() {
    // Its bells are open, so that light which got through would come out again.
    let scene = scenes::load("bent");
    let mut bent = 0;
    for traced in paths(&scene, 16) {
        let path = &traced.path;
        let infinite = scene.lights.is_infinite(&path.light);
        for (i, point) in path.surfaces().iter().enumerate() {
            if is_glass(scene.material(point.shape)) {
                continue;
            }
            let toward = |p: Vec3A| (p - point.p).normalize();
            let wl = match i {
                0 if infinite => path.light.n,
                0 => toward(path.light.p),
                _ => toward(path.surfaces()[i - 1].p),
            };
            let wc = toward(path.surfaces().get(i + 1).map_or(path.lens, |next| next.p));
            let (l, c) = (wl.dot(point.ng), wc.dot(point.ng));
            // A sign is told only where rounding cannot change it.
            let clear = l.abs().min(c.abs()) > 1e-4;
            assert!(!clear || l * c > 0.0, "{:?} at {point:?}: {l}, {c}", traced.sample);
            bent += u32::from(point.ns.dot(point.ng) < 0.99);
        }
    }
    assert!(bent > 500, "only {bent} vertices have a shading normal of their own");
}
