//! The materials that every test goes through, and directions to look at them from.

use crate::bsdf::*;
use crate::math::{Rgb, Stream, StreamKind};
use crate::texture::Texture;
use glam::{Vec2, Vec3A};

/// One row: a material, its name for messages, and the index of refraction inside over outside.
pub struct Row {
    pub name: String,
    pub material: Material,
    pub eta: f32,
}

pub fn grey(v: f32) -> Texture {
    Texture::grey(v)
}

pub fn rgb(r: f32, g: f32, b: f32) -> Texture {
    Texture::constant(Rgb::new(r, g, b))
}

pub fn diffuse(r: f32, g: f32, b: f32) -> Material {
    Material::Diffuse(Diffuse::new(rgb(r, g, b)).unwrap())
}

pub fn metal(name: &str, alpha: f32) -> Material {
    Material::Conductor(Conductor::metal(name, alpha, grey(1.0)).unwrap())
}

pub fn glass(eta: f32, alpha: f32) -> Material {
    Material::Dielectric(Dielectric::new(eta, 1.0, alpha, grey(1.0), grey(1.0)).unwrap())
}

/// A rough metal or glass with Beckmann's distribution.
pub fn beckmann(material: Material) -> Material {
    match material {
        Material::Conductor(m) => Material::Conductor(m.with_distribution(NormalDistribution::Beckmann)),
        Material::Dielectric(m) => Material::Dielectric(m.with_distribution(NormalDistribution::Beckmann)),
        other => panic!("{other:?} has no distribution to be set"),
    }
}

pub fn tinted_glass(alpha: f32) -> Material {
    Material::Dielectric(Dielectric::new(1.6, 1.2, alpha, rgb(0.3, 0.5, 0.2), rgb(0.1, 0.8, 0.9)).unwrap())
}

pub fn phong(exponent: f32) -> Material {
    Material::Phong(Phong::new(rgb(0.3, 0.1, 0.05), rgb(0.2, 0.4, 0.6), exponent).unwrap())
}

pub fn layered(parts: Vec<(f32, Material)>) -> Material {
    Material::Layered(Layered::new(parts).unwrap())
}

pub fn mirror(v: f32) -> Material {
    Material::Mirror(Mirror::new(grey(v)).unwrap())
}

pub fn plastic(roughness: f32, nonlinear: bool) -> Material {
    plastic_of(NormalDistribution::Ggx, roughness, nonlinear)
}

pub fn plastic_of(distribution: NormalDistribution, roughness: f32, nonlinear: bool) -> Material {
    let settings = PlasticSettings {
        diffuse: rgb(0.7, 0.3, 0.1),
        specular: rgb(0.9, 1.0, 0.8),
        ior: 1.5,
        exterior_ior: 1.0,
        roughness,
        distribution,
        masking: Masking::Separable,
        nonlinear,
    };
    Material::Plastic(Box::new(Plastic::new(settings).unwrap()))
}

pub fn sided(front: Option<Material>, back: Option<Material>) -> Material {
    Material::Sided(Sided::new(front, back).unwrap())
}

pub fn pane(ior: f32) -> Material {
    Material::Thin(Thin::new(ior, 1.0, rgb(0.9, 1.0, 0.5), rgb(0.4, 0.6, 0.8)).unwrap())
}

fn row(name: &str, material: Material, eta: f32) -> Row {
    Row { name: name.to_owned(), material, eta }
}

/// The rows of [`broad`] with Beckmann's distribution.
fn broad_beckmann() -> Vec<Row> {
    let bare = Conductor::without_fresnel(0.3, grey(0.8)).unwrap().with_masking(Masking::Separable);
    vec![
        row("Beckmann's gold", beckmann(metal("gold", 0.2)), 1.0),
        row("Beckmann's roughest iron", beckmann(metal("Fe", 1.0)), 1.0),
        row("Beckmann, no Fresnel, separable", beckmann(Material::Conductor(bare)), 1.0),
        row("Beckmann's plastic", plastic_of(NormalDistribution::Beckmann, 0.3, true), 1.0),
        row("Beckmann's glass", beckmann(glass(1.5, 0.2)), 1.5),
        row("Beckmann's roughest glass", beckmann(glass(1.5, 1.0)), 1.5),
        row("Beckmann's bubble", beckmann(glass(0.75, 0.4)), 0.75),
        row("Beckmann's tinted glass", beckmann(tinted_glass(0.5)), 1.6 / 1.2),
    ]
}

