//! Boxes in a binary tree, each with what is in it: what a ray or a point may meet.

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

/// Boxes in a binary tree, each with an item; items lie in the tree's order.
pub struct Boxes<T> {
    tree: Bvh2,
    items: Vec<T>,
}

impl<T: Copy> Boxes<T> {
    /// Over boxes and what is in each.
    pub fn build(boxes: &[Aabb], items: &[T]) -> Self {
        if boxes.is_empty() {
            return Self { tree: Bvh2::default(), items: Vec::new() };
        }
        let tree = build_bvh2(boxes, BvhBuildParams::very_fast_build(), &mut Default::default());
        let items = tree.primitive_indices.iter().map(|i| items[*i as usize]).collect();
        Self { tree, items }
    }

    /// How many boxes there are.
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// Calls `found` with what a segment may meet.
    #[inline]
    pub fn along(&self, origin: Vec3A, dir: Vec3A, length: f32, mut found: impl FnMut(&T)) {
        if self.items.is_empty() {
            return;
        }
        let ray = obvhs::ray::Ray::new(origin, dir, 0.0, length);
        self.tree.ray_traverse_anyhit(ray, |_, i| found(&self.items[i]));
    }

    /// Calls `found` with what may be about a point.
    #[inline]
    pub fn about(&self, point: Vec3A, mut found: impl FnMut(&T)) {
        if self.items.is_empty() {
            return;
        }
        self.tree.point_traverse(point, |tree, node| {
            let node = &tree.nodes[node as usize];
            for item in &self.items[node.first_index as usize..][..node.prim_count as usize] {
                found(item);
            }
            true
        });
    }
}

/// The box about two points and `half` more on each side, and a few ulps.
pub fn widened(a: Vec3A, b: Vec3A, half: f32) -> Aabb {
    let (min, max) = (a.min(b), a.max(b));
    // A little wider, so that the rounding of the boxes' test loses nothing.
    let slack = Vec3A::splat(half * 1.0001) + 4.0 * f32::EPSILON * min.abs().max(max.abs());
    Aabb::new(min - slack, max + slack)
}
