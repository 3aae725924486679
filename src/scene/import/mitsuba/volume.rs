//! Volumes: what the coefficients of a heterogeneous medium are by place.
//!
//! A `gridvolume` has its values in the middle of voxels, as our grids do, and what is trilinear or nearest there is
//! trilinear or constant here. The differences are outside of a grid's box. Extinction ends at the box *along the axes* that
//! holds the grid's box, and everything else nowhere: up to there the values at the rim go on. So where a grid's box is
//! turned against the axes, or a grid does not cover the medium, what is beyond it must not matter, or is refused.

use super::super::Place;
use super::super::numbers::{array, quoted};
use super::tree::Element;
use super::{Translator, file_of, steps, used_at};
use crate::error::Result;
use crate::geometry::TriangleMesh;
use crate::medium::volume::{self, Volume, own};
use glam::{DAffine3, DMat3, DVec3, UVec3};
use std::rc::Rc;

/// So far beyond a box, as a share of it, is still within: what rounding makes of a shape that fills it.
const SLACK: f64 = 1e-4;

/// What there is at a point of a medium.
pub(super) enum Field {
    /// The same everywhere in a box along the axes: its corners.
    Constant([f64; 3], [DVec3; 2]),
    /// Values of a file.
    Grid(Grid),
}

/// A grid of a file at its place.
pub(super) struct Grid {
    /// Where the scene has it.
    pub place: Place,
    /// The inline table of a scene file of ours that is this grid.
    pub entry: String,
    /// Numbers a value.
    pub channels: usize,
    /// From its box, as the unit cube, to the world.
    from_unit: DAffine3,
    /// Whether there is anything in the outermost voxels.
    rim: bool,
}

impl Field {
    /// A property of a medium or a phase function, which is `default` where it is missing.
    pub fn of(translator: &mut Translator, owner: &Element, name: &str, default: f64) -> Result<Self> {
        let unit = || [DVec3::ZERO, DVec3::ONE];
        let Some(value) = translator.property(owner, name)? else {
            return Ok(Self::Constant([default; 3], unit()));
        };
        if value.tag != "volume" {
            return Ok(Self::Constant(value.color()?, unit()));
        }
        match value.kind()? {
            "constvolume" => Ok(Self::Constant(constant(&value)?, bounds(&value.transform("to_world")?))),
            "gridvolume" => Grid::of(translator, &value).map(Self::Grid),
            _ => Err(value.unsupported("only constvolume and gridvolume are supported")),
        }
    }

    /// Corners of the part of space in which there can be extinction, where this is the extinction.
    pub fn corners(&self) -> [DVec3; 8] {
        match self {
            Self::Constant(_, [low, high]) => corners_of(*low, *high),
            Self::Grid(grid) => unit_corners().map(|c| grid.from_unit.transform_point3(c)),
        }
    }
}

impl Grid {
    fn of(translator: &mut Translator, element: &Rc<Element>) -> Result<Self> {
        element.only(&[
            "filename",
            "filter_type",
            "wrap_mode",
            "raw",
            "to_world",
            "accel",
            "use_grid_bbox",
            "max_value",
        ])?;
        let path = file_of(translator.tree, element)?;
        if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("vol")) {
            let file = path.display();
            return Err(
                element.error(format!("`{file}`: the name of a grid of Mitsuba's must end in .vol here"))
            );
        }
        let volume = volume::read(&path, None).map_err(|e| used_at(element, e))?;
        let interpolation = interpolation(element)?;
        let to_world = element.transform("to_world")?;
        let own = element.boolean_or("use_grid_bbox", false)?;
        let (corners, cube) = match (own, volume.from_unit) {
            (false, _) => (", min = [0, 0, 0], max = [1, 1, 1]", DAffine3::IDENTITY),
            (true, Some(cube)) => {
                let m = cube.matrix3;
                let m = DMat3::from_cols(m.x_axis.as_dvec3(), m.y_axis.as_dvec3(), m.z_axis.as_dvec3());
                ("", DAffine3::from_mat3_translation(m, cube.translation.as_dvec3()))
            }
            (true, None) => {
                let file = path.display();
                return Err(element.error(format!("`use_grid_bbox`: the box that `{file}` names is none")));
            }
        };
        let from_unit = to_world * cube;
        if !from_unit.inverse().is_finite() {
            return Err(element.error("this `to_world` is singular: it flattens the grid"));
        }
        let transform = steps(&to_world).map_or(String::new(), |steps| format!(", transform = {steps}"));
        let file = quoted(&translator.document.file(&path));
        Ok(Self {
            place: element.place.clone(),
            entry: format!("{{ file = {file}{interpolation}{corners}{transform} }}"),
            channels: volume.channels,
            from_unit,
            rim: has_rim(&volume),
        })
    }

    /// Its entry, where its box covers that of the medium, whose corners are given: beyond its own, Mitsuba goes on with
    /// the values at the rim.
    pub fn covering(&self, medium: &[DVec3; 8]) -> Result<&str> {
        let to_unit = self.from_unit.inverse();
        match medium.iter().all(|p| is_within(to_unit.transform_point3(*p))) {
            true => Ok(&self.entry),
            false => Err(self.place.error(
                "this grid does not cover the extinction's: Mitsuba goes on with the values at its rim there, which is not \
                 supported; put both into the same box",
            )),
        }
    }

    /// Whether Mitsuba, where this is the extinction, fills more than its box with the values at its rim.
    fn spills(&self) -> bool {
        let [low, high] = bounds(&self.from_unit);
        let around = (high - low).element_product();
        self.rim && around > (1.0 + SLACK) * self.from_unit.matrix3.determinant().abs()
    }
}