/// Everything with a smooth lobe that is broad enough to be binned over the whole sphere.
pub fn broad() -> Vec<Row> {
    let bare = Conductor::without_fresnel(0.3, grey(0.8)).unwrap().with_masking(Masking::Separable);
    let mut rows = vec![
        row("diffuse", diffuse(0.2, 0.9, 0.5), 1.0),
        row("rough gold", metal("gold", 0.2), 1.0),
        row("roughest iron", metal("Fe", 1.0), 1.0),
        row("no Fresnel, separable", Material::Conductor(bare), 1.0),
        row("rough glass", glass(1.5, 0.2), 1.5),
        row("roughest glass", glass(1.5, 1.0), 1.5),
        row("rough bubble", glass(0.75, 0.4), 0.75),
        row("rough tinted glass", tinted_glass(0.5), 1.6 / 1.2),
        row("phong", phong(15.0), 1.0),
        row("plastic", plastic(0.0, false), 1.0),
        row("deep plastic", plastic(0.0, true), 1.0),
        row("rough plastic", plastic(0.3, true), 1.0),
        row("two faces", sided(Some(diffuse(0.2, 0.9, 0.5)), Some(metal("gold", 0.3))), 1.0),
        row("one face", sided(Some(plastic(0.4, false)), None), 1.0),
        row("half a diffuse surface", layered(vec![(0.6, diffuse(0.2, 0.9, 0.5)), (0.4, pane(1.0))]), 1.0),
        row(
            "varnish: diffuse, rough copper, mirror",
            layered(vec![(0.5, diffuse(0.8, 0.2, 0.1)), (0.3, metal("copper", 0.4)), (0.2, mirror(1.0))]),
            1.0,
        ),
        row(
            "rough glass, phong and smooth glass",
            layered(vec![(0.4, glass(1.5, 0.3)), (0.5, phong(30.0)), (0.1, glass(1.5, 0.0))]),
            1.5,
        ),
    ];
    rows.extend(broad_beckmann());
    rows
}

/// Everything with a smooth lobe: the broad ones, and lobes that are narrow.
pub fn smooth() -> Vec<Row> {
    let mut rows = broad();
    rows.extend([
        row("polished silver", metal("silver", 0.01), 1.0),
        row("polished glass", glass(1.5, 0.02), 1.5),
        row("narrow phong", phong(3000.0), 1.0),
        row("Beckmann's polished silver", beckmann(metal("silver", 0.01)), 1.0),
        row("Beckmann's polished glass", beckmann(glass(1.5, 0.02)), 1.5),
    ]);
    rows
}

/// Every material, with the specular ones.
pub fn all() -> Vec<Row> {
    let mut rows = smooth();
    rows.extend([
        row("mirror", mirror(0.7), 1.0),
        row("smooth gold", metal("Au", 0.0), 1.0),
        row("glass", glass(1.5, 0.0), 1.5),
        row("bubble", glass(0.7, 0.0), 0.7),
        row("matched glass", glass(1.0, 0.0), 1.0),
        row("tinted glass", tinted_glass(0.0), 1.6 / 1.2),
        row("pane", pane(1.5), 1.0),
        row("share of nothing", pane(1.0), 1.0),
        row("mirror before diffuse", sided(Some(mirror(0.8)), Some(diffuse(0.2, 0.9, 0.5))), 1.0),
        row("null", Material::Null, 1.0),
    ]);
    rows
}

/// The unit direction of that cosine and azimuth.
pub fn direction(cos: f32, phi: f32) -> Vec3A {
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    Vec3A::new(sin * phi.cos(), sin * phi.sin(), cos)
}

/// A normal that is along no axis.
pub fn tilted() -> Vec3A {
    Vec3A::new(0.48, -0.6, -0.64)
}

/// Steep, oblique and grazing, from outside and from inside.
pub fn directions() -> [Vec3A; 6] {
    [(0.95, 0.3), (0.6, 2.0), (0.05, -1.0), (-0.9, 0.7), (-0.5, -2.5), (-0.1, 1.2)]
        .map(|(c, p)| direction(c, p))
}

pub fn stream(seed: u64) -> Stream {
    Stream::new(seed, 0, StreamKind::Other, 0)
}

/// A direction uniform over the sphere.
pub fn any_direction(s: &mut Stream) -> Vec3A {
    crate::math::warp::uniform_sphere(s.next_2d())
}

/// Where on the textures: they are constant here.
pub const UV: Vec2 = Vec2::ZERO;

/// η²(to)/η²(from) by the sides that the directions are on: what a camera walk's weight lacks to be an energy.
pub fn radiance_to_energy(eta: f32, from: Vec3A, to: Vec3A) -> f32 {
    match (from.z > 0.0, to.z > 0.0) {
        (true, false) => eta * eta,
        (false, true) => 1.0 / (eta * eta),
        _ => 1.0,
    }
}
