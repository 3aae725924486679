//! Up to four triangles against a ray at once, watertight [Woop, Benthin, Wald 2013].
//!
//! The corners are sheared into a frame in which the ray is the z axis; each corner is rounded there by itself, so all
//! triangles that share it agree where it is. Three edge functions then decide exactly (f32 gives the right sign or
//! zero, and zeros are decided in f64) whether the ray passes inside. A ray through an edge of a closed mesh so hits
//! one of its two triangles at least.

use super::mesh::cross;
use super::ray::Ray;
use glam::{BVec4A, Vec2, Vec3, Vec4};

/// Triangles in a block.
pub(super) const LANES: usize = 4;

/// Up to four triangles, 160 bytes: for each axis, the three corners' coordinates. Unused lanes are NaN and never hit.
#[derive(Clone, Debug)]
#[repr(C)]
pub(super) struct Block {
    axis: [[Vec4; 3]; 3],
    /// Primitives, counted over all shapes.
    pub prim: [u32; LANES],
}

/// What of a ray a block's test needs.
pub(super) struct Shear {
    /// Axes x, y, z of the sheared frame; z is the one along which the ray is longest.
    axes: [usize; 3],
    origin: [Vec4; 3],
    /// Shear of x and of y, and scale of z.
    shear: [Vec4; 3],
}

/// A lane through which the ray passes.
struct Candidate {
    /// The edge functions, whose quotients by their sum are barycentric coordinates.
    edges: [f32; 3],
    t: f32,
    /// Bound on the error of `t`.
    slack: f32,
}

/// The corners in the sheared frame.
struct Sheared {
    x: [Vec4; 3],
    y: [Vec4; 3],
    z: [Vec4; 3],
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
        let axes = [(kz + 1) % 3, (kz + 2) % 3, kz];
        let scale = 1.0 / dir[kz];
        Self {
            axes,
            origin: axes.map(|a| Vec4::splat(origin[a])),
            shear: [dir[axes[0]] * scale, dir[axes[1]] * scale, scale].map(Vec4::splat),
        }
    }
}

impl Block {
    /// From one to four triangles with their primitive indices.
    pub(super) fn new(triangles: &[([Vec3; 3], u32)]) -> Self {
        let mut axis = [[Vec4::NAN; 3]; 3];
        let mut prim = [u32::MAX; LANES];
        for (lane, (corners, p)) in triangles.iter().enumerate() {
            for (a, rows) in axis.iter_mut().enumerate() {
                for (row, corner) in rows.iter_mut().zip(corners) {
                    row[lane] = corner[a];
                }
            }
            prim[lane] = *p;
        }
        Self { axis, prim }
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
            z,
        }
    }

    /// The nearest hit in (0, `nearest`) and before the ray's end: distance, lane, and barycentric coordinates of the
    /// second and third corner.
    #[inline(always)]
    pub(super) fn hit(&self, ray: &Ray, s: &Shear, nearest: f32) -> Option<(f32, usize, Vec2)> {
        let c = self.shear(s);
        let u = c.x[2] * c.y[1] - c.y[2] * c.x[1];
        let v = c.x[0] * c.y[2] - c.y[0] * c.x[2];
        let w = c.x[1] * c.y[0] - c.y[1] * c.x[0];
        let zero = Vec4::ZERO;
        let front = u.cmpge(zero) & v.cmpge(zero) & w.cmpge(zero);
        let back = u.cmple(zero) & v.cmple(zero) & w.cmple(zero);
        let inside: BVec4A = front | back;
        let mask = inside.bitmask();
        if mask == 0 {
            return None;
        }
        self.nearest(ray, s, nearest, mask, &c, [u, v, w])
    }

    /// The rest of [`Self::hit`], for the lanes in `mask`, through which the ray passes.
    #[inline]
    fn nearest(
        &self,
        ray: &Ray,
        s: &Shear,
        mut nearest: f32,
        mut mask: u32,
        c: &Sheared,
        [u, v, w]: [Vec4; 3],
    ) -> Option<(f32, usize, Vec2)> {
        // All lanes' distances at once; most lanes end here.
        let det = u + v + w;
        let scale = s.shear[2];
        let t = scale * (u * c.z[0] + v * c.z[1] + w * c.z[2]) / det;
        let slack = c.slack(scale, det);
        // A lane with an edge function of zero, or without area to the ray, is settled by itself.
        let doubtful = (u * v * w).cmpeq(Vec4::ZERO) | det.cmpeq(Vec4::ZERO);
        let between = (t + slack).cmpge(Vec4::ZERO) & (t - slack).cmple(Vec4::splat(nearest));
        mask &= (between | doubtful).bitmask();
        let mut best = None;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & 3;
            mask &= mask - 1;
            let pick = |x: Vec4| x.to_array()[lane];
            let mut hit = Candidate { edges: [u, v, w].map(pick), t: pick(t), slack: pick(slack) };
            if doubtful.bitmask() >> lane & 1 == 1 {
                match c.settle(s, lane, nearest) {
                    Some(settled) => hit = settled,
                    None => continue,
                }
            }
            let mut t = hit.t;
            // Near the ends of the ray, f64 decides: the origin's own triangle must not be hit, its neighbour must.
            if t <= hit.slack || t >= ray.t_max - hit.slack {
                match exact_distance(ray, self.corners(lane)) {
                    Some(exact) => t = exact,
                    None => continue,
                }
            }
            if t < nearest {
                nearest = t;
                let scale = 1.0 / (hit.edges[0] + hit.edges[1] + hit.edges[2]);
                best = Some((t, lane, Vec2::new(hit.edges[1] * scale, hit.edges[2] * scale)));
            }
        }
        best
    }
}

