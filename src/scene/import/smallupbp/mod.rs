//! SmallUPBP's scenes: `NAME.obj`, its `.mtl`, and `NAME.obj.aux` with camera, media, lights and what a `.mtl` does not know.
//!
//! A surface is the sum of a diffuse reflection (`Kd`), a Phong lobe (`Ks`, `Ns`) and a mirror; with an `ior` that mirror
//! is a smooth dielectric, whose reflection `mirror` multiplies. All triangles of a material are one shape. The world's
//! z axis is up.

mod aux;
mod lines;
#[cfg(test)]
mod tests;

use super::numbers::{array, color, number, quoted};
use super::{Document, Imported, Place};
use crate::error::{Error, Result, did_you_mean, nearest};
use crate::geometry::TriangleMesh;
use crate::geometry::load::obj::Obj;
use aux::{Aux, MaterialLines, Medium};
use glam::DVec3;
use lines::Line;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A material: what its two files say about it.
#[derive(Clone, Debug)]
struct Material {
    place: Place,
    diffuse: [f64; 3],
    phong: [f64; 3],
    exponent: f64,
    emission: [f64; 3],
    mirror: [f64; 3],
    /// Negative: none.
    ior: f64,
    medium: Option<Line>,
    priority: Option<i32>,
    imaginary: bool,
}

/// Translates a scene, of which `path` is the OBJ file.
///
/// # Errors
/// With file and line of what cannot be read.
pub fn read(path: &Path) -> Result<Imported> {
    crate::stage::begin(format!("reading {}", path.display()));
    let bytes = std::fs::read(path).map_err(|e| Error::unreadable(path, &e))?;
    let obj = Obj::parse(path, &bytes)?;
    drop(bytes);
    let beside = aux_path(path);
    if !beside.is_file() {
        let message =
            format!("an OBJ file alone has neither camera nor lights: there is no {}", beside.display());
        return Err(Error::file(path, message));
    }
    let mut document = Document::new(path);
    document.read_file(&beside);
    let library = match obj.libraries.first() {
        Some((line, name)) => library(path, *line, name)?,
        None => path.with_extension("mtl"),
    };
    document.read_file(&library);
    let mut materials = mtl(&mut document, &lines::read(&library)?)?;
    let aux = Aux::read(&mut document, &lines::read(&beside)?)?;
    for lines in &aux.materials {
        extend(&mut materials, lines)?;
    }
    camera(&mut document, &aux, &beside)?;
    for medium in &aux.media {
        write_medium(&mut document, medium)?;
    }
    if let Some(name) = &aux.global_medium {
        document.table(&name.place, "[world]");
        document.line(format!("medium = {}", quoted(name.name()?)));
    }
    for part in obj.parts() {
        let mesh = obj.part(&part).map_err(|e| Error::file(path, format!("`{}`: {e}", part.material)))?;
        let material = find(&materials, path, &part.material)?;
        shape(
            &mut document,
            &aux,
            &part.material,
            material,
            turned_outwards(mesh).map_err(|e| Error::file(path, e))?,
        )?;
    }
    for light in &aux.lights {
        write_light(&mut document, light, path)?;
    }
    Ok(document.finish())
}

fn aux_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".aux");
    name.into()
}

/// The file of materials that the OBJ file names.
fn library(path: &Path, line: usize, name: &str) -> Result<PathBuf> {
    let library = path.parent().unwrap_or(Path::new("")).join(name);
    match library.is_file() {
        true => Ok(library),
        false => Err(Error::at(path, line, 0, format!("there is no file of materials `{name}`"))),
    }
}

/// The materials of a `.mtl`, by name.
fn mtl(document: &mut Document, lines: &[Line]) -> Result<BTreeMap<String, Material>> {
    let mut materials = BTreeMap::new();
    let mut current: Option<(String, Material)> = None;
    for line in lines {
        if line.key == "newmtl" {
            materials.extend(current.take());
            current = Some((line.name()?.to_owned(), Material::new(line.place.clone())));
            continue;
        }
        let Some((_, material)) = &mut current else {
            return Err(line.place.error(format!("`{}` before the first `newmtl`", line.key)));
        };
        match line.key.as_str() {
            "Kd" => material.diffuse = line.numbers()?,
            "Ks" => material.phong = line.numbers()?,
            "Ke" => material.emission = line.numbers()?,
            "Ns" => material.exponent = line.number()?,
            // What other programs write, and SmallUPBP does not look at.
            "Ka" | "Ni" | "d" | "Tr" | "Tf" | "illum" => {}
            key => document.warn(&line.place, format!("`{key}` is not looked at")),
        }
    }
    materials.extend(current);
    Ok(materials)
}

impl Material {
    fn new(place: Place) -> Self {
        Self {
            place,
            diffuse: [0.0; 3],
            phong: [0.0; 3],
            exponent: 0.0,
            emission: [0.0; 3],
            mirror: [0.0; 3],
            ior: -1.0,
            medium: None,
            priority: None,
            imaginary: false,
        }
    }
}

