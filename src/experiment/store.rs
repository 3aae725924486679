//! Runs on disk, as far as they have come, so that an experiment goes on where it was.
//!
//! Each run (scene × estimator × seed) has a folder `cells/<scene>-<estimator>-<run>-<hash>` in the folder of results. The hash is of
//! all that decides its samples: the contents of the scene's files, the settings, the seed, the code that renders
//! ([`RENDERING`]), and, where the clock decides when it ends, the machine and its threads. In it is
//! the state after so many iterations, `0000000064.film`: a header, the film's sums in f64, the images of earlier checkpoints, and
//! a check sum. A state is written beside and renamed, then its predecessor is deleted: a process that is killed leaves one or the other.
//! What is damaged is rendered again.
//!
//! Blocks of a run may be rendered ahead of those before them, by other processes ([`super::handout`]): each is a file like a
//! state, `ahead/0000000016-0000000032.film`, until whoever comes to its start adds it.
//!
//! Whoever renders a run holds the lock on the file `lock` in its folder. The system gives it up when the process ends,
//! however it ends. Others leave that run to its holder and take another.

use super::contents;
use super::hash::Hasher;
use crate::error::{Error, Result};
use crate::film::output::write_atomically;
use crate::film::{Dropped, Film, Image, Planes};
use crate::render::files::{RENDERING, Resolved, prepare_folder};
use crate::render::{Budget, Outcome, Spent};
use crate::scene::Scene;
use crate::transport::settings::Settings;
use crate::transport::technique::Technique;
use serde::{Deserialize, Serialize};
use std::fs::{File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The folder in the folder of results.
pub const FOLDER: &str = "cells";
/// The folder therein with what techniques cost.
pub const COSTS: &str = "costs";
/// The folder in a run's with blocks that were rendered ahead of those before them.
const AHEAD: &str = "ahead";
/// First line of a state.
const MAGIC: &[u8] = b"tyndall film 2\n";
/// Ends the name of a state.
const EXTENSION: &str = "film";

/// What the image of a run is called, in the folder of its estimator.
pub fn image_file(run: u32) -> String {
    format!("run-{run:02}.exr")
}

/// The run that a file is of which is called as [`image_file`] calls it.
pub fn run_of(name: &str) -> Option<u32> {
    let run = name.strip_prefix("run-")?.strip_suffix(".exr")?.parse().ok()?;
    (image_file(run) == name).then_some(run)
}

/// An image on the way.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Iterations it is of.
    pub iterations: u64,
    /// Seconds of rendering until then.
    pub seconds: f64,
    /// The image.
    pub image: Image,
}

/// A run as far as it has come.
#[derive(Clone, Debug)]
pub struct State {
    /// The sums.
    pub outcome: Outcome,
    /// What was rendered, with the radii and counts that were chosen.
    pub resolved: Resolved,
    /// After 1, 2, 4, 8 … iterations, but not at the end.
    pub snapshots: Vec<Snapshot>,
    /// The budget that ended here.
    pub ended: Option<Budget>,
    /// When the last of its iterations was rendered, UTC; none in states from before this was kept.
    pub rendered: Option<String>,
}

/// What stands before the numbers of a state.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Header {
    key: String,
    /// Iterations.
    pub iterations: u64,
    /// Seconds of rendering.
    pub seconds: f64,
    setup: f64,
    #[serde(default)]
    waited: f64,
    camera_paths: u64,
    light_paths: u64,
    light_vertices: u64,
    beams: u64,
    merges: Vec<(String, String)>,
    dropped: Vec<u64>,
    resolved: Resolved,
    planes: Vec<bool>,
    snapshots: Vec<(u64, f64)>,
    /// The budget that ended here.
    pub ended: Option<Budget>,
    #[serde(default)]
    rendered: Option<String>,
}

/// Names a run, and tells what decides its samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unit {
    folder: PathBuf,
    key: String,
}

