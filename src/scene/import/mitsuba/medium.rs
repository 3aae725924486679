//! Media and phase functions.

use super::super::numbers::{color, number, quoted};
use super::Translator;
use super::tree::Element;
use crate::error::Result;
use std::rc::Rc;

const MEDIUM: [&str; 7] = [
    "albedo",
    "sigma_t",
    "scale",
    "sample_emitters",
    "has_spectral_extinction",
    "phase",
    "majorant_resolution_factor",
];

impl Translator<'_> {
    /// The name of a medium.
    pub(super) fn medium(&mut self, medium: &Rc<Element>) -> Result<String> {
        if let Some(name) = self.media.get(&Rc::as_ptr(medium)) {
            return Ok(name.clone());
        }
        medium.only(&MEDIUM)?;
        if !matches!(medium.kind()?, "homogeneous" | "heterogeneous") {
            return Err(medium.unsupported("only homogeneous and heterogeneous media are supported"));
        }
        if medium.kind()? == "heterogeneous"
            && let Some(volume) = self.property(medium, "sigma_t")?
            && volume.attribute("type") == Some("constvolume")
        {
            return Err(volume.unsupported("a constvolume in a heterogeneous medium fills a unit cube alone: make the medium homogeneous"));
        }
        let sigma_t = self.constant(medium, "sigma_t", 1.0)?;
        let albedo = self.constant(medium, "albedo", 0.75)?;
        let scale = medium.number_or("scale", 1.0)?;
        let phase = match self.below(medium, "phase")?.first() {
            Some(phase) => self.phase(phase)?,
            None => quoted("isotropic"),
        };
        let name = self.document.name("medium", medium.attribute("id").unwrap_or("medium"));
        self.document.table(&medium.place, format!("[medium.{}]", quoted(&name)));
        self.document.line(format!("sigma_t = {}\nalbedo = {}", color(sigma_t), color(albedo)));
        if scale != 1.0 {
            self.document.line(format!("scale = {}", number(scale)));
        }
        self.document.line(format!("phase = {phase}"));
        self.media.insert(Rc::as_ptr(medium), name.clone());
        Ok(name)
    }

    /// A coefficient that is the same everywhere: a colour, or a volume of one.
    fn constant(&self, medium: &Element, name: &str, default: f64) -> Result<[f64; 3]> {
        let Some(value) = self.property(medium, name)? else { return Ok([default; 3]) };
        if value.tag != "volume" {
            return value.color();
        }
        match value.kind()? {
            "constvolume" => match value.property("value") {
                Some(inner) => inner.color(),
                None => Err(value.error("a constvolume without a `value`")),
            },
            "gridvolume" => Err(value.unsupported("grids are not read from scenes of Mitsuba yet")),
            _ => Err(value.unsupported("only constvolume is supported")),
        }
    }

    /// A phase function, as an entry of a medium.
    fn phase(&self, phase: &Element) -> Result<String> {
        match phase.kind()? {
            "isotropic" => Ok(quoted("isotropic")),
            "rayleigh" => Ok(quoted("rayleigh")),
            "hg" => {
                phase.only(&["g"])?;
                match phase.number_or("g", 0.8)? {
                    0.0 => Ok(quoted("isotropic")),
                    g => Ok(format!("{{ hg = {} }}", number(g))),
                }
            }
            "blendphase" => {
                let weight = self.property(phase, "weight")?;
                let weight = weight.ok_or_else(|| phase.error("a blendphase without a `weight`"))?;
                let share =
                    weight.number().map_err(|_| weight.unsupported("only a constant weight is supported"))?;
                if !(0.0..=1.0).contains(&share) {
                    return Err(weight.error(format!("the weight {share} is not from 0 to 1")));
                }
                let parts = self.below(phase, "phase")?;
                let [first, second] = &parts[..] else {
                    return Err(
                        phase.error(format!("a blendphase of {} phase functions: it takes two", parts.len()))
                    );
                };
                let part =
                    |share: f64, text: String| format!("{{ weight = {}, phase = {text} }}", number(share));
                match (self.phase(first)?, self.phase(second)?) {
                    (first, _) if share == 0.0 => Ok(first),
                    (_, second) if share == 1.0 => Ok(second),
                    (first, second) => {
                        let (first, second) = (part(1.0 - share, first), part(share, second));
                        Ok(format!("{{ mixture = [{first}, {second}] }}"))
                    }
                }
            }
            _ => Err(phase.unsupported("only isotropic, hg, rayleigh and blendphase are supported")),
        }
    }

    /// The medium on a side of a shape: `interior` or `exterior`.
    pub(super) fn side(&self, shape: &Element, side: &str) -> Result<Option<Rc<Element>>> {
        let Some(medium) = self.property(shape, side)? else { return Ok(None) };
        match medium.tag.as_str() {
            "medium" => Ok(Some(medium)),
            tag => Err(medium.error(format!("`{side}` is a <{tag}>, not a medium"))),
        }
    }

    /// The medium about all shapes. Mitsuba says on both sides of each surface what is there; here solids have what is
    /// inside, and the world has the rest: the medium that is outside of some shape, or about the camera, and inside
    /// of none.
    pub(super) fn world_medium(
        &self,
        sensor: &Element,
        shapes: &[Rc<Element>],
    ) -> Result<Option<Rc<Element>>> {
        let mut inside = Vec::new();
        for shape in shapes {
            inside.extend(self.side(shape, "interior")?);
        }
        let is_inside = |m: &Rc<Element>| inside.iter().any(|i| Rc::ptr_eq(i, m));
        let mut world: Option<Rc<Element>> = self.property(sensor, "medium")?.filter(|m| !is_inside(m));
        for shape in shapes {
            let Some(outside) = self.side(shape, "exterior")?.filter(|m| !is_inside(m)) else { continue };
            match &world {
                Some(known) if !Rc::ptr_eq(known, &outside) => {
                    return Err(shape.unsupported("two media that are outside of shapes and inside of none"));
                }
                _ => world = Some(outside),
            }
        }
        // A shape that is filled and stands in nothing would stand in that medium here.
        if world.is_some() {
            for shape in shapes {
                if self.side(shape, "interior")?.is_some() && self.side(shape, "exterior")?.is_none() {
                    return Err(shape.unsupported("it has nothing outside where other shapes have a medium"));
                }
            }
        }
        Ok(world)
    }
}
