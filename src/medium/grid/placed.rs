//! A grid somewhere in the world.

use super::lattice::{Interpolation, Lattice};
use super::texel::Texel;
use super::traverse::Span;
use glam::{Affine3A, DAffine3, DMat3, DVec3, Vec3A};
use std::ops::ControlFlow;

/// Half the distance of the two points of the Gauss-Legendre rule, as a part of half the interval: 1/√3.
const GAUSS: f32 = 0.577_350_26;
/// So far outside of its box, in voxels, a grid's value is still that on the face: rounding must not lead to where nothing
/// is.
const SLACK: f32 = 1.0 / 4096.0;
/// Newton's steps at most; a bracket of f32 is halved away long before.
const STEPS: usize = 40;

/// A grid and its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed<T> {
    pub(super) lattice: Lattice<T>,
    /// From the world to lattice coordinates.
    to_lattice: DAffine3,
    /// From the box, as the unit cube, to the world.
    from_unit: DAffine3,
}

impl<T: Texel> Placed<T> {
    /// `from_unit` puts the grid's box, as the unit cube, into the world.
    ///
    /// # Errors
    /// Where that flattens it.
    pub fn new(lattice: Lattice<T>, from_unit: Affine3A) -> Result<Self, String> {
        if crate::geometry::transform::is_singular(&from_unit) {
            return Err("the grid's place is singular: its box has no volume".into());
        }
        let m = from_unit.matrix3;
        let from_unit = DAffine3 {
            matrix3: DMat3::from_cols(m.x_axis.as_dvec3(), m.y_axis.as_dvec3(), m.z_axis.as_dvec3()),
            translation: from_unit.translation.as_dvec3(),
        };
        let (low, _) = lattice.bounds();
        let to_lattice = DAffine3::from_translation(low)
            * DAffine3::from_scale(lattice.size().as_dvec3())
            * from_unit.inverse();
        Ok(Self { lattice, to_lattice, from_unit })
    }

    /// The grid in its own coordinates.
    pub fn lattice(&self) -> &Lattice<T> {
        &self.lattice
    }

    /// The corners of the box in the world.
    pub fn corners(&self) -> [Vec3A; 8] {
        std::array::from_fn(|i| {
            let corner = DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
            self.from_unit.transform_point3(corner).as_vec3a()
        })
    }

    /// Volume of the box, m³.
    pub fn volume(&self) -> f64 {
        self.from_unit.matrix3.determinant().abs()
    }

    /// Whether another grid has the same size, place and interpolation.
    pub fn is_like<U: Texel>(&self, other: &Placed<U>) -> bool {
        self.lattice.size() == other.lattice.size()
            && self.lattice.interpolation() == other.lattice.interpolation()
            && self.to_lattice == other.to_lattice
    }

    /// The shortest edge of a voxel in the world (metres).
    pub fn voxel(&self) -> f64 {
        let size = self.lattice.size().as_dvec3();
        let m = self.from_unit.matrix3;
        (m.x_axis.length() / size.x).min(m.y_axis.length() / size.y).min(m.z_axis.length() / size.z)
    }

    /// The value at a point.
    #[inline]
    pub fn value(&self, p: Vec3A) -> T::Wide {
        let at = self.to_lattice.transform_point3(p.as_dvec3()).as_vec3a();
        let (low, high) = self.lattice.bounds();
        let (low, high) = (low.as_vec3a(), high.as_vec3a());
        // Also what is not a number is outside.
        if !(at.cmpge(low - SLACK) & at.cmple(high + SLACK)).all() {
            return T::NONE;
        }
        let at = at.clamp(low, high);
        let cell = at.floor().min(self.lattice.last);
        match self.lattice.interpolation() {
            Interpolation::Constant => self.lattice.voxel(cell).wide(),
            Interpolation::Trilinear => T::mean(&self.lattice.corners(cell), at - cell),
        }
    }

    #[inline]
    pub(super) fn span(&self, origin: Vec3A, dir: Vec3A, t0: f32, t1: f32) -> Option<Span> {
        let (t0, t1) = (f64::from(t0), f64::from(t1));
        let origin = self.to_lattice.transform_point3(origin.as_dvec3());
        let dir = self.to_lattice.transform_vector3(dir.as_dvec3());
        Span::new(origin, dir, t0, t1, self.lattice.bounds())
    }

    /// The longest edge of a voxel in the world (metres).
    pub fn longest(&self) -> f64 {
        let size = self.lattice.size().as_dvec3();
        let m = self.from_unit.matrix3;
        (m.x_axis.length() / size.x).max(m.y_axis.length() / size.y).max(m.z_axis.length() / size.z)
    }

