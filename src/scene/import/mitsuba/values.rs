//! Values of properties: numbers, colours, transforms.

use super::tree::Element;
use crate::error::Result;
use crate::texture::load::srgb_to_linear;
use glam::{DAffine3, DMat3, DMat4, DVec3};

/// The numbers of a list, separated by commas or blanks.
pub fn numbers(element: &Element, text: &str) -> Result<Vec<f64>> {
    text.split(|c: char| c == ',' || c.is_whitespace())
        .filter(|word| !word.is_empty())
        .map(|word| one(element, word))
        .collect()
}

fn one(element: &Element, word: &str) -> Result<f64> {
    match word.trim().parse::<f64>() {
        Ok(x) if (x as f32).is_finite() => Ok(x),
        Ok(_) => Err(element.error(format!("`{word}` is not a finite number in single precision"))),
        Err(_) => Err(element.error(format!("`{word}` is not a number"))),
    }
}

impl Element {
    /// The number that it is.
    pub fn number(&self) -> Result<f64> {
        match self.tag.as_str() {
            "float" | "integer" => one(self, self.required("value")?),
            _ => Err(self.error(format!("expected a <float>, found <{}>", self.tag))),
        }
    }

    /// A number among the properties.
    pub fn number_or(&self, name: &str, default: f64) -> Result<f64> {
        self.property(name).map_or(Ok(default), |e| e.number())
    }

    /// A whole number among the properties.
    pub fn integer(&self, name: &str) -> Result<Option<i64>> {
        let Some(element) = self.property(name) else { return Ok(None) };
        let value = element.required("value")?;
        let number = value.trim().parse();
        number.map(Some).map_err(|_| element.error(format!("`{value}` is not a whole number")))
    }

    /// True or false among the properties.
    pub fn boolean_or(&self, name: &str, default: bool) -> Result<bool> {
        let Some(element) = self.property(name) else { return Ok(default) };
        match element.required("value")?.trim().to_ascii_lowercase().as_str() {
            "true" => Ok(true),
            "false" => Ok(false),
            other => Err(element.error(format!("`{other}` is neither true nor false"))),
        }
    }

    /// A text among the properties.
    pub fn string(&self, name: &str) -> Result<Option<&str>> {
        self.property(name).map(|e| e.required("value")).transpose()
    }

