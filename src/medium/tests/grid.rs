//! Grids against a slow trilinear function of our own and its quadrature, in f64.

use crate::math::testing::stream;
use crate::math::{Stream, warp};
use crate::medium::grid::{Interpolation, Lattice, Placed};
use glam::{Affine3A, DVec3, Mat3A, UVec3, Vec3, Vec3A};
use proptest::prelude::*;

/// A grid, and all that a slow evaluation needs of it.
#[derive(Clone)]
pub struct Case {
    size: UVec3,
    values: Vec<f32>,
    interpolation: Interpolation,
    from_unit: Affine3A,
}

impl Case {
    /// Of any size up to 20 a side, anywhere, skewed, with parts where there is nothing.
    pub fn random(s: &mut Stream, interpolation: Interpolation) -> Self {
        let size = UVec3::from_array(std::array::from_fn(|_| 1 + (s.next_1d() * 19.99) as u32));
        let hole = s.next_1d();
        let count = size.element_product() as usize;
        let values = (0..count)
            .map(|i| {
                // Whole slabs of nothing, for the blocks, and single holes.
                let x = i % size.x as usize;
                let empty = (hole < 0.5 && x < size.x as usize / 2) || s.next_1d() < 0.3 * hole;
                if empty { 0.0 } else { s.next_1d() * 5.0 }
            })
            .collect();
        let column = |s: &mut Stream| warp::uniform_sphere(s.next_2d()) * (0.5 + 2.0 * s.next_1d());
        let matrix3 = loop {
            let m = Mat3A::from_cols(column(s), column(s), column(s));
            if m.determinant().abs() > 0.3 {
                break m;
            }
        };
        let from_unit = Affine3A { matrix3, translation: warp::uniform_sphere(s.next_2d()) * 3.0 };
        Self { size, values, interpolation, from_unit }
    }

    pub fn placed(&self) -> Placed<f32> {
        let lattice = Lattice::new(self.size, &self.values, self.interpolation).expect("a grid");
        Placed::new(lattice, self.from_unit).expect("a place")
    }

    /// Of noise, of this size, in the unit cube.
    pub fn noise(s: &mut Stream, size: UVec3, interpolation: Interpolation) -> Self {
        let values = (0..size.element_product()).map(|_| s.next_1d() * 5.0).collect();
        Self { size, values, interpolation, from_unit: Affine3A::IDENTITY }
    }

    /// Another grid about the same place, of another size and box.
    pub fn beside(&self, s: &mut Stream) -> Self {
        let other = Self::random(s, self.interpolation);
        let shift = Affine3A::from_scale_rotation_translation(
            Vec3::new(1.1, 0.8, 0.9),
            glam::Quat::from_rotation_z(0.3),
            Vec3::new(0.1, -0.1, 0.1),
        );
        Self { from_unit: self.from_unit * shift, ..other }
    }

    /// The same grid with other values, each less or more than it was.
    pub fn varied(&self, s: &mut Stream) -> Self {
        let values = self.values.iter().map(|v| v * 2.0 * s.next_1d()).collect();
        Self { values, ..self.clone() }
    }

    /// The same grid with all values multiplied by `by`.
    pub fn scaled(self, by: f32) -> Self {
        let values = self.values.iter().map(|v| v * by).collect();
        Self { values, ..self }
    }

    /// The largest value.
    pub fn largest(&self) -> f64 {
        self.values.iter().fold(0.0, |a, b| a.max(f64::from(*b)))
    }

    /// Three grids of the same size and place as one of three numbers a value.
    pub fn together(cases: &[Self; 3]) -> Placed<Vec3> {
        let numbers: Vec<f32> =
            (0..cases[0].values.len()).flat_map(|i| [0, 1, 2].map(|c| cases[c].values[i])).collect();
        let lattice = Lattice::new(cases[0].size, &numbers, cases[0].interpolation).expect("a grid");
        Placed::new(lattice, cases[0].from_unit).expect("a place")
    }

    fn at(&self, i: [i64; 3]) -> f64 {
        let n = self.size.as_i64vec3().to_array();
        let c: [i64; 3] = std::array::from_fn(|a| i[a].clamp(0, n[a] - 1));
        f64::from(self.values[((c[2] * n[1] + c[1]) * n[0] + c[0]) as usize])
    }

