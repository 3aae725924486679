//! The text of a file with what it takes to point into it: every error names file, line and column.

use crate::error::{Error, Result, did_you_mean, nearest};
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A TOML file that has been read, or the translation of a file of another kind, which knows where each of its parts
/// comes from.
#[derive(Debug)]
pub struct Source {
    path: PathBuf,
    text: String,
    origins: Vec<Origin>,
}

/// Where a translated text comes from, from a byte on up to the next origin.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// The first byte of the translation.
    pub start: usize,
    /// The file that was translated.
    pub path: Arc<Path>,
    /// Line in it, from 1; 0 where it has none.
    pub line: usize,
    /// Column in it, from 1; 0 where only the line is known.
    pub column: usize,
}

/// Where in the text of a [`Source`] something stands, in bytes.
pub type Span = Range<usize>;

impl Source {
    /// Reads a file; an error if it is missing, is a folder or is not UTF-8.
    pub fn read(path: &Path) -> Result<Self> {
        match std::fs::read(path) {
            Ok(bytes) => match String::from_utf8(bytes) {
                Ok(text) => Ok(Self::from_text(path, text)),
                Err(e) => {
                    let line =
                        e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count();
                    Err(Error::at(path, line + 1, 0, "is not a text file: a byte here is not UTF-8"))
                }
            },
            Err(e) => Err(Error::unreadable(path, &e)),
        }
    }

    /// A text that did not come from a file, under the name that errors shall give it.
    pub fn from_text(path: impl Into<PathBuf>, text: impl Into<String>) -> Self {
        Self { path: path.into(), text: text.into(), origins: Vec::new() }
    }

    /// A translation of the file at `path`, with the origins of its parts in order.
    pub fn translated(path: impl Into<PathBuf>, text: String, origins: Vec<Origin>) -> Self {
        Self { path: path.into(), text, origins }
    }

    /// The file's path as the user would name it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder that relative paths in the file start from.
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Reads the text as TOML into a `T`. Errors point at the offending key or value, list what is allowed
    /// and, where a name is nearly right, say which was probably meant.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T> {
        toml::from_str(&self.text).map_err(|e| {
            let mut message = explained(e.message());
            match e.span() {
                Some(span) => {
                    if let Some(name) = single_header(&message, self.text.get(span.start..).unwrap_or("")) {
                        message.push_str(&format!("; there may be several: write `[[{name}]]`"));
                    }
                    self.error(span, message)
                }
                None => Error::file(&self.path, message),
            }
        })
    }

    /// An error at a place in this file.
    pub fn error(&self, span: Span, message: impl Into<String>) -> Error {
        match self.origin(span.start) {
            Some(origin) if origin.line == 0 => Error::file(&origin.path, message),
            Some(origin) => Error::at(&origin.path, origin.line, origin.column, message),
            None => {
                let (line, column) = self.place(span.start);
                Error::at(&self.path, line, column, message)
            }
        }
    }

    /// The origin of a byte of a translated text.
    fn origin(&self, offset: usize) -> Option<&Origin> {
        let after = self.origins.partition_point(|o| o.start <= offset);
        self.origins[..after].last()
    }

    /// A name was used at `span` that is none of `known`: lists them and suggests the nearest.
    pub fn unknown_name<'a>(
        &self,
        span: Span,
        what: &str,
        name: &str,
        known: impl IntoIterator<Item = &'a str>,
    ) -> Error {
        let known: Vec<&str> = known.into_iter().collect();
        self.error(span, format!("there is no {what} `{name}`; {}", allowed(what, name, &known)))
    }

    /// Line and column (in characters) of a byte offset, both from 1; of a translated text, where it comes from.
    pub fn place(&self, offset: usize) -> (usize, usize) {
        if let Some(origin) = self.origin(offset) {
            return (origin.line, origin.column);
        }
        let mut end = offset.min(self.text.len());
        while !self.text.is_char_boundary(end) {
            end -= 1;
        }
        let before = &self.text[..end];
        let start = before.rfind('\n').map_or(0, |i| i + 1);
        (before.matches('\n').count() + 1, before[start..].chars().count() + 1)
    }
}

