//! The scene file that an importer writes, with where each of its parts comes from.

use super::numbers::quoted;
use super::{Far, Imported};
use crate::error::Error;
use crate::geometry::TriangleMesh;
use crate::scene::file::assets::{Asset, Assets};
use crate::scene::file::source::{Origin, Source};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A place in a foreign file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub path: Arc<Path>,
    /// Line, from 1; 0 where there are none.
    pub line: usize,
    /// Column, from 1; 0 where only the line is known.
    pub column: usize,
}

impl Place {
    /// A whole file.
    pub fn file(path: &Path) -> Self {
        Self { path: path.into(), line: 0, column: 0 }
    }

    /// A line of a file.
    pub fn line(path: &Arc<Path>, line: usize) -> Self {
        Self { path: path.clone(), line, column: 0 }
    }

    /// An error here.
    pub fn error(&self, message: impl Into<String>) -> Error {
        match self.line {
            0 => Error::file(&self.path, message),
            line => Error::at(&self.path, line, self.column, message),
        }
    }
}

/// A scene file in the making.
#[derive(Debug)]
pub struct Document {
    path: PathBuf,
    text: String,
    origins: Vec<Origin>,
    assets: Assets,
    files: Vec<PathBuf>,
    warnings: Vec<String>,
    /// See [`Imported::far`].
    pub far: Option<Far>,
    /// Names of materials, media and textures that are taken.
    names: BTreeSet<String>,
}

impl Document {
    /// An empty one, the translation of the file at `path`.
    pub fn new(path: &Path) -> Self {
        let mut document = Self {
            path: path.to_owned(),
            text: String::new(),
            origins: Vec::new(),
            assets: Assets::new(),
            files: Vec::new(),
            warnings: Vec::new(),
            far: None,
            names: BTreeSet::new(),
        };
        document.read_file(path);
        document.at(&Place::file(path));
        let name = path.file_stem().map_or("scene".into(), |n| n.to_string_lossy());
        document.line(format!("name = {}", quoted(&name)));
        document
    }

    /// What is written from here on comes from that place.
    pub fn at(&mut self, place: &Place) {
        let Place { path, line, column } = place.clone();
        self.origins.push(Origin { start: self.text.len(), path, line, column });
    }

    /// Writes a line.
    pub fn line(&mut self, line: impl AsRef<str>) {
        self.text.push_str(line.as_ref());
        self.text.push('\n');
    }

    /// Begins a table such as `[film]` or `[[shape]]`, which comes from that place.
    pub fn table(&mut self, place: &Place, header: impl AsRef<str>) {
        self.text.push('\n');
        self.at(place);
        self.line(header);
    }

    /// A file was read.
    pub fn read_file(&mut self, path: &Path) {
        if !self.files.iter().any(|f| f == path) {
            self.files.push(path.to_owned());
        }
    }

    /// Something could not be taken over.
    pub fn warn(&mut self, place: &Place, message: impl std::fmt::Display) {
        let file = match *place.path == *self.path {
            true => String::new(),
            false => format!("{}, ", place.path.display()),
        };
        self.warnings.push(match place.line {
            0 => format!("{file}{message}"),
            line => format!("{file}line {line}: {message}"),
        });
    }

    /// A name like `wish` that nothing else of the kind `kind` has.
    pub fn name(&mut self, kind: &str, wish: &str) -> String {
        let mut name = wish.to_owned();
        let mut n = 1;
        while !self.names.insert(format!("{kind} {name}")) {
            n += 1;
            name = format!("{wish}-{n}");
        }
        name
    }

    /// Takes a mesh; the name under which the scene file has it.
    pub fn mesh(&mut self, wish: &str, mesh: TriangleMesh) -> String {
        self.asset(wish, "ply", Asset::Mesh(mesh))
    }

    /// Takes a file that is there; the name under which the scene file has it.
    pub fn file(&mut self, path: &Path) -> String {
        let same = |asset: &Asset| matches!(asset, Asset::File(known) if known == path);
        if let Some((name, _)) = self.assets.iter().find(|(_, asset)| same(asset)) {
            return name.clone();
        }
        self.read_file(path);
        let stem = path.file_stem().map_or("file".into(), |s| s.to_string_lossy()).into_owned();
        let ending = path.extension().map_or("".into(), |s| s.to_string_lossy()).into_owned();
        self.asset(&stem, &ending, Asset::File(path.to_owned()))
    }

    /// Takes the bytes of a file, once; the name under which the scene file has it.
    pub fn bytes(&mut self, wish: &str, ending: &str, bytes: Vec<u8>) -> String {
        let same = |asset: &Asset| matches!(asset, Asset::Bytes(known) if *known == bytes);
        if let Some((name, _)) = self.assets.iter().find(|(_, asset)| same(asset)) {
            return name.clone();
        }
        self.asset(wish, ending, Asset::Bytes(bytes))
    }

    /// Takes an asset; the name under which the scene file has it.
    pub fn asset(&mut self, wish: &str, ending: &str, asset: Asset) -> String {
        let plain = |c: char| if c.is_alphanumeric() || "-_".contains(c) { c } else { '-' };
        let wish: String = wish.chars().map(plain).take(80).collect();
        let folder = self.path.file_stem().map_or("scene".into(), |s| s.to_string_lossy());
        let folder: String = folder.chars().map(plain).take(80).collect();
        let named = |stem: &str| format!("{folder}-files/{stem}.{ending}");
        let mut name = named(&wish);
        let mut n = 1;
        while self.assets.contains_key(&name) {
            n += 1;
            name = named(&format!("{wish}-{n}"));
        }
        self.assets.insert(name.clone(), asset);
        name
    }

    /// A file that was taken, by its name.
    pub fn get(&self, name: &str) -> Option<&Asset> {
        self.assets.get(name)
    }

    /// The scene file as it is now.
    pub fn finish(self) -> Imported {
        let source = Source::translated(self.path, self.text, self.origins);
        Imported { source, assets: self.assets, files: self.files, warnings: self.warnings, far: self.far }
    }
}
