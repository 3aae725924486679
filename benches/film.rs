//! What bookkeeping costs: CPU time of iterations into films of no layers (the default), of families and of all, beside the same subpaths
//! whose samples are added up to an image and nothing else.
//!
//!     cargo bench --bench film [-- SCENE PRESET SIZE ROUNDS]
//!
//! Two images stand beside the films. `racy` adds each sample to its pixel in f32 as it comes: no renderer on several threads
//! can. `ordered` is what rendering is: samples of a camera subpath are summed and added to their pixel once, splats are kept
//! and added in an order that does not depend on threads, in f64, so that long renders do not stall. What a film takes longer
//! than `ordered` is bookkeeping: techniques apart, variance, outliers, counts of what is dropped.
//!
//! On one thread, taking turns, each round starting with the next of them, so that what else the machine does falls on all
//! alike; the first round is not counted, as it touches the films' memory for the first time. Output is not part of it.
//! Beside the median of a round's ratios stands the interval that has the true median in it in 19 of 20 cases: on a machine
//! that others use too it takes some 40 rounds to tell 2%.

use glam::UVec2;
use std::path::Path;
use tyndall::film::{BAND_ROWS, Film, Sample, Splat};
use tyndall::scene::Scene;
use tyndall::scene::file::{Overrides, load};
use tyndall::transport::camera_path::{self, Partners};
use tyndall::transport::merge::Gathers;
use tyndall::transport::merge::store::{CHUNK, Stored};
use tyndall::transport::pass::Pass;
use tyndall::transport::sink::{Joint, Sink};
use tyndall::transport::{Layers, Renderer, Settings, Technique, TechniqueSet, light_path};

/// Iterations a round, as a render of this size does them in one go.
const IN_ONE_GO: u64 = 4;

/// Takes samples for an image.
trait Image: Sink {
    /// Samples are of the light subpaths of this chunk from now on.
    fn start_chunk(&mut self, _chunk: usize) {}
    /// Adds what light subpaths brought to the band that starts with this row.
    fn start_band(&mut self, _top: u32) {}
    /// Samples fall on this pixel from now on.
    fn start_pixel(&mut self, pixel: usize);
    /// All samples of the pixel were made.
    fn end_pixel(&mut self) {}
}

/// Adds samples to an image in f32 as they come.
struct Racy {
    width: usize,
    pixel: usize,
    image: Vec<[f32; 3]>,
    samples: u64,
}

impl Sink for Racy {
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

impl Image for Racy {
    fn start_pixel(&mut self, pixel: usize) {
        self.pixel = pixel;
    }
}

/// Adds samples to an image in an order that does not depend on threads.
struct Ordered {
    width: usize,
    pixel: usize,
    sum: [f64; 3],
    image: Vec<[f64; 3]>,
    /// `[chunk][band]`, as several threads fill them.
    splats: Vec<Vec<Vec<Splat>>>,
    chunk: usize,
}

fn add(sum: &mut [f64; 3], sample: &Sample) {
    let value = sample.contribution * sample.weight;
    if value.is_finite() {
        sum.iter_mut().zip(value.to_array()).for_each(|(sum, v)| *sum += f64::from(v));
    }
}

impl Sink for Ordered {
    #[inline]
    fn record(&mut self, sample: &Sample, joint: &Joint) {
        match joint {
            Joint::Lens(_, pixel) => {
                let (x, y) = (pixel.x as usize, pixel.y as usize);
                self.splats[self.chunk][y / BAND_ROWS]
                    .push(Splat::new(y % BAND_ROWS * self.width + x, sample));
            }
            _ => add(&mut self.sum, sample),
        }
    }
}

impl Image for Ordered {
    fn start_chunk(&mut self, chunk: usize) {
        let bands = (self.image.len() / self.width).div_ceil(BAND_ROWS);
        self.splats.resize_with(self.splats.len().max(chunk + 1), || vec![Vec::new(); bands]);
        self.splats[chunk].iter_mut().for_each(Vec::clear);
        self.chunk = chunk;
    }

    fn start_band(&mut self, top: u32) {
        let first = top as usize * self.width;
        let band = top as usize / BAND_ROWS;
        for splat in self.splats.iter().flat_map(|chunk| &chunk[band]) {
            let (pixel, sample) = splat.sample();
            add(&mut self.image[first + pixel], &sample);
        }
    }

    fn start_pixel(&mut self, pixel: usize) {
        self.pixel = pixel;
    }