/// Adds to a material what the `.aux` says about it.
fn extend(materials: &mut BTreeMap<String, Material>, lines: &MaterialLines) -> Result<()> {
    let name = lines.name.name()?;
    let Some(material) = materials.get_mut(name) else {
        let meant = nearest(name, materials.keys().map(String::as_str));
        let hint = did_you_mean(meant);
        return Err(lines
            .name
            .place
            .error(format!("there is no material `{name}` in the file of materials{hint}")));
    };
    material.place = lines.name.place.clone();
    for line in &lines.emission {
        material.emission = line.numbers()?;
    }
    if let Some(line) = &lines.mirror {
        material.mirror = line.numbers()?;
    }
    if let Some(line) = &lines.ior {
        material.ior = line.number()?;
    }
    if let Some(line) = &lines.priority {
        let value = line.number()?;
        if value.fract() != 0.0 || value.abs() > 1e9 {
            return Err(line.place.error(format!("the priority {value} is not a whole number")));
        }
        material.priority = (value >= 0.0).then_some(value as i32);
    }
    if let Some(line) = &lines.geometry {
        material.imaginary = match line.name()? {
            "real" => false,
            "imaginary" => true,
            other => {
                return Err(line
                    .place
                    .error(format!("the geometryType `{other}` is neither real nor imaginary")));
            }
        };
    }
    material.medium = lines.medium.clone();
    Ok(())
}

fn find<'a>(materials: &'a BTreeMap<String, Material>, path: &Path, name: &str) -> Result<&'a Material> {
    materials.get(name).ok_or_else(|| {
        if name.is_empty() {
            return Error::file(path, "there are faces before the first `usemtl`");
        }
        let meant = nearest(name, materials.keys().map(String::as_str));
        let hint = did_you_mean(meant);
        Error::file(path, format!("there is no material `{name}` in the file of materials{hint}"))
    })
}

fn camera(document: &mut Document, aux: &Aux, path: &Path) -> Result<()> {
    let row = |i: usize| match &aux.rows[i] {
        Some(line) => line.numbers().map(DVec3::from_array),
        None => Err(Error::file(path, format!("the camera has no TM_ROW{i}"))),
    };
    let (up, backward, position) = (row(1)?, row(2)?, row(3)?);
    let Some(fov) = &aux.fov else { return Err(Error::file(path, "the camera has no CAMERA_FOV")) };
    let Some(forward) = (-backward).try_normalize() else {
        return Err(fov.place.error("TM_ROW2 has no length: the camera looks nowhere"));
    };
    if let Some([width, height]) = &aux.resolution {
        let size = |line: &Line| match line.number()? {
            n if n >= 1.0 && n.fract() == 0.0 && n < 1e6 => Ok(n as u32),
            n => Err(line.place.error(format!("{n} is no number of pixels"))),
        };
        let (width, height) = (size(width)?, size(height)?);
        document.table(&fov.place, format!("[film]\nwidth = {width}\nheight = {height}"));
    }
    let distance = match &aux.target_distance {
        Some(line) => line.number()?,
        None => 1.0,
    };
    // A target at a distance of nothing would be none.
    let distance = if distance > 0.0 { distance } else { 1.0 };
    let place = aux.rows[3].as_ref().map_or(&fov.place, |l| &l.place).clone();
    document.table(&place, "[camera]");
    document.line(format!("origin = {}", array(&position.to_array())));
    document.line(format!("target = {}", array(&(position + forward * distance).to_array())));
    document.line(format!("up = {}", array(&up.to_array())));
    document.at(&fov.place);
    document.line(format!("fov = {}", number(fov.number()?.to_degrees())));
    Ok(())
}

fn write_medium(document: &mut Document, medium: &Medium) -> Result<()> {
    let coefficients = |line: &Option<Line>, default: f64| match line {
        Some(line) => line.numbers(),
        None => Ok([default; 3]),
    };
    let place = &medium.name.place;
    document.table(place, format!("[medium.{}]", quoted(medium.name.name()?)));
    for (key, line, default) in [
        ("sigma_a", &medium.absorption, 0.5),
        ("sigma_s", &medium.scattering, 0.5),
        ("emission", &medium.emission, 0.0),
    ] {
        document.at(line.as_ref().map_or(place, |l| &l.place));
        document.line(format!("{key} = {}", color(coefficients(line, default)?)));
    }
    if let Some(line) = &medium.g {
        document.at(&line.place);
        match line.number()? {
            0.0 => {}
            g => document.line(format!("phase = {{ hg = {} }}", number(g))),
        }
    }
    Ok(())
}

/// The triangles turned to the side of the mean of their vertices' normals.
fn turned_outwards(mesh: TriangleMesh) -> Result<TriangleMesh, String> {
    let Some(normals) = mesh.normals() else { return Ok(mesh) };
    let turned = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions()[i as usize].as_dvec3());
        let mean: DVec3 = t.iter().map(|i| normals[*i as usize].as_dvec3()).sum();
        if (b - a).cross(c - a).dot(mean) < 0.0 { [t[0], t[2], t[1]] } else { *t }
    };
    let indices = mesh.indices().iter().map(turned).collect();
    TriangleMesh::new(
        mesh.positions().to_vec(),
        Some(normals.to_vec()),
        mesh.uvs().map(<[_]>::to_vec),
        indices,
    )
}

