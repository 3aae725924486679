//! Up to four parallelograms against a ray at once.
//!
//! Rectangles and boxes are meshes, two triangles a face. Where two triangles, one after the other, are a parallelogram to
//! the last bit, the acceleration structure holds it whole: the place in its plane has coordinates s and t along its
//! edges, affine functions of the position, and one test takes the place of two. f32 only tells what is missed for sure,
//! with a bound on its rounding; what is left is decided in f64. Its hits are still hits of the triangles.

use super::lanes::{Lanes, dot, eight, eight::Eight, in_lanes};
use super::mesh::{TriangleMesh, cross};
use super::ray::{Footing, Ray};
use super::shape::Span;
use super::triangle::{LANES, Plane};
use crate::math::choose;
use glam::{DVec3, Vec2, Vec3, Vec3A, Vec4};

/// How far over its rim a parallelogram is hit, as part of its edges: rounding of f64 shall open no gap between two.
const RIM: f64 = 1e-12;

/// Roundings of f32 in the test's affine functions, times what they round (see [`Block::candidates`]).
const ROUNDING: f32 = 1.0 / (1 << 19) as f32;

/// Edges that f32 can divide by, and by their squares (metres).
const LENGTHS: std::ops::Range<f64> = 1e-15..1e15;

/// Sine of the least angle between the edges.
const LEAST_SINE: f64 = 1e-2;

/// corner + s·(second − corner) + t·(third − corner), s and t in [0, 1].
#[derive(Clone, Copy, Debug)]
pub(super) struct Parallelogram {
    /// The corner, and those at s = 1 and t = 1.
    pub corners: [Vec3; 3],
    /// Its triangles, counted from the first of the two: where t ≤ s, and the other.
    pub triangles: [usize; 2],
    /// Of a flat one: unit normal on the outside, and how texture coordinates go on from the corner.
    flat: Option<Flat>,
}

/// Of a parallelogram without shading normals whose texture coordinates are affine in s and t.
#[derive(Clone, Copy, Debug)]
struct Flat {
    /// Unit normal on the outside.
    ng: Vec3A,
    /// At the corner, and their change over s and over t.
    uv: [Vec2; 3],
}

impl Flat {
    fn of(mesh: &TriangleMesh, first: usize, [a, b, c, d]: [u32; 4]) -> Option<Self> {
        let uvs = mesh.uvs().filter(|_| mesh.normals().is_none())?;
        let [a, b, c, d] = [a, b, c, d].map(|i| uvs[i as usize]);
        (c - b == d - a).then(|| Self { ng: mesh.facet(first), uv: [a, b - a, d - a] })
    }

    /// Texture coordinates at (s, t).
    #[inline]
    fn uv(&self, at: Vec2) -> Vec2 {
        self.uv[0] + self.uv[1] * at.x + self.uv[2] * at.y
    }
}

impl Parallelogram {
    /// The one that triangles `i` and `i + 1` of a mesh are, if they are.
    pub(super) fn of(mesh: &TriangleMesh, i: usize) -> Option<Self> {
        if i + 1 >= mesh.indices().len() {
            return None;
        }
        // (a, b, c) and (a, c, d), or the other way about, as after a reflection.
        [[0, 1], [1, 0]].into_iter().find_map(|triangles| {
            let [[a, b, c], [a2, c2, d]] = triangles.map(|k| mesh.corners(i + k));
            let exact = a == a2 && c == c2 && c.as_dvec3() - b.as_dvec3() == d.as_dvec3() - a.as_dvec3();
            let lengths = Span::of([a, b, d]).edges.map(DVec3::length);
            let fits = lengths.iter().all(|l| LENGTHS.contains(l))
                && cross([a, b, d]).length() > LEAST_SINE * lengths[0] * lengths[1];
            let [[ia, ib, ic], [.., id]] = triangles.map(|k| mesh.indices()[i + k]);
            (exact && fits).then(|| {
                let flat = Flat::of(mesh, i + triangles[0], [ia, ib, ic, id]);
                Self { corners: [a, b, d], triangles, flat }
            })
        })
    }

    /// All four corners.
    pub(super) fn all_corners(&self) -> [Vec3; 4] {
        let [a, b, d] = self.corners;
        [a, b, b + (d - a), d]
    }
}