    /// In voxels from the box's corner.
    fn voxels(&self, p: DVec3) -> DVec3 {
        let m = self.from_unit.matrix3;
        let inverse =
            glam::DMat3::from_cols(m.x_axis.as_dvec3(), m.y_axis.as_dvec3(), m.z_axis.as_dvec3()).inverse();
        inverse * (p - self.from_unit.translation.as_dvec3()) * self.size.as_dvec3()
    }

    /// By the definition.
    pub fn value(&self, p: DVec3) -> f64 {
        let v = self.voxels(p);
        if v.cmplt(DVec3::ZERO).any() || v.cmpgt(self.size.as_dvec3()).any() {
            return 0.0;
        }
        if self.interpolation == Interpolation::Constant {
            return self.at(v.floor().as_i64vec3().to_array());
        }
        let v = v - 0.5;
        let cell = v.floor();
        let f = v - cell;
        let c = cell.as_i64vec3().to_array();
        let mut sum = 0.0;
        for corner in 0..8 {
            let bits = [corner & 1, corner >> 1 & 1, corner >> 2];
            let weight: f64 = (0..3).map(|a| if bits[a] == 1 { f[a] } else { 1.0 - f[a] }).product();
            sum += weight * self.at(std::array::from_fn(|a| c[a] + bits[a] as i64));
        }
        sum
    }

    /// Where the planes between cells cut a ray, and its ends.
    pub fn cuts(&self, ray: &Line) -> Vec<f64> {
        let (o, d) = (self.voxels(ray.at(0.0)), self.voxels(ray.at(1.0)) - self.voxels(ray.at(0.0)));
        let mut cuts = vec![ray.t0, ray.t1];
        for axis in 0..3 {
            // All planes of either kind: too many do no harm.
            for half in 0..=2 * self.size[axis] {
                let t = (0.5 * f64::from(half) - o[axis]) / d[axis];
                if t > ray.t0 && t < ray.t1 {
                    cuts.push(t);
                }
            }
        }
        cuts.sort_by(f64::total_cmp);
        cuts
    }

    /// By Simpson's rule, which is exact for cubics, between all planes.
    pub fn integral(&self, ray: &Line) -> f64 {
        let piece = |a: f64, b: f64| {
            // Just within: at its ends the function may jump.
            let (a, b) = (a + 1e-9 * (b - a), b - 1e-9 * (b - a));
            let f = |t: f64| self.value(ray.at(t));
            (f(a) + 4.0 * f(0.5 * (a + b)) + f(b)) / 6.0 * (b - a)
        };
        self.cuts(ray).windows(2).map(|c| piece(c[0], c[1])).sum()
    }
}

/// A part of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    pub origin: Vec3A,
    pub dir: Vec3A,
    pub t0: f64,
    pub t1: f64,
}

impl Line {
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin.as_dvec3() + self.dir.as_dvec3() * t
    }

    /// Through a point of the box, from in or out of it.
    pub fn through(s: &mut Stream, case: &Case) -> Self {
        let inside = Vec3A::new(s.next_1d(), s.next_1d(), s.next_1d());
        let point = case.from_unit.transform_point3a(inside);
        let dir = warp::uniform_sphere(s.next_2d());
        let back = 6.0 * s.next_1d() - 1.0;
        let (t0, t1) = (f64::from(0.5 * s.next_1d()), f64::from(0.6 + 8.0 * s.next_1d()));
        Self { origin: point - dir * back, dir, t0, t1 }
    }

    pub fn ends(&self) -> (f32, f32) {
        (self.t0 as f32, self.t1 as f32)
    }
}

/// How far f32 may be off: positions are known to 1e-6 of 10, which is 1e-4 of a voxel, and values are up to 5.
fn assert_near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() < 2e-5 * expected + 2e-4, "{what}: {found} for {expected}");
}

pub const KINDS: [Interpolation; 2] = [Interpolation::Trilinear, Interpolation::Constant];

