//! `tyndall explain`: why a pixel is as it is.

use super::args::ExplainArgs;
use super::progress::while_loading;
use super::render::settings;
use super::render::techniques;
use super::session::{Ending, print, stop_on_interrupt, with_threads};
use crate::error::{Error, Result};
use crate::experiment::store::{SceneKey, is_image_file};
use crate::explain::{Found, Largest, Replay, command, largest, text};
use crate::film::exr::{LayeredImage, read_layers};
use crate::render::files::{
    OUTLIERS, REFERENCE, RENDERING, RUNS, Resolved, SCENE_CONTENTS, SCENE_FILE, entries,
};
use crate::scene::Scene;
use crate::scene::file::{Overrides, load, resolve};
use crate::transport::settings::Settings;
use glam::UVec2;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Iterations that are replayed where neither their number nor one of them is asked for.
const DEFAULT_ITERATIONS: u64 = 16;

/// What may be said beside an EXR: all that decides the samples is in it.
const BESIDE_A_FILE: [&str; 7] = ["scene", "pixel", "sample", "path", "most", "top", "threads"];

/// A replay may differ from what was rendered by this share; another iteration would by far more.
const TOLERANCE: f32 = 1e-3;

/// Replays samples of a pixel and tells of one path all there is; or lists the pixels with the largest samples of a file. `given`
/// are the options on the command line.
///
/// # Errors
/// Anything wrong with the scene or the options.
pub fn run(args: &ExplainArgs, given: &[String]) -> Result<Ending> {
    let path = &args.render.scene;
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        return of_file(args, path, given);
    }
    let render = &args.render;
    let writes = [render.out.is_some(), render.png, render.time.is_some()];
    if writes.contains(&true) {
        return Err(Error::usage("explain renders no image: --out, --png and --time have no meaning here"));
    }
    let Some(pixel) = args.pixel else {
        return Err(Error::usage(
            "which pixel? --pixel X,Y says it; an EXR that tyndall wrote, instead of a scene, lists those with the largest samples",
        ));
    };
    let techniques = techniques(render)?;
    let path = resolve(&render.scene)?;
    let scene = while_loading(|| load(&path, &Overrides { size: render.size.map(UVec2::from_array) }))?;
    let settings = settings(render, techniques, &scene)?;
    let iterations = match args.sample {
        Some(sample) => sample..sample + 1,
        None => 0..render.spp.unwrap_or(DEFAULT_ITERATIONS),
    };
    let (words, _, ending) = explain(args, &scene, settings, pixel, iterations)?;
    print(words)?;
    Ok(ending)
}

/// What is found in iterations of a pixel, and the luminance of all of it.
fn explain(
    args: &ExplainArgs,
    scene: &Scene,
    settings: Settings,
    pixel: [u32; 2],
    iterations: Range<u64>,
) -> Result<(String, f32, Ending)> {
    let stop = stop_on_interrupt()?;
    let (words, whole) = with_threads(args.render.threads, || {
        let replay = Replay::new(scene, settings, UVec2::from_array(pixel))?;
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
        let whole = found.iter().map(|f| f.luminance).filter(|l| l.is_finite()).sum::<f32>();
        Ok((text(scene, &settings, &replay, &found, args.path, args.most), whole))
    })?;
    Ok((words, whole, Ending::from(&stop)))
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
    let Some(all) = largest(&file) else {
        let message = format!(
            "has no layer `{OUTLIERS}`: the runs of an experiment have it (run-00.exr …), and renders with --layers families"
        );
        return Err(Error::file(path, message));
    };
    let Some(pixel) = args.pixel else {
        if args.sample.is_some() {
            return Err(Error::usage("--sample N is of a pixel: --pixel X,Y says which"));
        }
        print(made.list(path, &all, args.top))?;
        return Ok(Ending::Done);
    };
    let scene = made.scene(path)?;
    let settings = made.settings(path, &scene)?;
    let known = all.iter().find(|l| l.pixel == pixel);
    let sample = args.sample.or(known.map(|l| l.iteration));
    let iterations = sample.map_or(0..0, |n| n..n + 1);
    let (words, whole, ending) = explain(args, &scene, settings, pixel, iterations)?;
    let Some(sample) = sample else {
        print(format!("No iteration added anything to the pixel {},{}.\n", pixel[0], pixel[1]))?;
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
    let is_run = |path: &PathBuf| path.file_name().and_then(|n| n.to_str()).is_some_and(is_image_file);
    entries(folder).into_iter().filter(is_run).collect()
}

/// What to explain instead of a reference.
fn of_a_reference(path: &Path) -> String {
    let folders = entries(path.parent().unwrap_or(Path::new("")));
    let run = folders.iter().filter(|f| f.is_dir()).find_map(|folder| runs_in(folder).into_iter().next());
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
    iterations: String,
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
                         and each run of an experiment has"
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
        let iterations = file.text("tyndall.iterations").unwrap_or("some").to_owned();
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
