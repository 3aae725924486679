//! Mitsuba's named materials: indices of refraction.

use super::tree::Element;
use crate::error::{Result, did_you_mean, nearest};

/// Dielectrics at 589 nm and room temperature, by the names that scene files use.
const DIELECTRICS: [(&str, f64); 23] = [
    ("vacuum", 1.0),
    ("helium", 1.000_036),
    ("hydrogen", 1.000_132),
    ("air", 1.000_277),
    ("carbon dioxide", 1.000_45),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.520_45),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

/// Conductors: η and k as the RGB variants of Mitsuba 3.9 have them.
const CONDUCTORS: [(&str, [f64; 3], [f64; 3]); 33] = [
    ("a-C", [2.944046, 2.227136, 1.968162], [0.8874649, 0.7992985, 0.81529]),
    ("Ag", [0.1552762, 0.116728, 0.1383876], [4.828354, 3.122222, 2.146901]),
    ("Al", [1.657501, 0.8804047, 0.5212445], [9.223811, 6.269502, 4.837004]),
    ("AlAs", [3.605296, 3.232938, 2.216319], [0.0006794373, 0.0, 0.007512709]),
    ("Au", [0.143036, 0.3753071, 1.442045], [3.982997, 2.385556, 1.603359]),
    ("Be", [4.185012, 3.185029, 2.784061], [3.835466, 3.010122, 2.868994]),
    ("Cr", [4.369668, 2.916505, 1.654905], [5.206547, 4.231306, 3.754699]),
    ("CsI", [2.1449, 1.702319, 1.662427], [0.0, 0.0, 0.0]),
    ("Cu", [0.2010055, 0.9237495, 1.102215], [3.913262, 2.453045, 2.14209]),
    ("Cu2O", [3.551773, 2.94987, 2.751875], [0.114207, 0.1938969, 0.6061339]),
    ("CuO", [3.247541, 2.447805, 2.21022], [0.5210896, 0.5700307, 0.7221789]),
    ("d-C", [2.70872, 2.318826, 2.228898], [0.0, 0.0, 0.0]),
    ("Hg", [2.398939, 1.440028, 0.9095704], [6.327587, 4.371925, 3.421764]),
    ("HgTe", [4.77904, 3.231196, 2.659901], [1.631613, 1.58081, 1.729287]),
    ("Ir", [3.0863, 2.082191, 1.617915], [5.592153, 4.067088, 3.267312]),
    ("K", [0.06404319, 0.04640977, 0.03818491], [2.1042, 1.34894, 0.9131259]),
    ("Li", [0.2657909, 0.1956183, 0.2209486], [3.540155, 2.311123, 1.668607]),
    ("MgO", [2.089584, 1.650723, 1.594879], [4.332695e-12, 0.0, 2.498646e-11]),
    ("Mo", [4.483974, 3.525131, 2.77631], [4.111437, 3.420827, 3.150607]),
    ("Na_palik", [0.06026936, 0.05614095, 0.06198843], [3.179273, 2.11249, 1.579041]),
    ("Nb", [3.420074, 2.790093, 2.395629], [3.441395, 2.737666, 2.579746]),
    ("Ni_palik", [2.367305, 1.663373, 1.467078], [4.498812, 3.050153, 2.345439]),
    ("Rh", [2.585793, 1.860216, 1.554263], [6.78226, 4.702987, 3.976073]),
    ("Se", [4.058311, 2.842935, 2.820853], [0.7540495, 0.6384435, 0.5218076]),
    ("Ta", [2.062721, 2.392939, 2.627929], [2.40836, 1.741486, 1.947028]),
    ("Te", [7.390234, 4.482105, 2.637106], [3.256022, 3.527059, 3.292054]),
    ("ThF4", [1.830714, 1.442229, 1.387648], [0.0, 0.0, 0.0]),
    ("TiC", [3.700528, 2.837422, 2.582287], [3.265635, 2.351589, 2.172791]),
    ("TiN", [1.64845, 1.150516, 1.379823], [3.368328, 1.943498, 1.102068]),
    ("VC", [3.657566, 2.752736, 2.532672], [3.068301, 2.198687, 1.963193]),
    ("V_palik", [4.277582, 3.512949, 2.761071], [3.491301, 2.889455, 3.111522]),
    ("VN", [2.865602, 2.119189, 1.940091], [3.032243, 2.056116, 1.616306]),
    ("W", [4.370817, 3.300246, 2.998407], [3.500641, 2.604874, 2.273233]),
];

/// An index of refraction: a number, or the name of a dielectric.
pub(super) fn index(element: &Element, name: &str, default: &str) -> Result<f64> {
    let Some(value) = element.property(name) else { return Ok(named(default).unwrap_or(1.0)) };
    if value.tag != "string" {
        return value.number();
    }
    let text = value.required("value")?;
    named(&text.to_ascii_lowercase()).ok_or_else(|| {
        let meant = nearest(text, DIELECTRICS.iter().map(|(n, _)| *n));
        let hint = did_you_mean(meant);
        value.error(format!("there is no dielectric `{text}`{hint}"))
    })
}

fn named(name: &str) -> Option<f64> {
    DIELECTRICS.iter().find(|(n, _)| *n == name).map(|(_, ior)| *ior)
}

/// η and k of a conductor by its name.
pub(super) fn conductor(element: &Element, name: &str) -> Result<([f64; 3], [f64; 3])> {
    let found = CONDUCTORS.iter().find(|(n, ..)| n.eq_ignore_ascii_case(name));
    found.map(|(_, eta, k)| (*eta, *k)).ok_or_else(|| {
        let meant = nearest(name, CONDUCTORS.iter().map(|(n, ..)| *n));
        let hint = did_you_mean(meant);
        let known: Vec<&str> = CONDUCTORS.iter().map(|(n, ..)| *n).collect();
        element.error(format!("there is no conductor `{name}`: none, {}{hint}", known.join(", ")))
    })
}
