//! What a user can say about merges, and what that comes to in a scene.

use super::kernel::Kernel;
use crate::error::{Error, Result};
use crate::transport::technique::{Technique, TechniqueSet};
use serde::{Deserialize, Serialize};

/// Techniques that merge, in the order in which [`MergeSettings::of`] has them.
pub const MERGES: [Technique; 5] = [
    Technique::Surface,
    Technique::PointPoint,
    Technique::PointBeam,
    Technique::BeamPoint,
    Technique::BeamBeam,
];

/// A kernel's radius in the first iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Radius {
    /// Chosen from the scene.
    #[default]
    Auto,
    /// In metres.
    Absolute(f32),
    /// In radii of the sphere about the scene.
    Scene(f32),
    /// In median footprints of a pixel at what it sees first.
    Footprint(f32),
    /// Such that so many photons are within it on average, about the vertices of camera subpaths; see [`super::auto`].
    Nearest(f32),
}

/// How many light subpaths of an iteration a technique uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PathCount {
    /// Chosen from the scene.
    #[default]
    Auto,
    /// So many.
    Absolute(u64),
    /// So many a pixel of the full frame.
    PerPixel(f32),
}

/// How long beams are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Beams {
    /// Up to the sampled collision.
    Short,
    /// The whole ray up to the first surface, weighted by transmittance.
    Long,
}

/// Media that have a continuation of their own; all others have that of the last of these.
pub const EACH: usize = 16;

/// The probability with which camera subpaths go on from a collision at most.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Continuation {
    /// Chosen for each medium, see [`super::auto`].
    #[default]
    Auto,
    /// The same in all media.
    All(f32),
    /// By medium.
    Each([f32; EACH]),
}

impl Continuation {
    /// Of each medium; `None` where it is to be chosen.
    pub fn of(&self, media: usize) -> Option<Vec<f32>> {
        match self {
            Self::Auto => None,
            Self::All(q) => Some(vec![*q; media]),
            Self::Each(each) => Some((0..media).map(|m| each[m.min(EACH - 1)]).collect()),
        }
    }
}

/// What a user says about one technique.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gather {
    /// In the first iteration.
    pub radius: Radius,
    /// The radius shrinks from iteration to iteration so that the kernel's measure falls as i^(α − 1); 1 keeps it.
    pub alpha: f32,
    /// Light subpaths that are merged with, the first of an iteration.
    pub paths: PathCount,
}

impl Default for Gather {
    fn default() -> Self {
        Self { radius: Radius::Auto, alpha: 0.75, paths: PathCount::Auto }
    }
}

/// What a user says about merges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MergeSettings {
    /// By technique, in the order of [`MERGES`].
    pub of: [Gather; 5],
    /// Of all techniques.
    pub kernel: Kernel,
    /// Of light subpaths.
    pub photon_beams: Beams,
    /// Of camera subpaths.
    pub camera_beams: Beams,
    /// Whether camera subpaths end at their first vertex that is not specular, as in earlier work, and each path has
    /// a single place to be merged at.
    pub first: bool,
    /// About as many photons are stored for merges at most: fewer light subpaths are merged with where there would be
    /// more. `None` for no bound.
    pub most_photons: Option<u64>,
    /// The same of beams.
    pub most_beams: Option<u64>,
    /// Where something merges in media, and camera subpaths do not end at their first vertex anyway, how often they go on from
    /// a collision.
    pub camera_continuation: Continuation,
    /// Whether lights as they are seen directly are connected with the lens, beside being hit. `None` leaves it to be chosen where something
    /// merges; else they are.
    pub direct: Option<bool>,
    /// Whether what is open is chosen for the least error in a given time; else each technique has as many merges.
    pub efficient: bool,
}

impl Default for MergeSettings {
    fn default() -> Self {
        Self {
            of: [Gather::default(); 5],
            kernel: Kernel::Constant,
            photon_beams: Beams::Short,
            camera_beams: Beams::Short,
            first: false,
            most_photons: None,
            most_beams: None,
            camera_continuation: Continuation::Auto,
            direct: None,
            efficient: true,
        }
    }
}

/// The position of a technique in [`MERGES`].
pub fn place_of(technique: Technique) -> Option<usize> {
    MERGES.iter().position(|t| *t == technique)
}

/// Whether a technique merges along camera beams.
#[inline]
pub fn has_camera_beam(technique: Technique) -> bool {
    matches!(technique, Technique::PointBeam | Technique::BeamBeam)
}

impl MergeSettings {
    /// What is said of a technique.
    ///
    /// # Panics
    /// For a technique that does not merge.
    pub fn of(&self, technique: Technique) -> &Gather {
        &self.of[place_of(technique).expect("a merge")]
    }

    /// # Errors
    /// Numbers that make no sense, or a set that cannot do what is asked.
    pub fn validate(&self, techniques: TechniqueSet) -> Result<()> {
        for technique in MERGES {
            let Gather { radius, alpha, paths } = *self.of(technique);
            let key = technique.info().key;
            if let Radius::Absolute(r) | Radius::Scene(r) | Radius::Footprint(r) | Radius::Nearest(r) = radius
                && !(r.is_finite() && r > 0.0)
            {
                return Err(Error::usage(format!("the radius of {key} is {r}: it must be above 0")));
            }
            if !(alpha > 0.0 && alpha <= 1.0) {
                return Err(Error::usage(format!(
                    "alpha of {key} is {alpha}: it must be above 0 and at most 1"
                )));
            }
            let none = match paths {
                PathCount::Auto => false,
                PathCount::Absolute(n) => n == 0,
                PathCount::PerPixel(n) => !(n.is_finite() && n > 0.0),
            };
            if none {
                return Err(Error::usage(format!("the number of light paths of {key} must be above 0")));
            }
        }
        let continuations = self.camera_continuation.of(EACH).unwrap_or_default();
        if let Some(q) = continuations.iter().find(|q| !(**q > 0.0 && **q <= 1.0)) {
            return Err(Error::usage(format!(
                "camera_continuation is {q}: it must be above 0 and at most 1"
            )));
        }
        for (what, most) in [("photons", self.most_photons), ("beams", self.most_beams)] {
            if most == Some(0) {
                return Err(Error::usage(format!("most_{what} is 0: with no {what} nothing merges")));
            }
        }
        let connects = [Technique::NextEvent, Technique::Connect, Technique::Lens]
            .into_iter()
            .find(|t| techniques.has(*t));
        if self.first
            && let Some(technique) = connects
        {
            return Err(Error::usage(format!(
                "camera subpaths shall end at their first vertex that is not specular: {} cannot be weighted then",
                technique.info().key
            )));
        }
        Ok(())
    }
}
