//! glTF 2.0: `.gltf` with its buffers, or `.glb`. So that a scene can come from Blender.
//!
//! Light is taken in the numbers that stand there, candela or lux or watts: what matters is how lights compare. What glTF's
//! materials become, see [`material`].

mod data;
mod json;
mod material;

use super::numbers::{array, color, number, quoted};
use super::{Document, Imported, Place};
use crate::error::Result;
use crate::geometry::TriangleMesh;
use data::Data;
use glam::{DAffine3, DMat4, DQuat, DVec3, Vec2, Vec3};
use std::collections::HashMap;
use std::path::Path;

/// Extensions that a file may require.
const KNOWN: [&str; 8] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];
/// Height of the image: glTF's cameras have no film.
const HEIGHT: f64 = 512.0;
/// Nodes within each other.
const MAX_DEPTH: usize = 256;
/// Nodes that are placed: more is a trap of nodes that are children of many.
const MAX_NODES: usize = 10_000_000;

/// Translates a scene.
///
/// # Errors
/// With the part of the file that is wrong, and with line and column where its JSON cannot be read.
pub fn read(path: &Path) -> Result<Imported> {
    let data = Data::read(path)?;
    let mut document = Document::new(path);
    for file in &data.files {
        document.read_file(file);
    }
    let mut translator = Translator {
        data,
        document,
        materials: HashMap::new(),
        meshes: HashMap::new(),
        images: HashMap::new(),
        camera: None,
        placed: 0,
    };
    translator.scene()?;
    Ok(translator.document.finish())
}

struct Translator {
    data: Data,
    document: Document,
    materials: HashMap<Option<usize>, material::Translated>,
    /// Files of meshes, by mesh, primitive and set of texture coordinates.
    meshes: HashMap<(usize, usize, usize), String>,
    images: HashMap<usize, String>,
    /// The first camera, and where it stands.
    camera: Option<(usize, DAffine3)>,
    placed: usize,
}

impl Translator {
    fn warn(&mut self, part: &str, message: &str) {
        let place = Place::file(&self.data.path);
        self.document.warn(&place, format!("{part}: {message}"));
    }

    fn scene(&mut self) -> Result<()> {
        let root = &self.data.root;
        if !root.asset.version.starts_with("2.") {
            return Err(self
                .data
                .error("asset", format!("version `{}`: only 2 is read", root.asset.version)));
        }
        if let Some(unknown) = root.extensions_required.iter().find(|e| !KNOWN.contains(&e.as_str())) {
            return Err(self.data.error("extensionsRequired", format!("`{unknown}` is not supported")));
        }
        let index = root.scene.unwrap_or(0);
        let Some(scene) = root.scenes.get(index) else {
            return Err(self.data.error("scene", format!("there is no scenes[{index}]")));
        };
        for node in scene.nodes.clone() {
            self.node(node, DAffine3::IDENTITY, 0)?;
        }
        let Some((index, to_world)) = self.camera else {
            return Err(self
                .data
                .error("nodes", "no node of the scene has a camera: there is nothing to see it with"));
        };
        self.write_camera(index, to_world)
    }

    fn node(&mut self, index: usize, parent: DAffine3, depth: usize) -> Result<()> {
        let part = format!("nodes[{index}]");
        self.placed += 1;
        if depth > MAX_DEPTH || self.placed > MAX_NODES {
            return Err(self.data.error(&part, "nodes are children of each other without end"));
        }
        let Some(node) = self.data.root.nodes.get(index) else {
            return Err(self.data.error(&part, "there is none"));
        };
        let local = match node.matrix {
            Some(columns) => DAffine3::from_mat4(DMat4::from_cols_array(&columns)),
            None => DAffine3::from_scale_rotation_translation(
                node.scale.map_or(DVec3::ONE, DVec3::from_array),
                node.rotation.map_or(DQuat::IDENTITY, |q| DQuat::from_array(q).normalize()),
                node.translation.map_or(DVec3::ZERO, DVec3::from_array),
            ),
        };
        let to_world = parent * local;
        if !to_world.is_finite() {
            return Err(self.data.error(&part, "its transform is not one of finite numbers"));
        }
        let (mesh, camera, skin) = (node.mesh, node.camera, node.skin);
        let (name, children) = (node.name.clone(), node.children.clone());
        let light = node.extensions.light.as_ref().map(|l| l.light);
        if skin.is_some() {
            self.warn(&part, "it is not posed by its skin");
        }
        if let Some(mesh) = mesh {
            self.mesh(mesh, name.as_deref(), &to_world)?;
        }
        if let Some(light) = light {
            self.light(light, name.as_deref(), &to_world)?;
        }
        if let (Some(camera), None) = (camera, &self.camera) {
            self.camera = Some((camera, to_world));
        }
        for child in children {
            self.node(child, to_world, depth + 1)?;
        }
        Ok(())
    }

