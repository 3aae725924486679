//! Colours that vary over a surface.

use super::super::numbers::{array, color, number, quoted};
use super::tree::Element;
use super::{Translator, file_of};
use crate::error::Result;
use glam::DAffine3;
use std::rc::Rc;

impl Translator<'_> {
    /// A reflectance, as an entry of a material, and whether it varies. `None` where the element does not have it.
    pub(super) fn albedo(&mut self, element: &Element, name: &str) -> Result<Option<(String, bool)>> {
        let Some(value) = self.property(element, name)? else { return Ok(None) };
        match value.tag.as_str() {
            "texture" => Ok(Some((quoted(&self.texture(&value)?), true))),
            _ => Ok(Some((color(value.color()?), false))),
        }
    }

    /// The name of a texture.
    fn texture(&mut self, texture: &Rc<Element>) -> Result<String> {
        if let Some(name) = self.textures.get(&Rc::as_ptr(texture)) {
            return Ok(name.clone());
        }
        let definition = match texture.kind()? {
            "bitmap" => self.bitmap(texture)?,
            "checkerboard" => {
                texture.only(&["color0", "color1", "to_uv"])?;
                let (even, odd) = (texture.color_or("color0", 0.4)?, texture.color_or("color1", 0.2)?);
                let mut checker = format!("even = {}, odd = {}, squares = [2, 2]", color(even), color(odd));
                let to_uv = texture.transform("to_uv")?;
                if to_uv != DAffine3::IDENTITY {
                    checker.push_str(&format!(", uv = {}", uv(&to_uv, false)));
                }
                format!("checker = {{ {checker} }}")
            }
            _ => return Err(texture.unsupported("only bitmap and checkerboard are supported")),
        };
        let name = self.document.name("texture", texture.attribute("id").unwrap_or(texture.kind()?));
        self.document.table(&texture.place, format!("[texture.{}]", quoted(&name)));
        self.document.line(definition);
        self.textures.insert(Rc::as_ptr(texture), name.clone());
        Ok(name)
    }

    fn bitmap(&mut self, texture: &Element) -> Result<String> {
        texture.only(&["filename", "raw", "filter_type", "wrap_mode", "to_uv", "accel", "format"])?;
        match texture.string("filter_type")? {
            None | Some("bilinear") => {}
            Some(other) => return Err(texture.unsupported(&format!("the filter `{other}` is not supported"))),
        }
        let wrap = match texture.string("wrap_mode")?.unwrap_or("repeat") {
            "repeat" => "",
            "clamp" => ", wrap = \"clamp\"",
            other => return Err(texture.unsupported(&format!("the wrap mode `{other}` is not supported"))),
        };
        let encoding = if texture.boolean_or("raw", false)? { ", encoding = \"linear\"" } else { "" };
        let path = file_of(self.tree, texture)?;
        let file = quoted(&self.document.file(&path));
        let rows = uv(&texture.transform("to_uv")?, true);
        Ok(format!("image = {{ file = {file}{encoding}{wrap}, uv = {rows} }}"))
    }
}

/// The rows of a map of texture coordinates; with `down`, to those of a picture whose v goes down.
fn uv(to_uv: &DAffine3, down: bool) -> String {
    let row = |i: usize| [to_uv.matrix3.x_axis[i], to_uv.matrix3.y_axis[i], to_uv.translation[i]];
    let (u, mut v) = (row(0), row(1));
    if down {
        v = [-v[0], -v[1], 1.0 - v[2]];
    }
    format!("[{}, {}]", array(&u), array(&v))
}

/// A number among the properties that has to be the same everywhere.
pub(super) fn constant(element: &Element, name: &str, default: f64) -> Result<f64> {
    match element.property(name) {
        Some(value) if matches!(value.tag.as_str(), "texture" | "ref") => {
            Err(value.unsupported("only a constant is supported here"))
        }
        Some(value) => value.number(),
        None => Ok(default),
    }
}

/// `, key = value` where there is a value.
pub(super) fn entry(key: &str, value: &Option<(String, bool)>) -> String {
    value.as_ref().map_or(String::new(), |(text, _)| format!(", {key} = {text}"))
}

/// `, key = value` where it is not the default.
pub(super) fn number_entry(key: &str, value: f64, default: f64) -> String {
    if value == default { String::new() } else { format!(", {key} = {}", number(value)) }
}
