//! From primitives to the tree.

use super::super::aabb::Aabb;
use super::super::lanes::eight;
use super::super::parallelogram::{self, Parallelogram};
use super::super::quadric::Spheres;
use super::super::triangle::{Block, LANES};
use super::{Bvh, Child, Node, Primitive};
use glam::{Vec3, Vec3A, Vec4};
use obvhs::aabb::Aabb as ObvhsAabb;
use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

/// Expected cost of testing four boxes.
const NODE_COST: f32 = 1.0;
/// Expected cost of testing up to four triangles or parallelograms, beside that.
const BLOCK_COST: f32 = 1.3;
/// Expected cost of testing a sphere or a disc, beside that.
const ROUND_COST: f32 = 1.0;

/// Leaves up to which testing all of them is faster than a tree.
const FLAT: usize = 8;
const _: () = assert!(FLAT <= parallelogram::Block::AT_ONCE && FLAT <= Spheres::AT_ONCE);

/// The cheapest ways to turn the subtree of a binary node into at most 1, 2, 3, 4 subtrees of the new tree.
#[derive(Clone, Copy, Default)]
struct Plan {
    cost: [f32; 4],
    /// How many of 2, 3, 4 subtrees come from the left child, when the node itself is taken apart.
    left: [u8; 3],
    /// Whether taking apart into up to 2, 3, 4 is worth it over fewer.
    apart: [bool; 3],
    /// As one subtree: a leaf.
    leaf: bool,
    under: Under,
}

/// What is under a node.
#[derive(Clone, Copy, Debug, Default)]
struct Under {
    triangles: u32,
    parallelograms: u32,
    /// Spheres and discs.
    round: u32,
}

impl Under {
    fn and(self, other: Self) -> Self {
        Self {
            triangles: self.triangles.saturating_add(other.triangles),
            parallelograms: self.parallelograms.saturating_add(other.parallelograms),
            round: self.round.saturating_add(other.round),
        }
    }

    /// Whether one block has room for it: of triangles alone, or of parallelograms.
    fn fits(self) -> bool {
        let Self { triangles, parallelograms, round } = self;
        round == 0 && (triangles == 0 || parallelograms == 0) && triangles.max(parallelograms) <= LANES as u32
    }
}

struct Builder<'a> {
    tree: &'a Bvh2,
    primitives: &'a [(Primitive, u32)],
    plans: Vec<Plan>,
    bvh: Bvh,
}

impl Bvh {
    /// Over primitives, each with its index over all shapes.
    pub(in super::super) fn build(primitives: &[(Primitive, u32)]) -> Self {
        if primitives.is_empty() {
            return Self { flat: true, ..Self::default() };
        }
        if let Some(bvh) = Self::flat(primitives) {
            return bvh;
        }
        crate::stage::begin(format!("building the tree of {} primitives", primitives.len()));
        let boxes: Vec<_> =
            primitives.par_iter().map(|(p, _)| p.bounds()).map(|b| ObvhsAabb::new(b.min, b.max)).collect();
        let bounds = primitives.par_iter().map(|(p, _)| p.bounds()).reduce_with(Aabb::union);
        let indices = (0..boxes.len() as u32).collect();
        let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            &boxes,
            indices,
            SortPrecision::U64,
            3,
        );
        ReinsertionOptimizer::default().run(&mut tree, 0.05, None);
        let mut builder = Builder { tree: &tree, primitives, plans: Vec::new(), bvh: Self::default() };
        builder.plan();
        drop(boxes);
        let stack = builder.node(0).1;
        let mut bvh = builder.bvh;
        bvh.wide = eight::is_at_hand();
        // One more is written in vain.
        bvh.stack = stack + 1;
        bvh.bounds = bounds;
        bvh
    }
}

