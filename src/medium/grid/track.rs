//! Collisions and transmittance by random points, whose density is the largest value of the block that they are in.
//!
//! A function times a factor is the extinction here. Points are strewn over a ray as if the extinction were the block's
//! majorant everywhere, which is at least as much; each of them is a collision with the share of it that the extinction
//! is there [Woodcock et al. 1965], and the first one that is ends a flight. What a ray lets through on average is the product
//! of what each point lets through, which needs no end: ratio tracking [Novák et al. 2014]. Few points are looked up where
//! the medium is thin, however fine the grid is.

use super::lattice::Interpolation;
use super::placed::Placed;
use super::texel::Texel;
use super::traverse::{Block, Span};
use crate::math::Stream;
use crate::medium::decay::drawn_depth;
use glam::{Vec2, Vec3A};
use std::ops::ControlFlow;

/// Below this share of the light a ratio-tracked ray goes on with the probability of what is left over it.
const FAINT: f32 = 0.1;

/// The majorant's depth to the next point, above 0, and a uniform beside it.
#[inline(always)]
fn draw(random: &mut Stream) -> (f32, f32) {
    let Vec2 { x, y } = random.next_2d();
    (drawn_depth(x), y)
}

impl Placed<f32> {
    /// The value at `s` of a span that is in `block` there: as the integral has it.
    #[inline(always)]
    fn value_at(&self, span: &Span, block: &Block, s: f32) -> f32 {
        let cell = block.cell(span, s);
        match self.lattice.interpolation() {
            Interpolation::Constant => self.lattice.voxel(cell),
            Interpolation::Trilinear => f32::mean(&self.lattice.corners(cell), span.within(cell, s)),
        }
    }

    /// Shows `visit` the points that are strewn over a span, if the extinction is `sigma` times the value, until it breaks off: where, the
    /// value there, the largest of its block, and a uniform.
    #[inline(always)]
    fn strew(
        &self,
        span: &Span,
        sigma: f32,
        random: &mut Stream,
        mut visit: impl FnMut(f32, f32, f32, f32) -> ControlFlow<()>,
    ) {
        let (mut left, mut uniform) = draw(random);
        span.blocks(&self.lattice, |block, majorant, from, to| {
            let most = sigma * majorant;
            let mut s = from;
            loop {
                let next = s + left / most;
                // Also where there is nothing to divide by.
                if next >= to || next.is_nan() {
                    left = (left - (to - s) * most).max(0.0);
                    return ControlFlow::Continue(());
                }
                s = next;
                visit(s, self.value_at(span, &block, s), majorant, uniform)?;
                (left, uniform) = draw(random);
            }
        });
    }

    /// Where on `origin` + t·`dir`, t0 < t < t1, the next collision is, if the extinction is `sigma` times the value; none where the
    /// stretch ends before. `t1` may be infinite.
    #[inline]
    pub fn track(
        &self,
        origin: Vec3A,
        dir: Vec3A,
        (t0, t1): (f32, f32),
        sigma: f32,
        random: &mut Stream,
    ) -> Option<f32> {
        let span = self.span(origin, dir, t0, t1)?;
        let mut found = None;
        self.strew(&span, sigma, random, |s, value, majorant, uniform| {
            if uniform * majorant < value {
                found = Some(s);
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
        // Never out of the stretch.
        found.map(|s| ((span.start + f64::from(s)) as f32).max(t0).min(t1.next_down()))
    }

    /// An estimate of exp(−∫ `sigma` · value) over the stretch; `t1` may be infinite.
    #[inline]
    pub fn ratio(
        &self,
        origin: Vec3A,
        dir: Vec3A,
        (t0, t1): (f32, f32),
        sigma: f32,
        random: &mut Stream,
    ) -> f32 {
        let Some(span) = self.span(origin, dir, t0, t1) else { return 1.0 };
        let mut passed = 1.0;
        self.strew(&span, sigma, random, |_, value, majorant, uniform| {
            passed *= 1.0 - value / majorant;
            if passed < FAINT {
                if uniform * FAINT >= passed {
                    passed = 0.0;
                    return ControlFlow::Break(());
                }
                passed = FAINT;
            }
            ControlFlow::Continue(())
        });
        passed
    }

    /// Shows `visit` the parts of a stretch that are in one block each, by distance from `t0`, with what no value there is above.
    #[cfg(test)]
    pub fn majorants(
        &self,
        origin: Vec3A,
        dir: Vec3A,
        (t0, t1): (f32, f32),
        mut visit: impl FnMut(f32, f64, f64),
    ) {
        let Some(span) = self.span(origin, dir, t0, t1) else { return };
        span.blocks(&self.lattice, |_, majorant, a, b| {
            visit(majorant, span.start + f64::from(a), span.start + f64::from(b));
            ControlFlow::Continue(())
        });
    }
}
