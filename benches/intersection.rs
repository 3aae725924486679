//! Rays a second, on one thread: closest hit and any hit, coherent (a camera's, row by row) and random (chords of the
//! bounding sphere), on meshes of 10 thousand and 500 thousand triangles and on a box with two balls.
//!
//!     cargo bench --bench intersection

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Affine3A, Vec3, Vec3A};
use std::hint::black_box;
use tyndall::geometry::{Geometry, Ray, ShapeDesc, TriangleMesh};
use tyndall::math::{Stream, StreamKind, warp};

const RAYS: usize = 1 << 14;

/// A unit sphere with bumps, of about `triangles`.
fn bumpy_sphere(triangles: u32) -> ShapeDesc {
    let rings = f64::from(triangles / 4).sqrt().round() as u32;
    let around = 2 * rings;
    let mut positions = Vec::new();
    for i in 0..=rings {
        for j in 0..around {
            let theta = std::f32::consts::PI * i as f32 / rings as f32;
            let phi = std::f32::consts::TAU * j as f32 / around as f32;
            let r = 1.0 + 0.05 * (20.0 * theta).sin() * (20.0 * phi).sin() * theta.sin();
            positions.push(r * Vec3::new(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin()));
        }
    }
    let at = |i: u32, j: u32| i * around + j % around;
    let quads = (0..rings).flat_map(|i| (0..around).map(move |j| (i, j)));
    let indices = quads
        .flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]]
        })
        .collect();
    ShapeDesc::Mesh(TriangleMesh::new(positions, None, None, indices).expect("a mesh"))
}

/// An open box with a box and two balls in it, and a lamp: 26 primitives.
fn cornell() -> Vec<ShapeDesc> {
    let wall = |corner: [f32; 3], u: [f32; 3], v: [f32; 3]| {
        let [corner, u, v] = [corner, u, v].map(Vec3::from_array);
        ShapeDesc::Mesh(TriangleMesh::parallelogram(corner, u, v).expect("a wall"))
    };
    let block = Affine3A::from_translation(Vec3::new(0.3, -0.7, -0.2))
        * Affine3A::from_rotation_y(0.3)
        * Affine3A::from_scale(Vec3::new(0.25, 0.3, 0.25));
    vec![
        wall([-1.0, -1.0, -1.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0]),
        wall([-1.0, 1.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]),
        wall([-1.0, -1.0, -1.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]),
        wall([-1.0, -1.0, -1.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]),
        wall([1.0, -1.0, -1.0], [0.0, 0.0, 2.0], [0.0, 2.0, 0.0]),
        wall([-0.3, 0.999, -0.3], [0.6, 0.0, 0.0], [0.0, 0.0, 0.6]),
        ShapeDesc::Mesh(TriangleMesh::cube().transformed(&block).expect("a block")),
        ShapeDesc::Sphere { centre: Vec3A::new(-0.4, -0.6, -0.3), radius: 0.4 },
        ShapeDesc::Sphere { centre: Vec3A::new(0.4, -0.2, 0.3), radius: 0.3 },
    ]
}

fn camera_rays() -> Vec<Ray> {
    let side = (RAYS as f64).sqrt() as usize;
    let pixel = |i: usize| (i as f32 + 0.5) / side as f32 * 2.0 - 1.0;
    let ray = |i: usize| {
        let dir = Vec3A::new(0.4 * pixel(i % side), -0.4 * pixel(i / side), -1.0);
        Ray::new(Vec3A::Z * 3.0, dir.normalize())
    };
    (0..side * side).map(ray).collect()
}

fn random_rays() -> Vec<Ray> {
    let mut s = Stream::new(1, 0, StreamKind::Other, 0);
    let ray = |_| {
        let from = warp::uniform_sphere(s.next_2d()) * 1.05;
        let to = warp::uniform_sphere(s.next_2d()) * 1.05;
        Ray::new(from, (to - from).normalize())
    };
    (0..RAYS).map(ray).collect()
}

/// Diffuse bounces off what random rays hit, and shadow rays of 0.7 length from there.
fn bounces(geometry: &Geometry) -> Vec<Ray> {
    let mut s = Stream::new(2, 0, StreamKind::Other, 0);
    let from = random_rays();
    let hits = from.iter().filter_map(|ray| Some((ray.dir, geometry.intersect(ray)?.point)));
    hits.map(|(dir, point)| {
        let n = if point.ng.dot(dir) < 0.0 { point.ng } else { -point.ng };
        let out = (n + warp::uniform_sphere(s.next_2d())).normalize_or(n);
        point.spawn(out)
    })
    .collect()
}

fn queries(c: &mut Criterion, name: &str, geometry: &Geometry) {
    println!(
        "{name}: {} primitives, {} bytes each in the tree",
        geometry.primitive_count(),
        geometry.acceleration_bytes() / geometry.primitive_count()
    );
    let mut group = c.benchmark_group(name);
    group.sample_size(20).measurement_time(std::time::Duration::from_secs(2));
    group.warm_up_time(std::time::Duration::from_millis(500));
    for (kind, rays) in
        [("coherent", camera_rays()), ("random", random_rays()), ("bounce", bounces(geometry))]
    {
        group.throughput(Throughput::Elements(rays.len() as u64));
        group.bench_function(format!("closest/{kind}"), |b| {
            b.iter(|| rays.iter().filter(|r| geometry.intersect(black_box(r)).is_some()).count());
        });
        let segments: Vec<Ray> = rays.iter().map(|r| Ray { t_max: 0.7, ..*r }).collect();
        group.bench_function(format!("any/{kind}"), |b| {
            b.iter(|| segments.iter().filter(|r| geometry.occluded(black_box(r))).count());
        });
    }
    group.finish();
}

fn intersection(c: &mut Criterion) {
    queries(c, "cornell", &Geometry::build(cornell()));
    for (name, triangles) in [("10k", 10_000), ("500k", 500_000)] {
        let mesh = bumpy_sphere(triangles);
        queries(c, name, &Geometry::build(vec![mesh.clone()]));
        let mut group = c.benchmark_group("build");
        group.sample_size(10);
        group.bench_function(name, |b| {
            b.iter_batched(|| vec![mesh.clone()], Geometry::build, BatchSize::LargeInput);
        });
        group.finish();
    }
}

criterion_group!(benches, intersection);
criterion_main!(benches);
