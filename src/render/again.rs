//! Settings had back from the words that a render wrote beside its pixels, so that its samples can be walked again.

use super::files::{Resolved, ResolvedMerging};
use crate::error::{Error, Result};
use crate::transport::expression::Expression;
use crate::transport::merge::settings::{Continuation, EACH};
use crate::transport::merge::{MERGES, MergeSettings, PathCount, Radius};
use crate::transport::settings::{Heuristic, LightStarts, MOST_LIGHTS, Settings, Tracking};
use crate::transport::technique::{Technique, TechniqueSet};

impl Resolved {
    /// The settings of the render. What was chosen from the scene is in them as it was chosen, so that the samples are the same to
    /// the bit, without a pilot.
    ///
    /// # Errors
    /// Words that no render wrote.
    pub fn settings(&self) -> Result<Settings> {
        let wrong = |what: &str| Error::usage(format!("the settings are damaged: {what}"));
        let techniques = TechniqueSet::parse(self.techniques.iter().map(String::as_str))?;
        let mut settings = Settings::new(techniques);
        settings.heuristic = match self.heuristic.strip_prefix("power ") {
            Some(exponent) => Heuristic::Power(exponent.parse().map_err(|_| wrong(&self.heuristic))?),
            None => Heuristic::Balance,
        };
        (settings.min_length, settings.max_length) = (self.min_length, self.max_length);
        settings.paths = Expression::parse(&self.paths)?;
        settings.connections = self.connections.unwrap_or_default();
        if let Some(shares) = &self.light_starts {
            if shares.len() > MOST_LIGHTS {
                return Err(wrong("light_starts"));
            }
            let each = |light: usize| shares.get(light).copied().unwrap_or(0.0);
            settings.light_starts = LightStarts::Each(std::array::from_fn(each));
        }
        settings.tracking = self.tracking.unwrap_or(Tracking::Exact);
        if let Some(merging) = &self.merging {
            settings.merging = merging.settings()?;
            settings.left_out = merging.left_out()?;
        }
        settings.merging.direct = self.direct;
        settings.seed = self.seed.parse().map_err(|_| wrong(&self.seed))?;
        (settings.layers, settings.pyramid) = (self.layers, self.pyramid);
        settings.validate()?;
        Ok(settings)
    }
}

impl ResolvedMerging {
    fn left_out(&self) -> Result<TechniqueSet> {
        match self.left_out.is_empty() {
            true => Ok(TechniqueSet::default()),
            false => TechniqueSet::parse(self.left_out.iter().map(String::as_str)),
        }
    }

    fn settings(&self) -> Result<MergeSettings> {
        let Self { kernel, photon_beams, camera_beams, first, continuations, techniques, .. } = self;
        let (kernel, photon_beams, camera_beams, first) = (*kernel, *photon_beams, *camera_beams, *first);
        let mut merging =
            MergeSettings { kernel, photon_beams, camera_beams, first, ..MergeSettings::default() };
        for (gather, technique) in merging.of.iter_mut().zip(MERGES) {
            // Those that are off have nothing to say.
            let Some(resolved) = techniques.get(Technique::info(technique).key) else { continue };
            gather.radius = Radius::Absolute(resolved.radius);
            gather.alpha = resolved.alpha;
            gather.paths = PathCount::Absolute(resolved.paths);
        }
        merging.camera_continuation = match continuations.last() {
            None => Continuation::All(1.0),
            Some(last) => Continuation::Each(std::array::from_fn(|medium| {
                *continuations.get(medium.min(EACH - 1)).unwrap_or(last)
            })),
        };
        Ok(merging)
    }
}