/// What the runs of a scene have in common.
#[derive(Clone, Debug)]
pub struct SceneKey {
    key: String,
    contents: String,
}

impl SceneKey {
    /// Of the contents of a scene's files, and the size of its images.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn new(scene: &Scene) -> Result<Self> {
        let mut hasher = Hasher::default();
        hasher.field(RENDERING.as_bytes());
        let (size, crop) = (scene.camera.size(), scene.camera.crop());
        hasher.field(format!("{size} {} {} {} {}", crop.x0, crop.y0, crop.x1, crop.y1).as_bytes());
        let mut contents = Hasher::default();
        contents::add(&mut contents, scene)?;
        let contents = contents.hex();
        hasher.field(contents.as_bytes());
        Ok(Self { key: hasher.hex(), contents })
    }

    /// Names the contents of the scene's files alone, whatever code renders them and in which size.
    pub fn contents(&self) -> &str {
        &self.contents
    }
}

impl Unit {
    /// Of run `run` of an estimator, by their names, with these settings; `ends` is what beside the samples decides where it
    /// ends.
    pub fn new(
        out: &Path,
        scene: (&str, &SceneKey),
        estimator: &str,
        run: u32,
        settings: &Settings,
        ends: &str,
    ) -> Self {
        let Settings {
            techniques,
            left_out,
            heuristic,
            connections,
            light_starts,
            tracking,
            merging,
            min_length,
            max_length,
            paths,
            seed,
            layers,
            pyramid,
        } = settings;
        let mut hasher = Hasher::default();
        hasher.field(scene.1.key.as_bytes());
        let words = format!(
            "{techniques} {heuristic:?} {connections:?} {tracking:?} {merging:?} {min_length} {max_length}"
        );
        hasher
            .field(words.as_bytes())
            .field(format!("{light_starts:?}").as_bytes())
            .field(&paths.fingerprint());
        hasher.field(format!("{seed} {layers:?} {pyramid} {left_out}").as_bytes()).field(ends.as_bytes());
        let key = hasher.hex();
        let name = format!("{}-{estimator}-{run:02}-{}", scene.0, &key[..16]);
        Self { folder: out.join(FOLDER).join(name), key }
    }

