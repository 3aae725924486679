//! Small things that the compiler would make a branch or a quotient of.

use glam::Vec3A;

/// `a` where `first`, else `b`, without a branch. For choices that no processor can foretell: of two floating-point numbers the
/// compiler makes a jump of an `if`, which costs as much as thirty multiplications where it is guessed wrong.
#[inline(always)]
pub fn choose(first: bool, a: f32, b: f32) -> f32 {
    let mask = 0u32.wrapping_sub(u32::from(first));
    f32::from_bits(b.to_bits() ^ ((a.to_bits() ^ b.to_bits()) & mask))
}

/// `v`, whose length is 1 but for roundings, at the length 1: one step of Newton's method for 1/√, which leaves 3/8 of the square
/// of what v² was off by, and needs neither root nor quotient.
#[inline(always)]
pub fn renormalized(v: Vec3A) -> Vec3A {
    v * (1.5 - 0.5 * v.length_squared())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_one_that_is_chosen_comes_out_to_the_bit() {
        for (a, b) in [(1.0, 2.0), (0.0, -0.0), (f32::INFINITY, f32::MIN_POSITIVE), (-3.5, f32::NAN)] {
            for (first, expected) in [(true, a), (false, b)] {
                assert_eq!(choose(first, a, b).to_bits(), expected.to_bits(), "{a} {b}");
            }
        }
    }

    #[test]
    fn lengths_become_one() {
        for v in [Vec3A::new(0.6, 0.0, 0.8), Vec3A::new(-0.48, 0.6, 0.64)] {
            for off in [-1e-4, -1e-6, 0.0, 1e-7, 1e-4] {
                let u = renormalized(v * (1.0 + off));
                assert!((u.as_dvec3().length() - 1.0).abs() < 1.5e-7 && u.distance(v) < 2e-7, "{v} {off}");
            }
        }
    }
}
