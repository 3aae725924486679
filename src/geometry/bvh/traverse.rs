//! Rays through the tree.

use super::super::aabb::Aabb;
use super::super::parallelogram::Block;
use super::super::quadric::{Disc, Sphere};
use super::super::ray::Ray;
use super::super::slab::Line;
use super::super::triangle::{LANES, Shear};
use super::{Bvh, Child, Found, Leaf, Node};
use glam::{Vec2, Vec3A, Vec4};

/// Entries of the stack from here up are boxes that the ray misses.
const MISSED: u64 = (u32::MAX as u64) << 32;

/// What of a ray the tests of boxes and of triangles need.
pub(in super::super) struct Query {
    line: Line,
    shear: Shear,
}

impl Bvh {
    #[inline(always)]
    fn query(&self, ray: &Ray) -> Query {
        let nowhere = Aabb { min: Vec3A::ZERO, max: Vec3A::ZERO };
        let bounds = self.bounds.as_ref().unwrap_or(&nowhere);
        Query { line: Line::new(ray.origin, ray.dir, bounds), shear: Shear::new(ray) }
    }

    /// What the ray meets first.
    #[inline]
    pub(in super::super) fn closest(&self, ray: &Ray) -> Option<Found> {
        let mut found = Found { t: ray.t_max, child: Child::NONE, lane: 0, at: Vec2::ZERO };
        self.walk::<false>(ray, &mut found).then_some(found)
    }

    /// Whether the ray meets anything.
    #[inline]
    pub(in super::super) fn any(&self, ray: &Ray) -> bool {
        let mut found = Found { t: ray.t_max, child: Child::NONE, lane: 0, at: Vec2::ZERO };
        self.walk::<true>(ray, &mut found)
    }

    #[inline(always)]
    fn walk<const ANY: bool>(&self, ray: &Ray, found: &mut Found) -> bool {
        // SAFETY: what is wide is called where the processor has eight lanes.
        match (self.flat, self.wide) {
            (true, true) => unsafe { self.flat_wide::<ANY>(ray, found) },
            (true, false) => self.flat_narrow::<ANY>(ray, found),
            (false, true) => unsafe { self.tree_wide::<ANY>(ray, found) },
            (false, false) => self.tree_narrow::<ANY>(ray, found),
        }
    }

    /// Without a tree, for processors with eight lanes (see [`super::super::lanes::eight`]).
    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2"))]
    #[inline(never)]
    unsafe fn flat_wide<const ANY: bool>(&self, ray: &Ray, found: &mut Found) -> bool {
        self.walk_flat::<ANY, true>(ray, found)
    }

    #[inline(never)]
    fn flat_narrow<const ANY: bool>(&self, ray: &Ray, found: &mut Found) -> bool {
        self.walk_flat::<ANY, false>(ray, found)
    }

    /// Through the tree, for processors with eight lanes: the same, but their registers need fewer copies.
    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2"))]
    #[inline(never)]
    unsafe fn tree_wide<const ANY: bool>(&self, ray: &Ray, found: &mut Found) -> bool {
        self.walk_tree::<ANY>(ray, found)
    }

    #[inline(never)]
    fn tree_narrow<const ANY: bool>(&self, ray: &Ray, found: &mut Found) -> bool {
        self.walk_tree::<ANY>(ray, found)
    }

    #[inline(always)]
    fn walk_tree<const ANY: bool>(&self, ray: &Ray, found: &mut Found) -> bool {
        // Clearing a stack takes time, beside a query in a small scene.
        match self.stack {
            0..=16 => self.walk_with::<ANY>(ray, found, &mut [0; 16]),
            17..=48 => self.walk_with::<ANY>(ray, found, &mut [0; 48]),
            49..=128 => self.walk_with::<ANY>(ray, found, &mut [0; 128]),
            _ => self.walk_deep::<ANY>(ray, found),
        }
    }

    /// All leaves one after the other.
    #[inline(always)]
    fn walk_flat<const ANY: bool, const WIDE: bool>(&self, ray: &Ray, found: &mut Found) -> bool {
        let mut any = self.meet_spheres::<ANY, WIDE>(ray, found);
        if ANY && any {
            return true;
        }
        for (i, (disc, _)) in self.discs.iter().enumerate() {
            any |= Self::take(flat(disc, ray, found.t), Child::new(Child::DISC, i), found);
            if ANY && any {
                return true;
            }
        }
        let hit = Block::hit_of::<ANY, WIDE>(&self.parallelograms, &self.pairs, ray, found.t);
        if let Some((t, lane, at)) = hit {
            any = true;
            if ANY {
                return true;
            }
            let child = Child::new(Child::PARALLELOGRAMS, lane / LANES);
            *found = Found { t, child, lane: lane % LANES, at };
        }
        if self.blocks.is_empty() {
            return any;
        }
        let shear = Shear::new(ray);
        for (i, block) in self.blocks.iter().enumerate() {
            any |= Self::take(block.hit::<ANY>(ray, &shear, found.t), Child::new(Child::BLOCK, i), found);
            if ANY && any {
                return true;
            }
        }
        any
    }

