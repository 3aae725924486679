//! Up to four triangles against a ray at once, watertight [Woop, Benthin, Wald 2013].
//!
//! The corners are sheared into a frame in which the ray is the z axis; each corner is rounded there by itself, so all
//! triangles that share it agree where it is. Three edge functions then decide exactly (f32 gives the right sign or
//! zero, and zeros are decided in f64) whether the ray passes inside. A ray through an edge of a closed mesh so hits
//! one of its two triangles at least.

use super::mesh::cross;
use super::ray::Ray;
use glam::{BVec4A, DVec3, Vec2, Vec3, Vec4};

/// Triangles in a block.
pub(super) const LANES: usize = 4;

/// Up to four triangles, 288 bytes: for each axis, the three corners' coordinates. Unused lanes are NaN and never hit.
#[derive(Clone, Debug)]
#[repr(C)]
pub(super) struct Block {
    axis: [[Vec4; 3]; 3],
    /// Primitives, counted over all shapes.
    pub prim: [u32; LANES],
    plane: [Plane; LANES],
}

/// The plane of a triangle: n·p = d, with n of unit length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    n: DVec3,
    d: f64,
}

/// What of a ray a block's test needs.
pub(super) struct Shear {
    /// Axes x, y, z of the sheared frame; z is the one along which the ray is longest.
    axes: [usize; 3],
    origin: [Vec4; 3],
    /// Shear of x and of y.
    shear: [Vec4; 2],
}

/// The corners in the sheared frame.
struct Sheared {
    x: [Vec4; 3],
    y: [Vec4; 3],
}

impl Shear {
    #[inline]
    pub(super) fn new(ray: &Ray) -> Self {
        let dir = ray.dir.to_array();
        let origin = ray.origin.to_array();
        let size = ray.dir.abs();
        let kz = if size.x > size.y && size.x > size.z {
            0
        } else if size.y > size.z {
            1
        } else {
            2
        };
        // Which of the two other axes is x does not matter: both signs of the edge functions are accepted.
        let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][kz];
        let scale = 1.0 / dir[kz];
        Self {
            axes,
            origin: axes.map(|a| Vec4::splat(origin[a])),
            shear: [dir[axes[0]] * scale, dir[axes[1]] * scale].map(Vec4::splat),
        }
    }
}

impl Block {
    /// From one to four triangles with their primitive indices.
    pub(super) fn new(triangles: &[([Vec3; 3], u32)]) -> Self {
        let mut axis = [[Vec4::NAN; 3]; 3];
        let mut prim = [u32::MAX; LANES];
        let mut plane = [Plane::NOWHERE; LANES];
        for (lane, (corners, p)) in triangles.iter().enumerate() {
            for (a, rows) in axis.iter_mut().enumerate() {
                for (row, corner) in rows.iter_mut().zip(corners) {
                    row[lane] = corner[a];
                }
            }
            prim[lane] = *p;
            plane[lane] = Plane::of(*corners);
        }
        Self { axis, prim, plane }
    }

    /// Corners of the triangle in a lane.
    #[inline]
    pub(super) fn corners(&self, lane: usize) -> [Vec3; 3] {
        std::array::from_fn(|c| {
            Vec3::from_array(std::array::from_fn(|a| self.axis[a][c].to_array()[lane & 3]))
        })
    }

    #[inline(always)]
    fn shear(&self, s: &Shear) -> Sheared {
        let [kx, ky, kz] = s.axes;
        let z = self.axis[kz].map(|z| z - s.origin[2]);
        let (rx, ry) = (&self.axis[kx], &self.axis[ky]);
        Sheared {
            x: std::array::from_fn(|c| (rx[c] - s.origin[0]) - s.shear[0] * z[c]),
            y: std::array::from_fn(|c| (ry[c] - s.origin[1]) - s.shear[1] * z[c]),
        }
    }

