//! Frames, warps, discrete distributions, random streams and statistics.

pub mod color;
pub mod distribution;
mod exact;
pub mod frame;
mod prefetch;
pub mod rng;
#[cfg(test)]
pub(crate) mod testing;
pub mod trig;
pub mod warp;

pub use color::{Rgb, RgbExt};
pub use distribution::{Discrete, Piecewise2d};
pub use exact::{choose, renormalized};
pub use frame::Frame;
pub(crate) use prefetch::prefetch;
pub use rng::{Stream, StreamKind, Streams};
