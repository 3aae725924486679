//! BSDFs.
//!
//! Masks, blends and single sides nest in Mitsuba. Here they come down to a sum of materials by fixed weights, each
//! opaque one the same on both sides, or `sided`.

use super::super::numbers::{color, number, quoted};
use super::Translator;
use super::materials::{conductor, index};
use super::texture::{constant, entry, number_entry};
use super::tree::Element;
use crate::error::Result;
use std::rc::Rc;

/// A material of the scene file.
#[derive(Clone, Debug)]
pub(super) struct Translated {
    /// Its name.
    pub name: String,
    /// Whether it asks for texture coordinates.
    pub textured: bool,
    /// Whether light passes into what is behind.
    pub passes: bool,
}

/// What a material is a sum of.
#[derive(Clone, Debug)]
struct Part {
    weight: f64,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    /// Nothing at all.
    Null,
    /// A material, known by its name.
    Material(Translated),
}

/// The definition of a material that is no sum.
struct Definition {
    text: String,
    textured: bool,
    opaque: bool,
}

impl Translator<'_> {
    /// The material that a BSDF becomes.
    pub(super) fn material(&mut self, bsdf: &Rc<Element>) -> Result<Translated> {
        if let Some(known) = self.materials.get(&Rc::as_ptr(bsdf)) {
            return Ok(known.clone());
        }
        let parts = self.parts(bsdf, false, 1.0)?;
        let material = match &parts[..] {
            [Part { weight: 1.0, kind: Kind::Material(material) }] => material.clone(),
            [Part { kind: Kind::Null, .. }] => {
                let name = self.define(bsdf, "", "null = {}");
                Translated { name, textured: false, passes: true }
            }
            _ => self.sum(bsdf, parts)?,
        };
        self.materials.insert(Rc::as_ptr(bsdf), material.clone());
        Ok(material)
    }

    /// Writes a material; its name.
    fn define(&mut self, bsdf: &Element, suffix: &str, definition: &str) -> String {
        let wish = bsdf.attribute("id").or(bsdf.attribute("type")).unwrap_or("material");
        let name = self.document.name("material", &format!("{wish}{suffix}"));
        self.document.table(&bsdf.place, format!("[material.{}]", quoted(&name)));
        self.document.line(definition);
        name
    }

    fn sum(&mut self, bsdf: &Element, parts: Vec<Part>) -> Result<Translated> {
        let (mut layers, mut textured, mut passes) = (Vec::new(), false, false);
        for part in parts {
            let material = match part.kind {
                Kind::Null => {
                    let name = self.define(bsdf, "-through", "thin = { ior = 1.0 }");
                    Translated { name, textured: false, passes: true }
                }
                Kind::Material(material) => material,
            };
            textured |= material.textured;
            passes |= material.passes;
            layers.push(format!(
                "{{ material = {}, weight = {} }}",
                quoted(&material.name),
                number(part.weight)
            ));
        }
        let name = self.define(bsdf, "", &format!("layered = {{ layers = [{}] }}", layers.join(", ")));
        Ok(Translated { name, textured, passes })
    }

    /// What a BSDF is a sum of, times `weight`.
    fn parts(&mut self, bsdf: &Rc<Element>, two_sided: bool, weight: f64) -> Result<Vec<Part>> {
        match bsdf.kind()? {
            "null" => Ok(vec![Part { weight, kind: Kind::Null }]),
            "twosided" => self.two_sided(bsdf, weight),
            "mask" => {
                bsdf.only(&["opacity", "bsdf"])?;
                let opacity = self.share(bsdf, "opacity", Some(0.5))?;
                let inner = self.one_below(bsdf)?;
                let mut parts = Vec::new();
                if opacity > 0.0 {
                    parts.extend(self.parts(&inner, two_sided, weight * opacity)?);
                }
                if opacity < 1.0 {
                    parts.push(Part { weight: weight * (1.0 - opacity), kind: Kind::Null });
                }
                Ok(parts)
            }
            "blendbsdf" => {
                let share = self.share(bsdf, "weight", None)?;
                let inner = self.below(bsdf, "bsdf")?;
                let [first, second] = &inner[..] else {
                    return Err(bsdf.error(format!("a blend of {} BSDFs: it takes two", inner.len())));
                };
                let mut parts = Vec::new();
                if share < 1.0 {
                    parts.extend(self.parts(first, two_sided, weight * (1.0 - share))?);
                }
                if share > 0.0 {
                    parts.extend(self.parts(second, two_sided, weight * share)?);
                }
                Ok(parts)
            }
            _ => {
                let material = self.single(bsdf, two_sided)?;
                Ok(vec![Part { weight, kind: Kind::Material(material) }])
            }
        }
    }

    /// One BSDF for both sides, or one for each.
    fn two_sided(&mut self, bsdf: &Rc<Element>, weight: f64) -> Result<Vec<Part>> {
        let inner = self.below(bsdf, "bsdf")?;
        match &inner[..] {
            [both] => self.parts(both, true, weight),
            [front, back] => {
                let (front, back) = (self.face(front)?, self.face(back)?);
                let text =
                    format!("sided = {{ front = {}, back = {} }}", quoted(&front.name), quoted(&back.name));
                let name = self.define(bsdf, "", &text);
                let textured = front.textured || back.textured;
                let material = Translated { name, textured, passes: false };
                Ok(vec![Part { weight, kind: Kind::Material(material) }])
            }
            _ => Err(bsdf.error(format!("twosided with {} BSDFs: it takes one or two", inner.len()))),
        }
    }

    /// The material of one side.
    fn face(&mut self, bsdf: &Rc<Element>) -> Result<Translated> {
        let definition = self.definition(bsdf)?;
        if !definition.opaque {
            return Err(bsdf.unsupported("a side has to be opaque"));
        }
        let name = self.define(bsdf, "", &definition.text);
        Ok(Translated { name, textured: definition.textured, passes: false })
    }

    /// A BSDF that is no sum.
    fn single(&mut self, bsdf: &Rc<Element>, two_sided: bool) -> Result<Translated> {
        let Definition { text, textured, opaque } = self.definition(bsdf)?;
        if two_sided && !opaque {
            return Err(bsdf.error("light passes it: it cannot be `twosided`"));
        }
        if !opaque || two_sided {
            let name = self.define(bsdf, "", &text);
            return Ok(Translated { name, textured, passes: !opaque });
        }
        let front = self.define(bsdf, "-front", &text);
        let name = self.define(bsdf, "", &format!("sided = {{ front = {} }}", quoted(&front)));
        Ok(Translated { name, textured, passes: false })
    }

    fn one_below(&self, bsdf: &Element) -> Result<Rc<Element>> {
        let inner = self.below(bsdf, "bsdf")?;
        match &inner[..] {
            [one] => Ok(one.clone()),
            _ => Err(bsdf.error(format!("{} BSDFs inside, where there has to be one", inner.len()))),
        }
    }

    /// A share from 0 to 1 that is the same everywhere.
    fn share(&self, bsdf: &Element, name: &str, default: Option<f64>) -> Result<f64> {
        let share = match (self.property(bsdf, name)?, default) {
            (Some(value), _) if value.tag == "texture" => {
                return Err(value.unsupported(&format!("only a constant `{name}` is supported")));
            }
            (Some(value), _) => match value.color()? {
                [r, g, b] if r == g && g == b => r,
                _ => return Err(value.unsupported(&format!("a coloured `{name}` is not supported"))),
            },
            (None, Some(default)) => default,
            (None, None) => return Err(bsdf.error(format!("it has no `{name}`"))),
        };
        match (0.0..=1.0).contains(&share) {
            true => Ok(share),
            false => Err(bsdf.error(format!("`{name}` is {share}, not from 0 to 1"))),
        }
    }

    fn definition(&mut self, bsdf: &Rc<Element>) -> Result<Definition> {
        match bsdf.kind()? {
            "diffuse" => {
                bsdf.only(&["reflectance"])?;
                let reflectance = self.albedo(bsdf, "reflectance")?;
                let textured = reflectance.as_ref().is_some_and(|r| r.1);
                let text = reflectance.map_or("0.5".into(), |r| r.0);
                Ok(Definition {
                    text: format!("diffuse = {{ reflectance = {text} }}"),
                    textured,
                    opaque: true,
                })
            }
            "dielectric" | "roughdielectric" | "thindielectric" => self.dielectric(bsdf),
            "conductor" | "roughconductor" => self.conductor(bsdf),
            "plastic" | "roughplastic" => self.plastic(bsdf),
            _ => Err(bsdf.unsupported("this kind of BSDF is not supported")),
        }
    }

    /// The entries of a rough surface, with the masking that Mitsuba has; none for a smooth one.
    fn roughness(&self, bsdf: &Element) -> Result<String> {
        if !bsdf.kind()?.starts_with("rough") {
            return Ok(String::new());
        }
        let distribution = match bsdf.string("distribution")?.unwrap_or("beckmann") {
            "beckmann" => ", distribution = \"beckmann\"",
            "ggx" => "",
            other => {
                let place = bsdf.property("distribution").map_or(bsdf, |d| d);
                let message = format!("there is no distribution `{other}`: it is `beckmann` or `ggx`");
                return Err(place.unsupported(&message));
            }
        };
        let alpha = constant(bsdf, "alpha", 0.1)?;
        let (u, v) = (constant(bsdf, "alpha_u", alpha)?, constant(bsdf, "alpha_v", alpha)?);
        if u != v {
            return Err(bsdf.unsupported("`alpha_u` and `alpha_v` differ: anisotropy is not supported"));
        }
        Ok(match u {
            0.0 => String::new(),
            _ => format!("{}{distribution}, masking = \"separable\"", number_entry("roughness", u, 0.0)),
        })
    }

    fn dielectric(&mut self, bsdf: &Element) -> Result<Definition> {
        bsdf.only(&[
            "int_ior",
            "ext_ior",
            "specular_reflectance",
            "specular_transmittance",
            "distribution",
            "alpha",
            "alpha_u",
            "alpha_v",
            "sample_visible",
        ])?;
        let (inside, outside) = (index(bsdf, "int_ior", "bk7")?, index(bsdf, "ext_ior", "air")?);
        let reflectance = self.albedo(bsdf, "specular_reflectance")?;
        let transmittance = self.albedo(bsdf, "specular_transmittance")?;
        let kind = if bsdf.kind()? == "thindielectric" { "thin" } else { "dielectric" };
        let text = format!(
            "{kind} = {{ ior = {}, exterior_ior = {}{}{}{} }}",
            number(inside),
            number(outside),
            self.roughness(bsdf)?,
            entry("reflectance", &reflectance),
            entry("transmittance", &transmittance)
        );
        let textured = [reflectance, transmittance].iter().flatten().any(|t| t.1);
        Ok(Definition { text, textured, opaque: false })
    }

    fn conductor(&mut self, bsdf: &Element) -> Result<Definition> {
        bsdf.only(&[
            "material",
            "eta",
            "k",
            "specular_reflectance",
            "distribution",
            "alpha",
            "alpha_u",
            "alpha_v",
            "sample_visible",
            "ext_eta",
        ])?;
        let tint = self.albedo(bsdf, "specular_reflectance")?;
        let own = (self.property(bsdf, "eta")?, self.property(bsdf, "k")?);
        let index = match (bsdf.property("material"), own) {
            (Some(material), (None, None)) => match material.required("value")? {
                "none" => None,
                name => Some(conductor(material, name)?),
            },
            (None, (Some(eta), Some(k))) => Some((eta.color()?, k.color()?)),
            (None, (None, None)) => None,
            _ => return Err(bsdf.error("a conductor has either a `material`, or both `eta` and `k`")),
        };
        let outside = match bsdf.property("ext_eta") {
            Some(_) => super::materials::index(bsdf, "ext_eta", "vacuum")?,
            None => 1.0,
        };
        let rough = self.roughness(bsdf)?;
        let textured = tint.as_ref().is_some_and(|t| t.1);
        let text = match index {
            Some((eta, k)) => {
                let over = |c: [f64; 3]| color(c.map(|x| x / outside));
                let tint = entry("reflectance", &tint);
                format!("conductor = {{ eta = {}, k = {}{rough}{tint} }}", over(eta), over(k))
            }
            None => {
                let tint = tint.map_or("1.0".into(), |t| t.0);
                format!("conductor = {{ reflectance = {tint}{rough} }}")
            }
        };
        Ok(Definition { text, textured, opaque: true })
    }

    fn plastic(&mut self, bsdf: &Element) -> Result<Definition> {
        bsdf.only(&[
            "diffuse_reflectance",
            "specular_reflectance",
            "nonlinear",
            "int_ior",
            "ext_ior",
            "distribution",
            "alpha",
            "sample_visible",
        ])?;
        let (inside, outside) = (index(bsdf, "int_ior", "polypropylene")?, index(bsdf, "ext_ior", "air")?);
        let diffuse = self.albedo(bsdf, "diffuse_reflectance")?;
        let specular = self.albedo(bsdf, "specular_reflectance")?;
        let nonlinear = if bsdf.boolean_or("nonlinear", false)? { ", nonlinear = true" } else { "" };
        let text = format!(
            "plastic = {{ ior = {}, exterior_ior = {}{}{}{}{nonlinear} }}",
            number(inside),
            number(outside),
            self.roughness(bsdf)?,
            entry("diffuse", &diffuse),
            entry("specular", &specular)
        );
        let textured = [diffuse, specular].iter().flatten().any(|t| t.1);
        Ok(Definition { text, textured, opaque: true })
    }
}
