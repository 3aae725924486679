//! References: what estimators are measured against, read from a file or rendered once and kept.
//!
//! A rendered reference lies in a folder of its own, named by a hash of all that it depends on: the contents of the
//! scene's files, size and crop, techniques, how they merge (radii and counts as they come out in this scene), which paths
//! and of which lengths, seed, and the code that renders ([`RENDERING`]): after a change there, no old image is taken for the
//! new code's. In it are blocks of iterations, each an EXR with mean and variance. When more samples are asked for than are there, further blocks
//! are rendered; the blocks together are the weighted means of their images and variances. Blocks end at numbers of
//! iterations that depend on the image's size alone, so that the same request gives the same bits everywhere.

use super::blocks::{Block, Sum};
use super::hash::{Hasher, REFERENCE_SEED};
use super::metrics::{Metric, TABLE};
use super::plan::{Lengths, ReferencePlan, ScenePlan};
use super::results::ReferenceKind;
use super::store::{self, SceneKey};
use crate::error::{Error, Result};
use crate::film::Image;
use crate::film::exr;
use crate::render::files::{MADE_BY, RENDERING, Resolved, VARIANCE, layered, made_by, prepare_folder};
use crate::render::{Budget, Job, Observer, Stop};
use crate::scene::Scene;
use crate::transport::expression::Expression;
use crate::transport::settings::Settings;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

/// Samples of the longest block: iterations times pixels.
const LONGEST_BLOCK: u64 = 1 << 25;
/// How often it is looked whether another process is done.
pub(super) const WAIT: Duration = Duration::from_millis(200);

/// A reference that is there.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Where it comes from.
    pub kind: ReferenceKind,
    /// The image.
    pub image: Image,
    /// The variance of its pixels, where known.
    pub variance: Option<Image>,
    /// Samples per pixel, where known.
    pub spp: Option<u64>,
    /// How long it took to render, where known.
    pub seconds: Option<f64>,
    /// Bounds on the lengths of its paths, where known.
    pub lengths: Lengths,
    /// Which paths it has, where known.
    pub paths: Option<Expression>,
    /// Names its random numbers, where known.
    pub seed: Option<u64>,
    /// Program, code and settings that rendered it, as metadata of an EXR ([`MADE_BY`]), as far as known.
    pub made_by: Vec<(String, String)>,
    /// Whether it is short of what was asked for.
    pub partial: bool,
    /// What its noise adds to each metric that was asked for.
    pub(super) noise: Noise,
}

/// By the number of the metric; each is computed once, as a run is measured at every checkpoint.
pub(super) type Noise = [OnceLock<Option<f64>>; TABLE.len()];

impl Truth {
    /// What its own noise adds to a metric; none where that is not known, or it is not one to which it adds up.
    ///
    /// # Errors
    /// A variance that does not belong to the image.
    pub fn noise(&self, metric: Metric) -> Result<Option<f64>> {
        let known = &self.noise[metric as usize];
        if let Some(noise) = known.get() {
            return Ok(*noise);
        }
        let noise = match &self.variance {
            Some(variance) => metric.reference_noise(&self.image, variance)?,
            None => None,
        };
        Ok(*known.get_or_init(|| noise))
    }

    /// Names the image and what is known of its variance.
    pub fn fingerprint(&self) -> String {
        let mut hasher = Hasher::default();
        let bytes = |image: &Image| -> Vec<u8> {
            image.pixels.iter().flatten().flat_map(|v| v.to_le_bytes()).collect()
        };
        hasher.field(&bytes(&self.image)).field(&self.variance.as_ref().map(bytes).unwrap_or_default());
        hasher.hex()
    }
}

/// Where references are kept, and who follows their making.
pub struct Maker<'a> {
    /// The folder of all references.
    pub cache: &'a Path,
    /// To stop early.
    pub stop: &'a Stop,
    /// Told what goes on.
    pub observer: &'a mut dyn Observer,
    /// Whether what is there has to do.
    pub frozen: bool,
}

