//! Runs an experiment from its plan to its results on disk.

use super::cell::{Measured, SceneContext};
use super::plan::{EstimatorPlan, Lengths, Plan, ScenePlan};
use super::reference::{Maker, Truth, WAIT, check_reference};
use super::results::{
    self, EstimatorInfo, EstimatorSettings, MetricInfo, Reference, Results, SCHEMA, SceneResult,
};
use super::store::{self, SceneKey};
use super::{csv, leftovers, machine, moved, waited};
use crate::error::{Error, Result};
use crate::film::exr::{self, LayeredImage};
use crate::film::false_color::{Scale, paint};
use crate::film::output::write_bytes;
use crate::film::png::{self, ToneCurve};
use crate::film::{Image, ScalarImage};
use crate::render::files::{PROGRAM, REFERENCE, RENDERING, VARIANCE, heuristic_text, prepare_folder};
use crate::render::{Budget, Observer, Stop};
use crate::scene::Scene;
use crate::scene::file::{Overrides, load};
use glam::UVec2;
use std::collections::BTreeMap;
use std::path::Path;

/// The share of an error map's values that lies within its scale, over all estimators of a scene.
const MAP_QUANTILE: f64 = 0.99;

/// Holds, beside timed runs, what their times depend on.
pub const CLOCK: &str = "clock";

/// Where an experiment runs.
pub struct Options<'a> {
    /// The folder of results.
    pub out: &'a Path,
    /// The folder of references, which experiments share.
    pub cache: &'a Path,
    /// To stop early: what is done is written, marked as partial.
    pub stop: &'a Stop,
    /// What is done of it.
    pub part: Part,
}

/// What is done of an experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// All of it.
    All,
    /// Nothing more is rendered: what is there is measured.
    Measure,
    /// Every `of`-th run and reference, from number `index` on, is rendered, and nothing measured.
    Shard {
        /// From 0.
        index: u64,
        /// How many there are.
        of: u64,
    },
}

/// Runs all of it, with as many threads as the current pool has. What is there is not rendered again; other processes
/// may work at the same results. Results are written after each cell.
///
/// # Errors
/// Anything wrong with scenes, references or the folders, most of it before the first iteration.
pub fn run(plan: &Plan, options: &Options, observer: &mut dyn Observer) -> Result<Results> {
    let scenes = load_scenes(plan)?;
    prepare_folder(options.out)?;
    leftovers::remove_half_written(options.out);
    let clock = clock_of(plan, options)?;
    let mut runner = Runner { plan, options, observer, results: skeleton(plan, &scenes), clock: &clock };
    if let Part::Shard { index, of } = options.part {
        runner.shard(&scenes, index, of)?;
        runner.results.partial = options.stop.requested();
        return Ok(runner.results);
    }
    write_bytes(&options.out.join("experiment.toml"), plan.text.as_bytes())?;
    runner.save()?;
    for (index, scene) in scenes.iter().enumerate() {
        if options.stop.requested() {
            break;
        }
        runner.scene(index, scene)?;
    }
    let waited = waited::warning(&runner.results.cells, rayon::current_num_threads());
    waited.iter().for_each(|warning| runner.observer.note(warning));
    runner.results.warnings.extend(waited);
    let mut results = runner.results;
    let unfinished = |r: &results::Run| r.partial;
    results.partial = options.stop.requested()
        || results.cells.len() < plan.scenes.len() * plan.estimators.len()
        || results.cells.iter().any(|c| c.runs.len() < plan.runs as usize || c.runs.iter().any(unfinished));
    save(&mut results, options.out)?;
    Ok(results)
}

/// What times depend on, beside the program.
pub fn clock() -> String {
    let machine = machine::machine();
    format!("{} {} {}", machine.cpu, machine.cores, machine.threads)
}

/// Names what times depend on where runs are timed: this machine; or, where shards are put together, the one that they
/// ran on, which they left beside the runs.
fn clock_of(plan: &Plan, options: &Options) -> Result<String> {
    let own = clock();
    if !plan.estimators.iter().any(|e| e.budget.is_timed()) {
        return Ok(own);
    }
    let folder = options.out.join(store::FOLDER);
    let path = folder.join(CLOCK);
    if options.part == Part::Measure {
        return Ok(std::fs::read_to_string(path).unwrap_or(own));
    }
    prepare_folder(&folder)?;
    write_bytes(&path, own.as_bytes())?;
    Ok(own)
}

