//! What is in a scene, for `tyndall info`: as text for people and as JSON for programs.

mod media;

pub use media::MediumInfo;

use super::Scene;
use crate::bsdf::Material;
use crate::geometry::{ShapeKind, ShapeStats};
use crate::math::RgbExt;
use glam::Vec3A;
use serde::Serialize;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// All that `tyndall info` tells. Lengths in metres, areas in m², powers in W, memory in bytes.
#[derive(Clone, Debug, Serialize)]
pub struct SceneInfo {
    /// What the scene is called.
    pub name: String,
    /// A sentence or two, or nothing.
    pub description: String,
    /// The image.
    pub film: FilmInfo,
    /// Where the scene is seen from.
    pub camera: CameraInfo,
    /// Shapes in the order of the file.
    pub shapes: Vec<ShapeInfo>,
    /// Triangles, spheres and discs of all shapes.
    pub primitives: usize,
    /// Triangles of all shapes.
    pub triangles: usize,
    /// Materials in the order of the file.
    pub materials: Vec<MaterialInfo>,
    /// Lights, those of shapes first.
    pub lights: Vec<LightInfo>,
    /// Media in the order of the file.
    pub media: Vec<MediumInfo>,
    /// How large the scene is; `None` without a shape.
    pub extent: Option<ExtentInfo>,
    /// What it takes in memory.
    pub memory: MemoryInfo,
    /// Every file that was read.
    pub files: Vec<PathBuf>,
    /// What looks odd but can be rendered.
    pub warnings: Vec<String>,
}

/// The image.
#[derive(Clone, Debug, Serialize)]
pub struct FilmInfo {
    /// Columns of the full frame.
    pub width: u32,
    /// Rows of the full frame.
    pub height: u32,
    /// What is rendered of it, `[x0, y0, x1, y1]`.
    pub crop: [u32; 4],
}

/// Where the scene is seen from.
#[derive(Clone, Debug, Serialize)]
pub struct CameraInfo {
    /// Middle of the lens.
    pub position: [f32; 3],
    /// Unit viewing direction.
    pub forward: [f32; 3],
    /// Angle from the left to the right edge of the image, degrees.
    pub horizontal_fov: f32,
    /// Radius of the lens; 0 for a pinhole.
    pub lens_radius: f32,
}

/// A shape.
#[derive(Clone, Debug, Serialize)]
pub struct ShapeInfo {
    /// Its name.
    pub name: String,
    /// Sphere, disc or mesh (rectangles, boxes and lathes are meshes).
    pub kind: &'static str,
    /// Triangles; 1 for a sphere or a disc.
    pub primitives: usize,
    /// Its area.
    pub area: f64,
    /// Whether it bounds a volume.
    pub closed: bool,
    /// Name of its material; empty for a lamp without.
    pub material: String,
    /// Whether it emits.
    pub emits: bool,
}

/// A material.
#[derive(Clone, Debug, Serialize)]
pub struct MaterialInfo {
    /// Its name; empty for the black of lamps without a material.
    pub name: String,
    /// What kind it is.
    pub kind: &'static str,
    /// Mean albedo by its textures, each channel; an estimate, see [`Material::albedo`].
    pub albedo: [f32; 3],
    /// How many shapes have it.
    pub shapes: usize,
}

/// A light.
#[derive(Clone, Debug, Serialize)]
pub struct LightInfo {
    /// Its name, or that of its shape.
    pub name: String,
    /// What kind it is.
    pub kind: &'static str,
    /// Luminance of its power; of infinite lights, what enters the disc that covers the scene.
    pub power: f32,
    /// How often it is sampled: its share of all power.
    pub share: f32,
}

/// How large a scene is.
#[derive(Clone, Debug, Serialize)]
pub struct ExtentInfo {
    /// Smallest coordinates.
    pub min: [f32; 3],
    /// Largest coordinates.
    pub max: [f32; 3],
    /// From the one to the other.
    pub diagonal: f32,
    /// Centre of the bounding sphere.
    pub center: [f32; 3],
    /// Radius of the bounding sphere.
    pub radius: f32,
}

/// What a scene takes in memory.
#[derive(Clone, Debug, Serialize)]
pub struct MemoryInfo {
    /// The acceleration structure.
    pub acceleration: usize,
    /// Images of textures.
    pub textures: usize,
}

