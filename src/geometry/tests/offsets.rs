//! Rays that start or end on surfaces do not meet them there, and meet what is behind.

use super::super::*;
use super::{direction, point, stream, turn};
use crate::math::Stream;
use glam::{Affine3A, Vec3};

/// Scales, and centres as far away as leaves the shapes some thousand ulps.
fn places() -> Vec<(f32, Vec3A)> {
    let mut places = Vec::new();
    for scale in [1e-3f32, 1.0, 1e3] {
        for away in [0.0, 1.0, 30.0, 1000.0] {
            places.push((scale, Vec3A::new(0.37, -0.83, 0.41) * away * scale));
            if scale >= 1.0 {
                places.push((scale, Vec3A::new(-1e3, 700.0, 10.0)));
            }
        }
    }
    places
}

/// One of each kind, about `centre`, turned anyhow.
fn shapes(s: &mut Stream, scale: f32, centre: Vec3A) -> Vec<ShapeDesc> {
    let q = turn(s);
    let place = Affine3A::from_scale_rotation_translation(Vec3::splat(scale), q, centre.into());
    let corners = [point(s), point(s), point(s)].map(|p| Vec3::from(centre + p * scale));
    let triangle = TriangleMesh::new(corners.to_vec(), None, None, vec![[0, 1, 2]]).unwrap();
    vec![
        ShapeDesc::Sphere { centre, radius: scale },
        ShapeDesc::Disc { centre, normal: direction(s), radius: scale },
        ShapeDesc::Mesh(TriangleMesh::rectangle().transformed(&place).unwrap()),
        ShapeDesc::Mesh(triangle),
    ]
}

/// What a ray meets at no more than `reach`.
fn meets(geometry: &Geometry, ray: Ray, reach: f32) -> bool {
    geometry.intersect(&ray).is_some_and(|h| h.t < reach) || geometry.occluded(&Ray { t_max: reach, ..ray })
}

#[test]
fn spawned_rays_do_not_hit_their_own_primitive() {
    let mut s = stream(40);
    for (scale, centre) in places() {
        for round in 0..8 {
            for (kind, shape) in shapes(&mut s, scale, centre).into_iter().enumerate() {
                let geometry = Geometry::build(vec![shape]);
                for i in 0..60 {
                    let mut p = geometry.sample_area(0, s.next_2d());
                    if i % 2 == 0 {
                        // Points that a ray found, too.
                        let from = centre + direction(&mut s) * scale * 3.0;
                        let Some(hit) = geometry.intersect(&Ray::new(from, (p.p - from).normalize())) else {
                            continue;
                        };
                        p = hit.point;
                    }
                    let mut dir = direction(&mut s);
                    if i % 3 == 0 {
                        // Nearly along the surface.
                        dir = (dir - p.ng * dir.dot(p.ng) * 0.999).normalize();
                    }
                    let outwards = dir.dot(p.ng) > 0.0;
                    let told =
                        format!("kind {kind}, round {round}, scale {scale}, centre {centre}, {p:?} {dir}");
                    if kind == 0 && !outwards {
                        // The far side of the sphere, at the length of the chord.
                        let chord = 2.0 * scale * -dir.dot(p.ng);
                        let hit = geometry.intersect(&p.spawn(dir)).expect(&told);
                        let room = 1e-6 * (scale + centre.length()) / dir.dot(p.ng).abs();
                        assert!((hit.t - chord).abs() < 4.0 * room, "{told}: {} for {chord}", hit.t);
                    } else {
                        assert!(!meets(&geometry, p.spawn(dir), f32::INFINITY), "{told}");
                    }
                }
            }
        }
    }
}

