//! The elements of a scene and of the files that it includes, with parameters filled in.

use super::super::Place;
use crate::error::{Error, Result, did_you_mean, nearest};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

/// Files that may include each other in a row; as many as Mitsuba takes.
const MAX_INCLUDES: usize = 15;
/// Elements of all files together: more is a trap of includes, not a scene.
const MAX_ELEMENTS: usize = 10_000_000;
/// Elements within each other.
const MAX_DEPTH: usize = 64;

/// An element.
#[derive(Debug)]
pub struct Element {
    /// Its kind, such as `shape` or `float`.
    pub tag: String,
    attributes: Vec<(String, String)>,
    /// What it holds, in order.
    pub children: Vec<Rc<Element>>,
    /// Where it stands.
    pub place: Place,
}

impl Element {
    /// An attribute.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }

    /// An attribute that has to be there.
    pub fn required(&self, name: &str) -> Result<&str> {
        self.attribute(name).ok_or_else(|| self.error(format!("<{}> has no `{name}`", self.tag)))
    }

    /// The plugin: its `type`.
    pub fn kind(&self) -> Result<&str> {
        self.required("type")
    }

    /// An error about it.
    pub fn error(&self, message: impl Into<String>) -> Error {
        self.place.error(message)
    }

    /// An error: this is not supported. Says what it is.
    pub fn unsupported(&self, why: &str) -> Error {
        let kind = self.attribute("type").map_or(String::new(), |t| format!(" type=\"{t}\""));
        let name = self.attribute("name").map_or(String::new(), |n| format!(" name=\"{n}\""));
        self.error(format!("<{}{kind}{name}>: {why}", self.tag))
    }

    /// The child that is the property `name`.
    pub fn property(&self, name: &str) -> Option<&Rc<Element>> {
        self.children.iter().find(|c| c.attribute("name") == Some(name))
    }

    /// Refuses properties of a name that is not known: what they are for might change the picture.
    pub fn only(&self, known: &[&str]) -> Result<()> {
        for child in &self.children {
            let Some(name) = child.attribute("name").filter(|n| !known.contains(n)) else { continue };
            let meant = nearest(name, known.iter().copied());
            let hint = did_you_mean(meant);
            let of = self.attribute("type").unwrap_or(&self.tag);
            return Err(child.error(format!("`{name}` of the {} `{of}` is not supported{hint}", self.tag)));
        }
        Ok(())
    }
}

/// A scene with the files that it includes.
#[derive(Debug)]
pub struct Tree {
    /// The root.
    pub root: Rc<Element>,
    /// Elements with an `id`.
    pub ids: BTreeMap<String, Rc<Element>>,
    /// Every file that was read.
    pub files: Vec<PathBuf>,
    /// Folders that files are looked for in.
    pub folders: Vec<PathBuf>,
}

impl Tree {
    /// Reads a scene.
    pub fn read(path: &Path) -> Result<Self> {
        let mut reader = Reader {
            parameters: BTreeMap::new(),
            files: Vec::new(),
            folders: vec![path.parent().unwrap_or(Path::new("")).to_owned()],
            within: Vec::new(),
            elements: 0,
        };
        let root = reader.file(path, &Place::file(path))?;
        if root.tag != "scene" {
            return Err(
                root.error(format!("expected <scene> as the outermost element, found <{}>", root.tag))
            );
        }
        let mut ids = BTreeMap::new();
        collect_ids(&root, &mut ids)?;
        Ok(Self { root, ids, files: reader.files, folders: reader.folders })
    }

    /// What an element stands for: itself, or what a `ref` names.
    pub fn resolve<'a>(&'a self, element: &'a Rc<Element>) -> Result<&'a Rc<Element>> {
        if element.tag != "ref" {
            return Ok(element);
        }
        let id = element.required("id")?;
        self.ids.get(id).ok_or_else(|| {
            let meant = nearest(id, self.ids.keys().map(String::as_str));
            let hint = did_you_mean(meant);
            element.error(format!("there is nothing with the id `{id}`{hint}"))
        })
    }

    /// The path of a file that an element names.
    pub fn find(&self, element: &Element, name: &str) -> Result<PathBuf> {
        find(&self.folders, element, name)
    }
}

fn find(folders: &[PathBuf], element: &Element, name: &str) -> Result<PathBuf> {
    let paths = folders.iter().rev().map(|folder| folder.join(name));
    let mut looked = Vec::new();
    for path in paths {
        if path.is_file() {
            return Ok(path);
        }
        looked.push(path.display().to_string());
    }
    Err(element.error(format!("there is no file `{name}`: looked for {}", looked.join(" and "))))
}

fn collect_ids(element: &Rc<Element>, ids: &mut BTreeMap<String, Rc<Element>>) -> Result<()> {
    for child in &element.children {
        if let (Some(id), false) = (child.attribute("id"), matches!(child.tag.as_str(), "ref" | "alias"))
            && let Some(first) = ids.insert(id.to_owned(), child.clone())
        {
            let message = format!("the id `{id}` is taken: see line {}", first.place.line);
            return Err(child.error(message));
        }
        if child.tag == "alias" {
            let (id, name) = (child.required("id")?, child.required("as")?);
            let target = ids.get(id).cloned();
            let target =
                target.ok_or_else(|| child.error(format!("there is nothing with the id `{id}` above")))?;
            ids.insert(name.to_owned(), target);
        }
        collect_ids(child, ids)?;
    }
    Ok(())
}

