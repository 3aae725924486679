//! Parallelograms: the same hits as of their triangles, and no gaps.

use super::super::*;
use super::{direction, placed, point, stream};
use crate::math::Stream;
use glam::{Affine3A, Mat3A, Vec2, Vec3};

/// A cube's mesh with the same triangles, of which no two are seen to be a parallelogram.
fn in_triangles(cube: &TriangleMesh) -> TriangleMesh {
    let turned = cube.indices().iter().enumerate();
    let indices = turned.map(|(i, &[a, b, c])| if i % 2 == 0 { [a, b, c] } else { [b, c, a] }).collect();
    let (positions, uvs) = (cube.positions().to_vec(), cube.uvs().map(<[_]>::to_vec));
    TriangleMesh::new(positions, None, uvs, indices).unwrap()
}

fn scales() -> impl Iterator<Item = (f32, Vec3A)> {
    [1e-9f32, 1e-3, 1.0, 1e3, 1e9].into_iter().flat_map(|scale| {
        [0.0, 1.0, 100.0].into_iter().map(move |away| (scale, Vec3A::new(0.37, -0.83, 0.41) * away * scale))
    })
}

/// Cubes turned anyhow, also sheared and reflected.
fn cube(s: &mut Stream, scale: f32, centre: Vec3A) -> TriangleMesh {
    let mut place = placed(s, scale, centre);
    if s.next_1d() < 0.5 {
        let shear = Mat3A::from_cols(-Vec3A::X, Vec3A::Y + 0.4 * point(s), Vec3A::Z);
        place *= Affine3A { matrix3: shear, translation: Vec3A::ZERO };
    }
    TriangleMesh::cube().transformed(&place).unwrap()
}

#[test]
fn faces_of_cubes_and_squares_are_found_whatever_their_transform() {
    let mut s = stream(60);
    for (scale, centre) in scales() {
        for _ in 0..50 {
            let geometry = Geometry::build(vec![ShapeDesc::Mesh(cube(&mut s, scale, centre))]);
            assert_eq!(geometry.walls.blocks.len(), 0, "at {scale}, {centre}");
            let mut found: Vec<_> =
                geometry.walls.parallelograms.iter().flat_map(|b| b.primitives()).collect();
            found.sort_unstable();
            assert_eq!(found, (0..12).collect::<Vec<_>>());
            let square = TriangleMesh::unit_square().transformed(&placed(&mut s, scale, centre)).unwrap();
            assert_eq!(Geometry::build(vec![ShapeDesc::Mesh(square)]).walls.parallelograms.len(), 1);
        }
    }
}

/// The corners of a transformed cube are where the transform takes them, as far as a few roundings.
#[test]
fn transforms_of_cubes_are_rounded_by_no_more_than_f32() {
    let mut s = stream(61);
    for (scale, centre) in scales() {
        for _ in 0..50 {
            let place = placed(&mut s, scale, centre);
            let moved = TriangleMesh::cube().transformed(&place).unwrap();
            for (p, unit) in moved.positions().iter().zip(TriangleMesh::cube().positions()) {
                let columns = place.matrix3.to_cols_array_2d().map(|c| Vec3::from_array(c).as_dvec3());
                let exact =
                    columns.iter().zip(unit.to_array()).map(|(c, x)| *c * f64::from(x)).sum::<glam::DVec3>()
                        + place.translation.as_dvec3();
                let reach = 4.0 * f64::from(scale + centre.abs().max_element());
                assert!(
                    (p.as_dvec3() - exact).abs().max_element() < 2f64.powi(-23) * reach,
                    "{p} for {exact}"
                );
            }
        }
    }
}

#[test]
fn hits_are_those_of_the_triangles() {
    let mut s = stream(62);
    let mut hits = 0;
    for (scale, centre) in scales() {
        for _ in 0..40 {
            let mesh = cube(&mut s, scale, centre);
            let triangles = Geometry::build(vec![ShapeDesc::Mesh(in_triangles(&mesh))]);
            let whole = Geometry::build(vec![ShapeDesc::Mesh(mesh)]);
            assert!(triangles.walls.parallelograms.is_empty() && whole.walls.blocks.is_empty());
            for _ in 0..100 {
                let from = centre + point(&mut s) * 3.0 * scale;
                let to = centre + point(&mut s) * scale;
                let Some(dir) = (to - from).try_normalize() else { continue };
                let t_max = if s.next_1d() < 0.3 { s.next_1d() * 4.0 * scale } else { f32::INFINITY };
                let ray = Ray { t_max, ..Ray::new(from, dir) };
                let (a, b) = (triangles.intersect(&ray), whole.intersect(&ray));
                assert_eq!(whole.occluded(&ray), b.is_some(), "{ray:?}");
                let (a, b) = match (a, b) {
                    (None, None) => continue,
                    (Some(a), Some(b)) => (a, b),
                    // At a rim the triangles' corners are rounded toward the ray.
                    (a, b) => {
                        let Hit { point, .. } = a.or(b).unwrap();
                        assert!(point.uv.min(1.0 - point.uv).min_element() < 1e-5, "{ray:?} {point:?}");
                        continue;
                    }
                };
                let size = scale + centre.length();
                let rounding = 1e-5 * size / dir.dot(a.point.ng).abs();
                assert!(
                    (a.t - b.t).abs() < 1e-5 * size && a.point.p.distance(b.point.p) < rounding,
                    "{a:?} {b:?}"
                );
                let at_rim = b.point.uv.min(1.0 - b.point.uv).min_element() < 1e-3;
                let at_diagonal = (b.point.uv.x - b.point.uv.y).abs() < 1e-3;
                if !(at_rim || at_diagonal) {
                    assert_eq!(a.point.prim, b.point.prim, "{a:?} {b:?}");
                    assert!(a.point.uv.distance(b.point.uv) < rounding / (0.1 * scale), "{a:?} {b:?}");
                    assert!(a.point.ng.distance(b.point.ng) < 1e-5, "{a:?} {b:?}");
                    hits += 1;
                }
            }
        }
    }
    assert!(hits > 15_000, "{hits}");
}

