//! Grids: cells that rays cross, and depths along beams; on one thread.
//!
//! `cargo bench --bench media`. An element is a cell that is crossed in `grid`, a ray in `tracking`, a beam in `beam, depths kept`, and a
//! candidate of a merge in the other groups of beams. What a grid takes in memory is printed first.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{UVec3, Vec3, Vec3A};
use std::hint::black_box;
use tyndall::math::{Rgb, Stream, StreamKind, warp};
use tyndall::medium::grid::{Interpolation, Lattice, Placed, Texel};
use tyndall::medium::procedural::{Noise, puff};
use tyndall::medium::varying::{Density, Emission, Extinction, Scattering};
use tyndall::medium::{Medium, Phase, Varying, volume};

const RAYS: usize = 1024;

/// A ray from face to face of the box -1…1.
type Ray = (Vec3A, Vec3A);

/// The numbers of a grid of `n` a side between -1 and 1: noise everywhere, or a puff that leaves half of it empty.
fn numbers(n: usize, filled: bool) -> Vec<f32> {
    let noise = Noise::new(3, 4);
    let puff = puff(Vec3A::ZERO, 0.95, 0.7, Noise::new(11, 4));
    (0..n * n * n)
        .map(|i| {
            let index = Vec3A::new((i % n) as f32, (i / n % n) as f32, (i / n / n) as f32);
            let p = (index + 0.5) * (2.0 / n as f32) - 1.0;
            if filled { 0.1 + noise.at(p * 4.0).abs() } else { puff(p) }
        })
        .collect()
}

fn grid<T: Texel>(n: usize, filled: bool, interpolation: Interpolation) -> Placed<T> {
    let numbers = numbers(n, filled);
    let numbers: Vec<f32> = numbers.into_iter().flat_map(|x| std::iter::repeat_n(x, T::CHANNELS)).collect();
    let lattice = Lattice::<T>::new(UVec3::splat(n as u32), &numbers, interpolation).expect("a grid");
    let bytes = lattice.bytes();
    println!(
        "{n}³ of {} numbers, {interpolation:?}: {bytes} bytes, {:.4} of its floats",
        T::CHANNELS,
        bytes as f64 / (4 * numbers.len()) as f64
    );
    Placed::new(lattice, volume::cube(Vec3A::NEG_ONE, Vec3A::ONE)).expect("a place")
}

/// Rays from anywhere to anywhere through the box, or near each other, as those of neighbouring pixels are.
fn rays(scattered: bool) -> Vec<Ray> {
    let mut s = Stream::new(1, 0, StreamKind::Other, 0);
    (0..RAYS)
        .map(|i| {
            let dir = match scattered {
                true => warp::uniform_sphere(s.next_2d()),
                false => Vec3A::new(0.003 * (i % 32) as f32 - 0.05, 0.003 * (i / 32) as f32 - 0.05, 1.0)
                    .normalize(),
            };
            let through =
                Vec3A::new(s.next_1d(), s.next_1d(), s.next_1d()) * if scattered { 1.6 } else { 0.02 };
            (through - if scattered { 0.8 } else { 0.01 } - dir * 3.0, dir)
        })
        .collect()
}

fn cells<T: Texel>(grid: &Placed<T>, rays: &[Ray]) -> u64 {
    let mut count = 0;
    for (origin, dir) in rays {
        grid.pieces(*origin, *dir, 0.0, f32::INFINITY, |_, _| count += 1);
    }
    count
}

fn crossings<T: Texel>(c: &mut Criterion, name: &str, grid: &Placed<T>, inverts: bool) {
    let mut group = c.benchmark_group("grid");
    group.sample_size(20);
    for scattered in [false, true] {
        let rays = rays(scattered);
        let crossed = cells(grid, &rays);
        let what = if scattered { "scattered" } else { "neighbours" };
        println!("{name}, {what}: {} cells a ray", crossed / RAYS as u64);
        group.throughput(Throughput::Elements(crossed));
        group.bench_function(format!("{name}, {what}, depth"), |b| {
            b.iter(|| {
                for (origin, dir) in &rays {
                    black_box(grid.integral(*origin, *dir, 0.0, f32::INFINITY));
                }
            });
        });
        if inverts {
            // All of the way to the end, and the solve in the last cell: as many cells as a depth.
            let targets: Vec<f64> = rays
                .iter()
                .map(|(origin, dir)| {
                    let whole = T::rounded(grid.integral(*origin, *dir, 0.0, f32::INFINITY)).x;
                    0.9999 * f64::from(whole)
                })
                .collect();
            group.bench_function(format!("{name}, {what}, free flight"), |b| {
                b.iter(|| {
                    for ((origin, dir), target) in rays.iter().zip(&targets) {
                        let _ = black_box(grid.invert(*origin, *dir, 0.0, f32::INFINITY, 0, *target));
                    }
                });
            });
        }
    }
    group.finish();
}

