//! Who wants to know how a render goes on: a progress bar, a log, nobody.

use super::Budget;
use crate::film::Film;

/// Follows renders, one after the other.
pub trait Observer {
    /// A render begins: what it is called, and what it may use.
    fn begin(&mut self, what: &str, budget: Budget);
    /// So many iterations are complete, in so many seconds.
    fn advance(&mut self, iterations: u64, seconds: f64);
    /// What came of it so far, for who shows it: outside the clock. `film` puts it together when it is called, which takes
    /// some time.
    fn look(&mut self, _film: &dyn Fn() -> Film) {}
    /// What came of it in the end, likewise.
    fn last(&mut self, _film: &dyn Fn() -> Film) {}
    /// The render has ended, by its budget or by a stop.
    fn end(&mut self);
    /// Something begins beside the renders that takes its time too: what it is called, and of how many steps, such as `renders`.
    fn begin_steps(&mut self, _what: &str, _count: u64, _steps: &str) {}
    /// So many of these steps are done.
    fn step(&mut self, _done: u64) {}
    /// It has ended.
    fn end_steps(&mut self) {}
    /// Something that is worth a line of its own.
    fn note(&mut self, line: &str);
}

/// Nobody.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Observer for Silent {
    fn begin(&mut self, _: &str, _: Budget) {}
    fn advance(&mut self, _: u64, _: f64) {}
    fn end(&mut self) {}
    fn note(&mut self, _: &str) {}
}
