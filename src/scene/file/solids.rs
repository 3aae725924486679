//! Solids of a scene file: which shapes have something in them.

use super::context::Context;
use super::materials::Materials;
use super::media::Media;
use super::schema::{SceneFile, ShapeDef};
use super::shapes::Shapes;
use crate::error::Result;
use crate::geometry::{Geometry, ShapeDesc, ShapeStats};
use crate::medium::Medium;
use crate::scene::solids::{Solid, Solids, Surface, VACUUM};
use glam::{Vec2, Vec3A};
use toml::Spanned;

/// Points of a shape that are looked at to tell whether it overlaps another.
const PROBES: u32 = 256;

/// The solids of a file: shapes that are said to have something in them, and closed ones that refract.
pub(super) fn build(
    context: &mut Context,
    file: &SceneFile,
    materials: &Materials,
    media: &mut Media,
    shapes: &Shapes,
) -> Result<Solids> {
    let world = match &file.world.medium {
        Some(name) => media.index(context, name)?,
        None => VACUUM,
    };
    let mut solids = Vec::new();
    for (i, def) in file.shape.iter().enumerate() {
        if let Some(solid) = solid(context, materials, media, shapes, i, def)? {
            solids.push(solid);
        }
    }
    let result = Solids::new(solids, shapes.shapes.len(), world);
    context.at(0..0, result)
}

/// What a shape is as a solid.
fn solid(
    context: &mut Context,
    materials: &Materials,
    media: &mut Media,
    shapes: &Shapes,
    i: usize,
    spanned: &Spanned<ShapeDef>,
) -> Result<Option<Solid>> {
    let def = spanned.get_ref();
    let (shape, name) = (&shapes.shapes[i], &shapes.names[i]);
    let material = &materials.all[shapes.materials[i] as usize];
    let surface = match material.refraction() {
        Some((inside, outside)) => Surface::Refracting { inside, outside },
        None if material.is_null() => Surface::Matched,
        None => Surface::Opaque,
    };
    let medium = match &def.interior {
        Some(medium) => media.index(context, medium)?,
        None => VACUUM,
    };
    if medium == VACUUM && surface == Surface::Opaque {
        if let Some(priority) = &def.priority {
            let message = format!(
                "`{name}` has a priority but nothing inside: give it an `interior`, or a dielectric or null material"
            );
            return Err(context.source.error(priority.span(), message));
        }
        return Ok(None);
    }
    let stats = ShapeStats::of(shape);
    let bounds_something = match (&def.interior, surface) {
        (Some(medium), _) => Some(format!("is filled with `{}`", medium.get_ref())),
        (None, Surface::Refracting { .. }) if matches!(shape, ShapeDesc::Mesh(_)) => {
            Some("is of a dielectric".to_owned())
        }
        _ => None,
    };
    if let Some(what) = bounds_something {
        if !stats.closed {
            let why = stats.gap.map_or(String::new(), |gap| format!(" ({gap})"));
            context.warn(spanned.span(), format!("`{name}` {what} but not closed: it has no inside{why}"));
        } else if stats.volume.is_some_and(|v| v < 0.0) {
            context.warn(spanned.span(), format!("`{name}` {what} and inside out: its inside is outside"));
        }
    }
    // Without a medium an open shape is a mere surface: a pane of glass, say.
    if !stats.closed && medium == VACUUM {
        return Ok(None);
    }
    let priority = def.priority.as_ref().map_or(0, |p| *p.get_ref());
    let (shape, bounds) = (i as u32, stats.bounds);
    let closed = stats.volume.is_some_and(|volume| volume > 0.0);
    Ok(Some(Solid { shape, surface, medium, priority, closed, bounds }))
}

/// Warns of grids of which a part is outside of the shape that they fill, where nothing of them is: as far as the shape's
/// bounds tell.
pub(super) fn check_grids(
    context: &mut Context,
    file: &SceneFile,
    names: &[String],
    solids: &Solids,
    media: &Media,
) {
    for solid in solids.all().iter().filter(|s| s.medium != VACUUM) {
        let Medium::Varying(medium) = &media.all[solid.medium as usize] else { continue };
        let slack = 1e-4 * (solid.bounds.max - solid.bounds.min).length();
        let is_out = |corner: &Vec3A| {
            corner.cmplt(solid.bounds.min - slack).any() || corner.cmpgt(solid.bounds.max + slack).any()
        };
        if medium.boxes().iter().flatten().any(is_out) {
            let shape = solid.shape as usize;
            let message = format!(
                "the grid that fills `{}` reaches out of it: what is outside is cut off",
                names[shape]
            );
            context.warn(file.shape[shape].span(), message);
        }
    }
}

/// Looks for solids that overlap without one being in front of the other.
pub(super) fn check_overlaps(
    context: &mut Context,
    file: &SceneFile,
    names: &[String],
    solids: &Solids,
    geometry: &Geometry,
) -> Result<()> {
    let all = solids.all();
    for (i, a) in all.iter().enumerate() {
        for b in &all[i + 1..] {
            let equal = a.priority == b.priority && a.bounds.overlaps(&b.bounds);
            if !equal || !crosses(solids, geometry, a, b) {
                continue;
            }
            let (def_a, def_b) = (&file.shape[a.shape as usize], &file.shape[b.shape as usize]);
            let (name_a, name_b) = (&names[a.shape as usize], &names[b.shape as usize]);
            let message = format!(
                "`{name_a}` and `{name_b}` overlap and have the same priority, {}: give the one that shall be there a \
                 higher one",
                a.priority
            );
            match (&def_a.get_ref().priority, &def_b.get_ref().priority) {
                (Some(place), Some(_)) => return Err(context.source.error(place.span(), message)),
                _ => context
                    .warn(def_a.span(), format!("{message}; as it is, that is `{name_a}`, the smaller one")),
            }
        }
    }
    Ok(())
}

/// Whether the surface of `a` lies partly inside and partly outside of `b`, as far as probes tell.
fn crosses(solids: &Solids, geometry: &Geometry, a: &Solid, b: &Solid) -> bool {
    let (mut within, mut without) = (0, 0);
    for k in 0..PROBES {
        // The golden ratio's and the plastic number's fractions spread evenly.
        let u = Vec2::new((k as f32 * 0.618_034).fract(), (k as f32 * 0.754_877_7).fract());
        let point = geometry.sample_area(a.shape, u);
        match solids.at(geometry, point.p).has(solids.of_shape(b.shape)) {
            true => within += 1,
            false => without += 1,
        }
    }
    within > 0 && without > 0
}