impl Maker<'_> {
    /// The reference of a scene, whose contents `key` names, from its file or from the cache, rendered as far as it is not there.
    ///
    /// # Errors
    /// A file that cannot be read or is of another size; a cache that cannot be written.
    pub fn obtain(&mut self, plan: &ScenePlan, scene: &Scene, key: &SceneKey) -> Result<Option<Truth>> {
        match &plan.reference {
            None => Ok(None),
            Some(ReferencePlan::File { path, file }) => read_file(path, file, scene).map(Some),
            Some(ReferencePlan::Render { .. }) => {
                let making = self.making(plan, scene, key)?.expect("it is to be rendered");
                self.render(plan, scene, &making).map(Some)
            }
        }
    }

    /// How the reference of a scene is made, if it is rendered.
    ///
    /// # Errors
    /// Settings that make no sense.
    pub fn making(&self, plan: &ScenePlan, scene: &Scene, key: &SceneKey) -> Result<Option<Making>> {
        let Some(ReferencePlan::Render { techniques, tracking, merging, paths, budget }) = &plan.reference
        else {
            return Ok(None);
        };
        let defaults = Lengths::from(scene.notes.defaults);
        let mut settings = plan.settings(defaults, Lengths::default(), *techniques)?;
        settings.paths = **paths;
        settings.seed = REFERENCE_SEED;
        settings.tracking = *tracking;
        settings.merging = **merging;
        settings.check_scene(scene)?;
        let settings = settings.pinned(scene);
        let resolved = Resolved::new(&plan.file, scene, &settings);
        let name = format!("{}-{}", plan.key, &fingerprint(key, &settings, &resolved)[..16]);
        Ok(Some(Making { dir: self.cache.join(name), settings, resolved, budget: *budget }))
    }

    fn render(&mut self, plan: &ScenePlan, scene: &Scene, making: &Making) -> Result<Truth> {
        let Making { dir, settings, budget, .. } = making;
        let budget = *budget;
        prepare_folder(dir)?;
        let _lock = if self.frozen { None } else { self.wait_for(dir, &plan.key)? };
        let mut sum = Sum::new(film_size(scene));
        self.add_blocks(dir, &mut sum)?;
        let there = sum.iterations;
        let needed = budget.goes_on(sum.spent()) && !self.frozen;
        if needed {
            let added = if there > 0 { format!(", {there} spp are there") } else { String::new() };
            self.observer.begin(&format!("{}: reference ({}{added})", plan.key, settings.techniques), budget);
            let extended = self.extend(&mut sum, scene, making);
            self.observer.end();
            extended?;
        } else {
            self.observer.note(&format!("{}: reference of {there} spp found in {}", plan.key, dir.display()));
        }
        if sum.iterations == 0 && self.frozen {
            return Err(Error::file(dir, "there is no reference here yet: 'tyndall run' renders it"));
        }
        if sum.iterations == 0 {
            return Err(Error::usage("stopped before the reference had a single sample"));
        }
        let (image, variance) = sum.images();
        Ok(Truth {
            kind: ReferenceKind::Estimator(settings.techniques.to_string()),
            image,
            variance: (sum.iterations > 1).then_some(variance),
            spp: Some(sum.iterations),
            seconds: Some(sum.seconds),
            lengths: Lengths { min: Some(settings.min_length), max: Some(settings.max_length) },
            paths: Some(settings.paths),
            seed: Some(settings.seed),
            made_by: made_by(&making.resolved),
            partial: budget.goes_on(sum.spent()),
            noise: Noise::default(),
        })
    }

    /// Adds the blocks on disk that come next, one after the other.
    fn add_blocks(&mut self, dir: &Path, sum: &mut Sum) -> Result<()> {
        for path in blocks(dir)? {
            match read_block(&path, sum.iterations) {
                Ok(Some(block)) => sum.add(&block),
                Ok(None) => {}
                Err(e) => self.observer.note(&format!("{e}: rendered again")),
            }
        }
        Ok(())
    }

    /// The lock on a reference's folder, once no other process has it.
    fn wait_for(&mut self, dir: &Path, scene: &str) -> Result<Option<File>> {
        let mut said = false;
        loop {
            if let Some(lock) = store::lock(dir)? {
                return Ok(lock);
            }
            if self.stop.requested() {
                return Err(Error::usage("stopped while another process renders the reference"));
            }
            if !std::mem::replace(&mut said, true) {
                self.observer
                    .note(&format!("{scene}: another process renders the reference: waiting for it"));
            }
            std::thread::sleep(WAIT);
        }
    }

    fn extend(&mut self, sum: &mut Sum, scene: &Scene, making: &Making) -> Result<()> {
        while making.budget.goes_on(sum.spent()) && !self.stop.requested() {
            let count = next_block(sum.iterations, sum.seconds, sum.pixels(), making.budget);
            let before = (sum.iterations, sum.seconds);
            let Some(block) = making.block(scene, before, count, self.stop, self.observer)? else { break };
            sum.add(&block);
            // Blocks that were rendered ahead.
            self.add_blocks(&making.dir, sum)?;
            self.observer.advance(sum.iterations, sum.seconds);
        }
        Ok(())
    }
}

