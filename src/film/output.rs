//! Files that are there whole or not at all.

use crate::error::{Error, Result};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use tempfile::{Builder, NamedTempFile};

/// What a file is written through: buffered, and able to seek.
pub type Output<'a> = BufWriter<&'a mut File>;

/// Writes the file at `path` by `write`, into a temporary file beside it that takes its name only when all is
/// written. An error leaves what was at `path` as it was, and nothing beside it; its message names `path`.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut Output) -> io::Result<()>) -> Result<()> {
    let failed = |e: io::Error| Error::io(path, "write the file", &e);
    let mut file = temporary_beside(path).map_err(failed)?;
    let mut output = BufWriter::new(file.as_file_mut());
    write(&mut output).and_then(|()| output.flush()).map_err(failed)?;
    drop(output);
    file.persist(path).map(drop).map_err(|e| failed(e.error))
}

/// Writes `bytes` to the file at `path` as [`write_atomically`] does.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomically(path, |output| output.write_all(bytes))
}

/// A temporary file in the directory of `path`, so that a rename reaches `path`, with the permissions that a
/// newly created file would have.
fn temporary_beside(path: &Path) -> io::Result<NamedTempFile> {
    if path.file_name().is_none() || path.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a directory"));
    }
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = Builder::new();
    builder.prefix(".tyndall-").suffix(".part");
    #[cfg(unix)]
    {
        // A temporary file is private by default; results are not. The process's umask still applies.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(directory)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_the_file_and_leaves_nothing_beside_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.txt");
        write_bytes(&path, b"one").unwrap();
        write_bytes(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[test]
    fn an_error_keeps_the_old_file_and_names_the_path() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.txt");
        write_bytes(&path, b"old").unwrap();
        let result = write_atomically(&path, |output| {
            output.write_all(b"half")?;
            Err(io::Error::other("the disk is full"))
        });
        let message = result.unwrap_err().to_string();
        assert!(message.contains("a.txt") && message.contains("the disk is full"), "{message}");
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_directory_and_a_directory_are_errors() {
        let directory = tempfile::tempdir().unwrap();
        assert!(write_bytes(&directory.path().join("no/a.txt"), b"").is_err());
        let message = write_bytes(directory.path(), b"").unwrap_err().to_string();
        assert!(message.contains("directory"), "{message}");
    }
}
