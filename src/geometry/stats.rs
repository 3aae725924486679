//! What `tyndall info` tells about a shape.

use super::aabb::Aabb;
use super::mesh::TriangleMesh;
use super::shape::ShapeDesc;
use glam::Vec3;
use rayon::prelude::*;
use std::fmt;

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
    /// Why a mesh is not closed.
    pub gap: Option<Gap>,
    /// The volume that a closed shape bounds in m³, negative where its outside is inside; `None` for open shapes.
    pub volume: Option<f64>,
    /// Triangles without area, left out.
    pub dropped: usize,
}

impl ShapeStats {
    /// Of a shape. Takes time in proportion to its triangles.
    pub fn of(shape: &ShapeDesc) -> Self {
        let (kind, gap, volume, dropped) = match shape {
            ShapeDesc::Sphere { radius, .. } => {
                let volume = 4.0 / 3.0 * std::f64::consts::PI * f64::from(*radius).powi(3);
                (ShapeKind::Sphere, None, Some(volume), 0)
            }
            ShapeDesc::Disc { .. } => (ShapeKind::Disc, None, None, 0),
            ShapeDesc::Mesh(mesh) => {
                let gap = gap(mesh);
                (ShapeKind::Mesh, gap, gap.is_none().then(|| volume(mesh)), mesh.dropped())
            }
        };
        let (primitives, area, bounds) = (shape.primitives(), shape.area(), shape.bounds());
        Self { kind, primitives, area, bounds, closed: volume.is_some(), gap, volume, dropped }
    }
}

/// Where a mesh has no inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gap {
    /// Edges of one triangle alone, or of more than two.
    Open {
        /// How many.
        edges: usize,
        /// The ends of one of them.
        one: [Vec3; 2],
    },
    /// Edges between two triangles of which one shows its front and one its back, with no open edge beside them.
    Turned {
        /// How many.
        edges: usize,
        /// The ends of one of them.
        one: [Vec3; 2],
    },
}

impl fmt::Display for Gap {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (Self::Open { edges, one } | Self::Turned { edges, one }) = self;
        let what = match self {
            Self::Open { .. } => "belong to one triangle or to more than two",
            Self::Turned { .. } => "lie between two faces that are not turned the same way",
        };
        write!(f, "{edges} of its edges {what}, such as that from {} to {}", one[0], one[1])
    }
}

/// Why not each directed edge occurs once, and so does its reverse; none where they do.
fn gap(mesh: &TriangleMesh) -> Option<Gap> {
    let places = places(mesh);
    let mut edges: Vec<(u32, u32, bool)> = mesh
        .indices()
        .par_iter()
        .flat_map_iter(|t| {
            let [a, b, c] = t.map(|i| places[i as usize]);
            [(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to), from < to))
        })
        .collect();
    edges.par_sort_unstable();
    // Both ways along an edge are neighbours now, and there is no third. An edge to where it starts has no other way.
    let (pairs, rest) = edges.as_chunks::<2>();
    let paired = pairs.par_iter().all(|[a, b]| (a.0, a.1) == (b.0, b.1) && a.2 != b.2);
    let closed =
        paired && rest.is_empty() && edges.par_windows(3).all(|w| (w[0].0, w[0].1) != (w[2].0, w[2].1));
    if closed {
        return None;
    }
    let position = |place: u32| {
        let vertex = places.iter().position(|p| *p == place);
        vertex.map_or(Vec3::ZERO, |vertex| mesh.positions()[vertex])
    };
    let groups = || edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
    let of = |which: fn(&[(u32, u32, bool)]) -> bool| {
        let first = groups().find(|group| which(group))?[0];
        Some((groups().filter(|group| which(group)).count(), [first.0, first.1].map(position)))
    };
    let open = of(|group| group.len() != 2).map(|(edges, one)| Gap::Open { edges, one });
    open.or_else(|| of(|group| group[0].2 == group[1].2).map(|(edges, one)| Gap::Turned { edges, one }))
}

/// For each vertex a number that those at its place have in common.
fn places(mesh: &TriangleMesh) -> Vec<u32> {
    // Adding zero makes −0 a 0.
    let bits = |p: &glam::Vec3| (*p + glam::Vec3::ZERO).to_array().map(f32::to_bits);
    let mut order: Vec<([u32; 3], u32)> =
        mesh.positions().par_iter().enumerate().map(|(i, p)| (bits(p), i as u32)).collect();
    order.par_sort_unstable();
    let mut places = vec![0; order.len()];
    let mut place = 0;
    for (k, (bits, vertex)) in order.iter().enumerate() {
        place += u32::from(k > 0 && *bits != order[k - 1].0);
        places[*vertex as usize] = place;
    }
    places
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