fn shape(
    document: &mut Document,
    aux: &Aux,
    name: &str,
    material: &Material,
    mesh: TriangleMesh,
) -> Result<()> {
    let surface = write_material(document, name, material);
    let file = document.mesh(name, mesh);
    document.table(&material.place, "[[shape]]");
    document.line(format!("name = {}\nmaterial = {}", quoted(name), quoted(&surface)));
    document.line(format!("mesh = {{ file = {} }}", quoted(&file)));
    if material.emission != [0.0; 3] {
        document.line(format!("emission = {}", color(material.emission)));
    }
    let passes = material.imaginary || material.ior >= 0.0;
    match (&material.medium, &aux.global_medium) {
        (Some(medium), _) => {
            document.at(&medium.place);
            document.line(format!("interior = {}", quoted(medium.name()?)));
        }
        // A wall that changes no medium.
        (None, Some(global)) if passes => document.line(format!("interior = {}", quoted(global.name()?))),
        (None, _) => {}
    }
    if passes || material.medium.is_some() {
        document.line(format!("priority = {}", material.priority.unwrap_or(-1)));
    }
    Ok(())
}

/// Writes a material; its name.
fn write_material(document: &mut Document, name: &str, material: &Material) -> String {
    let mut lobes = Vec::new();
    if material.imaginary {
        lobes.push("null = {}".to_owned());
    } else {
        if material.phong != [0.0; 3] && material.exponent > 0.0 {
            lobes.push(format!(
                "phong = {{ diffuse = {}, specular = {}, exponent = {} }}",
                color(material.diffuse),
                color(material.phong),
                number(material.exponent)
            ));
        } else if material.diffuse != [0.0; 3] {
            lobes.push(format!("diffuse = {{ reflectance = {} }}", color(material.diffuse)));
        }
        if material.ior >= 0.0 {
            let (ior, mirror) = (number(material.ior), color(material.mirror));
            lobes.push(format!("dielectric = {{ ior = {ior}, reflectance = {mirror} }}"));
        } else if material.mirror != [0.0; 3] {
            lobes.push(format!("mirror = {{ reflectance = {} }}", color(material.mirror)));
        }
        if lobes.is_empty() {
            lobes.push("diffuse = { reflectance = 0.0 }".to_owned());
        }
    }
    let sum = lobes.len() > 1;
    let mut layers = Vec::new();
    for (i, lobe) in lobes.iter().enumerate() {
        let wish = if sum { format!("{name}-{}", i + 1) } else { name.to_owned() };
        let own = document.name("material", &wish);
        document.table(&material.place, format!("[material.{}]", quoted(&own)));
        document.line(lobe);
        layers.push(own);
    }
    if !sum {
        return layers.remove(0);
    }
    let own = document.name("material", name);
    document.table(&material.place, format!("[material.{}]", quoted(&own)));
    let layers: Vec<String> =
        layers.iter().map(|l| format!("{{ material = {}, weight = 1.0 }}", quoted(l))).collect();
    document.line(format!("layered = {{ layers = [{}] }}", layers.join(", ")));
    own
}

fn write_light(document: &mut Document, line: &Line, path: &Path) -> Result<()> {
    let light = match line.key.as_str() {
        "light_point" => {
            let [x, y, z, r, g, b] = line.numbers()?;
            format!("point = {{ position = {}, intensity = {} }}", array(&[x, y, z]), color([r, g, b]))
        }
        "light_directional" => {
            let [x, y, z, r, g, b] = line.numbers()?;
            format!(
                "directional = {{ direction = {}, irradiance = {} }}",
                array(&[x, y, z]),
                color([r, g, b])
            )
        }
        "light_background_constant" => format!("environment = {{ radiance = {} }}", color(line.numbers()?)),
        "light_background_em" => {
            let [scale, rotate] = line.numbers()?;
            let name = line.values[2..].join(" ");
            let picture = path.parent().unwrap_or(Path::new("")).join(&name);
            if name.is_empty() || !picture.is_file() {
                return Err(line.place.error(format!("there is no picture `{name}` for the background")));
            }
            let file = document.file(&picture);
            // Pixels move to the right by a share of the width; ours turn to the left by an angle. The picture's upper
            // edge is about +z, and its middle about +x.
            format!(
                "environment = {{ image = {}, scale = {}, rotation = {}, transform = [{{ matrix = [[0, 0, 1, 0], \
                 [1, 0, 0, 0], [0, 1, 0, 0]] }}] }}",
                quoted(&file),
                number(scale),
                number(-360.0 * rotate)
            )
        }
        other => return Err(line.place.error(format!("`{other}` is no kind of light"))),
    };
    document.table(&line.place, "[[light]]");
    document.line(light);
    Ok(())
}
