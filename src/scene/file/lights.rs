//! Lights of a scene file that are not shapes.

use super::context::Context;
use super::schema::{EnvironmentDef, FalloffKind, LightDef, SpotDef};
use super::source::Span;
use super::transform;
use crate::error::Result;
use crate::light::{DirectionalLight, EnvironmentLight, Falloff, Light, PointLight, SpotLight};
use crate::texture::Encoding;
use glam::Mat3A;
use toml::Spanned;

const DEFAULT_CUTOFF: f32 = 30.0;

/// Builds all lights of `[[light]]`, with their names.
pub(super) fn build(context: &mut Context, defs: &[Spanned<LightDef>]) -> Result<Vec<(String, Light)>> {
    let mut lights = Vec::new();
    let mut environment: Option<Span> = None;
    for (i, spanned) in defs.iter().enumerate() {
        let LightDef { name, point, spot, directional, environment: surroundings } = spanned.get_ref();
        let keys = [
            ("point", point.is_some()),
            ("spot", spot.is_some()),
            ("directional", directional.is_some()),
            ("environment", surroundings.is_some()),
        ];
        let kind = context.exactly_one(spanned.span(), "light", &keys)?;
        let name = name.clone().unwrap_or_else(|| format!("{kind} {}", i + 1));
        let light = if let Some(def) = point {
            let light = PointLight::new(def.get_ref().position.0, def.get_ref().intensity.0);
            Light::Point(context.at(def.span(), light)?)
        } else if let Some(def) = spot {
            Light::Spot(spot_light(context, def)?)
        } else if let Some(def) = directional {
            let light = DirectionalLight::new(def.get_ref().direction.0, def.get_ref().irradiance.0);
            Light::Directional(context.at(def.span(), light)?)
        } else if let Some(def) = surroundings {
            if let Some(first) = environment.replace(def.span()) {
                let (line, _) = context.source.place(first.start);
                let message =
                    format!("a second environment: there is one in line {line}, and a scene has at most one");
                return Err(context.source.error(def.span(), message));
            }
            Light::Environment(environment_light(context, def)?)
        } else {
            return Err(context.source.error(spanned.span(), "this light does not say what it is"));
        };
        lights.push((name, light));
    }
    Ok(lights)
}

fn spot_light(context: &Context, def: &Spanned<SpotDef>) -> Result<SpotLight> {
    let SpotDef { position, target, intensity, inner, cutoff, falloff } = def.get_ref();
    let axis = target.0 - position.0;
    if axis.try_normalize().is_none() {
        return Err(context
            .source
            .error(def.span(), "the spot's target is at its position: it has no direction"));
    }
    let cutoff_angle = cutoff.as_ref().map_or(DEFAULT_CUTOFF, |c| c.get_ref().get());
    let inner_angle = inner.as_ref().map_or(0.75 * cutoff_angle, |i| i.get_ref().get());
    let span = inner.as_ref().map(Spanned::span).or(cutoff.as_ref().map(Spanned::span)).unwrap_or(def.span());
    let falloff = match falloff {
        FalloffKind::Smooth => Falloff::Smooth,
        FalloffKind::Linear => Falloff::Linear,
    };
    let light = SpotLight::new(position.0, axis, intensity.0, inner_angle, cutoff_angle);
    context.at(span, light.map(|light| light.with_falloff(falloff)))
}

fn environment_light(context: &mut Context, def: &Spanned<EnvironmentDef>) -> Result<EnvironmentLight> {
    let EnvironmentDef { radiance, image, scale, rotation, transform: steps } = def.get_ref();
    match (radiance, image) {
        (Some(radiance), None) if scale.is_none() && rotation.is_none() && steps.is_empty() => {
            context.at(def.span(), EnvironmentLight::constant(radiance.0))
        }
        (None, Some(file)) => {
            let raster = context.image(file, Encoding::Srgb)?;
            let (width, height) = (raster.width as usize, raster.height as usize);
            let turn = Mat3A::from_rotation_y(rotation.map_or(0.0, |r| r.get()).to_radians());
            let turn = transform::compose(context.source, steps)?.matrix3 * turn;
            let scale = scale.map_or(1.0, |s| s.get());
            context.at(file.span(), EnvironmentLight::image(width, height, raster.texels, turn, scale))
        }
        _ => {
            let message = "an environment has either `radiance`, or `image` with `scale`, `rotation` and `transform` as you like";
            Err(context.source.error(def.span(), message))
        }
    }
}
