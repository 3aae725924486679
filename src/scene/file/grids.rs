//! Media of a scene file that vary.

use super::context::Context;
use super::schema::{DensityDef, GridDef, InterpolationDef, MediumDef};
use super::source::Span;
use super::transform;
use crate::error::{Error, Result};
use crate::math::Rgb;
use crate::medium::grid::{Interpolation, Placed, Texel};
use crate::medium::height::HeightFog;
use crate::medium::procedural::{self, Noise};
use crate::medium::varying::{Density, Emission, Extinction, Scattering};
use crate::medium::volume::{self, Volume};
use crate::medium::{Phase, Varying};
use glam::{Affine3A, Vec3, Vec3A};
use toml::Spanned;

/// Whether a medium of the file varies.
pub(super) fn varies(def: &MediumDef) -> bool {
    def.density.is_some() || grids(def).iter().any(|(_, grid)| grid.is_some())
}

fn grids(def: &MediumDef) -> [(&'static str, Option<&Spanned<GridDef>>); 5] {
    [
        ("albedo_grid", def.albedo_grid.as_ref()),
        ("sigma_t_grid", def.sigma_t_grid.as_ref()),
        ("sigma_a_grid", def.sigma_a_grid.as_ref()),
        ("sigma_s_grid", def.sigma_s_grid.as_ref()),
        ("emission_grid", def.emission_grid.as_ref()),
    ]
}

/// A medium that varies; `phase` is its phase function.
pub(super) fn build(context: &mut Context, span: Span, def: &MediumDef, phase: Phase) -> Result<Varying> {
    let scale = def.scale.map_or(1.0, |s| s.get());
    let (extinction, scattering) = match &def.density {
        Some(density) => scaled(context, &span, def, density, scale)?,
        None => by_place(context, &span, def, scale)?,
    };
    let emission = match (&def.emission, &def.emission_grid) {
        (None, None) => Emission::None,
        (Some(_), None) if def.density.is_none() => {
            let message = "`emission` needs an `emission_grid` where there is no `density`";
            return Err(context.source.error(span, message));
        }
        (Some(e), None) => Emission::WithDensity(e.0),
        (e, Some(grid)) => {
            let color = e.map_or(Rgb::ONE, |e| e.0);
            let volume = load(context, grid)?;
            match volume.channels {
                1 => Emission::Scaled(place(context, grid, &volume, 1.0)?, color),
                _ => Emission::Colored(place(context, grid, &volume, 1.0)?, color),
            }
        }
    };
    context.at(span, Varying::new(extinction, scattering, emission, phase))
}

/// A density times constant coefficients.
fn scaled(
    context: &mut Context,
    span: &Span,
    def: &MediumDef,
    density: &Spanned<DensityDef>,
    scale: f32,
) -> Result<(Extinction, Scattering)> {
    if let Some((key, Some(grid))) = grids(def)[1..4].iter().find(|(_, grid)| grid.is_some()) {
        let message = format!("`{key}` beside a `density`: the coefficients are either constant or grids");
        return Err(context.source.error(grid.span(), message));
    }
    let (sigma_t, scattering) = match (
        &def.sigma_a,
        &def.sigma_s,
        &def.sigma_t,
        &def.albedo,
        &def.albedo_grid,
    ) {
        (Some(a), Some(s), None, None, None) => {
            let (sigma_a, sigma_s) = (a.get_ref().0, s.get_ref().0);
            let sigma_t = sigma_a + sigma_s;
            let there = sigma_t.cmpgt(Rgb::ZERO);
            (sigma_t, Scattering::Albedo(Rgb::select(there, sigma_s / sigma_t, Rgb::ZERO).min(Rgb::ONE)))
        }
        (None, None, Some(t), Some(albedo), None) => (t.get_ref().0, Scattering::Albedo(albedo.get_ref().0)),
        (None, None, Some(t), None, Some(grid)) => {
            (t.get_ref().0, Scattering::AlbedoGrid(grid_of(context, grid, 1.0)?))
        }
        _ => {
            let message = "a medium with a `density` has `sigma_a` and `sigma_s`, or `sigma_t` and one of `albedo` and \
                           `albedo_grid`";
            return Err(context.source.error(span.clone(), message));
        }
    };
    Ok((Extinction::Scaled(self::density(context, density)?, sigma_t * scale), scattering))
}

/// Coefficients as grids.
fn by_place(
    context: &mut Context,
    span: &Span,
    def: &MediumDef,
    scale: f32,
) -> Result<(Extinction, Scattering)> {
    if let Some(constant) = [&def.sigma_a, &def.sigma_s, &def.sigma_t].into_iter().flatten().next() {
        let message = "constant coefficients beside grids of them: give a `density`, or grids for all";
        return Err(context.source.error(constant.span(), message));
    }
    match (&def.sigma_t_grid, &def.sigma_a_grid, &def.sigma_s_grid, &def.albedo, &def.albedo_grid) {
        (Some(t), None, None, Some(albedo), None) => {
            let extinction = Extinction::Colored(grid_of(context, t, scale)?);
            Ok((extinction, Scattering::Albedo(albedo.get_ref().0)))
        }
        (Some(t), None, None, None, Some(albedo)) => {
            let extinction = Extinction::Colored(grid_of(context, t, scale)?);
            Ok((extinction, Scattering::AlbedoGrid(grid_of(context, albedo, 1.0)?)))
        }
        (None, Some(a), Some(s), None, None) => {
            let (absorbing, scattering) = (load(context, a)?, load(context, s)?);
            let sum = sum_of(&absorbing, &scattering);
            let sum = context.at(s.span(), sum)?;
            let scattered = place::<Vec3>(context, s, &scattering, scale)?;
            let extinction = place::<Vec3>(context, a, &sum, scale)?;
            if !extinction.is_like(&scattered) {
                let message =
                    "`sigma_a_grid` and `sigma_s_grid` must have the same size, place and interpolation";
                return Err(context.source.error(s.span(), message));
            }
            Ok((Extinction::Colored(extinction), Scattering::Rates(scattered)))
        }
        _ => {
            let message = "a medium of grids has `sigma_a_grid` and `sigma_s_grid`, or `sigma_t_grid` and one of `albedo` \
                           and `albedo_grid`";
            Err(context.source.error(span.clone(), message))
        }
    }
}

/// Absorption and scattering together, three numbers a value.
fn sum_of(a: &Volume, s: &Volume) -> Result<Volume, String> {
    if a.size != s.size {
        return Err(format!("the grid of scattering is {} and that of absorption {}", s.size, a.size));
    }
    let at = |v: &Volume, i: usize, c: usize| v.numbers[i * v.channels + if v.channels == 3 { c } else { 0 }];
    let count = a.numbers.len() / a.channels;
    let numbers = (0..3 * count).map(|i| at(a, i / 3, i % 3) + at(s, i / 3, i % 3)).collect();
    Ok(Volume { numbers, channels: 3, ..a.clone() })
}

fn density(context: &mut Context, def: &Spanned<DensityDef>) -> Result<Density> {
    let span = def.span();
    let resolution = |n: &Option<super::values::Count<1>>, usual: u32| n.map_or(usual, |n| n.0);
    let noise = |seed: &Option<super::values::Count<0>>, octaves: &Option<super::values::Count<1>>| {
        Noise::new(seed.map_or(1, |s| s.0).into(), octaves.map_or(5, |o| o.0))
    };
    let baked = |volume: Result<Volume, String>| {
        let volume = volume?;
        let place = volume.from_unit.unwrap_or(Affine3A::IDENTITY);
        volume.place(place, Interpolation::Trilinear, 1.0).map(|grid| Density::Grid(Box::new(grid)))
    };
    match def.get_ref() {
        DensityDef::Grid(grid) => {
            let volume = load_at(context, span.clone(), grid)?;
            place_at(context, span, grid, &volume, 1.0).map(Density::Grid)
        }
        DensityDef::Height(height) => {
            let up = height.up.map_or(Vec3A::Y, |up| up.0);
            let fog = HeightFog::new(up, height.level.map_or(0.0, |l| l.get()), height.scale.get());
            context.at(span, fog).map(Density::Height)
        }
        DensityDef::Puff(puff) => {
            let roughness = puff.roughness.map_or(0.7, |r| r.get());
            if !(0.0..=1.0).contains(&roughness) {
                let message = format!("the roughness of a puff must be from 0 to 1, found {roughness}");
                return Err(context.source.error(span, message));
            }
            let (centre, radius) = (puff.center.map_or(Vec3A::ZERO, |c| c.0), puff.radius.get());
            let shape = procedural::puff(centre, radius, roughness, noise(&puff.seed, &puff.octaves));
            let bounds = (centre - radius, centre + radius);
            context.at(span, baked(procedural::bake(bounds, resolution(&puff.resolution, 64), shape)))
        }
        DensityDef::Plume(plume) => {
            let (base, height, radius) =
                (plume.base.map_or(Vec3A::ZERO, |b| b.0), plume.height.get(), plume.radius.get());
            let shape = procedural::plume(base, Vec3::Y, height, radius, noise(&plume.seed, &plume.octaves));
            let wide = Vec3A::new(2.0 * radius, 0.0, 2.0 * radius);
            let bounds = (base - wide, base + wide + Vec3A::Y * height);
            context.at(span, baked(procedural::bake(bounds, resolution(&plume.resolution, 96), shape)))
        }
        DensityDef::Noise(def) => {
            let (size, base) = (def.size.get(), def.base.map_or(0.0, |b| b.get()));
            if !(0.0..=1.0).contains(&base) {
                let message = format!("the base of a noise must be from 0 to 1, found {base}");
                return Err(context.source.error(span, message));
            }
            let noise = noise(&def.seed, &def.octaves);
            let shape = |p: Vec3A| base + (1.0 - base) * (0.5 + 0.5 * noise.at(p / size)).clamp(0.0, 1.0);
            let bounds = (def.min.0, def.max.0);
            context.at(span, baked(procedural::bake(bounds, resolution(&def.resolution, 64), shape)))
        }
    }
}

pub(super) fn grid_of<T: Texel>(
    context: &mut Context,
    def: &Spanned<GridDef>,
    scale: f32,
) -> Result<Box<Placed<T>>> {
    let volume = load(context, def)?;
    place(context, def, &volume, scale)
}

fn load(context: &mut Context, def: &Spanned<GridDef>) -> Result<Volume> {
    load_at(context, def.span(), def.get_ref())
}

fn load_at(context: &mut Context, span: Span, def: &GridDef) -> Result<Volume> {
    context.volume(&def.file, def.name.as_deref()).map_err(|e| context.used_at(span, e))
}

fn place<T: Texel>(
    context: &Context,
    def: &Spanned<GridDef>,
    volume: &Volume,
    scale: f32,
) -> Result<Box<Placed<T>>> {
    place_at(context, def.span(), def.get_ref(), volume, scale)
}

fn place_at<T: Texel>(
    context: &Context,
    span: Span,
    def: &GridDef,
    volume: &Volume,
    scale: f32,
) -> Result<Box<Placed<T>>> {
    let own = match (&def.min, &def.max) {
        (Some(min), Some(max)) => {
            let (low, high) = (min.get_ref().0, max.get_ref().0);
            if !low.cmplt(high).all() {
                let message = format!("the box {low} … {high} is none: `min` must be below `max`");
                return Err(context.source.error(min.span(), message));
            }
            volume::cube(low, high)
        }
        (None, None) => volume.from_unit.unwrap_or(Affine3A::IDENTITY),
        (Some(one), None) | (None, Some(one)) => {
            return Err(context.source.error(one.span(), "a box needs both `min` and `max`"));
        }
    };
    let from_unit = transform::compose(context.source, &def.transform)? * own;
    let interpolation = match def.interpolation {
        InterpolationDef::Trilinear => Interpolation::Trilinear,
        InterpolationDef::Constant => Interpolation::Constant,
    };
    let scale = scale * def.scale.map_or(1.0, |s| s.get());
    let placed = volume.place(from_unit, interpolation, scale);
    placed.map(Box::new).map_err(|message: String| -> Error { context.source.error(span, message) })
}
