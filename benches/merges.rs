//! Merges: the structures that they find by, whole merges, and weights alone; on one thread.
//!
//! `cargo bench --bench merges`. An element is a point, disc or beam in builds, a query in queries, and a merge in
//! merges and weights.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{UVec2, Vec3, Vec3A};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::hint::black_box;
use std::path::Path;
use tyndall::film::Sample;
use tyndall::geometry::Ray;
use tyndall::math::{Stream, StreamKind, warp};
use tyndall::scene::Scene;
use tyndall::scene::file::{Overrides, load};
use tyndall::transport::expression::Label;
use tyndall::transport::merge::boxes::{Boxes, widened};
use tyndall::transport::merge::grid::{Entry, Points};
use tyndall::transport::merge::join::{nearest, sample, scatter_in};
use tyndall::transport::merge::{Arm, GatherNow, Gathers, Photons, Stored};
use tyndall::transport::pass::Pass;
use tyndall::transport::sink::{Joint, Sink};
use tyndall::transport::thinning::Thinning;
use tyndall::transport::walk::{Place, Vertex};
use tyndall::transport::{Settings, Technique, TechniqueSet, camera_path, light_path};

const POINTS: u32 = 100_000;
const QUERIES: usize = 4096;

fn random() -> impl FnMut() -> Vec3A {
    let mut s = Stream::new(1, 0, StreamKind::Other, 0);
    move || {
        let (a, b) = (s.next_2d(), s.next_1d());
        Vec3A::new(a.x, a.y, b)
    }
}

/// Points in a unit cube, and queries on a walk through it, as those of neighbouring pixels are.
fn points(c: &mut Criterion) {
    let mut random = random();
    // 8 points a query.
    let radius = (8.0 / POINTS as f32 * 3.0 / (4.0 * std::f32::consts::PI)).cbrt();
    let entries: Vec<Entry> = (0..POINTS).map(|id| Entry { p: random().into(), id }).collect();
    let positions: Vec<[f32; 3]> = entries.iter().map(|e| e.p.to_array()).collect();
    let scattered: Vec<Vec3A> = (0..QUERIES).map(|_| random()).collect();
    let near: Vec<Vec3A> = (0..QUERIES).map(|i| scattered[i / 64] + 0.02 * random()).collect();
    let mut group = c.benchmark_group("points");
    group.sample_size(10).throughput(Throughput::Elements(POINTS.into()));
    group.bench_function("build, grid", |b| b.iter(|| black_box(Points::build(&entries, radius))));
    group.bench_function("build, kd-tree", |b| {
        b.iter(|| black_box(ImmutableKdTree::<f32, 3>::new_from_slice(&positions).expect("a tree")));
    });
    let grid = Points::build(&entries, radius);
    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&positions).expect("a tree");
    group.throughput(Throughput::Elements(QUERIES as u64));
    for (name, queries) in [("scattered", &scattered), ("neighbours", &near)] {
        group.bench_function(format!("query, grid, {name}"), |b| {
            b.iter(|| {
                let mut sum = 0.0;
                queries.iter().for_each(|q| grid.within(*q, |_, d2| sum += d2));
                black_box(sum)
            });
        });
        group.bench_function(format!("query, kd-tree, {name}"), |b| {
            b.iter(|| {
                let mut sum = 0.0;
                for q in queries {
                    let q = q.to_array();
                    let query = tree.query(&q).within::<SquaredEuclidean<f32>>(radius * radius);
                    query.unsorted().visit(|hit| sum += hit.distance);
                }
                black_box(sum)
            });
        });
    }
    group.finish();
}

/// Discs and beams across rays through a unit cube.
fn boxes(c: &mut Criterion) {
    let mut random = random();
    let radius = 0.005;
    let rays: Vec<Ray> = (0..QUERIES)
        .map(|i| Ray { t_max: 1.0, ..Ray::new(random() * Vec3A::new(1.0, 1.0, 0.1), jitter(i)) })
        .collect();
    let centres: Vec<Entry> = (0..POINTS).map(|id| Entry { p: random().into(), id }).collect();
    let balls: Vec<_> = centres.iter().map(|e| widened(e.p.into(), e.p.into(), radius)).collect();
    let mut group = c.benchmark_group("boxes");
    group.sample_size(10).throughput(Throughput::Elements(POINTS.into()));
    group.bench_function("build, discs", |b| b.iter(|| black_box(Boxes::build(&balls, &centres))));
    let tree = Boxes::build(&balls, &centres);
    group.throughput(Throughput::Elements(QUERIES as u64));
    group.bench_function("query, discs", |b| {
        b.iter(|| {
            let mut hits = 0;
            for ray in &rays {
                tree.along(ray.origin, ray.dir, ray.t_max, |e| {
                    hits += u32::from(nearest(ray, e.p.into()).1 <= radius * radius);
                });
            }
            black_box(hits)
        });
    });
    let segments: Vec<[Vec3; 2]> = (0..20_000)
        .map(|_| {
            let from = random();
            [from.into(), (from + 0.05 * (random() - 0.5)).into()]
        })
        .collect();
    let pieces: Vec<_> = segments.iter().map(|[a, b]| widened((*a).into(), (*b).into(), radius)).collect();
    group.throughput(Throughput::Elements(segments.len() as u64));
    group
        .bench_function("build, pieces of beams", |b| b.iter(|| black_box(Boxes::build(&pieces, &segments))));
    let tree = Boxes::build(&pieces, &segments);
    group.throughput(Throughput::Elements(QUERIES as u64));
    group.bench_function("query, pieces of beams", |b| {
        b.iter(|| {
            let mut candidates = 0;
            rays.iter().for_each(|ray| tree.along(ray.origin, ray.dir, ray.t_max, |_| candidates += 1));
            black_box(candidates)
        });
    });
    group.finish();
}

