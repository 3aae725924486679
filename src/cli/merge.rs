//! `tyndall merge`: the parts of an experiment that several processes rendered become its results.

use super::args::MergeArgs;
use super::folder::announce;
use super::progress::Progress;
use super::run::{default_cache, open, show};
use super::session::{Ending, stop_on_interrupt, with_threads};
use crate::error::{Error, Result};
use crate::experiment::run::{self, CLOCK, Options, Part};
use crate::experiment::store::FOLDER;
use crate::film::output::write_bytes;
use crate::render::files::prepare_folder;
use std::path::{Path, PathBuf};

/// Copies what the folders have, measures it and writes the page. Nothing is rendered.
///
/// # Errors
/// A folder without anything to take over, or a reference that is nowhere; files that cannot be read or written.
pub fn run(args: &MergeArgs) -> Result<Ending> {
    let (plan, out, cache) = open(&args.of)?;
    announce(&args.of, &plan, &out);
    for dir in &args.from {
        let cells = dir.join(FOLDER);
        if !cells.is_dir() {
            return Err(Error::file(dir, "there are no runs here: 'tyndall run --shard' makes them"));
        }
        copy_missing(&cells, &out.join(FOLDER))?;
        copy_file(&cells.join(CLOCK), &out.join(FOLDER).join(CLOCK))?;
        let references = default_cache(dir);
        if references.is_dir() && references != cache {
            copy_missing(&references, &cache)?;
        }
    }
    let stop = stop_on_interrupt()?;
    let options = Options { out: &out, cache: &cache, stop: &stop, part: Part::Measure };
    let results = with_threads(args.of.threads, || run::run(&plan, &options, &mut Progress::new()))?;
    show(&out, &results)?;
    Ok(Ending::from(&stop))
}

/// Copies the files in the folders of a folder that are not in those of the other, each whole or not at all.
fn copy_missing(from: &Path, to: &Path) -> Result<()> {
    for folder in entries(from)?.into_iter().filter(|p| p.is_dir()) {
        let target = to.join(folder.file_name().unwrap_or_default());
        for file in entries(&folder)?.into_iter().filter(|p| p.is_file()) {
            let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if name != "lock" && !name.starts_with('.') {
                prepare_folder(&target)?;
                copy_file(&file, &target.join(&name))?;
            }
        }
    }
    Ok(())
}

/// Copies a file that is there to where none is.
fn copy_file(from: &Path, to: &Path) -> Result<()> {
    if !from.is_file() || to.exists() {
        return Ok(());
    }
    let bytes = std::fs::read(from).map_err(|e| Error::io(from, "read it", &e))?;
    write_bytes(to, &bytes)
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).map_err(|e| Error::io(folder, "read this folder", &e))?;
    Ok(entries.flatten().map(|e| e.path()).collect())
}