impl Bvh {
    /// The leaves alone, where there are no more than [`FLAT`].
    fn flat(primitives: &[(Primitive, u32)]) -> Option<Self> {
        let mut bvh = Self { flat: true, ..Self::default() };
        let (mut triangles, mut parallelograms) = (Vec::new(), Vec::new());
        if primitives.len() > FLAT * LANES {
            return None;
        }
        for (primitive, index) in primitives {
            match *primitive {
                Primitive::Triangle(corners) => triangles.push((corners, *index)),
                Primitive::Parallelogram(p) => parallelograms.push((p, *index)),
                Primitive::Sphere(s) => bvh.spheres.push((s, *index)),
                Primitive::Disc(d) => bvh.discs.push((d, *index)),
            }
        }
        bvh.blocks = triangles.chunks(LANES).map(Block::new).collect();
        bvh.parallelograms = parallelograms.chunks(LANES).map(parallelogram::Block::new).collect();
        let leaves = bvh.blocks.len() + bvh.parallelograms.len() + bvh.spheres.len() + bvh.discs.len();
        if leaves > FLAT {
            return None;
        }
        bvh.wide = eight::is_at_hand();
        if bvh.wide {
            bvh.pairs = bvh.parallelograms.chunks(2).map(parallelogram::Pair::of).collect();
            bvh.octet = (!bvh.spheres.is_empty()).then(|| Spheres::of(&bvh.spheres));
        }
        Some(bvh)
    }
}

impl Primitive {
    fn bounds(&self) -> Aabb {
        match self {
            Self::Triangle(corners) => Aabb::of(corners.map(Vec3A::from)),
            Self::Parallelogram(p) => Aabb::of(p.all_corners().map(Vec3A::from)),
            Self::Sphere(s) => {
                Aabb { min: s.centre - Vec3A::splat(s.radius), max: s.centre + Vec3A::splat(s.radius) }
            }
            Self::Disc(d) => {
                super::super::ShapeDesc::Disc { centre: d.centre, normal: d.normal, radius: d.radius }
                    .bounds()
            }
        }
    }
}

