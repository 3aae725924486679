//! Radii and counts of an iteration: the one place that estimators and weights read them from.

use super::settings::{MERGES, MergeSettings, place_of};
use crate::transport::technique::Technique;
use std::f32::consts::PI;

/// How a technique gathers in an iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GatherNow {
    /// Radius of the kernel (metres).
    pub radius: f32,
    /// N: the first so many light subpaths are merged with.
    pub paths: u64,
}

impl GatherNow {
    /// N times the measure of the kernel, constant over it: m² on a disc, m³ in a ball, m on a segment.
    #[inline]
    pub fn density(&self, technique: Technique) -> f32 {
        let (n, r) = (self.paths as f32, self.radius);
        match technique {
            Technique::PointPoint => n * (4.0 / 3.0 * PI * r * r * r),
            Technique::BeamBeam => n * (2.0 * r),
            _ => n * (PI * r * r),
        }
    }
}

/// Dimension of a technique's kernel.
pub fn dimension(technique: Technique) -> f64 {
    match technique {
        Technique::PointPoint => 3.0,
        Technique::BeamBeam => 1.0,
        _ => 2.0,
    }
}

/// How each technique gathers, in the order of [`MERGES`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gathers {
    /// By technique.
    pub of: [GatherNow; 5],
}

impl Gathers {
    /// Of one technique.
    ///
    /// # Panics
    /// For a technique that does not merge.
    #[inline]
    pub fn of(&self, technique: Technique) -> &GatherNow {
        &self.of[place_of(technique).expect("a merge")]
    }

    /// These, as they are in iteration `index` (from 0) where they are the radii of the first: the kernel's measure
    /// falls as (i + 1)^(α − 1) [Kaplanyan & Dachsbacher 2013], whatever ran before.
    pub fn at(&self, index: u64, settings: &MergeSettings) -> Self {
        let mut now = *self;
        for (gather, technique) in now.of.iter_mut().zip(MERGES) {
            let alpha = f64::from(settings.of(technique).alpha);
            let shrunk = (index as f64 + 1.0).powf((alpha - 1.0) / dimension(technique));
            gather.radius *= shrunk as f32;
        }
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_shrink_as_alpha_says() {
        let settings = MergeSettings::default();
        let first = Gathers { of: [GatherNow { radius: 0.1, paths: 7 }; 5] };
        assert_eq!(first.at(0, &settings), first);
        for technique in MERGES {
            let ratio = first.at(15, &settings).of(technique).density(technique)
                / first.of(technique).density(technique);
            assert!((ratio - 16f32.powf(-0.25)).abs() < 1e-5, "{technique:?}: {ratio}");
        }
    }
}
