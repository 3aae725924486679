//! Points drawn on shapes.

use super::facing::Facing;
use super::parallelogram::{self, Parallelogram};
use super::quadric::{Disc, Sphere};
use super::shape::Span;
use super::{Geometry, Shape, ShapeDesc, SurfacePoint, TriangleMesh};
use crate::math::{Discrete, warp};
use glam::{DVec3, Vec2, Vec3A};

/// A point on a shape, without what only materials ask for.
pub(crate) struct Place {
    /// Position, within a rounding of f32 of the true surface (metres).
    pub p: Vec3A,
    /// Unit geometric normal on the outside.
    pub ng: Vec3A,
    /// Which primitive, counted over all shapes.
    pub prim: u32,
}

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
            ShapeDesc::Sphere { centre, radius } => {
                let sphere = Sphere { centre, radius };
                sphere.point(sphere.sample_area(u), shape, s.first)
            }
            ShapeDesc::Disc { centre, normal, radius } => {
                let disc = Disc { centre, normal, radius };
                disc.point(disc.sample_area(u), shape, s.first)
            }
            ShapeDesc::Mesh(ref mesh) => {
                let (i, facet, b) = s.sample_triangle(mesh, u);
                self.on_triangle(s.first + i as u32, b, facet.span.at(b))
            }
        }
    }

    /// As [`Self::sample_area`], of the point only what a light needs: it takes a fraction of the time.
    #[inline]
    pub(crate) fn sample_place(&self, shape: u32, u: Vec2) -> Place {
        let s = &self.shapes[shape as usize];
        let ((p, ng), prim) = match s.desc {
            ShapeDesc::Sphere { centre, radius } => {
                let sphere = Sphere { centre, radius };
                (sphere.place(sphere.sample_area(u)), s.first)
            }
            ShapeDesc::Disc { centre, normal, radius } => {
                let disc = Disc { centre, normal, radius };
                (disc.place(disc.sample_area(u)), s.first)
            }
            ShapeDesc::Mesh(ref mesh) => {
                if let Some(whole) = &s.facets(mesh).whole {
                    return whole.place(s.first, u);
                }
                let (i, facet, b) = s.sample_triangle(mesh, u);
                ((facet.span.at(b), facet.ng), s.first + i as u32)
            }
        };
        Place { p, ng, prim }
    }

    /// A point on a shape for light that goes to `from`, and its density per area. On a sphere seen from outside:
    /// uniform in the cone of directions that see it. Otherwise uniform over the area. `None` where the density is 0
    /// (a point at the very rim).
    pub fn sample_toward(&self, shape: u32, from: Vec3A, u: Vec2) -> Option<(SurfacePoint, f32)> {
        let point = match self.sample_cone(shape, from, u) {
            Some((sphere, n)) => sphere.point(n, shape, self.shapes[shape as usize].first),
            None => self.sample_area(shape, u),
        };
        let pdf = self.pdf_toward(shape, from, &point);
        (pdf > 0.0).then_some((point, pdf))
    }

    /// As [`Self::sample_toward`], of the point only what a light needs; of a mesh by where its triangles face
    /// ([`super::facing`]). `both`: the shape shines on either side.
    #[inline(always)]
    pub(crate) fn sample_place_toward(
        &self,
        shape: u32,
        from: Vec3A,
        both: bool,
        u: Vec2,
    ) -> Option<(Place, f32)> {
        let s = &self.shapes[shape as usize];
        // The commonest, without a call.
        if let ShapeDesc::Mesh(ref mesh) = s.desc
            && let Some(whole) = &s.facets(mesh).whole
        {
            return Some((whole.place(s.first, u), s.inv_area));
        }
        self.sample_rarer_toward(shape, from, both, u)
    }

    #[inline(never)]
    fn sample_rarer_toward(&self, shape: u32, from: Vec3A, both: bool, u: Vec2) -> Option<(Place, f32)> {
        let s = &self.shapes[shape as usize];
        match s.desc {
            ShapeDesc::Sphere { .. } => return self.sample_sphere_toward(shape, from, u),
            ShapeDesc::Mesh(ref mesh) => {
                let facets = s.facets(mesh);
                if let Some(facing) = &facets.facing {
                    let (i, rest, pdf) = facing.sample(from, both, u.x)?;
                    let facet = &facets.list[i];
                    let p = facet.span.at(warp::uniform_triangle(Vec2::new(rest, u.y)));
                    return Some((Place { p, ng: facet.ng, prim: s.first + i as u32 }, pdf));
                }
            }
            ShapeDesc::Disc { .. } => {}
        }
        (s.inv_area > 0.0).then(|| (self.sample_place(shape, u), s.inv_area))
    }

    /// [`Self::sample_place_toward`] of a sphere.
    #[inline(never)]
    fn sample_sphere_toward(&self, shape: u32, from: Vec3A, u: Vec2) -> Option<(Place, f32)> {
        let place = match self.sample_cone(shape, from, u) {
            Some((sphere, n)) => {
                let (p, ng) = sphere.place(n);
                Place { p, ng, prim: self.shapes[shape as usize].first }
            }
            None => self.sample_place(shape, u),
        };
        let pdf = self.pdf_in_cone(shape, from, (place.p, place.ng));
        (pdf > 0.0).then_some((place, pdf))
    }

    /// Of a sphere seen from outside: the direction from its centre to a point that is uniform in the cone of
    /// directions in which `from` sees it.
    #[inline]
    fn sample_cone(&self, shape: u32, from: Vec3A, u: Vec2) -> Option<(Sphere, DVec3)> {
        match self.shapes[shape as usize].desc {
            ShapeDesc::Sphere { centre, radius } => {
                let sphere = Sphere { centre, radius };
                Some((sphere, sphere.sample_cone(from, u)?))
            }
            ShapeDesc::Disc { .. } | ShapeDesc::Mesh(_) => None,
        }
    }

    /// Density per area with which [`Self::sample_toward`] gives `point` from `from`.
    #[inline]
    pub fn pdf_toward(&self, shape: u32, from: Vec3A, point: &SurfacePoint) -> f32 {
        self.pdf_in_cone(shape, from, (point.p, point.ng))
    }

    /// Density per area with which [`Self::sample_place_toward`] gives a position, with the normal and the primitive there.
    #[inline]
    pub(crate) fn pdf_place_toward(
        &self,
        shape: u32,
        from: Vec3A,
        both: bool,
        (p, ng, prim): (Vec3A, Vec3A, u32),
    ) -> f32 {
        let s = &self.shapes[shape as usize];
        if let ShapeDesc::Mesh(ref mesh) = s.desc
            && let Some(facing) = &s.facets(mesh).facing
        {
            return facing.pdf(from, both, (prim - s.first) as usize);
        }
        self.pdf_in_cone(shape, from, (p, ng))
    }

    /// Density per area of a position with the normal there: in the cone in which a sphere is seen, else uniform.
    #[inline]
    fn pdf_in_cone(&self, shape: u32, from: Vec3A, place: (Vec3A, Vec3A)) -> f32 {
        let s = &self.shapes[shape as usize];
        let cone = match s.desc {
            ShapeDesc::Sphere { centre, radius } => Sphere { centre, radius }.pdf_cone(from, place),
            ShapeDesc::Disc { .. } | ShapeDesc::Mesh(_) => None,
        };
        cone.unwrap_or(s.inv_area)
    }
}

