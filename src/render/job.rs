//! The loop around the iterations.

use super::waits::waited;
use super::{Budget, Observer, Spent, Stop};
use crate::error::Result;
use crate::film::Film;
use crate::scene::Scene;
use crate::transport::Renderer;
use crate::transport::merge::MERGES;
use crate::transport::settings::Settings;
use crate::transport::technique::Technique;
use std::time::{Duration, Instant};

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
    /// Seconds that it took to choose the settings, by pilots: a part of the budget.
    pub chosen: f64,
}

/// What came of a [`Job`], or has come of it so far.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The sums; the number of iterations is there.
    pub film: Film,
    /// Rendering, by the wall clock: what goes before the first iteration, and the iterations.
    pub seconds: f64,
    /// Of these, what went before the first iteration: pilots that choose radii, counts and shares.
    pub setup: f64,
    /// Seconds that threads waited for a processor meanwhile ([`super::waits`]), to a quarter of a second; 0 where that is not known.
    pub waited: f64,
    /// Camera subpaths that were walked.
    pub camera_paths: u64,
    /// Light subpaths that were walked.
    pub light_paths: u64,
    /// Vertices of light subpaths that were stored.
    pub light_vertices: u64,
    /// Photon beams that were stored.
    pub beams: u64,
    /// How merges gathered in the first iteration and connections were thinned out, in words, by the technique's key.
    pub merges: Vec<(String, String)>,
    /// Whether it was stopped before its budget was used up.
    pub partial: bool,
}

impl Job<'_> {
    /// Iterates until the budget is used up or a stop is asked for.
    ///
    /// # Errors
    /// Settings that make no sense for the scene.
    pub fn run(&self, stop: &Stop, observer: &mut dyn Observer) -> Result<Outcome> {
        let mut engine = Engine::new(self.scene, self.settings)?;
        engine.setup += self.chosen;
        let mut outcome = engine.nothing_yet();
        while self.budget.goes_on(outcome.spent()) {
            if stop.requested() {
                outcome.partial = true;
                break;
            }
            let done = outcome.film.iterations();
            engine.iterations(self.first + done, self.budget.room(outcome.spent()), &mut outcome);
            observer.advance(outcome.film.iterations(), outcome.seconds);
            observer.look(&|| outcome.film.clone());
        }
        observer.last(&|| outcome.film.clone());
        Ok(outcome)
    }
}

/// Renders one iteration after the other, with a clock.
pub struct Engine<'a> {
    scene: &'a Scene,
    renderer: Renderer<'a>,
    /// Seconds that it took to set up: pilots that choose radii, counts and shares.
    pub setup: f64,
    /// When it was last asked how long threads have waited, and the answer.
    asked: (Instant, Option<f64>),
    /// Seconds that an iteration took, the last time.
    pace: f64,
}

/// Iterations in one go take no longer than this, in seconds, so that progress is seen and a stop heeded.
const LONGEST_GO: f64 = 0.5;
/// No more in one go: it would save nothing more.
const MOST_AT_ONCE: u64 = 16;

/// Asking takes some reads of files.
const ASKED_EVERY: Duration = Duration::from_millis(250);

impl<'a> Engine<'a> {
    /// # Errors
    /// Settings that make no sense for the scene.
    pub fn new(scene: &'a Scene, settings: Settings) -> Result<Self> {
        let start = Instant::now();
        let renderer = Renderer::new(scene, settings)?;
        let setup = start.elapsed().as_secs_f64();
        Ok(Self { scene, renderer, setup, asked: (Instant::now(), waited()), pace: f64::INFINITY })
    }

    /// No iteration, but the time for setting up.
    pub fn nothing_yet(&self) -> Outcome {
        let starts = started(self.scene, &self.renderer).into_iter();
        let words = starts.chain(thinned(self.scene, &self.renderer)).chain(gathered(&self.renderer));
        Outcome {
            film: Film::new(&self.scene.camera, self.renderer.settings()),
            seconds: self.setup,
            setup: self.setup,
            waited: 0.0,
            camera_paths: 0,
            light_paths: 0,
            light_vertices: 0,
            beams: 0,
            merges: words.map(|(key, words)| (key.to_owned(), words)).collect(),
            partial: false,
        }
    }