    /// Where the stretch `t0`..`t1` of `origin` + t·`dir` is in the box.
    pub fn crossing(&self, origin: Vec3A, dir: Vec3A, t0: f32, t1: f32) -> Option<(f32, f32)> {
        let span = self.span(origin, dir, t0, t1)?;
        let end = (span.start + f64::from(span.end)) as f32;
        Some((span.start as f32, end.next_up().min(t1)))
    }

    /// The integral over the stretch `t0`..`t1` of `origin` + t·`dir`; `t1` may be infinite.
    #[inline]
    pub fn integral(&self, origin: Vec3A, dir: Vec3A, t0: f32, t1: f32) -> T::Sum {
        let Some(span) = self.span(origin, dir, t0, t1) else { return T::EMPTY };
        let mut sum = T::EMPTY;
        match self.lattice.interpolation() {
            Interpolation::Constant => span.march(&self.lattice, |cell, a, b| {
                sum = T::add(sum, self.lattice.voxel(cell).wide() * (b - a));
                ControlFlow::Continue(())
            }),
            Interpolation::Trilinear => span.march(&self.lattice, |cell, a, b| {
                sum = T::add(sum, gauss(&self.lattice.corners(cell), &span, cell, a, b));
                ControlFlow::Continue(())
            }),
        }
        sum
    }

    /// Where on the stretch the integral of `channel` from `t0` on reaches `target`.
    ///
    /// # Errors
    /// Where it does not, the integral over all of it.
    #[inline]
    pub fn invert(
        &self,
        origin: Vec3A,
        dir: Vec3A,
        t0: f32,
        t1: f32,
        channel: usize,
        target: f64,
    ) -> Result<f32, T::Sum> {
        self.advance(origin, dir, t0, t1, channel, target).map(|(t, _)| t)
    }

    /// [`Self::invert`], with the integral from `t0` to where that is, as [`Self::integral`] has it.
    ///
    /// # Errors
    /// Where the target is not reached, the integral over all of the stretch.
    #[inline]
    pub fn advance(
        &self,
        origin: Vec3A,
        dir: Vec3A,
        t0: f32,
        t1: f32,
        channel: usize,
        target: f64,
    ) -> Result<(f32, T::Sum), T::Sum> {
        let Some(span) = self.span(origin, dir, t0, t1) else { return Err(T::EMPTY) };
        let mut sum = T::EMPTY;
        let mut found = None;
        let lattice = &self.lattice;
        // What is still wanted where a cell has it, with what that cell has.
        let mut wanted = |term: T::Wide| {
            let (before, own) = (T::channel_of_sum(sum, channel), T::channel(term, channel));
            if before + f64::from(own) > target {
                return Some(((target - before).max(0.0) as f32, own));
            }
            sum = T::add(sum, term);
            None
        };
        match lattice.interpolation() {
            Interpolation::Constant => span.march(lattice, |cell, a, b| {
                let term = lattice.voxel(cell).wide() * (b - a);
                let Some((rest, own)) = wanted(term) else { return ControlFlow::Continue(()) };
                found = Some((cell, a, (a + (b - a) * (rest / own)).min(b)));
                ControlFlow::Break(())
            }),
            Interpolation::Trilinear => span.march(lattice, |cell, a, b| {
                let corners = lattice.corners(cell);
                let Some((rest, own)) = wanted(gauss(&corners, &span, cell, a, b)) else {
                    return ControlFlow::Continue(());
                };
                let integral = |b: f32| T::channel(gauss(&corners, &span, cell, a, b), channel);
                let value = |s: f32| T::channel(T::mean(&corners, span.within(cell, s)), channel);
                found = Some((cell, a, solve((a, b), rest, own, integral, value)));
                ControlFlow::Break(())
            }),
        }
        let Some((cell, a, s)) = found else { return Err(sum) };
        // Rounded down: never beyond the depth that was asked for, and never out of the stretch.
        let t = span.start + f64::from(s);
        let rounded = t as f32;
        let rounded = if f64::from(rounded) > t { rounded.next_down() } else { rounded };
        let rounded = rounded.max(t0).min(t1.next_down());
        let s = (f64::from(rounded) - span.start) as f32;
        if s > a {
            let last = match lattice.interpolation() {
                Interpolation::Constant => lattice.voxel(cell).wide() * (s - a),
                Interpolation::Trilinear => gauss(&lattice.corners(cell), &span, cell, a, s),
            };
            sum = T::add(sum, last);
        }
        Ok((rounded, sum))
    }

