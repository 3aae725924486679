//! Which files of figures the report made: those that it does not make any more are taken away, and nothing else is.

use crate::error::{Error, Result};
use crate::film::output::write_bytes;
use std::collections::BTreeMap;
use std::path::Path;

/// The list, in the folder of figures.
const FILE_NAME: &str = "made.json";
/// What figures are written as.
const KINDS: [&str; 3] = ["svg", "pdf", "png"];

/// By name, check sums of the files.
pub(super) type Made = BTreeMap<String, u32>;

/// The check sum of a file's contents.
pub(super) fn sum_of(bytes: &[u8]) -> u32 {
    crc32fast::hash(bytes)
}

/// Deletes what an earlier report made in this folder, where it is still as it was made and is not among what was `made` now;
/// and writes down what was. What somebody else put there or has changed stays.
///
/// # Errors
/// A list that cannot be written. What cannot be deleted stays.
pub(super) fn tidy(folder: &Path, made: &Made) -> Result<()> {
    let path = folder.join(FILE_NAME);
    // Without a list, or with a damaged one, nothing is known to be ours.
    let before: Made =
        std::fs::read(&path).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok()).unwrap_or_default();
    for (name, sum) in before.iter().filter(|(name, _)| !made.contains_key(*name) && is_figure(name)) {
        let file = folder.join(name);
        if std::fs::read(&file).is_ok_and(|bytes| sum_of(&bytes) == *sum) {
            let _ = std::fs::remove_file(file);
        }
    }
    let list = serde_json::to_vec_pretty(made).map_err(|e| Error::file(&path, e.to_string()))?;
    write_bytes(&path, &list)
}

/// Whether it is the name of a file in the folder itself, of a kind that figures have.
fn is_figure(name: &str) -> bool {
    let path = Path::new(name);
    let kind = path.extension().and_then(|e| e.to_str());
    path.file_name().is_some_and(|file| file == name) && kind.is_some_and(|kind| KINDS.contains(&kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bug that this keeps out: figures of a metric that was taken out of the experiment, beside those of now.
    #[test]
    fn only_what_was_made_before_is_taken_away() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("figures");
        std::fs::create_dir(&folder).unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
        let there = |name: &str| folder.join(name).exists();
        let made = |names: &[&str]| -> Made {
            names.iter().map(|n| ((*n).to_owned(), sum_of(n.as_bytes()))).collect()
        };
        for name in ["a.svg", "b.svg", "c.png", "theirs.svg", "../outside.svg", "notes.txt"] {
            write(name, name);
        }
        // The first report knows of nothing before it.
        tidy(&folder, &made(&["a.svg", "b.svg", "c.png", "../outside.svg", "notes.txt"])).unwrap();
        assert!(there("theirs.svg") && there("b.svg"));
        write("c.png", "changed by hand");
        tidy(&folder, &made(&["a.svg"])).unwrap();
        assert!(there("a.svg") && !there("b.svg"), "made before, and not any more");
        assert!(there("c.png") && there("theirs.svg"), "of somebody else");
        assert!(there("../outside.svg") && there("notes.txt"), "no figures in this folder");
        write(FILE_NAME, "damaged");
        tidy(&folder, &made(&[])).unwrap();
        assert!(there("a.svg"), "nothing was known");
    }
}
