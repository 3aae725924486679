//! Progress on the standard error: a bar on a terminal, plain lines at intervals elsewhere.

use crate::render::{Budget, Observer};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Seconds between lines where there is no terminal.
const INTERVAL: Duration = Duration::from_secs(10);

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
        }
    }

    fn state(&self) -> String {
        let share = self.budget.share(self.iterations, self.seconds);
        let samples = match self.budget {
            Budget::Spp(spp) => format!("{} of {spp} spp", self.iterations),
            Budget::Seconds(_) | Budget::RelMse { .. } => format!("{} spp", self.iterations),
        };
        let left = if share > 0.0 { self.seconds * (1.0 - share) / share } else { 0.0 };
        format!("{samples}, {}, {} left", clock(self.seconds), clock(left))
    }
}

impl Default for Progress {
    fn default() -> Self {
        Self::new()
    }
}

impl Observer for Progress {
    fn begin(&mut self, what: &str, budget: Budget) {
        (self.what, self.budget) = (what.to_owned(), budget);
        (self.iterations, self.seconds) = (0, 0.0);
        if self.terminal {
            let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{prefix} {bar:24} {percent:>3}%  {msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.set_prefix(what.to_owned());
            self.bar = Some(bar);
        } else {
            eprintln!("{what}: {budget}");
            self.last_line = Instant::now();
        }
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

    fn end(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        eprintln!("{}: {} spp in {}", self.what, self.iterations, clock(self.seconds));
    }

    fn note(&mut self, line: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| eprintln!("{line}")),
            None => eprintln!("{line}"),
        }
    }
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
    fn the_rest_is_extrapolated() {
        let mut progress = Progress::new();
        progress.budget = Budget::Spp(40);
        (progress.iterations, progress.seconds) = (10, 5.0);
        assert_eq!(progress.state(), "10 of 40 spp, 5.00 s, 15.0 s left");
    }
}
