//! What a user writes about merges: a table `merge` of an estimator, or `--merge KEY=VALUE` on the command line.

use super::kernel::Kernel;
use super::settings::{Beams, Continuation, Gather, MERGES, MergeSettings, PathCount, Radius};
use crate::error::{Error, Result};
use crate::scene::file::source::explained;
use crate::transport::technique::{Technique, TechniqueSet};
use serde::Deserialize;

/// `merge = { kernel, photon_beams, camera_beams, first, most_photons, most_beams, camera_continuation, direct, efficient,
/// radius, alpha, paths, surf = {…}, pp3d = {…}, pb2d = {…}, bp2d = {…}, bb1d = {…} }`.
#[derive(Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct MergeDef {
    /// `constant` or `epanechnikov`; default `constant`.
    pub kernel: Option<Kernel>,
    /// `short` or `long`; default `short`.
    pub photon_beams: Option<Beams>,
    /// `short` or `long`; default `long` where camera subpaths end at their first vertex, else `short`.
    pub camera_beams: Option<Beams>,
    /// Whether camera subpaths end at their first vertex that is not specular; default: as the preset says.
    pub first: Option<bool>,
    /// About as many photons are stored for merges at most; default no bound.
    pub most_photons: Option<u64>,
    /// About as many beams are stored at most; default no bound.
    pub most_beams: Option<u64>,
    /// Above 0, at most 1: the probability with which camera subpaths go on from a collision, at most; default: chosen
    /// for each medium.
    pub camera_continuation: Option<f32>,
    /// Whether lights as they are seen directly are connected with the lens, beside being hit; default: chosen.
    pub direct: Option<bool>,
    /// Whether the radii and counts that are left open, `direct` and `camera_continuation`, are chosen for the least error in a given
    /// time, where a technique that is worth less than it costs is left out; default true. Else each technique has as many merges.
    pub efficient: Option<bool>,
    /// Radius of each technique that says none of its own, in the same words.
    pub radius: Option<RadiusDef>,
    /// How the kernel's measure shrinks, of each technique that does not say it.
    pub alpha: Option<f32>,
    /// Light subpaths of each technique that does not say how many, in the same words.
    pub paths: Option<PathsDef>,
    /// Of surface merging.
    pub surf: Option<GatherDef>,
    /// Of P-P3D.
    pub pp3d: Option<GatherDef>,
    /// Of P-B2D.
    pub pb2d: Option<GatherDef>,
    /// Of B-P2D.
    pub bp2d: Option<GatherDef>,
    /// Of B-B1D.
    pub bb1d: Option<GatherDef>,
}

/// Of one technique: `{ radius, alpha, paths }`.
#[derive(Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct GatherDef {
    /// In metres, or `{ scene = share of the scene's radius }`, or `{ footprint = number of pixel footprints }`, or
    /// `{ nearest = number of photons within it on average }`; default: chosen from the scene.
    pub radius: Option<RadiusDef>,
    /// Above 0, at most 1: how the kernel's measure shrinks with the iterations; default 0.75, 1 keeps it.
    pub alpha: Option<f32>,
    /// Light subpaths: a number, or `{ per_pixel = number }`; default: chosen from the scene.
    pub paths: Option<PathsDef>,
}

/// A radius.
#[derive(Deserialize, Clone, Copy, Debug, PartialEq)]
#[serde(
    untagged,
    expecting = "expected metres, { scene = share }, { footprint = number } or { nearest = number }"
)]
pub enum RadiusDef {
    /// In metres.
    Metres(f32),
    /// In radii of the scene.
    Scene {
        /// The share.
        scene: f32,
    },
    /// In pixel footprints.
    Footprint {
        /// How many.
        footprint: f32,
    },
    /// By photons within it.
    Nearest {
        /// How many.
        nearest: f32,
    },
}

/// A number of light subpaths.
#[derive(Deserialize, Clone, Copy, Debug, PartialEq)]
#[serde(untagged, expecting = "expected a whole number or { per_pixel = number }")]
pub enum PathsDef {
    /// So many.
    Number(u64),
    /// So many a pixel.
    PerPixel {
        /// How many.
        per_pixel: f32,
    },
}

impl GatherDef {
    /// With what is said of all techniques, where this says nothing of its own.
    fn or(self, all: Self) -> Self {
        Self {
            radius: self.radius.or(all.radius),
            alpha: self.alpha.or(all.alpha),
            paths: self.paths.or(all.paths),
        }
    }

    fn resolve(self) -> Gather {
        let default = Gather::default();
        Gather {
            radius: match self.radius {
                None => Radius::Auto,
                Some(RadiusDef::Metres(r)) => Radius::Absolute(r),
                Some(RadiusDef::Scene { scene }) => Radius::Scene(scene),
                Some(RadiusDef::Footprint { footprint }) => Radius::Footprint(footprint),
                Some(RadiusDef::Nearest { nearest }) => Radius::Nearest(nearest),
            },
            alpha: self.alpha.unwrap_or(default.alpha),
            paths: match self.paths {
                None => PathCount::Auto,
                Some(PathsDef::Number(n)) => PathCount::Absolute(n),
                Some(PathsDef::PerPixel { per_pixel }) => PathCount::PerPixel(per_pixel),
            },
        }
    }
}

impl MergeDef {
    /// From entries such as `bb1d.radius=0.01`.
    ///
    /// # Errors
    /// An entry that is none, with what is allowed.
    pub fn parse(entries: &[String]) -> Result<Self> {
        let text = entries.join("\n");
        toml::from_str(&text).map_err(|e| {
            let entry = e.span().and_then(|s| text.get(..s.start)).map_or(0, |t| t.matches('\n').count());
            let entry = entries.get(entry).map_or("", String::as_str);
            Error::usage(format!("--merge {entry}: {}", explained(e.message())))
        })
    }

