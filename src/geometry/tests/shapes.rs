//! Shapes under transforms, and what is told about them.

use super::super::transform::{is_singular, normal_matrix, similarity_scale};
use super::super::*;
use super::{bumpy_sphere, direction, stream};
use glam::{Affine3A, Mat3, Quat, Vec3};

fn scaled(x: f32, y: f32, z: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::new(1.0, -2.0, 0.5))
        * Affine3A::from_quat(Quat::from_rotation_x(0.7) * Quat::from_rotation_y(-1.1))
        * Affine3A::from_scale(Vec3::new(x, y, z))
}

fn stats(shape: ShapeDesc) -> ShapeStats {
    ShapeStats::of(&shape)
}

#[test]
fn a_cube_is_closed_and_stays_outside_out() {
    let cube = TriangleMesh::cube();
    let s = stats(ShapeDesc::Mesh(cube.clone()));
    assert!(s.closed && s.volume == Some(8.0) && s.area == 24.0 && s.primitives == 12);
    assert_eq!((s.bounds.min, s.bounds.max), (-Vec3A::ONE, Vec3A::ONE));
    for (x, y, z) in [(1.0, 2.0, 3.0), (-1.0, 2.0, 3.0), (-1.0, -2.0, 3.0), (-1.0, -2.0, -3.0)] {
        let moved = ShapeDesc::Mesh(cube.clone()).transformed(&scaled(x, y, z)).unwrap();
        let s = stats(moved);
        assert!(s.closed && (s.volume.unwrap() - 48.0).abs() < 1e-4, "{x} {y} {z}: {:?}", s.volume);
    }
}

#[test]
fn discs_and_normals_stay_outside_out() {
    let mirror = scaled(1.0, 1.0, -1.0);
    let disc = ShapeDesc::Disc { centre: Vec3A::X, normal: Vec3A::Z, radius: 2.0 };
    let ShapeDesc::Disc { centre, normal, radius } = disc.transformed(&mirror).unwrap() else {
        panic!("a disc stays one")
    };
    let above = mirror.transform_point3a(Vec3A::X + Vec3A::Z);
    assert!((above - centre).normalize().distance(normal) < 1e-6 && radius == 2.0);
    let square = ShapeDesc::Mesh(TriangleMesh::rectangle()).transformed(&mirror).unwrap();
    let geometry = Geometry::build(vec![square]);
    let ng = geometry.sample_area(0, glam::Vec2::splat(0.3)).ng;
    assert!(ng.distance(mirror.transform_vector3a(Vec3A::Z)) < 1e-6);
    // A normal stays perpendicular to its plane, on the outside, under any transform.
    for m in [scaled(1.0, 5.0, 0.2), scaled(-1e-3, 2e-3, 1e-3), scaled(-1.0, -3.0, -1.0)] {
        let n = normal_matrix(&m) * Vec3::new(1.0, 2.0, 2.0);
        let along = [Vec3::new(2.0, -1.0, 0.0), Vec3::new(0.0, 1.0, -1.0)].map(|v| m.transform_vector3(v));
        assert!(along.iter().all(|v| v.normalize().dot(n.normalize()).abs() < 1e-5));
        assert!(m.transform_vector3(Vec3::new(1.0, 2.0, 2.0)).dot(n) > 0.0);
    }
}

#[test]
fn a_disc_may_be_scaled_along_its_axis_only_otherwise_evenly() {
    let disc = || ShapeDesc::Disc { centre: Vec3A::ZERO, normal: Vec3A::Z, radius: 1.0 };
    assert!(disc().transformed(&scaled(2.0, 2.0, 7.0)).is_ok());
    assert!(disc().transformed(&scaled(2.0, 1.0, 1.0)).unwrap_err().contains("disc"));
    let sphere = || ShapeDesc::Sphere { centre: Vec3A::ONE, radius: 1.5 };
    assert!(sphere().transformed(&scaled(2.0, 2.0, 2.1)).unwrap_err().contains("sphere"));
    let ShapeDesc::Sphere { radius, .. } = sphere().transformed(&scaled(-2.0, 2.0, 2.0)).unwrap() else {
        panic!("a sphere stays one")
    };
    assert!((radius - 3.0).abs() < 1e-5);
}

#[test]
fn transforms_are_told_apart() {
    assert!(!is_singular(&scaled(1e-4, 1e-4, 1e-4)) && !is_singular(&scaled(1e3, 1e-3, -1.0)));
    assert!(is_singular(&scaled(1.0, 0.0, 1.0)) && is_singular(&scaled(f32::NAN, 1.0, 1.0)));
    let flat = Mat3::from_cols(Vec3::X, Vec3::Y, Vec3::new(0.3, 0.7, 0.0));
    assert!(is_singular(&Affine3A::from_mat3(flat)));
    assert!(is_singular(&Affine3A::from_translation(Vec3::new(f32::INFINITY, 0.0, 0.0))));
    assert!((similarity_scale(&scaled(-3.0, 3.0, 3.0)).unwrap() - 3.0).abs() < 1e-5);
    assert!(similarity_scale(&scaled(3.0, 3.0, 3.01)).is_none());
    let shear = Mat3::from_cols(Vec3::X, Vec3::Y, Vec3::new(0.6, 0.0, 0.8));
    assert!(similarity_scale(&Affine3A::from_mat3(shear)).is_none());
    let squashed = ShapeDesc::Mesh(TriangleMesh::cube()).transformed(&scaled(1.0, 0.0, 1.0));
    assert!(squashed.unwrap_err().contains("singular"));
}