    /// Renders iterations from `index` on into the outcome, one at least and no more than `most`; the clock runs. How many in
    /// one go makes no difference to what comes out.
    pub fn iterations(&mut self, index: u64, most: u64, outcome: &mut Outcome) {
        let count = match self.renderer.gains_from_many() {
            true => ((LONGEST_GO / self.pace) as u64).clamp(1, most.clamp(1, MOST_AT_ONCE)),
            false => 1,
        };
        let start = Instant::now();
        let stats = self.renderer.iterations(index..index + count, &mut outcome.film);
        let seconds = start.elapsed().as_secs_f64();
        self.pace = seconds / count as f64;
        outcome.seconds += seconds;
        if self.asked.0.elapsed() > ASKED_EVERY {
            let now = waited();
            // Threads that are gone take what they waited with them.
            outcome.waited += now.zip(self.asked.1).map_or(0.0, |(now, before)| (now - before).max(0.0));
            self.asked = (Instant::now(), now);
        }
        outcome.camera_paths += stats.camera_paths;
        outcome.light_paths += stats.light_paths;
        outcome.light_vertices += stats.light_vertices;
        outcome.beams += stats.beams;
    }
}

impl Outcome {
    /// What it used up.
    pub fn spent(&self) -> Spent {
        Spent { iterations: self.film.iterations(), seconds: self.seconds, setup: self.setup }
    }

    /// Adds the iterations of `later`, which come after those of this one; `later` is left with none and with no time.
    pub fn append(&mut self, later: &mut Self) {
        self.film.append(&later.film);
        later.film.clear();
        self.seconds += std::mem::take(&mut later.seconds);
        self.waited += std::mem::take(&mut later.waited);
        self.camera_paths += std::mem::take(&mut later.camera_paths);
        self.light_paths += std::mem::take(&mut later.light_paths);
        self.light_vertices += std::mem::take(&mut later.light_vertices);
        self.beams += std::mem::take(&mut later.beams);
    }
}

/// Which lights light subpaths start on, where it was chosen.
fn started(scene: &Scene, renderer: &Renderer) -> Option<(&'static str, String)> {
    let starts = renderer.starts()?;
    let named = scene.notes.light_names.iter().enumerate();
    let shares: Vec<String> = named.map(|(i, name)| format!("{:.3} on {name}", starts.pdf(i))).collect();
    Some(("light_starts", format!("share of the light subpaths: {}", shares.join(", "))))
}

/// What is thinned out in media, if anything is.
fn thinned(scene: &Scene, renderer: &Renderer) -> Vec<(&'static str, String)> {
    let words = |values: &[f32], power: i32| -> Vec<String> {
        let named = scene.notes.medium_names.iter().zip(values).filter(|(_, value)| **value < 1.0);
        named.map(|(name, value)| format!("{:.3} in {name}", value.powi(power))).collect()
    };
    let thinning = renderer.thinning();
    let (shares, continuations) = (words(&thinning.shares, 2), words(&thinning.continuations, 1));
    let mut lines = Vec::new();
    if !shares.is_empty() {
        let line = format!("share of the connections: {}", shares.join(", "));
        lines.push((Technique::Connect.info().key, line));
    }
    if thinning.only_hit {
        lines.push((Technique::Lens.info().key, "not for lights as they are seen directly".to_owned()));
    }
    if !continuations.is_empty() {
        let line = format!("camera subpaths go on with at most {}", continuations.join(", "));
        lines.push(("camera_continuation", line));
    }
    lines
}

/// What is said of a technique's merges where a pilot found them not worth what they cost.
pub const LEFT_OUT: &str = "left out, as it is not worth what it costs here";

/// How the merges that are on gather in the first iteration.
fn gathered(renderer: &Renderer) -> Vec<(&'static str, String)> {
    let settings = renderer.settings();
    let on = MERGES.into_iter().filter(|t| settings.techniques.has(*t));
    on.map(|t| {
        if renderer.left_out().has(t) {
            return (t.info().key, LEFT_OUT.to_owned());
        }
        let now = renderer.gathers().of(t);
        let alpha = settings.merging.of(t).alpha;
        let bound = match renderer.no_room(t) {
            0 => String::new(),
            n => format!(" (of {}: there is no room for more)", now.paths + n),
        };
        (
            t.info().key,
            format!("radius {:.4e} m, alpha {alpha}, {} light paths{bound}", now.radius, now.paths),
        )
    })
    .collect()
}
