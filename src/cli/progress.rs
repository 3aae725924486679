//! Progress on the standard error: a bar on a terminal, plain lines at intervals elsewhere.

use crate::film::{Film, Image, ImageKind};
use crate::render::tev::Tev;
use crate::render::{Budget, Observer};
use crate::stage;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// How long something may take before anybody is told what it is at.
const PATIENCE: Duration = Duration::from_millis(500);

/// Seconds between lines where there is no terminal.
const INTERVAL: Duration = Duration::from_secs(10);

/// Time between looks at the film.
const LOOK: Duration = Duration::from_secs(1);

/// Steps of a bar.
const STEPS: u64 = 1000;

/// Shows how renders go on.
pub struct Progress {
    terminal: bool,
    bar: Option<ProgressBar>,
    what: String,
    budget: Budget,
    iterations: u64,
    seconds: f64,
    last_line: Instant,
    /// When the film was last looked at.
    looked: Instant,
    /// The standard error of a pixel, as a share of the mean.
    noise: Option<f64>,
    tev: Option<Tev>,
    /// What is done beside the renders.
    steps: Option<Steps>,
}

/// Something of so many steps.
struct Steps {
    what: String,
    count: u64,
    /// What they are, such as `renders`.
    name: String,
    start: Instant,
}

impl Steps {
    fn state(&self, done: u64) -> String {
        let seconds = self.start.elapsed().as_secs_f64();
        let left = if done > 0 { seconds * (self.count - done) as f64 / done as f64 } else { 0.0 };
        format!("{done} of {} {}, {}, {} left", self.count, self.name, clock(seconds), clock(left))
    }
}

impl Progress {
    /// On the standard error.
    pub fn new() -> Self {
        Self {
            terminal: std::io::stderr().is_terminal(),
            bar: None,
            what: String::new(),
            budget: Budget::Spp(1),
            iterations: 0,
            seconds: 0.0,
            last_line: Instant::now(),
            looked: Instant::now(),
            noise: None,
            tev: None,
            steps: None,
        }
    }

    /// Streams what is rendered to the viewer tev at this address too.
    pub fn with_tev(mut self, address: Option<&str>) -> Self {
        self.tev = address.map(Tev::new);
        self
    }

    /// A bar where there is a terminal, or a line.
    fn show(&mut self, what: &str, amount: &str) {
        if self.terminal {
            let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{prefix} {bar:24} {percent:>3}%  {msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.set_prefix(what.to_owned());
            self.bar = Some(bar);
        } else {
            eprintln!("{what}: {amount}");
            self.last_line = Instant::now();
        }
    }

    fn state(&self) -> String {
        let share = self.budget.share(self.iterations, self.seconds);
        let samples = match self.budget {
            Budget::Spp(spp) => format!("{} of {spp} spp", self.iterations),
            Budget::Seconds(_) | Budget::RelMse { .. } => format!("{} spp", self.iterations),
        };
        let left = if share > 0.0 { self.seconds * (1.0 - share) / share } else { 0.0 };
        let rate = self.iterations as f64 / self.seconds;
        let rate = if rate.is_finite() { format!(", {rate:.3} /s") } else { String::new() };
        let noise = self.noise.map_or(String::new(), |noise| format!(", noise {:.2}%", 100.0 * noise));
        format!("{samples}, {}{rate}{noise}, {} left", clock(self.seconds), clock(left))
    }
}

impl Default for Progress {
    fn default() -> Self {
        Self::new()
    }
}

/// Does `work`, a preparation, and shows what it is at if it takes long (see [`crate::stage`]).
pub fn while_loading<T>(work: impl FnOnce() -> T) -> T {
    let (done, waiting) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || show_stages(&waiting));
        // Goes out of scope when the work is done, or has panicked: then the other thread ends.
        let _done = done;
        work()
    })
}

/// Until the other end hangs up.
fn show_stages(waiting: &Receiver<()>) {
    let start = Instant::now();
    let bar = std::io::stderr().is_terminal().then(|| {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        let style = ProgressStyle::with_template("{spinner} {msg}");
        bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()))
    });
    let mut shown = String::new();
    while waiting.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
        let stage = stage::current();
        match &bar {
            Some(bar) => {
                bar.set_message(format!("{stage}, {}", clock(start.elapsed().as_secs_f64())));
                bar.tick();
            }
            None if stage != shown => eprintln!("{stage}"),
            None => {}
        }
        shown = stage;
    }
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
}

impl Observer for Progress {
    fn begin(&mut self, what: &str, budget: Budget) {
        (self.what, self.budget) = (what.to_owned(), budget);
        (self.iterations, self.seconds, self.noise) = (0, 0.0, None);
        self.show(what, &budget.to_string());
    }

