//! Points drawn on shapes are distributed as said.

use super::super::*;
use super::{bumpy_sphere, point, stream};
use crate::math::testing::assert_chi_square;
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

const N: usize = 400_000;

/// Counts over a grid of equal cells of the unit square.
fn assert_uniform(name: &str, points: impl Iterator<Item = (f64, f64)>) {
    let (mut counts, mut n) = (vec![0.0; 64], 0.0);
    for (x, y) in points {
        assert!((-1e-5..=1.0 + 1e-5).contains(&x) && (-1e-5..=1.0 + 1e-5).contains(&y), "{name}: {x} {y}");
        let cell = |v: f64| ((v * 8.0) as usize).min(7);
        counts[8 * cell(y) + cell(x)] += 1.0;
        n += 1.0;
    }
    assert_chi_square(name, &counts, &[n / 64.0; 64]);
    // Marginals see a small tilt that the cells drown.
    let marginal = |f: &dyn Fn(usize, usize) -> usize| -> Vec<f64> {
        (0..8).map(|i| (0..8).map(|j| counts[f(i, j)]).sum()).collect()
    };
    assert_chi_square(name, &marginal(&|i, j| 8 * i + j), &[n / 8.0; 8]);
    assert_chi_square(name, &marginal(&|i, j| 8 * j + i), &[n / 8.0; 8]);
}

fn turn(x: f64, y: f64) -> f64 {
    (y.atan2(x) / (2.0 * PI)).rem_euclid(1.0)
}

#[test]
fn areas_are_sampled_uniformly() {
    let (centre, normal) = (Vec3A::new(3.0, -1.0, 2.0), Vec3A::new(1.0, 2.0, -2.0) / 3.0);
    let geometry = Geometry::build(vec![
        ShapeDesc::Sphere { centre, radius: 0.5 },
        ShapeDesc::Disc { centre, normal, radius: 2.0 },
    ]);
    assert!((f64::from(geometry.area(0)) - PI).abs() < 1e-6);
    assert!((f64::from(geometry.area(1)) - 4.0 * PI).abs() < 1e-6);
    let mut s = stream(50);
    assert_uniform(
        "sphere",
        (0..N).map(|_| {
            let p = geometry.sample_area(0, s.next_2d());
            assert!((p.p - centre - p.ng * 0.5).length() < 1e-6 && p.ng.is_normalized());
            let n = p.ng.as_dvec3();
            (turn(n.x, n.z), 0.5 + 0.5 * n.y)
        }),
    );
    let mut s = stream(51);
    let (e, f) = normal.any_orthonormal_pair();
    assert_uniform(
        "disc",
        (0..N).map(|_| {
            let p = geometry.sample_area(1, s.next_2d());
            let d = (p.p - centre) / 2.0;
            assert!(d.dot(normal).abs() < 1e-6 && p.ng == normal);
            (turn(d.dot(e).into(), d.dot(f).into()), f64::from(d.length_squared()))
        }),
    );
}

#[test]
fn meshes_are_sampled_uniformly() {
    // Triangles of very different sizes.
    let mesh = bumpy_sphere(4, 0.3, Vec3::new(1.0, 2.0, 3.0), 2.0);
    let geometry = Geometry::build(vec![
        ShapeDesc::Sphere { centre: Vec3A::ZERO, radius: 0.1 },
        ShapeDesc::Mesh(mesh.clone()),
        ShapeDesc::Mesh(TriangleMesh::rectangle()),
    ]);
    let count = mesh.indices().len();
    let areas: Vec<f64> = (0..count).map(|i| mesh.triangle_area(i)).collect();
    let total: f64 = areas.iter().sum();
    assert!((f64::from(geometry.area(1)) / total - 1.0).abs() < 1e-6);
    let mut counts = vec![0.0; count];
    let mut s = stream(52);
    for _ in 0..N {
        let p = geometry.sample_area(1, s.next_2d());
        let triangle = p.prim as usize - 1;
        assert_eq!(p.shape, 1);
        counts[triangle] += 1.0;
    }
    let expected: Vec<f64> = areas.iter().map(|a| a / total * N as f64).collect();
    assert_chi_square("triangles of a mesh", &counts, &expected);
    let mut s = stream(53);
    assert_uniform(
        "square",
        (0..N).map(|_| {
            let p = geometry.sample_area(2, s.next_2d());
            assert!((p.uv * 2.0 - Vec2::ONE).distance(Vec2::new(p.p.x, p.p.y)) < 1e-6 && p.p.z == 0.0);
            (p.uv.x.into(), p.uv.y.into())
        }),
    );
}

