//! One estimator in one scene: its runs, their files and their numbers.

use super::costs::{costs, file_name};
use super::leftovers;
use super::means::{MeanLayers, mean_of_maps};
use super::measure::{CONFIDENCE, curve, estimate};
use super::metrics::{Metric, relmse::EPSILON};
use super::plan::{EstimatorPlan, Lengths, Plan, ScenePlan};
use super::reference::Truth;
use super::results::{Cell, Checkpoint, Estimate, Files, Interval, Run, Summary};
use super::shares::Shares;
use super::split::{efficiency, noise_variance, split};
use super::statistics::{mean, two_sided_quantile};
use super::store::{self, SceneKey, State, Unit, image_file};
use super::work::{Got, Work, without_noise};
use crate::error::{Error, Result};
use crate::film::exr::{self, LayeredImage};
use crate::film::output::write_bytes;
use crate::film::png::{self, ToneCurve};
use crate::film::{Image, ScalarImage};
use crate::render::files::{OUTLIERS, Resolved, VARIANCE, dropped, layered, origin, prepare_folder};
use crate::render::{Budget, Observer, Stop};
use crate::scene::Scene;
use crate::transport::settings::{Layers, Settings};
use crate::transport::technique::Technique;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the layer with the mean over the runs less the reference.
const BIAS: &str = "bias";

/// Where the noise of the reference is more than this share of a metric, a warning is given.
const REFERENCE_NOISE: f64 = 0.1;
/// Where it is more than this share, it dominates.
const DOMINANT_NOISE: f64 = 0.5;

/// A run in time that ends further than this from its budget is warned about.
const TIME_TOLERANCE: f64 = 0.05;

/// What the cells of a scene share.
pub struct SceneContext<'a> {
    /// The experiment.
    pub plan: &'a Plan,
    /// The scene's entry.
    pub entry: &'a ScenePlan,
    /// The scene.
    pub scene: &'a Scene,
    /// What it is measured against.
    pub truth: Option<&'a Truth>,
    /// The folder of results.
    pub out: &'a Path,
    /// Names the scene's contents.
    pub key: &'a SceneKey,
    /// What the clock depends on.
    pub clock: &'a str,
    /// Whether what is there has to do.
    pub frozen: bool,
    /// To stop early.
    pub stop: &'a Stop,
}

/// A cell with the means over its runs of its error maps, by the metric's key.
pub struct Measured {
    /// What goes into the results.
    pub cell: Cell,
    /// The maps.
    pub maps: BTreeMap<String, ScalarImage>,
}

/// A run that was stopped before its end.
pub struct Stopped {
    estimator: String,
    run: u32,
    state: Box<State>,
}

/// What is gathered run by run.
struct Gathered {
    runs: Vec<Run>,
    images: Vec<Image>,
    maps: BTreeMap<String, ScalarImage>,
    mean: MeanLayers,
    shares: Shares,
    settings: Vec<Resolved>,
}

/// The settings of a cell's runs, as they are written beside its images.
#[derive(Serialize)]
struct CellSettings<'a> {
    budget: Budget,
    run: &'a [Resolved],
}

impl<'a> SceneContext<'a> {
    /// A run of an estimator: what names it, and what is to be rendered.
    ///
    /// # Errors
    /// Settings that make no sense.
    pub fn unit(&self, estimator: &EstimatorPlan, run: u32) -> Result<(Unit, Work<'a>)> {
        let defaults = Lengths::from(self.scene.notes.defaults);
        // What `auto` comes to is what counts.
        let settings = self.plan.settings(self.entry, defaults, estimator, run)?.with_tracking_in(self.scene);
        let budget = estimator.budget;
        let mut ends = if budget.is_timed() { self.clock.to_owned() } else { String::new() };
        if let (Budget::RelMse { target, .. }, Some(truth)) = (budget, self.truth) {
            ends += &format!(" {target} {}", truth.fingerprint());
        }
        let scene = (self.entry.key.as_str(), self.key);
        let unit = Unit::new(self.out, scene, &estimator.key, run, &settings, &ends);
        let (truth, stop, file) = (self.truth, self.stop, self.entry.file.as_str());
        Ok((unit, Work { scene: self.scene, file, settings, budget, truth, stop }))
    }

