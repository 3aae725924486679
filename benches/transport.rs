//! Walks, connections and whole iterations, on one thread.
//!
//! `cargo bench --bench transport`. An element is a subpath for walks and connections, a pixel for iterations.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::UVec2;
use std::hint::black_box;
use std::path::Path;
use tyndall::film::{Film, Sample};
use tyndall::scene::Scene;
use tyndall::scene::file::{Overrides, load};
use tyndall::transport::merge::Gathers;
use tyndall::transport::merge::store::Stored;
use tyndall::transport::pass::Pass;
use tyndall::transport::sink::{Joint, Sink};
use tyndall::transport::thinning::Thinning;
use tyndall::transport::{Renderer, Settings, Technique, TechniqueSet, camera_path, light_path};

const SIZE: u32 = 64;

/// Counts samples and forgets them.
#[derive(Default)]
struct Counter {
    samples: u64,
}

impl Sink for Counter {
    fn record(&mut self, sample: &Sample, _joint: &Joint) {
        self.samples += u64::from(sample.weight > 0.0);
    }
}

fn scene(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let overrides = Overrides { size: Some(UVec2::splat(SIZE)) };
    load(&path, &overrides).expect("a scene of ours")
}

fn settings(techniques: TechniqueSet) -> Settings {
    Settings { max_length: 10, ..Settings::new(techniques) }
}

/// Camera subpaths of all pixels, each with its partner if there are any; how many samples they made.
fn camera_paths(scene: &Scene, settings: &Settings, partners: &Partners) -> u64 {
    let mut sink = Counter::default();
    let pass = pass(scene, settings);
    for i in 0..SIZE * SIZE {
        let pixel = UVec2::new(i % SIZE, i / SIZE);
        let partners = camera_path::Partners { vertices: partners.of(i as usize), photons: None };
        camera_path::trace(scene, &pass, pixel, partners, &mut sink);
    }
    sink.samples
}

/// The constants of an iteration without merges.
fn pass(scene: &Scene, settings: &Settings) -> Pass {
    let starts = scene.lights.by_power().clone();
    Pass::new(*settings, 0, Gathers::default(), u64::from(SIZE * SIZE), Thinning::default(), starts)
}

/// Stored light vertices, by subpath.
#[derive(Default)]
struct Partners(Stored);

impl Partners {
    fn trace(&mut self, scene: &Scene, settings: &Settings) -> usize {
        let pass = pass(scene, settings);
        self.0.clear(0);
        for i in 0..u64::from(SIZE * SIZE) {
            light_path::trace(scene, &pass, i, &mut self.0, &mut Counter::default());
            self.0.end_path();
        }
        self.0.vertices.len()
    }

    fn of(&self, path: usize) -> &[tyndall::transport::walk::Vertex] {
        if self.0.vertices.is_empty() { &[] } else { self.0.path(path) }
    }
}

fn subpaths(c: &mut Criterion) {
    let scene = scene("cornell");
    let only = |technique| settings(TechniqueSet::of(&[technique]));
    let connect = only(Technique::Connect);
    let mut group = c.benchmark_group("subpath");
    group.throughput(Throughput::Elements(u64::from(SIZE * SIZE)));
    let mut partners = Partners::default();
    group.bench_function("light walk, stored", |b| {
        b.iter(|| black_box(partners.trace(&scene, &connect)));
    });
    let nobody = Partners::default();
    for (name, technique) in
        [("camera walk, light hits", Technique::Hit), ("camera walk, next event", Technique::NextEvent)]
    {
        let settings = only(technique);
        group.bench_function(name, |b| b.iter(|| black_box(camera_paths(&scene, &settings, &nobody))));
    }
    group.bench_function("camera walk, inner connections", |b| {
        b.iter(|| black_box(camera_paths(&scene, &connect, &partners)));
    });
    group.finish();
}

fn iterations(c: &mut Criterion) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let mut group = c.benchmark_group("iteration");
    group.sample_size(20).throughput(Throughput::Elements(u64::from(SIZE * SIZE)));
    for name in ["cornell", "veach-room"] {
        let scene = scene(name);
        for preset in ["pt", "lt", "bpt"] {
            let settings = settings(TechniqueSet::parse([preset]).expect("a preset"));
            let mut film = Film::new(&scene.camera, &settings);
            let mut renderer = Renderer::new(&scene, settings).expect("sensible settings");
            let mut index = 0;
            group.bench_function(format!("{name}, {preset}"), |b| {
                b.iter(|| {
                    index += 1;
                    pool.install(|| black_box(renderer.iteration(index, &mut film)))
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, subpaths, iterations);
criterion_main!(benches);