fn grids(c: &mut Criterion) {
    crossings(c, "256³ trilinear", &grid::<f32>(256, true, Interpolation::Trilinear), true);
    crossings(c, "256³ trilinear, half empty", &grid::<f32>(256, false, Interpolation::Trilinear), false);
    crossings(c, "256³ constant", &grid::<f32>(256, true, Interpolation::Constant), false);
    crossings(c, "128³ trilinear colours", &grid::<Vec3>(128, true, Interpolation::Trilinear), false);
    crossings(c, "32³ trilinear", &grid::<f32>(32, true, Interpolation::Trilinear), false);
}

/// Rays through a grid that is thin, and one that is dense, by points and by all cells.
fn tracking(c: &mut Criterion) {
    let mut group = c.benchmark_group("tracking");
    group.sample_size(20).throughput(Throughput::Elements(RAYS as u64));
    let rays = rays(true);
    for (name, filled) in [("256³ trilinear", true), ("256³ trilinear, half empty", false)] {
        let grid = grid::<f32>(256, filled, Interpolation::Trilinear);
        group.bench_function(format!("{name}, exact depth"), |b| {
            b.iter(|| {
                for (origin, dir) in &rays {
                    black_box(grid.integral(*origin, *dir, 0.0, f32::INFINITY));
                }
            });
        });
        for sigma in [1.0, 4.0, 16.0] {
            let mut s = Stream::new(3, 0, StreamKind::Other, 0);
            group.bench_function(format!("{name}, σ_t {sigma}, flight"), |b| {
                b.iter(|| {
                    for (origin, dir) in &rays {
                        black_box(grid.track(*origin, *dir, (0.0, f32::INFINITY), sigma, &mut s));
                    }
                });
            });
            group.bench_function(format!("{name}, σ_t {sigma}, shadow ray"), |b| {
                b.iter(|| {
                    for (origin, dir) in &rays {
                        black_box(grid.ratio(*origin, *dir, (0.0, f32::INFINITY), sigma, &mut s));
                    }
                });
            });
        }
    }
    group.finish();
}

/// What a candidate of a merge costs on beams of different lengths: by the depths that are kept, and without them; and
/// what it takes to keep them.
fn beams(c: &mut Criterion) {
    let density = Density::Grid(Box::new(grid::<f32>(256, true, Interpolation::Trilinear)));
    let extinction = Extinction::Scaled(density, Rgb::ONE);
    let scattering = Scattering::Albedo(Rgb::splat(0.9));
    let medium = Varying::new(extinction, scattering, Emission::None, Phase::Isotropic).expect("a medium");
    let medium = Medium::Varying(Box::new(medium));
    let mut s = Stream::new(2, 0, StreamKind::Other, 0);
    for voxels in [8, 32, 128, 256] {
        let length = voxels as f32 * 2.0 / 256.0;
        let beams: Vec<(Vec3A, Vec3A, f32)> = (0..RAYS)
            .map(|_| {
                // Straight through the middle part, so that all of a beam is in the grid.
                let dir = (Vec3A::Z + 0.1 * warp::uniform_sphere(s.next_2d())).normalize();
                let u = s.next_2d();
                (Vec3A::new(u.x - 0.5, u.y - 0.5, -0.999), dir, length)
            })
            .collect();
        let kept: Vec<Vec<f32>> = beams
            .iter()
            .map(|(origin, dir, length)| {
                let mut depths = Vec::new();
                medium.depths_along(*origin, *dir, *length, &mut depths);
                depths
            })
            .collect();
        let at: Vec<f32> = (0..RAYS).map(|_| length * s.next_1d()).collect();
        let mut group = c.benchmark_group("beam");
        group.sample_size(20).throughput(Throughput::Elements(RAYS as u64));
        group.bench_function(BenchmarkId::new("candidate, depths kept", voxels), |b| {
            b.iter(|| {
                for ((beam, depths), t) in beams.iter().zip(&kept).zip(&at) {
                    black_box(medium.depth_along(depths, *beam, *t));
                }
            });
        });
        group.bench_function(BenchmarkId::new("candidate, integrated", voxels), |b| {
            b.iter(|| {
                for ((origin, dir, _), t) in beams.iter().zip(&at) {
                    black_box(medium.optical_depth(*origin, *dir, 0.0, *t));
                }
            });
        });
        group.bench_function(BenchmarkId::new("depths of a beam", voxels), |b| {
            let mut depths = Vec::new();
            b.iter(|| {
                for (origin, dir, length) in &beams {
                    depths.clear();
                    medium.depths_along(*origin, *dir, *length, &mut depths);
                    black_box(&depths);
                }
            });
        });
        group.finish();
    }
}

criterion_group!(benches, grids, tracking, beams);
criterion_main!(benches);
