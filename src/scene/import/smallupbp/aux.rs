//! The `.aux` file. Its reader knows most keys by their first letters, and published files have misspelt ones: they are
//! taken as it takes them, with a warning.

use super::super::Document;
use super::lines::Line;
use crate::error::{Result, did_you_mean, nearest};

/// What the file says, line by line.
#[derive(Debug, Default)]
pub(super) struct Aux {
    /// `TM_ROW0` to `TM_ROW3`.
    pub rows: [Option<Line>; 4],
    /// `CAMERA_FOV`, in radians.
    pub fov: Option<Line>,
    /// `CAMERA_TDIST`.
    pub target_distance: Option<Line>,
    /// `CAMERA_RESOLUTION_X` and `CAMERA_RESOLUTION_Y`.
    pub resolution: Option<[Line; 2]>,
    /// `medium`.
    pub media: Vec<Medium>,
    /// `material`.
    pub materials: Vec<MaterialLines>,
    /// `light_…`.
    pub lights: Vec<Line>,
    /// `globalMediumId`.
    pub global_medium: Option<Line>,
}

/// `medium NAME` and the lines below.
#[derive(Debug)]
pub(super) struct Medium {
    pub name: Line,
    pub absorption: Option<Line>,
    pub scattering: Option<Line>,
    pub emission: Option<Line>,
    pub g: Option<Line>,
}

/// `material NAME` and the lines below.
#[derive(Debug)]
pub(super) struct MaterialLines {
    pub name: Line,
    pub mirror: Option<Line>,
    pub ior: Option<Line>,
    pub medium: Option<Line>,
    pub priority: Option<Line>,
    pub geometry: Option<Line>,
    /// In order: the last one stands.
    pub emission: Vec<Line>,
}

/// What a line belongs to.
enum Section {
    None,
    Medium,
    Material,
}

const TOP: [&str; 16] = [
    "TM_ROW0",
    "TM_ROW1",
    "TM_ROW2",
    "TM_ROW3",
    "CAMERA_FOV",
    "CAMERA_TDIST",
    "CAMERA_MATERIAL",
    "CAMERA_RESOLUTION_X",
    "CAMERA_RESOLUTION_Y",
    "medium",
    "material",
    "globalMediumId",
    "light_point",
    "light_directional",
    "light_background_constant",
    "light_background_em",
];
const MEDIUM: [&str; 5] = ["absorption", "scattering", "emission", "g", "continuation_probability"];
const MATERIAL: [&str; 7] = ["mirror", "ior", "mediumId", "priority", "Ke", "geometryType", "enclosingMatId"];

impl Aux {
    pub fn read(document: &mut Document, lines: &[Line]) -> Result<Self> {
        let mut aux = Self::default();
        let mut section = Section::None;
        let (mut width, mut height) = (None, None);
        for line in lines {
            match line.key.as_str() {
                "TM_ROW0" => aux.rows[0] = Some(line.clone()),
                "TM_ROW1" => aux.rows[1] = Some(line.clone()),
                "TM_ROW2" => aux.rows[2] = Some(line.clone()),
                "TM_ROW3" => aux.rows[3] = Some(line.clone()),
                "CAMERA_FOV" => aux.fov = Some(line.clone()),
                "CAMERA_TDIST" => aux.target_distance = Some(line.clone()),
                "CAMERA_RESOLUTION_X" => width = Some(line.clone()),
                "CAMERA_RESOLUTION_Y" => height = Some(line.clone()),
                // What the camera is inside of is found out from the shapes.
                "CAMERA_MATERIAL" => {}
                "globalMediumId" => aux.global_medium = Some(line.clone()),
                "medium" => {
                    section = Section::Medium;
                    aux.media.push(Medium::new(line.clone()));
                }
                "material" => {
                    section = Section::Material;
                    aux.materials.push(MaterialLines::new(line.clone()));
                }
                key if key.starts_with("light_") => aux.lights.push(line.clone()),
                _ => match (&section, aux.media.last_mut(), aux.materials.last_mut()) {
                    (Section::Medium, Some(medium), _) => medium.line(document, line)?,
                    (Section::Material, _, Some(material)) => material.line(document, line)?,
                    _ => return Err(unknown(line, &TOP)),
                },
            }
        }
        aux.resolution = width.zip(height).map(|(w, h)| [w, h]);
        Ok(aux)
    }
}

fn unknown(line: &Line, known: &[&str]) -> crate::error::Error {
    let list: Vec<String> = known.iter().map(|k| format!("`{k}`")).collect();
    let meant = nearest(&line.key, known.iter().copied());
    let hint = did_you_mean(meant);
    line.place.error(format!("unknown key `{}`, expected one of {}{hint}", line.key, list.join(", ")))
}

/// The known key that stands for this one: itself, or the one whose first letters it has.
fn key(
    document: &mut Document,
    line: &Line,
    prefixes: &[(&str, &'static str)],
    known: &[&str],
) -> Result<&'static str> {
    let found = prefixes.iter().find(|(prefix, _)| line.key.starts_with(prefix));
    let Some((_, key)) = found else { return Err(unknown(line, known)) };
    if line.key != *key {
        document.warn(&line.place, format!("`{}` is taken for `{key}`, by its first letters", line.key));
    }
    Ok(key)
}

impl Medium {
    fn new(name: Line) -> Self {
        Self { name, absorption: None, scattering: None, emission: None, g: None }
    }

    fn line(&mut self, document: &mut Document, line: &Line) -> Result<()> {
        let prefixes = [
            ("a", "absorption"),
            ("s", "scattering"),
            ("em", "emission"),
            ("g", "g"),
            ("c", "continuation_probability"),
        ];
        let place = match key(document, line, &prefixes, &MEDIUM)? {
            "absorption" => &mut self.absorption,
            "scattering" => &mut self.scattering,
            "emission" => &mut self.emission,
            "g" => &mut self.g,
            // How long paths go on does not change the picture.
            _ => return Ok(()),
        };
        *place = Some(line.clone());
        Ok(())
    }
}

impl MaterialLines {
    fn new(name: Line) -> Self {
        Self {
            name,
            mirror: None,
            ior: None,
            medium: None,
            priority: None,
            geometry: None,
            emission: Vec::new(),
        }
    }

    fn line(&mut self, document: &mut Document, line: &Line) -> Result<()> {
        let prefixes = [
            ("mi", "mirror"),
            ("me", "mediumId"),
            ("i", "ior"),
            ("p", "priority"),
            ("K", "Ke"),
            ("g", "geometryType"),
            ("en", "enclosingMatId"),
        ];
        let place = match key(document, line, &prefixes, &MATERIAL)? {
            "mirror" => &mut self.mirror,
            "mediumId" => &mut self.medium,
            "ior" => &mut self.ior,
            "priority" => &mut self.priority,
            "geometryType" => &mut self.geometry,
            "Ke" => {
                self.emission.push(line.clone());
                return Ok(());
            }
            // What a light is inside of is found out from the shapes.
            _ => return Ok(()),
        };
        *place = Some(line.clone());
        Ok(())
    }
}