    /// Its folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Takes the run's lock. None where another process has it.
    ///
    /// # Errors
    /// A folder that cannot be made or written into.
    pub fn lock(&self) -> Result<Option<Held<'_>>> {
        prepare_folder(&self.folder)?;
        let Some(lock) = lock(&self.folder)? else { return Ok(None) };
        // What a killed process left half written: nobody else writes here.
        for path in files(&self.folder)?.filter(|p| is_partial(p)) {
            let _ = std::fs::remove_file(path);
        }
        Ok(Some(Held { unit: self, _lock: lock }))
    }

    /// Whether another process has the lock, as far as can be told.
    pub fn is_busy(&self) -> bool {
        is_busy(&self.folder)
    }

    /// The states that are there, the longest first.
    fn states(&self) -> Vec<(u64, PathBuf)> {
        let Ok(files) = files(&self.folder) else { return Vec::new() };
        let count = |path: &PathBuf| {
            let name = path.file_name()?.to_str()?.strip_suffix(EXTENSION)?.strip_suffix('.')?;
            name.parse().ok()
        };
        let mut found: Vec<(u64, PathBuf)> = files.filter_map(|p| Some((count(&p)?, p))).collect();
        found.sort_by(|a, b| b.cmp(a));
        found
    }

    /// The blocks that were rendered ahead: first iteration and end.
    pub fn blocks_ahead(&self) -> Vec<(u64, u64)> {
        let Ok(files) = files(&self.folder.join(AHEAD)) else { return Vec::new() };
        let range = |path: PathBuf| {
            let name = path.file_name()?.to_str()?.strip_suffix(EXTENSION)?.strip_suffix('.')?;
            let (first, end) = name.split_once('-')?;
            Some((first.parse().ok()?, end.parse().ok()?))
        };
        let mut found: Vec<(u64, u64)> = files.filter_map(range).collect();
        found.sort_unstable();
        found
    }

    fn ahead_path(&self, first: u64, end: u64) -> PathBuf {
        self.folder.join(AHEAD).join(format!("{first:010}-{end:010}.{EXTENSION}"))
    }

    /// A block that was rendered ahead, if it is there and whole.
    pub fn ahead(&self, first: u64, end: u64, empty: &Film) -> Option<State> {
        let block = read(&self.ahead_path(first, end), &self.key, empty).ok()?;
        (block.outcome.film.iterations() == end - first).then_some(block)
    }

    /// Seconds of rendering that a block took which was rendered ahead, if it is there.
    pub fn seconds_ahead(&self, first: u64, end: u64) -> Option<f64> {
        Some(read_header(&self.ahead_path(first, end), &self.key).ok()?.seconds)
    }

    /// Writes a block that was rendered ahead.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn save_ahead(&self, first: u64, end: u64, block: &State) -> Result<()> {
        prepare_folder(&self.folder.join(AHEAD))?;
        write(&self.ahead_path(first, end), &self.key, block)
    }

    /// What is known of the longest state that serves a budget, from its header alone.
    pub fn peek(&self, budget: Budget) -> Option<Header> {
        let headers = self.states().into_iter().filter_map(|(_, path)| read_header(&path, &self.key).ok());
        headers.into_iter().find(|h| h.serves(budget))
    }

    /// The longest state that serves a budget. What is damaged is noted, and passed over.
    pub fn load(&self, budget: Budget, empty: &Film, note: &mut dyn FnMut(&str)) -> Option<State> {
        for (_, path) in self.states() {
            let header = read_header(&path, &self.key);
            if header.as_ref().is_ok_and(|h| !h.serves(budget)) {
                continue;
            }
            match header.and_then(|_| read(&path, &self.key, empty)) {
                Ok(state) => return Some(state),
                Err(e) => note(&format!("{e}: rendered again")),
            }
        }
        None
    }
}

impl Header {
    /// Whether a run with this budget comes by this state.
    fn serves(&self, budget: Budget) -> bool {
        if self.is_done(budget) {
            return true;
        }
        let spent = self.spent();
        // Where the error ended it, it may have been reached long before; where the bounds did, it was not.
        let unreached = self.ended.is_none_or(|old| !old.goes_on(spent));
        match budget {
            Budget::Spp(spp) => self.iterations <= spp,
            Budget::Seconds(_) => budget.goes_on(spent),
            Budget::RelMse { .. } => unreached && budget.goes_on(spent),
        }
    }

    /// Whether a run with this budget ends with this state.
    pub fn is_done(&self, budget: Budget) -> bool {
        ends(self.ended, budget, self.spent())
    }

    fn spent(&self) -> Spent {
        Spent { iterations: self.iterations, seconds: self.seconds, setup: self.setup }
    }
}

impl State {
    /// Whether a run with this budget ends with this state.
    pub fn is_done(&self, budget: Budget) -> bool {
        ends(self.ended, budget, self.outcome.spent())
    }
}

/// Whether a budget ends where `ended` did, after what was spent.
fn ends(ended: Option<Budget>, budget: Budget, spent: Spent) -> bool {
    match (ended, budget) {
        (_, Budget::Spp(spp)) => spp == spent.iterations,
        (Some(old @ Budget::RelMse { target: a, .. }), Budget::RelMse { target: b, .. }) => {
            // The same, or both short of their bounds: then the error was reached.
            old == budget || a == b && old.goes_on(spent) && budget.goes_on(spent)
        }
        (ended, _) => ended == Some(budget),
    }
}

/// A run whose lock is held.
pub struct Held<'a> {
    unit: &'a Unit,
    _lock: Option<File>,
}