/// Which of a parallelogram's two triangles (see [`Parallelogram::triangles`]) has the coordinates (s, t), and the
/// barycentric coordinates of its second and third corner there.
#[inline]
pub(super) fn split(Vec2 { x: s, y: t }: Vec2) -> (usize, Vec2) {
    let first = t <= s;
    (usize::from(!first), Vec2::new(s - choose(first, t, 0.0), t - choose(first, 0.0, s)))
}

/// An affine function of the position, for each lane: coefficients of x, y, z, and the constant.
type Affine<L> = [L; 4];

/// What f32 needs to rule parallelograms out.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
struct Test<L> {
    /// Over the plane (metres).
    height: Affine<L>,
    /// s − ½ and t − ½.
    edges: [Affine<L>; 2],
    /// The largest coordinate of a corner (metres), times [`ROUNDING`].
    reach: L,
    /// The larger sum of the coefficients' sizes of `edges` (1/m).
    slope: L,
    /// [`Footing::key`] of both primitives; of what is not used NaN.
    keys: [L; 2],
    used: u32,
}

/// Up to four parallelograms.
#[derive(Clone, Debug)]
#[repr(C)]
pub(super) struct Block {
    test: Test<Vec4>,
    /// Primitives, counted over all shapes, in the order of [`Parallelogram::triangles`].
    prims: [[u32; 2]; LANES],
    exact: [Exact; LANES],
}

/// The tests of two blocks, one after the other, in one.
#[derive(Clone, Debug)]
pub(super) struct Pair(Test<Eight>);

/// A lane in f64.
#[derive(Clone, Copy, Debug)]
struct Exact {
    plane: Plane,
    span: Span,
    /// Gradients of s and t.
    duals: [DVec3; 2],
    flat: Option<Flat>,
}

/// What is at a place of a lane.
pub(super) struct There {
    /// Counted over all shapes.
    pub prim: u32,
    /// Of the primitive's second and third corner.
    pub barycentric: Vec2,
    /// Computed in f64 and rounded once (metres).
    pub p: Vec3A,
    /// The rest, where it is at hand: normal and texture coordinates.
    pub flat: Option<(Vec3A, Vec2)>,
}

/// Where a lane is hit: s and t are these over `rate`.
struct Inside {
    distance: f32,
    coordinates: [f64; 2],
    rate: f64,
}

impl Exact {
    fn new(Parallelogram { corners, flat, .. }: Parallelogram) -> Self {
        let (plane, span) = (Plane::of(corners), Span::of(corners));
        let [u, v] = span.edges;
        let across = [v.cross(plane.normal()), plane.normal().cross(u)];
        let duals = std::array::from_fn(|k| across[k] / across[k].dot(span.edges[k]));
        Self { plane, span, duals, flat }
    }

    /// Where a ray hits, if in (0, `limit`).
    #[inline(always)]
    fn hit(&self, ray: &Ray, limit: f32) -> Option<Inside> {
        let crossing = self.plane.crossing(ray, limit)?;
        let (height, rate) = (crossing.height, crossing.rate);
        // The place less the corner, times the rate, so that misses divide by nothing.
        let place = (ray.origin.as_dvec3() - self.span.corner) * rate + ray.dir.as_dvec3() * height;
        let coordinates = self.duals.map(|dual| dual.dot(place));
        let outside = |x: f64| (x - 0.5 * rate).abs() > (0.5 + RIM) * rate.abs();
        if coordinates.into_iter().any(outside) {
            return None;
        }
        Some(Inside { distance: crossing.distance(), coordinates, rate })
    }
}

#[inline(always)]
fn affine<L: Lanes>(f: &Affine<L>, x: &[L; 3]) -> L {
    (f[0] * x[0] + f[1] * x[1]) + (f[2] * x[2] + f[3])
}

#[inline(always)]
fn linear<L: Lanes>(f: &Affine<L>, x: &[L; 3]) -> L {
    dot(&[f[0], f[1], f[2]], x)
}

impl Test<Vec4> {
    /// Of none.
    fn none() -> Self {
        Self {
            height: [Vec4::ZERO; 4],
            edges: [[Vec4::ZERO; 4]; 2],
            reach: Vec4::ZERO,
            slope: Vec4::ZERO,
            keys: [Vec4::NAN; 2],
            used: 0,
        }
    }
}