struct Runner<'a> {
    plan: &'a Plan,
    options: &'a Options<'a>,
    observer: &'a mut dyn Observer,
    results: Results,
    clock: &'a str,
}

impl Runner<'_> {
    fn save(&mut self) -> Result<()> {
        save(&mut self.results, self.options.out)
    }

    /// Renders a part of the runs, and of the references.
    fn shard(&mut self, scenes: &[Scene], shard: u64, of: u64) -> Result<()> {
        let mut number = 0;
        let mut mine = || {
            number += 1;
            (number - 1) % of == shard
        };
        for (entry, scene) in self.plan.scenes.iter().zip(scenes) {
            let key = SceneKey::new(scene)?;
            // Who stops at an error needs the reference at once; else it is one piece of work among the others.
            let needed = self.plan.estimators.iter().any(|e| matches!(e.budget, Budget::RelMse { .. }));
            let own = mine();
            let truth = if needed || own { self.maker().obtain(entry, scene, &key)? } else { None };
            let context = SceneContext {
                plan: self.plan,
                entry,
                scene,
                truth: truth.as_ref(),
                out: self.options.out,
                key: &key,
                clock: self.clock,
                frozen: false,
                stop: self.options.stop,
            };
            for estimator in &self.plan.estimators {
                for run in 0..self.plan.runs {
                    if mine() && !self.options.stop.requested() {
                        let (unit, work) = context.unit(estimator, run)?;
                        work.complete(&unit, &context.name(estimator, run), self.observer)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn maker(&mut self) -> Maker<'_> {
        let frozen = self.options.part == Part::Measure;
        Maker { cache: self.options.cache, stop: self.options.stop, observer: self.observer, frozen }
    }

    fn scene(&mut self, index: usize, scene: &Scene) -> Result<()> {
        let (plan, options) = (self.plan, self.options);
        let entry = &plan.scenes[index];
        let key = SceneKey::new(scene)?;
        for warning in &scene.warnings {
            self.observer.note(&format!("warning: {}: {warning}", entry.key));
        }
        if let Some(hint) = moved::hint(plan, entry, &key, options.out) {
            self.observer.note(&hint);
        }
        prepare_folder(&options.out.join(&entry.key))?;
        let truth = self.maker().obtain(entry, scene, &key)?;
        if let Some(truth) = &truth {
            self.results.scenes[index].reference = Some(write_reference(options.out, entry, scene, truth)?);
            if truth.partial {
                self.results.warnings.push(format!("{}: the reference is incomplete", entry.key));
            }
        }
        let context = SceneContext {
            plan,
            entry,
            scene,
            truth: truth.as_ref(),
            out: options.out,
            key: &key,
            clock: self.clock,
            frozen: options.part == Part::Measure,
            stop: options.stop,
        };
        if options.part != Part::Measure
            && let Some(hint) = moved::fuller(&context)?
        {
            self.observer.note(&hint);
        }
        let measured = self.cells(&context)?;
        self.paint(&entry.key, &measured)?;
        self.save()
    }

    /// Renders and measures every estimator of a scene, those first at which no other process is.
    fn cells(&mut self, context: &SceneContext) -> Result<Vec<(usize, BTreeMap<String, ScalarImage>)>> {
        let (plan, stop) = (self.plan, self.options.stop);
        let mut measured = Vec::new();
        let mut stopped = Vec::new();
        let mut left: Vec<&EstimatorPlan> = plan.estimators.iter().collect();
        let mut said = false;
        while !left.is_empty() {
            let mut busy = Vec::new();
            for estimator in left {
                let there = self.options.part == Part::Measure
                    || context.render(estimator, &mut stopped, self.observer)?;
                if !there && !stop.requested() {
                    busy.push(estimator);
                    continue;
                }
                let Some(Measured { cell, maps }) = context.measure(estimator, &stopped, self.observer)?
                else {
                    continue;
                };
                for warning in &cell.warnings {
                    self.observer.note(&format!("{}: {}: {warning}", context.entry.key, estimator.key));
                }
                measured.push((cell.estimator.clone(), maps));
                self.results.cells.push(cell);
                self.in_order();
                self.save()?;
            }
            left = busy;
            if !left.is_empty() {
                if !std::mem::replace(&mut said, true) {
                    let key = &context.entry.key;
                    self.observer.note(&format!("{key}: another process is at the rest: waiting for it"));
                }
                std::thread::sleep(WAIT);
            }
        }
        let place = |estimator: &str| {
            let of = |c: &results::Cell| c.scene == context.entry.key && c.estimator == estimator;
            self.results.cells.iter().position(of).expect("what was measured is among the results")
        };
        Ok(measured.into_iter().map(|(estimator, maps)| (place(&estimator), maps)).collect())
    }

    /// Cells in the order of the plan, in whatever order they were done.
    fn in_order(&mut self) {
        let plan = self.plan;
        self.results.cells.sort_by_key(|cell| {
            let scene = plan.scenes.iter().position(|s| s.key == cell.scene);
            (scene, plan.estimators.iter().position(|e| e.key == cell.estimator))
        });
    }

    /// Error maps of a scene in false colour, all estimators' on one scale.
    fn paint(&mut self, scene: &str, measured: &[(usize, BTreeMap<String, ScalarImage>)]) -> Result<()> {
        for info in &mut self.results.metrics {
            let maps: Vec<(usize, &ScalarImage)> =
                measured.iter().filter_map(|(cell, maps)| Some((*cell, maps.get(&info.key)?))).collect();
            if maps.is_empty() {
                continue;
            }
            let values: Vec<f32> = maps.iter().flat_map(|(_, m)| m.values.iter().copied()).collect();
            let white = ScalarImage { width: values.len(), height: 1, values }.quantile(MAP_QUANTILE);
            info.map_scale.insert(scene.to_owned(), f64::from(white));
            for (index, map) in maps {
                let cell = &mut self.results.cells[index];
                let name = format!("{scene}/{}/error-{}.png", cell.estimator, info.key);
                paint(map, Scale::Linear(white)).write(self.options.out.join(&name))?;
                cell.files.error_png.insert(info.key.clone(), name);
            }
        }
        Ok(())
    }
}

/// Writes results, but not a part over the whole that another process has finished meanwhile.
fn save(results: &mut Results, out: &Path) -> Result<()> {
    if results.partial && results::finished_since(out, &results.started) {
        return Ok(());
    }
    results.finished = machine::now();
    results.write(out)?;
    csv::write(results, out)
}

/// Loads every scene and checks all that can be checked before anything is rendered.
///
/// # Errors
/// Anything wrong with a scene, or with the experiment in it.
pub fn load_scenes(plan: &Plan) -> Result<Vec<Scene>> {
    let mut scenes = Vec::new();
    for entry in &plan.scenes {
        let overrides = Overrides { size: entry.size.map(UVec2::from_array) };
        let scene = load(&entry.path, &overrides)?;
        let crop = scene.camera.crop();
        let (width, height) = (crop.width() as usize, crop.height() as usize);
        for c in &entry.crops {
            if c.x + c.width > width || c.y + c.height > height {
                return Err(Error::usage(format!(
                    "scene {}: the crop of {}x{} at ({}, {}) does not lie inside the image of {width}x{height}",
                    entry.key, c.width, c.height, c.x, c.y
                )));
            }
        }
        check_reference(entry, &scene)?;
        for estimator in &plan.estimators {
            let settings = plan.settings(entry, Lengths::from(scene.notes.defaults), estimator, 0)?;
            settings.check_scene(&scene)?;
            if matches!(estimator.budget, Budget::RelMse { .. }) && entry.reference.is_none() {
                return Err(Error::usage(format!(
                    "estimator {} is to come to a relMSE, and scene {} has no reference to measure it against",
                    estimator.key, entry.key
                )));
            }
        }
        scenes.push(scene);
    }
    Ok(scenes)
}

/// Results in which nothing has been measured yet.
fn skeleton(plan: &Plan, scenes: &[Scene]) -> Results {
    let metric = |m: &super::metrics::Metric| {
        let row = m.description();
        MetricInfo {
            key: row.key.to_owned(),
            label: row.label.to_owned(),
            description: row.formula.to_owned(),
            map_scale: BTreeMap::new(),
        }
    };
    let started = machine::now();
    Results {
        schema: SCHEMA,
        experiment: plan.name.clone(),
        source: Some(plan.source.clone()),
        title: plan.title.clone(),
        description: plan.description.clone(),
        program: PROGRAM.to_owned(),
        rendering: RENDERING.to_owned(),
        machine: machine::machine(),
        finished: started.clone(),
        started,
        partial: true,
        runs: plan.runs,
        metrics: plan.metrics.iter().map(metric).collect(),
        scenes: plan.scenes.iter().zip(scenes).map(|(entry, scene)| scene_result(entry, scene)).collect(),
        estimators: plan.estimators.iter().map(|e| estimator_info(plan, e)).collect(),
        cells: Vec::new(),
        figures: plan.figures.clone(),
        warnings: plan.warnings.clone(),
    }
}

fn scene_result(entry: &ScenePlan, scene: &Scene) -> SceneResult {
    let crop = scene.camera.crop();
    SceneResult {
        key: entry.key.clone(),
        label: entry.label.clone(),
        caption: entry.caption.clone(),
        file: entry.file.clone(),
        width: crop.width() as usize,
        height: crop.height() as usize,
        exposure: entry.exposure,
        crops: entry.crops.clone(),
        reference: None,
        warnings: scene.warnings.clone(),
    }
}

fn estimator_info(plan: &Plan, estimator: &EstimatorPlan) -> EstimatorInfo {
    let layers = match estimator.layers {
        crate::transport::Layers::None => "none",
        crate::transport::Layers::Families => "families",
        crate::transport::Layers::All => "all",
    };
    EstimatorInfo {
        key: estimator.key.clone(),
        label: estimator.label.clone(),
        caption: estimator.caption.clone(),
        color: estimator.color.clone(),
        settings: EstimatorSettings {
            techniques: estimator.techniques.iter().map(|t| t.info().key.to_owned()).collect(),
            heuristic: heuristic_text(estimator.heuristic),
            min_length: estimator.lengths.min,
            max_length: estimator.lengths.max,
            paths: estimator.paths.unwrap_or(plan.paths).to_string(),
            layers: layers.to_owned(),
            pyramid: estimator.pyramid,
            budget: estimator.budget,
        },
    }
}

/// Puts the reference beside the results that are measured against it.
fn write_reference(out: &Path, entry: &ScenePlan, scene: &Scene, truth: &Truth) -> Result<Reference> {
    let [exr, png] = ["exr", "png"].map(|kind| format!("{}/reference.{kind}", entry.key));
    let crop = scene.camera.crop();
    let mut file = LayeredImage::new(truth.image.clone());
    file.origin = [crop.x0 as i32, crop.y0 as i32];
    file.full_size = scene.camera.size().to_array().map(|v| v as usize);
    if let Some(variance) = &truth.variance {
        file.push(VARIANCE, variance.clone());
    }
    let numbers = [
        ("tyndall.iterations", truth.spp.map(|n| n.to_string())),
        ("tyndall.seconds", truth.seconds.map(|s| format!("{s:.6}"))),
        ("tyndall.seed", truth.seed.map(|s| s.to_string())),
        ("tyndall.partial", Some(truth.partial.to_string())),
    ];
    file.metadata = numbers.into_iter().filter_map(|(key, text)| Some((key.to_owned(), text?))).collect();
    file.metadata.extend(truth.made_by.iter().cloned());
    file.metadata.push((REFERENCE.to_owned(), "true".to_owned()));
    exr::write(out.join(&exr), &file)?;
    png::write(out.join(&png), &truth.image, entry.exposure, ToneCurve::Srgb)?;
    let mean = |image: &Image| image.mean().iter().sum::<f64>() / 3.0;
    Ok(Reference {
        kind: truth.kind.clone(),
        exr,
        png,
        spp: truth.spp,
        seconds: truth.seconds,
        variance: truth.variance.as_ref().map(mean),
        partial: truth.partial,
        paths: truth.paths.map(|p| p.to_string()),
    })
}
