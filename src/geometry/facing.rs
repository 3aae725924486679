//! The triangles of a mesh that shines, sorted by where they face, so that few points are drawn on those that face away.
//!
//! A closed mesh turns half of its area away from any point outside. So its triangles lie in bins by the directions of their normals, and
//! toward a point x a bin is drawn by its area times the cosine that it has on average there, or a part of the largest that one of its triangles can have:
//!
//! ```text
//! w_b = A_b · max(cos θ_b, 0.15 cos max(0, θ_b − α_b − β), 0)
//! ```
//!
//! θ_b is the angle between the bin's axis and the direction from the middle of the mesh to x, α_b the largest angle between the
//! axis and a normal of the bin, and β the largest between that direction and one from a point of the mesh. So what is never drawn does not shine there, and
//! the density is known for any point of the mesh. From within the sphere about the mesh all are drawn by their area.

use super::TriangleMesh;
use crate::math::Discrete;
use glam::Vec3A;

/// Cells along the side of a cube's face, by which normals are sorted.
const SIDE: usize = 2;
/// The part of the largest cosine that a bin has at least.
const PART: f32 = 0.15;
const BINS: usize = 6 * SIDE * SIDE;

/// The triangles of a mesh by where they face.
#[derive(Debug)]
pub(super) struct Facing {
    /// A sphere about the mesh.
    centre: Vec3A,
    radius: f32,
    /// By triangle, its bin.
    of: Vec<u8>,
    cones: Cones,
    bins: Vec<Bin>,
}

/// What is asked of all bins at once, in arrays that are gone through side by side; bins that are not there have no area.
#[derive(Debug, Default)]
struct Cones {
    axis: [[f32; BINS]; 3],
    /// cos α and sin α.
    cosine: [f32; BINS],
    sine: [f32; BINS],
    area: [f32; BINS],
}

/// The triangles of a bin.
#[derive(Debug)]
struct Bin {
    triangles: Vec<u32>,
    /// Which of them, by area.
    picker: Discrete,
}

/// The cell of a unit normal.
fn cell(n: Vec3A) -> usize {
    let a = n.abs();
    let axis = if a.x >= a.y && a.x >= a.z {
        0
    } else if a.y >= a.z {
        1
    } else {
        2
    };
    let (u, v) = (n[(axis + 1) % 3] / a[axis], n[(axis + 2) % 3] / a[axis]);
    let at = |x: f32| (((x + 1.0) * 0.5 * SIDE as f32) as usize).min(SIDE - 1);
    ((2 * axis + usize::from(n[axis] < 0.0)) * SIDE + at(u)) * SIDE + at(v)
}