#[test]
fn integrals_are_those_of_the_slow_function() {
    for kind in KINDS {
        let mut s = stream(900);
        let mut seen = 0.0;
        for _ in 0..60 {
            let case = Case::random(&mut s, kind);
            let grid = case.placed();
            for _ in 0..40 {
                let line = Line::through(&mut s, &case);
                let (t0, t1) = line.ends();
                let (found, expected) = (grid.integral(line.origin, line.dir, t0, t1), case.integral(&line));
                assert_near(found, expected, &format!("{kind:?} {:?} {line:?}", case.size));
                seen += expected;
                // From the other end.
                let back = grid.integral(line.origin + line.dir * (t0 + t1), -line.dir, t0, t1);
                assert_near(back, found, "from the other end");
                // In parts.
                let middle = t0 + (t1 - t0) * s.next_1d();
                let parts = grid.integral(line.origin, line.dir, t0, middle)
                    + grid.integral(line.origin, line.dir, middle, t1);
                assert!((parts - found).abs() < 1e-5 * found.max(0.1), "in parts: {parts} for {found}");
            }
        }
        assert!(seen > 1000.0, "{seen}");
    }
}

/// Integrals up to places along a ray, from in or out of the grid and beyond it, are those to each of them alone.
#[test]
fn integrals_up_to_places_are_those_to_each() {
    for kind in KINDS {
        let mut s = stream(903);
        for _ in 0..100 {
            let case = Case::random(&mut s, kind);
            let grid = case.placed();
            let line = Line::through(&mut s, &case);
            let (_, length) = line.ends();
            // Many in a cell, and many cells between two.
            for parts in [1, 2, 7, 300] {
                let mut found = Vec::new();
                grid.integrals(line.origin, line.dir, length, parts, |sum: f64| found.push(sum));
                assert_eq!(found.len(), parts - 1);
                let mut last = 0.0;
                for (i, found) in found.into_iter().enumerate() {
                    let t = length * ((i + 1) as f32 / parts as f32);
                    let expected = grid.integral(line.origin, line.dir, 0.0, t);
                    let off = (found - expected).abs();
                    assert!(off < 2e-6 * expected + 5e-6, "{kind:?} {i} of {parts}: {found} for {expected}");
                    assert!(found >= last);
                    last = found;
                }
            }
        }
    }
}