#[test]
fn points_that_see_each_other_are_not_hidden_by_their_own_surfaces() {
    let mut s = stream(41);
    for (scale, centre) in places() {
        for distance in [2.5f32, 100.0] {
            let apart = direction(&mut s) * distance * scale;
            let here = shapes(&mut s, scale, centre);
            let there = shapes(&mut s, scale, centre + apart);
            for a in &here {
                for b in &there {
                    let geometry = Geometry::build(vec![a.clone(), b.clone()]);
                    for _ in 0..30 {
                        let (p, q) =
                            (geometry.sample_area(0, s.next_2d()), geometry.sample_area(1, s.next_2d()));
                        let d = (q.p - p.p).normalize();
                        // Spheres hide their far sides.
                        let faces = |shape: &ShapeDesc, cos: f32| match shape {
                            ShapeDesc::Sphere { .. } => cos > 1e-3,
                            _ => cos.abs() > 1e-5,
                        };
                        if faces(a, p.ng.dot(d)) && faces(b, -q.ng.dot(d)) {
                            let told = format!("scale {scale}, centre {centre}, {p:?} {q:?}");
                            let ray = shadow_ray(p.p, Some(p.footing()), q.p, Some(q.footing()));
                            assert!(!geometry.occluded(&ray), "{told}");
                            let back = shadow_ray(
                                q.p,
                                Some(Footing { normal: -q.ng, ..q.footing() }),
                                p.p,
                                Some(Footing { normal: -p.ng, ..p.footing() }),
                            );
                            assert!(!geometry.occluded(&back), "{told}");
                            assert!(!geometry.occluded(&shadow_ray(
                                p.p + d * scale * 1e-2,
                                None,
                                q.p,
                                Some(q.footing())
                            )));
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn thin_walls_do_not_leak() {
    let mut s = stream(42);
    for (scale, centre) in places() {
        // A wall must be thicker than f32 can round away.
        let thickness = (1e-3 * scale).max(4e-6 * (centre.length() + scale));
        let q = turn(&mut s);
        let size = Vec3::new(scale, scale, 0.5 * thickness);
        let place = Affine3A::from_scale_rotation_translation(size, q, centre.into());
        let wall = TriangleMesh::cube().transformed(&place).unwrap();
        let geometry = Geometry::build(vec![ShapeDesc::Mesh(wall)]);
        let inverse = place.inverse();
        let mut crossed = 0;
        for _ in 0..2000 {
            let (a, b) = (geometry.sample_area(0, s.next_2d()), geometry.sample_area(0, s.next_2d()));
            let height = |p: &SurfacePoint| inverse.transform_point3a(p.p).z;
            if height(&a) * height(&b) > -0.9 {
                continue;
            }
            let told = format!("scale {scale}, centre {centre}, {a:?} {b:?}");
            let ray = shadow_ray(a.p, Some(a.footing()), b.p, Some(b.footing()));
            // The segment leads through the wall: from a point it leaves by the inside.
            assert!(!geometry.occluded(&ray), "from inside nothing is in the way: {told}");
            let outside = (a.ng + direction(&mut s) * 0.5).normalize();
            let above = offset_origin(a.p, a.ng, outside);
            assert!(geometry.occluded(&shadow_ray(above, None, b.p + b.ng * thickness, None)), "{told}");
            let hit = geometry.intersect(&a.spawn(-outside)).expect(&told);
            // It ends at the other side, or at the rim where that is nearer.
            let rounding = 2e-6 * (centre.length() + scale);
            let at_rim = hit.point.ng.dot(a.ng) > -0.9;
            assert!(at_rim || hit.t >= thickness - rounding, "{told} {}", hit.t);
            crossed += u32::from(!at_rim);
        }
        assert!(crossed > 700, "{crossed}");
    }
}

#[test]
fn rays_from_a_corner_of_a_closed_box_stay_inside() {
    let mut s = stream(43);
    for (scale, centre) in places() {
        let q = turn(&mut s);
        let place = Affine3A::from_scale_rotation_translation(Vec3::splat(scale), q, centre.into());
        let room = TriangleMesh::cube().transformed(&place).unwrap();
        let geometry = Geometry::build(vec![ShapeDesc::Mesh(room)]);
        let mut escaped = 0;
        let rays = 4000;
        for _ in 0..rays {
            let p = geometry.sample_area(0, s.next_2d());
            let dir = (direction(&mut s) - p.ng * 1.001).normalize();
            escaped += u32::from(geometry.intersect(&p.spawn(dir)).is_none());
        }
        // A point within some ulps of an edge may be moved through the other wall; it takes luck to draw one.
        let ulps = 2f32.powi(-22) * (1.0 + centre.length() / scale);
        assert!(
            escaped as f32 <= 3.0 + 20.0 * rays as f32 * ulps,
            "{escaped} at scale {scale}, centre {centre}"
        );
    }
}

#[test]
fn a_wall_some_ulps_ahead_is_hit() {
    let mut s = stream(44);
    for (scale, centre) in places() {
        let q = turn(&mut s);
        let place = Affine3A::from_scale_rotation_translation(Vec3::splat(scale), q, centre.into());
        let wall = TriangleMesh::rectangle().transformed(&place).unwrap();
        let geometry = Geometry::build(vec![ShapeDesc::Mesh(wall)]);
        for _ in 0..1000 {
            let p = geometry.sample_area(0, glam::Vec2::splat(0.1) + s.next_2d() * 0.8);
            let towards = (direction(&mut s) * 0.7 - p.ng).normalize();
            // Above the wall by its rounding alone: in f32, behind it as often as before it.
            let ray = Ray::new(offset_origin(p.p, p.ng, p.ng), towards);
            let hit = geometry.intersect(&ray).unwrap_or_else(|| panic!("{ray:?}, {scale}, {centre}"));
            assert!(hit.t > 0.0 && hit.t < 1e-5 * (scale + centre.length()), "{ray:?} {}", hit.t);
            assert!(geometry.occluded(&ray));
        }
    }
}
