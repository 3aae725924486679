//! What a render is asked for.

use super::expression::Expression;
use super::merge::settings::Continuation;
use super::merge::{MERGES, MergeSettings, PathCount, Radius, auto};
use super::technique::{Technique, TechniqueSet};
use super::thinning::Thinning;
use crate::error::{Error, Result};
use crate::medium::Medium;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};

/// How the densities of the techniques become weights [Veach 1997, 9.2].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Heuristic {
    /// Weight proportional to the density.
    Balance,
    /// Weight proportional to the density to this power; 2 is usual.
    Power(f32),
}

/// Which connections between subpaths are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Connections {
    /// In media that scatter light many times a share of them (see [`super::thinning`]).
    #[default]
    Thinned,
    /// All with all.
    All,
}

/// Lights that light subpaths can be shared out among by what they bring; with more it goes by power.
pub const MOST_LIGHTS: usize = 16;

/// Which light a light subpath starts on.
#[derive(Clone, Copy, Debug, PartialEq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightStarts {
    /// In proportion to the lights' powers.
    #[default]
    Power,
    /// By what each light's subpaths bring to the image, as a pilot sees it ([`super::merge::starts`]).
    Pilot,
    /// With these probabilities, a light each.
    #[serde(skip)]
    Each([f32; MOST_LIGHTS]),
}

/// How flights and shadow rays go through media on grids whose extinction is grey (see [`crate::medium::Medium::is_tracked`]); all other
/// media are exact in any case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tracking {
    /// Delta where the techniques are hits and next-event estimation alone, else exact.
    #[default]
    Auto,
    /// By their optical depths, cell by cell.
    Exact,
    /// Flights by delta tracking [Woodcock et al. 1965] and shadow rays by ratio tracking [Novák et al. 2014], with the largest
    /// extinction of each block of the grid. The transmittance of such media is in no density that weights are made of.
    Delta,
}

/// Which images are kept beside the combined one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Layers {
    /// The combined image and its variance only.
    #[default]
    None,
    /// Weighted and unweighted contribution and mean weight of each technique family.
    Families,
    /// Families, and weighted and unweighted contribution of each (s, t) up to `pyramid` segments.
    All,
}

impl Layers {
    /// As users write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Families => "families",
            Self::All => "all",
        }
    }
}

/// Resolved settings of a render. Everything that decides the pixels beside the scene is here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Which techniques are asked for.
    pub techniques: TechniqueSet,
    /// Those of them that are off, as they were found not to be worth what they cost; default none, which leaves it to the pilot where
    /// their radii and counts are open.
    pub left_out: TechniqueSet,
    /// How they are weighted; default balance.
    pub heuristic: Heuristic,
    /// Which connections are made; default thinned out in media that scatter light many times.
    pub connections: Connections,
    /// Which lights light subpaths start on; default by power.
    pub light_starts: LightStarts,
    /// How media on grids are gone through; default auto.
    pub tracking: Tracking,
    /// How merges are made.
    pub merging: MergeSettings,
    /// Shortest path that counts, in segments; default 1 (light that is seen directly).
    pub min_length: u32,
    /// Longest path that counts, in segments; default 64.
    pub max_length: u32,
    /// Which paths count; default all.
    pub paths: Expression,
    /// Names the run: runs with different seeds share no random numbers; default 0.
    pub seed: u64,
    /// Which images are kept; default none but the combined one.
    pub layers: Layers,
    /// With [`Layers::All`]: (s, t) layers for paths of up to so many segments; default 6.
    pub pyramid: u32,
}

/// The longest path that can be asked for.
pub const MAX_LENGTH: u32 = 1000;

impl Settings {
    /// The defaults with a set of techniques.
    pub fn new(techniques: TechniqueSet) -> Self {
        Self {
            techniques,
            left_out: TechniqueSet::default(),
            heuristic: Heuristic::Balance,
            connections: Connections::default(),
            light_starts: LightStarts::default(),
            tracking: Tracking::default(),
            merging: MergeSettings::default(),
            min_length: 1,
            max_length: 64,
            paths: Expression::ALL,
            seed: 0,
            layers: Layers::None,
            pyramid: 6,
        }
    }

    /// # Errors
    /// Lengths or an exponent that make no sense.
    pub fn validate(&self) -> Result<()> {
        if self.max_length == 0 || self.max_length > MAX_LENGTH {
            return Err(Error::usage(format!(
                "the maximum path length is {}: it must lie between 1 and {MAX_LENGTH} segments",
                self.max_length
            )));
        }
        if self.min_length == 0 || self.min_length > self.max_length {
            return Err(Error::usage(format!(
                "the minimum path length is {}: it must lie between 1 and the maximum, {}",
                self.min_length, self.max_length
            )));
        }
        if let Heuristic::Power(beta) = self.heuristic
            && !(beta.is_finite() && beta > 0.0 && beta <= 8.0)
        {
            return Err(Error::usage(format!(
                "the power heuristic's exponent is {beta}: it must be positive and at most 8"
            )));
        }
        self.check_tracking()?;
        self.merging.validate(self.techniques)
    }

