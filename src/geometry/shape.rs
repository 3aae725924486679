//! What scenes are made of, and points on it.

use super::aabb::Aabb;
use super::mesh::TriangleMesh;
use super::quadric::{Disc, Sphere};
use super::ray::{Footing, Ray};
use super::transform;
use glam::{Affine3A, DVec3, Vec2, Vec3, Vec3A};

/// A point on a surface.
///
/// The order is one that [`crate::scene::Collision`] fits: where a flight leads to either, the parts in which the compiler moves
/// what the two have in common are the parts in which this is written. What is written otherwise than it is read is waited for.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct SurfacePoint {
    /// Position, within a rounding of f32 of the true surface (metres).
    pub p: Vec3A,
    /// Unit geometric normal on the outside of the shape (by winding for meshes).
    pub ng: Vec3A,
    /// Unit shading normal, in the hemisphere of `ng`.
    pub ns: Vec3A,
    /// Which shape, by its place in the list that the geometry was built from.
    pub shape: u32,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Which primitive, counted over all shapes.
    pub prim: u32,
}

impl SurfacePoint {
    /// What it is made of, in order.
    #[inline(always)]
    pub(super) fn parts(self) -> (Vec3A, Vec3A, Vec3A, Vec2, u32, u32) {
        let Self { p, ng, ns, uv, shape, prim } = self;
        (p, ng, ns, uv, shape, prim)
    }

    /// The ray from here in the unit direction `dir`, started just off the surface on that side.
    #[inline]
    pub fn spawn(&self, dir: Vec3A) -> Ray {
        self.footing().spawn(self.p, dir)
    }

    /// What a ray from here starts on.
    #[inline]
    pub fn footing(&self) -> Footing {
        Footing { normal: self.ng, prim: self.prim }
    }
}

/// A surface point that a ray hit.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance along the ray (metres).
    pub t: f32,
    /// What was hit.
    pub point: SurfacePoint,
}

/// What a shape is made of, in world space.
#[derive(Clone, Debug)]
pub enum ShapeDesc {
    /// A sphere. Texture coordinates: u around +y from +x by +z, v from the top (+y) down.
    Sphere {
        /// Centre (metres).
        centre: Vec3A,
        /// Radius (metres).
        radius: f32,
    },
    /// A flat disc; its outside is the side of the normal. Texture coordinates: the square about it, (0.5, 0.5) in
    /// the middle.
    Disc {
        /// Centre (metres).
        centre: Vec3A,
        /// Unit normal.
        normal: Vec3A,
        /// Radius (metres).
        radius: f32,
    },
    /// Triangles.
    Mesh(TriangleMesh),
}

impl ShapeDesc {
    /// The shape under a transform; its outside stays the outside, also under a reflection.
    ///
    /// # Errors
    /// A message where the transform is singular, or takes a sphere or a disc to what is none.
    pub fn transformed(self, by: &Affine3A) -> Result<Self, String> {
        if transform::is_singular(by) {
            return Err(
                "the transform is singular: it flattens the shape, or has a number that is not finite".into(),
            );
        }
        let moved = match self {
            Self::Sphere { centre, radius } => {
                let scale = transform::similarity_scale(by)
                    .ok_or("a sphere can only be scaled by the same factor in all directions")?;
                Self::Sphere { centre: by.transform_point3a(centre), radius: radius * scale }
            }
            Self::Disc { centre, normal, radius } => {
                let scale = transform::circle_scale(by, normal.into())
                    .ok_or("a disc can only be scaled by the same factor in all directions of its plane")?;
                let normal =
                    Vec3A::from(transform::normal_matrix(by) * Vec3::from(normal)).normalize_or_zero();
                Self::Disc { centre: by.transform_point3a(centre), normal, radius: radius * scale }
            }
            Self::Mesh(mesh) => Self::Mesh(mesh.transformed(by)?),
        };
        moved.check()?;
        Ok(moved)
    }

    /// Whether the numbers make a shape. Meshes have been checked when they were made.
    ///
    /// # Errors
    /// A message where a number is not finite, a radius is not positive or a normal is not of unit length.
    pub fn check(&self) -> Result<(), String> {
        let (centre, radius) = match self {
            Self::Sphere { centre, radius } | Self::Disc { centre, radius, .. } => (*centre, *radius),
            Self::Mesh(_) => return Ok(()),
        };
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(format!("the radius must be positive and finite, it is {radius}"));
        }
        if !centre.is_finite() {
            return Err(format!("the centre must be finite, it is {centre}"));
        }
        if let Self::Disc { normal, .. } = self
            && !normal.is_normalized()
        {
            return Err(format!("the normal must be of unit length, it is {normal}"));
        }
        Ok(())
    }

    /// Number of primitives.
    pub(super) fn primitives(&self) -> usize {
        match self {
            Self::Sphere { .. } | Self::Disc { .. } => 1,
            Self::Mesh(mesh) => mesh.indices().len(),
        }
    }

    /// The least box about it.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Sphere { centre, radius } => {
                Aabb { min: *centre - Vec3A::splat(*radius), max: *centre + Vec3A::splat(*radius) }
            }
            Self::Disc { centre, normal, radius } => {
                // Half the extent along an axis is r·sin of the angle between axis and normal.
                let sin2 = (Vec3A::ONE - *normal * *normal).max(Vec3A::ZERO);
                let half = *radius * Vec3A::new(sin2.x.sqrt(), sin2.y.sqrt(), sin2.z.sqrt());
                Aabb { min: *centre - half, max: *centre + half }
            }
            Self::Mesh(mesh) => mesh.bounds(),
        }
    }

    /// Area in m².
    pub(super) fn area(&self) -> f64 {
        match *self {
            Self::Sphere { centre, radius } => Sphere { centre, radius }.area(),
            Self::Disc { centre, normal, radius } => Disc { centre, normal, radius }.area(),
            Self::Mesh(ref mesh) => (0..mesh.indices().len()).map(|i| mesh.triangle_area(i)).sum(),
        }
    }
}

/// Places by coordinates along two edges of a triangle or of a parallelogram, in f64, so that they lie in its plane up to
/// one rounding, however large it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub corner: DVec3,
    /// From the corner to the second and to the third.
    pub edges: [DVec3; 2],
}

impl Span {
    #[inline]
    pub(super) fn of(corners: [Vec3; 3]) -> Self {
        let [corner, second, third] = corners.map(|v| v.as_dvec3());
        Self { corner, edges: [second - corner, third - corner] }
    }

    /// The place with the coordinates `at`: of a triangle, the barycentric ones of its second and third corner.
    #[inline(always)]
    pub(super) fn at(&self, at: Vec2) -> Vec3A {
        let [u, v] = self.edges;
        (self.corner + u * f64::from(at.x) + v * f64::from(at.y)).as_vec3a()
    }
}

/// The point of a mesh's triangle at barycentric coordinates `b`, which is at `p`, with all that belongs to it.
#[inline]
pub(super) fn mesh_point(
    mesh: &TriangleMesh,
    triangle: usize,
    (b, p): (Vec2, Vec3A),
    shape: u32,
    prim: u32,
) -> SurfacePoint {
    let ng = mesh.facet(triangle);
    let (ns, uv) = mesh.attributes(triangle, b);
    let ns = match ns.and_then(Vec3A::try_normalize) {
        Some(ns) if ns.dot(ng) >= 0.0 => ns,
        Some(ns) => -ns,
        None => ng,
    };
    SurfacePoint { p, ng, ns, uv, shape, prim }
}
