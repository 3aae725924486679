//! A mixture of two phase functions that varies by place: drops where it rains, dust elsewhere.
//!
//! Flakes cannot be a part of it: how much is seen of them, and with it the extinction along a ray, would vary by place with the share.

use super::{Phase, PhaseSample};
use crate::medium::grid::Placed;
use glam::{Vec2, Vec3A};

/// Two phase functions, and by place how often the second is picked.
#[derive(Clone, Debug, PartialEq)]
pub struct ByPlace {
    share: Placed<f32>,
    parts: [Phase; 2],
}

impl ByPlace {
    /// The second phase function has the weight `share`, at most 1 and 0 outside of its grid, and the first the rest.
    ///
    /// # Errors
    /// A share above 1, and a part that varies by place itself, or that has flakes in it.
    pub fn new(share: Placed<f32>, parts: [Phase; 2]) -> Result<Self, String> {
        if let Some(value) = share.lattice().values().find(|v| *v > 1.0) {
            return Err(format!("the weight of a phase function by place must be at most 1, found {value}"));
        }
        if parts.iter().any(|p| matches!(p, Phase::ByPlace(_))) {
            return Err("a phase function that varies by place cannot be a part of another".into());
        }
        if parts.iter().any(Phase::is_directional) {
            return Err("fibres and flakes cannot be a part of what varies by place, as their extinction goes with the \
                        direction: mix them with the other part by one weight (`mixture`), or give each part a solid of \
                        its own"
                .into());
        }
        Ok(Self { share, parts })
    }

    fn share(&self, p: Vec3A) -> f32 {
        self.share.value(p).min(1.0)
    }

    pub(super) fn value(&self, p: Vec3A, wl: Vec3A, wc: Vec3A) -> f32 {
        let share = self.share(p);
        self.parts[0].evaluate(wl, wc) * (1.0 - share) + self.parts[1].evaluate(wl, wc) * share
    }

    pub(super) fn sample(&self, p: Vec3A, from: Vec3A, u: (f32, Vec2)) -> PhaseSample {
        let share = self.share(p);
        // What is left of the uniform picks within the part.
        let (part, rest) = match u.0 < share {
            true => (&self.parts[1], u.0 / share),
            false => (&self.parts[0], (u.0 - share) / (1.0 - share)),
        };
        let to = part.sample_at(p, from, (rest.min(1.0 - f32::EPSILON), u.1)).to;
        PhaseSample::even(to, self.value(p, from, to))
    }

    pub(super) fn mean_cosine(&self) -> f32 {
        let (sum, count) = self.share.lattice().values().fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        let share: f32 = sum / count;
        self.parts[0].mean_cosine() * (1.0 - share) + self.parts[1].mean_cosine() * share
    }

    pub(super) fn describe(&self) -> String {
        format!("by place {} or {}", self.parts[0].describe(), self.parts[1].describe())
    }
}