impl Held<'_> {
    /// What is held.
    pub fn unit(&self) -> &Unit {
        self.unit
    }

    /// Writes a state, whole or not at all, and deletes those that came before it.
    ///
    /// # Errors
    /// Where it cannot be written: those before it are still there.
    pub fn save(&self, state: &State) -> Result<()> {
        let iterations = state.outcome.film.iterations();
        let path = self.unit.folder.join(format!("{iterations:010}.{EXTENSION}"));
        write(&path, &self.unit.key, state)?;
        for (_, earlier) in self.unit.states().into_iter().filter(|(count, _)| *count < iterations) {
            // A state too many does no harm.
            let _ = std::fs::remove_file(earlier);
        }
        for (first, end) in self.unit.blocks_ahead().into_iter().filter(|(_, end)| *end <= iterations) {
            let _ = std::fs::remove_file(self.unit.ahead_path(first, end));
        }
        // Only where nothing is in it.
        let _ = std::fs::remove_dir(self.unit.folder.join(AHEAD));
        Ok(())
    }
}

/// The lock on a folder: none where another process has it, none within where the file system has no locks.
///
/// # Errors
/// A folder that cannot be written into.
pub fn lock(folder: &Path) -> Result<Option<Option<File>>> {
    let path = folder.join("lock");
    let open = File::options().create(true).truncate(false).write(true).open(&path);
    let file = open.map_err(|e| Error::io(&path, "open it", &e))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(Some(file))),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(e)) if e.kind() == io::ErrorKind::Unsupported => Ok(Some(None)),
        Err(TryLockError::Error(e)) => Err(Error::io(&path, "lock it", &e)),
    }
}

/// Whether another process has the lock on a folder, as far as can be told.
pub fn is_busy(folder: &Path) -> bool {
    let Ok(file) = File::open(folder.join("lock")) else { return false };
    matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock))
}

/// Whether a file's name is that of one that is being written.
pub(super) fn is_partial(path: &Path) -> bool {
    let name = path.file_name().map(|n| n.to_string_lossy());
    name.is_some_and(|n| n.starts_with(".tyndall-"))
}

fn files(folder: &Path) -> Result<impl Iterator<Item = PathBuf> + use<>> {
    let entries = std::fs::read_dir(folder).map_err(|e| Error::io(folder, "read this folder", &e))?;
    Ok(entries.flatten().map(|e| e.path()))
}

/// Passes bytes on, and keeps a check sum of them.
struct Summed<W> {
    inner: W,
    sum: crc32fast::Hasher,
}

impl<W: Write> Write for Summed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.sum.update(&bytes[..written]);
        Ok(written)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

fn write(path: &Path, key: &str, state: &State) -> Result<()> {
    let outcome = &state.outcome;
    let planes = outcome.film.planes();
    let header = Header {
        key: key.to_owned(),
        iterations: outcome.film.iterations(),
        seconds: outcome.seconds,
        setup: outcome.setup,
        waited: outcome.waited,
        camera_paths: outcome.camera_paths,
        light_paths: outcome.light_paths,
        light_vertices: outcome.light_vertices,
        beams: outcome.beams,
        merges: outcome.merges.clone(),
        dropped: outcome.film.dropped().0.to_vec(),
        resolved: state.resolved.clone(),
        planes: planes.0.clone(),
        snapshots: state.snapshots.iter().map(|s| (s.iterations, s.seconds)).collect(),
        ended: state.ended,
        rendered: state.rendered.clone(),
    };
    let header = serde_json::to_vec(&header).map_err(|e| Error::file(path, e.to_string()))?;
    write_atomically(path, |output| {
        let mut output = Summed { inner: output, sum: crc32fast::Hasher::new() };
        output.write_all(MAGIC)?;
        output.write_all(&(header.len() as u64).to_le_bytes())?;
        output.write_all(&header)?;
        outcome.film.write_planes(&planes, &mut output)?;
        for snapshot in &state.snapshots {
            let bytes: Vec<u8> =
                snapshot.image.pixels.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
            output.write_all(&bytes)?;
        }
        let sum = output.sum.clone().finalize();
        output.write_all(&sum.to_le_bytes())
    })
}