    /// What a run is called in messages.
    pub fn name(&self, estimator: &EstimatorPlan, run: u32) -> String {
        let several = self.plan.runs > 1;
        let number = if several { format!(", run {} of {}", run + 1, self.plan.runs) } else { String::new() };
        format!("{}: {}{number}", self.entry.key, estimator.key)
    }

    /// Renders the runs of an estimator as far as they are not there. False where another process is at one of them.
    ///
    /// # Errors
    /// A state that cannot be written.
    pub fn render(
        &self,
        estimator: &EstimatorPlan,
        stopped: &mut Vec<Stopped>,
        observer: &mut dyn Observer,
    ) -> Result<bool> {
        let mut all = true;
        for run in 0..self.plan.runs {
            if self.stop.requested() {
                return Ok(false);
            }
            let (unit, work) = self.unit(estimator, run)?;
            if unit.peek(work.budget).is_some_and(|h| h.is_done(work.budget)) {
                continue;
            }
            match work.complete(&unit, &self.name(estimator, run), observer)? {
                Got::Busy => all = false,
                Got::There(state) if state.outcome.partial => {
                    stopped.push(Stopped { estimator: estimator.key.clone(), run, state });
                }
                Got::There(_) => {}
            }
        }
        Ok(all)
    }

    /// Measures the runs of an estimator that are there, and writes their images. None where there is none.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn measure(
        &self,
        estimator: &EstimatorPlan,
        stopped: &[Stopped],
        observer: &mut dyn Observer,
    ) -> Result<Option<Measured>> {
        let folder = format!("{}/{}", self.entry.key, estimator.key);
        let mut gathered = Gathered {
            runs: Vec::new(),
            images: Vec::new(),
            maps: BTreeMap::new(),
            mean: MeanLayers::default(),
            shares: Shares::default(),
            settings: Vec::new(),
        };
        let what = format!("{}: {}: measuring", self.entry.key, estimator.key);
        let mut said = false;
        for run in 0..self.plan.runs {
            let (unit, work) = self.unit(estimator, run)?;
            let of_run = |s: &&Stopped| s.estimator == estimator.key && s.run == run;
            let state = match stopped.iter().find(of_run) {
                Some(stopped) => Some((*stopped.state).clone()),
                None => match work.find(&unit) {
                    // Its header was whole, but not the rest.
                    None if !self.frozen && !self.stop.requested() => {
                        match work.complete(&unit, &self.name(estimator, run), observer)? {
                            Got::There(state) => Some(*state),
                            Got::Busy => None,
                        }
                    }
                    found => found,
                },
            };
            if let Some(state) = state.filter(|s| s.outcome.film.iterations() > 0) {
                if !std::mem::replace(&mut said, true) {
                    observer.begin_steps(&what, self.plan.runs.into(), "runs");
                }
                prepare_folder(&self.out.join(&folder))?;
                self.run(&folder, run, &work.settings, state, &mut gathered)?;
                observer.step(u64::from(run) + 1);
            }
        }
        if gathered.runs.is_empty() {
            return Ok(None);
        }
        let scale = 1.0 / gathered.runs.len() as f32;
        for map in gathered.maps.values_mut() {
            map.values.iter_mut().for_each(|v| *v *= scale);
        }
        let text = toml::to_string(&CellSettings { budget: estimator.budget, run: &gathered.settings })
            .map_err(|e| Error::usage(format!("cannot write settings: {e}")))?;
        write_bytes(&self.out.join(&folder).join(leftovers::SETTINGS), text.as_bytes())?;
        let files = self.write_means(&folder, &gathered)?;
        let mut cell = self.cell(estimator, &gathered, files);
        observer.end_steps();
        cell.techniques = gathered.shares.rows(&self.costs(estimator, observer)?);
        Ok(Some(Measured { cell, maps: gathered.maps }))
    }

    /// What each technique costs, where that is wanted.
    fn costs(
        &self,
        estimator: &EstimatorPlan,
        observer: &mut dyn Observer,
    ) -> Result<Vec<(Technique, Estimate)>> {
        if !self.plan.figures.costs {
            return Ok(Vec::new());
        }
        let (unit, work) = self.unit(estimator, 0)?;
        let name = unit.folder().file_name().unwrap_or_default().to_string_lossy().into_owned();
        let folder = self.out.join(store::FOLDER).join(store::COSTS);
        let file = folder.join(file_name(&name, self.clock));
        if (self.frozen || self.stop.requested()) && !file.is_file() {
            return Ok(Vec::new());
        }
        prepare_folder(&folder)?;
        let name = format!("{}: {}", self.entry.key, estimator.key);
        costs(self.scene, &work.settings, &file, (&name, observer))
    }

    /// One run: one seed.
    fn run(
        &self,
        folder: &str,
        index: u32,
        settings: &Settings,
        state: State,
        gathered: &mut Gathered,
    ) -> Result<()> {
        let State { outcome, resolved, snapshots, rendered, .. } = state;
        let mut checkpoints = Vec::new();
        for snapshot in &snapshots {
            checkpoints.extend(self.checkpoint(snapshot.iterations, snapshot.seconds, &snapshot.image)?);
        }
        let image = outcome.film.image();
        let (metrics, measured) = self.metrics(&image, &mut gathered.maps)?;
        if self.truth.is_some() {
            let quick = self.plan.metrics.iter().filter(|m| is_quick(**m)).map(|m| m.description().key);
            let metrics = quick.map(|key| (key.to_owned(), metrics[key])).collect();
            let (spp, seconds) = (outcome.film.iterations(), outcome.seconds);
            checkpoints.push(Checkpoint { spp, seconds, metrics });
        }
        let exr = format!("{folder}/{}", image_file(index));
        // Single runs keep image and variance; layers are kept as means, which is where they are looked at.
        let bare = Settings { layers: Layers::None, ..*settings };
        let mut file = layered(self.scene, &bare, &resolved, &outcome);
        file.push(OUTLIERS, outcome.film.outliers());
        file.metadata.extend(origin(&self.entry.path, self.key.contents()));
        exr::write(self.out.join(&exr), &file)?;
        gathered.shares.add(&outcome.film);
        let mut file = layered(self.scene, settings, &resolved, &outcome);
        // There is no mean of them.
        file.layers.retain(|l| l.name != OUTLIERS);
        gathered.mean.add(file, &outcome.film);
        // These two are kept whether or not they are among the experiment's metrics.
        let always = |metric: Metric| match metrics.get(metric.description().key) {
            Some(value) => Ok(Some(*value)),
            None => self.truth.map(|truth| without_noise(metric, &image, truth)).transpose(),
        };
        let (relmse, mse) = (always(Metric::RelMse)?, always(Metric::Mse)?);
        gathered.runs.push(Run {
            index,
            seed: settings.seed,
            spp: outcome.film.iterations(),
            seconds: outcome.seconds,
            setup: outcome.setup,
            waited: outcome.waited,
            rendered,
            camera_paths: outcome.camera_paths,
            light_paths: outcome.light_paths,
            merges: outcome.merges.iter().cloned().collect(),
            dropped: dropped(&outcome.film),
            partial: outcome.partial,
            mean: image.mean(),
            metrics,
            measured,
            relmse,
            mse,
            checkpoints,
            exr,
        });
        gathered.images.push(image);
        gathered.settings.push(resolved);
        Ok(())
    }

    /// The metrics that are quick to compute, on the way.
    fn checkpoint(&self, spp: u64, seconds: f64, image: &Image) -> Result<Option<Checkpoint>> {
        let Some(truth) = self.truth else { return Ok(None) };
        let mut metrics = BTreeMap::new();
        for metric in self.plan.metrics.iter().filter(|m| is_quick(**m)) {
            metrics.insert(metric.description().key.to_owned(), without_noise(*metric, image, truth)?);
        }
        Ok(Some(Checkpoint { spp, seconds, metrics }))
    }

    /// All metrics at the end of a run, and those from which the reference's noise was taken off as they were measured; its maps
    /// are added up.
    fn metrics(
        &self,
        image: &Image,
        maps: &mut BTreeMap<String, ScalarImage>,
    ) -> Result<(BTreeMap<String, f64>, BTreeMap<String, f64>)> {
        let (mut values, mut measured) = (BTreeMap::new(), BTreeMap::new());
        let Some(truth) = self.truth else { return Ok((values, measured)) };
        for metric in &self.plan.metrics {
            let key = metric.description().key;
            let measurement = metric.measure(image, &truth.image)?;
            let noise = truth.noise(*metric)?;
            values.insert(key.to_owned(), measurement.value - noise.unwrap_or(0.0));
            if noise.is_some() {
                measured.insert(key.to_owned(), measurement.value);
            }
            match maps.get_mut(key) {
                None => drop(maps.insert(key.to_owned(), measurement.map)),
                Some(sum) => {
                    sum.values.iter_mut().zip(&measurement.map.values).for_each(|(s, v)| *s += v);
                }
            }
        }
        Ok((values, measured))
    }

    fn write_means(&self, folder: &str, gathered: &Gathered) -> Result<Files> {
        let mean = gathered.mean.finish();
        let named = |name: &str| format!("{folder}/{name}");
        let mut files = Files {
            png: named("run-00.png"),
            exr: gathered.runs[0].exr.clone(),
            mean_exr: named("mean.exr"),
            mean_png: named("mean.png"),
            error_exr: None,
            error_png: BTreeMap::new(),
            statistics_exr: None,
            layers: mean
                .layers
                .iter()
                .map(|l| l.name.clone())
                .filter(|n| !n.is_empty() && n != VARIANCE)
                .collect(),
        };
        let exposure = self.entry.exposure;
        exr::write(self.out.join(&files.mean_exr), &mean)?;
        let default = mean.layer("").expect("renders have a default layer");
        png::write(self.out.join(&files.mean_png), default, exposure, ToneCurve::Srgb)?;
        png::write(self.out.join(&files.png), &gathered.images[0], exposure, ToneCurve::Srgb)?;
        if !gathered.maps.is_empty() {
            let mut maps = mean_of_maps(&gathered.maps);
            maps.origin = mean.origin;
            maps.full_size = mean.full_size;
            files.error_exr = Some(named("error.exr"));
            exr::write(self.out.join(named("error.exr")), &maps)?;
        }
        let statistics = self.statistics(gathered, &mean);
        if !statistics.layers.is_empty() {
            files.statistics_exr = Some(named("statistics.exr"));
            exr::write(self.out.join(named("statistics.exr")), &statistics)?;
        }
        Ok(files)
    }

    /// Maps of variance and bias.
    fn statistics(&self, gathered: &Gathered, mean: &LayeredImage) -> LayeredImage {
        let mut file = LayeredImage { layers: Vec::new(), metadata: Vec::new(), ..mean.clone() };
        if let Some(variance) = mean.layer(VARIANCE) {
            // That of the mean over the runs.
            let runs = gathered.runs.len() as f32;
            let pixels = variance.pixels.iter().map(|p| p.map(|v| v * runs)).collect();
            file.push(VARIANCE, Image { pixels, ..*variance });
        }
        if let Some((truth, mean)) = self.truth.zip(mean.layer("")) {
            let difference = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|c| a[c] - b[c]);
            let pixels = mean.pixels.iter().zip(&truth.image.pixels).map(difference).collect();
            file.push(BIAS, Image { pixels, ..*mean });
        }
        for (technique, map) in gathered.shares.maps() {
            file.push(format!("{VARIANCE}.{}", technique.info().key), map);
        }
        file
    }

    fn cell(&self, estimator: &EstimatorPlan, gathered: &Gathered, files: Files) -> Cell {
        let runs = &gathered.runs;
        let seconds: Vec<f64> = runs.iter().map(|r| r.seconds).collect();
        let spp: Vec<f64> = runs.iter().map(|r| r.spp as f64).collect();
        let split = split(&gathered.images, self.truth);
        let summary: Vec<Summary> =
            self.plan.metrics.iter().filter_map(|metric| self.summary(*metric, gathered)).collect();
        let curves = self
            .plan
            .metrics
            .iter()
            .filter_map(|m| curve(m.description().key, runs).filter(|c| !c.points.is_empty()));
        let convergence = curves.collect();
        let nothing = Estimate { mean: 0.0, interval: None };
        let seconds = estimate(&seconds).unwrap_or(nothing);
        let settings = &gathered.settings[0];
        let mut cell = Cell {
            scene: self.entry.key.clone(),
            estimator: estimator.key.clone(),
            min_length: settings.min_length,
            max_length: settings.max_length,
            paths: settings.paths.clone(),
            summary,
            variance: split.variance,
            bias: split.bias,
            efficiency: efficiency(split.mse, &seconds),
            variance_efficiency: efficiency(split.variance, &seconds),
            seconds,
            spp: estimate(&spp).unwrap_or(nothing),
            convergence,
            techniques: Vec::new(),
            files,
            warnings: Vec::new(),
            runs: runs.clone(),
        };
        cell.warnings = self.warnings(estimator, &cell);
        cell
    }

    /// A metric over the runs, with what the reference's noise adds to it.
    fn summary(&self, metric: Metric, gathered: &Gathered) -> Option<Summary> {
        let key = metric.description().key;
        let over = |of: fn(&Run) -> &BTreeMap<String, f64>| {
            let values: Option<Vec<f64>> = gathered.runs.iter().map(|r| of(r).get(key).copied()).collect();
            estimate(&values?)
        };
        let truth = self.truth?;
        let (plain, measured) = (over(|r| &r.metrics)?, over(|r| &r.measured));
        let noise = truth.noise(metric).ok().flatten();
        if noise.is_none() {
            return Some(Summary { metric: key.to_owned(), value: plain, noise, measured: None });
        }
        let weight = |r: f64| if metric == Metric::RelMse { 1.0 / (r * r + EPSILON) } else { 1.0 };
        let more = noise_variance(&gathered.images, truth, weight);
        let quantile = two_sided_quantile(CONFIDENCE, gathered.runs.len() as f64 - 1.0).unwrap_or(0.0);
        let interval = plain.interval.map(|i| {
            let half = (0.5 * (i.high - i.low)).hypot(quantile * more.sqrt());
            Interval { low: plain.mean - half, high: plain.mean + half }
        });
        let value = Estimate { mean: plain.mean, interval };
        Some(Summary { metric: key.to_owned(), value, noise, measured })
    }

    fn warnings(&self, estimator: &EstimatorPlan, cell: &Cell) -> Vec<String> {
        let mut warnings = Vec::new();
        if cell.runs.iter().any(|r| r.partial) || cell.runs.len() < self.plan.runs as usize {
            warnings.push("stopped before all its runs were complete".to_owned());
        }
        let dropped: u64 = cell.runs.iter().flat_map(|r| r.dropped.values()).sum();
        if dropped > 0 {
            warnings.push(format!("{dropped} contributions were not finite and were dropped"));
        }
        if let Budget::RelMse { target, .. } = estimator.budget {
            let short =
                cell.runs.iter().filter(|r| !r.partial && r.relmse.is_some_and(|e| e > target)).count();
            if short > 0 {
                warnings.push(format!(
                    "{short} of {} runs did not come to a relMSE of {target} within the bounds",
                    cell.runs.len()
                ));
            }
        }
        if let Budget::Seconds(limit) = estimator.budget
            && (cell.seconds.mean / limit - 1.0).abs() > TIME_TOLERANCE
            && !cell.runs.iter().any(|r| r.partial)
        {
            let (taken, spp) = (cell.seconds.mean, cell.spp.mean);
            let setups: Vec<f64> = cell.runs.iter().map(|r| r.setup).collect();
            let why = match mean(&setups) {
                Some(setup) if setup > 0.5 * limit => format!("their pilots alone took {setup:.3} s"),
                _ => "an iteration is a long part of that".to_owned(),
            };
            warnings.push(format!("runs took {taken:.3} s and not {limit} s: {why} ({spp:.0} spp)"));
        }
        if let Some(truth) = self.truth {
            self.warn_of_reference(truth, estimator, cell, &mut warnings);
        }
        warnings
    }

    fn warn_of_reference(
        &self,
        truth: &Truth,
        estimator: &EstimatorPlan,
        cell: &Cell,
        warnings: &mut Vec<String>,
    ) {
        let own = estimator.paths.unwrap_or(self.entry.paths);
        if let Some(its) = truth.paths.filter(|its| *its != own) {
            warnings.push(format!(
                "its paths are `{own}`, those of the reference `{its}`: a part of the error is that"
            ));
        }
        let own = [Some(cell.min_length), Some(cell.max_length)];
        let its = [truth.lengths.min, truth.lengths.max];
        if own.iter().zip(&its).any(|(own, its)| its.is_some() && its != own) {
            warnings.push(format!(
                "its paths have {} to {} segments, those of the reference {} to {}: a part of the error is that",
                cell.min_length,
                cell.max_length,
                its[0].unwrap_or(cell.min_length),
                its[1].unwrap_or(cell.max_length)
            ));
        }
        if cell.runs.iter().any(|r| Some(r.seed) == truth.seed) {
            warnings.push("a run and the reference have the same seed: they are not independent".to_owned());
        }
        let told = cell.summary.iter().filter_map(|summary| {
            let share = summary.noise? / summary.measured.unwrap_or(summary.value).mean;
            let metric = self.plan.metrics.iter().find(|m| m.description().key == summary.metric);
            Some((metric.map_or("", |m| m.description().label).to_owned(), share))
        });
        for (label, share) in told.chain(self.noise_of_efficiency(truth, cell)) {
            if share > DOMINANT_NOISE {
                warnings.push(format!(
                    "the reference's own noise dominates the {label} ({:.0}% of it): what is left without it is hardly known, and \
                     the reference needs more samples",
                    100.0 * share.min(1.0)
                ));
            } else if share > REFERENCE_NOISE {
                warnings.push(format!(
                    "the reference's own noise makes up {:.0}% of the {label}, and is taken off: it needs more samples",
                    100.0 * share
                ));
            }
        }
    }

    /// The share of the reference's noise in the MSE that variance, bias and an efficiency go by, where that is none of the metrics
    /// that were asked for: then nothing else would tell.
    fn noise_of_efficiency(&self, truth: &Truth, cell: &Cell) -> Option<(String, f64)> {
        if self.plan.metrics.contains(&Metric::Mse) {
            return None;
        }
        let noise = truth.noise(Metric::Mse).ok().flatten()?;
        let errors: Option<Vec<f64>> = cell.runs.iter().map(|r| r.mse).collect();
        let share = noise / (noise + mean(&errors?)?);
        // Where the relMSE is there the page compares efficiencies by that.
        let compared = !self.plan.metrics.contains(&Metric::RelMse);
        let why = if compared {
            "by which efficiencies are compared"
        } else {
            "which bias² and an efficiency go by"
        };
        Some((format!("{}, {why}", Metric::Mse.description().label), share))
    }
}

/// Whether a metric is computed at each checkpoint: a sum over pixels is quick, FLIP's filters are not.
fn is_quick(metric: Metric) -> bool {
    !matches!(metric, Metric::Flip | Metric::LdrFlip)
}
