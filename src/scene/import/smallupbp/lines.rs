//! Files of lines: a key, and its values.

use super::super::Place;
use crate::error::{Error, Result};
use std::path::Path;
use std::sync::Arc;

/// A line that says something.
#[derive(Clone, Debug)]
pub(super) struct Line {
    /// Its first word.
    pub key: String,
    /// The rest of its words.
    pub values: Vec<String>,
    /// All of the rest, for names with blanks.
    pub rest: String,
    /// Where it stands.
    pub place: Place,
}

impl Line {
    /// Exactly so many numbers; what comes after them is left.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N]> {
        let mut numbers = [0.0; N];
        for (i, number) in numbers.iter_mut().enumerate() {
            let Some(word) = self.values.get(i) else {
                let message =
                    format!("{} values after `{}`, where {N} are needed", self.values.len(), self.key);
                return Err(self.place.error(message));
            };
            *number = match word.parse::<f64>() {
                Ok(x) if (x as f32).is_finite() => x,
                Ok(_) => return Err(self.place.error(format!("`{word}` is not a finite number"))),
                Err(_) => {
                    return Err(self.place.error(format!("`{word}` is not a number, after `{}`", self.key)));
                }
            };
        }
        Ok(numbers)
    }

    /// One number.
    pub fn number(&self) -> Result<f64> {
        self.numbers::<1>().map(|[x]| x)
    }

    /// A name: the whole rest of the line.
    pub fn name(&self) -> Result<&str> {
        match self.rest.is_empty() {
            true => Err(self.place.error(format!("there is no name after `{}`", self.key))),
            false => Ok(&self.rest),
        }
    }
}

/// The lines of a file without comments and empty ones.
pub(super) fn read(path: &Path) -> Result<Vec<Line>> {
    let bytes = std::fs::read(path).map_err(|e| Error::unreadable(path, &e))?;
    Ok(parse(path, &bytes))
}

/// As [`read`], of the file's bytes.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Vec<Line> {
    let path: Arc<Path> = path.into();
    // Comments and names may be in any encoding.
    let text = String::from_utf8_lossy(bytes);
    let mut lines = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        if key.is_empty() {
            continue;
        }
        lines.push(Line {
            key: key.to_owned(),
            values: rest.split_whitespace().map(str::to_owned).collect(),
            rest: rest.trim().to_owned(),
            place: Place::line(&path, i + 1),
        });
    }
    lines
}
