//! A ray through the cells of a grid, in lattice coordinates.

use super::lattice::{BLOCK, Lattice};
use super::texel::Texel;
use glam::{BVec3A, DVec3, Vec3A};
use std::ops::ControlFlow;

/// So far ahead, in cells, values are asked for: as long as they take to come.
const AHEAD: f32 = 8.0;

/// The part of a ray that is in a grid's box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    /// Where it enters: a point near the grid, so that f32 will do from here on.
    base: Vec3A,
    /// Lattice units a metre.
    dir: Vec3A,
    inverse: Vec3A,
    moving: BVec3A,
    /// How far it goes in [`AHEAD`] cells or so (metres).
    soon: f32,
    /// From a cell's number to the plane that the ray leaves it by.
    ahead: Vec3A,
    /// From a cell's number to the next one's.
    step: Vec3A,
    /// The ray's parameter at `base`.
    pub start: f64,
    /// How far it goes from there (metres).
    pub end: f32,
}

impl Span {
    /// Of the ray `origin` + t `dir`, t0 < t < t1, all in lattice coordinates but t, through the box `bounds`.
    #[inline]
    pub fn new(origin: DVec3, dir: DVec3, t0: f64, t1: f64, bounds: (DVec3, DVec3)) -> Option<Self> {
        let (mut enter, mut exit) = (t0, t1);
        for axis in 0..3 {
            let (low, high) = (bounds.0[axis] - origin[axis], bounds.1[axis] - origin[axis]);
            if dir[axis] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (a, b) = (low / dir[axis], high / dir[axis]);
            enter = enter.max(a.min(b));
            exit = exit.min(a.max(b));
        }
        let end = (exit - enter) as f32;
        if end.is_nan() || end <= 0.0 {
            return None;
        }
        let base = (origin + dir * enter).as_vec3a();
        let dir = dir.as_vec3a();
        let zero = Vec3A::ZERO;
        let (inverse, moving) =
            (dir.recip(), dir.recip().cmplt(Vec3A::INFINITY) & dir.recip().cmpgt(-Vec3A::INFINITY));
        let forward = dir.cmpgt(zero);
        let ahead = Vec3A::select(forward, Vec3A::ONE, zero);
        let step = Vec3A::select(moving, Vec3A::select(forward, Vec3A::ONE, -Vec3A::ONE), zero);
        let soon = AHEAD * dir.length_recip();
        Some(Self { base, dir, inverse, moving, soon, ahead, step, start: enter, end })
    }

    /// Where the ray crosses the planes at `coordinates`.
    #[inline(always)]
    fn planes(&self, coordinates: Vec3A) -> Vec3A {
        Vec3A::select(self.moving, (coordinates - self.base) * self.inverse, Vec3A::INFINITY)
    }

    /// The point at `s` from the base, within a cell.
    #[inline(always)]
    pub fn within(&self, cell: Vec3A, s: f32) -> Vec3A {
        (self.base + self.dir * s - cell).clamp(Vec3A::ZERO, Vec3A::ONE)
    }

    /// Shows `visit` each cell that the ray crosses, with the distances from the base between which it is in it. Blocks
    /// with nothing in them are left out.
    #[inline(always)]
    pub fn march<T: Texel>(
        &self,
        lattice: &Lattice<T>,
        mut visit: impl FnMut(Vec3A, f32, f32) -> ControlFlow<()>,
    ) {
        self.blocks(lattice, |block, _, from, exit| {
            let mut cell = block.cell(self, from);
            let mut s = from;
            loop {
                let planes = self.planes(cell + self.ahead);
                let next = planes.min_element().min(exit);
                if next > s {
                    lattice.ask_for(self.base + self.dir * (s + self.soon));
                    visit(cell, s, next)?;
                    s = next;
                }
                if next >= exit {
                    return ControlFlow::Continue(());
                }
                cell += Vec3A::select(planes.cmple(Vec3A::splat(next)), self.step, Vec3A::ZERO);
            }
        });
    }

    /// Shows `visit` each block that the ray crosses and that anything is in, with its majorant and the distances from
    /// the base between which the ray is in it.
    #[inline(always)]
    pub fn blocks<T: Texel>(
        &self,
        lattice: &Lattice<T>,
        mut visit: impl FnMut(Block, f32, f32, f32) -> ControlFlow<()>,
    ) {
        let (last, last_block) = (lattice.last, lattice.last_block);
        let mut block = (self.base * (1.0 / BLOCK)).floor().clamp(Vec3A::ZERO, last_block);
        let mut s = 0.0f32;
        loop {
            // The same numbers as for the block's outermost cells, so that both planes are the same.
            let planes = self.planes(((block + self.ahead) * BLOCK).min(last + 1.0));
            let exit = planes.min_element().min(self.end);
            if exit > s {
                let majorant = lattice.majorant(block);
                if majorant > 0.0 {
                    let low = block * BLOCK;
                    let block = Block { low, high: (low + (BLOCK - 1.0)).min(last) };
                    if visit(block, majorant, s, exit).is_break() {
                        return;
                    }
                }
                s = exit;
            }
            if exit >= self.end {
                return;
            }
            block += Vec3A::select(planes.cmple(Vec3A::splat(exit)), self.step, Vec3A::ZERO);
            if block.cmplt(Vec3A::ZERO).any() || block.cmpgt(last_block).any() {
                return;
            }
        }
    }
}

/// Its first and last cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    low: Vec3A,
    high: Vec3A,
}

impl Block {
    /// The cell of it that holds the point at `s` of a span that is in it there.
    #[inline(always)]
    pub fn cell(&self, span: &Span, s: f32) -> Vec3A {
        (span.base + span.dir * s).floor().clamp(self.low, self.high)
    }
}
