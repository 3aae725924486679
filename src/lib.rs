//! tyndall: a volumetric light transport research renderer.
//!
//! Bidirectional path tracing with every technique on or off, alone or in any set, under one multiple
//! importance sampling weight; experiments that measure and compare the estimators.
#![deny(missing_docs)]

pub mod bsdf;
pub mod camera;
pub mod cli;
pub mod error;
pub mod experiment;
pub mod explain;
pub mod film;
pub mod geometry;
pub mod light;
pub mod math;
pub mod medium;
pub mod notation;
pub mod oracle;
pub mod render;
pub mod report;
pub mod scene;
pub mod stage;
pub mod texture;
pub mod transport;

pub use error::{Error, Result};