    fn end_pixel(&mut self) {
        let sum = std::mem::take(&mut self.sum);
        self.image[self.pixel].iter_mut().zip(sum).for_each(|(pixel, v)| *pixel += v);
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
fn plain<S: Image>(scene: &Scene, renderer: &Renderer, index: u64, chunks: &mut Vec<Stored>, sink: &mut S) {
    let size = scene.camera.size();
    let settings = *renderer.settings();
    let pixels = u64::from(size.x) * u64::from(size.y);
    let paths = if settings.needs_light_paths() { pixels } else { 0 };
    let pass = Pass::new(
        settings,
        index,
        Gathers::default(),
        pixels,
        renderer.thinning().clone(),
        scene.lights.by_power().clone(),
    );
    chunks.resize_with(paths.div_ceil(CHUNK) as usize, Stored::default);
    for (number, chunk) in chunks.iter_mut().enumerate() {
        chunk.clear(0);
        sink.start_chunk(number);
        let first = number as u64 * CHUNK;
        for path in first..(first + CHUNK).min(paths) {
            light_path::trace(scene, &pass, path, chunk, sink);
            chunk.end_path();
        }
    }
    let tile = BAND_ROWS as u32;
    for top in (0..size.y).step_by(BAND_ROWS) {
        sink.start_band(top);
        for left in (0..size.x).step_by(BAND_ROWS) {
            for y in top..(top + tile).min(size.y) {
                for x in left..(left + tile).min(size.x) {
                    let partner = u64::from(y) * u64::from(size.x) + u64::from(x);
                    let vertices = match pass.on(Technique::Connect) {
                        true => chunks[(partner / CHUNK) as usize].path((partner % CHUNK) as usize),
                        false => &[],
                    };
                    sink.start_pixel(partner as usize);
                    let partners = Partners { vertices, photons: None };
                    camera_path::trace(scene, &pass, UVec2::new(x, y), partners, sink);
                    sink.end_pixel();
                }
            }
        }
    }
}

fn median(values: &[f64]) -> f64 {
    median_and_interval(values)[0]
}

/// The median, and the order statistics between which the true one lies with 95%: as many of the values as tosses of a coin
/// that show heads lie below it.
fn median_and_interval(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (last, half) = (sorted.len() - 1, 0.98 * (sorted.len() as f64).sqrt());
    let at = |place: f64| sorted[place.clamp(0.0, last as f64) as usize];
    let middle = sorted.len() as f64 / 2.0;
    [sorted[sorted.len() / 2], at((middle - half).floor()), at((middle + half).ceil())]
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
    let kinds = [Layers::None, Layers::Families, Layers::All];
    let mut films: Vec<(Renderer, Film)> = kinds
        .iter()
        .map(|layers| {
            let settings = Settings { layers: *layers, ..Settings::new(techniques) };
            (Renderer::new(&scene, settings).expect("sensible settings"), Film::new(&scene.camera, &settings))
        })
        .collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let mut chunks = Vec::new();
    let merges = techniques.merges();
    let mut times = vec![Vec::new(); kinds.len() + 2];
    let (width, pixels) = (side as usize, (side * side) as usize);
    let mut racy = Racy { width, pixel: 0, image: vec![[0.0; 3]; pixels], samples: 0 };
    let image = vec![[0.0; 3]; pixels];
    let mut ordered = Ordered { width, pixel: 0, sum: [0.0; 3], image, splats: Vec::new(), chunk: 0 };
    for round in 0..=rounds {
        let indices = u64::from(round) * IN_ONE_GO..u64::from(round + 1) * IN_ONE_GO;
        let mut keep = |i: usize, work: &mut (dyn FnMut() + Send)| {
            let start = cpu();
            pool.install(work);
            if round > 0 {
                times[i].push(cpu() - start);
            }
        };
        racy.samples = 0;
        for turn in 0..kinds.len() + 2 {
            match (turn + round as usize) % (kinds.len() + 2) {
                0 | 1 if merges => {}
                0 => keep(0, &mut || {
                    indices.clone().for_each(|i| plain(&scene, &films[0].0, i, &mut chunks, &mut racy));
                }),
                1 => keep(1, &mut || {
                    indices.clone().for_each(|i| plain(&scene, &films[0].0, i, &mut chunks, &mut ordered));
                }),
                kind => keep(kind, &mut || {
                    let (renderer, film) = &mut films[kind - 2];
                    renderer.iterations(indices.clone(), film);
                }),
            }
        }
    }
    let per_pixel = racy.samples as f64 / (pixels as u64 * IN_ONE_GO) as f64;
    println!(
        "{name}, {preset}, {side}x{side}, {per_pixel:.1} samples a pixel and iteration, medians of {rounds}:"
    );
    let base = if merges { 2 } else { 1 };
    for (i, name) in ["racy", "ordered", "none", "families", "all"].into_iter().enumerate() {
        if times[i].is_empty() {
            continue;
        }
        let ratios: Vec<f64> = times[i].iter().zip(&times[base]).map(|(t, b)| t / b).collect();
        let [ratio, low, high] = median_and_interval(&ratios);
        println!("  {name:<10} {:.4} s, times {ratio:.3} [{low:.3}, {high:.3}]", median(&times[i]));
    }
}