/// A mesh's triangles as sampling wants them.
#[derive(Debug)]
pub(super) struct Facets {
    /// Which one, by area.
    picker: Discrete,
    list: Vec<Facet>,
    /// Of a mesh that is one parallelogram.
    whole: Option<Whole>,
    /// Where they face; `None` where all face the same way.
    facing: Option<Facing>,
}

/// A triangle, or a parallelogram, for points on it.
#[derive(Clone, Copy, Debug)]
struct Facet {
    /// Unit normal on the outside.
    ng: Vec3A,
    span: Span,
}

/// A mesh that is one parallelogram.
#[derive(Debug)]
struct Whole {
    facet: Facet,
    /// See [`Parallelogram::triangles`].
    triangles: [u32; 2],
}

impl Whole {
    fn of(p: &Parallelogram, facets: &[Facet]) -> Self {
        let facet = Facet { span: Span::of(p.corners), ..facets[p.triangles[0]] };
        Self { facet, triangles: p.triangles.map(|i| i as u32) }
    }

    /// The point at the coordinates `u` along the edges; `first`: the first of its primitives.
    #[inline(always)]
    fn place(&self, first: u32, u: Vec2) -> Place {
        let prim = first + self.triangles[usize::from(u.y > u.x)];
        Place { p: self.facet.span.at(u), ng: self.facet.ng, prim }
    }
}

impl Facets {
    fn of(mesh: &TriangleMesh) -> Option<Self> {
        let count = mesh.indices().len();
        let picker = Discrete::new((0..count).map(|i| mesh.triangle_area(i)))?;
        let facet = |i| Facet { ng: mesh.facet(i), span: Span::of(mesh.corners(i)) };
        let list: Vec<_> = (0..count).map(facet).collect();
        let whole = Parallelogram::of(mesh, 0).filter(|_| count == 2).map(|p| Whole::of(&p, &list));
        Some(Self { picker, list, whole, facing: Facing::of(mesh) })
    }
}

impl Shape {
    #[inline]
    fn facets(&self, mesh: &TriangleMesh) -> &Facets {
        let facets = self.facets.get_or_init(|| Facets::of(mesh)).as_ref();
        facets.expect("a mesh has a triangle with an area, and no other triangles")
    }

    /// A triangle of a mesh by area, and barycentric coordinates of its second and third corner, uniform over it.
    #[inline]
    fn sample_triangle(&self, mesh: &TriangleMesh, u: Vec2) -> (usize, &Facet, Vec2) {
        let facets = self.facets(mesh);
        if let Some(whole) = &facets.whole {
            let (k, b) = parallelogram::split(u);
            let i = whole.triangles[k & 1] as usize;
            return (i, &facets.list[i], b);
        }
        let (i, rest) = facets.picker.sample(u.x);
        (i, &facets.list[i], warp::uniform_triangle(Vec2::new(rest, u.y)))
    }
}