impl SceneInfo {
    /// Of a scene. Looks at every triangle.
    pub fn of(scene: &Scene) -> Self {
        let shapes = shapes(scene);
        let triangles =
            shapes.iter().filter(|s| s.kind == kind_name(ShapeKind::Mesh)).map(|s| s.primitives).sum();
        Self {
            name: scene.name.clone(),
            description: scene.notes.description.clone(),
            film: film(scene),
            camera: camera(scene),
            shapes,
            primitives: scene.geometry.primitive_count(),
            triangles,
            materials: materials(scene),
            lights: lights(scene),
            media: media::media(scene),
            extent: extent(scene),
            memory: MemoryInfo {
                acceleration: scene.geometry.acceleration_bytes(),
                textures: scene.notes.texture_bytes,
            },
            files: scene.dependencies.clone(),
            warnings: scene.warnings.clone(),
        }
    }
}

fn film(scene: &Scene) -> FilmInfo {
    let (size, crop) = (scene.camera.size(), scene.camera.crop());
    FilmInfo { width: size.x, height: size.y, crop: [crop.x0, crop.y0, crop.x1, crop.y1] }
}

fn camera(scene: &Scene) -> CameraInfo {
    let camera = &scene.camera;
    // On the axis the density is 1/(4 tan_x tan_y); with square pixels tan_x/tan_y is the image's aspect.
    let size = camera.size().as_vec2();
    let density = camera.pdf_direction(camera.position(), camera.forward());
    let tan_x = 0.5 * (size.x / size.y / density).sqrt();
    CameraInfo {
        position: camera.position().into(),
        forward: camera.forward().into(),
        horizontal_fov: (2.0 * tan_x.atan()).to_degrees(),
        lens_radius: camera.lens_area().map_or(0.0, |a| (a / std::f32::consts::PI).sqrt()),
    }
}

fn shapes(scene: &Scene) -> Vec<ShapeInfo> {
    let emitting = |shape: u32| {
        let area =
            |light: &crate::light::Light| matches!(light, crate::light::Light::Area(l) if l.shape() == shape);
        scene.lights.lights().iter().any(area)
    };
    let info = |(i, name): (usize, &String)| {
        let stats: ShapeStats = scene.geometry.stats(i as u32);
        ShapeInfo {
            name: name.clone(),
            kind: kind_name(stats.kind),
            primitives: stats.primitives,
            area: stats.area,
            closed: stats.closed,
            material: material_name(scene, scene.shape_materials[i] as usize),
            emits: emitting(i as u32),
        }
    };
    scene.shape_names.iter().enumerate().map(info).collect()
}

fn kind_name(kind: ShapeKind) -> &'static str {
    match kind {
        ShapeKind::Sphere => "sphere",
        ShapeKind::Disc => "disc",
        ShapeKind::Mesh => "mesh",
    }
}

fn material_name(scene: &Scene, index: usize) -> String {
    scene.notes.material_names.get(index).cloned().unwrap_or_default()
}

fn materials(scene: &Scene) -> Vec<MaterialInfo> {
    let info = |(i, material): (usize, &Arc<Material>)| MaterialInfo {
        name: material_name(scene, i),
        kind: match &**material {
            Material::Diffuse(_) => "diffuse",
            Material::Mirror(_) => "mirror",
            Material::Conductor(m) if m.is_rough() => "rough conductor",
            Material::Conductor(_) => "conductor",
            Material::Dielectric(m) if m.is_rough() => "rough dielectric",
            Material::Dielectric(_) => "dielectric",
            Material::Phong(_) => "phong",
            Material::Thin(_) => "thin",
            Material::Plastic(_) => "plastic",
            Material::Sided(_) => "sided",
            Material::Layered(_) => "layered",
            Material::Null => "null",
        },
        albedo: material.mean_albedo().into(),
        shapes: scene.shape_materials.iter().filter(|m| **m as usize == i).count(),
    };
    scene.materials.iter().enumerate().map(info).collect()
}

fn lights(scene: &Scene) -> Vec<LightInfo> {
    let info = |(i, light): (usize, &crate::light::Light)| LightInfo {
        name: scene.notes.light_names.get(i).cloned().unwrap_or_default(),
        kind: light.kind(),
        power: scene.lights.power(i).luminance(),
        share: scene.lights.by_power().pdf(i),
    };
    scene.lights.lights().iter().enumerate().map(info).collect()
}