impl Builder<'_> {
    fn children(&self, n: usize) -> Option<[usize; 2]> {
        let node = &self.tree.nodes[n];
        (!node.is_leaf()).then(|| [node.first_index as usize, node.first_index as usize + 1])
    }

    /// The primitive of a binary leaf: leaves have one each.
    fn primitive(&self, n: usize) -> &(Primitive, u32) {
        let place = self.tree.nodes[n].first_index as usize;
        &self.primitives[self.tree.primitive_indices[place] as usize]
    }

    /// Children before parents: the cheapest way to merge each subtree, as in [Ylitie et al. 2017, 3].
    fn plan(&mut self) {
        let mut order: Vec<u32> = Vec::with_capacity(self.tree.nodes.len());
        let mut stack = vec![0];
        while let Some(n) = stack.pop() {
            order.push(n as u32);
            stack.extend(self.children(n).into_iter().flatten());
        }
        self.plans = vec![Plan::default(); self.tree.nodes.len()];
        for n in order.into_iter().rev() {
            self.plans[n as usize] = self.plan_node(n as usize);
        }
    }

    fn plan_node(&self, n: usize) -> Plan {
        let area = self.tree.nodes[n].aabb().half_area();
        let Some([l, r]) = self.children(n) else {
            let none = Under::default();
            let (cost, under) = match self.primitive(n).0 {
                Primitive::Triangle(_) => (BLOCK_COST, Under { triangles: 1, ..none }),
                Primitive::Parallelogram(_) => (BLOCK_COST, Under { parallelograms: 1, ..none }),
                Primitive::Sphere(_) | Primitive::Disc(_) => (ROUND_COST, Under { round: 1, ..none }),
            };
            return Plan { cost: [area * cost; 4], leaf: true, under, ..Plan::default() };
        };
        let (l, r) = (&self.plans[l], &self.plans[r]);
        let mut plan = Plan { under: l.under.and(r.under), ..Plan::default() };
        let mut apart = [0.0; 3];
        for count in 2..=4 {
            let (cost, left) = (1..count)
                .map(|k| (l.cost[k - 1] + r.cost[count - k - 1], k as u8))
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .expect("there is a way to share two or more among two");
            apart[count - 2] = cost;
            plan.left[count - 2] = left;
        }
        let inner = area * NODE_COST + apart[2];
        let leaf = area * BLOCK_COST;
        // Costs of a scene whose areas are beyond f32 are infinite or NaN: then whatever fits is a leaf.
        plan.leaf = plan.under.fits() && (leaf <= inner || inner.is_nan());
        plan.cost[0] = if plan.leaf { leaf } else { inner };
        for (i, cost) in apart.into_iter().enumerate() {
            plan.apart[i] = cost < plan.cost[i];
            plan.cost[i + 1] = cost.min(plan.cost[i]);
        }
        plan
    }

    /// The roots of at most `count` subtrees into which `n` is taken apart. `always`: even if it were cheaper whole.
    fn roots(&self, n: usize, count: usize, always: bool, out: &mut Vec<usize>) {
        let Some([l, r]) = self.children(n).filter(|_| count > 1) else {
            out.push(n);
            return;
        };
        let plan = &self.plans[n];
        if always || plan.apart[count - 2] {
            let left = plan.left[count - 2] as usize;
            self.roots(l, left, false, out);
            self.roots(r, count - left, false, out);
        } else {
            self.roots(n, count - 1, false, out);
        }
    }

    /// Write an inner node for `n`; its index, and how many entries a traversal from it can come to hold.
    fn node(&mut self, n: usize) -> (usize, usize) {
        let index = self.bvh.nodes.len();
        let empty = [Vec4::INFINITY, Vec4::NEG_INFINITY];
        self.bvh.nodes.push(Node { bounds: [empty; 3], child: [Child::NONE; 4] });
        let mut roots = Vec::with_capacity(4);
        if self.plans[n].leaf {
            roots.push(n);
        } else {
            self.roots(n, 4, true, &mut roots);
        }
        // Each step down leaves the node's other children on the stack.
        let siblings = roots.len() - 1;
        let mut deepest = 0;
        for (place, root) in roots.into_iter().enumerate() {
            let aabb = *self.tree.nodes[root].aabb();
            let child = if self.plans[root].leaf {
                self.leaf(root)
            } else {
                let (child, below) = self.node(root);
                deepest = deepest.max(below);
                Child::new(Child::NODE, child)
            };
            let node = &mut self.bvh.nodes[index];
            node.child[place] = child;
            for axis in 0..3 {
                node.bounds[axis][0][place] = aabb.min[axis];
                node.bounds[axis][1][place] = aabb.max[axis];
            }
        }
        (index, deepest + siblings)
    }

    /// Write the primitives under `n` as one leaf.
    fn leaf(&mut self, n: usize) -> Child {
        let mut triangles: Vec<([Vec3; 3], u32)> = Vec::with_capacity(LANES);
        let mut parallelograms: Vec<(Parallelogram, u32)> = Vec::new();
        let mut stack = vec![n];
        while let Some(n) = stack.pop() {
            if let Some(children) = self.children(n) {
                stack.extend(children);
                continue;
            }
            let (primitive, index) = self.primitive(n);
            match *primitive {
                Primitive::Triangle(corners) => triangles.push((corners, *index)),
                Primitive::Parallelogram(p) => parallelograms.push((p, *index)),
                Primitive::Sphere(s) => {
                    let child = Child::new(Child::SPHERE, self.bvh.spheres.len());
                    let entry = (s, *index);
                    self.bvh.spheres.push(entry);
                    return child;
                }
                Primitive::Disc(d) => {
                    let child = Child::new(Child::DISC, self.bvh.discs.len());
                    let entry = (d, *index);
                    self.bvh.discs.push(entry);
                    return child;
                }
            }
        }
        if triangles.is_empty() {
            self.bvh.parallelograms.push(parallelogram::Block::new(&parallelograms));
            return Child::new(Child::PARALLELOGRAMS, self.bvh.parallelograms.len() - 1);
        }
        self.bvh.blocks.push(Block::new(&triangles));
        Child::new(Child::BLOCK, self.bvh.blocks.len() - 1)
    }
}
