//! Shapes: rays against them, points on them, meshes from files.
//!
//! A scene's shapes become one flat list of primitives (triangles, spheres, discs) in world space under two
//! acceleration structures, in which two triangles that are a parallelogram are held as one (`parallelogram`): walls,
//! which end every ray, and boundaries, which a ray may pass (index-matched ones, and those of solids that another solid
//! may hide). [`Geometry::intersect`] and [`Geometry::occluded`], which know of walls alone, are the renderer's innermost
//! loop; most scenes have few boundaries or none.
//!
//! How rays stay on their side of a surface: triangle tests are watertight, and parallelograms overlap by some roundings
//! of f64; points on surfaces are computed in f64 and rounded once; [`SurfacePoint::spawn`] and [`shadow_ray`] move
//! origins by a few ulps; and hits near a ray's ends are decided in f64. So nothing leaks through thin walls or along
//! edges, whatever the scene's scale.

mod aabb;
mod bvh;
mod facing;
mod hollow;
mod lanes;
mod lathe;
pub mod load;
mod mesh;
mod parallelogram;
mod quadric;
mod ray;
mod sample;
mod shape;
pub(crate) mod slab;
mod smooth;
mod stats;
#[cfg(test)]
mod tests;
pub mod transform;
mod triangle;

pub use aabb::Aabb;
pub use mesh::TriangleMesh;
pub use ray::{Ends, Footing, Ray, offset_origin, shadow_ray, shadow_ray_along};
pub use shape::{Hit, ShapeDesc, SurfacePoint};
pub use stats::{Gap, ShapeKind, ShapeStats};

use bvh::{Bvh, Found, Leaf, Primitive};
use glam::{Vec2, Vec3A};
use parallelogram::{Parallelogram, There};
use quadric::{Disc, Sphere};
use sample::Facets;
use shape::Span;
use std::sync::OnceLock;

/// All shapes of a scene.
#[derive(Debug)]
pub struct Geometry {
    shapes: Vec<Shape>,
    /// The shape of each primitive.
    shape_of: Vec<u32>,
    walls: Bvh,
    boundaries: Bvh,
    has_boundaries: bool,
    bounds: Aabb,
}

#[derive(Debug)]
struct Shape {
    desc: ShapeDesc,
    is_boundary: bool,
    /// The first of its primitives.
    first: u32,
    area: f32,
    inv_area: f32,
    /// Of a mesh, made when first asked for: few shapes are lights.
    facets: OnceLock<Option<Facets>>,
}

impl Geometry {
    /// From shapes, whose ids are their places in the list. They must pass [`ShapeDesc::check`].
    pub fn build(shapes: Vec<ShapeDesc>) -> Self {
        Self::build_with(shapes.into_iter().map(|s| (s, false)).collect())
    }

    /// From shapes, each with whether it is a boundary, which a ray may pass, or a wall. Boundaries are reported by
    /// [`Self::boundary`] alone; they count for bounds, areas and sampling as walls do.
    pub fn build_with(shapes: Vec<(ShapeDesc, bool)>) -> Self {
        let mut shape_of = Vec::new();
        let (mut walls, mut boundaries) = (Vec::new(), Vec::new());
        let mut bounds = Aabb::EMPTY;
        let mut list = Vec::with_capacity(shapes.len());
        for (id, (desc, is_boundary)) in shapes.into_iter().enumerate() {
            let first = shape_of.len() as u32;
            shape_of.resize(shape_of.len() + desc.primitives(), id as u32);
            bounds = bounds.union(desc.bounds());
            let primitives = if is_boundary { &mut boundaries } else { &mut walls };
            match desc {
                ShapeDesc::Sphere { centre, radius } => {
                    primitives.push((Primitive::Sphere(Sphere { centre, radius }), first));
                }
                ShapeDesc::Disc { centre, normal, radius } => {
                    primitives.push((Primitive::Disc(Disc { centre, normal, radius }), first));
                }
                ShapeDesc::Mesh(ref mesh) => add_mesh(primitives, mesh, first),
            }
            let area = desc.area() as f32;
            list.push(Shape {
                desc,
                is_boundary,
                first,
                area,
                inv_area: 1.0 / area,
                facets: OnceLock::new(),
            });
        }
        let has_boundaries = !boundaries.is_empty();
        let (walls, boundaries) = (Bvh::build(&walls), Bvh::build(&boundaries));
        Self { shapes: list, shape_of, walls, boundaries, has_boundaries, bounds }
    }

