//! Triangle meshes.

use super::aabb::Aabb;
use glam::{Affine3A, DVec3, Mat3A, Vec2, Vec3, Vec3A};

/// A mesh of triangles. Counter-clockwise seen from outside.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    positions: Vec<Vec3>,
    pub(super) normals: Option<Vec<Vec3>>,
    uvs: Option<Vec<Vec2>>,
    indices: Vec<[u32; 3]>,
    /// Unit normals of the triangles.
    facets: Vec<Vec3>,
    dropped: usize,
}

impl TriangleMesh {
    /// From vertices and the triangles' indices into them; `normals` (of any length but 0) and `uvs` one a vertex.
    /// Triangles without area are dropped and counted ([`Self::dropped`]).
    ///
    /// # Errors
    /// A message where an index is out of range, a number is not finite, lengths differ, or no triangle is left.
    pub fn new(
        positions: Vec<Vec3>,
        normals: Option<Vec<Vec3>>,
        uvs: Option<Vec<Vec2>>,
        mut indices: Vec<[u32; 3]>,
    ) -> Result<Self, String> {
        let count = positions.len();
        if indices.is_empty() {
            return Err("the mesh has no triangle".into());
        }
        // Global primitive indices and those of blocks share 32 bits with three bits of tag.
        if indices.len() >= 1 << 29 {
            return Err(format!("the mesh has {} triangles; at most {} fit", indices.len(), (1 << 29) - 1));
        }
        if let Some(i) = positions.iter().position(|p| !p.is_finite()) {
            return Err(format!("vertex {i} has a position that is not finite: {}", positions[i]));
        }
        if let Some(t) = indices.iter().position(|t| t.iter().any(|&i| i as usize >= count)) {
            return Err(format!("triangle {t} has indices {:?}, but there are {count} vertices", indices[t]));
        }
        if let Some(normals) = &normals {
            if normals.len() != count {
                return Err(format!("{} normals for {count} vertices", normals.len()));
            }
            if let Some(i) = normals.iter().position(|n| !n.is_finite()) {
                return Err(format!("vertex {i} has a normal that is not finite: {}", normals[i]));
            }
        }
        if let Some(uvs) = &uvs {
            if uvs.len() != count {
                return Err(format!("{} texture coordinates for {count} vertices", uvs.len()));
            }
            if let Some(i) = uvs.iter().position(|uv| !uv.is_finite()) {
                return Err(format!("vertex {i} has texture coordinates that are not finite: {}", uvs[i]));
            }
        }
        let before = indices.len();
        indices.retain(|t| !is_degenerate(t.map(|i| positions[i as usize])));
        if indices.is_empty() {
            return Err(format!("the mesh has no triangle with an area ({before} without)"));
        }
        let facet = |t: &[u32; 3]| cross(t.map(|i| positions[i as usize])).normalize().as_vec3();
        let facets = indices.iter().map(facet).collect();
        Ok(Self { positions, normals, uvs, dropped: before - indices.len(), indices, facets })
    }

    /// A parallelogram of two triangles: `corner` + u·`edge_u` + v·`edge_v`, u and v in [0, 1], also its texture
    /// coordinates. The outside is on the side of `edge_u` × `edge_v`.
    ///
    /// # Errors
    /// A message where the edges are parallel or not finite.
    pub fn parallelogram(corner: Vec3, edge_u: Vec3, edge_v: Vec3) -> Result<Self, String> {
        let positions = vec![corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v];
        let uvs = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        Self::new(positions, None, Some(uvs), vec![[0, 1, 2], [0, 2, 3]])
    }

    /// The square −1 ≤ x, y ≤ 1 at z = 0, outside towards +z; texture coordinates from (0, 0) at (−1, −1) to (1, 1).
    pub fn rectangle() -> Self {
        let square = Self::parallelogram(Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0);
        square.expect("a square has an area")
    }

    /// The square 0 ≤ x, y ≤ 1 at z = 0, outside towards +z, which are also its texture coordinates.
    pub fn unit_square() -> Self {
        Self::parallelogram(Vec3::ZERO, Vec3::X, Vec3::Y).expect("a square has an area")
    }

    /// The cube 0 ≤ x, y, z ≤ 1, otherwise as [`Self::cube`].
    pub fn unit_cube() -> Self {
        let mut cube = Self::cube();
        for p in &mut cube.positions {
            *p = (*p + Vec3::ONE) * 0.5;
        }
        cube
    }

