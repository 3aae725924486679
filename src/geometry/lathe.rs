//! Solids of revolution: glasses, bottles, candles.

use super::mesh::TriangleMesh;
use glam::{Vec2, Vec3};

/// A stretch of the profile between two neighbouring points.
struct Segment {
    /// Its points.
    ends: [Vec2; 2],
    /// Unit normal on the right.
    normal: Vec2,
    length: f32,
    /// Shading normals at its ends.
    shading: [Vec2; 2],
    /// Arc length of the profile at its ends, as part of the whole.
    along: [f32; 2],
}

impl TriangleMesh {
    /// The surface that `profile` sweeps about the y axis: points (radius, height) in metres, in `segments` flat
    /// steps around.
    ///
    /// The outside is on the right of the profile's way: a profile that goes up has it away from the axis. A solid
    /// starts and ends on the axis (radius 0), or ends where it started. Shading is smooth around the axis, and along
    /// the profile except where it turns by more than `crease` degrees (40 is a good choice) and where a point is
    /// given twice. `crease` `None`: no shading normals, flat facets. Texture coordinates: u around from +x by −z,
    /// v along the profile by length.
    ///
    /// # Errors
    /// A message where there are fewer than two points or three segments, a radius is negative, a number is not
    /// finite, or the profile lies on the axis.
    pub fn lathe(profile: &[Vec2], segments: u32, crease: Option<f32>) -> Result<Self, String> {
        if let Some(i) = profile.iter().position(|p| !p.is_finite() || p.x < 0.0) {
            return Err(format!(
                "point {i} of the profile is {}: a radius from 0 up, and a height",
                profile[i]
            ));
        }
        if segments < 3 {
            return Err(format!("a lathe of {segments} segments; it needs three"));
        }
        if segments > 1 << 20 {
            return Err(format!("a lathe of {segments} segments; at most {} make sense", 1 << 20));
        }
        let mut stretches = stretches(profile);
        if stretches.is_empty() {
            return Err("the profile needs two different points".into());
        }
        if let Some(crease) = crease {
            smooth(&mut stretches, profile, crease);
        }
        revolve(&stretches, segments, crease.is_some())
    }
}

/// The stretches of a profile, with flat shading.
fn stretches(profile: &[Vec2]) -> Vec<Segment> {
    let total: f32 = profile.windows(2).map(|w| w[0].distance(w[1])).sum();
    let mut arc = 0.0;
    let mut stretches = Vec::with_capacity(profile.len());
    for ends in profile.windows(2).map(|w| [w[0], w[1]]) {
        let length = ends[0].distance(ends[1]);
        if length > 0.0 {
            let normal = -(ends[1] - ends[0]).perp() / length;
            let along = [arc / total, (arc + length) / total];
            stretches.push(Segment { ends, normal, length, shading: [normal; 2], along });
            arc += length;
        }
    }
    stretches
}

/// Share normals where the profile turns by less than `crease` degrees.
fn smooth(stretches: &mut [Segment], profile: &[Vec2], crease: f32) {
    let limit = crease.to_radians().cos();
    let repeated = |p: Vec2| profile.windows(2).any(|w| w[0] == p && w[1] == p);
    let count = stretches.len();
    let closed = stretches[0].ends[0] == stretches[count - 1].ends[1];
    for i in 0..count {
        let next = if i + 1 < count { i + 1 } else { 0 };
        let corner = stretches[i].ends[1];
        if (i + 1 < count || closed) && !repeated(corner) {
            let (a, b) = (&stretches[i], &stretches[next]);
            if a.normal.dot(b.normal) >= limit {
                // A circle through three points has this normal in the middle one, to first order.
                let shared = (a.normal * b.length + b.normal * a.length).normalize_or(a.normal);
                stretches[i].shading[1] = shared;
                stretches[next].shading[0] = shared;
            }
        }
        // On the axis the profile meets its mirror image.
        for end in 0..2 {
            meet_axis(&mut stretches[i], end, limit, &repeated);
        }
    }
}