    /// A point or vector: `value="x, y, z"`, or `x`, `y` and `z`, each `default` where it is missing.
    pub fn triple(&self, default: f64) -> Result<DVec3> {
        if let Some(value) = self.attribute("value") {
            return match numbers(self, value)?[..] {
                [x, y, z] => Ok(DVec3::new(x, y, z)),
                ref other => Err(self.error(format!("expected three numbers, found {}", other.len()))),
            };
        }
        let mut triple = DVec3::splat(default);
        for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
            if let Some(value) = self.attribute(name) {
                triple[i] = one(self, value)?;
            }
        }
        Ok(triple)
    }

    /// A point or vector among the properties.
    pub fn point(&self, name: &str) -> Result<Option<DVec3>> {
        self.property(name).map(|e| e.triple(0.0)).transpose()
    }

    /// The colour that it is: linear RGB as it stands, as Mitsuba's RGB variants take it.
    pub fn color(&self) -> Result<[f64; 3]> {
        match self.tag.as_str() {
            "float" | "integer" => self.number().map(|x| [x; 3]),
            "rgb" => self.rgb(self.required("value")?.trim()),
            "spectrum" => {
                let value = self.required("value")?;
                match numbers(self, value) {
                    Ok(list) if list.len() == 1 => Ok([list[0]; 3]),
                    _ => Err(self.unsupported("a spectrum over wavelengths is not supported: give <rgb>")),
                }
            }
            tag => Err(self.unsupported(&format!("expected a colour such as <rgb>, found <{tag}>"))),
        }
    }

    fn rgb(&self, value: &str) -> Result<[f64; 3]> {
        if let Some(hex) = value.strip_prefix('#') {
            let bits = (hex.len() == 6).then(|| u32::from_str_radix(hex, 16).ok()).flatten();
            let bits =
                bits.ok_or_else(|| self.error(format!("`{value}` is not a colour such as #ff8000")))?;
            let channel = |shift: u32| f64::from(srgb_to_linear((bits >> shift & 0xff) as f32 / 255.0));
            return Ok([channel(16), channel(8), channel(0)]);
        }
        match numbers(self, value)?[..] {
            [grey] => Ok([grey; 3]),
            [r, g, b] => Ok([r, g, b]),
            ref other => Err(self.error(format!("expected one or three numbers, found {}", other.len()))),
        }
    }

    /// A colour among the properties.
    pub fn color_or(&self, name: &str, default: f64) -> Result<[f64; 3]> {
        self.property(name).map_or(Ok([default; 3]), |e| e.color())
    }

    /// A transform among the properties; none is the identity.
    pub fn transform(&self, name: &str) -> Result<DAffine3> {
        self.property(name).map_or(Ok(DAffine3::IDENTITY), |e| e.steps())
    }

    /// The steps of a transform; the first is applied first.
    fn steps(&self) -> Result<DAffine3> {
        if self.tag != "transform" {
            return Err(self.error(format!("expected a <transform>, found <{}>", self.tag)));
        }
        let mut whole = DAffine3::IDENTITY;
        for step in &self.children {
            whole = step.step()? * whole;
        }
        if !whole.is_finite() {
            return Err(self.error("these transforms together leave the range of numbers"));
        }
        Ok(whole)
    }

    fn step(&self) -> Result<DAffine3> {
        match self.tag.as_str() {
            "translate" => Ok(DAffine3::from_translation(self.triple(0.0)?)),
            "scale" => {
                let uniform = self.attribute("value").map(|v| numbers(self, v)).transpose()?;
                match uniform.as_deref() {
                    Some([s]) => Ok(DAffine3::from_scale(DVec3::splat(*s))),
                    _ => Ok(DAffine3::from_scale(self.triple(1.0)?)),
                }
            }
            "rotate" => {
                let angle = one(self, self.required("angle")?)?;
                let axis = self.triple(0.0)?;
                if axis.try_normalize().is_none() {
                    return Err(self.error("the rotation's axis has no length"));
                }
                Ok(DAffine3::from_mat3(turn(axis, angle.to_radians())))
            }
            "matrix" => {
                let list = numbers(self, self.required("value")?)?;
                match list.len() {
                    9 => {
                        let rows: [f64; 9] = std::array::from_fn(|i| list[i]);
                        Ok(DAffine3::from_mat3(DMat3::from_cols_array(&rows).transpose()))
                    }
                    16 if list[12..] == [0.0, 0.0, 0.0, 1.0] => {
                        let rows: [f64; 16] = std::array::from_fn(|i| list[i]);
                        Ok(DAffine3::from_mat4(DMat4::from_cols_array(&rows).transpose()))
                    }
                    16 => Err(self.error("the matrix's last row is not 0 0 0 1")),
                    n => Err(self.error(format!("a matrix of {n} numbers: expected 16 or 9, by rows"))),
                }
            }
            "lookat" => {
                let vector = |name| match numbers(self, self.required(name)?)?[..] {
                    [x, y, z] => Ok(DVec3::new(x, y, z)),
                    ref other => Err(self.error(format!("`{name}` has {} numbers, not three", other.len()))),
                };
                let (origin, target) = (vector("origin")?, vector("target")?);
                let up = if self.attribute("up").is_some() { vector("up")? } else { DVec3::Y };
                let forward = (target - origin).try_normalize();
                let left = forward.and_then(|f| up.try_normalize()?.cross(f).try_normalize().map(|l| (f, l)));
                let (forward, left) = left.ok_or_else(|| {
                    self.error("`lookat` needs a target apart from its origin, and an `up` across")
                })?;
                let matrix = DMat3::from_cols(left, forward.cross(left), forward);
                Ok(DAffine3::from_mat3_translation(matrix, origin))
            }
            tag => Err(self.error(format!("<{tag}> is no step of a transform"))),
        }
    }
}

/// Rodrigues' formula with the axis as it is. Mitsuba does not bring it to unit length either, and so stretches what it
/// turns about an axis of another.
pub(super) fn turn(axis: DVec3, angle: f64) -> DMat3 {
    let (sin, cos) = angle.sin_cos();
    let along = DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
    let across = DMat3::from_cols(axis.cross(DVec3::X), axis.cross(DVec3::Y), axis.cross(DVec3::Z));
    DMat3::from_diagonal(DVec3::splat(cos)) + across * sin + along * (1.0 - cos)
}
