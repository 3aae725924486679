//! Whole queries, against brute force and on closed meshes.

use super::super::*;
use super::{bumpy_sphere, direction, placed, point, stream};
use glam::{DVec3, Vec2, Vec3};

/// Random small triangles, spheres, discs and boxes within a cube of half-size `scale` about `centre`, some degenerate.
fn soup(count: usize, scale: f32, centre: Vec3A, seed: u64) -> Vec<ShapeDesc> {
    let mut s = stream(seed);
    let (mut positions, mut indices) = (Vec::new(), Vec::new());
    for i in 0..count as u32 {
        let base = point(&mut s);
        // Every fifth is a sliver, every seventh has no area.
        let thin = if i % 5 == 0 { 1e-3 } else { 0.2 };
        let e = point(&mut s) * 0.2;
        let f = if i % 7 == 0 { e * 0.5 } else { e * 0.5 + point(&mut s) * thin };
        positions.extend([base, base + e, base + f].map(|p| Vec3::from(centre + p * scale)));
        indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let mut shapes = vec![ShapeDesc::Mesh(TriangleMesh::new(positions, None, None, indices).unwrap())];
    for _ in 0..count / 8 {
        let radius = scale * 0.1 * s.next_1d() + 1e-4 * scale;
        shapes.push(ShapeDesc::Sphere { centre: centre + point(&mut s) * scale, radius });
        let normal = direction(&mut s);
        shapes.push(ShapeDesc::Disc { centre: centre + point(&mut s) * scale, normal, radius });
    }
    for _ in 0..count / 16 {
        let middle = centre + point(&mut s) * scale;
        let place = placed(&mut s, 0.1 * scale, middle);
        shapes.push(ShapeDesc::Mesh(TriangleMesh::cube().transformed(&place).unwrap()));
    }
    shapes
}

/// Where areas are beyond what f32 holds, no leaf takes more than it has room for, and nothing is lost.
#[test]
fn trees_of_immense_scenes_hold_all_primitives() {
    for scale in [1e18, 1e19, 3e19, 1e25, 1e37] {
        let shapes = soup(200, scale, Vec3A::ZERO, 3);
        let count: usize = shapes.iter().map(ShapeDesc::primitives).sum();
        let walls = Geometry::build(shapes).walls;
        let triangles = walls.blocks.iter().flat_map(|b| b.prim).filter(|p| *p != u32::MAX).count();
        let triangles = triangles + walls.parallelograms.iter().flat_map(|b| b.primitives()).count();
        assert_eq!(triangles + walls.spheres.len() + walls.discs.len(), count, "at {scale:e}");
    }
}

/// Rays of all kinds: random, along axes with zeros of either sign, from a shape's surface, from far away, of bounded
/// length.
fn rays(count: usize, scale: f32, centre: Vec3A, seed: u64) -> Vec<Ray> {
    let mut s = stream(seed);
    (0..count)
        .map(|i| {
            let origin = point(&mut s) * 1.5;
            let mut dir = direction(&mut s);
            let sign = if i % 2 == 0 { 0.0 } else { -0.0 };
            match i % 6 {
                1 => dir = (dir * Vec3A::new(sign, 1.0, 1.0)).normalize(),
                2 => dir = Vec3A::new(sign, -sign, 1f32.copysign(dir.z)),
                3 => dir = Vec3A::new(1f32.copysign(dir.x), -0.0, sign),
                _ => {}
            }
            let origin = if i % 6 == 4 { dir * -30.0 + point(&mut s) } else { origin };
            let t_max = if i % 6 == 5 { s.next_1d() * scale } else { f32::INFINITY };
            Ray { t_max, ..Ray::new(centre + origin * scale, dir) }
        })
        .collect()
}

/// All primitives one by one, in f64 and by other formulas than the renderer's: distance, and how far inside the
/// primitive's rim the hit lies (relative; below zero outside).
fn brute_force(shapes: &[ShapeDesc], ray: &Ray) -> Vec<(f64, f64)> {
    let (o, d) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    let mut hits = Vec::new();
    for shape in shapes {
        match shape {
            ShapeDesc::Sphere { centre, radius } => {
                let (c, r) = (o - centre.as_dvec3(), f64::from(*radius));
                let (b, c) = (2.0 * c.dot(d), c.length_squared() - r * r);
                let disc = b * b - 4.0 * d.length_squared() * c;
                let inside = disc / (4.0 * r * r);
                for sign in [-1.0, 1.0] {
                    let t = (-b + sign * disc.max(0.0).sqrt()) / (2.0 * d.length_squared());
                    hits.push((t, inside));
                }
            }
            ShapeDesc::Disc { centre, normal, radius } => {
                let n = normal.as_dvec3();
                let t = (centre.as_dvec3() - o).dot(n) / d.dot(n);
                let r = (o + d * t).distance(centre.as_dvec3()) / f64::from(*radius);
                hits.push((t, 1.0 - r));
            }
            ShapeDesc::Mesh(mesh) => {
                for t in mesh.indices() {
                    let [a, b, c] = t.map(|i| mesh.positions()[i as usize].as_dvec3());
                    let n = (b - a).cross(c - a);
                    let t = (a - o).dot(n) / d.dot(n);
                    let p = o + d * t;
                    let side = |a: DVec3, b: DVec3| (b - a).cross(p - a).dot(n) / n.length_squared();
                    hits.push((t, side(a, b).min(side(b, c)).min(side(c, a))));
                }
            }
        }
    }
    hits.retain(|(t, inside)| t.is_finite() && inside.is_finite());
    hits
}

#[test]
fn queries_agree_with_brute_force_in_f64() {
    let scenes =
        [(1.0, Vec3A::ZERO), (1e-3, Vec3A::ZERO), (1e3, Vec3A::ZERO), (1.0, Vec3A::new(50.0, -20.0, 10.0))];
    for (seed, (scale, centre)) in scenes.into_iter().enumerate() {
        let shapes = soup(700, scale, centre, seed as u64);
        let geometry = Geometry::build(shapes.clone());
        // Rounding moves corners by some ulps of their distance to the ray's origin and of their own coordinates.
        let ulps = 1e-6 * f64::from(40.0 * scale + centre.length());
        let (mut hits, mut undecided) = (0, 0);
        for ray in rays(3000, scale, centre, 100 + seed as u64) {
            let all = brute_force(&shapes, &ray);
            // Hits well inside a rim must be found; hits well outside must not be.
            let limit = f64::from(ray.t_max);
            let within = |(t, _): &&(f64, f64)| *t > ulps && *t < limit - ulps;
            let sure =
                all.iter().filter(within).filter(|h| h.1 > 1e-2).map(|h| h.0).fold(f64::INFINITY, f64::min);
            let hit = geometry.intersect(&ray);
            match hit {
                Some(hit) => {
                    let t = f64::from(hit.t);
                    assert!(t < limit && t <= sure + ulps * 10.0, "{ray:?} hit at {t}, nearer at {sure}");
                    let near = |h: &&(f64, f64)| (h.0 - t).abs() < 1e-2 * f64::from(scale) && h.1 > -1e-2;
                    assert!(all.iter().any(|h| near(&h)), "{ray:?} hit nothing at {t}");
                    hits += 1;
                    undecided += usize::from((t - sure).abs() > 10.0 * ulps);
                }
                None => assert!(sure.is_infinite(), "{ray:?} missed at {sure}"),
            }
            assert_eq!(geometry.occluded(&ray), hit.is_some(), "{ray:?}");
        }
        assert!(hits > 600 && undecided * 10 < hits, "{hits} hits, {undecided} near rims");
    }
}

/// The tree must lose nothing that its leaves, tested one by one, would find: exactly.
#[test]
fn tree_loses_no_hit() {
    let offsets = [Vec3A::ZERO, Vec3A::new(3.0, 1e3, -200.0)];
    for (seed, scale) in [1e-3f32, 1.0, 1e3].into_iter().enumerate() {
        for offset in offsets {
            let shapes = soup(300, scale, offset, 20 + seed as u64);
            let geometry = Geometry::build(shapes);
            for ray in rays(4000, scale, offset, 200 + seed as u64) {
                let found = geometry.walls.closest(&ray).map(|f| f.t);
                assert_eq!(found, geometry.walls.closest_of_all(&ray), "{ray:?} at scale {scale}");
                assert_eq!(geometry.walls.any(&ray), found.is_some());
            }
        }
    }
}

#[test]
fn nothing_escapes_a_closed_mesh() {
    for (scale, centre) in
        [(1.0, Vec3::ZERO), (1e-3, Vec3::ZERO), (1e3, Vec3::ZERO), (1.0, Vec3::new(300.0, 70.0, 5.0))]
    {
        let mesh = bumpy_sphere(16, 0.1, centre, scale);
        let geometry = Geometry::build(vec![ShapeDesc::Mesh(mesh.clone())]);
        let mut s = stream(3);
        for i in 0..40_000 {
            let corners = mesh.corners(s.next_u64() as usize % mesh.indices().len()).map(Vec3A::from);
            // At corners, at edges, and near them by a few ulps.
            let along = if i % 2 == 0 { 0.0 } else { s.next_1d() };
            let ulp = if i % 4 < 2 { Vec3A::ZERO } else { point(&mut s) * corners[0].length() * 1e-7 };
            let target = corners[0].lerp(corners[1], along) + ulp;
            let origin = Vec3A::from(centre) + point(&mut s) * 0.4 * scale;
            let ray = Ray::new(origin, (target - origin).normalize());
            assert!(geometry.intersect(&ray).is_some(), "{ray:?} escaped at {target}");
            assert!(geometry.occluded(&ray));
        }
    }
}

#[test]
fn axis_aligned_rays_do_not_escape_a_box_through_its_edges() {
    let geometry = Geometry::build(vec![ShapeDesc::Mesh(TriangleMesh::cube())]);
    for axis in 0..3 {
        for sign in [-1.0f32, 1.0] {
            for zero in [0.0f32, -0.0] {
                for x in [-1.0f32, -0.5, 0.0, 0.5, 1.0] {
                    for y in [-1.0f32, 0.0, 1.0] {
                        let mut dir = Vec3A::splat(zero);
                        dir[axis] = sign;
                        let mut origin = Vec3A::ZERO;
                        origin[(axis + 1) % 3] = x;
                        origin[(axis + 2) % 3] = y;
                        let hit = geometry.intersect(&Ray::new(origin, dir)).expect("a face lies ahead");
                        assert_eq!(hit.t, 1.0, "{origin} {dir}");
                    }
                }
            }
        }
    }
}

#[test]
fn hits_lie_on_the_surface_and_face_outwards() {
    let shapes = soup(100, 1.0, Vec3A::ZERO, 5);
    let geometry = Geometry::build(shapes.clone());
    for ray in rays(3000, 1.0, Vec3A::ZERO, 6) {
        let Some(Hit { t, point }) = geometry.intersect(&ray) else { continue };
        assert!((ray.at(t) - point.p).length() < 1e-4 * (1.0 + t), "{ray:?} {t} {point:?}");
        assert!((point.ng.length() - 1.0).abs() < 1e-6 && point.ns.dot(point.ng) >= 0.0);
        let p = point.p.as_dvec3();
        let height = match &shapes[point.shape as usize] {
            ShapeDesc::Sphere { centre, radius } => {
                assert!((centre + *radius * point.ng - point.p).length() < 1e-6);
                p.distance(centre.as_dvec3()) - f64::from(*radius)
            }
            ShapeDesc::Disc { centre, normal, .. } => (p - centre.as_dvec3()).dot(normal.as_dvec3()),
            ShapeDesc::Mesh(mesh) => {
                let first = geometry.shapes[point.shape as usize].first;
                let corners = mesh.corners((point.prim - first) as usize);
                let n = mesh::cross(corners).normalize();
                assert!(n.distance(point.ng.as_dvec3()) < 1e-6);
                (p - corners[0].as_dvec3()).dot(n)
            }
        };
        assert!(height.abs() <= 1.01 * 2f64.powi(-24) * p.abs().dot(point.ng.as_dvec3().abs()), "{height:e}");
    }
}

#[test]
fn boundaries_and_walls_are_told_apart() {
    let wall = |z: f32| ShapeDesc::Disc { centre: Vec3A::Z * z, normal: Vec3A::Z, radius: 1.0 };
    let geometry = Geometry::build_with(vec![(wall(1.0), true), (wall(2.0), false)]);
    let ray = Ray::new(Vec3A::new(0.1, 0.2, 0.0), Vec3A::Z);
    assert_eq!(geometry.intersect(&ray).unwrap().point.shape, 1);
    assert!(!geometry.occluded(&Ray { t_max: 1.5, ..ray }));
    let boundary = geometry.boundary(&ray).unwrap();
    assert_eq!((boundary.point.shape, boundary.point.prim, boundary.t), (0, 0, 1.0));
    assert!(geometry.boundary(&boundary.point.spawn(Vec3A::Z)).is_none());
    assert!(geometry.has_boundaries() && geometry.is_boundary(0) && !geometry.is_boundary(1));
    assert_eq!(geometry.primitive_count(), 2);
}

#[test]
fn an_empty_scene_is_empty() {
    let geometry = Geometry::build(Vec::new());
    assert!(geometry.intersect(&Ray::new(Vec3A::ZERO, Vec3A::X)).is_none());
    assert!(!geometry.occluded(&Ray::new(Vec3A::ZERO, Vec3A::X)));
    assert!(geometry.bounds().is_empty() && geometry.bounding_sphere().1 == 0.0);
}

#[test]
fn attributes_are_interpolated() {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    let normals = vec![Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::Z];
    let uvs = vec![Vec2::ZERO, Vec2::new(2.0, 0.0), Vec2::new(0.0, 4.0)];
    let mesh = TriangleMesh::new(positions, Some(normals), Some(uvs), vec![[0, 2, 1]]).unwrap();
    let geometry = Geometry::build(vec![ShapeDesc::Mesh(mesh)]);
    let hit = geometry.intersect(&Ray::new(Vec3A::new(0.5, 0.25, 1.0), -Vec3A::Z)).unwrap();
    assert_eq!(hit.point.ng, -Vec3A::Z, "the winding decides the outside");
    assert!(hit.point.uv.distance(Vec2::new(1.0, 1.0)) < 1e-6);
    let expected = -Vec3A::new(0.5, 0.0, 1.0).normalize();
    assert!(hit.point.ns.distance(expected) < 1e-6, "flipped to the side of ng: {}", hit.point.ns);
}
