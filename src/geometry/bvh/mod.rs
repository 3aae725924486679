//! The acceleration structure: a tree of four-way nodes over blocks of up to four triangles or
//! parallelograms, spheres and discs.
//!
//! obvhs builds a binary tree (parallel locally-ordered clustering, then reinsertion); [`build`] merges it into
//! four-way nodes with the least expected cost, and [`traverse`] walks it with four boxes a step. Boxes are kept in
//! full f32, so there is no grid to fall off in small scenes, and each ray widens them by a bound on what rounding can
//! do to it: see [`traverse::Query`].

mod build;
mod traverse;

use super::aabb::Aabb;
use super::lanes::eight::Eight;
use super::parallelogram::{self, Parallelogram};
use super::quadric::{Disc, Sphere, Spheres};
use super::slab::FourBoxes;
use super::triangle::Block;
use glam::{Vec2, Vec3};

/// A primitive to build over.
pub(super) enum Primitive {
    Triangle([Vec3; 3]),
    /// Two triangles, that of the primitive's index and the next.
    Parallelogram(Parallelogram),
    Sphere(Sphere),
    Disc(Disc),
}

/// What a child of a node is: three bits of kind, then an index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(u32);

/// A child, taken apart.
pub(super) enum Leaf {
    Block(usize),
    Parallelograms(usize),
    Sphere(usize),
    Disc(usize),
}

const INDEX_BITS: u32 = 29;

impl Child {
    const NODE: u32 = 0;
    const BLOCK: u32 = 1;
    const SPHERE: u32 = 2;
    const DISC: u32 = 3;
    const PARALLELOGRAMS: u32 = 4;
    const NONE: Self = Self(0);

    #[inline]
    fn new(kind: u32, index: usize) -> Self {
        debug_assert!(index < 1 << INDEX_BITS);
        Self(kind << INDEX_BITS | index as u32)
    }

    #[inline(always)]
    fn index(self) -> usize {
        (self.0 & ((1 << INDEX_BITS) - 1)) as usize
    }

    #[inline(always)]
    fn kind(self) -> u32 {
        self.0 >> INDEX_BITS
    }

    /// The leaf that it is. Not for inner nodes.
    #[inline(always)]
    pub(super) fn leaf(self) -> Leaf {
        match self.kind() {
            Self::BLOCK => Leaf::Block(self.index()),
            Self::PARALLELOGRAMS => Leaf::Parallelograms(self.index()),
            Self::SPHERE => Leaf::Sphere(self.index()),
            _ => Leaf::Disc(self.index()),
        }
    }
}

/// Four boxes and what is in them; 112 bytes. The box of an empty place is inside out and is never entered.
#[derive(Clone, Debug)]
#[repr(C)]
struct Node {
    /// For each axis, the lower and the upper bounds of the four boxes.
    bounds: FourBoxes,
    child: [Child; 4],
}

/// What a ray met first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub t: f32,
    pub child: Child,
    pub lane: usize,
    /// Of a triangle: barycentric coordinates of the second and third corner; of a parallelogram s and t.
    pub at: Vec2,
}

/// The tree with its primitives.
#[derive(Debug, Default)]
pub(super) struct Bvh {
    nodes: Vec<Node>,
    pub blocks: Vec<Block>,
    pub parallelograms: Vec<parallelogram::Block>,
    /// The same in pairs, where all leaves are asked and the processor has eight lanes.
    pairs: Vec<parallelogram::Pair>,
    /// And the spheres.
    octet: Option<Spheres<Eight>>,
    pub spheres: Vec<(Sphere, u32)>,
    pub discs: Vec<(Disc, u32)>,
    /// Entries that the stack of a traversal can come to hold.
    stack: usize,
    bounds: Option<Aabb>,
    /// There are so few leaves that no tree is needed.
    flat: bool,
    /// Whether the processor has eight lanes, see [`super::lanes::eight`].
    wide: bool,
}

impl Bvh {
    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
            + size_of_val(&*self.blocks)
            + size_of_val(&*self.parallelograms)
            + size_of_val(&*self.pairs)
            + size_of_val(&*self.spheres)
            + size_of_val(&*self.discs)
    }
}

#[cfg(test)]
mod tests {
    use super::super::lanes::eight;
    use super::super::mesh::TriangleMesh;
    use super::super::ray::{Ends, Footing, Ray};
    use super::super::triangle::Shear;
    use super::{Bvh, Parallelogram, Primitive, Sphere};
    use crate::math::{Stream, StreamKind, warp};

