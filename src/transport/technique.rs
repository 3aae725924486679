//! The one list of techniques and presets. Configuration keys, layer names, report columns, `--help` and
//! `tyndall techniques` all come from the two tables here.

use super::merge::MERGES;
use crate::error::{Error, Result, nearest};

/// A family of sampling techniques: a way in which a light and a camera subpath make one path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Technique {
    /// s = 0: the camera subpath finds the light by itself.
    Hit,
    /// s = 1: next-event estimation, a point on a light from its own density.
    NextEvent,
    /// s ≥ 2, t ≥ 2: a light vertex is connected to a camera vertex.
    Connect,
    /// t = 1: light tracing, a light vertex is connected to the lens.
    Lens,
    /// A light and a camera vertex near each other on a surface are taken for one.
    Surface,
    /// P-P3D: the same of two collisions in a medium.
    PointPoint,
    /// P-B2D: a collision of a light subpath and a camera beam that passes it.
    PointBeam,
    /// B-P2D: a photon beam and a collision of a camera subpath that it passes.
    BeamPoint,
    /// B-B1D: a photon beam and a camera beam that pass each other.
    BeamBeam,
}

/// What is known of a technique: a row of the table.
pub struct TechniqueInfo {
    /// The technique.
    pub technique: Technique,
    /// Name in experiment files, on the command line and in layer names.
    pub key: &'static str,
    /// Name for people.
    pub label: &'static str,
    /// Which (s, t) it stands for.
    pub symbol: &'static str,
    /// Where it comes from.
    pub paper: &'static str,
    /// Colour in figures, sRGB hex.
    pub color: &'static str,
}

/// All techniques, in the order in which they are shown and summed.
pub const TECHNIQUES: [TechniqueInfo; 9] = [
    TechniqueInfo {
        technique: Technique::Hit,
        key: "hit",
        label: "light hit",
        symbol: "s=0",
        paper: "Kajiya 1986",
        color: "#4477aa",
    },
    TechniqueInfo {
        technique: Technique::NextEvent,
        key: "nee",
        label: "next-event estimation",
        symbol: "s=1",
        paper: "Veach 1997, 10.2",
        color: "#66ccee",
    },
    TechniqueInfo {
        technique: Technique::Connect,
        key: "connect",
        label: "vertex connection",
        symbol: "s≥2, t≥2",
        paper: "Veach 1997, 10.2; Lafortune & Willems 1993",
        color: "#228833",
    },
    TechniqueInfo {
        technique: Technique::Lens,
        key: "lens",
        label: "light tracing",
        symbol: "t=1",
        paper: "Dutré et al. 1993; Veach 1997, 10.2",
        color: "#ccbb44",
    },
    TechniqueInfo {
        technique: Technique::Surface,
        key: "surf",
        label: "surface merging",
        symbol: "SURF",
        paper: "Jensen 1996; Georgiev et al. 2012; Hachisuka et al. 2012",
        color: "#ee6677",
    },
    TechniqueInfo {
        technique: Technique::PointPoint,
        key: "pp3d",
        label: "point-point 3D",
        symbol: "P-P3D",
        paper: "Jensen & Christensen 1998; Křivánek et al. 2014",
        color: "#aa3377",
    },
    TechniqueInfo {
        technique: Technique::PointBeam,
        key: "pb2d",
        label: "point-beam 2D",
        symbol: "P-B2D",
        paper: "Jarosz et al. 2008; Křivánek et al. 2014",
        color: "#ee7733",
    },
    TechniqueInfo {
        technique: Technique::BeamPoint,
        key: "bp2d",
        label: "beam-point 2D",
        symbol: "B-P2D",
        paper: "Jarosz et al. 2011; Křivánek et al. 2014",
        color: "#882255",
    },
    TechniqueInfo {
        technique: Technique::BeamBeam,
        key: "bb1d",
        label: "beam-beam 1D",
        symbol: "B-B1D",
        paper: "Jarosz et al. 2011; Křivánek et al. 2014",
        color: "#009988",
    },
];

