//! The rule for refraction in the weights (src/bsdf): `pdf_rev` of a refraction carries dω_to/dω_from, so that the
//! quotient of the densities of both walks along a chain of Diracs is the true one.
//!
//! The truth is found here from the definition, in f64: the density per area with which a walk that leaves a along a
//! sampled direction arrives at b is the density of the direction over the area that a small cone about it covers at
//! b, and that area comes from finite differences through the glass. The renderer's quotient comes from its own recursion:
//! with a single technique whose count is at a alone, the link at b holds the product of all r/p between.

use glam::{DVec3, UVec2, Vec2, Vec3, Vec3A};
use std::f64::consts::PI;
use tyndall::bsdf::{BsdfSample, Dielectric, Diffuse, Layered, Material, Mirror, Mode};
use tyndall::film::Sample;
use tyndall::geometry::{ShapeDesc, SurfacePoint};
use tyndall::scene::Scene;
use tyndall::scene::file::source::Source;
use tyndall::texture::Texture;
use tyndall::transport::camera_path::Partners;
use tyndall::transport::merge::store::Stored;
use tyndall::transport::sink::{Joint, Sink, Start};
use tyndall::transport::walk::Vertex;
use tyndall::transport::{Settings, Technique, TechniqueSet, camera_path, light_path};

const IOR: f64 = 1.5;
/// Reflectance, and so the continuation probability, of all that is diffuse.
const ALBEDO: f64 = 0.5;

/// Scenes of glass between what is diffuse: name, camera (origin, target) and shapes.
const SCENES: [(&str, &str, &str); 5] = [
    ("a pane, into glass", ABOVE_THE_PANE, PANE_DOWN),
    ("a pane, out of glass", ABOVE_THE_PANE, PANE_UP),
    ("through a ball", ABOVE_THE_BALL, BALL),
    ("into a ball", ABOVE_THE_BALL, BALL_WITH_PLATE),
    ("out of a ball", "origin = [0.1, 0.3, 0]\ntarget = [0, -0.3, 0]\nup = [0, 0, 1]", BALL_WITH_LAMP),
];

const ABOVE_THE_PANE: &str = "origin = [0.1, 0.5, 0]\ntarget = [0, 2.5, 0.1]\nup = [0, 0, 1]";
const ABOVE_THE_BALL: &str = "origin = [0.1, 1.3, 0]\ntarget = [0, 2.5, 0.1]\nup = [0, 0, 1]";

const PANE_DOWN: &str = r#"
[[shape]]
rectangle = { corner = [-9, 0, 9], u = [18, 0, 0], v = [0, 0, -18] }
material = "glass"
[[shape]]
rectangle = { corner = [-0.5, 2, -0.5], u = [1, 0, 0], v = [0, 0, 1] }
material = "white"
emission = [1, 1, 1]
"#;
const PANE_UP: &str = r#"
[[shape]]
rectangle = { corner = [-9, 0, -9], u = [18, 0, 0], v = [0, 0, 18] }
material = "glass"
[[shape]]
rectangle = { corner = [-0.5, 2, -0.5], u = [1, 0, 0], v = [0, 0, 1] }
material = "white"
emission = [1, 1, 1]
"#;
const BALL: &str = r#"
[[shape]]
sphere = { center = [0, 0, 0], radius = 1 }
material = "glass"
[[shape]]
rectangle = { corner = [-0.5, 2, -0.5], u = [1, 0, 0], v = [0, 0, 1] }
material = "white"
emission = [1, 1, 1]
"#;
const BALL_WITH_PLATE: &str = r#"
[[shape]]
sphere = { center = [0, 0, 0], radius = 1 }
material = "glass"
[[shape]]
rectangle = { corner = [-0.6, -0.3, 0.6], u = [1.2, 0, 0], v = [0, 0.2, -1.2] }
material = "white"
[[shape]]
rectangle = { corner = [-0.5, 2, -0.5], u = [1, 0, 0], v = [0, 0, 1] }
material = "white"
emission = [1, 1, 1]
"#;
const BALL_WITH_LAMP: &str = r#"
[[shape]]
sphere = { center = [0, 0, 0], radius = 1 }
material = "glass"
[[shape]]
rectangle = { corner = [-0.4, -0.3, 0.4], u = [0.8, 0, 0], v = [0, 0.1, -0.8] }
material = "white"
emission = [1, 1, 1]
"#;

