//! Points drawn on shapes.

use super::quadric::{Disc, Sphere};
use super::{Geometry, Shape, ShapeDesc, SurfacePoint};
use crate::math::{Discrete, warp};
use glam::{Vec2, Vec3A};

impl Geometry {
    /// Area of a shape in m².
    #[inline]
    pub fn area(&self, shape: u32) -> f32 {
        self.shapes[shape as usize].area
    }

    /// A point uniform over a shape's area: density 1 / [`Self::area`].
    pub fn sample_area(&self, shape: u32, u: Vec2) -> SurfacePoint {
        let s = &self.shapes[shape as usize];
        match s.desc {
            ShapeDesc::Sphere { centre, radius } => Sphere { centre, radius }.sample_area(u, shape, s.first),
            ShapeDesc::Disc { centre, normal, radius } => {
                Disc { centre, normal, radius }.sample_area(u, shape, s.first)
            }
            ShapeDesc::Mesh(ref mesh) => {
                let (i, rest) = s.picker().map_or((0, u.x), |picker| picker.sample(u.x));
                let b = warp::uniform_triangle(Vec2::new(rest, u.y));
                self.triangle(s.first + i as u32, mesh.corners(i), b)
            }
        }
    }

    /// A point on a shape for light that goes to `from`, and its density per area. On a sphere seen from outside:
    /// uniform in the cone of directions that see it. Otherwise uniform over the area. `None` where the density is 0
    /// (a point at the very rim).
    pub fn sample_toward(&self, shape: u32, from: Vec3A, u: Vec2) -> Option<(SurfacePoint, f32)> {
        let s = &self.shapes[shape as usize];
        let cone = match s.desc {
            ShapeDesc::Sphere { centre, radius } => {
                Sphere { centre, radius }.sample_cone(from, u, shape, s.first)
            }
            ShapeDesc::Disc { .. } | ShapeDesc::Mesh(_) => None,
        };
        let point = cone.unwrap_or_else(|| self.sample_area(shape, u));
        let pdf = self.pdf_toward(shape, from, &point);
        (pdf > 0.0).then_some((point, pdf))
    }

    /// Density per area with which [`Self::sample_toward`] gives `point` from `from`.
    pub fn pdf_toward(&self, shape: u32, from: Vec3A, point: &SurfacePoint) -> f32 {
        let s = &self.shapes[shape as usize];
        let cone = match s.desc {
            ShapeDesc::Sphere { centre, radius } => Sphere { centre, radius }.pdf_cone(from, point),
            ShapeDesc::Disc { .. } | ShapeDesc::Mesh(_) => None,
        };
        cone.unwrap_or(1.0 / s.area)
    }
}

impl Shape {
    /// The triangles of a mesh by area.
    fn picker(&self) -> Option<&Discrete> {
        let make = || match &self.desc {
            ShapeDesc::Mesh(mesh) => Discrete::new((0..mesh.indices().len()).map(|i| mesh.triangle_area(i))),
            ShapeDesc::Sphere { .. } | ShapeDesc::Disc { .. } => None,
        };
        self.picker.get_or_init(make).as_ref()
    }
}