/// A named set of techniques.
pub struct Preset {
    /// Name in experiment files and on the command line.
    pub key: &'static str,
    /// Name for people.
    pub label: &'static str,
    /// Its techniques.
    pub techniques: &'static [Technique],
    /// Whether camera subpaths end at their first vertex that is not specular.
    pub first: bool,
}

/// All presets.
pub const PRESETS: [Preset; 11] = {
    use Technique::{BeamBeam, BeamPoint, Connect, Hit, Lens, NextEvent, PointBeam, PointPoint, Surface};
    const fn preset(
        key: &'static str,
        label: &'static str,
        techniques: &'static [Technique],
        first: bool,
    ) -> Preset {
        Preset { key, label, techniques, first }
    }
    [
        preset("pt", "path tracing", &[Hit, NextEvent], false),
        preset("lt", "light tracing", &[Lens], false),
        preset("bpt", "bidirectional path tracing", &[Hit, NextEvent, Connect, Lens], false),
        preset("ppm", "progressive photon mapping", &[Hit, Surface], true),
        preset("bpm", "bidirectional photon mapping", &[Hit, Surface], false),
        preset("vcm", "vertex connection and merging", &[Hit, NextEvent, Connect, Lens, Surface], false),
        preset("pp3d", "point-point 3D", &[Hit, Surface, PointPoint], true),
        preset("pb2d", "point-beam 2D", &[Hit, Surface, PointBeam], true),
        preset("bp2d", "beam-point 2D", &[Hit, Surface, BeamPoint], true),
        preset("bb1d", "beam-beam 1D", &[Hit, Surface, BeamBeam], true),
        preset(
            "upbp",
            "points, beams and paths",
            &[Hit, NextEvent, Connect, Lens, Surface, PointPoint, PointBeam, BeamBeam],
            false,
        ),
    ]
};

/// A preset by its key.
///
/// # Errors
/// One that is unknown; the nearest is offered.
pub fn preset(key: &str) -> Result<&'static Preset> {
    let known = PRESETS.iter().map(|p| p.key);
    PRESETS.iter().find(|p| p.key == key).ok_or_else(|| {
        let hint = nearest(key, known.clone()).map_or(String::new(), |n| format!("; did you mean '{n}'?"));
        let known: Vec<&str> = known.collect();
        Error::usage(format!("unknown preset '{key}'{hint} (known: {})", known.join(", ")))
    })
}

impl Technique {
    /// Number of techniques.
    pub const COUNT: usize = TECHNIQUES.len();

    /// All of them, in the table's order.
    pub fn all() -> impl Iterator<Item = Self> {
        TECHNIQUES.iter().map(|i| i.technique)
    }

    /// Position in the table.
    #[inline]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Its row of the table.
    pub fn info(self) -> &'static TechniqueInfo {
        &TECHNIQUES[self.index()]
    }
}

/// A set of techniques; never empty once parsed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct TechniqueSet(u32);

impl TechniqueSet {
    /// The set of these techniques.
    pub fn of(techniques: &[Technique]) -> Self {
        Self(techniques.iter().fold(0, |bits, t| bits | 1 << t.index()))
    }

    /// Every technique.
    pub fn all() -> Self {
        Self((1 << Technique::COUNT) - 1)
    }

    /// Every set that is not empty.
    pub fn subsets() -> impl Iterator<Item = Self> {
        (1..1u32 << Technique::COUNT).map(Self)
    }

    /// Every connection: what needs no other light subpath than a partner.
    pub fn of_connections() -> Self {
        Self(Technique::all().filter(|t| !MERGES.contains(t)).fold(0, |bits, t| bits | 1 << t.index()))
    }

    /// Those that ask for no density of a flight from its far end, so that media may be tracked
    /// ([`super::settings::Tracking::Delta`]): neither needs a light subpath.
    pub fn tracked() -> Self {
        Self::of(&[Technique::Hit, Technique::NextEvent])
    }

