//! What the parts of a scene file share while they are turned into a scene.

use super::assets::{Asset, Assets};
use super::source::{Source, Span, allowed};
use crate::error::{Error, Result};
use crate::geometry::TriangleMesh;
use crate::medium::volume::{self, Volume};
use crate::texture::load::{self, Encoding, Raster};
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Endings of image files that can be read.
pub(super) const IMAGES: [&str; 5] = [".png", ".jpg", ".jpeg", ".exr", ".hdr"];
/// Endings of mesh files that can be read.
const MESHES: [&str; 2] = [".obj", ".ply"];

/// The file, what has been read besides it, and what looked odd.
#[derive(Debug)]
pub(super) struct Context<'a> {
    pub source: &'a Source,
    /// Files that are there without being on disk under their names.
    assets: &'a Assets,
    pub dependencies: Vec<PathBuf>,
    pub warnings: Vec<String>,
}

impl<'a> Context<'a> {
    pub fn new(source: &'a Source, assets: &'a Assets) -> Self {
        Self { source, assets, dependencies: vec![source.path().to_owned()], warnings: Vec::new() }
    }

    /// Something odd at a place in the file that can be rendered all the same.
    pub fn warn(&mut self, span: Span, message: impl std::fmt::Display) {
        let (line, _) = self.source.place(span.start);
        self.warnings.push(format!("line {line}: {message}"));
    }

    /// The path of a file that the scene refers to, which is relative to the scene file. An error at that place if it
    /// is not there, with the names of files in that folder that end like one of `endings`.
    pub fn find_file(&mut self, file: &Spanned<String>, what: &str, endings: &[&str]) -> Result<PathBuf> {
        let path = match self.assets.get(file.get_ref()) {
            Some(Asset::File(path)) => path.clone(),
            _ => self.source.folder().join(file.get_ref()),
        };
        if path.is_file() {
            if !self.dependencies.contains(&path) {
                self.dependencies.push(path.clone());
            }
            return Ok(path);
        }
        let name = path.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let beside = files_in(folder, endings);
        let beside: Vec<&str> = beside.iter().map(String::as_str).collect();
        let hint = match beside.is_empty() {
            true => format!("there is no {} in {}", endings.join(" or "), folder.display()),
            false => format!("in {}, {}", folder.display(), allowed(what, &name, &beside)),
        };
        Err(self.source.error(file.span(), format!("there is no {what} `{}`; {hint}", file.get_ref())))
    }

    /// Reads an image that the scene refers to.
    pub fn image(&mut self, file: &Spanned<String>, encoding: Encoding) -> Result<Raster> {
        let assets = self.assets;
        let raster = match assets.get(file.get_ref()) {
            Some(Asset::Bytes(bytes)) => load::decode(Path::new(file.get_ref()), bytes, encoding),
            _ => load::read(&self.find_file(file, "image", &IMAGES)?, encoding),
        };
        raster.map_err(|e| self.used_at(file.span(), e))
    }

    /// Reads a grid that the scene refers to; `name`: which one of a file with more than one.
    pub fn volume(&mut self, file: &Spanned<String>, name: Option<&str>) -> Result<Volume> {
        let assets = self.assets;
        match assets.get(file.get_ref()) {
            Some(Asset::Bytes(bytes)) => volume::read_bytes(Path::new(file.get_ref()), name, bytes),
            _ => volume::read(&self.find_file(file, "grid", &volume::ENDINGS)?, name),
        }
    }

    /// Reads a mesh that the scene refers to.
    pub fn mesh(&mut self, file: &Spanned<String>) -> Result<TriangleMesh> {
        let assets = self.assets;
        let mesh = match assets.get(file.get_ref()) {
            Some(Asset::Mesh(mesh)) => return Ok(mesh.clone()),
            _ => TriangleMesh::load(self.find_file(file, "mesh", &MESHES)?),
        };
        mesh.map_err(|e| self.used_at(file.span(), e))
    }

    /// An error inside a file that the scene refers to, with the place of the reference.
    pub fn used_at(&self, span: Span, error: Error) -> Error {
        match error {
            Error::File { path, place, message } => {
                let (line, column) = self.source.place(span.start);
                let message = format!("{message} (used at {}:{line}:{column})", self.source.path().display());
                Error::File { path, place, message }
            }
            other => other,
        }
    }

    /// A message of the library about something at a place in the file as an error.
    pub fn at<T>(&self, span: Span, result: Result<T, String>) -> Result<T> {
        result.map_err(|message| self.source.error(span, message))
    }

    /// Of several keys exactly one has to be there: its name.
    pub fn exactly_one(&self, span: Span, what: &str, keys: &[(&'static str, bool)]) -> Result<&'static str> {
        let all: Vec<&str> = keys.iter().map(|(key, _)| *key).collect();
        let there: Vec<&'static str> = keys.iter().filter(|(_, there)| *there).map(|(key, _)| *key).collect();
        let expected = super::choice::listed(&all);
        match there[..] {
            [one] => Ok(one),
            [] => Err(self
                .source
                .error(span, format!("this {what} does not say what it is: expected one of {expected}"))),
            _ => {
                let found = there.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(" and ");
                Err(self.source.error(span, format!("this {what} is {found}: expected one of {expected}")))
            }
        }
    }
}

/// The names of the files in a folder that end in one of `endings`, sorted; at most 20.
fn files_in(folder: &Path, endings: &[&str]) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let names = entries.filter_map(|e| e.ok()?.file_name().into_string().ok());
    let mut names: Vec<String> =
        names.filter(|n| endings.iter().any(|e| n.to_ascii_lowercase().ends_with(e))).collect();
    names.sort();
    names.truncate(20);
    names
}
