//! Random streams: one for each subpath, hashed from what names it.
//!
//! A stream depends on (seed, iteration, kind, index) alone, so a result cannot depend on the number of
//! threads or on the order in which they ran. The four numbers are hashed, never added up: with sums, the
//! streams of seeds 1 and 2 would be each other's, shifted.

use glam::Vec2;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// What a stream of random numbers is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum StreamKind {
    /// A subpath that starts on a light.
    Light = 1,
    /// A subpath that starts on the lens.
    Camera = 2,
    /// Anything else: tests, scene preparation.
    Other = 3,
}

/// A stream of uniform random numbers.
#[derive(Clone, Debug)]
pub struct Stream(Xoshiro256PlusPlus);

/// The streams of all subpaths of a kind in an iteration: what of their names they share is hashed once.
#[derive(Clone, Copy, Debug)]
pub struct Streams(u64);

impl Streams {
    /// Of the subpaths of `kind` in `iteration` of the run `seed`.
    #[inline]
    pub fn new(seed: u64, iteration: u64, kind: StreamKind) -> Self {
        Self([seed, iteration, kind as u64].into_iter().fold(GOLDEN, join))
    }

    /// The stream of subpath `index`.
    #[inline]
    pub fn stream(&self, index: u64) -> Stream {
        Stream::from_hash(join(self.0, index))
    }
}

/// 2⁶⁴ over the golden ratio.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// A hash with one more word.
#[inline]
fn join(h: u64, word: u64) -> u64 {
    mix(h.wrapping_add(GOLDEN) ^ mix(word.wrapping_add(GOLDEN)))
}

/// The finaliser of splitmix64: a bijection of 64 bits in which each input bit reaches each output bit.
#[inline]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Stream {
    /// The stream of subpath `index` of `kind` in `iteration` of the run `seed`.
    #[inline]
    pub fn new(seed: u64, iteration: u64, kind: StreamKind, index: u64) -> Self {
        Streams::new(seed, iteration, kind).stream(index)
    }

    /// From a hash of what names the stream.
    #[inline]
    fn from_hash(mut h: u64) -> Self {
        // As `seed_from_u64` does, which is not inlined.
        let mut state = [0; 32];
        for word in state.chunks_exact_mut(8) {
            h = h.wrapping_add(GOLDEN);
            word.copy_from_slice(&mix(h).to_le_bytes());
        }
        Self(Xoshiro256PlusPlus::from_seed(state))
    }

    /// A stream of its own, named by the next word of this one: however many numbers it is asked for, this one goes on the same.
    #[inline]
    pub fn fork(&mut self) -> Self {
        Self::from_hash(self.next_u64())
    }

    /// Uniform in [0, 1), a multiple of 2^-24.
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        (self.0.next_u64() >> 40) as f32 * (1.0 / (1u32 << 24) as f32)
    }

    /// Two independent uniforms in [0, 1).
    #[inline]
    pub fn next_2d(&mut self) -> Vec2 {
        let bits = self.0.next_u64();
        let scale = 1.0 / (1u32 << 24) as f32;
        Vec2::new((bits >> 40) as f32 * scale, ((bits >> 16) & 0xff_ffff) as f32 * scale)
    }

    /// Uniform over all 64-bit words.
    #[inline]
    pub fn next_u64(&mut self) -> u64 {
        self.0.next_u64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn streams_of_neighbouring_names_do_not_meet() {
        let mut seen = HashSet::new();
        for seed in 0..4 {
            for iteration in 0..4 {
                for kind in [StreamKind::Light, StreamKind::Camera, StreamKind::Other] {
                    for index in 0..64 {
                        let mut s = Stream::new(seed, iteration, kind, index);
                        for _ in 0..8 {
                            assert!(seen.insert(s.next_u64()), "a word came twice");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn uniforms_have_the_moments_of_a_uniform() {
        let (mut sum, mut sum2, mut cross) = (0f64, 0f64, 0f64);
        let n = 200_000;
        for i in 0..n {
            let mut s = Stream::new(7, 0, StreamKind::Other, i);
            let a = f64::from(s.next_1d());
            let b = s.next_2d();
            assert!((0.0..1.0).contains(&a) && (0.0..1.0).contains(&b.x) && (0.0..1.0).contains(&b.y));
            sum += a;
            sum2 += a * a;
            cross += f64::from(b.x) * f64::from(b.y);
        }
        let n = n as f64;
        // Five standard errors each.
        assert!((sum / n - 0.5).abs() < 5.0 * (1.0f64 / 12.0 / n).sqrt());
        assert!((sum2 / n - 1.0 / 3.0).abs() < 5.0 * (4.0f64 / 45.0 / n).sqrt());
        assert!((cross / n - 0.25).abs() < 5.0 * (7.0f64 / 144.0 / n).sqrt());
    }
}
