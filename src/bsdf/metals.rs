//! Complex indices of refraction of metals for linear Rec. 709.
//!
//! Three wavelengths stand for the three channels: the dominant wavelengths of the primaries (white D65), 611.4, 549.1
//! and 464.2 nm. The published tables are interpolated linearly there. A metal's colour then comes out as that of
//! its reflectance at these three wavelengths, which is what a renderer in RGB can know of it.

use crate::error::nearest;
use glam::Vec3;

/// A metal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metal {
    /// English name, lower case.
    pub name: &'static str,
    /// Chemical symbol.
    pub symbol: &'static str,
    /// Real part of the index of refraction, a channel each.
    pub eta: Vec3,
    /// Imaginary part: the extinction coefficient.
    pub k: Vec3,
}

const fn metal(name: &'static str, symbol: &'static str, eta: [f32; 3], k: [f32; 3]) -> Metal {
    Metal { name, symbol, eta: Vec3::from_array(eta), k: Vec3::from_array(k) }
}

/// The metals that are known, in alphabetical order. Sources: Ag, Au, Cu [Johnson & Christy 1972]; Cr, Fe, Ni, Pd, Ti
/// [Johnson & Christy 1974]; Al [Rakić 1995]; Pt [Rakić et al. 1998]; W [Weaver et al. 1975].
pub const METALS: [Metal; 11] = [
    metal("aluminium", "Al", [1.322, 1.011, 0.683], [7.311, 6.617, 5.625]),
    metal("chromium", "Cr", [3.178, 3.180, 2.449], [3.300, 3.330, 3.206]),
    metal("copper", "Cu", [0.362, 1.015, 1.246], [3.127, 2.579, 2.453]),
    metal("gold", "Au", [0.222, 0.428, 1.335], [3.208, 2.461, 1.872]),
    metal("iron", "Fe", [2.890, 2.950, 2.643], [3.040, 2.930, 2.803]),
    metal("nickel", "Ni", [1.985, 1.920, 1.763], [3.985, 3.611, 3.042]),
    metal("palladium", "Pd", [1.739, 1.640, 1.443], [4.180, 3.841, 3.346]),
    metal("platinum", "Pt", [2.263, 2.083, 1.879], [4.053, 3.710, 3.219]),
    metal("silver", "Ag", [0.058, 0.060, 0.046], [4.106, 3.590, 2.795]),
    metal("titanium", "Ti", [2.659, 2.540, 2.303], [3.698, 3.430, 3.080]),
    metal("tungsten", "W", [3.579, 3.522, 3.324], [2.881, 2.739, 2.571]),
];

/// Every name that [`find`] knows: the English names and the symbols.
pub fn names() -> impl Iterator<Item = &'static str> {
    METALS.iter().flat_map(|m| [m.name, m.symbol])
}

/// The metal of that name or symbol, in any case. The error names the nearest name, and all of them.
pub fn find(name: &str) -> Result<&'static Metal, String> {
    let same = |known: &str| known.eq_ignore_ascii_case(name);
    METALS.iter().find(|m| same(m.name) || same(m.symbol)).ok_or_else(|| {
        let meant = nearest(&name.to_lowercase(), METALS.iter().map(|m| m.name));
        let meant = meant.map_or(String::new(), |n| format!(" Did you mean `{n}`?"));
        let known: Vec<String> = METALS.iter().map(|m| format!("{} ({})", m.name, m.symbol)).collect();
        format!("there is no metal `{name}`.{meant} Known: {}", known.join(", "))
    })
}