/// At an end on the axis: the axis as shading normal, where the tip is blunt enough.
fn meet_axis(s: &mut Segment, end: usize, limit: f32, repeated: &dyn Fn(Vec2) -> bool) {
    let mirrored = Vec2::new(-s.normal.x, s.normal.y);
    if s.ends[end].x == 0.0 && s.normal.dot(mirrored) >= limit && !repeated(s.ends[end]) {
        s.shading[end] = Vec2::new(0.0, s.normal.y.signum());
    }
}

/// Sweep the stretches around.
fn revolve(stretches: &[Segment], around: u32, smooth: bool) -> Result<TriangleMesh, String> {
    let count = stretches.len() * 2 * (around as usize + 1);
    if count > u32::MAX as usize {
        return Err(format!("a lathe of {count} vertices is too large"));
    }
    let (mut positions, mut normals) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let (mut uvs, mut indices) = (Vec::with_capacity(count), Vec::with_capacity(count));
    // The last column repeats the first to the bit, so that the surface closes.
    let columns: Vec<Vec2> = (0..=around)
        .map(|j| {
            let turn = f64::from(j % around) / f64::from(around) * std::f64::consts::TAU;
            Vec2::new(turn.cos() as f32, -turn.sin() as f32)
        })
        .collect();
    for s in stretches {
        let first = positions.len() as u32;
        for end in 0..2 {
            for (j, column) in columns.iter().enumerate() {
                let sweep = |p: Vec2| Vec3::new(p.x * column.x, p.y, p.x * column.y);
                // Adding zero: the pole is at one place, not at 0 and −0.
                positions.push(sweep(s.ends[end]) + Vec3::ZERO);
                normals.push(sweep(s.shading[end]));
                uvs.push(Vec2::new(j as f32 / around as f32, s.along[end]));
            }
        }
        for j in first..first + around {
            let (low, high) = (j, j + around + 1);
            if s.ends[0].x > 0.0 {
                indices.push([low, low + 1, high + 1]);
            }
            if s.ends[1].x > 0.0 {
                indices.push([low, high + 1, high]);
            }
        }
    }
    if indices.is_empty() {
        return Err("the profile lies on the axis".into());
    }
    TriangleMesh::new(positions, smooth.then_some(normals), Some(uvs), indices)
}

#[cfg(test)]
mod tests {
    use super::super::{Geometry, Ray, ShapeDesc, ShapeStats};
    use super::*;
    use glam::Vec3A;
    use std::f64::consts::PI;

    /// Of a polygon of `n` corners inscribed in the unit circle, as part of π.
    fn polygon(n: u32) -> f64 {
        let n = f64::from(n);
        n * (2.0 * PI / n).sin() / (2.0 * PI)
    }

    #[test]
    fn a_cylinder_is_closed_and_has_its_volume() {
        let profile = [Vec2::ZERO, Vec2::new(2.0, 0.0), Vec2::new(2.0, 3.0), Vec2::new(0.0, 3.0)];
        for (segments, crease) in [(64, Some(40.0)), (7, None), (256, Some(180.0))] {
            let mesh = TriangleMesh::lathe(&profile, segments, crease).unwrap();
            let stats = ShapeStats::of(&ShapeDesc::Mesh(mesh));
            let expected = PI * 12.0 * polygon(segments);
            assert!(stats.closed, "{segments}");
            assert!((stats.volume.unwrap() / expected - 1.0).abs() < 1e-6, "{:?} {expected}", stats.volume);
            assert_eq!(stats.primitives, 4 * segments as usize);
        }
    }

