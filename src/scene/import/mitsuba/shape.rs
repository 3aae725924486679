//! Shapes, with what they are made of and what they emit.

use super::super::numbers::{array, color, number, quoted};
use super::bsdf::Translated;
use super::tree::Element;
use super::{Translator, file_of, steps, used_at};
use crate::error::Result;
use crate::geometry::TriangleMesh;
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
use std::rc::Rc;

/// Properties that every shape has.
const COMMON: [&str; 6] = ["to_world", "bsdf", "interior", "exterior", "emitter", "flip_normals"];

/// Steps around a cylinder: the middle of a step is 1 − cos(π/512) of the radius inside.
const AROUND: u32 = 512;

/// The faces of Mitsuba's cube, counter-clockwise from the corner with the texture coordinates (0, 1).
const CUBE: [[[f32; 3]; 4]; 6] = [
    [[1.0, -1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, -1.0, -1.0]],
    [[1.0, 1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, 1.0]],
    [[1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [1.0, -1.0, 1.0]],
    [[1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0]],
    [[-1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, -1.0]],
    [[1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]],
];

impl Translator<'_> {
    /// `[[shape]]`.
    pub(super) fn shape(&mut self, shape: &Element) -> Result<()> {
        let kind = shape.kind()?;
        let bsdfs = self.below(shape, "bsdf")?;
        let emitters = self.below(shape, "emitter")?;
        let material = match &bsdfs[..] {
            [] => None,
            [bsdf] => Some(self.material(bsdf)?),
            [_, second, ..] => return Err(second.error("a shape has one BSDF, and this is its second")),
        };
        let emission = match &emitters[..] {
            [] => None,
            [emitter] => Some(self.emission(emitter)?),
            [_, second, ..] => return Err(second.error("a shape has one emitter, and this is its second")),
        };
        let interior = match self.side(shape, "interior")? {
            Some(medium) => Some(self.medium(&medium)?),
            None => self.passed_world(shape, kind, material.as_ref())?,
        };
        // What Mitsuba gives a shape without a BSDF.
        let material = match (material, &emission) {
            (Some(material), _) => Some(material.name),
            (None, Some(_)) => None,
            (None, None) => Some(self.default_material(shape)),
        };
        let textured =
            bsdfs.first().is_some_and(|b| self.materials.get(&Rc::as_ptr(b)).is_some_and(|m| m.textured));
        let geometry = self.geometry(shape, kind, textured)?;
        self.document.table(&shape.place, "[[shape]]");
        if let Some(id) = shape.attribute("id") {
            self.document.line(format!("name = {}", quoted(id)));
        }
        if let Some(material) = material {
            self.document.line(format!("material = {}", quoted(&material)));
        }
        if let Some((radiance, place)) = emission {
            self.document.at(&place);
            self.document.line(format!("emission = {}", color(radiance)));
            self.document.at(&shape.place);
        }
        if let Some(interior) = interior {
            self.document.line(format!("interior = {}", quoted(&interior)));
        }
        self.document.line(geometry);
        Ok(())
    }

    fn default_material(&mut self, shape: &Element) -> String {
        let name = self.document.name("material", "default");
        self.document.table(&shape.place, format!("[material.{}]", quoted(&format!("{name}-front"))));
        self.document.line("diffuse = { reflectance = 0.5 }");
        self.document.table(&shape.place, format!("[material.{}]", quoted(&name)));
        self.document.line(format!("sided = {{ front = {} }}", quoted(&format!("{name}-front"))));
        name
    }

    /// A closed shape that light passes into and that says nothing of media changes none: what is about all shapes is
    /// in it, too.
    fn passed_world(
        &mut self,
        shape: &Element,
        kind: &str,
        material: Option<&Translated>,
    ) -> Result<Option<String>> {
        let says = self.side(shape, "exterior")?.is_some();
        let closed = matches!(kind, "sphere" | "cube" | "obj" | "ply");
        match self.world.clone() {
            Some(world) if !says && closed && material.is_some_and(|m| m.passes) => {
                self.medium(&world).map(Some)
            }
            _ => Ok(None),
        }
    }

    fn emission(&self, emitter: &Element) -> Result<([f64; 3], super::super::Place)> {
        if emitter.kind()? != "area" {
            return Err(emitter.unsupported("only an area emitter belongs to a shape"));
        }
        emitter.only(&["radiance", "sampling_weight"])?;
        let radiance = self.property(emitter, "radiance")?;
        match radiance {
            Some(radiance) if radiance.tag == "texture" => {
                Err(radiance.unsupported("a texture of emitted light is not supported"))
            }
            Some(radiance) => Ok((radiance.color()?, radiance.place.clone())),
            None => Ok(([1.0; 3], emitter.place.clone())),
        }
    }

    /// The lines of a shape's geometry.
    fn geometry(&mut self, shape: &Element, kind: &str, textured: bool) -> Result<String> {
        let only = |more: &[&str]| shape.only(&[&COMMON[..], more].concat());
        let to_world = shape.transform("to_world")?;
        let flip = shape.boolean_or("flip_normals", false)?;
        // Flat shapes face the other way when their z axis is turned round.
        let flat = if flip { to_world * DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0)) } else { to_world };
        match kind {
            "rectangle" => {
                only(&[])?;
                Ok(placed("rectangle = { corner = [-1, -1, 0], u = [2, 0, 0], v = [0, 2, 0] }", &flat))
            }
            "disk" | "sphere" | "cylinder" if textured => {
                Err(shape.unsupported("a texture on it is not supported"))
            }
            "disk" => {
                only(&[])?;
                Ok(placed("disc = { normal = [0, 0, 1], radius = 1 }", &flat))
            }
            "cylinder" => {
                only(&["p0", "p1", "radius"])?;
                self.cylinder(shape, flip, &to_world)
            }
            "sphere" | "cube" if flip => Err(shape.unsupported("`flip_normals` is not supported here")),
            "sphere" => {
                only(&["center", "radius"])?;
                let centre = shape.point("center")?.unwrap_or(DVec3::ZERO);
                let radius = shape.number_or("radius", 1.0)?;
                let sphere = format!(
                    "sphere = {{ center = {}, radius = {} }}",
                    array(&centre.to_array()),
                    number(radius)
                );
                Ok(placed(&sphere, &to_world))
            }
            "cube" if !textured => {
                only(&[])?;
                Ok(placed("box = { min = [-1, -1, -1], max = [1, 1, 1] }", &to_world))
            }
            "cube" => {
                only(&[])?;
                let mesh = cube().map_err(|e| shape.error(e))?;
                Ok(placed(&self.mesh_entry("cube", mesh), &to_world))
            }
            "obj" | "ply" => {
                only(&["filename", "face_normals", "flip_tex_coords"])?;
                self.mesh_from_file(shape, kind, flip, &to_world)
            }
            _ => Err(shape.unsupported("this kind of shape is not supported")),
        }
    }

    /// A tube without ends: flat steps around the axis, shaded smooth.
    fn cylinder(&mut self, shape: &Element, flip: bool, to_world: &DAffine3) -> Result<String> {
        let (from, to) = (shape.point("p0")?.unwrap_or(DVec3::ZERO), shape.point("p1")?.unwrap_or(DVec3::Z));
        let radius = shape.number_or("radius", 1.0)?;
        let axis = to - from;
        let Some(unit) = axis.try_normalize() else {
            return Err(shape.error("the cylinder has no length: `p0` is `p1`"));
        };
        let message =
            format!("the cylinder has {AROUND} flat steps around here, within 0.00002 of its radius");
        self.document.warn(&shape.place, message);
        let across = unit.any_orthonormal_vector();
        let placed_axis =
            DAffine3::from_mat3_translation(DMat3::from_cols(across, axis, across.cross(unit)), from);
        let (low, high) = if flip { (1, 0) } else { (0, 1) };
        let r = number(radius);
        let lathe = format!("lathe = {{ profile = [[{r}, {low}], [{r}, {high}]], segments = {AROUND} }}");
        Ok(placed(&lathe, &(*to_world * placed_axis)))
    }

    fn mesh_from_file(
        &mut self,
        shape: &Element,
        kind: &str,
        flip: bool,
        to_world: &DAffine3,
    ) -> Result<String> {
        let path = file_of(self.tree, shape)?;
        let mesh = TriangleMesh::load(&path).map_err(|e| used_at(shape, e))?;
        self.document.read_file(&path);
        if mesh.dropped() > 0 {
            let message = format!("{} triangles without area are left out", mesh.dropped());
            self.document.warn(&shape.place, message);
        }
        let mesh = match (shape.boolean_or("face_normals", false)?, mesh.normals()) {
            (true, _) => mesh.faceted(),
            (false, None) => mesh.smoothed(),
            (false, Some(_)) => mesh,
        };
        // A reflection turns a mesh of Mitsuba's inside out, as it goes by the order of corners; one of ours it does not.
        let reversed = flip != (to_world.matrix3.determinant() < 0.0);
        let upside_down = shape.boolean_or("flip_tex_coords", kind == "obj")?;
        let sign = if flip { -1.0 } else { 1.0 };
        let normals = mesh.normals().map(|n| n.iter().map(|n| *n * sign).collect());
        let uvs = mesh.uvs().map(|uvs| {
            uvs.iter().map(|uv| if upside_down { Vec2::new(uv.x, 1.0 - uv.y) } else { *uv }).collect()
        });
        let indices = mesh.indices().iter().map(|t| if reversed { [t[0], t[2], t[1]] } else { *t }).collect();
        let mesh = TriangleMesh::new(mesh.positions().to_vec(), normals, uvs, indices);
        let mesh = mesh.map_err(|e| shape.error(e))?;
        let stem = path.file_stem().map_or("mesh".into(), |s| s.to_string_lossy()).into_owned();
        Ok(placed(&self.mesh_entry(&stem, mesh), to_world))
    }

    fn mesh_entry(&mut self, wish: &str, mesh: TriangleMesh) -> String {
        format!("mesh = {{ file = {} }}", quoted(&self.document.mesh(wish, mesh)))
    }
}

fn placed(geometry: &str, to_world: &DAffine3) -> String {
    match steps(to_world) {
        Some(steps) => format!("{geometry}\ntransform = {steps}"),
        None => geometry.to_owned(),
    }
}

/// The cube with Mitsuba's texture coordinates.
fn cube() -> Result<TriangleMesh, String> {
    let positions = CUBE.iter().flatten().map(|p| Vec3::from_array(*p)).collect();
    let corners = [Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO];
    let uvs = (0..6).flat_map(|_| corners).collect();
    let indices =
        (0..6u32).flat_map(|f| [[0, 1, 2], [3, 0, 2]].map(|t: [u32; 3]| t.map(|i| 4 * f + i))).collect();
    TriangleMesh::new(positions, None, Some(uvs), indices)
}