    /// # Errors
    /// Delta tracking with techniques that it cannot have.
    pub fn check_tracking(&self) -> Result<()> {
        let forbidding = self.techniques.without(TechniqueSet::tracked());
        if self.tracking == Tracking::Delta && !forbidding.is_empty() {
            let names: Vec<&str> = forbidding.iter().map(|t| t.info().key).collect();
            return Err(Error::usage(format!(
                "tracking by `delta` is for hit and nee alone: {} must know the density of a flight from its far end",
                names.join(", ")
            )));
        }
        Ok(())
    }

    /// Whether media are tracked, where they can be: what `auto` comes to.
    pub fn tracks(&self) -> bool {
        match self.tracking {
            Tracking::Auto => self.techniques.without(TechniqueSet::tracked()).is_empty(),
            Tracking::Exact => false,
            Tracking::Delta => true,
        }
    }

    /// [`Self::with_tracking`], and exact where there is nothing to track: all is the same then.
    pub fn with_tracking_in(self, scene: &Scene) -> Self {
        let tracks = self.tracks() && scene.media.iter().any(Medium::is_tracked);
        Self { tracking: if tracks { Tracking::Delta } else { Tracking::Exact }, ..self }
    }

    /// These settings with the choice of `auto` made, by all techniques that were asked for.
    pub fn with_tracking(self) -> Self {
        Self { tracking: if self.tracks() { Tracking::Delta } else { Tracking::Exact }, ..self }
    }

    /// # Errors
    /// A set that can make no path in this scene: merges in media alone, where no medium scatters.
    pub fn check_scene(&self, scene: &Scene) -> Result<()> {
        let medium_only = self.techniques.iter().all(|t| MERGES.contains(&t) && t != Technique::Surface);
        if medium_only && !scene.traits.scattering {
            return Err(Error::usage(format!(
                "nothing scatters in the media of this scene: {} can make no path in it",
                self.techniques
            )));
        }
        Ok(())
    }

    /// The techniques that are on.
    pub fn active(&self) -> TechniqueSet {
        self.techniques.without(self.left_out)
    }

    /// These settings with all that is chosen from the scene as a number, where it was left open: a render with them is the same, without
    /// a pilot.
    pub fn pinned(&self, scene: &Scene) -> Self {
        let mut pinned = self.with_tracking_in(scene);
        let chosen = auto::resolve(scene, self);
        for (i, technique) in MERGES.into_iter().enumerate().filter(|(_, t)| self.techniques.has(*t)) {
            let now = chosen.gathers.of(technique);
            pinned.merging.of[i].radius = Radius::Absolute(now.radius);
            pinned.merging.of[i].paths = PathCount::Absolute(now.paths);
        }
        pinned.left_out = chosen.left_out;
        if Thinning::is_open(scene, self) {
            let each = |medium: usize| chosen.thinning.continuation(medium as u32);
            pinned.merging.camera_continuation = Continuation::Each(std::array::from_fn(each));
        }
        if Thinning::is_direct_open(self) {
            pinned.merging.direct = Some(chosen.thinning.direct());
        }
        if let Some(starts) = &chosen.starts {
            let each = |light: usize| if light < starts.len() { starts.pdf(light) } else { 0.0 };
            pinned.light_starts = LightStarts::Each(std::array::from_fn(each));
        }
        // The counts keep to them.
        (pinned.merging.most_photons, pinned.merging.most_beams) = (None, None);
        pinned
    }

    /// Techniques that are on and have nothing to do in this scene: merges in media, where no medium scatters.
    pub fn idle(&self, scene: &Scene) -> Vec<Technique> {
        let in_media = |t: &Technique| MERGES.contains(t) && *t != Technique::Surface;
        self.techniques.iter().filter(|t| !scene.traits.scattering && in_media(t)).collect()
    }

    /// Whether light subpaths are walked at all.
    pub fn needs_light_paths(&self) -> bool {
        self.needs_partners() || self.techniques.merges()
    }

    /// Whether light subpaths are walked that are connected: as many as the frame has pixels.
    pub fn needs_partners(&self) -> bool {
        self.techniques.has(Technique::Lens) || self.techniques.has(Technique::Connect)
    }

    /// Whether camera subpaths are walked at all.
    pub fn needs_camera_paths(&self) -> bool {
        [Technique::Hit, Technique::NextEvent, Technique::Connect].iter().any(|t| self.techniques.has(*t))
            || self.techniques.merges()
    }
}
