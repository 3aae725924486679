//! Boxes in trees, each with what is in it: what a segment ([`Crossed`]) or a point ([`Boxes`]) may meet.

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;

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

/// Size of a [`Crossed`]'s longest side in units of its own: the tree's test has a tolerance of 1e-4, and f32 has steps of 6e-5
/// there.
const UNITS: f32 = 1000.0;
/// By so much boxes are widened for the rounding of that change of units.
const ROUNDING: f32 = 3e-4;

/// Boxes in a compressed eight-way tree [Ylitie et al. 2017], each with an item; items lie in the tree's order.
pub struct Crossed<T> {
    tree: CwBvh,
    items: Vec<T>,
    /// Origin and scale of the tree's own units, in which its absolute tolerances are small.
    origin: Vec3A,
    scale: f32,
}

impl<T: Copy> Crossed<T> {
    /// Over boxes and what is in each.
    pub fn build(boxes: &[Aabb], items: &[T]) -> Self {
        let mut all = Aabb::empty();
        boxes.iter().for_each(|b| {
            all.extend(b.min).extend(b.max);
        });
        let longest = (all.max - all.min).max_element();
        let (origin, scale) = if longest > 0.0 { (all.min, UNITS / longest) } else { (Vec3A::ZERO, 1.0) };
        if boxes.is_empty() {
            return Self { tree: CwBvh::default(), items: Vec::new(), origin, scale };
        }
        let rounding = Vec3A::splat(ROUNDING);
        let own =
            |b: &Aabb| Aabb::new((b.min - origin) * scale - rounding, (b.max - origin) * scale + rounding);
        let boxes: Vec<Aabb> = boxes.iter().map(own).collect();
        let tree = build_cwbvh(&boxes, BvhBuildParams::very_fast_build(), &mut Default::default());
        let items = tree.primitive_indices.iter().map(|i| items[*i as usize]).collect();
        Self { tree, items, origin, scale }
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
        // The tree's test misses everything where a component is -0.
        let dir = dir + Vec3A::ZERO;
        let ray = obvhs::ray::Ray::new((origin - self.origin) * self.scale, dir, 0.0, length * self.scale);
        self.tree.ray_traverse_anyhit(ray, |_, i| found(&self.items[i]));
    }
}

/// The box about two points and `half` more on each side, and a few ulps.
pub fn widened(a: Vec3A, b: Vec3A, half: f32) -> Aabb {
    let (min, max) = (a.min(b), a.max(b));
    // A little wider, so that the rounding of the boxes' test loses nothing.
    let slack = Vec3A::splat(half * 1.0001) + 4.0 * f32::EPSILON * min.abs().max(max.abs());
    Aabb::new(min - slack, max + slack)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Stream, StreamKind, warp};

    /// Every ball that a segment comes within reach of is found, once: in scenes of a millimetre and of a kilometre, along
    /// the axes too.
    #[test]
    fn segments_meet_what_they_should() {
        for size in [1e-3, 1.0, 1e3] {
            let mut random = Stream::new(3, 0, StreamKind::Other, 0);
            let mut point = || {
                let (a, b) = (random.next_2d(), random.next_1d());
                Vec3A::new(a.x - 0.5, a.y - 0.5, b - 0.5) * size
            };
            let centres: Vec<Vec3A> = (0..3000).map(|_| point()).collect();
            let radius = 0.03 * size;
            let boxes: Vec<Aabb> = centres.iter().map(|c| widened(*c, *c, radius)).collect();
            let items: Vec<usize> = (0..centres.len()).collect();
            let tree = Crossed::build(&boxes, &items);
            let mut found_any = 0;
            for k in 0..300 {
                let origin = point() * 1.5;
                let u = Stream::new(4, 0, StreamKind::Other, k).next_2d();
                let dir = match k {
                    0 => Vec3A::new(-0.0, -0.0, -1.0),
                    1 => Vec3A::new(1.0, -0.0, 0.0),
                    _ => warp::uniform_sphere(u),
                };
                let length = 0.8 * size;
                let mut found = vec![0; centres.len()];
                tree.along(origin, dir, length, |i| found[*i] += 1);
                assert!(found.iter().all(|n| *n <= 1));
                for (i, centre) in centres.iter().enumerate() {
                    let t = (*centre - origin).dot(dir);
                    let near = (origin + dir * t - *centre).length() < radius;
                    if near && t > 0.0 && t < length {
                        found_any += 1;
                        assert_eq!(found[i], 1, "size {size}, ray {k}, ball {i}");
                    }
                }
            }
            assert!(found_any > 300, "{found_any}");
        }
    }
}
