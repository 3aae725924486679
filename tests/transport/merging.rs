//! What the tests of merges share: settings by technique, and means over runs.

use tyndall::film::Image;
use tyndall::transport::TechniqueSet;
use tyndall::transport::merge::settings::Continuation;
use tyndall::transport::merge::{Beams, Gather, Kernel, MergeSettings, PathCount, Radius};

/// The set of these names.
pub fn set(names: &str) -> TechniqueSet {
    TechniqueSet::parse(names.split(',')).expect("known names")
}

/// Radii (metres) and light subpaths by technique, in the order of `MERGES`; the radii stay.
pub fn gathers(radii: [f64; 5], paths: [u64; 5]) -> [Gather; 5] {
    std::array::from_fn(|i| Gather {
        radius: Radius::Absolute(radii[i] as f32),
        alpha: 1.0,
        paths: PathCount::Absolute(paths[i]),
    })
}

/// Kernel, photon and camera beams by the bits of a number: all eight of them in turn.
pub fn variant(i: usize, of: [Gather; 5]) -> MergeSettings {
    let kind = |bit: usize| if i >> bit & 1 == 0 { Beams::Short } else { Beams::Long };
    let kernel = if i >> 2 & 1 == 0 { Kernel::Constant } else { Kernel::Epanechnikov };
    MergeSettings {
        of,
        kernel,
        photon_beams: kind(0),
        camera_beams: kind(1),
        first: false,
        camera_continuation: Continuation::All(0.4),
        ..MergeSettings::default()
    }
}

/// The mean of each image.
pub fn image_means(images: &[Image]) -> Vec<f64> {
    let mean = |image: &Image| {
        let sum: f64 = image.pixels.iter().flatten().map(|v| f64::from(*v)).sum();
        sum / (3 * image.pixels.len()) as f64
    };
    images.iter().map(mean).collect()
}

/// Mean and standard error.
pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Simpson's rule with `n` intervals, an even number.
pub fn integral(n: usize, from: f64, to: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    let step = (to - from) / n as f64;
    let weight = |i: usize| if i == 0 || i == n { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
    (0..=n).map(|i| weight(i) * f(from + step * i as f64)).sum::<f64>() * step / 3.0
}

/// The mean of a periodic function over a turn.
pub fn around(n: usize, mut f: impl FnMut(f64) -> f64) -> f64 {
    let turn = |i: usize| std::f64::consts::TAU * (i as f64 + 0.5) / n as f64;
    (0..n).map(|i| f(turn(i))).sum::<f64>() / n as f64
}