impl Sheared {
    /// Bound on the error of the distances. Corners are wrong by a few ulps of their distance; that moves t by as much
    /// times the slope of the triangle against the ray, and the edge functions' own rounding by as much again.
    #[inline(always)]
    fn slack(&self, scale: Vec4, det: Vec4) -> Vec4 {
        let largest = |r: &[Vec4; 3]| r[0].abs().max(r[1].abs()).max(r[2].abs());
        let (mx, my, mz) = (largest(&self.x), largest(&self.y), largest(&self.z));
        let slope = (mx + my + mz) * (mx + my) / det.abs();
        2f32.powi(-20) * mz * scale.abs() * (Vec4::ONE + slope)
    }

    /// A lane that f32 leaves in doubt: its edge functions are computed again in f64.
    #[cold]
    fn settle(&self, s: &Shear, lane: usize, nearest: f32) -> Option<Candidate> {
        let pick = |r: &[Vec4; 3]| r.map(|v| v.to_array()[lane]);
        let z = pick(&self.z);
        let edges = exact_edges(pick(&self.x), pick(&self.y))?;
        let det = edges[0] + edges[1] + edges[2];
        if det == 0.0 {
            return None;
        }
        let t = s.shear[2].x * (edges[0] * z[0] + edges[1] * z[1] + edges[2] * z[2]) / det;
        let slack = self.slack(s.shear[2], Vec4::splat(det)).to_array()[lane];
        (t >= -slack && t - slack <= nearest).then_some(Candidate { edges, t, slack })
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

/// The distance of the triangle's plane in f64, where it lies inside the ray. An origin in the plane to the last bit
/// of f64 does not hit it.
#[inline(never)]
fn exact_distance(ray: &Ray, corners: [Vec3; 3]) -> Option<f32> {
    let n = cross(corners);
    let to_corner = corners[0].as_dvec3() - ray.origin.as_dvec3();
    let height = to_corner.dot(n);
    if height.abs() <= 2e-14 * to_corner.abs().dot(n.abs()) {
        return None;
    }
    let t = height / ray.dir.as_dvec3().dot(n);
    (t > 0.0 && t < f64::from(ray.t_max)).then_some(t as f32)
}
