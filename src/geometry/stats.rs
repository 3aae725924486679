//! What `tyndall info` tells about a shape.

use super::aabb::Aabb;
use super::mesh::TriangleMesh;
use super::shape::ShapeDesc;
use std::collections::HashMap;

/// What kind of shape it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShapeKind {
    /// A sphere.
    Sphere,
    /// A disc.
    Disc,
    /// A mesh of triangles.
    Mesh,
}

/// Numbers about a shape.
#[derive(Clone, Copy, Debug)]
pub struct ShapeStats {
    /// What it is.
    pub kind: ShapeKind,
    /// Triangles, or 1.
    pub primitives: usize,
    /// Area in m².
    pub area: f64,
    /// The least box about it.
    pub bounds: Aabb,
    /// Whether it bounds a volume: every edge is shared by exactly two triangles, in opposite directions. Corners at
    /// the same place count as one.
    pub closed: bool,
    /// The volume that a closed shape bounds in m³, negative where its outside is inside; `None` for open shapes.
    pub volume: Option<f64>,
    /// Triangles without area, left out.
    pub dropped: usize,
}

impl ShapeStats {
    /// Of a shape. Takes time in proportion to its triangles.
    pub fn of(shape: &ShapeDesc) -> Self {
        let (kind, closed, volume, dropped) = match shape {
            ShapeDesc::Sphere { radius, .. } => {
                let volume = 4.0 / 3.0 * std::f64::consts::PI * f64::from(*radius).powi(3);
                (ShapeKind::Sphere, true, Some(volume), 0)
            }
            ShapeDesc::Disc { .. } => (ShapeKind::Disc, false, None, 0),
            ShapeDesc::Mesh(mesh) => {
                let closed = is_closed(mesh);
                (ShapeKind::Mesh, closed, closed.then(|| volume(mesh)), mesh.dropped())
            }
        };
        let (primitives, area, bounds) = (shape.primitives(), shape.area(), shape.bounds());
        Self { kind, primitives, area, bounds, closed, volume, dropped }
    }
}

/// Whether each directed edge occurs once, and so does its reverse.
fn is_closed(mesh: &TriangleMesh) -> bool {
    let mut corner = HashMap::new();
    // Adding zero makes −0 a 0.
    let places: Vec<usize> = mesh
        .positions()
        .iter()
        .map(|p| {
            let next = corner.len();
            *corner.entry((*p + glam::Vec3::ZERO).to_array().map(f32::to_bits)).or_insert(next)
        })
        .collect();
    let mut edges: HashMap<(usize, usize), i32> = HashMap::with_capacity(3 * mesh.indices().len());
    for t in mesh.indices() {
        let t = t.map(|i| places[i as usize]);
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            *edges.entry((a, b)).or_insert(0) += 1;
        }
    }
    edges.iter().all(|((a, b), count)| *count == 1 && edges.get(&(*b, *a)) == Some(&1))
}

/// Signed volume, by the divergence theorem, about the centre of the mesh.
fn volume(mesh: &TriangleMesh) -> f64 {
    let centre = mesh.bounds().centre().as_dvec3();
    (0..mesh.indices().len())
        .map(|i| {
            let [a, b, c] = mesh.corners(i).map(|v| v.as_dvec3() - centre);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}
