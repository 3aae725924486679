//! Rays, and how far off a surface they start.

use glam::{DVec3, Vec3A};

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
    /// What it starts on, and what it ends on where it ends: flat things, which it need not be tested against.
    pub ends: Ends,
}

/// What a ray starts on and what it ends on, each by its [`Footing::key`].
///
/// In one word: a ray is written just before it is read, and a processor that reads two numbers at once which were written one
/// by one waits until both have left its store buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ends(u64);

impl Ends {
    /// Nothing.
    pub const NONE: Self = Self(0);

    /// What has these keys.
    #[inline(always)]
    pub(crate) fn new(from: f32, to: f32) -> Self {
        Self(u64::from(from.to_bits()) | u64::from(to.to_bits()) << 32)
    }

    /// The keys of both.
    #[inline(always)]
    pub(crate) fn keys(self) -> [f32; 2] {
        [self.0 as u32, (self.0 >> 32) as u32].map(f32::from_bits)
    }
}

/// The surface that an end of a ray lies on.
#[derive(Clone, Copy, Debug)]
pub struct Footing {
    /// Unit geometric normal (either side).
    pub normal: Vec3A,
    /// The primitive, counted over all shapes; `u32::MAX` where it is not known.
    pub prim: u32,
}

impl Footing {
    /// The bits of 1.
    const ONE: u32 = 0x3f80_0000;

    /// A primitive as a positive number that no other one has, as f32 are compared four at a time; 0 for what is none.
    #[inline(always)]
    pub(crate) fn key(prim: u32) -> f32 {
        if prim < Self::ONE { f32::from_bits(Self::ONE + prim) } else { 0.0 }
    }

    /// The ray from `p` on the surface in the unit direction `dir`, started just off the surface on that side.
    #[inline]
    pub fn spawn(&self, p: Vec3A, dir: Vec3A) -> Ray {
        let ends = Ends::new(Self::key(self.prim), 0.0);
        Ray { ends, ..Ray::new(offset_origin(p, self.normal, dir), dir) }
    }
}

impl Ray {
    /// A ray without an end. `dir` is a unit vector.
    #[inline]
    pub fn new(origin: Vec3A, dir: Vec3A) -> Self {
        Self { origin, dir, t_max: f32::INFINITY, ends: Ends::NONE }
    }

    /// The point at distance `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3A {
        self.origin + self.dir * t
    }

    /// The same in f64.
    #[inline]
    pub(super) fn at_exactly(&self, t: f32) -> DVec3 {
        self.origin.as_dvec3() + self.dir.as_dvec3() * f64::from(t)
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
/// end lies. `on0`, `on1`: what the ends lie on, `None` where there is nothing that could be hit (a lens, a point light).
#[inline]
pub fn shadow_ray(p0: Vec3A, on0: Option<Footing>, p1: Vec3A, on1: Option<Footing>) -> Ray {
    shadow_ray_along([(p0, on0), (p1, on1)], (p1 - p0).length_recip())
}

/// [`shadow_ray`] where 1 over the distance between the points is at hand.
#[inline(always)]
pub fn shadow_ray_along([(p0, on0), (p1, on1)]: [(Vec3A, Option<Footing>); 2], inverse_distance: f32) -> Ray {
    /// How far the square of the moved ends' distance may be off, as part of it: Newton's step leaves 3/8 of the square of
    /// that, which is less than f32 shows.
    const NEAR: f32 = 1.0 / (1 << 13) as f32;
    let towards = p1 - p0;
    let (origin, from) = match on0 {
        Some(Footing { normal, prim }) => (offset_origin(p0, normal, towards), Footing::key(prim)),
        None => (p0, 0.0),
    };
    // The rounded direction misses the far end by up to 2⁻²³ of the distance: so much more room is needed there. The sum of
    // the coordinates is no less than the distance, and takes no square root.
    let (end, to) = match on1 {
        Some(Footing { normal, prim }) => {
            let distance = OFFSET * (p1.abs().dot(normal.abs()) + towards.abs().element_sum());
            (p1 - normal * distance.copysign(normal.dot(towards)), Footing::key(prim))
        }
        None => (p1, 0.0),
    };
    let segment = end - origin;
    let d2 = segment.length_squared();
    let ratio = d2 * inverse_distance * inverse_distance;
    let (dir, distance) = if (ratio - 1.0).abs() < NEAR {
        let inverse = inverse_distance * (1.5 - 0.5 * ratio);
        (segment * inverse, d2 * inverse)
    } else {
        unit(segment)
    };
    Ray { origin, dir, t_max: distance * (1.0 - 2.0 * OFFSET), ends: Ends::new(from, to) }
}

/// Unit direction and length; of nothing any direction.
#[cold]
#[inline(never)]
fn unit(segment: Vec3A) -> (Vec3A, f32) {
    let distance = segment.length();
    if distance > 0.0 { (segment / distance, distance) } else { (Vec3A::Z, 0.0) }
}