fn extent(scene: &Scene) -> Option<ExtentInfo> {
    let bounds = scene.geometry.bounds();
    let (center, radius) = scene.geometry.bounding_sphere();
    (!bounds.is_empty()).then(|| ExtentInfo {
        min: bounds.min.into(),
        max: bounds.max.into(),
        diagonal: bounds.size().length(),
        center: center.into(),
        radius,
    })
}

impl fmt::Display for SceneInfo {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "{}", self.name)?;
        if !self.description.is_empty() {
            writeln!(f, "{}", self.description)?;
        }
        let [x0, y0, x1, y1] = self.film.crop;
        let FilmInfo { width, height, .. } = self.film;
        write!(f, "\nfilm      {width}x{height} pixels")?;
        if [x0, y0, x1, y1] != [0, 0, width, height] {
            write!(f, ", of which columns {x0} to {x1} and rows {y0} to {y1}")?;
        }
        let CameraInfo { position, forward, horizontal_fov, lens_radius } = &self.camera;
        write!(
            f,
            "\ncamera    at {} looking along {}, {horizontal_fov:.1} degrees wide, ",
            triple(position),
            triple(forward)
        )?;
        match *lens_radius {
            0.0 => writeln!(f, "a pinhole")?,
            radius => writeln!(f, "a lens of radius {radius}")?,
        }
        if let Some(ExtentInfo { min, max, diagonal, center, radius }) = &self.extent {
            writeln!(f, "extent    {} to {}, diagonal {diagonal:.4}", triple(min), triple(max))?;
            writeln!(f, "          bounding sphere about {} of radius {radius:.4}", triple(center))?;
        }
        let MemoryInfo { acceleration, textures } = self.memory;
        writeln!(f, "memory    acceleration {}, textures {}", bytes(acceleration), bytes(textures))?;
        if self.media.is_empty() {
            writeln!(f, "media     none")?;
        }
        self.write_tables(f)?;
        media::write(&self.media, f)?;
        for warning in &self.warnings {
            writeln!(f, "warning: {warning}")?;
        }
        Ok(())
    }
}

impl SceneInfo {
    fn write_tables(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        let (shapes, primitives) = (count(self.shapes.len(), "shape"), count(self.primitives, "primitive"));
        writeln!(f, "\n{shapes}, {primitives}, {}", count(self.triangles, "triangle"))?;
        let width = |names: &mut dyn Iterator<Item = &String>| {
            names.map(|n| n.chars().count()).max().unwrap_or(0).max(6)
        };
        let w = width(&mut self.shapes.iter().map(|s| &s.name));
        for s in &self.shapes {
            let material = if s.material.is_empty() { "(black)" } else { &s.material };
            let (closed, emits) =
                (if s.closed { "closed" } else { "open  " }, if s.emits { ", emits" } else { "" });
            let (name, kind, n, area) = (&s.name, s.kind, s.primitives, s.area);
            writeln!(f, "  {name:<w$}  {kind:<6} {n:>7}  {area:>10.4} m²  {closed}  {material}{emits}")?;
        }
        writeln!(f, "\n{}", count(self.materials.len(), "material"))?;
        let w = width(&mut self.materials.iter().map(|m| &m.name));
        for m in &self.materials {
            let [r, g, b] = m.albedo;
            let name = if m.name.is_empty() { "(black)" } else { &m.name };
            let kind = m.kind;
            writeln!(
                f,
                "  {name:<w$}  {kind:<16}  albedo {r:.2} {g:.2} {b:.2}  on {}",
                count(m.shapes, "shape")
            )?;
        }
        writeln!(f, "\n{}", count(self.lights.len(), "light"))?;
        let w = width(&mut self.lights.iter().map(|l| &l.name));
        for LightInfo { name, kind, power, share } in &self.lights {
            writeln!(f, "  {name:<w$}  {kind:<11}  {power:>12.4} W  {:>5.1} % of the power", 100.0 * share)?;
        }
        Ok(())
    }
}

fn triple(v: &[f32; 3]) -> String {
    // Adding 0 shows −0 as 0.
    let [x, y, z] = (Vec3A::from(*v) + Vec3A::ZERO).to_array();
    format!("({x:.4}, {y:.4}, {z:.4})")
}