impl<L: Lanes> Test<L> {
    /// The lanes that a ray may hit before `nearest`, as far as f32 tells.
    ///
    /// With M the sum of the largest coordinates of origin and corners, heights are wrong by no more than 9·2⁻²⁴·M and
    /// rates by 7·2⁻²⁴. A hit is at most √3·M away, so the distance is wrong by 22·2⁻²⁴·M/|rate|, and s and t by as much
    /// times the sum of their coefficients' sizes, and 15·2⁻²⁴·M times that sum of their own. Where the rate is 0, all
    /// bounds are infinite or NaN, and no comparison with those rules a lane out.
    ///
    /// A segment mostly has both ends on one side of a plane, as in a room. The height of its end is wrong by no more than
    /// 12·2⁻²⁴ times M with its length; of a ray without an end all is infinite or NaN again.
    #[inline(always)]
    fn candidates<const ANY: bool>(&self, ray: &Ray, nearest: f32) -> u32 {
        let (origin, dir) = (in_lanes(ray.origin), in_lanes(ray.dir));
        let (nearest_all, one) = (L::splat(nearest), L::splat(1.0));
        let rate = linear(&self.height, &dir);
        let height = affine(&self.height, &origin);
        let [from, to] = ray.ends.keys();
        let (from, to) = (L::splat(from), L::splat(to));
        let mut out = self.keys[0].equals(from) | self.keys[1].equals(from);
        let size = ray.origin.abs().max_element() + if ANY { nearest } else { 0.0 };
        let reach = self.reach + L::splat(size * ROUNDING);
        if ANY {
            let end = height + rate * nearest_all;
            out = out | self.keys[0].equals(to) | self.keys[1].equals(to);
            out = out | reach.below(height.min(end)) | height.max(end).below(-reach);
            if self.used & !L::bits(out) == 0 {
                return 0;
            }
        }
        let inverse = one / rate;
        let t = -height * inverse;
        let margin = reach * (inverse.abs() + one);
        let place = [origin[0] + t * dir[0], origin[1] + t * dir[1], origin[2] + t * dir[2]];
        let (x, y) = (affine(&self.edges[0], &place).abs(), affine(&self.edges[1], &place).abs());
        let rim = margin * self.slope + L::splat(0.5);
        out = out | t.below(-margin) | (margin + nearest_all).below(t) | rim.below(x.max(y));
        self.used & !L::bits(out)
    }
}

impl Pair {
    const LANES: usize = 2 * LANES;

    /// Of one block or two.
    pub(super) fn of(blocks: &[Block]) -> Self {
        let none = Test::none();
        let (low, high) = (&blocks[0].test, blocks.get(1).map_or(&none, |block| &block.test));
        let both = |low: Vec4, high: Vec4| eight::of(low.to_array(), high.to_array());
        let affine = |low: &Affine<Vec4>, high: &Affine<Vec4>| std::array::from_fn(|k| both(low[k], high[k]));
        Self(Test {
            height: affine(&low.height, &high.height),
            edges: [0, 1].map(|k| affine(&low.edges[k], &high.edges[k])),
            reach: both(low.reach, high.reach),
            slope: both(low.slope, high.slope),
            keys: [0, 1].map(|k| both(low.keys[k], high.keys[k])),
            used: low.used | high.used << LANES,
        })
    }
}

impl Block {
    /// How many [`Self::hit_of`] takes.
    pub(super) const AT_ONCE: usize = u32::BITS as usize / LANES;

    /// From one to four, each with the primitive index of the first of its two triangles.
    pub(super) fn new(members: &[(Parallelogram, u32)]) -> Self {
        let empty = Exact {
            plane: Plane::NOWHERE,
            span: Span::of([Vec3::ZERO; 3]),
            duals: [DVec3::ZERO; 2],
            flat: None,
        };
        let mut block = Self { test: Test::none(), prims: [[u32::MAX; 2]; LANES], exact: [empty; LANES] };
        let test = &mut block.test;
        test.used = (1 << members.len()) - 1;
        for (lane, (member, first)) in members.iter().enumerate() {
            let exact = Exact::new(*member);
            let set = |f: &mut Affine<Vec4>, gradient: DVec3, constant: f64| {
                let rows = [gradient.x, gradient.y, gradient.z, constant];
                f.iter_mut().zip(rows).for_each(|(row, x)| row[lane] = x as f32);
                gradient.as_vec3().abs().element_sum()
            };
            let normal = exact.plane.normal();
            set(&mut test.height, normal, -normal.dot(exact.span.corner));
            let slopes: [f32; 2] = std::array::from_fn(|k| {
                let dual = exact.duals[k];
                set(&mut test.edges[k], dual, -0.5 - dual.dot(exact.span.corner))
            });
            test.slope[lane] = slopes[0].max(slopes[1]);
            let corners = member.all_corners();
            test.reach[lane] = ROUNDING * corners.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
            block.prims[lane] = member.triangles.map(|k| first + k as u32);
            for (keys, prim) in test.keys.iter_mut().zip(block.prims[lane]) {
                keys[lane] = Footing::key(prim);
            }
            block.exact[lane] = exact;
        }
        block
    }

