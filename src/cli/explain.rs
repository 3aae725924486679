//! `tyndall explain`: why a pixel is as it is.

use super::args::ExplainArgs;
use super::progress::while_loading;
use super::render::settings;
use super::render::techniques;
use super::session::{Ending, print, stop_on_interrupt, with_threads};
use crate::error::{Error, Result};
use crate::explain::{Found, Replay, text};
use crate::scene::file::{Overrides, load, resolve};
use glam::UVec2;

/// Iterations that are replayed where neither their number nor one of them is asked for.
const DEFAULT_ITERATIONS: u64 = 16;

/// Replays samples of a pixel and tells of one path all there is.
///
/// # Errors
/// Anything wrong with the scene or the options.
pub fn run(args: &ExplainArgs) -> Result<Ending> {
    let render = &args.render;
    let writes = [render.out.is_some(), render.png, render.time.is_some()];
    if writes.contains(&true) {
        return Err(Error::usage("explain renders no image: --out, --png and --time have no meaning here"));
    }
    let techniques = techniques(render)?;
    let path = resolve(&render.scene)?;
    let scene = while_loading(|| load(&path, &Overrides { size: render.size.map(UVec2::from_array) }))?;
    let settings = settings(render, techniques, &scene)?;
    let iterations = match args.sample {
        Some(sample) => sample..sample + 1,
        None => 0..render.spp.unwrap_or(DEFAULT_ITERATIONS),
    };
    let stop = stop_on_interrupt()?;
    let words = with_threads(render.threads, || {
        let replay = Replay::new(&scene, settings, UVec2::from_array(args.pixel))?;
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
        Ok(text(&scene, &settings, &replay, &found, args.path, args.most))
    })?;
    print(words)?;
    Ok(Ending::from(&stop))
}