    impl Bvh {
        /// Distance of the closest hit, by all leaves one by one.
        pub(in super::super) fn closest_of_all(&self, ray: &Ray) -> Option<f32> {
            let shear = Shear::new(ray);
            let line = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
            let mut t = ray.t_max;
            for block in &self.blocks {
                t = block.hit::<false>(ray, &shear, t).map_or(t, |h| h.0);
            }
            for block in &self.parallelograms {
                t = block.hit::<false>(ray, t).map_or(t, |h| h.0);
            }
            for (sphere, _) in &self.spheres {
                t = sphere.hit(line, f64::from(t)).map_or(t, |h| h as f32);
            }
            for (disc, _) in &self.discs {
                t = disc.hit(line, f64::from(t)).map_or(t, |h| h as f32);
            }
            (t < ray.t_max).then_some(t)
        }
    }

    #[test]
    fn stacks_of_all_sizes_serve() {
        let mut s = Stream::new(1, 0, StreamKind::Other, 0);
        let mut random = || warp::uniform_sphere(s.next_2d());
        let triangles: Vec<_> = (0..500)
            .map(|i| {
                let p = random();
                (Primitive::Triangle([p, p + 0.3 * random(), p + 0.3 * random()].map(Into::into)), i)
            })
            .collect();
        let mut bvh = Bvh::build(&triangles);
        let needed = bvh.stack;
        assert!((10..=48).contains(&needed), "{needed}");
        let rays: Vec<_> = (0..2000).map(|_| Ray::new(random() * 0.5, random())).collect();
        let expected: Vec<_> = rays.iter().map(|r| bvh.closest_of_all(r)).collect();
        assert!(expected.iter().flatten().count() > 500);
        for size in [needed, 48, 49, 128, 129, 1000] {
            bvh.stack = size;
            for (ray, expected) in rays.iter().zip(&expected) {
                assert_eq!(bvh.closest(ray).map(|f| f.t), *expected);
                assert_eq!(bvh.any(ray), expected.is_some());
            }
        }
    }

    /// With few leaves and with a tree; in the first all are asked, also of pairs with one block.
    #[test]
    fn eight_lanes_find_what_four_do() {
        if !eight::is_at_hand() {
            println!("skipped: this processor has four");
            return;
        }
        let mut s = Stream::new(2, 0, StreamKind::Other, 0);
        for faces in [1, 4, 5, 8, 11, 16, 30, 200] {
            let build = |s: &mut Stream| {
                // So coarse that sums are exact.
                let mut point = || (warp::uniform_sphere(s.next_2d()) * 1024.0).round() / 1024.0;
                let square = |i: usize| {
                    let (p, u, v) = (point(), point(), point());
                    let corners = [p, p + u, p + u + v, p + v];
                    let mesh = TriangleMesh::new(
                        corners.map(Into::into).to_vec(),
                        None,
                        None,
                        vec![[0, 1, 2], [0, 2, 3]],
                    );
                    let whole = Parallelogram::of(&mesh.expect("a mesh"), 0).expect("a parallelogram");
                    (Primitive::Parallelogram(whole), 2 * i as u32)
                };
                let mut primitives: Vec<_> = (0..faces).map(square).collect();
                for i in 0..[2, 1, 0, 5][faces % 4] {
                    let sphere = Sphere { centre: 0.9 * point(), radius: 0.1 + 0.2 * i as f32 };
                    primitives.push((Primitive::Sphere(sphere), 2 * faces as u32 + i));
                }
                Bvh::build(&primitives)
            };
            let (wide, mut narrow) = (build(&mut s.clone()), build(&mut s));
            assert!(wide.wide);
            narrow.wide = false;
            let mut hits = 0;
            for _ in 0..5_000 {
                let [origin, dir] = [0, 1].map(|_| warp::uniform_sphere(s.next_2d()));
                let t_max = if s.next_1d() < 0.5 { f32::INFINITY } else { 2.0 * s.next_1d() };
                let [from, to] = [0, 1].map(|_| Footing::key((s.next_1d() * 2.0 * faces as f32) as u32));
                let ends = Ends::new(from, to);
                let ray = Ray { t_max, ends, ..Ray::new(0.3 * origin, dir) };
                let (found, expected) = (wide.closest(&ray), narrow.closest(&ray));
                assert_eq!(format!("{found:?}"), format!("{expected:?}"));
                assert_eq!(wide.any(&ray), narrow.any(&ray));
                hits += usize::from(expected.is_some());
            }
            assert!(hits > 10 * faces.min(10), "{hits} of {faces}");
        }
    }
}