#[test]
fn spheres_are_sampled_uniformly_in_the_visible_cone() {
    let cases = [(1.0, 1.001), (1.0, 1.5), (0.3, 10.0), (1e-3, 1e3), (1e3, 1.01e3)];
    for (i, (radius, distance)) in cases.into_iter().enumerate() {
        let centre = Vec3A::ZERO;
        let towards = Vec3A::new(2.0, -1.0, 2.0) / 3.0;
        let from = centre + towards * distance;
        let geometry = Geometry::build(vec![ShapeDesc::Sphere { centre, radius }]);
        // All in f64, from the positions as rounded.
        let axis = -from.as_dvec3();
        let d = axis.length();
        let sin2_max = (f64::from(radius) / d).powi(2);
        let one_minus_cos_max = sin2_max / (1.0 + (1.0 - sin2_max).sqrt());
        let (e, f) = axis.normalize().any_orthonormal_pair();
        let mut s = stream(60 + i as u64);
        let mut area = 0.0;
        let name = format!("sphere of {radius} at {distance}");
        let mut some = 0;
        assert_uniform(
            &name,
            (0..N).filter_map(|_| {
                let (p, pdf) = geometry.sample_toward(0, from, s.next_2d())?;
                some += 1;
                assert_eq!(pdf, geometry.pdf_toward(0, from, &p));
                // The direction by which the density is per solid angle: from the exact point of the sphere.
                let to = p.ng.as_dvec3().normalize() * f64::from(radius) - from.as_dvec3();
                let cos = -p.ng.as_dvec3().dot(to.normalize());
                let density = f64::from(pdf) * to.length_squared() / cos.max(1e-9);
                if cos > 1e-2 {
                    let expected = 1.0 / (2.0 * PI * one_minus_cos_max);
                    assert!((density / expected - 1.0).abs() < 1e-3, "{name}: {density} {expected}");
                }
                area += 1.0 / f64::from(pdf) * f64::from(u8::from(cos > 0.1));
                let sin2 = to.normalize().cross(axis.normalize()).length_squared();
                let h = sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt()) / one_minus_cos_max;
                Some((turn(to.dot(e), to.dot(f)), h.min(1.0)))
            }),
        );
        assert!(some * 1000 > N * 999, "{name}: {} without density", N - some);
        // The mean of 1/density is the area that is sampled: of the part seen at a cosine above 0.1.
        let cos_at_centre = cap_cosine(f64::from(radius), d, 0.1);
        let expected = 2.0 * PI * f64::from(radius).powi(2) * (1.0 - cos_at_centre);
        assert!((area / N as f64 / expected - 1.0).abs() < 0.02, "{name}: {} {expected}", area / N as f64);
    }
}

/// Cosine, at the centre of a sphere, of the cap that a viewer at distance `d` sees at cosines above `cos`.
fn cap_cosine(r: f64, d: f64, cos: f64) -> f64 {
    let sin = (1.0 - cos * cos).sqrt();
    // Sine rule: the angle at the viewer; the rest is at the centre.
    let at_viewer = (r * sin / d).asin();
    (cos.acos() - at_viewer).cos()
}

#[test]
fn from_inside_a_sphere_its_area_is_sampled() {
    let geometry = Geometry::build(vec![ShapeDesc::Sphere { centre: Vec3A::ONE, radius: 2.0 }]);
    let mut s = stream(70);
    for i in 0..1000 {
        let from =
            if i % 2 == 0 { Vec3A::ONE + point(&mut s) } else { geometry.sample_area(0, s.next_2d()).p };
        let (p, pdf) = geometry.sample_toward(0, from, s.next_2d()).unwrap();
        assert_eq!(pdf, 1.0 / geometry.area(0));
        assert_eq!(pdf, geometry.pdf_toward(0, from, &p));
        assert!(!geometry.occluded(&shadow_ray(from, None, p.p, Some(p.footing()))) || i % 2 == 1);
    }
}

#[test]
fn what_cannot_be_seen_of_a_sphere_has_no_density() {
    let geometry = Geometry::build(vec![ShapeDesc::Sphere { centre: Vec3A::ZERO, radius: 1.0 }]);
    let from = Vec3A::new(0.0, 0.0, 3.0);
    let mut s = stream(71);
    for _ in 0..1000 {
        let p = geometry.sample_area(0, s.next_2d());
        let pdf = geometry.pdf_toward(0, from, &p);
        let seen = f64::from(p.p.z) > 1.0 / 3.0;
        assert!((pdf > 0.0) == seen || (f64::from(p.p.z) - 1.0 / 3.0).abs() < 1e-5, "{p:?} {pdf}");
    }
}