fn scene(name: &str, camera: &str, shapes: &str) -> Scene {
    let text = format!(
        r#"
[film]
width = 24
height = 24
[camera]
fov = 60
{camera}
[material.white]
diffuse = {{ reflectance = {ALBEDO} }}
[material.glass]
dielectric = {{ ior = {IOR} }}
[[shape]]
rectangle = {{ corner = [-9, 2.5, -9], u = [18, 0, 0], v = [0, 0, 18] }}
material = "white"
[[shape]]
rectangle = {{ corner = [-9, -1.5, 9], u = [18, 0, 0], v = [0, 0, -18] }}
material = "white"
{shapes}
"#
    );
    let source = Source::from_text(format!("{name}.toml"), text);
    match tyndall::scene::file::from_source(&source, &Default::default()) {
        Ok(scene) => scene,
        Err(error) => panic!("{name}: {error}"),
    }
}

/// Keeps a subpath's vertices, and where on a light it starts.
#[derive(Default)]
struct Subpath {
    light: Option<tyndall::light::LightPoint>,
    vertices: Vec<Vertex>,
}

impl Sink for Subpath {
    fn record(&mut self, _: &Sample, _: &Joint) {}
    fn start(&mut self, start: &Start) {
        if let Start::Light(light) = start {
            self.light = Some(*light);
        }
    }
    fn vertex(&mut self, vertex: &Vertex) {
        self.vertices.push(*vertex);
    }
}

/// An end of a chain, in f64.
#[derive(Clone, Copy, Debug)]
struct End {
    p: DVec3,
    n: DVec3,
}

/// A Dirac on the way: a plane (through a point, with a normal) or a sphere of glass.
#[derive(Clone, Copy, Debug)]
enum Glass {
    Plane(DVec3, DVec3),
    Sphere(DVec3, f64),
}

#[derive(Clone, Copy, Debug)]
struct Event {
    glass: Glass,
    reflected: bool,
}

fn meet_plane(origin: DVec3, dir: DVec3, p: DVec3, n: DVec3) -> DVec3 {
    origin + dir * ((p - origin).dot(n) / dir.dot(n))
}

impl Event {
    /// Where a ray meets it, and how it goes on: the law of reflection, or Snell's law.
    fn pass(&self, origin: DVec3, dir: DVec3) -> (DVec3, DVec3) {
        let (p, outside) = match self.glass {
            Glass::Plane(p, n) => (meet_plane(origin, dir, p, n), n),
            Glass::Sphere(centre, radius) => {
                let b = (origin - centre).dot(dir);
                let root = (b * b - (origin - centre).length_squared() + radius * radius).sqrt();
                let t = if -b - root > 1e-4 { -b - root } else { -b + root };
                let p = origin + dir * t;
                (p, (p - centre) / radius)
            }
        };
        let entering = dir.dot(outside) < 0.0;
        let n = if entering { outside } else { -outside };
        let cos = -dir.dot(n);
        if self.reflected {
            return (p, dir + 2.0 * cos * n);
        }
        let e = if entering { 1.0 / IOR } else { IOR };
        (p, e * dir + (e * cos - (1.0 - e * e * (1.0 - cos * cos)).sqrt()) * n)
    }
}

/// Where the ray from `origin` along `dir` lands on the plane of `target` after all events.
fn land(origin: DVec3, dir: DVec3, events: &[Event], target: End) -> DVec3 {
    let (p, w) = events.iter().fold((origin, dir.normalize()), |(p, w), event| event.pass(p, w));
    meet_plane(p, w, target.p, target.n)
}

/// dA/dω: the area of `target` that a small cone about `dir` covers, by central differences.
fn spread(origin: DVec3, dir: DVec3, events: &[Event], target: End) -> f64 {
    let h = 1e-5;
    let (s, t) = dir.any_orthonormal_pair();
    let across =
        |v: DVec3| land(origin, dir + h * v, events, target) - land(origin, dir - h * v, events, target);
    across(s).cross(across(t)).length() / (4.0 * h * h)
}

