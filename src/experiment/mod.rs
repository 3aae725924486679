//! Experiments: scenes × estimators × independent runs, measured against a reference.

pub mod metrics;
pub mod results;
pub mod statistics;