    #[test]
    fn a_ring_is_closed_and_has_the_volume_of_guldin() {
        let circle: Vec<Vec2> = (0..=60)
            .map(|i| Vec2::X * 3.0 + Vec2::from_angle((i % 60) as f32 / 60.0 * std::f32::consts::TAU))
            .collect();
        let mesh = TriangleMesh::lathe(&circle, 90, Some(40.0)).unwrap();
        let stats = ShapeStats::of(&ShapeDesc::Mesh(mesh.clone()));
        let expected = 2.0 * PI * PI * 3.0 * polygon(60) * polygon(90);
        assert!(stats.closed && (stats.volume.unwrap() / expected - 1.0).abs() < 1e-3, "{:?}", stats.volume);
        // Smooth everywhere: shading normals are those of the true ring.
        for (p, n) in mesh.positions().iter().zip(mesh.normals().unwrap()) {
            let middle = Vec3::new(p.x, 0.0, p.z).normalize() * 3.0;
            assert!((*p - middle).normalize().distance(*n) < 1e-5, "{p} {n}");
        }
    }

    #[test]
    fn corners_stay_sharp_and_curves_smooth() {
        let arc =
            |i: i32| Vec2::from_angle((i - 10) as f32 / 20.0 * std::f32::consts::PI) * Vec2::new(1.0, 1.0);
        let mut ball: Vec<Vec2> = (0..=20).map(arc).collect();
        (ball[0].x, ball[20].x) = (0.0, 0.0);
        let mesh = TriangleMesh::lathe(&ball, 40, Some(40.0)).unwrap();
        for (p, n) in mesh.positions().iter().zip(mesh.normals().unwrap()) {
            assert!(p.distance(*n) < 1e-5, "a ball's normal is its point: {p} {n}");
        }
        let cylinder = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        let mesh = TriangleMesh::lathe(&cylinder, 16, Some(40.0)).unwrap();
        let flat = |n: &Vec3| n.y.abs() > 0.999_999 || n.y.abs() < 1e-6;
        assert!(mesh.normals().unwrap().iter().all(flat), "no normal is in between at right angles");
        let cut = [ball[8], ball[9], ball[10], ball[10], ball[11], ball[12]];
        let mesh = TriangleMesh::lathe(&cut, 16, Some(40.0)).unwrap();
        let at_cut = |p: &Vec3| p.y == ball[10].y;
        let sharp = mesh.positions().iter().zip(mesh.normals().unwrap()).filter(|(p, _)| at_cut(p));
        assert!(sharp.into_iter().all(|(p, n)| p.distance(*n) > 0.05), "a point given twice is a corner");
    }

    #[test]
    fn the_outside_is_on_the_right() {
        let up = [Vec2::X, Vec2::ONE];
        let down = [Vec2::ONE, Vec2::X];
        for (profile, sign) in [(up, 1.0), (down, -1.0)] {
            let mesh = TriangleMesh::lathe(&profile, 12, Some(40.0)).unwrap();
            let geometry = Geometry::build(vec![ShapeDesc::Mesh(mesh)]);
            for i in 0..50 {
                let (sin, cos) = (i as f32).sin_cos();
                let out = Vec3A::new(cos, 0.0, sin);
                let hit = geometry.intersect(&Ray::new(out * 5.0 + Vec3A::Y * 0.3, -out)).unwrap();
                assert!(hit.point.ng.dot(out) * sign > 0.9 && hit.point.ns.dot(out) * sign > 0.99999);
                assert!((hit.point.uv.y - if sign > 0.0 { 0.3 } else { 0.7 }).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn nonsense_is_refused() {
        let ok = [Vec2::X, Vec2::ONE];
        assert!(TriangleMesh::lathe(&ok[..1], 12, None).unwrap_err().contains("two different points"));
        assert!(TriangleMesh::lathe(&[Vec2::X; 3], 12, None).is_err());
        assert!(TriangleMesh::lathe(&ok, 2, None).unwrap_err().contains("three"));
        assert!(TriangleMesh::lathe(&ok, u32::MAX, None).is_err());
        assert!(TriangleMesh::lathe(&[Vec2::ZERO, Vec2::Y], 12, None).unwrap_err().contains("axis"));
        assert!(TriangleMesh::lathe(&[Vec2::NEG_X, Vec2::Y], 12, None).unwrap_err().contains("point 0"));
        assert!(TriangleMesh::lathe(&[Vec2::X, Vec2::NAN], 12, None).unwrap_err().contains("point 1"));
    }
}
