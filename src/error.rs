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

    /// A file that was named and cannot be read: mostly because it is not there.
    pub fn unreadable(path: impl AsRef<Path>, error: &std::io::Error) -> Self {
        match error.kind() {
            std::io::ErrorKind::NotFound => Self::missing(path, "file"),
            _ => Self::io(path, "read it", error),
        }
    }

    /// A file that was named and is not there; `what` it should have been.
    pub fn missing(path: impl AsRef<Path>, what: &str) -> Self {
        let meant = did_you_mean(nearest_on_disk(Path::new(""), path.as_ref()));
        Self::file(path, format!("there is no such {what}{meant}"))
    }

    /// An error of the command line.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::Usage(message.into())
    }
}

/// The name nearest to `name` among `known`, where one is near enough to be meant: "did you mean …?". Of names that as many
/// slips lead to, the one with the same letters and the same start: `ubpb` is two slips from `bpt`, too.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let apart = |k: &str| 1.0 - strsim::jaro_winkler(name, k);
    known
        .into_iter()
        .map(|k| (strsim::damerau_levenshtein(name, k), apart(k), k))
        .filter(|(distance, _, k)| *distance <= 1 + k.len() / 3)
        .min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))
        .map(|(_, _, k)| k)
}

/// "; did you mean `…`?" after what is wrong with a name; nothing where none was meant.
pub fn did_you_mean(meant: Option<impl std::fmt::Display>) -> String {
    meant.map_or(String::new(), |meant| format!("; did you mean `{meant}`?"))
}

/// What a path that leads nowhere was probably meant to be, as seen from a folder (empty: where the program was started): with the
/// nearest name in place of the first part that is not there, if the path leads somewhere then.
pub fn nearest_on_disk(from: &Path, path: &Path) -> Option<String> {
    let there = |path: &Path| from.join(path).exists();
    let missing = path.ancestors().take_while(|p| !p.as_os_str().is_empty() && !there(p)).last()?;
    let folder = missing.parent()?;
    let rest = path.strip_prefix(missing).ok()?;
    let place = from.join(folder);
    let entries =
        std::fs::read_dir(if place.as_os_str().is_empty() { Path::new(".") } else { &place }).ok()?;
    let mut names: Vec<String> = entries.flatten().filter_map(|e| e.file_name().into_string().ok()).collect();
    // Nothing after it: a slash would make a folder of a file.
    let whole =
        |name: &str| if rest == Path::new("") { folder.join(name) } else { folder.join(name).join(rest) };
    names.retain(|name| there(&whole(name)));
    names.sort();
    let meant = nearest(missing.file_name()?.to_str()?, names.iter().map(String::as_str))?;
    Some(whole(meant).display().to_string())
}

/// The path from the root of the file system, as whoever reads it may stand elsewhere; as it is where the system
/// does not know where we stand.
pub fn from_root(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bug that this keeps out: `ubpb` taken for `bpt`, which is as many slips away and comes first.
    #[test]
    fn letters_in_another_order_are_near() {
        let presets = ["pt", "lt", "bpt", "ppm", "bpm", "vcm", "points", "beams", "upbp"];
        for (name, meant) in
            [("ubpb", "upbp"), ("uppb", "upbp"), ("btp", "bpt"), ("vmc", "vcm"), ("baems", "beams")]
        {
            assert_eq!(nearest(name, presets), Some(meant), "{name}");
        }
        assert_eq!(nearest("metropolis", presets), None);
        // The first of those that are as near in every way.
        assert_eq!(nearest("b", ["ab", "cb"]), Some("ab"));
    }

    #[test]
    fn paths_are_followed_to_where_they_end() {
        let root = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(root.path().join("scenes/fog-cornell")).unwrap();
        std::fs::create_dir_all(root.path().join("scenes/fog-corner")).unwrap();
        std::fs::write(root.path().join("scenes/fog-cornell/scene.toml"), "").unwrap();
        let meant = |path: &str| nearest_on_disk(root.path(), Path::new(path));
        for (path, expected) in [
            ("scenes/fog-cornel", "scenes/fog-cornell"),
            // Where there is such a file.
            ("scenes/fog-corne/scene.toml", "scenes/fog-cornell/scene.toml"),
            ("scene/fog-cornell/scene.toml", "scenes/fog-cornell/scene.toml"),
            ("scenes/fog-cornell/scen.toml", "scenes/fog-cornell/scene.toml"),
            ("scenes/../scene", "scenes/../scenes"),
        ] {
            assert_eq!(meant(path).as_deref(), Some(expected));
        }
        assert_eq!(meant("scenes/still-life"), None);
        assert_eq!(meant("scenes/fog-cornell"), None, "it is there");
        let whole = root.path().join("scenes/fog-cornel");
        assert_eq!(nearest_on_disk(Path::new(""), &whole), Some(format!("{}l", whole.display())));
    }
}