    /// Keys of which something is said for nothing, each with the reason: of techniques that are not in the set.
    pub fn idle(&self, techniques: TechniqueSet) -> Vec<(&'static str, String)> {
        let said = [self.surf, self.pp3d, self.pb2d, self.bp2d, self.bb1d];
        let said = MERGES.into_iter().zip(said).filter(|(t, def)| def.is_some() && !techniques.has(*t));
        let not_there = |technique: Technique| {
            (technique.info().key, format!("it is not among the techniques {techniques}"))
        };
        let mut idle: Vec<_> = said.map(|(technique, _)| not_there(technique)).collect();
        let of_all = [
            ("radius", self.radius.is_some()),
            ("alpha", self.alpha.is_some()),
            ("paths", self.paths.is_some()),
        ];
        let of_none = of_all.into_iter().filter(|(_, said)| *said && !techniques.merges());
        idle.extend(of_none.map(|(key, _)| (key, format!("none of the techniques {techniques} merges"))));
        idle
    }

    /// What it comes to where the preset says `first`.
    pub fn resolve(&self, first: bool) -> MergeSettings {
        let default = MergeSettings::default();
        let first = self.first.unwrap_or(first);
        // Along the only edge that merges, the whole ray is worth its time.
        let camera_beams = if first { Beams::Long } else { default.camera_beams };
        let all = GatherDef { radius: self.radius, alpha: self.alpha, paths: self.paths };
        let gather = |def: Option<GatherDef>| def.unwrap_or_default().or(all).resolve();
        MergeSettings {
            of: [self.surf, self.pp3d, self.pb2d, self.bp2d, self.bb1d].map(gather),
            kernel: self.kernel.unwrap_or(default.kernel),
            photon_beams: self.photon_beams.unwrap_or(default.photon_beams),
            camera_beams: self.camera_beams.unwrap_or(camera_beams),
            first,
            most_photons: self.most_photons,
            most_beams: self.most_beams,
            camera_continuation: self
                .camera_continuation
                .map_or(default.camera_continuation, Continuation::All),
            direct: self.direct,
            efficient: self.efficient.unwrap_or(default.efficient),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_read() {
        let entries =
            ["bb1d.radius=0.01", "surf = { radius = { footprint = 2 }, alpha = 1 }", "kernel='epanechnikov'"];
        let merging = MergeDef::parse(&entries.map(str::to_owned)).unwrap().resolve(true);
        assert_eq!(merging.of[4].radius, Radius::Absolute(0.01));
        assert_eq!((merging.of[0].radius, merging.of[0].alpha), (Radius::Footprint(2.0), 1.0));
        assert_eq!((merging.kernel, merging.first), (Kernel::Epanechnikov, true));
        assert_eq!(merging.of[1], Gather::default());
    }

    #[test]
    fn what_is_said_of_all_holds_where_nothing_else_is() {
        let entries = ["radius=0.02", "alpha=1", "surf.radius=0.01", "pb2d.paths=5", "pb2d.alpha=0.5"];
        let of = MergeDef::parse(&entries.map(str::to_owned)).unwrap().resolve(false).of;
        let radii = of.map(|gather| gather.radius);
        let [own, all] = [0.01, 0.02].map(Radius::Absolute);
        assert_eq!(radii, [own, all, all, all, all]);
        assert_eq!(of.map(|gather| gather.alpha), [1.0, 1.0, 0.5, 1.0, 1.0]);
        assert_eq!((of[2].paths, of[3].paths), (PathCount::Absolute(5), PathCount::Auto));
        let of = MergeDef::parse(&["paths={per_pixel=0.5}".into()]).unwrap().resolve(false).of;
        assert!(of.iter().all(|gather| gather.paths == PathCount::PerPixel(0.5)));
    }

    #[test]
    fn what_changes_nothing_is_told() {
        let idle = |entry: &str, techniques: &str| {
            let techniques = TechniqueSet::parse([techniques]).unwrap();
            let def = MergeDef::parse(&[entry.to_owned()]).unwrap();
            def.idle(techniques).into_iter().map(|(key, why)| format!("{key}: {why}")).collect::<Vec<_>>()
        };
        assert_eq!(idle("bb1d.radius=0.1", "vcm").len(), 1);
        assert!(idle("bb1d.radius=0.1", "vcm")[0].starts_with("bb1d: it is not among the techniques "));
        let pt = TechniqueSet::parse(["pt"]).unwrap();
        assert_eq!(idle("radius=0.1", "pt"), [format!("radius: none of the techniques {pt} merges")]);
        assert!(idle("radius=0.1", "vcm").is_empty() && idle("surf.radius=0.1", "vcm").is_empty());
    }

    #[test]
    fn nonsense_is_refused() {
        for (entry, words) in [
            ("bb2d.radius=1", "unknown key `bb2d`"),
            ("bb1d.radus=1", "did you mean `radius`?"),
            ("sruf.radius=1", "did you mean `surf`?"),
            ("bb1d.radius='wide'", "expected metres"),
            ("surf.paths=-3", "expected a whole number"),
            ("kernel='gauss'", "unknown variant"),
        ] {
            let message = MergeDef::parse(&[entry.to_owned()]).unwrap_err().to_string();
            assert!(message.contains(words) && message.contains(entry), "{message}");
        }
    }
}
