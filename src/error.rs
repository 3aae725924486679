//! What can go wrong with a user's input, said once, with the file, the place and what to do.

use std::path::{Path, PathBuf};

/// Line and column, both from 1, in a text file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1; 0 where only the line is known.
    pub column: usize,
}

/// An error in what the user gave. Shown as one message; the process then ends with exit code 2.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Something in a file is wrong.
    #[error("{}{}: {message}", path.display(), place.map_or(String::new(), |p| if p.column > 0 { format!(":{}:{}", p.line, p.column) } else { format!(":{}", p.line) }))]
    File {
        /// The file as the user would name it.
        path: PathBuf,
        /// Where in the file, where it is known.
        place: Option<Place>,
        /// What is wrong and what to do about it.
        message: String,
    },
    /// Something on the command line, or in the combination of what was asked, is wrong.
    #[error("{0}")]
    Usage(String),
}

/// Result with the crate's [`enum@Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// An error in the file as a whole.
    pub fn file(path: impl AsRef<Path>, message: impl Into<String>) -> Self {
        Self::File { path: path.as_ref().to_owned(), place: None, message: message.into() }
    }

    /// An error at a place in a file.
    pub fn at(path: impl AsRef<Path>, line: usize, column: usize, message: impl Into<String>) -> Self {
        let place = Some(Place { line, column });
        Self::File { path: path.as_ref().to_owned(), place, message: message.into() }
    }

    /// A file that cannot be read or written.
    pub fn io(path: impl AsRef<Path>, doing: &str, error: &std::io::Error) -> Self {
        Self::file(path, format!("cannot {doing}: {error}"))
    }

    /// An error of the command line.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::Usage(message.into())
    }
}

/// The name nearest to `name` among `known`, where one is near enough to be meant: "did you mean …?".
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|k| (strsim::damerau_levenshtein(name, k), k))
        .filter(|(distance, k)| *distance <= 1 + k.len() / 3)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, k)| k)
}

/// The path from the root of the file system, as whoever reads it may stand elsewhere; as it is where the system
/// does not know where we stand.
pub fn from_root(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}