    /// Every set of connections that is not empty.
    pub fn connections() -> impl Iterator<Item = Self> {
        Self::subsets().filter(|s| !s.merges())
    }

    /// These and one more.
    pub fn with(self, technique: Technique) -> Self {
        Self(self.0 | 1 << technique.index())
    }

    /// These without those of another set.
    pub fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// Whether it has none.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether some technique of it merges.
    pub fn merges(self) -> bool {
        MERGES.iter().any(|t| self.has(*t))
    }

    /// Whether some technique of it merges in media.
    pub fn merges_in_media(self) -> bool {
        MERGES.iter().any(|t| *t != Technique::Surface && self.has(*t))
    }

    /// Whether a technique is in it.
    #[inline]
    pub fn has(self, technique: Technique) -> bool {
        self.0 >> technique.index() & 1 == 1
    }

    /// Its techniques in the table's order.
    pub fn iter(self) -> impl Iterator<Item = Technique> {
        Technique::all().filter(move |t| self.has(*t))
    }

    /// From names of techniques and presets, such as `["pt", "lens"]`.
    ///
    /// # Errors
    /// A name that is unknown (the nearest is offered) or given twice, or no name at all.
    pub fn parse<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<Self> {
        let mut set = Self(0);
        let mut seen = Vec::new();
        for name in names.into_iter().map(str::trim) {
            if seen.contains(&name) {
                return Err(Error::usage(format!("technique '{name}' is named twice")));
            }
            seen.push(name);
            set.0 |= Self::named(name)?.0;
        }
        if set.0 == 0 {
            return Err(Error::usage("no technique is named: see 'tyndall techniques'"));
        }
        Ok(set)
    }

    fn named(name: &str) -> Result<Self> {
        // Some presets are called after the technique that they show: in a list the technique is meant.
        if let Some(info) = TECHNIQUES.iter().find(|i| i.key == name) {
            return Ok(Self::of(&[info.technique]));
        }
        if let Some(preset) = PRESETS.iter().find(|p| p.key == name) {
            return Ok(Self::of(preset.techniques));
        }
        let mut known: Vec<&str> = PRESETS.iter().map(|p| p.key).collect();
        known.extend(TECHNIQUES.iter().map(|i| i.key).filter(|key| PRESETS.iter().all(|p| p.key != *key)));
        let hint =
            nearest(name, known.iter().copied()).map_or(String::new(), |n| format!("; did you mean '{n}'?"));
        Err(Error::usage(format!("unknown technique or preset '{name}'{hint} (known: {})", known.join(", "))))
    }
}

impl std::fmt::Display for TechniqueSet {
    /// The preset's name where the set is one, else its techniques joined by commas.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(preset) = PRESETS.iter().find(|p| !p.first && Self::of(p.techniques) == *self) {
            return f.write_str(preset.key);
        }
        let keys: Vec<&str> = self.iter().map(|t| t.info().key).collect();
        f.write_str(&keys.join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_the_enum() {
        for (i, info) in TECHNIQUES.iter().enumerate() {
            assert_eq!(info.technique.index(), i);
        }
    }

    #[test]
    fn names_resolve_and_print_back() {
        for set in TechniqueSet::subsets() {
            let printed = set.to_string();
            assert_eq!(TechniqueSet::parse(printed.split(',')).unwrap(), set);
        }
        assert_eq!(TechniqueSet::parse(["pt", "connect", "lens"]).unwrap().to_string(), "bpt");
    }

    #[test]
    fn wrong_names_are_refused_with_the_nearest() {
        assert!(TechniqueSet::parse(["btp"]).unwrap_err().to_string().contains("'bpt'"));
        assert!(TechniqueSet::parse(["nee", "nee"]).unwrap_err().to_string().contains("twice"));
        assert!(TechniqueSet::parse([]).is_err());
    }
}