    fn advance(&mut self, iterations: u64, seconds: f64) {
        (self.iterations, self.seconds) = (iterations, seconds);
        match &self.bar {
            Some(bar) => {
                bar.set_position((self.budget.share(iterations, seconds) * STEPS as f64) as u64);
                bar.set_message(self.state());
            }
            None if self.last_line.elapsed() >= INTERVAL => {
                eprintln!("{}: {}", self.what, self.state());
                self.last_line = Instant::now();
            }
            None => {}
        }
    }

    fn look(&mut self, film: &dyn Fn() -> Film) {
        let wanted = self.tev.is_some() || self.terminal || self.last_line.elapsed() + LOOK >= INTERVAL;
        if !wanted || self.looked.elapsed() < LOOK {
            return;
        }
        let film = film();
        self.noise = noise(&film);
        if let Some(tev) = &self.tev {
            tev.show(&self.what, shown(&film));
        }
        self.looked = Instant::now();
    }

    fn last(&mut self, film: &dyn Fn() -> Film) {
        if let Some(tev) = &self.tev {
            tev.finish(&self.what, shown(&film()));
        }
    }

    fn end(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        eprintln!("{}: {} spp in {}", self.what, self.iterations, clock(self.seconds));
    }

    fn begin_steps(&mut self, what: &str, count: u64, steps: &str) {
        self.show(what, &format!("{count} {steps}"));
        let (what, name) = (what.to_owned(), steps.to_owned());
        self.steps = Some(Steps { what, count: count.max(1), name, start: Instant::now() });
    }

    fn step(&mut self, done: u64) {
        let Some(steps) = &self.steps else { return };
        let done = done.min(steps.count);
        match &self.bar {
            Some(bar) => {
                bar.set_position(done * STEPS / steps.count);
                bar.set_message(steps.state(done));
            }
            None if self.last_line.elapsed() >= INTERVAL => {
                eprintln!("{}: {}", steps.what, steps.state(done));
                self.last_line = Instant::now();
            }
            None => {}
        }
    }

    fn end_steps(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        if let Some(steps) = self.steps.take() {
            eprintln!("{}: done in {}", steps.what, clock(steps.start.elapsed().as_secs_f64()));
        }
    }

    fn note(&mut self, line: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| eprintln!("{line}")),
            None => eprintln!("{line}"),
        }
    }
}

/// The standard error of a pixel, root mean square, as a share of the mean of the image.
fn noise(film: &Film) -> Option<f64> {
    let mean = |image: &Image| image.mean().iter().sum::<f64>() / 3.0;
    let noise = mean(&film.variance()).sqrt() / mean(&film.image());
    (film.iterations() > 1 && noise.is_finite()).then_some(noise)
}

/// The image, and what each technique adds to it.
fn shown(film: &Film) -> Vec<(String, Image)> {
    let weighted = film.layers_where(|kind| matches!(kind, ImageKind::Family { weighted: true, .. }));
    let layers = weighted.into_iter().map(|(kind, image)| (kind.name(), image));
    std::iter::once((String::new(), film.image())).chain(layers).collect()
}

/// `0.42 s`, `12.3 s`, `3 min 20 s`, `2 h 05 min`.
pub fn clock(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match seconds {
        s if s < 9.995 => format!("{s:.2} s"),
        s if s < 59.95 => format!("{s:.1} s"),
        s if s < 3599.5 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_readable() {
        for (seconds, text) in [
            (0.0, "0.00 s"),
            (9.994, "9.99 s"),
            (12.34, "12.3 s"),
            (59.96, "1 min 00 s"),
            (200.0, "3 min 20 s"),
            (7500.0, "2 h 05 min"),
        ] {
            assert_eq!(clock(seconds), text);
        }
    }

    #[test]
    fn steps_are_counted() {
        let steps = |done| {
            let start = Instant::now() - Duration::from_secs(30);
            Steps { what: "costs".into(), count: 40, name: "renders".into(), start }.state(done)
        };
        assert_eq!(steps(10), "10 of 40 renders, 30.0 s, 1 min 30 s left");
        assert_eq!(steps(0), "0 of 40 renders, 30.0 s, 0.00 s left");
    }

    #[test]
    fn the_rest_is_extrapolated() {
        let mut progress = Progress::new();
        progress.budget = Budget::Spp(40);
        (progress.iterations, progress.seconds) = (10, 5.0);
        assert_eq!(progress.state(), "10 of 40 spp, 5.00 s, 2.000 /s, 15.0 s left");
        progress.noise = Some(0.0123);
        assert!(progress.state().contains("noise 1.23%"));
    }
}
