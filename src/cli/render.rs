//! `tyndall render`.

use super::args::{HeuristicArg, RenderArgs, SamplesArgs};
use super::progress::{Progress, clock, while_loading};
use super::session::{Ending, stop_on_interrupt, with_threads};
use crate::error::{Error, Result};
use crate::experiment::store::SceneKey;
use crate::film::exr;
use crate::film::png::{self, ToneCurve};
use crate::render::files::{Resolved, check_output, layered, origin};
use crate::render::{Budget, Job, Observer, Outcome};
use crate::scene::Scene;
use crate::scene::file::{Overrides, load, resolve};
use crate::stage;
use crate::transport::expression::Expression;
use crate::transport::merge::MergeDef;
use crate::transport::settings::{Heuristic, Settings};
use crate::transport::technique::{TechniqueSet, preset};
use glam::UVec2;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Samples per pixel where neither these nor a time is asked for.
pub const DEFAULT_SPP: u64 = 16;

/// Seconds of setting up that are told of.
const WORTH_A_WORD: f64 = 0.1;

/// The files to write.
#[derive(Debug, PartialEq)]
struct Outputs {
    exr: Option<PathBuf>,
    png: Option<PathBuf>,
}

/// Renders a scene.
///
/// # Errors
/// Anything wrong with the scene or the options, before anything is rendered; files that cannot be written.
pub fn run(args: &RenderArgs) -> Result<Ending> {
    let techniques = techniques(&args.of)?;
    let path = resolve(&args.of.scene)?;
    let scene = while_loading(|| load(&path, &Overrides { size: args.of.size.map(UVec2::from_array) }))?;
    // Now, and not when it is done: by then the files may be others.
    let key = SceneKey::new(&scene)?;
    let settings = Settings { layers: args.layers.into(), ..settings(&args.of, techniques, &scene)? };
    let outputs = outputs(args, &scene, techniques)?;
    for file in [&outputs.exr, &outputs.png].into_iter().flatten() {
        check_output(file)?;
    }
    for warning in &scene.warnings {
        eprintln!("warning: {}: {warning}", path.display());
    }
    let budget = args.time.map_or(Budget::Spp(args.of.spp.unwrap_or(DEFAULT_SPP)), Budget::Seconds);
    let stop = stop_on_interrupt()?;
    let (settings, outcome) = with_threads(args.of.threads, || {
        let start = Instant::now();
        let settings = pinned(&settings, &scene);
        let chosen = start.elapsed().as_secs_f64();
        let job = Job { scene: &scene, settings, budget, first: 0, chosen };
        let mut progress = Progress::new().with_tev(args.tev.as_deref());
        progress.begin(&format!("{}: {techniques}", scene.name), budget);
        let outcome = job.run(&stop, &mut progress);
        progress.end();
        Ok((settings, outcome?))
    })?;
    if outcome.film.iterations() == 0 {
        eprintln!("stopped before the first sample: nothing is written");
        return Ok(Ending::Stopped);
    }
    write(args, &outputs, (&path, &key), &scene, &settings, &outcome)?;
    Ok(if outcome.partial { Ending::Stopped } else { Ending::Done })
}

/// The techniques that are asked for.
///
/// # Errors
/// Unknown names.
pub fn techniques(args: &SamplesArgs) -> Result<TechniqueSet> {
    if args.techniques.is_empty() {
        return Ok(TechniqueSet::of(preset(&args.estimator)?.techniques));
    }
    TechniqueSet::parse(args.techniques.iter().map(String::as_str))
}

/// The settings of a render of a scene, as they were asked for: what is open is chosen by [`Settings::pinned`].
///
/// # Errors
/// What makes no sense.
pub fn settings(args: &SamplesArgs, techniques: TechniqueSet, scene: &Scene) -> Result<Settings> {
    let mut settings = Settings::new(techniques);
    let defaults = scene.notes.defaults;
    settings.min_length = args.min_length.or(defaults.min_length).unwrap_or(settings.min_length);
    settings.max_length = args.max_length.or(defaults.max_length).unwrap_or(settings.max_length);
    settings.paths = Expression::parse(&args.paths)?;
    let first = args.techniques.is_empty() && preset(&args.estimator)?.first;
    settings.connections = args.connections.into();
    settings.light_starts = args.light_starts.into();
    settings.tracking = args.tracking.into();
    let merge = MergeDef::parse(&args.merge)?;
    for (key, why) in merge.idle(techniques) {
        eprintln!("warning: --merge {key}… changes nothing: {why}");
    }
    settings.merging = merge.resolve(first);
    settings.seed = args.seed;
    settings.heuristic = match args.heuristic {
        HeuristicArg::Balance => Heuristic::Balance,
        HeuristicArg::Power => Heuristic::Power(2.0),
    };
    settings.validate()?;
    settings.check_scene(scene)?;
    let idle: Vec<&str> = settings.idle(scene).iter().map(|t| t.info().key).collect();
    if !idle.is_empty() {
        eprintln!(
            "warning: nothing scatters in the media of this scene: {} have nothing to do",
            idle.join(", ")
        );
    }
    Ok(settings)
}

/// With what is open chosen, and shown that it is if it takes long.
pub fn pinned(settings: &Settings, scene: &Scene) -> Settings {
    stage::begin("choosing radii, counts and shares");
    while_loading(|| settings.pinned(scene))
}

fn outputs(args: &RenderArgs, scene: &Scene, techniques: TechniqueSet) -> Result<Outputs> {
    let default = || {
        let plain = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
        let name: String = scene.name.chars().map(plain).collect();
        let estimator =
            if args.of.techniques.is_empty() { args.of.estimator.clone() } else { techniques.to_string() };
        PathBuf::from(format!("{name}-{}.exr", estimator.replace(',', "+")))
    };
    let out = args.out.clone().unwrap_or_else(default);
    match out.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("exr") => {
            let png = args.png.then(|| out.with_extension("png"));
            Ok(Outputs { exr: Some(out), png })
        }
        Some("png") => Ok(Outputs { exr: None, png: Some(out) }),
        _ => Err(Error::file(
            &out,
            "cannot tell what kind of file this is: its name has to end in .exr or .png",
        )),
    }
}

fn write(
    args: &RenderArgs,
    outputs: &Outputs,
    (path, key): (&Path, &SceneKey),
    scene: &Scene,
    settings: &Settings,
    outcome: &Outcome,
) -> Result<()> {
    if outcome.setup >= WORTH_A_WORD {
        eprintln!(
            "of these {}, {} went by before the first sample: pilots that choose radii, counts and shares",
            clock(outcome.seconds),
            clock(outcome.setup)
        );
    }
    for (key, words) in &outcome.merges {
        eprintln!("{key}: {words}");
    }
    let dropped = outcome.film.dropped().total();
    if dropped > 0 {
        eprintln!("warning: {dropped} contributions were not finite and were dropped");
    }
    let partial = if outcome.partial { " (partial)" } else { "" };
    if let Some(file) = &outputs.exr {
        let resolved = Resolved::new(&path.to_string_lossy(), scene, settings);
        let mut image = layered(scene, settings, &resolved, outcome);
        image.metadata.extend(origin(path, key.contents()));
        exr::write(file, &image)?;
        eprintln!("wrote {}{partial}", file.display());
    }
    if let Some(file) = &outputs.png {
        png::write(file, &outcome.film.image(), args.exposure, ToneCurve::Srgb)?;
        eprintln!("wrote {}{partial}", file.display());
    }
    Ok(())
}
