//! Shapes of a scene file.

use super::context::Context;
use super::materials::Materials;
use super::profile;
use super::schema::{BoxDef, DiscDef, LatheDef, MeshDef, RectangleDef, ShapeDef, SphereDef};
use super::source::Span;
use super::transform;
use crate::error::Result;
use crate::geometry::transform::is_singular;
use crate::geometry::{ShapeDesc, TriangleMesh};
use crate::light::{AreaLight, Light};
use glam::{Affine3A, Mat3A, Vec3, Vec3A};
use toml::Spanned;

const DEFAULT_SEGMENTS: u32 = 64;
/// Some 3 GB: more is a slip of the pen.
const MAX_LATHE_POINTS: u64 = 1 << 25;
const DEFAULT_CREASE: f32 = 40.0;

/// What the shapes of a file come to, by index of the shape.
#[derive(Debug, Default)]
pub(super) struct Shapes {
    /// In world space.
    pub shapes: Vec<ShapeDesc>,
    /// Indices of materials.
    pub materials: Vec<u32>,
    /// Names for people.
    pub names: Vec<String>,
    /// Those that shine, with the names of their shapes.
    pub lights: Vec<(String, Light)>,
}

/// Builds all shapes.
pub(super) fn build(
    context: &mut Context,
    materials: &mut Materials,
    defs: &[Spanned<ShapeDef>],
) -> Result<Shapes> {
    let mut all = Shapes::default();
    for (i, spanned) in defs.iter().enumerate() {
        let def = spanned.get_ref();
        let Local { kind, span, shape, place } = local(context, spanned)?;
        let name = def.name.clone().unwrap_or_else(|| format!("{kind} {}", i + 1));
        let to_world = transform::compose(context.source, &def.transform)?;
        let moved = shape.transformed(&(to_world * place)).map_err(|message| {
            let place = def.transform.first().map_or(span.clone(), Spanned::span);
            context.source.error(place, format!("`{name}`: {message}"))
        })?;
        if let ShapeDesc::Mesh(mesh) = &moved
            && mesh.dropped() > 0
        {
            context.warn(
                span.clone(),
                format!("`{name}` has {} triangles without area; they are left out", mesh.dropped()),
            );
        }
        let material = material(context, materials, spanned, &name)?;
        let is_null = materials.all[material as usize].is_null();
        if let Some(emission) = &def.emission {
            if is_null {
                let message =
                    format!("`{name}` has a null material: it is not there for light, and cannot emit");
                return Err(context.source.error(spanned.span(), message));
            }
            let light = AreaLight::new(i as u32, emission.radiance.0, emission.two_sided);
            all.lights.push((name.clone(), Light::Area(context.at(spanned.span(), light)?)));
        }
        all.shapes.push(moved);
        all.materials.push(material);
        all.names.push(name);
    }
    Ok(all)
}

/// The index of a shape's material; lamps may do without.
fn material(
    context: &Context,
    materials: &mut Materials,
    def: &Spanned<ShapeDef>,
    name: &str,
) -> Result<u32> {
    match &def.get_ref().material {
        Some(material) => materials.index(context, material),
        None if def.get_ref().emission.is_some() => context.at(def.span(), materials.black()),
        None => {
            let message = format!(
                "`{name}` has no material: add material = \"…\" (only a shape that emits may go without)"
            );
            Err(context.source.error(def.span(), message))
        }
    }
}

/// A shape in its own coordinates.
struct Local {
    kind: &'static str,
    /// Where it stands in the file.
    span: Span,
    shape: ShapeDesc,
    /// What takes it to the place that the file says, before its transform. Of rectangles and boxes, which so are
    /// transformed in one step (see [`TriangleMesh::transformed`]).
    place: Affine3A,
}