fn jitter(i: usize) -> Vec3A {
    let mut s = Stream::new(2, 0, StreamKind::Other, i as u64);
    (Vec3A::Z + 0.2 * warp::uniform_sphere(s.next_2d())).normalize()
}

#[derive(Default)]
struct Counter(u64);

impl Sink for Counter {
    fn record(&mut self, sample: &Sample, _joint: &Joint) {
        self.0 += u64::from(sample.weight > 0.0);
    }
}

fn scene(file: &str, size: u32) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    load(&path, &Overrides { size: Some(UVec2::splat(size)) }).expect("a scene of ours")
}

/// Camera subpaths that merge by one technique, their walks included: time a merge that was accepted.
fn merges(c: &mut Criterion) {
    let (size, paths) = (48, 4096);
    let scene = scene("scenes/fog-cornell", size);
    let mut group = c.benchmark_group("merge");
    group.sample_size(10);
    for (technique, radius) in [
        (Technique::Surface, 0.1),
        (Technique::PointPoint, 0.2),
        (Technique::PointBeam, 0.06),
        (Technique::BeamPoint, 0.06),
        (Technique::BeamBeam, 0.002),
    ] {
        let settings = Settings { max_length: 24, ..Settings::new(TechniqueSet::of(&[technique])) };
        let pass = pass(&scene, settings, GatherNow { radius, paths }, 0);
        let (mut stored, mut chunks) = (Stored::default(), Vec::new());
        for path in 0..paths {
            light_path::trace(&scene, &pass, path, &mut stored, &mut Counter::default());
            stored.end_path();
            if (path + 1) % 1024 == 0 {
                chunks.push(std::mem::take(&mut stored));
            }
        }
        let photons = Photons::build(&scene, &pass, &chunks);
        let all = || {
            let mut counter = Counter::default();
            for i in 0..size * size {
                let partners = camera_path::Partners { vertices: &[], photons: Some(&photons) };
                camera_path::trace(&scene, &pass, UVec2::new(i % size, i / size), partners, &mut counter);
            }
            counter.0
        };
        group.throughput(Throughput::Elements(all()));
        group.bench_function(technique.info().key, |b| b.iter(|| black_box(all())));
    }
    group.finish();
}

/// Keeps the vertices in a medium of some lengths.
struct Keeper {
    lengths: [u32; 5],
    arms: [Vec<Arm>; 5],
}

impl Sink for Keeper {
    fn record(&mut self, _: &Sample, _: &Joint) {}
    fn vertex(&mut self, vertex: &Vertex) {
        if let (Some(i), Place::Medium(_)) =
            (self.lengths.iter().position(|l| *l == vertex.length), &vertex.place)
        {
            self.arms[i].push(Arm::from(vertex));
        }
    }
}

/// The constants of an iteration in which all techniques gather alike.
fn pass(scene: &Scene, settings: Settings, gather: GatherNow, partners: u64) -> Pass {
    let starts = scene.lights.by_power().clone();
    Pass::new(settings, 0, Gathers { of: [gather; 5] }, partners, Thinning::default(), starts)
}

/// Weight and contribution of pairs of subpaths, for paths of 5 to 80 segments.
fn weights(c: &mut Criterion) {
    let scene = scene("tests/scenes/furnace_fog.toml", 32);
    let settings = Settings { max_length: 100, ..Settings::new(TechniqueSet::all()) };
    let pass = pass(&scene, settings, GatherNow { radius: 0.1, paths: 1000 }, 1024);
    let keeper = |lengths| Keeper { lengths, arms: Default::default() };
    let (mut light, mut camera) = (keeper([2, 5, 10, 20, 40]), keeper([3, 5, 10, 20, 40]));
    for i in 0..4096 {
        light_path::trace(&scene, &pass, i, &mut Stored::default(), &mut light);
        let pixel = UVec2::new(i as u32 % 32, i as u32 / 32 % 32);
        camera_path::trace(&scene, &pass, pixel, camera_path::Partners::NONE, &mut camera);
    }
    let (medium, at) = (&scene.media[0], scene.media[0].coefficients(Vec3A::ZERO));
    let mut group = c.benchmark_group("weight");
    group.sample_size(20).throughput(Throughput::Elements(QUERIES as u64));
    for (i, (lights, cameras)) in light.arms.iter().zip(&camera.arms).enumerate() {
        let length = light.lengths[i] + camera.lengths[i];
        assert!(!lights.is_empty() && !cameras.is_empty(), "no subpath is that long");
        group.bench_with_input(BenchmarkId::from_parameter(length), &length, |b, _| {
            b.iter(|| {
                let mut sum = 0.0;
                for k in 0..QUERIES {
                    let arms = (&lights[k % lights.len()], &cameras[k % cameras.len()]);
                    let scattering =
                        scatter_in(&pass, (0, medium), Vec3A::ZERO, &at, arms.0.back, arms.1.back);
                    let sample = sample(&pass, Technique::BeamBeam, Label::Medium, arms, &scattering, 1.0);
                    sum += sample.map_or(0.0, |s| s.weight);
                }
                black_box(sum)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, points, boxes, merges, weights);
criterion_main!(benches);
