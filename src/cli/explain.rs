//! `tyndall explain`: why a pixel is as it is.

use super::args::ExplainArgs;
use super::progress::while_loading;
use super::render::{DEFAULT_SPP, pinned, settings, techniques};
use super::session::{Ending, print, stop_on_interrupt, with_threads};
use crate::error::{Error, Result};
use crate::experiment::store::{SceneKey, run_of};
use crate::explain::{Found, Largest, Replay, command, largest, text};
use crate::film::exr::{LayeredImage, read_layers};
use crate::render::files::{
    OUTLIERS, REFERENCE, RENDERING, RUNS, Resolved, SCENE_CONTENTS, SCENE_FILE, entries, folders,
};
use crate::scene::Scene;
use crate::scene::file::{Overrides, load, resolve};
use crate::transport::settings::Settings;
use glam::UVec2;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// What may be said beside an EXR: all that decides the samples is in it.
const BESIDE_A_FILE: [&str; 7] = ["scene", "pixel", "sample", "path", "most", "top", "threads"];

/// A replay may differ from what was rendered by this share; another iteration would by far more.
const TOLERANCE: f32 = 1e-3;

/// Replays samples of a pixel and tells of one path all there is; or lists the pixels with the largest samples of a file. `given`
/// are the options on the command line.
///
/// # Errors
/// Anything wrong with the scene or the options; a path that is not among those found.
pub fn run(args: &ExplainArgs, given: &[String]) -> Result<Ending> {
    let path = &args.of.scene;
    let kind = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match kind.as_deref() {
        Some("exr") => return of_file(args, path, given),
        Some("png") => {
            return Err(Error::file(
                path,
                "a PNG does not say how it was made: explain the EXR, or the scene",
            ));
        }
        _ => {}
    }
    let Some(pixel) = args.pixel else {
        return Err(Error::usage(
            "which pixel? --pixel X,Y says it; an EXR that tyndall wrote, instead of a scene, lists those with the largest samples",
        ));
    };
    let techniques = techniques(&args.of)?;
    let path = resolve(path)?;
    let scene = while_loading(|| load(&path, &Overrides { size: args.of.size.map(UVec2::from_array) }))?;
    let settings = settings(&args.of, techniques, &scene)?;
    let spp = args.of.spp;
    let iterations = match args.sample {
        Some(sample) => only(sample, spp.unwrap_or(u64::MAX))?,
        None => 0..spp.unwrap_or(DEFAULT_SPP),
    };
    let explained = explain(args, &scene, settings, pixel, iterations)?;
    print(explained.words)?;
    Ok(explained.ending)
}

/// The iterations of this sample alone, where so many samples have one of this number.
fn only(sample: u64, spp: u64) -> Result<Range<u64>> {
    if sample < spp {
        return Ok(sample..sample + 1);
    }
    Err(Error::usage(format!(
        "there is no sample {sample}: those of {spp} spp have the numbers 0 to {}",
        spp.saturating_sub(1)
    )))
}

/// What became of a replay.
struct Explained {
    words: String,
    /// Luminance of all that was found.
    whole: f32,
    ending: Ending,
}

/// What is found in iterations of a pixel.
fn explain(
    args: &ExplainArgs,
    scene: &Scene,
    settings: Settings,
    pixel: [u32; 2],
    iterations: Range<u64>,
) -> Result<Explained> {
    let stop = stop_on_interrupt()?;
    with_threads(args.of.threads, || {
        let replay = Replay::new(scene, pinned(&settings, scene), UVec2::from_array(pixel))?;
        let mut found: Vec<Found> = Vec::new();
        for iteration in iterations {
            if stop.requested() {
                break;
            }
            found.extend(replay.iteration(iteration));
        }
        // What is not finite first: a render drops it, and it wants explaining most.
        let size = |f: &Found| if f.luminance.is_nan() { f32::INFINITY } else { f.luminance };
        found.sort_by(|a, b| size(b).total_cmp(&size(a)));
        if args.path > found.len().max(1) && !stop.requested() {
            let paths =
                if found.len() == 1 { "path is".into() } else { format!("{} paths are", found.len()) };
            let message = format!("there is no --path {}: {paths} there", args.path);
            return Err(Error::usage(message));
        }
        let whole = found.iter().map(|f| f.luminance).filter(|l| l.is_finite()).sum::<f32>();
        let words = text(scene, &replay, &found, args.path, args.most);
        Ok(Explained { words, whole, ending: Ending::from(&stop) })
    })
}

