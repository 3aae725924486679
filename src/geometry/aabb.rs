//! Boxes along the axes.

use glam::Vec3A;

/// A box along the axes; empty where a `min` exceeds its `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Least coordinates.
    pub min: Vec3A,
    /// Greatest coordinates.
    pub max: Vec3A,
}

impl Aabb {
    /// The box of nothing.
    pub const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    /// The least box about some points.
    pub fn of(points: impl IntoIterator<Item = Vec3A>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The least box about both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether nothing is in it.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// Its centre; the origin for the empty box.
    pub fn centre(&self) -> Vec3A {
        if self.is_empty() { Vec3A::ZERO } else { 0.5 * self.min + 0.5 * self.max }
    }

    /// Its edge lengths; zero for the empty box.
    pub fn size(&self) -> Vec3A {
        if self.is_empty() { Vec3A::ZERO } else { self.max - self.min }
    }

    /// Whether both have a point in common; touching counts.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// The point of it that is nearest to `p`. Of a box of something.
    pub fn nearest(&self, p: Vec3A) -> Vec3A {
        p.max(self.min).min(self.max)
    }

    /// Twice the sum of the edge lengths' products; zero for the empty box.
    pub fn surface(&self) -> f32 {
        let s = self.size();
        2.0 * (s.x * s.y + s.y * s.z + s.z * s.x)
    }
}
