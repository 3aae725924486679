//! Scene files: TOML in, [`Scene`] out.
//!
//! [`schema`] says what a file may hold. A file is read in three steps, each with errors that name file, line and
//! column: TOML to checked values ([`source`], [`values`]); names to what they stand for, and files that the scene
//! refers to; and the whole, which has to have a camera and a light, and solids that can be told apart.

pub mod assets;
mod camera;
mod choice;
mod context;
mod forms;
mod grids;
mod lights;
mod materials;
mod media;
mod profile;
pub mod schema;
mod shapes;
mod solids;
pub mod source;
mod textures;
mod transform;
pub mod values;

use crate::error::{Error, Result, did_you_mean, from_root, nearest};
use crate::geometry::{Aabb, Geometry};
use crate::light::{Light, Lights};
use crate::scene::import;
use crate::scene::{Inside, RenderDefaults, Scene, SceneNotes, Solids, Traits};
use assets::Assets;
use context::Context;
use glam::UVec2;
use materials::Materials;
use media::Media;
use schema::{RenderDef, SceneFile};
use shapes::Shapes;
use source::Source;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use textures::Textures;

/// What the command line or an experiment changes about a scene.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Overrides {
    /// Another film size in pixels. The field of view stays, along its axis; a crop window is scaled.
    pub size: Option<UVec2>,
}

/// The scene file that a user means: a file; a folder with a `scene.toml`; or the name of a folder in `scenes/`.
///
/// # Errors
/// Where none of these is there, with the scenes that are.
pub fn resolve(scene: &Path) -> Result<PathBuf> {
    if scene.is_dir() {
        let file = scene.join("scene.toml");
        return match file.is_file() {
            true => Ok(file),
            false => Err(Error::file(scene, "is a folder without a scene.toml")),
        };
    }
    if scene.exists() {
        return Ok(scene.to_owned());
    }
    let Some(name) = scene.to_str().filter(|s| scene.components().count() == 1 && !s.contains('.')) else {
        return Err(Error::missing(scene, "scene file"));
    };
    let folder = Path::new("scenes");
    let known = known_scenes(folder);
    if known.iter().any(|k| k == name) {
        return Ok(Path::new("scenes").join(name).join("scene.toml"));
    }
    let mut message =
        format!("there is no such scene file, nor a folder of that name in {}", from_root(folder).display());
    if !folder.is_dir() {
        message.push_str(
            ", as that is no folder: names are looked for in the folder scenes/ where tyndall is started",
        );
    }
    if !known.is_empty() {
        message.push_str(&format!("; there: {}", known.join(", ")));
    }
    message.push_str(&did_you_mean(nearest(name, known.iter().map(String::as_str))));
    Err(Error::file(scene, message))
}

/// Names of the folders with a `scene.toml`, sorted.
fn known_scenes(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let scenes =
        entries.filter_map(std::result::Result::ok).filter(|e| e.path().join("scene.toml").is_file());
    let mut names: Vec<String> = scenes.filter_map(|e| e.file_name().into_string().ok()).collect();
    names.sort();
    names
}

/// Reads a scene, ours or another's (see [`import`]); see [`resolve`] for what `scene` may be.
///
/// # Errors
/// With file, line and column where something is wrong in the scene file or in a file that it refers to.
pub fn load(scene: &Path, overrides: &Overrides) -> Result<Scene> {
    let path = resolve(scene)?;
    match import::Format::of(&path) {
        None => from_source(&Source::read(&path)?, overrides),
        Some(format) => from_import(&format.read(&path)?, overrides),
    }
}

/// Makes a scene of what an importer read.
///
/// # Errors
/// As [`load`].
pub fn from_import(imported: &import::Imported, overrides: &Overrides) -> Result<Scene> {
    let mut scene = build(&imported.source, &imported.assets, overrides)?;
    if let Some(far) = &imported.far {
        far.check(&scene)?;
    }
    scene.warnings.splice(0..0, imported.warnings.iter().cloned());
    for file in &imported.files {
        if !scene.dependencies.contains(file) {
            scene.dependencies.push(file.clone());
        }
    }
    Ok(scene)
}

/// Makes a scene of the text of a scene file that has been read already.
///
/// # Errors
/// As [`load`].
pub fn from_source(source: &Source, overrides: &Overrides) -> Result<Scene> {
    build(source, &Assets::new(), overrides)
}

