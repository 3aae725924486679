//! From an experiment file to its plan: names are looked up, defaults filled in, and what is wrong is pointed at.

use super::file::{BudgetDef, EstimatorDef, ExperimentFile, HeuristicDef, ReferenceDef, SceneDef};
use super::metrics::Metric;
use super::plan::{EstimatorPlan, Lengths, Plan, ReferencePlan, ScenePlan};
use super::results::{Crop, Figures, Origin};
use crate::error::{Error, Result, did_you_mean, nearest_on_disk};
use crate::render::Budget;
use crate::scene::file::source::{Source, Span};
use crate::scene::file::values::Count;
use crate::transport::expression::Expression;
use crate::transport::merge::{MERGES, MergeDef, MergeSettings, Radius};
use crate::transport::settings::{Heuristic, Layers, Settings, Tracking};
use crate::transport::technique::{PRESETS, Technique, TechniqueSet};
use std::path::Path;
use toml::Spanned;

/// Metrics where the file names none.
const DEFAULT_METRICS: [Metric; 5] = [Metric::RelMse, Metric::Mse, Metric::Mae, Metric::Smape, Metric::Flip];

/// Colours of estimators that have none of their own, in order [Okabe & Ito 2008].
const PALETTE: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];

/// Names that the results folder needs for itself.
const RESERVED: [&str; 2] = ["figures", "cells"];

/// The plan in an experiment file.
///
/// # Errors
/// Whatever is wrong with the file, with the place in it.
pub fn resolve(source: &Source) -> Result<Plan> {
    let file: ExperimentFile = source.parse()?;
    let name = source.path().file_stem().map_or(String::new(), |s| s.to_string_lossy().into_owned());
    let resolver = Resolver { source, file: &file };
    let metrics = resolver.metrics()?;
    let estimators = resolver.estimators()?;
    let scenes = resolver.scenes()?;
    let figures = resolver.figures(&estimators, &scenes)?;
    let warnings = resolver.warnings(&estimators, &scenes);
    Ok(Plan {
        title: file.title.clone().unwrap_or_else(|| name.clone()),
        name,
        source: Origin::of(source),
        text: source.text().to_owned(),
        description: file.description.trim().to_owned(),
        runs: file.runs.map_or(1, |n| n.0),
        paths: resolver.paths(&file.paths)?.unwrap_or(Expression::ALL),
        seed: file.seed.map_or(0, |n| n.0.into()),
        metrics,
        figures,
        scenes,
        estimators,
        warnings,
    })
}

struct Resolver<'a> {
    source: &'a Source,
    file: &'a ExperimentFile,
}

fn count<const MIN: u32>(n: &Option<Spanned<Count<MIN>>>) -> Option<u32> {
    n.as_ref().map(|n| n.get_ref().0)
}

/// A number as the file has it: the shortest decimal that makes this one.
fn as_written(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(value.into())
}

fn size(size: &Option<[Count<1>; 2]>) -> Option<[u32; 2]> {
    size.map(|s| s.map(|n| n.0))
}