/// Through edges, corners, and near them by some ulps; and along faces, where f32 can tell nothing.
#[test]
fn nothing_escapes_a_turned_box() {
    let mut s = stream(63);
    for (scale, centre) in scales() {
        let mesh = cube(&mut s, scale, centre);
        let geometry = Geometry::build(vec![ShapeDesc::Mesh(mesh.clone())]);
        for i in 0..20_000 {
            let corners = mesh.corners(s.next_u64() as usize % 12).map(Vec3A::from);
            let along = if i % 2 == 0 { 0.0 } else { s.next_1d() };
            let ulp = if i % 4 < 2 { Vec3A::ZERO } else { point(&mut s) * corners[0].length() * 1e-7 };
            let target = corners[0].lerp(corners[1], along) + ulp;
            // From the middle, or from close to a face.
            let beside = corners[0].lerp(corners[2], s.next_1d()).lerp(centre, 1e-3);
            let origin = if i % 3 == 0 { beside } else { centre + direction(&mut s) * 1e-3 * scale };
            let Some(dir) = (target - origin).try_normalize() else { continue };
            let ray = Ray::new(origin, dir);
            assert!(geometry.intersect(&ray).is_some(), "{ray:?} escaped at {target}");
            assert!(geometry.occluded(&ray));
        }
    }
}

/// Rays that all but lie in a parallelogram's plane: what f64 finds is not ruled out by f32.
#[test]
fn grazing_rays_are_not_lost() {
    let mut s = stream(64);
    let (mut hits, mut grazing) = (0, 0);
    for (scale, centre) in scales() {
        for _ in 0..200 {
            let square = TriangleMesh::unit_square().transformed(&placed(&mut s, scale, centre)).unwrap();
            let [a, b, c] = square.corners(0).map(Vec3A::from);
            let geometry = Geometry::build(vec![ShapeDesc::Mesh(square)]);
            for i in 0..50 {
                let (u, v) = (s.next_1d(), s.next_1d());
                let target = a + (b - a) * u + (c - b) * v;
                let height = scale * 10f32.powi(-(i % 8));
                let beside = a + (b - a) * (4.0 * s.next_1d() - 1.5) + (c - b) * (4.0 * s.next_1d() - 1.5);
                let origin = beside + (b - a).cross(c - b).normalize() * height;
                let Some(dir) = (target - origin).try_normalize() else { continue };
                let ray = Ray::new(origin, dir);
                // By other formulas: where in f64 the ray, as it is, meets the plane.
                let [a, b, c, o, d] = [a, b, c, origin, dir].map(|x| x.as_dvec3());
                let normal = (b - a).cross(c - b).normalize();
                let t = (a - o).dot(normal) / d.dot(normal);
                let p = o + d * t - a;
                let [e, f] = [b - a, c - b];
                let at = |e: glam::DVec3, f: glam::DVec3| p.cross(f).dot(normal) / e.cross(f).dot(normal);
                let (u, v) = (at(e, f), at(f, e));
                // Of origins that lie on the plane to f32 it is the rounding that says which side they are on.
                let room = 1e-6 / d.dot(normal).abs().max(1e-9);
                let inside = u.min(1.0 - u).min(v).min(1.0 - v);
                let found = geometry.intersect(&ray).is_some();
                if t > 0.0 && inside > 1e-9 * room {
                    assert!(found, "{ray:?} {t} {u} {v}");
                    hits += 1;
                    grazing += u32::from(d.dot(normal).abs() < 1e-5);
                } else if inside < -1e-9 * room {
                    assert!(!found, "{ray:?} {t} {u} {v}");
                }
            }
        }
    }
    assert!(hits > 50_000 && grazing > 5000, "{hits} {grazing}");
}

