//! Images: what they are in memory, EXR and PNG files, tone curves and false colour.

pub mod accumulator;
pub mod exr;
pub mod false_color;
pub mod image;
pub mod layout;
pub mod output;
pub mod png;
mod state;
mod sums;

pub use accumulator::{BAND_ROWS, Band, Dropped, Film, Outlier, Sample, Splat};
pub use image::{Image, ScalarImage};
pub use layout::{ImageKind, Layout};
pub use state::Planes;