/// What was checked: chains by whether they end in denser glass than they began, in air, or neither.
#[derive(Default)]
struct Checked {
    into: u32,
    out: u32,
    level: u32,
    /// Left out.
    caustic: u32,
}

fn surface(vertex: &Vertex) -> &SurfacePoint {
    vertex.place.surface().expect("no medium")
}

/// Checks a chain from `a`, which was reached with the density `density` and left with `leave` times the cosine over π,
/// to the last of `vertices`; all between are Diracs.
fn check(
    scene: &Scene,
    what: &str,
    a: End,
    density: f64,
    leave: f64,
    vertices: &[Vertex],
    seen: &mut Checked,
) {
    let (last, glass) = vertices.split_last().expect("a chain");
    let d = |v: Vec3A| v.as_dvec3();
    let b = End { p: d(surface(last).p), n: d(surface(last).ng) };
    let mut points = vec![a.p];
    points.extend(vertices.iter().map(|v| d(surface(v).p)));
    let mut events = Vec::new();
    let mut index: i32 = 0;
    for (i, vertex) in glass.iter().enumerate() {
        let (here, n) = (points[i + 1], d(surface(vertex).ng));
        let before = (points[i] - here).normalize().dot(n);
        let after = (points[i + 2] - here).normalize().dot(n);
        // Beyond 84 degrees the rounding of the renderer's directions shows.
        if before.abs() < 0.1 || after.abs() < 0.1 {
            return;
        }
        let reflected = before * after > 0.0;
        if !reflected {
            index += if before > 0.0 { 1 } else { -1 };
        }
        let glass = match scene.geometry.shape(surface(vertex).shape) {
            ShapeDesc::Sphere { centre, radius } => Glass::Sphere(d(*centre), f64::from(*radius)),
            _ => Glass::Plane(here, n),
        };
        events.push(Event { glass, reflected });
    }
    let (there, back) = (points[1] - a.p, points[points.len() - 2] - b.p);
    let (there, back) = (there.normalize(), back.normalize());
    let (cos_a, cos_b) = (there.dot(a.n).abs(), back.dot(b.n).abs());
    if cos_a < 0.01 || cos_b < 0.01 {
        return;
    }
    let reversed: Vec<Event> = events.iter().rev().copied().collect();
    let missed = land(a.p, there, &events, b).distance(b.p);
    assert!(missed < 1e-3, "{what}: the light does not go this way, {missed}");

    let (spread_there, spread_back) = (spread(a.p, there, &events, b), spread(b.p, back, &reversed, a));
    // Close to a caustic the area is nearly nothing, and is another one for the rounding of the direction.
    let nudged = spread(a.p, there + 1e-5 * there.any_orthonormal_vector(), &events, b);
    if (nudged / spread_there - 1.0).abs() > 2e-4 {
        seen.caustic += 1;
        return;
    }
    let leave_b = ALBEDO * cos_b / PI;
    let forward = leave * cos_a / PI / spread_there;
    let reverse = leave_b / spread_back;
    let link = last.link;
    let renderer = f64::from(link.density) / (f64::from(link.behind) * leave_b * density);
    let quotient = renderer / (forward / reverse);
    assert!(
        (quotient - 1.0).abs() < 2e-3,
        "{what}: the quotient of the densities is {quotient} of the true one, over {events:?} from {a:?} to {b:?}"
    );
    match index {
        1 => seen.into += 1,
        -1 => seen.out += 1,
        _ => seen.level += 1,
    }
}

fn is_glass(scene: &Scene, vertex: &Vertex) -> bool {
    scene.material(surface(vertex).shape).has_specular()
}