fn bytes(n: usize) -> String {
    match n {
        0..=9_999 => format!("{n} B"),
        10_000..=9_999_999 => format!("{:.1} kB", n as f64 / 1e3),
        _ => format!("{:.1} MB", n as f64 / 1e6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::file::source::Source;
    use crate::scene::file::{Overrides, from_source};

    const SCENE: &str = r#"
        name = "Test"
        [film]
        width = 40
        height = 20
        crop = [0, 0, 20, 20]
        [camera]
        origin = [0, 0, 5]
        target = [0, 0, 0]
        fov = 30
        fov_axis = "vertical"
        lens_radius = 0.25
        [material.white]
        diffuse = { reflectance = 0.5 }
        [[shape]]
        name = "lamp"
        sphere = { radius = 1 }
        emission = 2
        interior = "fog"
        [[shape]]
        box = { min = [-3, -1, -1], max = [3, 1, 1] }
        material = "white"
        [medium.fog]
        sigma_a = [0.5, 0.25, 0]
        sigma_s = [0.5, 0.25, 0]
        emission = [0, 0, 1.5]
        phase = { hg = 0.75 }
        [[light]]
        name = "bulb"
        point = { position = [0, 4, 0], intensity = 1 }
    "#;

    #[test]
    fn numbers_are_those_of_the_scene() {
        let scene = from_source(&Source::from_text("a.toml", SCENE), &Overrides::default());
        let info = SceneInfo::of(&scene.unwrap_or_else(|e| panic!("{e}")));
        assert_eq!((info.primitives, info.triangles), (13, 12));
        assert_eq!(info.shapes[1].name, "box 2");
        assert!(info.shapes[0].emits && !info.shapes[1].emits && info.shapes[1].closed);
        assert!((info.shapes[1].area - 56.0).abs() < 1e-6);
        let expected = (2.0 * (2.0 * 15f32.to_radians().tan()).atan()).to_degrees();
        assert!((info.camera.horizontal_fov - expected).abs() < 1e-3, "{}", info.camera.horizontal_fov);
        assert!((info.camera.lens_radius - 0.25).abs() < 1e-6);
        let pi = std::f32::consts::PI;
        let (lamp, bulb) = (pi * 4.0 * pi * 2.0, 4.0 * pi);
        assert!(
            (info.lights[0].power / lamp - 1.0).abs() < 1e-5
                && (info.lights[1].power / bulb - 1.0).abs() < 1e-5
        );
        assert!((info.lights[0].share - lamp / (lamp + bulb)).abs() < 1e-5);
        let extent = info.extent.expect("there are shapes");
        assert_eq!((extent.min, extent.max), ([-3.0, -1.0, -1.0], [3.0, 1.0, 1.0]));
        assert!((extent.diagonal - 44f32.sqrt()).abs() < 1e-5);
    }

    #[test]
    fn text_and_json_tell_names_and_crop() {
        let scene = from_source(&Source::from_text("a.toml", SCENE), &Overrides::default());
        let info = SceneInfo::of(&scene.unwrap_or_else(|e| panic!("{e}")));
        let text = info.to_string();
        for words in [
            "40x20 pixels, of which columns 0 to 20",
            "lens of radius 0.25",
            "bulb",
            "(black), emits",
            "2 shapes",
        ] {
            assert!(text.contains(words), "{words}: {text}");
        }
        let fog = "mean free path 1.0000 2.0000 inf m, 0.1508 0.3015 inf of the extent's diagonal";
        for words in [
            "1 medium\n  fog     homogeneous  albedo 0.500 0.500 0.000, Henyey-Greenstein with g = 0.75",
            fog,
            "emits 0.0000 0.0000 1.5000 W/(sr m³)",
            "in lamp",
        ] {
            assert!(text.contains(words), "{words}: {text}");
        }
        let json = serde_json::to_value(&info).expect("it can be written");
        assert_eq!(json["film"]["crop"], serde_json::json!([0, 0, 20, 20]));
        assert_eq!(json["lights"][1]["name"], "bulb");
        let fog = &json["media"][0];
        assert_eq!((&fog["name"], &fog["mean_cosine"]), (&"fog".into(), &0.75.into()));
        assert_eq!(fog["mean_free_path"], serde_json::json!([1.0, 2.0, null]), "infinite: null");
        assert_eq!(fog["albedo"], serde_json::json!([0.5, 0.5, 0.0]));
    }
}