fn local(context: &mut Context, def: &Spanned<ShapeDef>) -> Result<Local> {
    let ShapeDef { sphere, rectangle, disc, cuboid, mesh, lathe, .. } = def.get_ref();
    let keys = [
        ("sphere", sphere.is_some()),
        ("rectangle", rectangle.is_some()),
        ("disc", disc.is_some()),
        ("box", cuboid.is_some()),
        ("mesh", mesh.is_some()),
        ("lathe", lathe.is_some()),
    ];
    let kind = context.exactly_one(def.span(), "shape", &keys)?;
    let mut place = Affine3A::IDENTITY;
    let (span, shape) = if let Some(sphere) = sphere {
        (sphere.span(), ball(sphere.get_ref()))
    } else if let Some(rectangle) = rectangle {
        place = context.at(rectangle.span(), parallelogram(rectangle.get_ref()))?;
        (rectangle.span(), ShapeDesc::Mesh(TriangleMesh::unit_square()))
    } else if let Some(disc) = disc {
        (disc.span(), context.at(disc.span(), round(disc.get_ref()))?)
    } else if let Some(cuboid) = cuboid {
        place = context.at(cuboid.span(), block(cuboid.get_ref()))?;
        (cuboid.span(), ShapeDesc::Mesh(TriangleMesh::unit_cube()))
    } else if let Some(mesh) = mesh {
        (mesh.span(), from_file(context, mesh.get_ref())?)
    } else if let Some(lathe) = lathe {
        (lathe.span(), turned(context, lathe)?)
    } else {
        return Err(context.source.error(def.span(), "this shape does not say what it is"));
    };
    Ok(Local { kind, span, shape, place })
}

fn ball(def: &SphereDef) -> ShapeDesc {
    ShapeDesc::Sphere { centre: def.center.map_or(Vec3A::ZERO, |c| c.0), radius: def.radius.get() }
}

/// What takes the unit square there.
fn parallelogram(def: &RectangleDef) -> Result<Affine3A, String> {
    let (u, v) = (def.u.0, def.v.0);
    let normal = u.cross(v).normalize_or_zero();
    let place = Affine3A { matrix3: Mat3A::from_cols(u, v, normal), translation: def.corner.0 };
    if is_singular(&place) {
        return Err("the rectangle has no area: `u` and `v` are parallel, or 0".into());
    }
    Ok(place)
}

fn round(def: &DiscDef) -> Result<ShapeDesc, String> {
    let normal = def.normal.map_or(Vec3A::Y, |n| n.0);
    let normal = normal.try_normalize().ok_or("the disc's normal has no length")?;
    Ok(ShapeDesc::Disc { centre: def.center.map_or(Vec3A::ZERO, |c| c.0), normal, radius: def.radius.get() })
}

/// What takes the unit cube there.
fn block(def: &BoxDef) -> Result<Affine3A, String> {
    let (min, max) = (Vec3::from(def.min.0), Vec3::from(def.max.0));
    if !min.cmplt(max).all() {
        return Err(format!(
            "the box is flat or inside out: `min` {min} has to be below `max` {max} in each coordinate"
        ));
    }
    Ok(Affine3A { matrix3: Mat3A::from_diagonal(max - min), translation: min.into() })
}

fn from_file(context: &mut Context, def: &MeshDef) -> Result<ShapeDesc> {
    let mesh = context.mesh(&def.file)?;
    Ok(ShapeDesc::Mesh(match def.smooth {
        Some(false) => mesh.faceted(),
        Some(true) if mesh.normals().is_none() => mesh.smoothed(),
        _ => mesh,
    }))
}

fn turned(context: &Context, def: &Spanned<LatheDef>) -> Result<ShapeDesc> {
    let LatheDef { profile, segments, smooth, crease } = def.get_ref();
    let points = profile::points(context.source, profile)?;
    let crease = crease.map_or(DEFAULT_CREASE, |c| c.get());
    let crease = smooth.unwrap_or(true).then_some(crease);
    let segments = segments.map_or(DEFAULT_SEGMENTS, |s| s.0);
    if u64::from(segments) * points.len() as u64 > MAX_LATHE_POINTS {
        let message =
            format!("{segments} segments of {} points are more than {MAX_LATHE_POINTS}", points.len());
        return Err(context.source.error(def.span(), message));
    }
    context.at(profile.span(), TriangleMesh::lathe(&points, segments, crease)).map(ShapeDesc::Mesh)
}
