//! Media and phase functions.

use super::super::Place;
use super::super::numbers::{color, number, quoted};
use super::Translator;
use super::tree::Element;
use super::volume::{self, Field};
use crate::error::Result;
use glam::DVec3;
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

/// Lines of a medium, with where they come from.
type Lines = Vec<(Place, String)>;

impl Translator<'_> {
    /// The name of a medium.
    pub(super) fn medium(&mut self, medium: &Rc<Element>) -> Result<String> {
        if let Some(name) = self.media.get(&Rc::as_ptr(medium)) {
            return Ok(name.clone());
        }
        medium.only(&MEDIUM)?;
        let (lines, corners) = match medium.kind()? {
            "homogeneous" => (self.homogeneous(medium)?, None),
            "heterogeneous" => self.heterogeneous(medium).map(|(lines, corners)| (lines, Some(corners)))?,
            _ => return Err(medium.unsupported("only homogeneous and heterogeneous media are supported")),
        };
        let scale = medium.number_or("scale", 1.0)?;
        let phase = match self.below(medium, "phase")?.first() {
            Some(phase) => self.phase(phase, corners.as_ref())?,
            None => quoted("isotropic"),
        };
        let name = self.document.name("medium", medium.attribute("id").unwrap_or("medium"));
        self.document.table(&medium.place, format!("[medium.{}]", quoted(&name)));
        for (place, line) in lines {
            self.document.at(&place);
            self.document.line(line);
        }
        self.document.at(&medium.place);
        if scale != 1.0 {
            self.document.line(format!("scale = {}", number(scale)));
        }
        self.document.line(format!("phase = {phase}"));
        self.media.insert(Rc::as_ptr(medium), name.clone());
        Ok(name)
    }

    /// The coefficients of a medium that is the same everywhere.
    fn homogeneous(&self, medium: &Element) -> Result<Lines> {
        let sigma_t = self.constant(medium, "sigma_t", 1.0)?;
        let albedo = self.constant(medium, "albedo", 0.75)?;
        let coefficients = format!("sigma_t = {}\nalbedo = {}", color(sigma_t), color(albedo));
        Ok(vec![(medium.place.clone(), coefficients)])
    }

    /// The coefficients of a medium that varies, and the corners of where it is. Extinction that is the same everywhere is
    /// so in its volume's box: the unit cube, where nothing places it.
    fn heterogeneous(&mut self, medium: &Rc<Element>) -> Result<(Lines, [DVec3; 8])> {
        let own = medium.place.clone();
        let extinction = Field::of(self, medium, "sigma_t", 1.0)?;
        let corners = extinction.corners();
        let mut lines = match extinction {
            Field::Constant(sigma_t, bounds) => {
                let grid = self.solid_box(&bounds);
                vec![(own, format!("sigma_t = {}\ndensity = {{ grid = {grid} }}", color(sigma_t)))]
            }
            Field::Grid(grid) => {
                self.refuse_spill(medium, &grid)?;
                match grid.channels {
                    1 => vec![
                        (own, "sigma_t = 1".into()),
                        (grid.place, format!("density = {{ grid = {} }}", grid.entry)),
                    ],
                    _ => vec![(grid.place, format!("sigma_t_grid = {}", grid.entry))],
                }
            }
        };
        lines.push(match Field::of(self, medium, "albedo", 0.75)? {
            Field::Constant(albedo, _) => (medium.place.clone(), format!("albedo = {}", color(albedo))),
            Field::Grid(grid) => {
                let entry = format!("albedo_grid = {}", grid.covering(&corners)?);
                (grid.place, entry)
            }
        });
        Ok((lines, corners))
    }

    /// A coefficient that is the same everywhere: a colour, or a volume of one.
    fn constant(&self, medium: &Element, name: &str, default: f64) -> Result<[f64; 3]> {
        let Some(value) = self.property(medium, name)? else { return Ok([default; 3]) };
        match (value.tag.as_str(), value.attribute("type")) {
            ("volume", Some("constvolume")) => volume::constant(&value),
            ("volume", Some("gridvolume")) => {
                Err(value.unsupported("a grid in a homogeneous medium: make the medium heterogeneous"))
            }
            ("volume", _) => Err(value.unsupported("only constvolume is supported")),
            _ => value.color(),
        }
    }

    /// A phase function, as an entry of a medium; `corners`: of where a medium is that varies.
    fn phase(&mut self, phase: &Element, corners: Option<&[DVec3; 8]>) -> Result<String> {
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
            "blendphase" => self.blend(phase, corners),
            _ => Err(phase.unsupported("only isotropic, hg, rayleigh and blendphase are supported")),
        }
    }

    fn blend(&mut self, phase: &Element, corners: Option<&[DVec3; 8]>) -> Result<String> {
        let weight = self.property(phase, "weight")?;
        let weight = weight.ok_or_else(|| phase.error("a blendphase without a `weight`"))?;
        let parts = self.below(phase, "phase")?;
        let [first, second] = &parts[..] else {
            return Err(phase.error(format!("a blendphase of {} phase functions: it takes two", parts.len())));
        };
        let (first, second) = (self.phase(first, corners)?, self.phase(second, corners)?);
        let share = match Field::of(self, phase, "weight", 0.0)? {
            Field::Constant([share, green, blue], _) if share == green && share == blue => share,
            Field::Constant(..) => return Err(weight.unsupported("a weight of colours is not supported")),
            Field::Grid(grid) => {
                let Some(corners) = corners else {
                    return Err(weight.unsupported("a grid needs a heterogeneous medium"));
                };
                if grid.channels != 1 {
                    return Err(weight.unsupported("a weight of colours is not supported"));
                }
                let grid = grid.covering(corners)?;
                return Ok(format!(
                    "{{ by_place = {{ first = {first}, second = {second}, share = {grid} }} }}"
                ));
            }
        };
        if !(0.0..=1.0).contains(&share) {
            return Err(weight.error(format!("the weight {share} is not from 0 to 1")));
        }
        let part = |share: f64, text: &str| format!("{{ weight = {}, phase = {text} }}", number(share));
        Ok(match share {
            0.0 => first,
            1.0 => second,
            _ => format!("{{ mixture = [{}, {}] }}", part(1.0 - share, &first), part(share, &second)),
        })
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
