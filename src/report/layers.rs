//! The layers of an EXR that hold contributions of techniques: what their names say.

use crate::film::Image;
use crate::film::exr::LayeredImage;
use crate::transport::technique::TECHNIQUES;

/// What the paths of a layer have in common.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Group {
    /// Made by the technique of this key.
    Family(String),
    /// Made of s light and t camera vertices.
    Pair(u32, u32),
}

/// What a layer holds of its paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Their contribution times its weight.
    Weighted,
    /// Their contribution.
    Unweighted,
    /// The mean weight of their samples.
    Weight,
}

impl Kind {
    /// The kind of contributions.
    pub fn of(weighted: bool) -> Self {
        if weighted { Self::Weighted } else { Self::Unweighted }
    }

    /// Start of the names of such layers.
    fn prefix(self) -> &'static str {
        match self {
            Self::Weighted => "weighted",
            Self::Unweighted => "unweighted",
            Self::Weight => "weight",
        }
    }
}

/// What `weighted.nee` or `unweighted.s02t03` holds; `None` for other layers.
pub(super) fn parse(name: &str) -> Option<(Group, Kind)> {
    let (prefix, rest) = name.split_once('.')?;
    let kind = [Kind::Weighted, Kind::Unweighted, Kind::Weight].into_iter().find(|k| k.prefix() == prefix)?;
    let pair = rest.strip_prefix('s').and_then(|r| r.split_once('t'));
    let pair = pair.and_then(|(s, t)| Some((s.parse().ok()?, t.parse().ok()?)));
    Some((pair.map_or_else(|| Group::Family(rest.to_owned()), |(s, t)| Group::Pair(s, t)), kind))
}

/// The layer's name.
pub(super) fn name(group: &Group, kind: Kind) -> String {
    let prefix = kind.prefix();
    match group {
        Group::Family(key) => format!("{prefix}.{key}"),
        Group::Pair(s, t) => format!("{prefix}.s{s:02}t{t:02}"),
    }
}

/// Keys of the techniques that have weighted layers: in the table's order, then others by name.
pub(super) fn families(image: &LayeredImage) -> Vec<String> {
    let mut keys: Vec<String> = image
        .layers
        .iter()
        .filter_map(|l| match parse(&l.name)? {
            (Group::Family(key), Kind::Weighted) => Some(key),
            _ => None,
        })
        .collect();
    keys.sort_by_key(|key| (TECHNIQUES.iter().position(|t| t.key == key).unwrap_or(usize::MAX), key.clone()));
    keys
}

/// Longest path, in segments, with a weighted layer of its own an (s, t).
pub(super) fn longest_pair(image: &LayeredImage) -> Option<u32> {
    let pairs = image.layers.iter().filter_map(|l| match parse(&l.name)? {
        (Group::Pair(s, t), Kind::Weighted) => (s + t).checked_sub(1),
        _ => None,
    });
    pairs.max()
}

/// Mean luminance over the finite pixels: what a layer's share of the energy is measured by.
pub(super) fn energy(image: &Image) -> f64 {
    image.luminance().values.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)).sum::<f64>()
        / image.pixels.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_and_written() {
        for (text, group, kind) in [
            ("weighted.nee", Group::Family("nee".into()), Kind::Weighted),
            ("unweighted.surf", Group::Family("surf".into()), Kind::Unweighted),
            ("weight.bb1d", Group::Family("bb1d".into()), Kind::Weight),
            ("weighted.s02t13", Group::Pair(2, 13), Kind::Weighted),
            ("unweighted.s00t02", Group::Pair(0, 2), Kind::Unweighted),
        ] {
            assert_eq!(parse(text), Some((group.clone(), kind)));
            assert_eq!(name(&group, kind), text);
        }
        for other in ["", "variance", "weightedXnee", "other.nee"] {
            assert_eq!(parse(other), None);
        }
    }

    #[test]
    fn energy_is_the_mean_luminance_of_what_is_finite() {
        let mut image = Image::from_fn(2, 2, |_, _| [1.0; 3]);
        assert!((energy(&image) - 1.0).abs() < 1e-6);
        image.pixels[0] = [f32::NAN; 3];
        assert!((energy(&image) - 0.75).abs() < 1e-6);
    }

    #[test]
    fn families_come_in_the_order_of_the_table() {
        let mut image = LayeredImage::new(Image::new(1, 1));
        for name in [
            "weighted.zeta",
            "weighted.lens",
            "unweighted.hit",
            "weight.nee",
            "weighted.hit",
            "weighted.s01t03",
        ] {
            image.push(name, Image::new(1, 1));
        }
        assert_eq!(families(&image), ["hit", "lens", "zeta"]);
        assert_eq!(longest_pair(&image), Some(3));
    }
}