    /// All spheres; of `ANY` that is met no more than one.
    #[inline(always)]
    fn meet_spheres<const ANY: bool, const WIDE: bool>(&self, ray: &Ray, found: &mut Found) -> bool {
        let mut mask = 0;
        if WIDE {
            if let Some(octet) = &self.octet {
                mask = octet.met(ray, found.t);
            }
        } else {
            for (i, (sphere, _)) in self.spheres.iter().enumerate() {
                mask |= u32::from(!sphere.is_missed(ray, found.t)) << i;
            }
        }
        let mut any = false;
        while mask != 0 {
            let i = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            let hit = round_exactly(&self.spheres[i].0, ray, found.t);
            any |= Self::take(hit, Child::new(Child::SPHERE, i), found);
            if ANY && any {
                return true;
            }
        }
        any
    }

    /// For trees of unusual depth: a stack on the heap.
    #[cold]
    #[inline(never)]
    fn walk_deep<const ANY: bool>(&self, ray: &Ray, found: &mut Found) -> bool {
        self.walk_with::<ANY>(ray, found, &mut vec![0; self.stack])
    }

    /// Depth first, near children first. An entry of the stack is a distance (its bits, which sort as it does) above a
    /// child, so that what lies behind a hit found meanwhile is skipped.
    #[inline(always)]
    fn walk_with<const ANY: bool>(&self, ray: &Ray, found: &mut Found, stack: &mut [u64]) -> bool {
        let query = self.query(ray);
        let mut any = false;
        let mut top = 0;
        let mut current = Child::new(Child::NODE, 0);
        loop {
            if current.kind() == Child::NODE {
                let mut entries = self.nodes[current.index()].enter(&query, found.t);
                // Any hit will do for visibility, so the order of the boxes is all the same.
                if !ANY {
                    sort(&mut entries);
                }
                // Without branches: what is pushed in vain is written over.
                for entry in entries[1..].iter().rev() {
                    stack[top] = *entry;
                    top += usize::from(*entry < MISSED);
                }
                if entries[0] < MISSED {
                    current = Child(entries[0] as u32);
                    continue;
                }
            } else if self.test::<ANY>(current, ray, &query.shear, found) {
                any = true;
                if ANY {
                    return true;
                }
            }
            loop {
                if top == 0 {
                    return any;
                }
                top -= 1;
                let entry = stack[top];
                if f32::from_bits((entry >> 32) as u32) <= found.t {
                    current = Child(entry as u32);
                    break;
                }
            }
        }
    }

    /// Test a leaf; whether it has the nearest hit so far.
    #[inline(always)]
    fn test<const ANY: bool>(&self, child: Child, ray: &Ray, shear: &Shear, found: &mut Found) -> bool {
        let hit = match child.leaf() {
            Leaf::Block(i) => self.blocks[i].hit::<ANY>(ray, shear, found.t),
            Leaf::Parallelograms(i) => self.parallelograms[i].hit::<ANY>(ray, found.t),
            Leaf::Sphere(i) => round(&self.spheres[i].0, ray, found.t),
            Leaf::Disc(i) => flat(&self.discs[i].0, ray, found.t),
        };
        Self::take(hit, child, found)
    }

    /// Keeps a hit; whether there was one.
    #[inline(always)]
    fn take(hit: Option<(f32, usize, Vec2)>, child: Child, found: &mut Found) -> bool {
        if let Some((t, lane, at)) = hit {
            *found = Found { t, child, lane, at };
        }
        hit.is_some()
    }
}

/// A sphere as a leaf.
#[inline(always)]
fn round(sphere: &Sphere, ray: &Ray, nearest: f32) -> Option<(f32, usize, Vec2)> {
    if sphere.is_missed(ray, nearest) { None } else { round_exactly(sphere, ray, nearest) }
}

/// Apart, so that rays that miss all spheres need not be made ready for it.
#[inline(never)]
fn round_exactly(sphere: &Sphere, ray: &Ray, nearest: f32) -> Option<(f32, usize, Vec2)> {
    let line = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    sphere.hit(line, f64::from(nearest)).map(|t| (t as f32, 0, Vec2::ZERO))
}

/// A disc as a leaf.
#[inline(always)]
fn flat(disc: &Disc, ray: &Ray, nearest: f32) -> Option<(f32, usize, Vec2)> {
    let line = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    disc.hit(line, f64::from(nearest)).map(|t| (t as f32, 0, Vec2::ZERO))
}

impl Node {
    /// The children whose boxes the ray enters before `t_max`, as entries for the stack; [`MISSED`] or above in the
    /// place of the others.
    #[inline(always)]
    fn enter(&self, q: &Query, t_max: f32) -> [u64; 4] {
        let (t0, t1) = q.line.through(&self.bounds, t_max);
        let t = Vec4::select(t0.cmple(t1), t0, Vec4::splat(f32::from_bits(u32::MAX))).to_array();
        std::array::from_fn(|i| u64::from(t[i].to_bits()) << 32 | u64::from(self.child[i].0))
    }
}

/// Sort four, without branches.
#[inline(always)]
fn sort(entries: &mut [u64; 4]) {
    let mut order = |a: usize, b: usize| {
        let (x, y) = (entries[a], entries[b]);
        entries[a] = x.min(y);
        entries[b] = x.max(y);
    };
    order(0, 1);
    order(2, 3);
    order(0, 2);
    order(1, 3);
    order(1, 2);
}