/// An EXR stands for scene and settings.
fn of_file(args: &ExplainArgs, path: &Path, given: &[String]) -> Result<Ending> {
    let others: Vec<String> = given
        .iter()
        .filter(|id| !BESIDE_A_FILE.contains(&id.as_str()))
        .map(|id| format!("--{}", id.replace('_', "-")))
        .collect();
    if !others.is_empty() {
        let message =
            format!("scene and settings are those of this file: {} cannot be said", others.join(", "));
        return Err(Error::file(path, message));
    }
    let file = read_layers(path)?;
    if let Some(runs) = file.text(RUNS) {
        return Err(Error::file(path, of_a_mean(path, runs)));
    }
    if file.text(REFERENCE).is_some() {
        return Err(Error::file(path, of_a_reference(path)));
    }
    let made = Made::of(path, &file)?;
    let outliers = largest(&file);
    let Some(pixel) = args.pixel else {
        if args.sample.is_some() {
            return Err(Error::usage("--sample N is of a pixel: --pixel X,Y says which"));
        }
        let Some(all) = outliers else {
            let message = format!(
                "has no layer `{OUTLIERS}`, which says where the largest samples are: the runs of an experiment have it (run-00.exr …), and \
                 renders with --layers families. --pixel X,Y explains a pixel without it"
            );
            return Err(Error::file(path, message));
        };
        print(made.list(path, &all, args.top))?;
        return Ok(Ending::Done);
    };
    let asked = args.sample.map(|sample| only(sample, made.iterations)).transpose()?;
    let scene = made.scene(path)?;
    let settings = made.settings(path, &scene)?;
    // Without the layer it is not known which sample is the largest: all are looked at.
    let Some(all) = outliers else {
        let iterations = asked.unwrap_or(0..made.iterations);
        let explained = explain(args, &scene, settings, pixel, iterations)?;
        print(explained.words)?;
        return Ok(explained.ending);
    };
    let known = all.iter().find(|l| l.pixel == pixel);
    let sample = args.sample.or(known.map(|l| l.iteration));
    let iterations = sample.map_or(Ok(0..0), |n| only(n, made.iterations))?;
    let Explained { words, whole, ending } = explain(args, &scene, settings, pixel, iterations)?;
    let Some(sample) = sample else {
        print(format!("No sample added anything to the pixel {},{}.\n", pixel[0], pixel[1]))?;
        return Ok(ending);
    };
    if let Some(known) = known.filter(|l| l.iteration == sample) {
        let apart = (whole - known.luminance).abs();
        if apart > TOLERANCE * known.luminance && ending == Ending::Done {
            eprintln!(
                "warning: this is not what was rendered: the file has a luminance of {:.6e} for this sample, and the replay {whole:.6e}",
                known.luminance
            );
        }
        print(format!(
            "The largest sample of pixel {},{} is number {sample}: {:.1}% of all that the pixel got.\n",
            pixel[0],
            pixel[1],
            100.0 * known.share
        ))?;
    }
    print(words)?;
    Ok(ending)
}

/// The runs in the folder of an estimator, in order.
fn runs_in(folder: &Path) -> Vec<PathBuf> {
    let is_run = |path: &PathBuf| path.file_name().and_then(|n| n.to_str()).and_then(run_of).is_some();
    entries(folder).into_iter().filter(is_run).collect()
}

/// Where something can be explained, beside a file that cannot.
fn beside(path: &Path) -> String {
    let first = runs_in(path.parent().unwrap_or(Path::new(""))).into_iter().next();
    first.map_or(String::new(), |run| format!(", {} for one", run.display()))
}

/// What to explain instead of a reference.
fn of_a_reference(path: &Path) -> String {
    let folders = folders(path.parent().unwrap_or(Path::new("")));
    let run = folders.iter().find_map(|folder| runs_in(folder).into_iter().next());
    let run = run.map_or_else(|| "run-00.exr …".to_owned(), |run| run.display().to_string());
    format!("is a reference, and has no samples of its own: explain a run that is measured against it: {run}")
}