#[test]
fn wrong_numbers_are_refused() {
    let sphere = |radius| ShapeDesc::Sphere { centre: Vec3A::ZERO, radius };
    assert!(sphere(1.0).check().is_ok());
    for radius in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(sphere(radius).check().unwrap_err().contains("radius"));
    }
    assert!(ShapeDesc::Sphere { centre: Vec3A::NAN, radius: 1.0 }.check().is_err());
    let disc = ShapeDesc::Disc { centre: Vec3A::ZERO, normal: Vec3A::ZERO, radius: 1.0 };
    assert!(disc.check().unwrap_err().contains("normal"));
    let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    let mesh = |indices| TriangleMesh::new(corners.clone(), None, None, indices);
    assert!(mesh(vec![[0, 1, 3]]).unwrap_err().contains("3 vertices"));
    assert!(mesh(vec![]).is_err() && mesh(vec![[0, 1, 1]]).unwrap_err().contains("area"));
    assert_eq!(mesh(vec![[0, 1, 1], [0, 1, 2]]).unwrap().dropped(), 1);
    let wrong = TriangleMesh::new(corners.clone(), Some(vec![Vec3::Z]), None, vec![[0, 1, 2]]);
    assert!(wrong.unwrap_err().contains("1 normals for 3 vertices"));
}

#[test]
fn open_and_folded_meshes_are_not_closed() {
    assert!(!stats(ShapeDesc::Mesh(TriangleMesh::rectangle())).closed);
    let ball = bumpy_sphere(6, 0.1, Vec3::ZERO, 1.0);
    let rebuilt = |indices: Vec<[u32; 3]>| {
        let mesh = TriangleMesh::new(ball.positions().to_vec(), None, None, indices).unwrap();
        stats(ShapeDesc::Mesh(mesh))
    };
    let all = ball.indices().to_vec();
    assert!(rebuilt(all.clone()).closed && rebuilt(all.clone()).volume.unwrap() > 0.0);
    assert_eq!(rebuilt(all.clone()).gap, None);
    let hole = rebuilt(all[1..].to_vec());
    let corners = all[0].map(|i| ball.positions()[i as usize]);
    let of_the_hole =
        |gap| matches!(gap, Some(Gap::Open { edges: 3, one }) if one.iter().all(|p| corners.contains(p)));
    assert!(!hole.closed && hole.volume.is_none() && of_the_hole(hole.gap), "a hole: {:?}", hole.gap);
    let mut turned = all.clone();
    turned[3].swap(0, 1);
    let turned = rebuilt(turned);
    assert!(
        !turned.closed && matches!(turned.gap, Some(Gap::Turned { edges: 3, .. })),
        "a triangle turned over"
    );
    let inside_out = rebuilt(all.iter().map(|&[a, b, c]| [a, c, b]).collect());
    assert!(inside_out.closed && inside_out.volume.unwrap() < 0.0);
    let twice = rebuilt([&all[..], &all[..1]].concat());
    assert!(matches!(twice.gap, Some(Gap::Open { edges: 3, .. })), "a triangle twice");
}

#[test]
fn bounds_hold_what_is_in_them() {
    let mut s = stream(80);
    let shapes = vec![
        ShapeDesc::Disc { centre: Vec3A::X, normal: direction(&mut s), radius: 0.7 },
        ShapeDesc::Sphere { centre: Vec3A::Y * 3.0, radius: 0.2 },
        ShapeDesc::Mesh(bumpy_sphere(5, 0.3, Vec3::NEG_Z, 0.5)),
    ];
    let boxes: Vec<Aabb> = shapes.iter().map(ShapeDesc::bounds).collect();
    let geometry = Geometry::build(shapes);
    let (centre, radius) = geometry.bounding_sphere();
    for (i, b) in boxes.iter().enumerate() {
        let (mut least, mut most) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
        for _ in 0..20_000 {
            let p = geometry.sample_area(i as u32, s.next_2d()).p;
            assert!(p.distance(centre) <= radius);
            (least, most) = (least.min(p), most.max(p));
        }
        // Inside, up to rounding, and tight.
        assert!((least - b.min).min_element() > -1e-6 && (b.max - most).min_element() > -1e-6, "shape {i}");
        assert!((least - b.min).max_element() < 0.02 && (b.max - most).max_element() < 0.02, "shape {i}");
    }
}