impl Resolver<'_> {
    fn metrics(&self) -> Result<Vec<Metric>> {
        let Some(named) = &self.file.metrics else { return Ok(DEFAULT_METRICS.to_vec()) };
        let mut metrics = Vec::new();
        for name in named {
            let metric = Metric::from_key(name.get_ref())
                .map_err(|e| self.source.error(name.span(), e.to_string()))?;
            if metrics.contains(&metric) {
                return Err(self.source.error(name.span(), format!("`{}` is there twice", name.get_ref())));
            }
            metrics.push(metric);
        }
        Ok(metrics)
    }

    fn budget(&self, def: &Spanned<BudgetDef>) -> Result<Budget> {
        let BudgetDef { spp, seconds, relmse } = def.get_ref();
        let (spp, seconds) = (spp.map(|n| n.0.into()), seconds.map(|s| as_written(s.get())));
        match (spp, seconds, relmse) {
            (Some(spp), None, None) => Ok(Budget::Spp(spp)),
            (None, Some(seconds), None) => Ok(Budget::Seconds(seconds)),
            (None, None, Some(_)) => {
                let message = "not every estimator comes to a relMSE: `relmse` needs a bound, `spp` or `seconds`, beside it";
                Err(self.source.error(def.span(), message))
            }
            (_, _, Some(target)) => Ok(Budget::RelMse { target: as_written(target.get()), spp, seconds }),
            _ => Err(self.source.error(
                def.span(),
                "a budget has exactly one of `spp` and `seconds`, or `relmse` with at least one of them",
            )),
        }
    }

    /// Techniques by a preset's key or by their own; exactly one of them.
    fn techniques(
        &self,
        what: &str,
        span: Span,
        preset: &Option<Spanned<String>>,
        techniques: &Option<Spanned<Vec<String>>>,
    ) -> Result<TechniqueSet> {
        match (preset, techniques) {
            (Some(preset), None) => {
                let row = PRESETS.iter().find(|p| p.key == preset.get_ref());
                let row = row.ok_or_else(|| {
                    let known = PRESETS.iter().map(|p| p.key);
                    self.source.unknown_name(preset.span(), "preset", preset.get_ref(), known)
                })?;
                Ok(TechniqueSet::of(row.techniques))
            }
            (None, Some(names)) => TechniqueSet::parse(names.get_ref().iter().map(String::as_str))
                .map_err(|e| self.source.error(names.span(), e.to_string())),
            (Some(_), Some(names)) => {
                let message = format!("{what} has `preset` or `techniques`, not both");
                Err(self.source.error(names.span(), message))
            }
            (None, None) => Err(self.source.error(span, format!("{what} lacks `preset` (or `techniques`)"))),
        }
    }

    fn estimators(&self) -> Result<Vec<EstimatorPlan>> {
        let mut plans: Vec<EstimatorPlan> = Vec::new();
        for def in &self.file.estimator {
            let plan = self.estimator(def, plans.len())?;
            if plans.iter().any(|p| p.key == plan.key) {
                let span = def.get_ref().name.as_ref().map_or(def.span(), Spanned::span);
                let message = format!("two estimators have the name `{}`: give one another `name`", plan.key);
                return Err(self.source.error(span, message));
            }
            plans.push(plan);
        }
        if plans.is_empty() {
            return Err(Error::file(self.source.path(), "there is no [[estimator]] in this experiment"));
        }
        Ok(plans)
    }

    fn estimator(&self, spanned: &Spanned<EstimatorDef>, index: usize) -> Result<EstimatorPlan> {
        let def = spanned.get_ref();
        let techniques = self.techniques("an estimator", spanned.span(), &def.preset, &def.techniques)?;
        let key = match &def.name {
            Some(name) => self.key(name.get_ref(), name.span())?,
            None => match &def.preset {
                Some(preset) => preset.get_ref().clone(),
                None => techniques.to_string().replace(',', "+"),
            },
        };
        let label = def.label.clone().unwrap_or_else(|| {
            let preset = def.preset.as_ref().filter(|_| def.name.is_none());
            let row = preset.and_then(|name| PRESETS.iter().find(|p| p.key == name.get_ref()));
            row.map_or_else(|| key.clone(), |row| row.label.to_owned())
        });
        let budget = match def.budget.as_ref().or(self.file.budget.as_ref()) {
            Some(budget) => self.budget(budget)?,
            None => {
                let message = "this estimator has no budget: the experiment needs `budget = { spp = … }` or \
                               `budget = { seconds = … }`";
                return Err(self.source.error(spanned.span(), message));
            }
        };
        let color = match &def.color {
            Some(color) => self.color(color)?,
            None => default_color(index),
        };
        Ok(EstimatorPlan {
            label,
            caption: def.caption.trim().to_owned(),
            color,
            techniques,
            heuristic: self.heuristic(def)?,
            connections: def.connections.unwrap_or_default(),
            light_starts: def.light_starts.unwrap_or_default(),
            tracking: self.tracking(&def.tracking, techniques)?,
            merging: self.merging(&def.merge, &def.preset, techniques)?,
            lengths: Lengths { min: count(&def.min_length), max: count(&def.max_length) },
            paths: self.paths(&def.paths)?,
            layers: self.layers(def, &key)?,
            pyramid: self.file.figures.pyramid.as_ref().map_or(6, |p| p.get_ref()[1].0),
            budget,
            key,
        })
    }

    /// Which paths count, where that is said.
    fn paths(&self, said: &Option<Spanned<String>>) -> Result<Option<Expression>> {
        let parse = |text: &Spanned<String>| {
            Expression::parse(text.get_ref()).map_err(|e| self.source.error(text.span(), e.to_string()))
        };
        said.as_ref().map(parse).transpose()
    }

    /// How an estimator or a reference merges.
    fn merging(
        &self,
        def: &Option<Spanned<MergeDef>>,
        preset: &Option<Spanned<String>>,
        techniques: TechniqueSet,
    ) -> Result<MergeSettings> {
        let preset = preset.as_ref().and_then(|key| PRESETS.iter().find(|p| p.key == key.get_ref()));
        let said = def.as_ref().map_or_else(MergeDef::default, |d| *d.get_ref());
        let merging = said.resolve(preset.is_some_and(|p| p.first));
        merging.validate(techniques).map_err(|e| {
            let span = def.as_ref().map_or(0..0, Spanned::span);
            self.source.error(span, e.to_string())
        })?;
        Ok(merging)
    }

    /// Entries of `merge` for techniques that are not there, and references that are biased by what merges in them.
    fn warnings(&self, estimators: &[EstimatorPlan], scenes: &[ScenePlan]) -> Vec<String> {
        let mut warnings: Vec<String> = Vec::new();
        let path = self.source.path().display();
        let mut idle = |whose: &str, merge: &Option<Spanned<MergeDef>>, techniques: TechniqueSet| {
            let idle = merge.as_ref().map_or(Vec::new(), |merge| merge.get_ref().idle(techniques));
            warnings.extend(idle.into_iter().map(|(key, why)| {
                format!("{path}: `{key}` in the `merge` of {whose} changes nothing: {why}")
            }));
        };
        for (def, plan) in self.file.estimator.iter().zip(estimators) {
            idle(&format!("estimator {}", plan.key), &def.get_ref().merge, plan.techniques);
        }
        let mut biased = Vec::new();
        let mut shared_is_done = false;
        for (def, plan) in self.file.scene.iter().zip(scenes) {
            let own = def.get_ref().reference.as_ref();
            let said = own.or(self.file.reference.as_ref());
            let Some((said, ReferencePlan::Render { techniques, merging, .. })) =
                said.zip(plan.reference.as_ref())
            else {
                continue;
            };
            // Scenes without a reference of their own share one, which is warned of once.
            if own.is_none() && std::mem::replace(&mut shared_is_done, true) {
                continue;
            }
            let whose = match own {
                Some(_) => format!("the reference of scene {}", plan.key),
                None => "the reference".to_owned(),
            };
            idle(&whose, &said.get_ref().merge, *techniques);
            biased.extend(biased_reference(&whose, *techniques, merging));
        }
        warnings.extend(biased.into_iter().map(|warning| format!("{path}: {warning}")));
        warnings
    }

    /// How media on grids are gone through.
    fn tracking(&self, said: &Option<Spanned<Tracking>>, techniques: TechniqueSet) -> Result<Tracking> {
        let Some(said) = said else { return Ok(Tracking::default()) };
        let settings = Settings { tracking: *said.get_ref(), ..Settings::new(techniques) };
        settings.check_tracking().map_err(|e| self.source.error(said.span(), e.to_string()))?;
        Ok(settings.tracking)
    }

    fn heuristic(&self, def: &EstimatorDef) -> Result<Heuristic> {
        match (def.heuristic, &def.exponent) {
            (Some(HeuristicDef::Power), exponent) => {
                Ok(Heuristic::Power(exponent.as_ref().map_or(2.0, |e| e.get_ref().get())))
            }
            (_, Some(exponent)) => {
                let message = "an exponent makes sense with `heuristic = \"power\"` only";
                Err(self.source.error(exponent.span(), message))
            }
            _ => Ok(Heuristic::Balance),
        }
    }

    /// The layers that an estimator keeps: what is said, else what the figures want.
    fn layers(&self, def: &EstimatorDef, key: &str) -> Result<Layers> {
        let figures = &self.file.figures;
        if let Some(pyramid) = &figures.pyramid
            && pyramid.get_ref()[0].0 > pyramid.get_ref()[1].0
        {
            return Err(self.source.error(pyramid.span(), "expected [shortest, longest] paths, in segments"));
        }
        let wants_families = figures.techniques.as_ref().is_some_and(|t| *t.get_ref());
        let wanted = match (&figures.pyramid, wants_families) {
            (Some(_), _) => Layers::All,
            (None, true) => Layers::Families,
            (None, false) => Layers::None,
        };
        let first = figures.contributions.as_ref().is_some_and(|name| name.get_ref() == key);
        let wanted = if first && wanted == Layers::None { Layers::Families } else { wanted };
        let Some(said) = def.layers.as_ref().or(self.file.layers.as_ref()) else { return Ok(wanted) };
        if (def.layers.is_none() || first) && (*said.get_ref() as u8) < wanted as u8 {
            let message = match wanted {
                Layers::All => "the pyramid wants layers = \"all\"",
                _ => "the figure of contributions wants layers = \"families\" or \"all\"",
            };
            return Err(self.source.error(said.span(), message));
        }
        Ok(*said.get_ref())
    }

    fn scenes(&self) -> Result<Vec<ScenePlan>> {
        let mut plans: Vec<ScenePlan> = Vec::new();
        for def in &self.file.scene {
            let plan = self.scene(def.get_ref())?;
            if plans.iter().any(|p| p.key == plan.key) {
                let span = def.get_ref().name.as_ref().map_or(def.get_ref().file.span(), Spanned::span);
                let message = format!("two scenes have the name `{}`: give one another `name`", plan.key);
                return Err(self.source.error(span, message));
            }
            plans.push(plan);
        }
        if plans.is_empty() {
            return Err(Error::file(self.source.path(), "there is no [[scene]] in this experiment"));
        }
        Ok(plans)
    }

    fn scene(&self, def: &SceneDef) -> Result<ScenePlan> {
        let file = def.file.get_ref();
        let named = self.source.folder().join(file);
        let path = crate::scene::file::resolve(&named).map_err(|e| {
            let mut message = e.to_string();
            // As this file would name it, and not as the program does.
            if let Some(meant) = self.scene_meant(file) {
                message.truncate(message.find("; did you mean").unwrap_or(message.len()));
                message.push_str(&did_you_mean(Some(meant)));
            }
            self.source.error(def.file.span(), message)
        })?;
        let key = match &def.name {
            Some(name) => self.key(name.get_ref(), name.span())?,
            None => self.key(&default_scene_key(&path), def.file.span())?,
        };
        let crops = def.crops.iter().map(|crop| {
            let crop = crop.get_ref();
            let [x, y, width, height] = [crop.x.0, crop.y.0, crop.width.0, crop.height.0].map(|n| n as usize);
            Crop { name: crop.name.clone(), x, y, width, height }
        });
        let reference = def.reference.as_ref().or(self.file.reference.as_ref());
        let paths = match self.paths(&def.paths)? {
            Some(paths) => paths,
            None => self.paths(&self.file.paths)?.unwrap_or(Expression::ALL),
        };
        Ok(ScenePlan {
            label: def.label.clone().unwrap_or_else(|| key.clone()),
            key,
            caption: def.caption.trim().to_owned(),
            path,
            file: file.clone(),
            size: size(&def.size).or(size(&self.file.size)),
            exposure: def.exposure.or(self.file.exposure).map_or(0.0, |e| e.get()),
            crops: crops.collect(),
            lengths: Lengths {
                min: count(&def.min_length).or(count(&self.file.min_length)),
                max: count(&def.max_length).or(count(&self.file.max_length)),
            },
            reference: reference.map(|r| self.reference(r, paths)).transpose()?,
            paths,
        })
    }

    /// What the name of a scene file that is not there was probably meant to be: a name that is nearly the same where it points
    /// to, or, of a name alone, that of a scene in the folder `scenes` beside the experiment's or in it.
    fn scene_meant(&self, file: &str) -> Option<String> {
        let folder = self.source.folder();
        nearest_on_disk(folder, Path::new(file)).or_else(|| {
            let alone = Path::new(file).components().count() == 1;
            let places =
                ["../scenes", "scenes"].into_iter().filter(|place| alone && folder.join(place).is_dir());
            places.into_iter().find_map(|place| {
                let folder = folder.join(place);
                let known = || Some(file.to_owned()).filter(|file| folder.join(file).exists());
                let name = known().or_else(|| nearest_on_disk(&folder, Path::new(file)))?;
                Some(format!("{place}/{name}"))
            })
        })
    }

    /// A reference, of these paths where it has none of its own.
    fn reference(&self, spanned: &Spanned<ReferenceDef>, paths: Expression) -> Result<ReferencePlan> {
        let def = spanned.get_ref();
        if let Some(file) = &def.file {
            let rendered = [
                def.preset.is_some(),
                def.techniques.is_some(),
                def.paths.is_some(),
                def.merge.is_some(),
                def.tracking.is_some(),
            ];
            if rendered.contains(&true) || def.spp.is_some() || def.seconds.is_some() {
                let message = "a reference is a `file` or an estimator with a budget, not both";
                return Err(self.source.error(file.span(), message));
            }
            let path = self.source.folder().join(file.get_ref());
            if !path.is_file() {
                let meant = did_you_mean(nearest_on_disk(self.source.folder(), Path::new(file.get_ref())));
                let message = format!("there is no reference image `{}`{meant}", path.display());
                return Err(self.source.error(file.span(), message));
            }
            return Ok(ReferencePlan::File { path, file: file.get_ref().clone() });
        }
        let techniques = self.techniques("a reference", spanned.span(), &def.preset, &def.techniques)?;
        let budget = match (def.spp, def.seconds) {
            (Some(spp), None) => Budget::Spp(spp.0.into()),
            (None, Some(seconds)) => Budget::Seconds(seconds.get().into()),
            _ => {
                let message = "a reference that is rendered has exactly one of `spp` and `seconds`";
                return Err(self.source.error(spanned.span(), message));
            }
        };
        let merging = Box::new(self.merging(&def.merge, &def.preset, techniques)?);
        let paths = Box::new(self.paths(&def.paths)?.unwrap_or(paths));
        let tracking = self.tracking(&def.tracking, techniques)?;
        Ok(ReferencePlan::Render { techniques, tracking, merging, paths, budget })
    }

    fn figures(&self, estimators: &[EstimatorPlan], scenes: &[ScenePlan]) -> Result<Figures> {
        let def = &self.file.figures;
        let reference = scenes.iter().any(|s| s.reference.is_some());
        let contributions = def.contributions.as_ref().map(|name| {
            let known = || estimators.iter().map(|e| e.key.as_str());
            if known().any(|key| key == name.get_ref()) {
                return Ok(name.get_ref().clone());
            }
            Err(self.source.unknown_name(name.span(), "estimator", name.get_ref(), known()))
        });
        let contributions = contributions.transpose()?;
        // What the first figure shows in large is not shown again in small.
        let others = estimators.iter().filter(|e| Some(&e.key) != contributions.as_ref());
        let layers = others.into_iter().any(|e| e.layers != Layers::None);
        Ok(Figures {
            contributions,
            strip: def.strip.unwrap_or(false),
            comparison: def.comparison.unwrap_or(true),
            techniques: def.techniques.as_ref().map_or(layers, |t| *t.get_ref()),
            pyramid: def.pyramid.as_ref().map(|p| p.get_ref().map(|n| n.0)),
            convergence: def.convergence.unwrap_or(reference),
            costs: def.costs.unwrap_or(false),
            width_cm: def.width_cm.map(|w| as_written(w.get())),
            font_pt: def.font_pt.map(|f| as_written(f.get())),
        })
    }

    /// A name that can be part of a path.
    fn key(&self, name: &str, span: Span) -> Result<String> {
        let fine = |c: char| c.is_ascii_alphanumeric() || "-_.+".contains(c);
        if name.is_empty() || !name.chars().all(fine) || name.starts_with('.') || RESERVED.contains(&name) {
            let message = format!(
                "`{name}` cannot name results: expected letters, digits, `-`, `_`, `+` and `.`, not a dot first, \
                 and neither `figures` nor `cells`"
            );
            return Err(self.source.error(span, message));
        }
        Ok(name.to_owned())
    }

    fn color(&self, color: &Spanned<String>) -> Result<String> {
        let text = color.get_ref();
        let digits = text.strip_prefix('#').unwrap_or("");
        if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
            let message = format!("expected a colour `#rrggbb`, found `{text}`");
            return Err(self.source.error(color.span(), message));
        }
        Ok(text.to_ascii_lowercase())
    }
}

