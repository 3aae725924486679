//! A render with a budget: the loop around the iterations, its clock, and what is kept of it.
//!
//! The clock runs during iterations, and the pilots before them. What watchers do between them (metrics, progress, files) is not counted.

mod again;
mod budget;
pub mod files;
mod job;
pub mod observer;
pub mod tev;
pub mod waits;

pub use budget::{Budget, Spent, Stop};
pub use job::{Engine, Job, LEFT_OUT, Outcome};
pub use observer::{Observer, Silent};
