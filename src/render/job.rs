//! The loop around the iterations.

use super::{Budget, Observer, Stop};
use crate::error::Result;
use crate::film::Film;
use crate::scene::Scene;
use crate::transport::Renderer;
use crate::transport::settings::Settings;
use std::time::Instant;

/// A render to be done.
#[derive(Clone, Copy, Debug)]
pub struct Job<'a> {
    /// What is rendered.
    pub scene: &'a Scene,
    /// How.
    pub settings: Settings,
    /// For how long.
    pub budget: Budget,
    /// Number of the first iteration: a render that goes on with an earlier one starts where that ended.
    pub first: u64,
}

/// What came of a [`Job`], or has come of it so far.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The sums; the number of iterations is there.
    pub film: Film,
    /// Rendering, by the wall clock.
    pub seconds: f64,
    /// Camera subpaths that were walked.
    pub camera_paths: u64,
    /// Light subpaths that were walked.
    pub light_paths: u64,
    /// Vertices of light subpaths that were stored.
    pub light_vertices: u64,
    /// Whether it was stopped before its budget was used up.
    pub partial: bool,
}

impl Job<'_> {
    /// Iterates until the budget is used up or a stop is asked for; `each` sees every completed iteration, outside
    /// the clock, and may refuse to go on.
    ///
    /// # Errors
    /// Settings that make no sense for the scene, and whatever `each` returns.
    pub fn run(
        &self,
        stop: &Stop,
        observer: &mut dyn Observer,
        mut each: impl FnMut(&Outcome) -> Result<()>,
    ) -> Result<Outcome> {
        let mut renderer = Renderer::new(self.scene, self.settings)?;
        let mut outcome = Outcome {
            film: Film::new(&self.scene.camera, &self.settings),
            seconds: 0.0,
            camera_paths: 0,
            light_paths: 0,
            light_vertices: 0,
            partial: false,
        };
        while self.budget.goes_on(outcome.film.iterations(), outcome.seconds) {
            if stop.requested() {
                outcome.partial = true;
                break;
            }
            let start = Instant::now();
            let stats = renderer.iteration(self.first + outcome.film.iterations(), &mut outcome.film);
            outcome.seconds += start.elapsed().as_secs_f64();
            outcome.camera_paths += stats.camera_paths;
            outcome.light_paths += stats.light_paths;
            outcome.light_vertices += stats.light_vertices;
            observer.advance(outcome.film.iterations(), outcome.seconds);
            each(&outcome)?;
        }
        Ok(outcome)
    }
}