#[test]
fn drawn_points_are_where_rays_find_them() {
    let mesh = bumpy_sphere(6, 0.2, Vec3::ZERO, 1.0);
    let geometry = Geometry::build(vec![ShapeDesc::Mesh(mesh)]);
    let mut s = stream(72);
    for _ in 0..5000 {
        let p = geometry.sample_area(0, s.next_2d());
        let outside = p.p + p.ng * 1e-3;
        let hit = geometry.intersect(&Ray::new(outside, -p.ng)).unwrap();
        assert!((hit.t - 1e-3).abs() < 1e-6 && hit.point.p.distance(p.p) < 1e-6);
        assert!(hit.point.prim == p.prim || hit.point.ng.dot(p.ng) > 0.5);
        let n: DVec3 = hit.point.ng.as_dvec3();
        assert!((n.length() - 1.0).abs() < 1e-6);
    }
}

/// A mesh that is no convex body, beside a small shape so that its primitives do not start at 0.
fn lamp() -> Geometry {
    Geometry::build(vec![
        ShapeDesc::Disc { centre: Vec3A::splat(9.0), normal: Vec3A::Z, radius: 0.1 },
        ShapeDesc::Mesh(bumpy_sphere(8, 0.1, Vec3::ZERO, 1.0)),
    ])
}

#[test]
fn triangles_that_shine_follow_their_density() {
    let geometry = lamp();
    assert!(geometry.sample_area(1, Vec2::splat(0.3)).prim > 0, "the disc is the first primitive");
    for (i, (from, both)) in [([4.0, 1.0, -2.0], false), ([1.3, -0.4, 0.9], true), ([0.1, 0.2, 0.0], false)]
        .into_iter()
        .enumerate()
    {
        let from = Vec3A::from(from);
        let mut s = stream(80 + i as u64);
        let (mut areas, mut densities) =
            (std::collections::BTreeMap::new(), std::collections::BTreeMap::new());
        let n = 200_000;
        for _ in 0..n {
            // How large each triangle is, by uniform points; what its density is there.
            let place = geometry.sample_place(1, s.next_2d());
            *areas.entry(place.prim).or_insert(0.0) += f64::from(geometry.area(1)) / f64::from(n);
            let pdf = geometry.pdf_place_toward(1, from, both, (place.p, place.ng, place.prim));
            densities.insert(place.prim, f64::from(pdf));
        }
        let sum: f64 = areas.iter().map(|(prim, area)| area * densities[prim]).sum();
        assert!((sum - 1.0).abs() < 0.01, "the density is {sum} in all from {from}");
        let mut drawn = std::collections::BTreeMap::new();
        for _ in 0..n {
            let (place, pdf) = geometry.sample_place_toward(1, from, both, s.next_2d()).expect("it is seen");
            assert_eq!(pdf, geometry.pdf_place_toward(1, from, both, (place.p, place.ng, place.prim)));
            *drawn.entry(place.prim).or_insert(0.0) += 1.0 / f64::from(n);
        }
        for (prim, share) in &drawn {
            let expected = areas[prim] * densities[prim];
            // Both sides are counts.
            let error =
                (expected * (1.0 + densities[prim] * f64::from(geometry.area(1))) / f64::from(n)).sqrt();
            assert!((share - expected).abs() < 5.0 * error + 1e-6, "{prim}: {share} {expected} from {from}");
        }
    }
}

#[test]
fn what_shines_toward_a_point_can_be_drawn_and_the_rest_is_rare() {
    let geometry = lamp();
    let mut s = stream(90);
    let (mut facing, mut all) = (0u32, 0u32);
    for _ in 0..20_000 {
        let from = 6.0 * point(&mut s).normalize_or(Vec3A::X) * (0.2 + s.next_1d());
        let place = geometry.sample_place(1, s.next_2d());
        let cosine = place.ng.dot((from - place.p).normalize());
        let pdf = |both| geometry.pdf_place_toward(1, from, both, (place.p, place.ng, place.prim));
        assert!(cosine <= 1e-5 || pdf(false) > 0.0, "{from} sees {} at a cosine of {cosine}", place.p);
        assert!(pdf(true) > 0.0 || cosine.abs() < 1e-5);
        if from.length() > 5.0 {
            let (place, _) = geometry.sample_place_toward(1, from, false, s.next_2d()).expect("it is seen");
            facing += u32::from(place.ng.dot(from - place.p) > 0.0);
            all += 1;
        }
    }
    // By area it would be a half.
    assert!(
        f64::from(facing) > 0.75 * f64::from(all),
        "{facing} of {all} points face who they are drawn for"
    );
}