impl Facing {
    /// `None` where all face the same way.
    pub fn of(mesh: &TriangleMesh) -> Option<Self> {
        let count = mesh.indices().len();
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); BINS];
        let with_area = |i: &usize| mesh.triangle_area(*i) > 0.0;
        for i in (0..count).filter(with_area) {
            members[cell(mesh.facet(i))].push(i as u32);
        }
        let mut of = vec![0; count];
        let (mut bins, mut cones) = (Vec::new(), Cones::default());
        for triangles in members.into_iter().filter(|m| !m.is_empty()) {
            triangles.iter().for_each(|i| of[*i as usize] = bins.len() as u8);
            cones.set(bins.len(), mesh, &triangles)?;
            let picker = Discrete::new(triangles.iter().map(|i| mesh.triangle_area(*i as usize)))?;
            bins.push(Bin { triangles, picker });
        }
        let corners = || (0..count).flat_map(|i| mesh.corners(i));
        let low = corners().fold(Vec3A::INFINITY, |a, b| a.min(b.into()));
        let high = corners().fold(Vec3A::NEG_INFINITY, |a, b| a.max(b.into()));
        let centre = 0.5 * (low + high);
        let radius = corners().map(|p| centre.distance(p.into())).fold(0.0, f32::max);
        (bins.len() > 1 && radius.is_finite()).then_some(Self {
            centre,
            radius: 1.0001 * radius,
            of,
            cones,
            bins,
        })
    }

    /// w_b / A_b of each bin toward `from`, and the sum of w_b. `both`: the mesh shines on either side.
    fn weights(&self, from: Vec3A, both: bool) -> ([f32; BINS], f32) {
        let to = from - self.centre;
        let distance = to.length();
        let sine = self.radius / distance;
        if sine.is_nan() || sine >= 1.0 {
            return ([1.0; BINS], self.cones.area.iter().sum());
        }
        let weights = self.cones.weights(to / distance, [(1.0 - sine * sine).sqrt(), sine], both);
        (weights, weights.iter().zip(&self.cones.area).map(|(w, a)| w * a).sum())
    }

    /// A triangle toward `from`, what is left of `u`, and its density per area. `None` where none faces it.
    pub fn sample(&self, from: Vec3A, both: bool, u: f32) -> Option<(usize, f32, f32)> {
        let (weights, sum) = self.weights(from, both);
        if sum.is_nan() || sum <= 0.0 {
            return None;
        }
        let mut left = u * sum;
        let mut last = None;
        let bins = weights.iter().zip(&self.cones.area).zip(&self.bins);
        for ((weight, area), bin) in bins.filter(|((weight, _), _)| **weight > 0.0) {
            let part = weight * area;
            last = Some((bin, weight, left / part));
            if left < part {
                break;
            }
            left -= part;
        }
        let (bin, weight, rest) = last?;
        let (i, rest) = bin.picker.sample(rest.clamp(0.0, 1.0 - f32::EPSILON / 2.0));
        Some((bin.triangles[i] as usize, rest, weight / sum))
    }

    /// Density per area of points on a triangle, as [`Self::sample`] draws it.
    pub fn pdf(&self, from: Vec3A, both: bool, triangle: usize) -> f32 {
        let (weights, sum) = self.weights(from, both);
        if sum > 0.0 { weights[usize::from(self.of[triangle])] / sum } else { 0.0 }
    }
}

impl Cones {
    /// Bin `b` of these triangles. `None` where they have no area.
    fn set(&mut self, b: usize, mesh: &TriangleMesh, triangles: &[u32]) -> Option<()> {
        let area = |i: &u32| mesh.triangle_area(*i as usize);
        let normal = |i: &u32| mesh.facet(*i as usize);
        let axis = triangles.iter().map(|i| normal(i) * area(i) as f32).sum::<Vec3A>().try_normalize()?;
        // A little more than the largest angle, for rounding.
        let cosine = triangles.iter().map(|i| axis.dot(normal(i))).fold(1.0, f32::min) - 1e-4;
        self.axis.iter_mut().zip(axis.to_array()).for_each(|(all, x)| all[b] = x);
        self.cosine[b] = cosine;
        self.sine[b] = (1.0 - cosine * cosine).max(0.0).sqrt();
        self.area[b] = triangles.iter().map(area).sum::<f64>() as f32;
        Some(())
    }

    /// w_b / A_b toward the unit direction `to`, with cosine and sine of β.
    fn weights(&self, to: Vec3A, [cos_beta, sin_beta]: [f32; 2], both: bool) -> [f32; BINS] {
        let mut weights = [0.0; BINS];
        for (b, weight) in weights.iter_mut().enumerate() {
            let dot = self.axis[0][b] * to.x + self.axis[1][b] * to.y + self.axis[2][b] * to.z;
            let cosine = if both { dot.abs() } else { dot };
            // cos(α + β) and sin(α + β): α < 55° and β < 90°, so that angles fall as cosines rise.
            let cos = self.cosine[b] * cos_beta - self.sine[b] * sin_beta;
            let sin = self.sine[b] * cos_beta + self.cosine[b] * sin_beta;
            let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
            let apart = (cosine * cos + sine * sin).max(0.0);
            let largest = if cosine >= cos { 1.0 } else { apart };
            *weight = cosine.max(PART * largest);
        }
        weights
    }
}