    /// The nearest hit in (0, `nearest`): distance, lane, and barycentric coordinates of the second and third corner. Of
    /// `ANY` hit there only the lane.
    #[inline(always)]
    pub(super) fn hit<const ANY: bool>(
        &self,
        ray: &Ray,
        s: &Shear,
        mut nearest: f32,
    ) -> Option<(f32, usize, Vec2)> {
        let c = self.shear(s);
        let [u, v, w] = c.edges();
        let zero = Vec4::ZERO;
        let inside: BVec4A = u.min(v).min(w).cmpge(zero) | u.max(v).max(w).cmple(zero);
        let mut mask = inside.bitmask();
        let mut best = None;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & 3;
            mask &= mask - 1;
            // In f64: the origin's own triangle must not be hit, its neighbour must.
            let Some(crossing) = self.plane[lane].crossing(ray, nearest) else { continue };
            let mut edges = [u, v, w].map(|e| e.to_array()[lane]);
            if edges.contains(&0.0) {
                match c.settle(lane) {
                    Some(settled) => edges = settled,
                    None => continue,
                }
            }
            if ANY {
                return Some((0.0, lane, Vec2::ZERO));
            }
            nearest = crossing.distance();
            best = Some((lane, edges));
        }
        best.map(|(lane, edges)| {
            let scale = 1.0 / (edges[0] + edges[1] + edges[2]);
            (nearest, lane, Vec2::new(edges[1] * scale, edges[2] * scale))
        })
    }
}

impl Sheared {
    /// The three edge functions.
    #[inline(always)]
    fn edges(&self) -> [Vec4; 3] {
        let (x, y) = (&self.x, &self.y);
        [x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]]
    }

    /// A lane that f32 leaves in doubt: its edge functions are computed again in f64. `None` where the ray passes
    /// outside, or sees the triangle edge-on.
    #[cold]
    #[inline(never)]
    fn settle(&self, lane: usize) -> Option<[f32; 3]> {
        let pick = |r: &[Vec4; 3]| r.map(|v| v.to_array()[lane]);
        let edges = exact_edges(pick(&self.x), pick(&self.y))?;
        (edges[0] + edges[1] + edges[2] != 0.0).then_some(edges)
    }
}

/// The edge functions in f64, where products of two f32 are exact; `None` where the ray passes outside.
#[cold]
fn exact_edges(x: [f32; 3], y: [f32; 3]) -> Option<[f32; 3]> {
    let (x, y) = (x.map(f64::from), y.map(f64::from));
    let edges = [x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]];
    let inside = edges.iter().all(|e| *e >= 0.0) || edges.iter().all(|e| *e <= 0.0);
    inside.then(|| edges.map(|e| e as f32))
}

/// Where a ray meets a plane, as a quotient: whether it counts is known long before the quotient is.
pub(super) struct Crossing {
    pub height: f64,
    pub rate: f64,
}

impl Crossing {
    /// Along the ray (metres).
    #[inline(always)]
    pub(super) fn distance(&self) -> f32 {
        (self.height / self.rate) as f32
    }
}

impl Plane {
    /// No ray meets it.
    pub(super) const NOWHERE: Self = Self { n: DVec3::NAN, d: f64::NAN };

    /// Through the corners of a triangle that has an area.
    pub(super) fn of(corners: [Vec3; 3]) -> Self {
        let n = cross(corners).normalize();
        Self { n, d: n.dot(corners[0].as_dvec3()) }
    }

    /// Of unit length.
    #[inline]
    pub(super) fn normal(&self) -> DVec3 {
        self.n
    }

    /// Where a ray meets the plane, if in (0, `limit`). An origin in the plane to the last bits of f64 does not hit it.
    #[inline(always)]
    pub(super) fn crossing(&self, ray: &Ray, limit: f32) -> Option<Crossing> {
        let rate = ray.dir.as_dvec3().dot(self.n);
        let origin = ray.origin.as_dvec3() * self.n;
        let height = self.d - (origin.x + origin.y + origin.z);
        // 0 < height/rate < limit. A ray along the plane meets it nowhere: 0 < 0 does not hold, nor does 0 < ∞·0.
        if !(height * rate > 0.0 && height.abs() < f64::from(limit) * rate.abs()) {
            return None;
        }
        let size = self.d.abs() + (origin.x.abs() + origin.y.abs() + origin.z.abs());
        (height.abs() > 2e-14 * size).then_some(Crossing { height, rate })
    }
}
