//! Points in a hashed grid of cells as wide as the kernel, sorted by cell.
//!
//! A query visits eight cells. The hash is linear, (x + P y + Q z) modulo a power of two, so that two cells next to
//! each other along x are next to each other in memory, and a query reads four runs of entries in a row. As it is
//! linear, whether two of a query's four runs share a bucket does not depend on the query: P and Q are chosen so that
//! they never do, and no point is found twice.
//!
//! An entry is 16 bytes: position and name. Only some 6% of the entries that a query reads are near enough, and only
//! these are looked up.

use glam::{Vec3, Vec3A};

/// A point and its name.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Where.
    pub p: Vec3,
    /// Its name.
    pub id: u32,
}

const _: () = assert!(size_of::<Entry>() == 16);

/// Cells are so many radii wide. A little more than two, so that rounding never makes a query's range three cells wide.
const CELL: f32 = 2.02;
/// No coordinate of a cell is above this, so that 1% of a cell is more than the rounding of a coordinate.
const MOST_CELLS: f32 = 65_536.0;

/// Points to be found within one radius.
#[derive(Debug, Default)]
pub struct Points {
    entries: Vec<Entry>,
    /// Where each bucket starts, and the end.
    starts: Vec<u32>,
    min: Vec3A,
    max: Vec3A,
    radius: f32,
    /// 1 / width of a cell.
    scale: f32,
    /// P and Q.
    factors: [u32; 2],
    mask: u32,
}

impl Points {
    /// Over points to be found within `radius` (metres).
    pub fn build(points: &[Entry], radius: f32) -> Self {
        if points.is_empty() {
            return Self::default();
        }
        let (mut min, mut max) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
        for entry in points {
            min = min.min(entry.p.into());
            max = max.max(entry.p.into());
        }
        let cell = (CELL * radius).max((max - min).max_element() / MOST_CELLS);
        let size = points.len().next_power_of_two().max(64) as u32;
        let mut grid = Self {
            entries: vec![points[0]; points.len()],
            starts: vec![0; size as usize + 1],
            min,
            max,
            radius,
            scale: 1.0 / cell,
            factors: factors(size),
            mask: size - 1,
        };
        let buckets: Vec<u32> = points.iter().map(|e| grid.bucket(grid.cell(e.p.into()))).collect();
        for bucket in &buckets {
            grid.starts[*bucket as usize] += 1;
        }
        let mut sum = 0;
        for start in &mut grid.starts {
            sum += *start;
            *start = sum;
        }
        // Backwards, so that entries stay in their order and each start ends where its bucket begins.
        for (entry, bucket) in points.iter().zip(&buckets).rev() {
            let start = &mut grid.starts[*bucket as usize];
            *start -= 1;
            grid.entries[*start as usize] = *entry;
        }
        grid
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    #[inline]
    fn cell(&self, p: Vec3A) -> [u32; 3] {
        // Casts take what is below 0 for 0.
        ((p - self.min) * self.scale).to_array().map(|c| c as u32)
    }

    #[inline]
    fn bucket(&self, [x, y, z]: [u32; 3]) -> u32 {
        let [p, q] = self.factors;
        x.wrapping_add(y.wrapping_mul(p)).wrapping_add(z.wrapping_mul(q)) & self.mask
    }

    /// Calls `found` with the name of each point within the radius of `p`, and the square of its distance.
    #[inline]
    pub fn within(&self, p: Vec3A, mut found: impl FnMut(u32, f32)) {
        let reach = Vec3A::splat(self.radius * 1.0001);
        let (low, high) = (p - reach, p + reach);
        if self.entries.is_empty() || !(low.cmple(self.max) & high.cmpge(self.min)).all() {
            return;
        }
        let ([x, y0, z0], [x1, y1, z1]) = (self.cell(low), self.cell(high));
        let r2 = self.radius * self.radius;
        let mut scan = |from: u32, to: u32| {
            let run = self.starts[from as usize] as usize..self.starts[to as usize] as usize;
            for entry in &self.entries[run] {
                let d2 = (Vec3A::from(entry.p) - p).length_squared();
                if d2 <= r2 {
                    found(entry.id, d2);
                }
            }
        };
        for z in z0..=z1 {
            for y in y0..=y1 {
                let first = self.bucket([x, y, z]);
                if x == x1 {
                    scan(first, first + 1);
                } else if first < self.mask {
                    scan(first, first + 2);
                } else {
                    scan(first, first + 1);
                    scan(0, 1);
                }
            }
        }
    }
}

/// P and Q for so many buckets (a power of two, 64 or more): the four runs of a query, two buckets each, share none.
fn factors(size: u32) -> [u32; 2] {
    let apart = |a: u32| {
        let a = a & (size - 1);
        a > 1 && a < size - 1
    };
    let p = 73_856_093u32;
    let mut q = 19_349_663u32;
    while !(apart(p) && apart(q) && apart(p.wrapping_add(q)) && apart(p.wrapping_sub(q))) {
        q = q.wrapping_add(2);
    }
    [p, q]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Stream, StreamKind, warp};

    /// Against every point one by one: clusters and lone points, radii from tiny to larger than all.
    #[test]
    fn each_point_that_is_near_enough_is_found_once() {
        let mut s = Stream::new(3, 0, StreamKind::Other, 0);
        for (n, radius) in [(1, 0.1), (50, 1.0), (3000, 0.03), (3000, 0.3), (3000, 1e-5), (500, 30.0)] {
            let points: Vec<Entry> = (0..n)
                .map(|id| {
                    let far = if id % 97 == 5 { 1e4 } else { 1.0 };
                    let p = warp::uniform_sphere(s.next_2d()) * (s.next_1d() * far);
                    Entry { p: p.into(), id }
                })
                .collect();
            let grid = Points::build(&points, radius);
            assert_eq!(grid.len(), points.len());
            let mut all = 0;
            for i in 0..400 {
                let p = if i % 3 == 0 {
                    Vec3A::from(points[i % points.len()].p)
                } else {
                    warp::uniform_sphere(s.next_2d()) * (s.next_1d() * 1.2)
                };
                let mut found = Vec::new();
                grid.within(p, |id, d2| {
                    assert!(d2 <= radius * radius);
                    found.push(id);
                });
                found.sort_unstable();
                let near = |e: &&Entry| (Vec3A::from(e.p) - p).length_squared() <= radius * radius;
                let expected: Vec<u32> = points.iter().filter(near).map(|e| e.id).collect();
                assert_eq!(found, expected, "{n} {radius}");
                all += found.len();
            }
            assert!(all > 0, "{n} {radius}: nothing was ever found");
        }
    }

    #[test]
    fn runs_never_share_a_bucket() {
        for bits in 6..31 {
            let size = 1u32 << bits;
            let [p, q] = factors(size);
            let runs = [0, p, q, p.wrapping_add(q)];
            let mut buckets: Vec<u32> =
                runs.iter().flat_map(|r| [*r & (size - 1), r.wrapping_add(1) & (size - 1)]).collect();
            buckets.sort_unstable();
            buckets.dedup();
            assert_eq!(buckets.len(), 8, "{size}");
        }
    }
}
