//! Experiments: scenes × estimators × independent runs, measured against a reference.

pub mod results;
