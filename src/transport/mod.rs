//! The heart: walks, techniques, weights and the iteration. Nothing here knows about files, progress bars or the
//! number of threads.

pub mod camera_path;
pub mod expression;
pub mod iteration;
pub mod light_path;
pub mod merge;
pub mod mis;
pub mod pass;
pub mod settings;
pub mod sink;
pub mod technique;
pub mod thinning;
pub mod walk;

pub use expression::{Expression, Label};
pub use iteration::{IterationStats, Renderer};
pub use settings::{Connections, Heuristic, Layers, LightStarts, Settings, Tracking};
pub use technique::{Technique, TechniqueSet};
