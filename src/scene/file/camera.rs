//! The camera and the film of a scene file.

use super::Overrides;
use super::context::Context;
use super::schema::{CameraDef, FilmDef, FovAxis};
use crate::camera::{self, Camera, CameraSettings, CropWindow, Lens, look_at};
use crate::error::{Error, Result};
use glam::{UVec2, Vec3A};
use toml::Spanned;

const DEFAULT_FOV: f32 = 45.0;

/// The camera, with the film that the overrides ask for.
pub(super) fn build(
    context: &Context,
    film: &FilmDef,
    def: Option<&Spanned<CameraDef>>,
    overrides: &Overrides,
) -> Result<Camera> {
    let Some(spanned) = def else {
        let message = "the scene has no camera: add [camera] with `origin` and `target`";
        return Err(Error::file(context.source.path(), message));
    };
    let def = spanned.get_ref();
    let (own, size) = (UVec2::new(film.width.0, film.height.0), overrides.size);
    let crop = crop_window(context, film, own)?.map(|crop| match size {
        Some(size) => scaled(crop, own, size),
        None => crop,
    });
    let up = def.up.map_or(Vec3A::Y, |up| up.0);
    let to_world = context.at(spanned.span(), look_at(def.origin.0, def.target.0, up))?;
    let lens = def.lens_radius.map(|r| r.get()).filter(|r| *r > 0.0).map(|radius| Lens {
        radius,
        focus_distance: def.focus_distance.map_or((def.target.0 - def.origin.0).length(), |d| d.get()),
    });
    let fov = def.fov.as_ref();
    let settings = CameraSettings {
        size: size.unwrap_or(own),
        crop,
        fov_axis: match def.fov_axis {
            FovAxis::Horizontal => camera::FovAxis::Horizontal,
            FovAxis::Vertical => camera::FovAxis::Vertical,
        },
        fov: fov.map_or(DEFAULT_FOV, |fov| fov.get_ref().get()),
        to_world,
        lens,
        near: def.near.map_or(0.0, |d| d.get()),
    };
    context.at(fov.map_or(spanned.span(), Spanned::span), Camera::new(&settings))
}

/// The crop window of the file, inside its film.
fn crop_window(context: &Context, film: &FilmDef, size: UVec2) -> Result<Option<CropWindow>> {
    let Some(crop) = &film.crop else { return Ok(None) };
    let [x0, y0, x1, y1] = crop.get_ref().map(|n| n.0);
    if x0 < x1 && y0 < y1 && x1 <= size.x && y1 <= size.y {
        return Ok(Some(CropWindow { x0, y0, x1, y1 }));
    }
    let message = format!(
        "the crop window [{x0}, {y0}, {x1}, {y1}] is empty or outside the film of {}x{}: expected [x0, y0, x1, y1] \
         with x0 < x1 <= {} and y0 < y1 <= {}",
        size.x, size.y, size.x, size.y
    );
    Err(context.source.error(crop.span(), message))
}

/// The window on a film of another size: the least one that covers the same part.
fn scaled(crop: CropWindow, from: UVec2, to: UVec2) -> CropWindow {
    let low = |x: u32, from: u32, to: u32| (u64::from(x) * u64::from(to) / u64::from(from)) as u32;
    let high = |x: u32, from: u32, to: u32| (u64::from(x) * u64::from(to)).div_ceil(u64::from(from)) as u32;
    CropWindow {
        x0: low(crop.x0, from.x, to.x),
        y0: low(crop.y0, from.y, to.y),
        x1: high(crop.x1, from.x, to.x),
        y1: high(crop.y1, from.y, to.y),
    }
}