    /// The first wall that a ray meets.
    #[inline(always)]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.closest(&self.walls, ray)
    }

    /// The first boundary that a ray meets.
    #[inline]
    pub fn boundary(&self, ray: &Ray) -> Option<Hit> {
        self.closest(&self.boundaries, ray)
    }

    /// Whether there are any boundaries.
    #[inline]
    pub fn has_boundaries(&self) -> bool {
        self.has_boundaries
    }

    /// What a ray meets first in a tree.
    #[inline(always)]
    fn closest(&self, bvh: &Bvh, ray: &Ray) -> Option<Hit> {
        let found = bvh.closest(ray)?;
        // In parts, so that the point is put together in registers: what a call writes bit by bit and is read at once makes
        // the processor wait.
        let (p, ng, ns, uv, shape, prim) = match found.child.leaf() {
            Leaf::Parallelograms(i) => {
                let There { prim, barycentric, p, flat } = bvh.parallelograms[i].place(found.lane, found.at);
                match flat {
                    Some((ng, uv)) => (p, ng, ng, uv, self.shape_of[prim as usize], prim),
                    None => self.on_triangle(prim, barycentric, p).parts(),
                }
            }
            Leaf::Sphere(i) => {
                let (sphere, prim) = &bvh.spheres[i];
                sphere.point_at(ray, found.t, self.shape_of[*prim as usize], *prim).parts()
            }
            Leaf::Block(_) | Leaf::Disc(_) => self.other_point(bvh, ray, &found).parts(),
        };
        Some(Hit { t: found.t, point: SurfacePoint { p, ng, ns, uv, shape, prim } })
    }

    /// The point of a hit on a triangle or a disc.
    #[inline(never)]
    fn other_point(&self, bvh: &Bvh, ray: &Ray, found: &Found) -> SurfacePoint {
        match found.child.leaf() {
            Leaf::Block(i) => {
                let block = &bvh.blocks[i];
                let prim = block.prim[found.lane & 3];
                let p = Span::of(block.corners(found.lane)).at(found.at);
                self.on_triangle(prim, found.at, p)
            }
            Leaf::Parallelograms(_) | Leaf::Sphere(_) => unreachable!("asked of triangles and discs"),
            Leaf::Disc(i) => {
                let (disc, prim) = &bvh.discs[i];
                disc.point(ray.at_exactly(found.t), self.shape_of[*prim as usize], *prim)
            }
        }
    }

    /// Whether a wall lies on the ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.walls.any(ray)
    }

    /// The point of triangle `prim` at barycentric coordinates `b`, which is at `p`.
    #[inline]
    fn on_triangle(&self, prim: u32, b: Vec2, p: Vec3A) -> SurfacePoint {
        let id = self.shape_of[prim as usize];
        let shape = &self.shapes[id as usize];
        match &shape.desc {
            ShapeDesc::Mesh(mesh) => shape::mesh_point(mesh, (prim - shape.first) as usize, (b, p), id, prim),
            ShapeDesc::Sphere { .. } | ShapeDesc::Disc { .. } => unreachable!("triangles belong to meshes"),
        }
    }

    /// A vector, not of unit length, that points to the outside of the surface at `p` of primitive `prim` of `shape`.
    pub fn outward(&self, shape: u32, prim: u32, p: Vec3A) -> Vec3A {
        let shape = &self.shapes[shape as usize];
        match &shape.desc {
            ShapeDesc::Sphere { centre, .. } => p - *centre,
            ShapeDesc::Disc { normal, .. } => *normal,
            ShapeDesc::Mesh(mesh) => {
                let [a, b, c] = mesh.corners((prim - shape.first) as usize);
                (b - a).cross(c - a).into()
            }
        }
    }

    /// Number of shapes.
    pub fn shape_count(&self) -> usize {
        self.shapes.len()
    }

    /// Number of primitives of all shapes.
    pub fn primitive_count(&self) -> usize {
        self.shape_of.len()
    }

    /// What a shape was made of.
    pub fn shape(&self, shape: u32) -> &ShapeDesc {
        &self.shapes[shape as usize].desc
    }

    /// Whether a shape is a boundary, which a ray may pass.
    #[inline]
    pub fn is_boundary(&self, shape: u32) -> bool {
        self.shapes[shape as usize].is_boundary
    }

    /// Numbers about a shape.
    pub fn stats(&self, shape: u32) -> ShapeStats {
        ShapeStats::of(&self.shapes[shape as usize].desc)
    }

    /// The least box about a shape.
    pub fn shape_bounds(&self, shape: u32) -> Aabb {
        self.shapes[shape as usize].desc.bounds()
    }

    /// The least box about all shapes; [`Aabb::EMPTY`] without any.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Centre and radius of a sphere about all shapes: that of their box. Radius 0 without any.
    pub fn bounding_sphere(&self) -> (Vec3A, f32) {
        // Rounded up, so that the corners are inside.
        (self.bounds.centre(), 0.5 * self.bounds.size().length() * (1.0 + 1e-6))
    }

    /// Memory of the acceleration structures, with the triangles in them, in bytes.
    pub fn acceleration_bytes(&self) -> usize {
        self.walls.bytes() + self.boundaries.bytes()
    }
}

/// A mesh's primitives, of which `first` is the index of the first triangle.
fn add_mesh(primitives: &mut Vec<(Primitive, u32)>, mesh: &TriangleMesh, first: u32) {
    let mut i = 0;
    while i < mesh.indices().len() {
        let index = first + i as u32;
        if let Some(whole) = Parallelogram::of(mesh, i) {
            primitives.push((Primitive::Parallelogram(whole), index));
            i += 2;
        } else {
            primitives.push((Primitive::Triangle(mesh.corners(i)), index));
            i += 1;
        }
    }
}