    /// The cube −1 ≤ x, y, z ≤ 1, outside outwards; each face has texture coordinates from (0, 0) to (1, 1).
    pub fn cube() -> Self {
        let (mut positions, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new());
        for axis in 0..3 {
            for side in [-1.0f32, 1.0] {
                let n = Vec3::AXES[axis] * side;
                let s = Vec3::AXES[(axis + 1) % 3];
                let t = n.cross(s);
                let first = positions.len() as u32;
                for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                    positions.push(n + s * x + t * y);
                    uvs.push(Vec2::new(x, y) * 0.5 + Vec2::splat(0.5));
                }
                indices.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            }
        }
        Self::new(positions, None, Some(uvs), indices).expect("a cube has an area")
    }

    /// The same mesh elsewhere. The outside stays the outside, also under a reflection. Squares and cubes become exact
    /// parallelograms, which are faster to test than triangles: the transform is rounded, by at most two units in the
    /// last place of the mesh's coordinates, so that the corners need no rounding any more.
    ///
    /// # Errors
    /// A message where no triangle has an area or a finite position any more.
    pub fn transformed(mut self, transform: &Affine3A) -> Result<Self, String> {
        let transform = &self.rounded(transform);
        for p in &mut self.positions {
            *p = transform.transform_point3(*p);
        }
        if let Some(normals) = &mut self.normals {
            let cofactor = super::transform::normal_matrix(transform);
            for n in normals {
                *n = (cofactor * *n).normalize_or_zero();
            }
        }
        if transform.matrix3.determinant() < 0.0 {
            for t in &mut self.indices {
                t.swap(1, 2);
            }
        }
        let dropped = self.dropped;
        let mesh = Self::new(self.positions, self.normals, self.uvs, self.indices)?;
        Ok(Self { dropped: dropped + mesh.dropped, ..mesh })
    }

    /// The transform on a grid of what f32 can hold, where all coordinates of this mesh are −1, 0 or 1.
    fn rounded(&self, transform: &Affine3A) -> Affine3A {
        let is_unit = |x: f32| x == 0.0 || x.abs() == 1.0;
        if !self.positions.iter().all(|p| p.to_array().into_iter().all(is_unit)) {
            return *transform;
        }
        // A bound on all sums of a column of the matrix each and the translation.
        let size = self.positions.iter().fold(Vec3::ZERO, |size, p| size.max(p.abs()));
        let columns = transform.matrix3.to_cols_array_2d().map(Vec3A::from);
        let reach = columns.iter().zip(size.to_array()).map(|(c, used)| c.abs() * used).sum::<Vec3A>()
            + transform.translation.abs();
        let round = |v: Vec3A| Vec3A::from_array(std::array::from_fn(|a| to_grid(v[a], reach[a])));
        let [x, y, z] = columns.map(round);
        Affine3A { matrix3: Mat3A::from_cols(x, y, z), translation: round(transform.translation) }
    }

    /// The same mesh without its shading normals: flat triangles.
    pub fn faceted(mut self) -> Self {
        self.normals = None;
        self
    }

    /// Positions of the vertices.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Shading normals of the vertices.
    pub fn normals(&self) -> Option<&[Vec3]> {
        self.normals.as_deref()
    }

    /// Texture coordinates of the vertices.
    pub fn uvs(&self) -> Option<&[Vec2]> {
        self.uvs.as_deref()
    }

    /// Indices of the triangles' vertices.
    pub fn indices(&self) -> &[[u32; 3]] {
        &self.indices
    }

    /// How many triangles without area were left out.
    pub fn dropped(&self) -> usize {
        self.dropped
    }

    /// Corners of triangle `i`.
    #[inline]
    pub(crate) fn corners(&self, i: usize) -> [Vec3; 3] {
        self.indices[i].map(|v| self.positions[v as usize])
    }

    /// Unit normal of triangle `i`.
    #[inline]
    pub(super) fn facet(&self, i: usize) -> Vec3A {
        self.facets[i].into()
    }

    /// Shading normal (not yet of unit length; `None` for a flat mesh) and texture coordinates at barycentric
    /// coordinates `b` of the second and third corner; those themselves where the mesh has no texture coordinates.
    #[inline]
    pub(super) fn attributes(&self, i: usize, b: Vec2) -> (Option<Vec3A>, Vec2) {
        if self.normals.is_none() && self.uvs.is_none() {
            return (None, b);
        }
        let [i0, i1, i2] = self.indices[i].map(|v| v as usize);
        let b0 = 1.0 - b.x - b.y;
        let ns = self.normals.as_ref().map(|n| Vec3A::from(n[i0] * b0 + n[i1] * b.x + n[i2] * b.y));
        let uv = self.uvs.as_ref().map_or(b, |uv| uv[i0] * b0 + uv[i1] * b.x + uv[i2] * b.y);
        (ns, uv)
    }

    /// Area of triangle `i` in m².
    pub(super) fn triangle_area(&self, i: usize) -> f64 {
        0.5 * cross(self.corners(i)).length()
    }

    /// The least box about its triangles.
    pub(super) fn bounds(&self) -> Aabb {
        Aabb::of(self.indices.iter().flatten().map(|&i| self.positions[i as usize].into()))
    }
}

/// `x` as a multiple of the unit in the last place of `reach`.
fn to_grid(x: f32, reach: f32) -> f32 {
    // All bits of the exponent alone: a power of two, of which a 2²³rd part is that unit.
    let unit = f32::from_bits(reach.to_bits() & 0x7f80_0000) * 2f32.powi(-23);
    if unit.is_normal() { (x / unit).round_ties_even() * unit } else { x }
}

/// Twice a triangle's area vector.
#[inline]
pub(super) fn cross([a, b, c]: [Vec3; 3]) -> DVec3 {
    let a = a.as_dvec3();
    (b.as_dvec3() - a).cross(c.as_dvec3() - a)
}

/// Whether a triangle has no area, to the precision of f64.
fn is_degenerate(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|v| v.as_dvec3());
    let longest2 = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
    let size = cross(corners).length();
    size <= 1e-14 * longest2 || !size.is_finite()
}