/// "known: `a`, `b`; did you mean `a`?", or that there are none at all.
pub fn allowed(what: &str, name: &str, known: &[&str]) -> String {
    if known.is_empty() {
        return format!("no {what} is defined");
    }
    let list: Vec<String> = known.iter().map(|k| format!("`{k}`")).collect();
    let meant = did_you_mean(nearest(name, known.iter().copied()));
    format!("known: {}{meant}", list.join(", "))
}

/// The name in a `[name]` that begins `text`, where one of `[[name]]` was expected.
fn single_header<'a>(message: &str, text: &'a str) -> Option<&'a str> {
    if !(message.starts_with("invalid type: table") && message.contains("expected an array")) {
        return None;
    }
    let (name, _) = text.strip_prefix('[')?.split_once(']')?;
    (!name.starts_with('[') && !name.contains('\n')).then(|| name.trim())
}

/// serde's words for what is wrong as someone who writes TOML would have them, and which name was probably meant.
pub fn explained(message: &str) -> String {
    let mut message = in_words(message);
    message.push_str(&did_you_mean(nearest_of_message(&message)));
    message
}

/// serde's words for what is wrong, in those of someone who writes TOML.
fn in_words(message: &str) -> String {
    let mut message = message
        .trim()
        .replace('\n', "; ")
        .replace("invalid type: sequence", "invalid type: array")
        .replace("invalid type: map", "invalid type: table")
        .replace("a sequence", "an array")
        .replace("a map", "a table");
    for (theirs, ours) in [("unknown field", "unknown key"), ("missing field", "missing key")] {
        if let Some(rest) = message.strip_prefix(theirs) {
            message = format!("{ours}{rest}");
        }
    }
    if let Some((before, _)) = message.split_once("expected struct ") {
        message = format!("{before}expected a table");
    }
    message
}

/// What others call a key, or what one expects it to be called, and what it is called here: no typing error would lead
/// from one to the other.
const OTHER_WORDS: [(&str, &str); 21] = [
    ("cube", "box"),
    ("cuboid", "box"),
    ("plane", "rectangle"),
    ("quad", "rectangle"),
    ("disk", "disc"),
    ("obj", "mesh"),
    ("ply", "mesh"),
    ("trianglemesh", "mesh"),
    ("metal", "conductor"),
    ("glass", "dielectric"),
    ("lambert", "diffuse"),
    ("lambertian", "diffuse"),
    ("matte", "diffuse"),
    ("envmap", "environment"),
    ("hdri", "environment"),
    ("sky", "environment"),
    ("medium", "interior"),
    ("bsdf", "material"),
    ("position", "origin"),
    ("look_at", "target"),
    ("max_depth", "max_length"),
];

/// "unknown key `x`, expected `a` or `b`": the known name nearest to `x`.
fn nearest_of_message(message: &str) -> Option<&str> {
    if !(message.starts_with("unknown key `") || message.starts_with("unknown variant `")) {
        return None;
    }
    // The parts between backticks: the unknown name first, the known ones after it.
    let mut quoted = message.split('`').skip(1).step_by(2);
    let name = quoted.next()?;
    let called = OTHER_WORDS.iter().filter(|(theirs, _)| *theirs == name);
    let known = |ours: &str| quoted.clone().find(|k| *k == ours);
    called.filter_map(|(_, ours)| known(ours)).next().or_else(|| nearest(name, quoted.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_count_lines_and_characters_from_one() {
        let source = Source::from_text("a.toml", "é = 1\nwidth = 3\n");
        assert_eq!(source.place(0), (1, 1));
        assert_eq!(source.place("é = ".len()), (1, 5));
        assert_eq!(source.place("é = 1\nwid".len()), (2, 4));
        assert_eq!(source.place(1000), (3, 1));
    }

    #[test]
    fn an_unknown_key_gets_the_nearest_known_one() {
        #[derive(serde::Deserialize, Debug)]
        #[serde(deny_unknown_fields)]
        struct Film {
            #[serde(rename = "width")]
            _width: u32,
            #[serde(rename = "height")]
            _height: u32,
        }
        let source = Source::from_text("a.toml", "width = 3\n  heigth = 4\n");
        let message = source.parse::<Film>().unwrap_err().to_string();
        assert!(message.starts_with("a.toml:2:3: unknown key `heigth`"), "{message}");
        assert!(message.ends_with("did you mean `height`?"), "{message}");
    }
}
