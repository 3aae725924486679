//! When a render ends.

use serde::{Deserialize, Serialize};
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

impl Budget {
    /// Whether another iteration fits in, after `iterations` that took `seconds` in all. Of a relMSE to be reached only the
    /// bounds are looked at.
    pub fn goes_on(self, iterations: u64, seconds: f64) -> bool {
        match self {
            Self::Spp(spp) => iterations < spp,
            Self::RelMse { spp, seconds: limit, .. } => {
                spp.is_none_or(|spp| Self::Spp(spp).goes_on(iterations, seconds))
                    && limit.is_none_or(|limit| Self::Seconds(limit).goes_on(iterations, seconds))
            }
            // Half an iteration beyond the end is as near to it as half an iteration before.
            Self::Seconds(limit) => iterations == 0 || seconds + 0.5 * seconds / iterations as f64 <= limit,
        }
    }

    /// How many iterations surely fit in, where [`Self::goes_on`] says that one does; at least one.
    pub fn room(self, iterations: u64, seconds: f64) -> u64 {
        match self {
            Self::Spp(spp) => spp.saturating_sub(iterations).max(1),
            Self::Seconds(limit) => ((limit - seconds) / seconds * iterations as f64).max(1.0) as u64,
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
        assert!(Budget::Spp(3).goes_on(2, 1e9));
        assert!(!Budget::Spp(3).goes_on(3, 0.0));
        assert_eq!(Budget::Spp(4).share(1, 0.0), 0.25);
    }

    #[test]
    fn what_has_room_ends_in_time() {
        assert_eq!(Budget::Spp(7).room(3, 1e9), 4);
        for (iterations, seconds, room) in [(0, 0.0, 1), (0, 0.3, 1), (4, 2.0, 6), (10, 4.9, 1), (10, 5.1, 1)]
        {
            assert_eq!(Budget::Seconds(5.0).room(iterations, seconds), room, "{iterations} in {seconds} s");
        }
        assert_eq!(Budget::RelMse { target: 0.1, spp: Some(10), seconds: None }.room(1, 1.0), 1);
    }

    #[test]
    fn a_relmse_is_bounded_by_what_comes_first() {
        let budget = Budget::RelMse { target: 0.1, spp: Some(10), seconds: Some(2.0) };
        assert!(budget.goes_on(9, 0.1) && !budget.goes_on(10, 0.1) && !budget.goes_on(5, 2.0));
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
            while Budget::Seconds(limit).goes_on(n, n as f64 * each) {
                n += 1;
            }
            n
        };
        assert_eq!(run(0.3, 1.0), 3, "0.9 is nearer than 1.2");
        assert_eq!(run(0.35, 1.0), 3, "1.05 is nearer than 0.7");
        assert_eq!(run(5.0, 1.0), 1, "at least one");
    }
}