fn build(source: &Source, assets: &Assets, overrides: &Overrides) -> Result<Scene> {
    let file: SceneFile = source.parse()?;
    let mut context = Context::new(source, assets);
    let camera = camera::build(&context, &file.film, file.camera.as_ref(), overrides)?;
    let defaults = defaults(&context, &file.render)?;
    let mut textures = Textures::load(&mut context, &file.texture)?;
    let mut materials = Materials::load(&mut context, &mut textures, &file.material)?;
    let shapes = shapes::build(&mut context, &mut materials, &file.shape)?;
    let mut media = Media::load(&mut context, &file.medium)?;
    let mut solids = solids::build(&mut context, &file, &materials, &mut media, &shapes)?;
    let mut lights = shapes.lights.clone();
    lights.extend(lights::build(&mut context, &file.light)?);
    if lights.is_empty() {
        let message = "the scene has no light: add a [[light]], or give a shape an `emission`";
        return Err(Error::file(source.path(), message));
    }
    warn_of_unused(&mut context, &file, &textures, &materials, &media);
    let Shapes { shapes, materials: shape_materials, names: shape_names, .. } = shapes;
    let boundaries = boundaries(&solids, &materials, &shape_materials);
    let geometry = Geometry::build_with(shapes.into_iter().zip(boundaries).collect());
    solids::check_overlaps(&mut context, &file, &shape_names, &solids, &geometry)?;
    solids::check_grids(&mut context, &file, &shape_names, &solids, &media);
    let (light_names, lights): (Vec<String>, Vec<_>) = lights.into_iter().unzip();
    let lights = Lights::new(lights, &geometry).map_err(|e| Error::file(source.path(), e))?;
    check_endless(&mut context, &file, &media, &solids, &lights)?;
    solids.light_up(|bounds| {
        lights.lights().iter().filter_map(|l| bounds_of(l, &geometry)).any(|b| b.overlaps(bounds))
    });
    solids.hollow_out(|shape| geometry.is_hollow(shape));
    if solids.within(&geometry, &camera.near_bounds(), None).is_none() {
        solids.open_up();
    }
    let mut warnings = context.warnings;
    warnings.extend(lights.warnings().iter().cloned());
    let notes = SceneNotes {
        description: file.description.unwrap_or_default(),
        material_names: materials.names(),
        light_names,
        medium_names: media.names(),
        texture_bytes: textures.bytes(),
        defaults,
    };
    let all_materials: Vec<_> = materials.all.into_iter().map(Arc::new).collect();
    let (media, camera_inside) = (media.all, solids.at(&geometry, camera.near_point()));
    let light_inside = lights.lights().iter().map(|l| inside_of_light(l, &solids, &geometry)).collect();
    Ok(Scene {
        name: file.name.unwrap_or_else(|| name_of(source.path())),
        camera,
        geometry,
        by_shape: shape_materials.iter().map(|m| Arc::clone(&all_materials[*m as usize])).collect(),
        materials: all_materials,
        shape_materials,
        shape_names,
        lights,
        traits: Traits::of(&media),
        media,
        solids,
        camera_inside,
        light_inside,
        warnings,
        dependencies: context.dependencies,
        notes,
    })
}

fn defaults(context: &Context, def: &RenderDef) -> Result<RenderDefaults> {
    let number = |n: &Option<toml::Spanned<values::Count<1>>>| n.as_ref().map(|n| n.get_ref().0);
    let defaults =
        RenderDefaults { min_length: number(&def.min_length), max_length: number(&def.max_length) };
    if let (Some(min), Some(max), Some(place)) = (defaults.min_length, defaults.max_length, &def.min_length)
        && min > max
    {
        let message = format!("min_length is {min} and max_length {max}: no path is left");
        return Err(context.source.error(place.span(), message));
    }
    Ok(defaults)
}

/// By shape, whether a ray may pass it: what solids say, and null shapes with nothing inside.
fn boundaries(solids: &Solids, materials: &Materials, shape_materials: &[u32]) -> Vec<bool> {
    let mut passable = solids.boundaries();
    for (passable, material) in passable.iter_mut().zip(shape_materials) {
        *passable |= materials.all[*material as usize].is_null();
    }
    passable
}

/// The solids that a light is in, its own apart, where that is the same for all its points.
fn inside_of_light(light: &Light, solids: &Solids, geometry: &Geometry) -> Option<Inside> {
    match light {
        Light::Area(l) => solids.within(geometry, &geometry.shape(l.shape()).bounds(), Some(l.shape())),
        Light::Point(l) => Some(solids.at(geometry, l.position())),
        Light::Spot(l) => Some(solids.at(geometry, l.position())),
        Light::Directional(_) | Light::Environment(_) => Some(Inside::NOTHING),
    }
}

/// The box about a light; none about one that is infinitely far away.
fn bounds_of(light: &Light, geometry: &Geometry) -> Option<Aabb> {
    match light {
        Light::Area(l) => Some(geometry.shape(l.shape()).bounds()),
        Light::Point(l) => Some(Aabb::of([l.position()])),
        Light::Spot(l) => Some(Aabb::of([l.position()])),
        Light::Directional(_) | Light::Environment(_) => None,
    }
}

/// A medium without an end must not shine without bound, and lets no light in from infinitely far away.
fn check_endless(
    context: &mut Context,
    file: &SceneFile,
    media: &Media,
    solids: &Solids,
    lights: &Lights,
) -> Result<()> {
    let Some(name) = &file.world.medium else { return Ok(()) };
    let medium = &media.all[solids.world() as usize];
    if medium.shines_without_bound() {
        let message = format!(
            "`{}` fills the world and shines where it does not absorb: the scene would be infinitely bright",
            name.get_ref()
        );
        return Err(context.source.error(name.span(), message));
    }
    let infinite = lights.lights().iter().any(|l| matches!(l, Light::Directional(_) | Light::Environment(_)));
    if infinite {
        let message = format!(
            "`{}` fills the world without end: directional and environment lights do not get through it (put it into \
             a closed shape with a null material)",
            name.get_ref()
        );
        context.warn(name.span(), message);
    }
    Ok(())
}

/// Warns of what is there but not used.
fn warn_of_unused(
    context: &mut Context,
    file: &SceneFile,
    textures: &Textures,
    materials: &Materials,
    media: &Media,
) {
    for (name, span) in materials.unused() {
        context.warn(span, format!("material `{name}` is not used"));
    }
    for (name, span) in media.unused() {
        context.warn(span, format!("medium `{name}` is not used"));
    }
    for (name, _) in &file.texture.0 {
        if textures.unused().any(|unused| unused == name.get_ref()) {
            context.warn(name.span(), format!("texture `{}` is not used", name.get_ref()));
        }
    }
}

/// What a scene is called that does not say so: its folder, or its file.
fn name_of(path: &Path) -> String {
    let folder = path.parent().and_then(Path::file_name);
    let stem = path.file_stem();
    let name = if path.file_name().is_some_and(|f| f == "scene.toml") { folder.or(stem) } else { stem };
    name.map_or_else(|| "scene".into(), |n| n.to_string_lossy().into_owned())
}
