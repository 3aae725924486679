//! Mitsuba 3's XML.
//!
//! Conventions that differ from ours: a camera looks along its +z and has +x to the left; surfaces reflect on one side
//! unless `twosided` (ours on both, unless `sided`); v = 0 is a picture's upper edge; rough surfaces have separable
//! masking; indices of refraction have names, and glass is in air of index 1.000277; media belong to the two sides of a
//! surface (ours to solids, and to the world). Colours are what the RGB variants of Mitsuba make of them.

mod bsdf;
mod emitter;
mod materials;
mod medium;
mod sensor;
mod shape;
#[cfg(test)]
mod tests;
mod texture;
mod tree;
mod values;
mod volume;

use super::numbers::array;
use super::{Document, Imported};
use crate::error::{Error, Result, nearest};
use crate::transport::settings::MAX_LENGTH;
use glam::DAffine3;
use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;
use tree::{Element, Tree};

/// Kinds of elements below the scene that are translated where something refers to them.
const REFERRED: [&str; 6] = ["bsdf", "medium", "phase", "texture", "volume", "film"];

/// Translates a scene.
///
/// # Errors
/// With the line and column of the element that cannot be read, or not be rendered as it is meant.
pub fn read(path: &Path) -> Result<Imported> {
    let tree = Tree::read(path)?;
    let mut document = Document::new(path);
    for file in &tree.files {
        document.read_file(file);
    }
    let mut translator = Translator {
        tree: &tree,
        document,
        materials: HashMap::new(),
        media: HashMap::new(),
        textures: HashMap::new(),
        world: None,
    };
    translator.scene()?;
    Ok(translator.document.finish())
}

/// What has been translated so far. Elements are known by their address: the tree does not change.
struct Translator<'a> {
    tree: &'a Tree,
    document: Document,
    materials: HashMap<*const Element, bsdf::Translated>,
    media: HashMap<*const Element, String>,
    textures: HashMap<*const Element, String>,
    /// The medium about all shapes.
    world: Option<Rc<Element>>,
}

impl<'a> Translator<'a> {
    fn scene(&mut self) -> Result<()> {
        let root = self.tree.root.clone();
        self.warn_of_version(&root);
        let of = |tag: &str| root.children.iter().filter(|c| c.tag == tag).cloned().collect::<Vec<_>>();
        let (sensors, shapes) = (of("sensor"), of("shape"));
        let Some(sensor) = sensors.first() else {
            return Err(root.error("the scene has no <sensor>: there is nothing to see it with"));
        };
        if let Some(second) = sensors.get(1) {
            self.document.warn(&second.place, "of several sensors the first is rendered");
        }
        self.world = self.world_medium(sensor, &shapes)?;
        self.integrator(&of("integrator"))?;
        self.sensor(sensor)?;
        if let Some(world) = self.world.clone() {
            let name = self.medium(&world)?;
            self.document.table(&world.place, "[world]");
            self.document.line(format!("medium = {}", super::numbers::quoted(&name)));
        }
        for child in &root.children {
            match child.tag.as_str() {
                "shape" => self.shape(child)?,
                "emitter" => self.emitter(child)?,
                "sensor" | "integrator" => {}
                tag if REFERRED.contains(&tag) => {}
                "ref" | "string" | "float" | "integer" | "boolean" | "alias" => {}
                tag => {
                    let known = ["shape", "emitter", "sensor", "integrator"].into_iter().chain(REFERRED);
                    let hint =
                        nearest(tag, known).map_or(String::new(), |m| format!("; did you mean <{m}>?"));
                    return Err(child.error(format!("<{tag}> is not an element of a scene{hint}")));
                }
            }
        }
        Ok(())
    }

    fn warn_of_version(&mut self, root: &Element) {
        let version = root.attribute("version").unwrap_or("none");
        if !version.starts_with("3.") {
            let message = format!("version {version} of the format: it is read as one of Mitsuba 3");
            self.document.warn(&root.place, message);
        }
    }

    fn integrator(&mut self, integrators: &[Rc<Element>]) -> Result<()> {
        let Some(integrator) = integrators.first() else { return Ok(()) };
        let mut depth = integrator.integer("max_depth")?.unwrap_or(-1);
        match integrator.kind()? {
            "path" | "volpath" | "volpathmis" | "ptracer" | "prb" | "prbvolpath" | "prb_basic" => {}
            "direct" => depth = 2,
            _ => {
                return Err(
                    integrator.unsupported("only integrators of all light paths can be compared with")
                );
            }
        }
        if integrator.boolean_or("hide_emitters", false)? {
            return Err(integrator.unsupported("`hide_emitters` is not supported: lights are seen"));
        }
        if depth == 0 || depth < -1 {
            return Err(integrator.error(format!("a `max_depth` of {depth} leaves no path")));
        }
        let longest = u32::try_from(depth).map_or(MAX_LENGTH, |d| d.min(MAX_LENGTH));
        self.document.table(&integrator.place, "[render]");
        self.document.line(format!("max_length = {longest}"));
        Ok(())
    }

    /// The elements of the kind `tag` below another, and those that are referred to.
    fn below(&self, element: &Element, tag: &str) -> Result<Vec<Rc<Element>>> {
        let mut found = Vec::new();
        for child in &element.children {
            let target = self.tree.resolve(child)?;
            if target.tag == tag {
                found.push(target.clone());
            }
        }
        Ok(found)
    }

    /// The property `name`, or what it refers to.
    fn property(&self, element: &Element, name: &str) -> Result<Option<Rc<Element>>> {
        element.property(name).map(|e| self.tree.resolve(e).cloned()).transpose()
    }
}

/// A transform as a list of steps of ours; empty for the identity.
fn steps(to_world: &DAffine3) -> Option<String> {
    (*to_world != DAffine3::IDENTITY).then(|| format!("[{{ matrix = {} }}]", matrix(to_world)))
}

/// The rows of a matrix.
fn matrix(m: &DAffine3) -> String {
    let rows: Vec<String> = (0..3)
        .map(|i| array(&[m.matrix3.x_axis[i], m.matrix3.y_axis[i], m.matrix3.z_axis[i], m.translation[i]]))
        .collect();
    format!("[{}]", rows.join(", "))
}

/// The file that an element names, with where it is.
fn file_of(tree: &Tree, element: &Element) -> Result<std::path::PathBuf> {
    let Some(name) = element.property("filename") else {
        return Err(element.error(format!("this {} has no `filename`", element.tag)));
    };
    tree.find(name, name.required("value")?)
}

/// An error in a file that is referred to, with the place of the reference.
fn used_at(element: &Element, error: Error) -> Error {
    match error {
        Error::File { path, place, message } => {
            let at = &element.place;
            let message = format!("{message} (used at {}:{}:{})", at.path.display(), at.line, at.column);
            Error::File { path, place, message }
        }
        other => other,
    }
}