/// What to explain instead of the mean over several runs.
fn of_a_mean(path: &Path, runs: &str) -> String {
    let beside = runs_in(path.parent().unwrap_or(Path::new("")));
    let runs = if runs == "1" { "of a single run".to_owned() } else { format!("over {runs} runs") };
    let where_to = match &beside[..] {
        [] => "explain one of these: run-00.exr …, which are not beside it any more".to_owned(),
        [one] => format!("explain that: {}", one.display()),
        [first, .., last] => format!("explain one of these: {} to {}", first.display(), last.display()),
    };
    format!("is a mean {runs}, and has no samples of its own: {where_to}")
}

/// How a file was made, by its own words.
struct Made {
    resolved: Resolved,
    iterations: u64,
    scene: PathBuf,
    contents: String,
}

impl Made {
    fn of(path: &Path, file: &LayeredImage) -> Result<Self> {
        let text = |key: &str| {
            file.text(key).map(str::to_owned).ok_or_else(|| {
                Error::file(
                    path,
                    format!(
                        "does not say how it was made: it has no metadata `{key}`, as a render by this version of tyndall \
                         and each run of an experiment has{}",
                        beside(path)
                    ),
                )
            })
        };
        let resolved: Resolved = serde_json::from_str(&text("tyndall.settings")?)
            .map_err(|e| Error::file(path, format!("its metadata `tyndall.settings` is damaged: {e}")))?;
        let (scene, contents) = (text(SCENE_FILE)?.into(), text(SCENE_CONTENTS)?);
        if file.text("tyndall.rendering").is_some_and(|code| code != RENDERING) {
            eprintln!(
                "warning: {}: other code rendered it than this program has: samples may differ",
                path.display()
            );
        }
        let iterations = text("tyndall.iterations")?
            .parse()
            .map_err(|e| Error::file(path, format!("its metadata `tyndall.iterations` is damaged: {e}")))?;
        Ok(Self { resolved, iterations, scene, contents })
    }

    /// The scene, if it is still the same.
    fn scene(&self, path: &Path) -> Result<Scene> {
        if !self.scene.is_file() {
            let message = format!("its scene is not there any more: {}", self.scene.display());
            return Err(Error::file(path, message));
        }
        let size = Some(UVec2::from_array(self.resolved.size));
        let scene = while_loading(|| load(&self.scene, &Overrides { size }))?;
        if SceneKey::new(&scene)?.contents() != self.contents {
            let message =
                format!("its scene has changed since: {}, or a file that it refers to", self.scene.display());
            return Err(Error::file(path, message));
        }
        Ok(scene)
    }

    /// The settings, which must come to the same words again.
    fn settings(&self, path: &Path, scene: &Scene) -> Result<Settings> {
        let settings = self.resolved.settings().map_err(|e| Error::file(path, e.to_string()))?;
        if Resolved::new(&self.resolved.scene, scene, &settings) != self.resolved {
            let message =
                "its settings come to others with this version of tyndall: it has to be rendered again";
            return Err(Error::file(path, message));
        }
        Ok(settings)
    }

    /// The pixels with the largest samples, with what to type to see more of each.
    fn list(&self, path: &Path, all: &[Largest], top: usize) -> String {
        let Resolved { scene, techniques, size: [width, height], .. } = &self.resolved;
        let mut text = format!(
            "{scene}, {width}x{height}, {} spp of {}: the pixels with the largest samples, by luminance times share of the pixel\n\n{:>4} {:>13} {:>12} {:>11} {:>10}\n",
            self.iterations,
            techniques.join(","),
            "",
            "luminance",
            "of the pixel",
            "pixel",
            "sample"
        );
        for (i, l) in all.iter().take(top).enumerate() {
            let pixel = format!("{},{}", l.pixel[0], l.pixel[1]);
            text.push_str(&format!(
                "{:>4} {:>13.6e} {:>11.1}% {pixel:>11} {:>10}   {}\n",
                i + 1,
                l.luminance,
                100.0 * l.share,
                l.iteration,
                command(path, l.pixel)
            ));
        }
        text
    }
}
