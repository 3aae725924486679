//! Media of a scene file.

use super::context::Context;
use super::grids;
use super::schema::{MediumDef, Named, PhaseDef, PhaseTableDef};
use super::source::Span;
use crate::error::Result;
use crate::math::Rgb;
use crate::medium::phase::{ByPlace, HenyeyGreenstein, Mixture, Sggx, Tabulated, droplets};
use crate::medium::{Homogeneous, Medium, Phase};
use toml::Spanned;

/// The media of a scene, by index, and which of them were asked for.
#[derive(Debug, Default)]
pub(super) struct Media {
    names: Vec<(String, Span)>,
    used: Vec<bool>,
    /// The media, by index.
    pub all: Vec<Medium>,
}

impl Media {
    /// Builds all media of the file, in its order.
    pub fn load(context: &mut Context, defs: &Named<MediumDef>) -> Result<Self> {
        let mut media = Self::default();
        for (name, def) in &defs.0 {
            let (span, def) = (name.span(), def.get_ref());
            let phase = phase(context, &def.phase)?;
            media.all.push(if grids::varies(def) {
                Medium::Varying(Box::new(grids::build(context, span, def, phase)?))
            } else {
                Medium::Homogeneous(homogeneous(context, span, def, phase)?)
            });
            media.names.push((name.get_ref().clone(), name.span()));
            media.used.push(false);
        }
        Ok(media)
    }

    /// The index of a medium by its name.
    pub fn index(&mut self, context: &Context, name: &Spanned<String>) -> Result<u32> {
        match self.names.iter().position(|(n, _)| n == name.get_ref()) {
            Some(i) => {
                self.used[i] = true;
                Ok(i as u32)
            }
            None => {
                let known = self.names.iter().map(|(n, _)| n.as_str());
                Err(context.source.unknown_name(name.span(), "medium", name.get_ref(), known))
            }
        }
    }

    /// Names of all media, by index.
    pub fn names(&self) -> Vec<String> {
        self.names.iter().map(|(name, _)| name.clone()).collect()
    }

    /// Names and places of the media that nothing asked for.
    pub fn unused(&self) -> Vec<(String, Span)> {
        let unused = self.names.iter().zip(&self.used).filter(|(_, used)| !**used);
        unused.map(|(entry, _)| entry.clone()).collect()
    }
}

fn homogeneous(context: &Context, span: Span, def: &MediumDef, phase: Phase) -> Result<Homogeneous> {
    let scale = def.scale.map_or(1.0, |s| s.get());
    let emission = def.emission.map_or(Rgb::ZERO, |e| e.0);
    let built = match (&def.sigma_a, &def.sigma_s, &def.sigma_t, &def.albedo) {
        (Some(sigma_a), Some(sigma_s), None, None) => {
            Homogeneous::new(sigma_a.get_ref().0 * scale, sigma_s.get_ref().0 * scale, emission, phase)
        }
        (None, None, Some(sigma_t), Some(albedo)) => {
            Homogeneous::with_albedo(sigma_t.get_ref().0 * scale, albedo.get_ref().0, emission, phase)
        }
        _ => return Err(wrong_keys(context, span, def)),
    };
    context.at(span, built)
}

/// What is wrong with a medium that has neither form.
fn wrong_keys(context: &Context, span: Span, def: &MediumDef) -> crate::error::Error {
    let keys = [
        ("sigma_a", def.sigma_a.as_ref().map(Spanned::span)),
        ("sigma_s", def.sigma_s.as_ref().map(Spanned::span)),
        ("sigma_t", def.sigma_t.as_ref().map(Spanned::span)),
        ("albedo", def.albedo.as_ref().map(Spanned::span)),
    ];
    let expected = "`sigma_a` and `sigma_s`, or `sigma_t` and `albedo`";
    let there: Vec<_> = keys.iter().filter_map(|(key, span)| Some((*key, span.clone()?))).collect();
    match &there[..] {
        [] => context.source.error(span, format!("this medium does not say what it is: expected {expected}")),
        [(key, span)] => {
            let message = format!("`{key}` alone does not say what the medium is: expected {expected}");
            context.source.error(span.clone(), message)
        }
        [.., (_, last)] => {
            let named: Vec<String> = there.iter().map(|(key, _)| format!("`{key}`")).collect();
            let message = format!("a medium has either {expected}, found {}", named.join(", "));
            context.source.error(last.clone(), message)
        }
    }
}

