//! The one list of techniques and presets. Configuration keys, layer names, report columns, `--help` and
//! `tyndall techniques` all come from the two tables here.

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
pub const TECHNIQUES: [TechniqueInfo; 4] = [
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
];

/// A named set of techniques.
pub struct Preset {
    /// Name in experiment files and on the command line.
    pub key: &'static str,
    /// Name for people.
    pub label: &'static str,
    /// Its techniques.
    pub techniques: &'static [Technique],
}

/// All presets.
pub const PRESETS: [Preset; 3] = [
    Preset { key: "pt", label: "path tracing", techniques: &[Technique::Hit, Technique::NextEvent] },
    Preset { key: "lt", label: "light tracing", techniques: &[Technique::Lens] },
    Preset {
        key: "bpt",
        label: "bidirectional path tracing",
        techniques: &[Technique::Hit, Technique::NextEvent, Technique::Connect, Technique::Lens],
    },
];

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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
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
        if let Some(preset) = PRESETS.iter().find(|p| p.key == name) {
            return Ok(Self::of(preset.techniques));
        }
        if let Some(info) = TECHNIQUES.iter().find(|i| i.key == name) {
            return Ok(Self::of(&[info.technique]));
        }
        let known: Vec<&str> =
            PRESETS.iter().map(|p| p.key).chain(TECHNIQUES.iter().map(|i| i.key)).collect();
        let hint =
            nearest(name, known.iter().copied()).map_or(String::new(), |n| format!("; did you mean '{n}'?"));
        Err(Error::usage(format!("unknown technique or preset '{name}'{hint} (known: {})", known.join(", "))))
    }
}

impl std::fmt::Display for TechniqueSet {
    /// The preset's name where the set is one, else its techniques joined by commas.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(preset) = PRESETS.iter().find(|p| Self::of(p.techniques) == *self) {
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
        assert!(TechniqueSet::parse(["bpd"]).unwrap_err().to_string().contains("'bpt'"));
        assert!(TechniqueSet::parse(["nee", "nee"]).unwrap_err().to_string().contains("twice"));
        assert!(TechniqueSet::parse([]).is_err());
    }
}