#[test]
fn values_are_those_of_the_slow_function() {
    for kind in KINDS {
        let mut s = stream(901);
        for _ in 0..60 {
            let case = Case::random(&mut s, kind);
            let grid = case.placed();
            for _ in 0..60 {
                let unit = Vec3A::new(s.next_1d(), s.next_1d(), s.next_1d()) * 1.4 - 0.2;
                let p = case.from_unit.transform_point3a(unit);
                let voxels = case.voxels(p.as_dvec3());
                let edge = (voxels - voxels.round()).abs().min_element() < 1e-3;
                if !edge {
                    assert_near(grid.value(p).into(), case.value(p.as_dvec3()), "value");
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]
    /// Any grid, any ray, any part of the depth.
    #[test]
    fn inversion_undoes_integration(seed in 0u64..1_000_000, constant: bool, share in 0.0f64..1.2) {
        let mut s = stream(seed);
        let case = Case::random(&mut s, KINDS[usize::from(constant)]);
        let grid = case.placed();
        let line = Line::through(&mut s, &case);
        let (t0, t1) = line.ends();
        let whole = grid.integral(line.origin, line.dir, t0, t1);
        let target = share * whole;
        match grid.invert(line.origin, line.dir, t0, t1, 0, target) {
            Ok(t) => {
                prop_assert!(t >= t0 && t < t1 && target < whole * (1.0 + 1e-12));
                let found = grid.integral(line.origin, line.dir, t0, t);
                let (same, sum) = grid.advance(line.origin, line.dir, t0, t1, 0, target).expect("it is reached");
                prop_assert!(same == t && (sum - found).abs() <= 2e-6 * found + 2e-6, "{sum} {found}");
                // One step of t is worth as much.
                let step = 5.0 * f64::from(t.next_up() - t);
                prop_assert!((found - target).abs() <= 3e-6 * target + 2.0 * step, "{found} {target}");
            }
            Err(all) => {
                prop_assert!(target >= whole || whole == 0.0);
                prop_assert_eq!(all.to_bits(), whole.to_bits());
            }
        }
    }

    /// Whatever the ray, there is a number: along faces, edges and through corners, from anywhere, without an end.
    #[test]
    fn odd_rays_have_integrals(
        n in prop::array::uniform3(1u32..19),
        o in prop::array::uniform3(-2i8..20),
        d in prop::array::uniform3(-1i8..2),
        halves: bool,
        constant: bool,
    ) {
        prop_assume!(d != [0, 0, 0]);
        let size = UVec3::from(n);
        let lattice = Lattice::<f32>::new(size, &vec![1.5; size.element_product() as usize], KINDS[usize::from(constant)]);
        // A voxel a metre.
        let grid = Placed::new(lattice.expect("a grid"), Affine3A::from_scale(size.as_vec3())).expect("a place");
        let off = if halves { 0.5 } else { 0.0 };
        let origin = Vec3A::from_array(o.map(|o| f32::from(o) + off));
        let dir = Vec3A::from_array(d.map(f32::from)).normalize();
        let integral: f64 = grid.integral(origin, dir, 0.0, f32::INFINITY);
        let inside = grid.crossing(origin, dir, 0.0, f32::INFINITY).map_or(0.0, |(a, b)| f64::from(b - a));
        prop_assert!((integral - 1.5 * inside).abs() < 1e-4, "{integral} for {inside}");
        if let Ok(t) = grid.invert(origin, dir, 0.0, f32::INFINITY, 0, 0.5 * integral) {
            prop_assert!(grid.value(origin + dir * t) == 1.5);
        }
    }
}

#[test]
fn colours_are_three_grids() {
    for kind in KINDS {
        let mut s = stream(902);
        let case = Case::random(&mut s, kind);
        let scale = [1.0, 0.25, 3.0];
        let numbers: Vec<f32> = case.values.iter().flat_map(|v| scale.map(|k| k * v)).collect();
        let lattice = Lattice::<Vec3>::new(case.size, &numbers, kind).expect("a grid");
        let (colours, one) = (Placed::new(lattice, case.from_unit).expect("a place"), case.placed());
        for _ in 0..200 {
            let line = Line::through(&mut s, &case);
            let (t0, t1) = line.ends();
            let (three, single) = (
                colours.integral(line.origin, line.dir, t0, t1),
                one.integral(line.origin, line.dir, t0, t1),
            );
            for c in 0..3 {
                let expected = single * f64::from(scale[c]);
                assert!((three[c] - expected).abs() < 1e-5 * expected.max(0.01), "{three} for {single}");
                let found = colours.invert(line.origin, line.dir, t0, t1, c, 0.5 * three[c]);
                let alone =
                    one.invert(line.origin, line.dir, t0, t1, 0, 0.5 * three[c] / f64::from(scale[c]));
                if let (Ok(a), Ok(b)) = (found, alone) {
                    assert!((a - b).abs() < 1e-4, "{a} {b}");
                }
            }
        }
    }
}

#[test]
fn a_grid_takes_little_more_than_its_numbers() {
    // Bricks of 4³ that are hardly filled, for their size, for being flat and for being thin, among them.
    for [x, y, z] in [[40, 40, 40], [33, 33, 33], [97, 97, 97], [128, 128, 128], [1, 300, 300], [5, 2000, 5]]
    {
        let numbers = vec![1.0; x * y * z];
        for kind in KINDS {
            let size = UVec3::new(x as u32, y as u32, z as u32);
            let lattice = Lattice::<f32>::new(size, &numbers, kind).expect("a grid");
            let ratio = lattice.bytes() as f64 / (4 * numbers.len()) as f64;
            assert!(ratio < 1.3, "{size} {kind:?}: {ratio}");
        }
    }
}

#[test]
fn what_is_no_grid_is_refused() {
    let new = |size: [u32; 3], numbers: &[f32]| {
        Lattice::<f32>::new(size.into(), numbers, Interpolation::Trilinear).map(|_| ()).expect_err("no grid")
    };
    for (message, word) in [
        (new([0, 1, 1], &[]), "no values"),
        (new([2, 2, 2], &[1.0; 7]), "takes 8 numbers: found 7"),
        (new([2, 1, 2], &[1.0, 1.0, -1.0, 1.0]), "(0, 0, 1) is -1"),
        (new([2, 1, 1], &[1.0, f32::NAN]), "(1, 0, 0) is NaN"),
        (new([1 << 20, 1 << 20, 1 << 20], &[]), "too large"),
    ] {
        assert!(message.contains(word), "{message}");
    }
    let lattice = Lattice::<f32>::new(UVec3::ONE, &[1.0], Interpolation::Constant).expect("a grid");
    let flat = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    assert!(Placed::new(lattice, flat).expect_err("flat").contains("singular"));
}