/// How a reference is made, and where it lies.
#[derive(Clone, Debug)]
pub struct Making {
    /// The folder of its blocks.
    dir: PathBuf,
    /// With radii and counts as they come out in this scene.
    settings: Settings,
    resolved: Resolved,
    /// At least this much.
    budget: Budget,
}

impl Making {
    /// Where its blocks lie.
    pub fn folder(&self) -> &Path {
        &self.dir
    }

    /// At least this much.
    pub fn budget(&self) -> Budget {
        self.budget
    }

    /// Iterations and seconds of the blocks on disk that come one after the other.
    pub fn there(&self) -> (u64, f64) {
        let (mut iterations, mut seconds) = (0, 0.0);
        for path in blocks(&self.dir).unwrap_or_default() {
            if let Ok(Some(block)) = read_block(&path, iterations) {
                (iterations, seconds) = (iterations + block.iterations, seconds + block.seconds);
            }
        }
        (iterations, seconds)
    }

    /// The blocks that are missing, as first iterations and counts; none where the clock says where blocks end.
    ///
    /// # Errors
    /// A folder that cannot be read or made.
    pub fn missing(&self, scene: &Scene) -> Result<Option<Vec<(u64, u64)>>> {
        let Budget::Spp(spp) = self.budget else { return Ok(None) };
        prepare_folder(&self.dir)?;
        let there = blocks(&self.dir)?;
        let (width, height) = film_size(scene);
        let (mut at, mut missing) = (0, Vec::new());
        while at < spp {
            let found = there.iter().filter_map(|p| block_range(p)).find(|(first, _)| *first == at);
            let count = found.map_or_else(|| next_block(at, 0.0, width * height, self.budget), |f| f.1);
            if found.is_none() {
                missing.push((at, count));
            }
            at += count.max(1);
        }
        Ok(Some(missing))
    }

    /// Renders a block of `count` iterations after so many iterations and seconds, and writes it. None where it was stopped
    /// before its first iteration.
    ///
    /// # Errors
    /// Settings that make no sense; a file that cannot be written.
    fn block(
        &self,
        scene: &Scene,
        (first, seconds): (u64, f64),
        count: u64,
        stop: &Stop,
        observer: &mut dyn Observer,
    ) -> Result<Option<Block>> {
        let job = Job { scene, settings: self.settings, budget: Budget::Spp(count), first, chosen: 0.0 };
        let mut offset = Offset { inner: observer, iterations: first, seconds };
        let outcome = job.run(stop, &mut offset)?;
        let iterations = outcome.film.iterations();
        if iterations == 0 {
            return Ok(None);
        }
        let dropped = outcome.film.dropped().total();
        if dropped > 0 {
            observer.note(&format!("the reference dropped {dropped} contributions that were not finite"));
        }
        let file = layered(scene, &self.settings, &self.resolved, &outcome);
        // Where blocks end must not depend on where they were stopped, but where the clock says it anyway.
        if !outcome.partial || matches!(self.budget, Budget::Seconds(_)) {
            exr::write(block_path(&self.dir, first, iterations), &file)?;
        } else {
            observer.note(&format!(
                "the {iterations} spp of the reference that were under way are not kept: parts of it end at {first} and at {} spp",
                first + count
            ));
        }
        Ok(Some(Block::of(&file, iterations, outcome.seconds)))
    }

    /// Renders a block ahead of those before it. Needs no lock: whoever renders the same block writes the same.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn ahead(
        &self,
        scene: &Scene,
        first: u64,
        count: u64,
        stop: &Stop,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        prepare_folder(&self.dir)?;
        self.block(scene, (first, 0.0), count, stop, observer).map(drop)
    }
}