    /// The nearest hit in (0, `nearest`): distance, lane, s and t. Of `ANY` hit there only the lane.
    #[inline(always)]
    pub(super) fn hit<const ANY: bool>(&self, ray: &Ray, nearest: f32) -> Option<(f32, usize, Vec2)> {
        let mask = self.test.candidates::<ANY>(ray, nearest);
        Self::hit_among::<ANY>(std::slice::from_ref(self), mask, ray, nearest)
    }

    /// The nearest hit among several blocks, no more than [`Self::AT_ONCE`]. Lanes are counted through them. `pairs`: the
    /// same blocks in pairs, of which `WIDE` makes use.
    ///
    /// Which of them a ray hits nothing can foretell, but mostly it hits one: so all are asked before any is looked into.
    #[inline(always)]
    pub(super) fn hit_of<const ANY: bool, const WIDE: bool>(
        blocks: &[Self],
        pairs: &[Pair],
        ray: &Ray,
        nearest: f32,
    ) -> Option<(f32, usize, Vec2)> {
        let mut mask = 0;
        if WIDE {
            // Mostly there is one, and a loop would keep more at hand than there are registers.
            if let Some((Pair(test), rest)) = pairs.split_first() {
                mask = test.candidates::<ANY>(ray, nearest);
                if !rest.is_empty() {
                    // SAFETY: what is wide is run where there are eight lanes.
                    mask |= unsafe { Self::among_pairs::<ANY>(rest, ray, nearest) } << Pair::LANES;
                }
            }
        } else {
            for (i, block) in blocks.iter().enumerate() {
                mask |= block.test.candidates::<ANY>(ray, nearest) << (LANES * i);
            }
        }
        Self::hit_among::<ANY>(blocks, mask, ray, nearest)
    }

    /// The lanes of pairs that a ray may hit.
    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2"))]
    #[inline(never)]
    unsafe fn among_pairs<const ANY: bool>(pairs: &[Pair], ray: &Ray, nearest: f32) -> u32 {
        let mut mask = 0;
        for (i, Pair(test)) in pairs.iter().enumerate() {
            mask |= test.candidates::<ANY>(ray, nearest) << (Pair::LANES * i);
        }
        mask
    }

    /// The nearest hit among the lanes in `mask`.
    #[inline(always)]
    fn hit_among<const ANY: bool>(
        blocks: &[Self],
        mut mask: u32,
        ray: &Ray,
        mut nearest: f32,
    ) -> Option<(f32, usize, Vec2)> {
        let mut best = None;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            let Some(inside) = blocks[lane / LANES].exact[lane % LANES].hit(ray, nearest) else { continue };
            if ANY {
                return Some((0.0, lane, Vec2::ZERO));
            }
            nearest = inside.distance;
            best = Some((lane, inside));
        }
        best.map(|(lane, Inside { distance, coordinates: [s, t], rate })| {
            let scale = 1.0 / rate;
            (distance, lane, Vec2::new((s * scale) as f32, (t * scale) as f32).clamp(Vec2::ZERO, Vec2::ONE))
        })
    }

    /// What is at (s, t) of a lane.
    #[inline(always)]
    pub(super) fn place(&self, lane: usize, at: Vec2) -> There {
        let lane = lane & 3;
        let (triangle, barycentric) = split(at);
        let Exact { span, flat, .. } = &self.exact[lane];
        let flat = flat.as_ref().map(|f| (f.ng, f.uv(at)));
        There { prim: self.prims[lane][triangle & 1], barycentric, p: span.at(at), flat }
    }

    /// Primitives in it.
    #[cfg(test)]
    pub(super) fn primitives(&self) -> impl Iterator<Item = u32> {
        self.prims.into_iter().flatten().filter(|p| *p != u32::MAX)
    }
}