impl Translator<'_> {
    /// Refuses the extinction of a medium that goes on beyond its box, unless the medium is only in shapes that do not.
    pub(super) fn refuse_spill(&self, medium: &Rc<Element>, grid: &Grid) -> Result<()> {
        if !grid.spills() {
            return Ok(());
        }
        let world = self.world.as_ref().is_some_and(|w| Rc::ptr_eq(w, medium));
        let mut inside = !world;
        for shape in self.tree.root.children.iter().filter(|c| c.tag == "shape") {
            let filled = self.side(shape, "interior")?.is_some_and(|m| Rc::ptr_eq(&m, medium));
            inside = inside && (!filled || is_in(self, shape, grid)?);
        }
        match inside {
            true => Ok(()),
            false => Err(grid.place.error(
                "this grid is turned against the axes, and not 0 at its rim: Mitsuba goes on with the values there up to the \
                 box along the axes that holds the grid; give it a rim of 0, or let the medium fill a shape that is all \
                 in the grid",
            )),
        }
    }

    /// A grid of one value, 1, from corner to corner.
    pub(super) fn solid_box(&mut self, [low, high]: &[DVec3; 2]) -> String {
        let one = Volume { size: UVec3::ONE, channels: 1, numbers: vec![1.0], from_unit: None };
        let file = quoted(&self.document.bytes("one", "grid", own::encode(&one)));
        let (min, max) = (array(&low.to_array()), array(&high.to_array()));
        format!("{{ file = {file}, interpolation = \"constant\", min = {min}, max = {max} }}")
    }
}

/// The colour of a `constvolume`.
pub(super) fn constant(volume: &Element) -> Result<[f64; 3]> {
    volume.only(&["value", "to_world"])?;
    match volume.property("value") {
        Some(inner) => inner.color(),
        None => Err(volume.error("a constvolume without a `value`")),
    }
}

fn interpolation(element: &Element) -> Result<&'static str> {
    let filter = element.string("filter_type")?.unwrap_or("trilinear");
    let wrap = element.string("wrap_mode")?.unwrap_or("clamp");
    match (filter, wrap) {
        // Within the box a mirror image begins where the values end, and so does what is clamped.
        ("trilinear", "clamp" | "mirror") => Ok(""),
        ("nearest", "clamp" | "mirror" | "repeat") => Ok(", interpolation = \"constant\""),
        ("trilinear", "repeat") => Err(element
            .unsupported("`wrap_mode` repeat mixes the values at opposite faces, which ours do not: clamp")),
        ("trilinear" | "nearest", other) => {
            Err(element.error(format!("`wrap_mode` is `{other}`: expected clamp, mirror or repeat")))
        }
        (other, _) => {
            Err(element.error(format!("`filter_type` is `{other}`: expected trilinear or nearest")))
        }
    }
}

fn has_rim(volume: &Volume) -> bool {
    let last = volume.size - 1;
    let mut values = volume.numbers.chunks_exact(volume.channels);
    (0..volume.size.z).any(|z| {
        (0..volume.size.y).any(|y| {
            // The row must be used up whatever is in it.
            (0..volume.size.x).fold(false, |found, x| {
                let at = UVec3::new(x, y, z);
                let outermost = (at.cmpeq(UVec3::ZERO) | at.cmpeq(last)).any();
                values.next().is_some_and(|v| outermost && v.iter().any(|v| *v > 0.0)) || found
            })
        })
    })
}

/// Whether a shape is all in the box of a grid; false also where that is not known.
fn is_in(translator: &Translator, shape: &Element, grid: &Grid) -> Result<bool> {
    let to_unit = grid.from_unit.inverse() * shape.transform("to_world")?;
    let points = match shape.kind()? {
        "cube" => corners_of(-DVec3::ONE, DVec3::ONE).to_vec(),
        "sphere" => {
            let centre = to_unit.transform_point3(shape.point("center")?.unwrap_or(DVec3::ZERO));
            let rows = to_unit.matrix3.transpose();
            let reach = DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
            let reach = reach * shape.number_or("radius", 1.0)?.abs();
            return Ok(is_within(centre - reach) && is_within(centre + reach));
        }
        "obj" | "ply" => {
            let path = file_of(translator.tree, shape)?;
            let mesh = TriangleMesh::load(path).map_err(|e| used_at(shape, e))?;
            mesh.positions().iter().map(|p| p.as_dvec3()).collect()
        }
        _ => return Ok(false),
    };
    Ok(points.into_iter().all(|p| is_within(to_unit.transform_point3(p))))
}

fn is_within(unit: DVec3) -> bool {
    unit.cmpge(DVec3::splat(-SLACK)).all() && unit.cmple(DVec3::splat(1.0 + SLACK)).all()
}

fn corners_of(low: DVec3, high: DVec3) -> [DVec3; 8] {
    unit_corners().map(|c| low + c * (high - low))
}

fn unit_corners() -> [DVec3; 8] {
    std::array::from_fn(|i| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64))
}

/// The box along the axes that holds the unit cube's image.
fn bounds(from_unit: &DAffine3) -> [DVec3; 2] {
    let corners = unit_corners().map(|c| from_unit.transform_point3(c));
    let of = |f: fn(DVec3, DVec3) -> DVec3| corners.into_iter().reduce(f).unwrap_or_default();
    [of(DVec3::min), of(DVec3::max)]
}