/// What is to be said of a reference that merges with radii that nobody chose for it: these are for the least error of a render, of
/// which a reference's noise is a small part and its bias is not. None where there are no such radii.
fn biased_reference(whose: &str, techniques: TechniqueSet, merging: &MergeSettings) -> Option<String> {
    let open = |t: &Technique| techniques.has(*t) && merging.of(*t).radius == Radius::Auto;
    let keys: Vec<&str> = MERGES.into_iter().filter(open).map(|t| t.info().key).collect();
    (!keys.is_empty()).then(|| {
        format!(
            "{whose} merges ({}) with radii as they are chosen for renders, and their bias is in it: errors are measured against \
             that, too small for estimators with the same bias and too large for the others; `pt` or `bpt` as its preset has none, \
             and less has a smaller `radius` in its `merge`, such as {{ footprint = 0.5 }}, or many more samples, as radii shrink \
             with them",
            keys.join(", ")
        )
    })
}

/// The name of a scene file's folder, or of the file if it is not called `scene.toml`.
fn default_scene_key(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    let named = if stem == "scene" {
        // The folder as the system knows it, for paths such as `../scene.toml`.
        let whole = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        whole.parent().and_then(Path::file_name).map(|n| n.to_owned())
    } else {
        None
    };
    let name = named.unwrap_or_else(|| stem.to_owned()).to_string_lossy().into_owned();
    let clean = |c: char| if c.is_ascii_alphanumeric() || "-_.+".contains(c) { c } else { '-' };
    name.chars().map(clean).collect()
}

/// A colour of the palette; beyond it, hues at golden-ratio steps, so that no two are the same.
fn default_color(index: usize) -> String {
    if let Some(color) = PALETTE.get(index) {
        return (*color).to_owned();
    }
    let hue = (index as f64 * 0.618_033_988_75).fract() * 6.0;
    let channel = |shift: f64| {
        let distance = ((hue + shift) % 6.0 - 3.0).abs();
        (40.0 + 160.0 * (distance - 1.0).clamp(0.0, 1.0)).round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", channel(0.0), channel(4.0), channel(2.0))
}