fn damaged(path: &Path) -> Error {
    Error::file(path, "is damaged")
}

/// The header of a state, and what comes after it.
fn split<'a>(path: &Path, key: &str, bytes: &'a [u8]) -> Result<(Header, &'a [u8])> {
    let parse = || {
        let rest = bytes.strip_prefix(MAGIC)?;
        let (length, rest) = rest.split_at_checked(8)?;
        let length = u64::from_le_bytes(length.try_into().ok()?);
        let (header, rest) = rest.split_at_checked(length.try_into().ok()?)?;
        let header: Header = serde_json::from_slice(header).ok()?;
        (header.key == key).then_some((header, rest))
    };
    parse().ok_or_else(|| damaged(path))
}

fn read_header(path: &Path, key: &str) -> Result<Header> {
    use std::io::Read;
    let failed = |e: io::Error| Error::io(path, "read it", &e);
    let mut file = File::open(path).map_err(failed)?;
    let mut start = vec![0; MAGIC.len() + 8];
    file.read_exact(&mut start).map_err(|_| damaged(path))?;
    let length = u64::from_le_bytes(start[MAGIC.len()..].try_into().expect("eight bytes"));
    if length > 1 << 24 {
        return Err(damaged(path));
    }
    let whole = start.len() + length as usize;
    start.resize(whole, 0);
    file.read_exact(&mut start[MAGIC.len() + 8..]).map_err(|_| damaged(path))?;
    Ok(split(path, key, &start)?.0)
}

fn read(path: &Path, key: &str, empty: &Film) -> Result<State> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read it", &e))?;
    let (bytes, sum) = bytes.split_last_chunk::<4>().ok_or_else(|| damaged(path))?;
    if crc32fast::hash(bytes) != u32::from_le_bytes(*sum) {
        return Err(damaged(path));
    }
    let (header, rest) = split(path, key, bytes)?;
    state(header, rest, empty).ok_or_else(|| damaged(path))
}

fn state(header: Header, bytes: &[u8], empty: &Film) -> Option<State> {
    let mut film = empty.clone();
    let planes = Planes(header.planes);
    let (sums, mut images) = bytes.split_at_checked(film.bytes_of(&planes))?;
    film.read_planes(header.iterations, &planes, sums)?;
    film.set_dropped(Dropped(header.dropped.try_into().ok()?));
    let (width, height) = film.size();
    let mut snapshots = Vec::new();
    for (iterations, seconds) in header.snapshots {
        let (image, rest) = images.split_at_checked(width * height * 12)?;
        images = rest;
        let value = |b: &[u8]| f32::from_le_bytes(b.try_into().expect("four bytes"));
        let pixels = image.chunks_exact(12).map(|p| [&p[..4], &p[4..8], &p[8..]].map(value)).collect();
        snapshots.push(Snapshot { iterations, seconds, image: Image { width, height, pixels } });
    }
    let outcome = Outcome {
        film,
        seconds: header.seconds,
        setup: header.setup,
        waited: header.waited,
        camera_paths: header.camera_paths,
        light_paths: header.light_paths,
        light_vertices: header.light_vertices,
        beams: header.beams,
        merges: header.merges,
        partial: false,
    };
    let Header { resolved, ended, rendered, .. } = header;
    images.is_empty().then_some(State { outcome, resolved, snapshots, ended, rendered })
}

const _: () = assert!(Technique::COUNT == size_of::<Dropped>() / 8, "the header has a count a technique");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_of_runs_are_known_by_their_names() {
        for run in [0, 7, 99, 100, 12345] {
            assert_eq!(run_of(&image_file(run)), Some(run));
        }
        for other in ["mean.exr", "run-.exr", "run-7.exr", "run-00.png", "run--1.exr", "run-00-old.exr"] {
            assert_eq!(run_of(other), None, "{other}");
        }
    }
}