    fn write_camera(&mut self, index: usize, to_world: DAffine3) -> Result<()> {
        let part = format!("cameras[{index}]");
        let perspective = self.data.root.cameras.get(index).and_then(|c| c.perspective.as_ref());
        let Some(perspective) = perspective else {
            return Err(self.data.error(&part, "only a perspective camera is supported"));
        };
        let (yfov, aspect) = (perspective.yfov, perspective.aspect_ratio.unwrap_or(1.0));
        let width = (HEIGHT * aspect).round();
        if !(1.0..=65536.0).contains(&width) {
            return Err(self
                .data
                .error(&part, format!("the aspectRatio {aspect} is beyond what can be rendered")));
        }
        let (origin, m) = (to_world.translation, to_world.matrix3);
        let Some(forward) = (-m.z_axis).try_normalize() else {
            return Err(self.data.error(&part, "its node leaves it no direction"));
        };
        let place = Place::file(&self.data.path);
        self.document.table(&place, format!("[film]\nwidth = {width}\nheight = {HEIGHT}"));
        // Far enough for the direction to keep its digits in single precision.
        let target = origin + forward * origin.length().max(1.0);
        self.document.table(&place, "[camera]");
        self.document.line(format!("origin = {}", array(&origin.to_array())));
        self.document.line(format!("target = {}", array(&target.to_array())));
        self.document.line(format!("up = {}", array(&m.y_axis.to_array())));
        self.document.line(format!("fov = {}\nfov_axis = \"vertical\"", number(yfov.to_degrees())));
        Ok(())
    }

    fn light(&mut self, index: usize, name: Option<&str>, to_world: &DAffine3) -> Result<()> {
        let part = format!("KHR_lights_punctual.lights[{index}]");
        let Some(light) = self.data.root.extensions.lights.lights.get(index) else {
            return Err(self.data.error(&part, "there is none"));
        };
        let strength = color(light.color.map(|c| c * light.intensity));
        let (inner, outer) = (light.spot.inner_cone_angle, light.spot.outer_cone_angle);
        let position = to_world.translation;
        let forward = (-to_world.matrix3.z_axis).try_normalize().unwrap_or(DVec3::NEG_Z);
        let mut soft = false;
        let at = array(&position.to_array());
        let definition = match light.kind.as_str() {
            "point" => format!("point = {{ position = {at}, intensity = {strength} }}"),
            "directional" => {
                format!(
                    "directional = {{ direction = {}, irradiance = {strength} }}",
                    array(&forward.to_array())
                )
            }
            "spot" => {
                soft = inner < outer;
                let target = array(&(position + forward * position.length().max(1.0)).to_array());
                let (inner, outer) = (number(inner.to_degrees()), number(outer.to_degrees()));
                format!(
                    "spot = {{ position = {at}, target = {target}, intensity = {strength}, inner = {inner}, cutoff = {outer} }}"
                )
            }
            other => return Err(self.data.error(&part, format!("`{other}` is no kind of light"))),
        };
        if soft {
            self.warn(&part, "the spot's edge is a smooth step of the cosine here, not its square");
        }
        self.document.table(&Place::file(&self.data.path), "[[light]]");
        if let Some(name) = name {
            self.document.line(format!("name = {}", quoted(name)));
        }
        self.document.line(definition);
        Ok(())
    }