    /// Shows `mark` the integrals from 0 to `length` i/`parts` of `origin` + t·`dir`, for i from 1 to `parts` − 1.
    pub fn integrals(
        &self,
        origin: Vec3A,
        dir: Vec3A,
        length: f32,
        parts: usize,
        mut mark: impl FnMut(T::Sum),
    ) {
        if parts < 2 {
            return;
        }
        let Some(span) = self.span(origin, dir, 0.0, length) else {
            return (1..parts).for_each(|_| mark(T::EMPTY));
        };
        let mut marks = Marks { length, parts, start: span.start, next: 1, at: 0.0, sum: T::EMPTY, mark };
        marks.at = marks.place();
        let lattice = &self.lattice;
        match lattice.interpolation() {
            Interpolation::Constant => span.march(lattice, |cell, a, b| {
                let value = lattice.voxel(cell).wide();
                marks.cross::<T>(a, b, |a, b| value * (b - a))
            }),
            Interpolation::Trilinear => span.march(lattice, |cell, a, b| {
                let corners = lattice.corners(cell);
                marks.cross::<T>(a, b, |a, b| gauss(&corners, &span, cell, a, b))
            }),
        }
        (marks.next..parts).for_each(|_| (marks.mark)(marks.sum));
    }

    /// Shows `visit` the parts of the stretch in single cells, by distance from `t0`: between two of them the function is a
    /// polynomial. Cells in which there is nothing may be left out.
    pub fn pieces(&self, origin: Vec3A, dir: Vec3A, t0: f32, t1: f32, mut visit: impl FnMut(f64, f64)) {
        let Some(span) = self.span(origin, dir, t0, t1) else { return };
        span.march(&self.lattice, |_, a, b| {
            visit(span.start + f64::from(a), span.start + f64::from(b));
            ControlFlow::Continue(())
        });
    }
}

/// An integral along a ray that is shown at places equally far apart.
struct Marks<S, F> {
    length: f32,
    parts: usize,
    /// The ray's parameter where the span begins.
    start: f64,
    /// The next place, and where on the span it is.
    next: usize,
    at: f32,
    sum: S,
    mark: F,
}

impl<S: Copy, F: FnMut(S)> Marks<S, F> {
    /// Where on the span the next place is.
    fn place(&self) -> f32 {
        let t = self.length * (self.next as f32 / self.parts as f32);
        (f64::from(t) - self.start) as f32
    }

    /// The ray is in a cell from `a` to `b`. Since the last one there was nothing; after the last place nothing is asked for.
    #[inline(always)]
    fn cross<T: Texel<Sum = S>>(
        &mut self,
        mut a: f32,
        b: f32,
        integral: impl Fn(f32, f32) -> T::Wide,
    ) -> ControlFlow<()> {
        while self.at <= b {
            if self.at > a {
                self.sum = T::add(self.sum, integral(a, self.at));
                a = self.at;
            }
            (self.mark)(self.sum);
            self.next += 1;
            if self.next >= self.parts {
                return ControlFlow::Break(());
            }
            self.at = self.place();
        }
        self.sum = T::add(self.sum, integral(a, b));
        ControlFlow::Continue(())
    }
}

/// The integral over the part `a`..`b` of a span in one cell.
#[inline(always)]
fn gauss<T: Texel>(corners: &[T; 8], span: &Span, cell: Vec3A, a: f32, b: f32) -> T::Wide {
    let half = 0.5 * (b - a);
    let middle = a + half;
    let off = GAUSS * half;
    let before = T::mean(corners, span.within(cell, middle - off));
    let after = T::mean(corners, span.within(cell, middle + off));
    (before + after) * half
}

/// Where the integral from `a` on is `wanted`, of which all up to `b` is `whole`.
fn solve(
    (a, b): (f32, f32),
    wanted: f32,
    whole: f32,
    integral: impl Fn(f32) -> f32,
    value: impl Fn(f32) -> f32,
) -> f32 {
    let (mut low, mut high) = (a, b);
    let mut s = a + (b - a) * (wanted / whole).min(1.0);
    for _ in 0..STEPS {
        let off = integral(s) - wanted;
        if off.abs() <= f32::EPSILON * wanted {
            return s;
        }
        if off > 0.0 {
            high = s;
        } else {
            low = s;
        }
        let newton = s - off / value(s);
        // Also where there is nothing to divide by.
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if next == s || next <= low || next >= high {
            return next;
        }
        s = next;
    }
    s
}
