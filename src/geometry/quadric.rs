//! Spheres and discs: intersection, points on them, sampling.
//!
//! There are few of them in a scene, so all is done in f64: no root is lost to cancellation, however small and far
//! away the sphere is.

use super::SurfacePoint;
use super::lanes::{Lanes, dot, eight, eight::Eight, in_lanes};
use super::ray::Ray;
use crate::math::{Frame, trig, warp};
use glam::{DVec3, Vec2, Vec3A};
use std::f32::consts::FRAC_1_PI;

/// What is taken for zero beside one in f64, a hundred roundings.
const TINY: f64 = 2e-14;

/// The angle of (x, y) from the x axis in whole turns, in [−½, ½]; wrong by no more than 10⁻⁷. Texture coordinates need
/// no more, and the library's arctangent takes several times as long.
#[inline]
fn turns(y: f32, x: f32) -> f32 {
    // arctan(r) / r as a polynomial in r², interpolated at Chebyshev's nodes over [0, 1].
    const SERIES: [f32; 8] = [
        0.999_999_9,
        -0.333_318_13,
        0.199_669_62,
        -0.140_032_9,
        0.098_688_655,
        -0.058_829_753,
        0.023_780_52,
        -0.004_559_792,
    ];
    let (long, short) = (x.abs().max(y.abs()), x.abs().min(y.abs()));
    let r = if long > 0.0 { short / long } else { 0.0 };
    let first = 0.5 * FRAC_1_PI * r * SERIES.iter().rev().fold(0.0, |sum, c| sum * (r * r) + c);
    let right = if y.abs() > x.abs() { 0.25 - first } else { first };
    (if x < 0.0 { 0.5 - right } else { right }).copysign(y)
}

/// A sphere in world space, outside outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre (metres).
    pub centre: Vec3A,
    /// Radius (metres), positive.
    pub radius: f32,
}

/// A flat disc in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Centre (metres).
    pub centre: Vec3A,
    /// Unit normal, towards the outside.
    pub normal: Vec3A,
    /// Radius (metres), positive.
    pub radius: f32,
}

/// Spheres side by side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spheres<L> {
    centre: [L; 3],
    /// A bit more than the radius, and than its square.
    reach: L,
    reach2: L,
    used: u32,
}

impl Spheres<Eight> {
    /// How many [`Self::of`] takes.
    pub(super) const AT_ONCE: usize = 8;

    /// Of some, each with what it is kept with.
    pub(super) fn of<T>(spheres: &[(Sphere, T)]) -> Self {
        let each = |f: &dyn Fn(&Sphere) -> f32| {
            let [low, high] = [0, 4]
                .map(|first| std::array::from_fn(|i| spheres.get(first + i).map_or(0.0, |(s, _)| f(s))));
            eight::of(low, high)
        };
        Self {
            centre: [0, 1, 2].map(|k| each(&|s| s.centre[k])),
            reach: each(&|s| 1.001 * s.radius),
            reach2: each(&|s| 1.001 * s.radius * s.radius),
            used: (1 << spheres.len()) - 1,
        }
    }
}

impl<L: Lanes> Spheres<L> {
    /// Those of which [`Sphere::is_missed`] does not hold, a bit for each.
    #[inline(always)]
    pub(super) fn met(&self, ray: &Ray, t_max: f32) -> u32 {
        let (origin, dir) = (in_lanes(ray.origin), in_lanes(ray.dir));
        let [x, y, z] = &self.centre;
        let to_centre = [*x - origin[0], *y - origin[1], *z - origin[2]];
        let (along, distance2) = (dot(&to_centre, &dir), dot(&to_centre, &to_centre));
        let reach2 = self.reach2 + L::splat(2f32.powi(-19)) * distance2;
        let missed = reach2.below(distance2 - along * along)
            | (along.below(L::splat(0.0)) & reach2.below(distance2))
            | (L::splat(t_max) + self.reach).below(L::splat(0.999) * along);
        self.used & !L::bits(missed)
    }
}

impl Sphere {
    /// Whether f32 is enough to say that a ray, up to `t_max`, does not meet the sphere.
    #[inline(always)]
    pub(super) fn is_missed(&self, ray: &Ray, t_max: f32) -> bool {
        let to_centre = self.centre - ray.origin;
        let along = to_centre.dot(ray.dir);
        let distance2 = to_centre.length_squared();
        // Both squares, and the length of `dir` as 1, are wrong by some 2⁻²¹ of the centre's distance squared.
        let reach2 = 1.001 * self.radius * self.radius + 2f32.powi(-19) * distance2;
        distance2 - along * along > reach2
            || (along < 0.0 && distance2 > reach2)
            || 0.999 * along > t_max + 1.001 * self.radius
    }

