//! An iteration's constants: what walks and merges share, and weights and estimators both read.

use super::merge::settings::has_camera_beam;
use super::merge::{Beams, Gathers, MERGES, place_of};
use super::mis::{Merges, Pending};
use super::settings::Settings;
use super::technique::Technique;
use super::thinning::Thinning;
use super::walk::Place;
use crate::bsdf::Mode;
use crate::math::{Discrete, Rgb, StreamKind, Streams};
use crate::medium::{Coefficients, Medium, Passage};
use std::sync::Arc;

/// The constants of an iteration.
#[derive(Clone, Debug)]
pub struct Pass {
    /// What was asked for.
    pub settings: Settings,
    /// Number of the iteration.
    pub iteration: u64,
    /// Random numbers of its light subpaths.
    pub light_streams: Streams,
    /// Random numbers of its camera subpaths.
    pub camera_streams: Streams,
    /// Radii and counts of this iteration.
    pub gathers: Gathers,
    /// M_i,v without what depends on the vertex, raised.
    pub merges: Merges,
    /// Light subpaths of an iteration that are connected to the lens or to a partner: as many as pixels.
    pub partners: u64,
    /// What is thinned out in each medium.
    pub thinning: Thinning,
    /// Which light a light subpath starts on.
    pub starts: Arc<Discrete>,
    /// Whether media are tracked, see [`Settings::tracks`].
    pub tracks: bool,
    /// Whether some technique that is on has a beam.
    pub beams: bool,
    /// Whether some technique that is on has a camera beam.
    pub camera_beams: bool,
}

impl Pass {
    /// Of iteration `iteration`, in which each technique gathers as `gathers` says, media are thinned out as `thinning`
    /// says, and light subpaths start on lights that are drawn from `starts`.
    pub fn new(
        settings: Settings,
        iteration: u64,
        gathers: Gathers,
        partners: u64,
        thinning: Thinning,
        starts: Arc<Discrete>,
    ) -> Self {
        let on = |t| settings.techniques.has(t);
        let raise = |t: Technique| {
            let place = place_of(t).expect("a merge");
            if on(t) { settings.heuristic.raise(gathers.of[place].density(t)) } else { 0.0 }
        };
        let [surface, point_point, point_beam, beam_point, beam_beam] = MERGES.map(raise);
        let merges = Merges { surface, point_point, point_beam, beam_point, beam_beam };
        let beams = [Technique::PointBeam, Technique::BeamPoint, Technique::BeamBeam].into_iter().any(on);
        let camera_beams = MERGES.into_iter().any(|t| has_camera_beam(t) && on(t));
        let streams = |kind| Streams::new(settings.seed, iteration, kind);
        Self {
            settings,
            iteration,
            light_streams: streams(StreamKind::Light),
            camera_streams: streams(StreamKind::Camera),
            gathers,
            merges,
            partners,
            thinning,
            starts,
            tracks: settings.tracks(),
            beams,
            camera_beams,
        }
    }

    /// A density or count as it enters a weight.
    #[inline(always)]
    pub fn raise(&self, x: f32) -> f32 {
        self.settings.heuristic.raise(x)
    }

    /// Whether a technique is on.
    #[inline]
    pub fn on(&self, technique: Technique) -> bool {
        self.settings.techniques.has(technique)
    }

    /// Whether a medium is tracked: flights and shadow rays have it as clear in their densities.
    pub fn is_tracked(&self, medium: &Medium) -> bool {
        self.tracks && medium.is_tracked()
    }

    /// g of a place: the share with which it is connected.
    #[inline(always)]
    pub fn share(&self, place: &Place) -> f32 {
        match place {
            Place::Surface(_) => 1.0,
            Place::Medium(collision) => self.thinning.share(collision.medium),
        }
    }

    /// The probability with which a walk in `mode` goes on from a collision in a medium with this index.
    #[inline(always)]
    pub fn continuation(&self, mode: Mode, (index, medium): (u32, &Medium), at: &Coefficients) -> f32 {
        let most = match mode {
            Mode::Importance => 1.0,
            Mode::Radiance => self.thinning.continuation(index),
        };
        medium.continuation(at).min(most)
    }

    /// How long the beams of a walk in `mode` are.
    #[inline]
    pub fn beams_of(&self, mode: Mode) -> Beams {
        match mode {
            Mode::Importance => self.settings.merging.photon_beams,
            Mode::Radiance => self.settings.merging.camera_beams,
        }
    }

    /// Light subpaths that merges use.
    pub fn merged_paths(&self) -> u64 {
        MERGES.into_iter().filter(|t| self.on(*t)).map(|t| self.gathers.of(t).paths).max().unwrap_or(0)
    }

    /// b(T) of an edge that a walk in `mode` samples, raised: 1/T of long beams, P/T of short ones, where `density` is
    /// T, the free-flight density at the collision that the edge ends in.
    #[inline(always)]
    pub fn beam(&self, mode: Mode, passage: &Passage, density: f32) -> f32 {
        if !self.beams || density <= 0.0 {
            return 0.0;
        }
        match self.beams_of(mode) {
            Beams::Long => self.raise(1.0 / density),
            Beams::Short => self.raise(passage.density(Rgb::ONE) / density),
        }
    }

    /// M_i at a collision as a walk in `mode` knows it: `own` is b of the edge that it came by, raised, and `sine` that
    /// of the angle between both edges.
    #[inline(always)]
    pub fn merges_at_collision(&self, mode: Mode, own: f32, sine: f32) -> Pending {
        let sine = if self.merges.beam_beam > 0.0 { self.raise(sine) } else { 0.0 };
        match mode {
            Mode::Importance => self.merges.from_light(own, sine),
            Mode::Radiance => self.merges.from_camera(own, sine),
        }
    }
}

/// The mode of the other subpath.
#[inline]
pub fn other(mode: Mode) -> Mode {
    match mode {
        Mode::Importance => Mode::Radiance,
        Mode::Radiance => Mode::Importance,
    }
}