struct Reader {
    parameters: BTreeMap<String, String>,
    files: Vec<PathBuf>,
    folders: Vec<PathBuf>,
    /// The files that are being read, each included by the one before.
    within: Vec<PathBuf>,
    elements: usize,
}

impl Reader {
    /// Reads a file that is included at `from`: its outermost element.
    fn file(&mut self, path: &Path, from: &Place) -> Result<Rc<Element>> {
        let real = path.canonicalize().map_err(|e| Error::unreadable(path, &e))?;
        if self.within.contains(&real) {
            return Err(from.error(format!("`{}` includes itself", path.display())));
        }
        if self.within.len() > MAX_INCLUDES {
            return Err(
                from.error(format!("more than {MAX_INCLUDES} files that include each other in a row"))
            );
        }
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read it", &e))?;
        let text = String::from_utf8(bytes).map_err(|e| {
            let line = e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count();
            Error::at(path, line + 1, 0, "is not a text file: a byte here is not UTF-8")
        })?;
        self.within.push(real);
        self.files.push(path.to_owned());
        let root = self.text(path, &text)?;
        self.within.pop();
        Ok(root)
    }

    fn text(&mut self, path: &Path, text: &str) -> Result<Rc<Element>> {
        let options = roxmltree::ParsingOptions { nodes_limit: MAX_ELEMENTS as u32, ..Default::default() };
        let document = roxmltree::Document::parse_with_options(text, options).map_err(|e| {
            let message = e.to_string();
            let message = message.split(" at ").next().unwrap_or_default().to_owned();
            let message = match e {
                roxmltree::Error::DtdDetected => {
                    "a document type declaration: entities are not expanded".into()
                }
                _ => format!("not readable as XML: {message}"),
            };
            let place = e.pos();
            Error::at(path, place.row as usize, place.col as usize, message)
        })?;
        let file = File { path: path.into(), lines: line_starts(text), text };
        self.element(&file, document.root_element(), 0)
    }

    fn element(&mut self, file: &File, node: roxmltree::Node, depth: usize) -> Result<Rc<Element>> {
        let place = file.place(node.range().start);
        self.elements += 1;
        if depth > MAX_DEPTH || self.elements > MAX_ELEMENTS {
            return Err(place.error(match depth > MAX_DEPTH {
                true => format!("elements within each other more than {MAX_DEPTH} deep"),
                false => format!("more than {MAX_ELEMENTS} elements"),
            }));
        }
        let mut attributes = Vec::new();
        for attribute in node.attributes() {
            attributes.push((attribute.name().to_owned(), self.filled_in(&place, attribute.value())?));
        }
        let mut element =
            Element { tag: node.tag_name().name().to_owned(), attributes, children: Vec::new(), place };
        for child in node.children() {
            if child.is_text() {
                if child.text().is_some_and(|t| !t.trim().is_empty()) {
                    return Err(file.place(child.range().start).error("text between the elements"));
                }
                continue;
            }
            if !child.is_element() {
                continue;
            }
            let child = self.element(file, child, depth + 1)?;
            match child.tag.as_str() {
                "default" => {
                    let (name, value) = (child.required("name")?, child.required("value")?);
                    self.parameters.entry(name.to_owned()).or_insert_with(|| value.to_owned());
                }
                "include" => {
                    let included = find(&self.folders, &child, child.required("filename")?)?;
                    let included = self.file(&included, &child.place)?;
                    // Of a whole scene its parts, of anything else itself.
                    match included.tag.as_str() {
                        "scene" => element.children.extend(included.children.iter().cloned()),
                        _ => element.children.push(included),
                    }
                }
                "path" => {
                    let folder = Path::new(child.required("value")?);
                    let base = file.path.parent().unwrap_or(Path::new(""));
                    self.folders.push(base.join(folder));
                }
                _ => element.children.push(child),
            }
        }
        Ok(Rc::new(element))
    }

    /// An attribute's value with `$name` replaced by what `default` says.
    fn filled_in(&self, place: &Place, value: &str) -> Result<String> {
        let mut out = String::with_capacity(value.len());
        let mut parts = value.split('$');
        out.push_str(parts.next().unwrap_or_default());
        for part in parts {
            let end = part.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(part.len());
            let (name, rest) = part.split_at(end);
            let Some(filling) = self.parameters.get(name) else {
                let meant = nearest(name, self.parameters.keys().map(String::as_str));
                let hint = meant.map_or(String::new(), |m| format!("; did you mean `${m}`?"));
                let message =
                    format!("there is no parameter `${name}`: no <default> above gives it a value{hint}");
                return Err(place.error(message));
            };
            out.push_str(filling);
            out.push_str(rest);
        }
        Ok(out)
    }
}

/// A file's text, and where its lines begin.
struct File<'a> {
    path: Arc<Path>,
    text: &'a str,
    lines: Vec<usize>,
}

fn line_starts(text: &str) -> Vec<usize> {
    std::iter::once(0).chain(text.match_indices('\n').map(|(i, _)| i + 1)).collect()
}

impl File<'_> {
    fn place(&self, offset: usize) -> Place {
        let line = self.lines.partition_point(|start| *start <= offset);
        let start = self.lines[line - 1];
        let column = self.text[start..offset].chars().count() + 1;
        Place { path: self.path.clone(), line, column }
    }
}
