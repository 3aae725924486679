//! What bookkeeping costs: CPU time of iterations into films of no, default and all layers, beside the same subpaths
//! whose samples are added to a plain image.
//!
//!     cargo bench --bench film [-- SCENE PRESET SIZE ROUNDS]
//!
//! On one thread, taking turns, so that what else the machine does falls on all alike; the first round is not counted, as
//! it touches the films' memory for the first time. Output is not part of it.

use glam::UVec2;
use std::path::Path;
use tyndall::film::{BAND_ROWS, Film, Sample};
use tyndall::scene::Scene;
use tyndall::scene::file::{Overrides, load};
use tyndall::transport::camera_path::{self, Partners};
use tyndall::transport::merge::Gathers;
use tyndall::transport::merge::store::{CHUNK, Stored};
use tyndall::transport::pass::Pass;
use tyndall::transport::sink::{Joint, Sink};
use tyndall::transport::{Layers, Renderer, Settings, Technique, TechniqueSet, light_path};

/// Adds samples to an image and keeps nothing else of them, as a renderer must at least.
struct Plain {
    width: usize,
    pixel: usize,
    image: Vec<[f32; 3]>,
    samples: u64,
}

impl Sink for Plain {
    #[inline]
    fn record(&mut self, sample: &Sample, joint: &Joint) {
        let pixel = match joint {
            Joint::Lens(_, pixel) => pixel.y as usize * self.width + pixel.x as usize,
            _ => self.pixel,
        };
        let value = sample.contribution * sample.weight;
        self.image[pixel].iter_mut().zip(value.to_array()).for_each(|(sum, v)| *sum += v);
        self.samples += 1;
    }
}

/// CPU time of all threads of this process, in seconds, as Linux keeps it.
fn cpu() -> f64 {
    let threads = std::fs::read_dir("/proc/self/task").expect("Linux's list of threads");
    let nanoseconds = |thread: std::fs::DirEntry| {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).unwrap_or_default();
        text.split(' ').next().and_then(|n| n.parse::<f64>().ok()).unwrap_or(0.0)
    };
    threads.flatten().map(nanoseconds).sum::<f64>() * 1e-9
}

/// An iteration without a film. Of sets that do not merge.
fn plain(scene: &Scene, renderer: &Renderer, index: u64, chunks: &mut Vec<Stored>, sink: &mut Plain) {
    let size = scene.camera.size();
    let paths = u64::from(size.x) * u64::from(size.y);
    let settings = *renderer.settings();
    let pass = Pass::new(settings, index, Gathers::default(), paths, renderer.thinning().clone());
    chunks.resize_with(paths.div_ceil(CHUNK) as usize, Stored::default);
    for (number, chunk) in chunks.iter_mut().enumerate() {
        chunk.clear(0);
        let first = number as u64 * CHUNK;
        for path in first..(first + CHUNK).min(paths) {
            light_path::trace(scene, &pass, path, chunk, sink);
            chunk.end_path();
        }
    }
    let tile = BAND_ROWS as u32;
    for top in (0..size.y).step_by(BAND_ROWS) {
        for left in (0..size.x).step_by(BAND_ROWS) {
            for y in top..(top + tile).min(size.y) {
                for x in left..(left + tile).min(size.x) {
                    let partner = u64::from(y) * u64::from(size.x) + u64::from(x);
                    let vertices = match pass.on(Technique::Connect) {
                        true => chunks[(partner / CHUNK) as usize].path((partner % CHUNK) as usize),
                        false => &[],
                    };
                    sink.pixel = partner as usize;
                    let partners = Partners { vertices, photons: None };
                    camera_path::trace(scene, &pass, UVec2::new(x, y), partners, sink);
                }
            }
        }
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let arg = |i: usize, default: &'static str| args.get(i).map_or(default, String::as_str).to_owned();
    let (name, preset) = (arg(0, "cornell"), arg(1, "bpt"));
    let number = |text: String| text.parse::<u32>().expect("a number");
    let (side, rounds) = (number(arg(2, "512")), number(arg(3, "9")));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(&name);
    let scene = load(&path, &Overrides { size: Some(UVec2::splat(side)) }).unwrap_or_else(|e| panic!("{e}"));
    let techniques = TechniqueSet::parse([preset.as_str()]).unwrap_or_else(|e| panic!("{e}"));
    let kinds = [("none", Layers::None), ("default", Layers::Families), ("all", Layers::All)];
    let mut films: Vec<(Renderer, Film)> = kinds
        .iter()
        .map(|(_, layers)| {
            let settings = Settings { layers: *layers, ..Settings::new(techniques) };
            (Renderer::new(&scene, settings).expect("sensible settings"), Film::new(&scene.camera, &settings))
        })
        .collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let mut chunks = Vec::new();
    let merges = techniques.merges();
    let mut times = vec![Vec::new(); kinds.len() + 1];
    let pixels = (side * side) as usize;
    let mut sink = Plain { width: side as usize, pixel: 0, image: vec![[0.0; 3]; pixels], samples: 0 };
    for round in 0..=rounds {
        let index = u64::from(round);
        let mut keep = |i: usize, work: &mut (dyn FnMut() + Send)| {
            let start = cpu();
            pool.install(work);
            if round > 0 {
                times[i].push(cpu() - start);
            }
        };
        if !merges {
            sink.samples = 0;
            keep(0, &mut || plain(&scene, &films[0].0, index, &mut chunks, &mut sink));
        }
        for (i, (renderer, film)) in films.iter_mut().enumerate() {
            keep(i + 1, &mut || {
                renderer.iteration(index, film);
            });
        }
    }
    println!("{name}, {preset}, {side}x{side}, {} samples an iteration, medians of {rounds}:", sink.samples);
    let base = if merges { 1 } else { 0 };
    for (i, name) in ["plain", "none", "default", "all"].into_iter().enumerate().skip(base) {
        let ratios: Vec<f64> = times[i].iter().zip(&times[base]).map(|(t, b)| t / b).collect();
        println!("  {name:<10} {:.4} s, times {:.4}", median(&times[i]), median(&ratios));
    }
}