/// From a point on the light, or where `light` is false from the camera's first diffuse vertex, through glass to the
/// first diffuse vertex.
fn check_walks(name: &str, scene: &Scene, light: bool, seen: &mut Checked) {
    // The one technique whose count is at a: c_0 of the hit, c_k of light tracing.
    let technique = if light { Technique::Hit } else { Technique::Lens };
    let settings = Settings { max_length: 8, seed: 5, ..Settings::new(TechniqueSet::of(&[technique])) };
    let size = scene.camera.size();
    for iteration in 0..8 {
        let pass = crate::collect::pass(scene, &settings, iteration);
        for index in 0..size.x * size.y {
            let mut subpath = Subpath::default();
            if light {
                let mut store = Stored::default();
                light_path::trace(scene, &pass, index.into(), &mut store, &mut subpath);
            } else {
                let pixel = UVec2::new(index % size.x, index / size.x);
                camera_path::trace(scene, &pass, pixel, Partners::NONE, &mut subpath);
            }
            let (a, density, leave, rest) = if light {
                let Some(x0) = subpath.light else { continue };
                let end = End { p: x0.p.as_dvec3(), n: x0.n.as_dvec3() };
                let density = scene.lights.pdf_position(&pass.starts, &x0);
                (end, f64::from(density), 1.0, &subpath.vertices[..])
            } else {
                let Some((first, rest)) = subpath.vertices.split_first() else { continue };
                if is_glass(scene, first) {
                    continue;
                }
                let end = End { p: surface(first).p.as_dvec3(), n: surface(first).ng.as_dvec3() };
                (end, f64::from(first.link.density), ALBEDO, rest)
            };
            let Some(length) = rest.iter().position(|v| !is_glass(scene, v)).filter(|l| *l > 0) else {
                continue;
            };
            let walk = if light { "light walk" } else { "camera walk" };
            check(scene, &format!("{name}, {walk}"), a, density, leave, &rest[..=length], seen);
        }
    }
}

#[test]
fn both_walks_densities_have_the_true_quotient_through_glass() {
    for light in [true, false] {
        let mut seen = Checked::default();
        for (name, camera, shapes) in SCENES {
            check_walks(name, &scene(name, camera, shapes), light, &mut seen);
        }
        let Checked { into, out, level, caustic } = seen;
        let checked = into + out + level;
        assert!(
            into.min(out).min(level) > 1000 && caustic < checked / 10,
            "{into} into, {out} out of, {level} through glass, {caustic} left out"
        );
    }
}

/// What a mixture says of the way back through one of its Diracs is what it says when it is asked to go there, with the
/// Jacobian of refraction, η_from² cos θ_from / (η_to² cos θ_to). The bug that this keeps out: a reverse density without the
/// probability of the layer.
#[test]
fn the_reverse_of_a_dirac_is_the_probability_of_going_back() {
    let white = || Texture::Constant(Vec3::splat(0.8));
    let diffuse = Material::Diffuse(Diffuse::new(white()).expect("an albedo"));
    let mirror = Material::Mirror(Mirror::new(white()).expect("an albedo"));
    let one = Texture::Constant(Vec3::ONE);
    let glass = Material::Dielectric(Dielectric::new(1.5, 1.0, 0.0, one, white()).expect("an index"));
    let layers = [vec![(0.7, diffuse.clone()), (0.3, mirror)], vec![(0.4, diffuse), (0.6, glass)]];
    for layered in layers {
        let material = Material::Layered(Layered::new(layered).expect("layers"));
        let sample = |from, u| {
            let sample = material.sample(Vec2::ZERO, from, Mode::Radiance, (u, Vec2::splat(0.3)));
            sample.filter(|b: &BsdfSample| b.specular)
        };
        let lobes = || (0..256).map(|i| (i as f32 + 0.5) / 256.0);
        let mut checked = 0;
        for i in 0..40u32 {
            let (z, phi) = (0.05 + 0.9 * (i / 2) as f32 / 20.0, i as f32);
            let z = if i % 2 == 0 { z } else { -z };
            let r = (1.0 - z * z).sqrt();
            let from = Vec3A::new(r * phi.cos(), r * phi.sin(), z);
            for u in lobes() {
                let Some(there) = sample(from, u) else { continue };
                let back = lobes()
                    .filter_map(|u| sample(there.to, u))
                    .find(|b| (b.to - from).length() < 1e-4)
                    .expect("light can go back where it came from");
                let jacobian = if there.to.z * from.z > 0.0 {
                    1.0
                } else {
                    let eta = if from.z > 0.0 { 1.5 } else { 1.0 / 1.5f32 };
                    (from.z / (eta * eta * there.to.z)).abs()
                };
                assert!(
                    (there.pdf_rev / (back.pdf * jacobian) - 1.0).abs() < 1e-3,
                    "{there:?} from {from}, and back {back:?}"
                );
                checked += 1;
            }
        }
        assert!(checked > 1000, "{checked}");
    }
}
