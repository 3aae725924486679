//! Images: what they are in memory, EXR and PNG files, tone curves and false colour.

pub mod exr;
pub mod false_color;
pub mod image;
pub mod output;
pub mod png;

pub use image::{Image, ScalarImage};