    fn mesh(&mut self, index: usize, name: Option<&str>, to_world: &DAffine3) -> Result<()> {
        let part = format!("meshes[{index}]");
        let Some(mesh) = self.data.root.meshes.get(index) else {
            return Err(self.data.error(&part, "there is none"));
        };
        let name = name.or(mesh.name.as_deref()).unwrap_or(&part).to_owned();
        for primitive in 0..self.data.root.meshes[index].primitives.len() {
            self.primitive(index, primitive, &name, to_world)?;
        }
        Ok(())
    }

    fn primitive(&mut self, mesh: usize, primitive: usize, name: &str, to_world: &DAffine3) -> Result<()> {
        let part = format!("meshes[{mesh}].primitives[{primitive}]");
        let mode = self.data.root.meshes[mesh].primitives[primitive].mode.unwrap_or(4);
        if mode < 4 {
            self.warn(&part, "points and lines are not rendered");
            return Ok(());
        }
        let material = self.material(self.data.root.meshes[mesh].primitives[primitive].material)?;
        let key = (mesh, primitive, material.tex_coord);
        let file = match self.meshes.get(&key) {
            Some(file) => file.clone(),
            None => {
                let triangles = self.triangles(&part, mesh, primitive, mode, material.tex_coord)?;
                let wish = self.data.root.meshes[mesh].name.clone().unwrap_or_else(|| format!("mesh-{mesh}"));
                let file = self.document.mesh(&wish, triangles);
                self.meshes.insert(key, file.clone());
                file
            }
        };
        self.document.table(&Place::file(&self.data.path), "[[shape]]");
        self.document.line(format!("name = {}\nmaterial = {}", quoted(name), quoted(&material.name)));
        self.document.line(format!("mesh = {{ file = {} }}", quoted(&file)));
        if *to_world != DAffine3::IDENTITY {
            let (m, t) = (to_world.matrix3, to_world.translation);
            let row = |i: usize| array(&[m.x_axis[i], m.y_axis[i], m.z_axis[i], t[i]]);
            self.document.line(format!("transform = [{{ matrix = [{}, {}, {}] }}]", row(0), row(1), row(2)));
        }
        if let Some(radiance) = material.emission {
            self.document.line(format!("emission = {}", color(radiance)));
        }
        if let Some(medium) = material.interior {
            self.document.line(format!("interior = {}", quoted(&medium)));
        }
        Ok(())
    }

    fn triangles(
        &mut self,
        part: &str,
        mesh: usize,
        primitive: usize,
        mode: u32,
        tex_coord: usize,
    ) -> Result<TriangleMesh> {
        let data = &self.data;
        let definition = &data.root.meshes[mesh].primitives[primitive];
        let attribute = |name: &str| definition.attributes.get(name).copied();
        let Some(positions) = attribute("POSITION") else {
            return Err(data.error(part, "it has no POSITION"));
        };
        let positions: Vec<Vec3> = data.vectors::<3>(part, positions)?.into_iter().map(Vec3::from).collect();
        let normals = match attribute("NORMAL") {
            Some(i) => Some(data.vectors::<3>(part, i)?.into_iter().map(Vec3::from).collect()),
            None => None,
        };
        let uvs = match attribute(&format!("TEXCOORD_{tex_coord}")) {
            Some(i) => Some(data.vectors::<2>(part, i)?.into_iter().map(Vec2::from).collect()),
            None => None,
        };
        let list = match definition.indices {
            Some(i) => data.indices(part, i)?,
            None => (0..positions.len() as u32).collect(),
        };
        let indices: Vec<[u32; 3]> = match mode {
            4 => list.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            // Every second triangle of a strip is turned.
            5 => (2..list.len())
                .map(|i| {
                    if i % 2 == 0 {
                        [list[i - 2], list[i - 1], list[i]]
                    } else {
                        [list[i - 1], list[i - 2], list[i]]
                    }
                })
                .collect(),
            6 => (2..list.len()).map(|i| [list[0], list[i - 1], list[i]]).collect(),
            other => return Err(data.error(part, format!("the mode {other} is not known"))),
        };
        let colored = attribute("COLOR_0").is_some();
        let mesh = TriangleMesh::new(positions, normals, uvs, indices).map_err(|e| data.error(part, e))?;
        if colored {
            self.warn(part, "colours of vertices are not looked at");
        }
        Ok(mesh)
    }
}