    /// Whether f32 is enough to say that a ray ends before it could come out of the sphere.
    #[inline]
    pub(super) fn holds_all_of(&self, ray: &Ray) -> bool {
        // The distance from the centre is wrong by some 2⁻²¹ of the radius where this can be true.
        let room = 0.999 * self.radius - ray.t_max;
        room > 0.0 && (self.centre - ray.origin).length_squared() < room * room
    }

    /// Whether a point is in it, and not on it as [`Self::hit`] has it.
    #[inline]
    pub(super) fn holds(&self, p: DVec3) -> bool {
        let radius2 = f64::from(self.radius).powi(2);
        (p - self.centre.as_dvec3()).length_squared() - radius2 < -TINY * radius2
    }

    /// The nearest distance in (0, `t_max`) at which a ray meets the sphere.
    #[inline]
    pub(super) fn hit(&self, (origin, dir): (DVec3, DVec3), t_max: f64) -> Option<f64> {
        let radius2 = f64::from(self.radius).powi(2);
        let from_centre = origin - self.centre.as_dvec3();
        let a = dir.length_squared();
        let half_b = from_centre.dot(dir);
        let mut c = from_centre.length_squared() - radius2;
        // An origin that lies on the sphere to the last bit is on it: its own root is not a hit.
        if c.abs() <= TINY * radius2 {
            c = 0.0;
        }
        // The discriminant from the distance of the line to the centre: no cancellation for small spheres far away
        // [Haines et al. 2019].
        let discriminant = radius2 - (from_centre - dir * (half_b / a)).length_squared();
        if discriminant < 0.0 {
            return None;
        }
        let q = -(half_b + (a * discriminant).sqrt().copysign(half_b));
        let (t0, t1) = if q == 0.0 { (0.0, 0.0) } else { (c / q, q / a) };
        let (near, far) = if t0 < t1 { (t0, t1) } else { (t1, t0) };
        if near > 0.0 && near < t_max {
            return Some(near);
        }
        (near <= 0.0 && far > 0.0 && far < t_max).then_some(far)
    }

    /// Position and unit normal in the direction `n` from the centre (any length but 0).
    #[inline(always)]
    pub(super) fn place(&self, n: DVec3) -> (Vec3A, Vec3A) {
        let n = n.normalize();
        ((self.centre.as_dvec3() + n * f64::from(self.radius)).as_vec3a(), n.as_vec3a())
    }

    /// The point that a ray meets at the distance `t`.
    #[inline(always)]
    pub(super) fn point_at(&self, ray: &Ray, t: f32, shape: u32, prim: u32) -> SurfacePoint {
        self.point(ray.at_exactly(t) - self.centre.as_dvec3(), shape, prim)
    }

    /// The point of the sphere in the direction `n` from its centre (any length but 0).
    #[inline(always)]
    pub(super) fn point(&self, n: DVec3, shape: u32, prim: u32) -> SurfacePoint {
        let (p, ng) = self.place(n);
        let turn = turns(ng.z, ng.x);
        let uv = Vec2::new(
            if turn < 0.0 { turn + 1.0 } else { turn },
            2.0 * turns((ng.x * ng.x + ng.z * ng.z).sqrt(), ng.y),
        );
        SurfacePoint { p, ng, ns: ng, uv, shape, prim }
    }

    /// Area in m².
    pub(super) fn area(&self) -> f64 {
        4.0 * std::f64::consts::PI * f64::from(self.radius).powi(2)
    }

    /// Sine squared and 1 − cosine of half the angle that the sphere fills seen from a point; `None` from inside.
    #[inline]
    fn cone(&self, from: Vec3A) -> Option<(f64, f64)> {
        let distance2 = (from.as_dvec3() - self.centre.as_dvec3()).length_squared();
        let sin2 = f64::from(self.radius).powi(2) / distance2;
        // Points on the sphere are rounded to either side of it; there the cone is half of all directions.
        (sin2 < 1.0 - 1e-6).then(|| (sin2, sin2 / (1.0 + (1.0 - sin2).sqrt())))
    }

    /// The direction from the centre to a point uniform in the cone of directions in which `from` sees the sphere;
    /// `None` from inside.
    #[inline]
    pub(super) fn sample_cone(&self, from: Vec3A, u: Vec2) -> Option<DVec3> {
        let (sin2_max, one_minus_cos_max) = self.cone(from)?;
        let to_viewer = (from.as_dvec3() - self.centre.as_dvec3()).normalize();
        let h = f64::from(u.x) * one_minus_cos_max;
        let (sin2, cos) = (h * (2.0 - h), 1.0 - h);
        // The angle at the centre between the viewer and the point, from the sine rule.
        let cos_at_centre = sin2 / sin2_max.sqrt() + cos * (1.0 - (sin2 / sin2_max).min(1.0)).sqrt();
        let sin_at_centre = (1.0 - cos_at_centre * cos_at_centre).max(0.0).sqrt();
        let frame = Frame::from_normal(to_viewer.as_vec3a());
        let (sin_phi, cos_phi) = trig::sin_cos_turns(u.y);
        let across = (frame.s * cos_phi + frame.t * sin_phi).as_dvec3();
        Some(to_viewer * cos_at_centre + across * sin_at_centre)
    }

