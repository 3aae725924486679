//! Rays, and how far off a surface they start.

use glam::Vec3A;

/// Part of a coordinate by which the origin of a ray is moved off a surface.
///
/// Points on surfaces are computed in f64 and rounded once, so one lies within 2⁻²⁴ Σ |pᵢ nᵢ| of its surface; the
/// moved point is rounded again, by as much. 2⁻²² is twice their sum. See [`offset_origin`].
const OFFSET: f32 = 1.0 / (1 << 22) as f32;

/// A half-line, or a segment: origin + t·dir for 0 < t < t_max.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3A,
    /// Unit direction.
    pub dir: Vec3A,
    /// Hits at this distance or further do not count (metres).
    pub t_max: f32,
}

impl Ray {
    /// A ray without an end. `dir` is a unit vector.
    #[inline]
    pub fn new(origin: Vec3A, dir: Vec3A) -> Self {
        Self { origin, dir, t_max: f32::INFINITY }
    }

    /// The point at distance `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3A {
        self.origin + self.dir * t
    }
}

/// `p`, a point on a surface with unit normal `n` (either side), moved off the surface to the side of `dir`.
///
/// The distance is a bound on the rounding of `p` and of the result, so the result is truly on that side; it is a few
/// ulps of the coordinates, so it does not cross a wall that f32 can tell from nothing. It needs no knowledge of the
/// primitive's size, since the intersection tests decide hits close to the origin in f64.
#[inline(always)]
pub fn offset_origin(p: Vec3A, n: Vec3A, dir: Vec3A) -> Vec3A {
    let distance = OFFSET * p.abs().dot(n.abs());
    p + n * distance.copysign(n.dot(dir))
}

/// The segment between two points, for visibility: each end is moved off its surface, to the side on which the other
/// end lies. `n0`, `n1`: unit geometric normals (either side) where the ends lie on surfaces, `None` where there is
/// nothing that could be hit (a lens, a point light).
#[inline(always)]
pub fn shadow_ray(p0: Vec3A, n0: Option<Vec3A>, p1: Vec3A, n1: Option<Vec3A>) -> Ray {
    let towards = p1 - p0;
    let origin = match n0 {
        Some(n) => offset_origin(p0, n, towards),
        None => p0,
    };
    // The rounded direction misses the far end by up to 2⁻²³ of the distance: so much more room is needed there. The sum of
    // the coordinates is no less than the distance, and takes no square root.
    let end = match n1 {
        Some(n) => {
            let distance = OFFSET * (p1.abs().dot(n.abs()) + towards.abs().element_sum());
            p1 - n * distance.copysign(n.dot(towards))
        }
        None => p1,
    };
    let segment = end - origin;
    let distance = segment.length();
    if distance > 0.0 {
        Ray { origin, dir: segment / distance, t_max: distance * (1.0 - 2.0 * OFFSET) }
    } else {
        Ray { origin, dir: Vec3A::Z, t_max: 0.0 }
    }
}
