//! Spheres with nothing in them: a ray that starts in one can meet the sphere first and nothing else, so that the tree need not
//! be asked. A flight in a ball of milk is over long before its rim, mostly.

use super::quadric::Sphere;
use super::{Aabb, Geometry, Hit, Ray, ShapeDesc};
use glam::Vec3A;

/// What of a sphere another wall must not come into, as part of its radius: a ball on a floor touches it. There, on a spot of a
/// thousandth of the radius, rounding says what is met first, and it is right that it be the sphere.
const INNER: f32 = 1.0 - 1e-6;

/// How much larger than it a sphere about it must be, relatively.
const LARGER: f32 = 1.0 + 1e-4;

impl Geometry {
    /// Whether a shape is a sphere, a wall, in which there is no other wall.
    pub fn is_hollow(&self, shape: u32) -> bool {
        let own = &self.shapes[shape as usize];
        let ShapeDesc::Sphere { centre, radius } = own.desc else { return false };
        let reach = INNER * radius;
        let is_clear = |bounds: Aabb| (bounds.nearest(centre) - centre).length() > reach;
        let others =
            self.shapes.iter().enumerate().filter(|(id, other)| *id as u32 != shape && !other.is_boundary);
        !own.is_boundary
            && others.map(|(_, other)| &other.desc).all(|other| {
                is_clear(other.bounds())
                    || match other {
                        ShapeDesc::Sphere { centre: c, radius: r } => {
                            *r > LARGER * radius && (*c - centre).length() + reach < *r
                        }
                        ShapeDesc::Disc { .. } => false,
                        ShapeDesc::Mesh(mesh) => (0..mesh.indices().len())
                            .all(|i| is_clear(Aabb::of(mesh.corners(i).map(Vec3A::from)))),
                    }
            })
    }

    /// [`Self::intersect`] for a ray that starts inside of `shape`, which [`Self::is_hollow`]: the same to the bit.
    #[inline(never)]
    pub fn intersect_within(&self, shape: u32, ray: &Ray) -> Option<Hit> {
        let own = &self.shapes[shape as usize];
        let ShapeDesc::Sphere { centre, radius } = own.desc else { return self.intersect(ray) };
        let sphere = Sphere { centre, radius };
        if sphere.holds_all_of(ray) {
            return None;
        }
        let line = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        if !sphere.holds(line.0) {
            return self.intersect(ray);
        }
        let t = sphere.hit(line, f64::from(ray.t_max))? as f32;
        Some(Hit { t, point: sphere.point_at(ray, t, shape, own.first) })
    }
}

#[cfg(test)]
mod tests {
    use super::super::TriangleMesh;
    use super::super::tests::{direction, point, stream};
    use super::*;
    use glam::Affine3A;

    const BALL: ShapeDesc = ShapeDesc::Sphere { centre: Vec3A::new(1.0, 2.0, 3.0), radius: 0.5 };

    fn cube(centre: Vec3A, half: f32) -> ShapeDesc {
        let place = Affine3A::from_scale_rotation_translation(
            glam::Vec3::splat(half),
            glam::Quat::IDENTITY,
            centre.into(),
        );
        ShapeDesc::Mesh(TriangleMesh::cube().transformed(&place).unwrap())
    }

    fn ball(away: f32, radius: f32) -> ShapeDesc {
        ShapeDesc::Sphere { centre: Vec3A::new(1.0 + away, 2.0, 3.0), radius }
    }

    #[test]
    fn hollow_is_what_has_nothing_in_it() {
        let is_hollow = |other: ShapeDesc, is_boundary| {
            Geometry::build_with(vec![(BALL, false), (other, is_boundary)]).is_hollow(0)
        };
        let centre = Vec3A::new(1.0, 2.0, 3.0);
        let half = |mesh: &ShapeDesc| mesh.bounds().size().x / 2.0;
        let unit = half(&cube(centre, 1.0));
        // About it, beside it, in it, through it, and through it by a hundredth.
        assert!(is_hollow(cube(centre, 0.6 / unit), false));
        assert!(is_hollow(cube(centre + 2.0 * Vec3A::X, 1.4 / unit), false));
        assert!(!is_hollow(cube(centre, 0.1 / unit), false));
        assert!(is_hollow(cube(centre, 0.1 / unit), true), "a boundary is no wall");
        assert!(!is_hollow(cube(centre + 0.5 * Vec3A::X, 0.1 / unit), false));
        assert!(!is_hollow(cube(centre + 1.0 * Vec3A::X, 0.51 / unit), false));
        assert!(is_hollow(cube(centre + 1.0 * Vec3A::X, 0.5 / unit), false), "a touch");
        assert!(is_hollow(ball(0.0, 0.6), false) && is_hollow(ball(0.3, 0.81), false));
        assert!(!is_hollow(ball(0.0, 0.4), false) && !is_hollow(ball(0.3, 0.79), false));
        assert!(!is_hollow(ball(0.0, 0.5), false), "the same twice");
        assert!(is_hollow(ball(1.0, 0.5), false) && !is_hollow(ball(1.0, 0.51), false));
        let disc =
            |away: f32| ShapeDesc::Disc { centre: centre + away * Vec3A::Y, normal: Vec3A::Y, radius: 9.0 };
        assert!(is_hollow(disc(0.6), false) && !is_hollow(disc(0.4), false));
        assert!(!Geometry::build_with(vec![(BALL, true)]).is_hollow(0), "a boundary");
        assert!(!Geometry::build(vec![disc(0.0)]).is_hollow(0) && Geometry::build(vec![BALL]).is_hollow(0));
    }

    /// From inside, from the surface, by some roundings to either side of it, and from outside.
    #[test]
    fn a_ray_meets_what_the_tree_says() {
        let mut s = stream(90);
        let (mut left, mut stayed, mut outside) = (0, 0, 0);
        for scale in [1e-3f32, 1.0, 1e3] {
            let centre = Vec3A::new(1.0, 2.0, 3.0) * scale;
            let sphere = ShapeDesc::Sphere { centre, radius: 0.5 * scale };
            let geometry = Geometry::build(vec![cube(centre, scale), sphere]);
            assert!(geometry.is_hollow(1));
            for i in 0..20_000 {
                let rim = direction(&mut s);
                let distance = match i % 4 {
                    0 => 1.0,
                    1 => 1.0 + 3e-7 * (s.next_1d() - 0.5),
                    2 => 1.1,
                    _ => s.next_1d(),
                };
                let origin = centre + rim * (0.5 * scale * distance);
                let t_max = if i % 3 == 0 { f32::INFINITY } else { scale * 10f32.powf(-3.0 * s.next_1d()) };
                let ray = Ray { t_max, ..Ray::new(origin, (point(&mut s) - 0.3 * rim).normalize()) };
                let (found, expected) = (geometry.intersect_within(1, &ray), geometry.intersect(&ray));
                assert_eq!(format!("{found:?}"), format!("{expected:?}"), "{ray:?}");
                match expected {
                    _ if distance > 1.0 => outside += 1,
                    Some(_) => left += 1,
                    None => stayed += 1,
                }
            }
        }
        assert!(left > 5_000 && stayed > 5_000 && outside > 5_000, "{left}, {stayed}, {outside}");
    }
}