fn phase(context: &mut Context, def: &PhaseDef) -> Result<Phase> {
    match def {
        PhaseDef::Isotropic => Ok(Phase::Isotropic),
        PhaseDef::Rayleigh => Ok(Phase::Rayleigh),
        PhaseDef::Table(PhaseTableDef::HenyeyGreenstein(g)) => {
            context.at(g.span(), HenyeyGreenstein::new(g.get_ref().get())).map(Phase::HenyeyGreenstein)
        }
        PhaseDef::Table(PhaseTableDef::Mixture(defs)) => {
            let mut lobe =
                |def: &super::schema::WeightedPhaseDef| Ok((def.weight.get(), phase(context, &def.phase)?));
            let lobes = defs.get_ref().iter().map(&mut lobe).collect::<Result<Vec<_>>>()?;
            context.at(defs.span(), Mixture::new(lobes)).map(Phase::Mixture)
        }
        PhaseDef::Table(PhaseTableDef::Droplets(diameter)) => {
            context.at(diameter.span(), droplets(diameter.get_ref().get()))
        }
        PhaseDef::Table(PhaseTableDef::Tabulated(pairs)) => {
            let entries: Vec<(f32, f32)> = pairs.get_ref().iter().map(|p| (p.0.x, p.0.y)).collect();
            context.at(pairs.span(), Tabulated::new(&entries)).map(Phase::Tabulated)
        }
        PhaseDef::Table(PhaseTableDef::Fibres(def)) => {
            let (axis, roughness) = (def.get_ref().axis.0, def.get_ref().roughness.get());
            context.at(def.span(), Sggx::new(axis, roughness, true)).map(Phase::Sggx)
        }
        PhaseDef::Table(PhaseTableDef::Flakes(def)) => {
            let (axis, roughness) = (def.get_ref().axis.0, def.get_ref().roughness.get());
            context.at(def.span(), Sggx::new(axis, roughness, false)).map(Phase::Sggx)
        }
        PhaseDef::Table(PhaseTableDef::ByPlace(def)) => {
            let inner = def.get_ref();
            let parts = [phase(context, &inner.first)?, phase(context, &inner.second)?];
            let share = grids::grid_of(context, &inner.share, 1.0)?;
            context.at(def.span(), ByPlace::new(*share, parts)).map(|p| Phase::ByPlace(Box::new(p)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::assets::Assets;
    use super::super::source::Source;
    use super::*;
    use glam::Vec3A;
    use serde::Deserialize;

    #[derive(Deserialize)]
    struct File {
        medium: Named<MediumDef>,
        inside: Spanned<String>,
    }

    const TEXT: &str = "inside = 'fog'\n[medium.milk]\nsigma_t = [1, 2, 4]\nalbedo = 0.5\nscale = 3\nemission = 7\n\
                        [medium.fog]\nsigma_a = 0\nsigma_s = [0.1, 1, 10]\nphase = { mixture = [\
                        { weight = 1, phase = { hg = 0.5 } }, { weight = 3, phase = \"rayleigh\" }] }\n";

    #[test]
    fn both_forms_are_read_and_scaled() {
        let source = Source::from_text("a.toml", TEXT);
        let file: File = source.parse().unwrap_or_else(|e| panic!("{e}"));
        let media = Media::load(&mut Context::new(&source, &Assets::new()), &file.medium)
            .unwrap_or_else(|e| panic!("{e}"));
        let [milk, fog] = [0, 1].map(|i| media.all[i].summary());
        assert_eq!((milk.sigma_t, milk.sigma_s), (Vec3A::new(3.0, 6.0, 12.0), Vec3A::new(1.5, 3.0, 6.0)));
        assert_eq!((milk.emission, milk.phase.as_str()), (Vec3A::splat(7.0), "isotropic"));
        assert_eq!((fog.sigma_t, fog.albedo), (Vec3A::new(0.1, 1.0, 10.0), Vec3A::ONE));
        assert!((fog.mean_cosine - 0.125).abs() < 1e-6);
    }

    #[test]
    fn names_are_found_or_refused_with_the_nearest() {
        let source = Source::from_text("a.toml", TEXT);
        let file: File = source.parse().unwrap_or_else(|e| panic!("{e}"));
        let assets = Assets::new();
        let mut context = Context::new(&source, &assets);
        let mut media = Media::load(&mut context, &file.medium).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(media.names(), ["milk", "fog"]);
        assert_eq!(media.index(&context, &file.inside).unwrap_or_else(|e| panic!("{e}")), 1);
        let unused: Vec<String> = media.unused().into_iter().map(|(name, _)| name).collect();
        assert_eq!(unused, ["milk"]);
        let source = Source::from_text("a.toml", TEXT.replacen("'fog'", "'fgo'", 1));
        let file: File = source.parse().unwrap_or_else(|e| panic!("{e}"));
        let assets = Assets::new();
        let context = Context::new(&source, &assets);
        let message = media.index(&context, &file.inside).expect_err("no such medium").to_string();
        assert!(
            message.starts_with("a.toml:1:10: there is no medium `fgo`; known: `milk`, `fog`"),
            "{message}"
        );
        assert!(message.ends_with("did you mean `fog`?"), "{message}");
    }
}