/// Passes on the progress of a block as that of the whole.
struct Offset<'a> {
    inner: &'a mut dyn Observer,
    iterations: u64,
    seconds: f64,
}

impl Observer for Offset<'_> {
    fn begin(&mut self, _: &str, _: Budget) {}
    fn advance(&mut self, iterations: u64, seconds: f64) {
        self.inner.advance(self.iterations + iterations, self.seconds + seconds);
    }
    fn end(&mut self) {}
    fn note(&mut self, line: &str) {
        self.inner.note(line);
    }
}

/// Iterations of the next block: up to the next power of two, in steps that bound what an interruption loses.
fn next_block(done: u64, seconds: f64, pixels: usize, budget: Budget) -> u64 {
    let longest = (LONGEST_BLOCK / pixels.max(1) as u64).max(16);
    let boundary = (done + 1).next_power_of_two().max(16).min((done / longest + 1) * longest);
    let count = boundary - done;
    match budget {
        Budget::Spp(spp) => count.min(spp - done),
        // The rate is known from the second block on; the first one finds it out.
        Budget::Seconds(_) | Budget::RelMse { .. } if done == 0 => 1,
        // The plan lets no reference have a relMSE to be reached.
        Budget::RelMse { .. } => count,
        // A machine that slows down within a block is noticed at its end: so no block takes more than half of the time that
        // is left, until that is a fiftieth of what there was.
        Budget::Seconds(limit) => {
            let left = limit - seconds;
            let part = if left > 0.02 * limit { 0.5 * left } else { left };
            count.min(((part / (seconds / done as f64)).round() as u64).max(1))
        }
    }
}

/// Hash of all that a reference depends on.
fn fingerprint(key: &SceneKey, settings: &Settings, resolved: &Resolved) -> String {
    let mut hasher = Hasher::default();
    hasher.field(RENDERING.as_bytes());
    // The scene goes in by contents, wherever it lies; paths by which they are, however that is written.
    let words = Resolved { scene: String::new(), ..resolved.clone() };
    let mut words = serde_json::to_value(words).expect("plain structs have a JSON form");
    words.as_object_mut().expect("a struct is an object").shift_remove("paths");
    hasher.field(words.to_string().as_bytes());
    hasher.field(&settings.paths.fingerprint());
    hasher.field(key.contents().as_bytes());
    hasher.hex()
}

fn film_size(scene: &Scene) -> (usize, usize) {
    let crop = scene.camera.crop();
    (crop.width() as usize, crop.height() as usize)
}

fn block_path(dir: &Path, first: u64, count: u64) -> PathBuf {
    dir.join(format!("block-{first:010}-{count:010}.exr"))
}

/// The first iteration of a block and how many there are, from its file's name.
fn block_range(path: &Path) -> Option<(u64, u64)> {
    let name = path.file_name()?.to_str()?;
    let (first, count) = name.strip_prefix("block-")?.strip_suffix(".exr")?.split_once('-')?;
    Some((first.parse().ok()?, count.parse().ok()?))
}

/// The blocks in a folder: by their first iterations, the longest first among equals.
fn blocks(dir: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(dir).map_err(|e| Error::io(dir, "read this folder", &e))?;
    let mut found: Vec<((u64, u64), PathBuf)> =
        entries.flatten().filter_map(|e| Some((block_range(&e.path())?, e.path()))).collect();
    found.sort_by_key(|((first, count), _)| (*first, std::cmp::Reverse(*count)));
    Ok(found.into_iter().map(|(_, path)| path).collect())
}

/// A block's file, if it starts at iteration `at`.
fn read_block(path: &Path, at: u64) -> Result<Option<Block>> {
    let Some((first, count)) = block_range(path) else { return Ok(None) };
    if first != at {
        return Ok(None);
    }
    let file = exr::read_layers(path)?;
    let number = |key: &str| file.text(key).and_then(|t| t.parse::<f64>().ok());
    let complete = number("tyndall.iterations") == Some(count as f64)
        && file.layer("").is_some()
        && (count == 1 || file.layer(VARIANCE).is_some());
    match number("tyndall.seconds").filter(|_| complete) {
        Some(seconds) => Ok(Some(Block::of(&file, count, seconds))),
        None => Err(Error::file(path, "is not a block of a reference")),
    }
}