    /// Density per area with which [`Self::sample_cone`] gives the position `p` with the normal `ng`; `None` from inside.
    #[inline]
    pub(super) fn pdf_cone(&self, from: Vec3A, (p, ng): (Vec3A, Vec3A)) -> Option<f32> {
        let (_, one_minus_cos_max) = self.cone(from)?;
        let to_viewer = from.as_dvec3() - p.as_dvec3();
        let distance2 = to_viewer.length_squared();
        let cos = ng.as_dvec3().dot(to_viewer) / distance2.sqrt();
        let per_solid_angle = 1.0 / (2.0 * std::f64::consts::PI * one_minus_cos_max);
        Some((per_solid_angle * cos.max(0.0) / distance2) as f32)
    }

    /// The direction from the centre to a point uniform over the area.
    #[inline]
    pub(super) fn sample_area(&self, u: Vec2) -> DVec3 {
        warp::uniform_sphere(u).as_dvec3()
    }
}

impl Disc {
    /// The distance in (0, `t_max`) at which a ray meets the disc.
    #[inline]
    pub(super) fn hit(&self, (origin, dir): (DVec3, DVec3), t_max: f64) -> Option<f64> {
        let n = self.normal.as_dvec3();
        let to_centre = self.centre.as_dvec3() - origin;
        let height = to_centre.dot(n);
        // An origin in the plane to the last bit does not hit it.
        if height.abs() <= TINY * to_centre.abs().dot(n.abs()) {
            return None;
        }
        let t = height / dir.dot(n);
        let inside = (dir * t - to_centre).length_squared() <= f64::from(self.radius).powi(2);
        (t > 0.0 && t < t_max && inside).then_some(t)
    }

    /// The vector from the centre to the point of the disc's plane nearest to `p`.
    #[inline]
    fn in_plane(&self, p: DVec3) -> DVec3 {
        let n = self.normal.as_dvec3();
        let from_centre = p - self.centre.as_dvec3();
        from_centre - n * (from_centre.dot(n) / n.length_squared())
    }

    /// Position and unit normal of the point of the disc's plane nearest to `p`.
    #[inline]
    pub(super) fn place(&self, p: DVec3) -> (Vec3A, Vec3A) {
        ((self.centre.as_dvec3() + self.in_plane(p)).as_vec3a(), self.normal)
    }

    /// The point of the disc's plane nearest to `p`.
    #[inline]
    pub(super) fn point(&self, p: DVec3, shape: u32, prim: u32) -> SurfacePoint {
        let in_plane = self.in_plane(p);
        let local = Frame::from_normal(self.normal).to_local((in_plane / f64::from(self.radius)).as_vec3a());
        SurfacePoint {
            p: (self.centre.as_dvec3() + in_plane).as_vec3a(),
            ng: self.normal,
            ns: self.normal,
            uv: Vec2::splat(0.5) + 0.5 * Vec2::new(local.x, local.y),
            shape,
            prim,
        }
    }

    /// Area in m².
    pub(super) fn area(&self) -> f64 {
        std::f64::consts::PI * f64::from(self.radius).powi(2)
    }

    /// A position uniform over the area, up to the rounding of f32.
    #[inline]
    pub(super) fn sample_area(&self, u: Vec2) -> DVec3 {
        let d = warp::concentric_disc(u) * self.radius;
        let frame = Frame::from_normal(self.normal);
        self.centre.as_dvec3() + (frame.s * d.x).as_dvec3() + (frame.t * d.y).as_dvec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_arctangents() {
        for i in 0..20_000 {
            let angle = (f64::from(i) - 10_000.0) / 10_000.0 * std::f64::consts::PI;
            let (x, y) = (3.0 * angle.cos() as f32, 3.0 * angle.sin() as f32);
            let expected = f64::from(y).atan2(f64::from(x)) / std::f64::consts::TAU;
            assert!((f64::from(turns(y, x)) - expected).abs() < 1e-7, "{angle}: {} {expected}", turns(y, x));
        }
        assert_eq!([turns(0.0, 0.0), turns(0.0, 2.0), turns(0.0, -2.0)], [0.0, 0.0, 0.5]);
        assert_eq!([turns(2.0, 0.0), turns(-2.0, 0.0)], [0.25, -0.25]);
    }
}
