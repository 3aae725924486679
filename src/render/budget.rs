//! When a render ends.

use serde::{Deserialize, Serialize};
use std::ops::Add;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What a render may use up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Budget {
    /// So many samples per pixel, which is as many iterations.
    Spp(u64),
    /// So many seconds of rendering, to the nearest whole iteration; at least one.
    Seconds(f64),
    /// Until the relMSE against a reference, less the reference's own noise, is no more than `target`; but no further than
    /// the bounds, of which there is at least one. Only who measures can tell when that is: see [`Self::goes_on`].
    RelMse {
        /// The relMSE to be reached.
        target: f64,
        /// Samples per pixel at most.
        spp: Option<u64>,
        /// Seconds of rendering at most.
        seconds: Option<f64>,
    },
}

/// What a render has used up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    /// Iterations.
    pub iterations: u64,
    /// Seconds in all.
    pub seconds: f64,
    /// Of these, what it took to set up: no measure of what an iteration takes.
    pub setup: f64,
}

impl Spent {
    /// So many iterations in so many seconds, without a set-up that is known of.
    pub fn new(iterations: u64, seconds: f64) -> Self {
        Self { iterations, seconds, setup: 0.0 }
    }

    /// Seconds an iteration; not a number before the first.
    fn pace(self) -> f64 {
        (self.seconds - self.setup).max(0.0) / self.iterations as f64
    }
}

impl Add for Spent {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            iterations: self.iterations + other.iterations,
            seconds: self.seconds + other.seconds,
            setup: self.setup + other.setup,
        }
    }
}

impl Budget {
    /// Whether another iteration fits in after what is spent. Of a relMSE to be reached only the bounds are looked at.
    pub fn goes_on(self, spent: Spent) -> bool {
        match self {
            Self::Spp(spp) => spent.iterations < spp,
            Self::RelMse { spp, seconds: limit, .. } => {
                spp.is_none_or(|spp| Self::Spp(spp).goes_on(spent))
                    && limit.is_none_or(|limit| Self::Seconds(limit).goes_on(spent))
            }
            // Half an iteration beyond the end is as near to it as half an iteration before.
            Self::Seconds(limit) => spent.iterations == 0 || spent.seconds + 0.5 * spent.pace() <= limit,
        }
    }

    /// How many iterations surely fit in, where [`Self::goes_on`] says that one does; at least one.
    pub fn room(self, spent: Spent) -> u64 {
        match self {
            Self::Spp(spp) => spp.saturating_sub(spent.iterations).max(1),
            Self::Seconds(limit) => ((limit - spent.seconds) / spent.pace()).max(1.0) as u64,
            // May be reached after any.
            Self::RelMse { .. } => 1,
        }
    }

    /// Whether the clock has a say in where it ends.
    pub fn is_timed(self) -> bool {
        matches!(self, Self::Seconds(_) | Self::RelMse { seconds: Some(_), .. })
    }

    /// The share that is done, in [0, 1]; of a relMSE to be reached, the share of the bounds.
    pub fn share(self, iterations: u64, seconds: f64) -> f64 {
        match self {
            Self::Spp(spp) => iterations as f64 / spp.max(1) as f64,
            Self::Seconds(limit) => seconds / limit,
            Self::RelMse { spp, seconds: limit, .. } => {
                let samples = spp.map_or(0.0, |spp| Self::Spp(spp).share(iterations, seconds));
                samples.max(limit.map_or(0.0, |limit| seconds / limit))
            }
        }
        .clamp(0.0, 1.0)
    }
}

impl std::fmt::Display for Budget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Spp(spp) => write!(f, "{spp} spp"),
            Self::Seconds(seconds) => write!(f, "{seconds} s"),
            Self::RelMse { target, spp, seconds } => {
                write!(f, "relMSE {target}, at most")?;
                spp.map_or(Ok(()), |spp| write!(f, " {spp} spp"))?;
                seconds.map_or(Ok(()), |seconds| write!(f, " {seconds} s"))
            }
        }
    }
}

/// A wish to stop, from Ctrl-C: the iteration under way is completed, what is there is kept.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Asks for the stop.
    pub fn request(&self) {
        self.0.store(true, Ordering::SeqCst);
    }

    /// Whether it was asked for.
    pub fn requested(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_counted_exactly() {
        assert!(Budget::Spp(3).goes_on(Spent::new(2, 1e9)));
        assert!(!Budget::Spp(3).goes_on(Spent::new(3, 0.0)));
        assert_eq!(Budget::Spp(4).share(1, 0.0), 0.25);
    }

    #[test]
    fn what_has_room_ends_in_time() {
        assert_eq!(Budget::Spp(7).room(Spent::new(3, 1e9)), 4);
        for (iterations, seconds, room) in [(0, 0.0, 1), (0, 0.3, 1), (4, 2.0, 6), (10, 4.9, 1), (10, 5.1, 1)]
        {
            assert_eq!(
                Budget::Seconds(5.0).room(Spent::new(iterations, seconds)),
                room,
                "{iterations} in {seconds} s"
            );
        }
        assert_eq!(Budget::RelMse { target: 0.1, spp: Some(10), seconds: None }.room(Spent::new(1, 1.0)), 1);
    }

    /// Bug that this keeps out: a set-up of more than half the time was taken for what an iteration takes, and one was all there was.
    #[test]
    fn a_set_up_is_no_measure_of_iterations() {
        let (limit, setup, each) = (3.0, 2.0, 0.1);
        let mut spent = Spent { iterations: 0, seconds: setup, setup };
        while Budget::Seconds(limit).goes_on(spent) {
            let room = Budget::Seconds(limit).room(spent);
            assert!(spent.seconds + (room - 1) as f64 * each <= limit + 1e-9, "{room} after {spent:?}");
            spent.iterations += 1;
            spent.seconds += each;
        }
        assert_eq!(spent.iterations, 10, "{spent:?}");
        let at_once = Spent { iterations: 1, seconds: setup + each, setup };
        assert_eq!(Budget::Seconds(limit).room(at_once), 8);
    }

    #[test]
    fn a_relmse_is_bounded_by_what_comes_first() {
        let budget = Budget::RelMse { target: 0.1, spp: Some(10), seconds: Some(2.0) };
        assert!(budget.goes_on(Spent::new(9, 0.1)));
        assert!(!budget.goes_on(Spent::new(10, 0.1)) && !budget.goes_on(Spent::new(5, 2.0)));
        assert_eq!((budget.share(5, 0.2), budget.share(1, 1.5)), (0.5, 0.75));
        assert_eq!(budget.to_string(), "relMSE 0.1, at most 10 spp 2 s");
        let json = serde_json::to_string(&budget).unwrap();
        assert_eq!(json, r#"{"relmse":{"target":0.1,"spp":10,"seconds":2.0}}"#);
        assert_eq!(serde_json::from_str::<Budget>(&json).unwrap(), budget);
    }

    #[test]
    fn time_ends_at_the_nearest_iteration() {
        let run = |each: f64, limit: f64| {
            let mut n = 0;
            while Budget::Seconds(limit).goes_on(Spent::new(n, n as f64 * each)) {
                n += 1;
            }
            n
        };
        assert_eq!(run(0.3, 1.0), 3, "0.9 is nearer than 1.2");
        assert_eq!(run(0.35, 1.0), 3, "1.05 is nearer than 0.7");
        assert_eq!(run(5.0, 1.0), 1, "at least one");
    }
}