/// Sees whether the file that a scene is to be measured against is there, is an image, and of the right size.
///
/// # Errors
/// Where it is not.
pub fn check_reference(plan: &ScenePlan, scene: &Scene) -> Result<()> {
    match &plan.reference {
        Some(ReferencePlan::File { path, file }) => read_file(path, file, scene).map(drop),
        _ => Ok(()),
    }
}

/// A reference of the user's.
fn read_file(path: &Path, shown: &str, scene: &Scene) -> Result<Truth> {
    let file = exr::read_layers(path)?;
    let Some(image) = file.layer("").cloned() else {
        return Err(Error::file(path, "has no channels R, G and B"));
    };
    let (width, height) = film_size(scene);
    if (image.width, image.height) != (width, height) {
        let message =
            format!("a reference of {} for images of {width}x{height} of {}", image.size_text(), scene.name);
        return Err(Error::file(path, message));
    }
    let bad = image.count_non_finite();
    if bad > 0 {
        return Err(Error::file(path, format!("{bad} pixels are NaN or infinite: it cannot be a reference")));
    }
    let settings: Option<Resolved> = file.text("tyndall.settings").and_then(|t| serde_json::from_str(t).ok());
    let paths = settings.as_ref().and_then(|s| Expression::parse(&s.paths).ok());
    let lengths =
        settings.map_or(Lengths::default(), |s| Lengths { min: Some(s.min_length), max: Some(s.max_length) });
    Ok(Truth {
        kind: ReferenceKind::File(shown.to_owned()),
        variance: file.layer(VARIANCE).filter(|v| v.count_non_finite() == 0).cloned(),
        spp: file.text("tyndall.iterations").and_then(|t| t.parse().ok()),
        seconds: file.text("tyndall.seconds").and_then(|t| t.parse().ok()),
        lengths,
        paths,
        seed: file.text("tyndall.seed").and_then(|t| t.parse().ok()),
        made_by: MADE_BY
            .iter()
            .filter_map(|key| Some(((*key).to_owned(), file.text(key)?.to_owned())))
            .collect(),
        partial: false,
        noise: Noise::default(),
        image,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Spent;

    #[test]
    fn block_lengths_cover_the_budget() {
        for (spp, pixels) in [(1, 64), (15, 64), (100, 64), (5000, 512 * 512)] {
            let mut sum = Sum::new((pixels, 1));
            let mut lengths = Vec::new();
            while Budget::Spp(spp).goes_on(sum.spent()) {
                let count = next_block(sum.iterations, 0.0, pixels, Budget::Spp(spp));
                assert!(count >= 1 && (count <= 16 || count * pixels as u64 <= LONGEST_BLOCK));
                lengths.push(count);
                sum.iterations += count;
            }
            assert_eq!(sum.iterations, spp, "{lengths:?}");
        }
    }

    /// Where the machine slows down to a half, or grows twice as fast, for the rest of the time.
    #[test]
    fn references_end_when_their_time_is_over() {
        for (change, before, after) in
            [(2.0, 1.0, 1.0), (0.5, 1.0, 2.0), (0.5, 1.0, 0.5), (0.7, 1.0, 2.0), (0.9, 1.0, 1.5)]
        {
            let (limit, pixels) = (100.0, 19_200);
            let (mut done, mut seconds, mut blocks) = (0, 0.0, 0);
            while Budget::Seconds(limit).goes_on(Spent::new(done, seconds)) {
                let count = next_block(done, seconds, pixels, Budget::Seconds(limit));
                for _ in 0..count {
                    seconds += 0.05 * if seconds < change * limit { before } else { after };
                }
                done += count;
                blocks += 1;
            }
            assert!((seconds / limit - 1.0).abs() < 0.05, "{change} {before} {after}: {seconds} s");
            assert!(blocks < 30, "{blocks} blocks");
        }
    }

    #[test]
    fn names_of_blocks_come_back() {
        let path = block_path(Path::new("x"), 16, 48);
        assert_eq!(block_range(&path), Some((16, 48)));
        assert_eq!(block_range(Path::new("x/block-3.exr")), None);
    }
}
