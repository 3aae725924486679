//! Shading normals for meshes that come without.

use super::mesh::TriangleMesh;
use glam::{DVec3, Vec3};
use std::collections::HashMap;

impl TriangleMesh {
    /// The same mesh with shading normals: at each vertex the mean of its triangles' normals, weighted by their angles
    /// there, which does not depend on how flat parts are cut into triangles [Thürmer & Wüthrich 1998]. Vertices at
    /// the same place share it. Normals that the mesh has are replaced.
    pub fn smoothed(mut self) -> Self {
        let key = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
        let mut sums: HashMap<[u32; 3], DVec3> = HashMap::new();
        for triangle in self.indices() {
            let corners = triangle.map(|i| self.positions()[i as usize].as_dvec3());
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
            for i in 0..3 {
                let (here, next, last) = (corners[i], corners[(i + 1) % 3], corners[(i + 2) % 3]);
                let angle = (next - here).angle_between(last - here);
                let angle = if angle.is_finite() { angle } else { 0.0 };
                *sums.entry(key(self.positions()[triangle[i] as usize])).or_insert(DVec3::ZERO) +=
                    normal * angle;
            }
        }
        // Where the normals cancel out, the zero vector stands for "as the triangle is".
        let at = |p: &Vec3| sums.get(&key(*p)).map_or(Vec3::ZERO, |n| n.normalize_or_zero().as_vec3());
        let normals = self.positions().iter().map(at).collect();
        self.normals = Some(normals);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_gets_the_directions_of_its_corners() {
        let cube = TriangleMesh::cube().smoothed();
        for (p, n) in cube.positions().iter().zip(cube.normals().unwrap()) {
            assert!(p.normalize().distance(*n) < 1e-6, "{p} {n}: the diagonals of the faces must not matter");
        }
    }

    #[test]
    fn a_flat_mesh_stays_flat() {
        let square = TriangleMesh::rectangle().smoothed();
        assert!(square.normals().unwrap().iter().all(|n| n.distance(Vec3::Z) < 1e-6));
    }
}