/// Texture coordinates that are not affine over the whole are those of each triangle.
#[test]
fn texture_coordinates_are_those_of_the_triangles() {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
    let mut s = stream(65);
    for corner in [[1.0, 1.0], [3.0, 0.5]] {
        let uvs = [[0.0, 0.0], [1.0, 0.0], corner, [0.0, 1.0]].map(Vec2::from_array).to_vec();
        let mesh = TriangleMesh::new(positions.clone(), None, Some(uvs), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let geometry = Geometry::build(vec![ShapeDesc::Mesh(mesh.clone())]);
        assert_eq!(geometry.walls.parallelograms.len(), 1);
        for _ in 0..200 {
            let at = s.next_2d();
            let ray = Ray::new(Vec3A::new(at.x, at.y, 1.0), -Vec3A::Z);
            let point = geometry.intersect(&ray).unwrap().point;
            let (triangle, b) = if at.y <= at.x {
                (0, Vec2::new(at.x - at.y, at.y))
            } else {
                (1, Vec2::new(at.x, at.y - at.x))
            };
            let (_, uv) = mesh.attributes(triangle, b);
            assert!(point.prim == triangle as u32 && point.uv.distance(uv) < 1e-5, "{point:?} for {uv}");
        }
    }
}

/// Points drawn on a lamp that is one parallelogram are on the triangle that they say.
#[test]
fn drawn_points_are_on_their_triangle() {
    let mut s = stream(66);
    let place = placed(&mut s, 1.0, Vec3A::new(0.3, 2.0, -1.0));
    for reflected in [1.0, -1.0] {
        let place = place * Affine3A::from_scale(Vec3::new(reflected, 1.0, 1.0));
        let mesh = TriangleMesh::unit_square().transformed(&place).unwrap();
        let geometry = Geometry::build(vec![ShapeDesc::Mesh(mesh.clone())]);
        for _ in 0..200 {
            let drawn = geometry.sample_place(0, s.next_2d());
            let away = Ray::new(drawn.p + drawn.ng, -drawn.ng);
            let found = geometry.intersect(&away).unwrap().point;
            let uv = found.uv;
            assert!(found.prim == drawn.prim || (uv.x - uv.y).abs() < 1e-4, "{} {found:?}", drawn.prim);
            assert!(found.p.distance(drawn.p) < 1e-5 && found.ng.distance(drawn.ng) < 1e-5);
        }
    }
}

/// What a ray starts and ends on is left out of its tests, and would not have been hit.
#[test]
fn rays_know_what_they_start_and_end_on() {
    let mut s = stream(66);
    let (mut clear, mut occluded) = (0, 0);
    for (scale, centre) in scales() {
        for _ in 0..20 {
            let mut place = || {
                let middle = centre + point(&mut s) * scale;
                ShapeDesc::Mesh(cube(&mut s, scale, middle))
            };
            let geometry = Geometry::build(vec![place(), place(), place()]);
            for _ in 0..200 {
                let [a, b] = [(); 2].map(|()| geometry.sample_area(s.next_u64() as u32 % 3, s.next_2d()));
                // Within a face either answer will do: no light goes along it.
                if a.prim / 2 == b.prim / 2 {
                    continue;
                }
                let ray = shadow_ray(a.p, Some(a.footing()), b.p, Some(b.footing()));
                assert_eq!(ray.ends.keys().map(|e| e > 0.0), [true; 2]);
                let bare = Ray { ends: Ends::NONE, ..ray };
                let hit = geometry.occluded(&ray);
                assert_eq!(hit, geometry.occluded(&bare), "{ray:?}");
                *if hit { &mut occluded } else { &mut clear } += 1;
                let ray = a.spawn(direction(&mut s));
                let [t, bare] =
                    [ray, Ray { ends: Ends::NONE, ..ray }].map(|ray| geometry.intersect(&ray).map(|h| h.t));
                assert_eq!(t, bare, "{ray:?}");
            }
        }
    }
    assert!(clear > 5000 && occluded > 5000, "{clear} {occluded}");
}

/// Both triangles of a parallelogram stand for it, and no other number does.
#[test]
fn what_a_ray_starts_on_is_told_by_its_number() {
    let geometry = Geometry::build(vec![ShapeDesc::Mesh(TriangleMesh::unit_square())]);
    let above = Ray::new(Vec3A::new(0.2, 0.1, 1.0), -Vec3A::Z);
    let meets = |ends: [f32; 2], t_max: f32| {
        let ray = Ray { ends: Ends::new(ends[0], ends[1]), t_max, ..above };
        (geometry.intersect(&ray).is_some(), geometry.occluded(&ray))
    };
    let key = Footing::key;
    assert_eq!(meets([0.0; 2], 3.0), (true, true));
    for prim in [0, 1] {
        assert_eq!(meets([key(prim), 0.0], 3.0), (false, false));
        assert_eq!(meets([0.0, key(prim)], 3.0), (true, false));
    }
    for prim in [2, 3, u32::MAX] {
        assert_eq!(meets([key(prim); 2], 3.0), (true, true));
        assert_eq!(meets([key(prim); 2], f32::INFINITY), (true, true));
        assert_eq!(meets([key(prim); 2], 0.5), (false, false));
    }
}
