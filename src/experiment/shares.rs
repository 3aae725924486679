//! Why an estimator is as it is: what each technique adds to the image, how much of the variance it causes, and what it
//! costs.
//!
//! With X_t the weighted image of technique t in a run and X = Σ X_t the whole, the variance of X is Σ cov(X_t, X): technique t
//! causes the share cov(X_t, X) / var X, and these shares sum up to 1. One may be negative, where a technique's noise is
//! against that of the others. Products of differences of two runs tell covariances without a mean: E ½ ⟨ΔX_t, ΔX⟩; runs are
//! taken in pairs, so that the pairs are independent.

use super::measure::CONFIDENCE;
use super::results::{Estimate, Interval, TechniqueShare};
use super::statistics::two_sided_quantile;
use crate::film::{Film, Image, ImageKind};
use crate::math::{Rgb, RgbExt};
use crate::transport::technique::Technique;

/// Pairs, or runs, from which on there is an interval.
const LEAST: usize = 3;

/// Products of the differences of a pair of runs, mean over pixels and channels.
#[derive(Clone, Debug, Default)]
struct Pair {
    /// ⟨ΔX_t, ΔX⟩ of each technique.
    with_all: Vec<f64>,
    /// ⟨ΔX_t, ΔX_t⟩ of each technique.
    own: Vec<f64>,
    /// ⟨ΔX, ΔX⟩.
    all: f64,
}

/// What is gathered run by run.
#[derive(Debug, Default)]
pub struct Shares {
    techniques: Vec<Technique>,
    /// Mean luminance of each technique's image, a run a row.
    energies: Vec<Vec<f64>>,
    pairs: Vec<Pair>,
    /// Images of the run that waits for its partner.
    waiting: Option<Vec<Image>>,
    /// Sums over the pairs of ½ (ΔX_t)² of each technique.
    maps: Vec<Image>,
}

impl Shares {
    /// Takes in a run.
    pub fn add(&mut self, film: &Film) {
        let weighted = film.layers_where(|kind| matches!(kind, ImageKind::Family { weighted: true, .. }));
        let (kinds, images): (Vec<ImageKind>, Vec<Image>) = weighted.into_iter().unzip();
        let technique = |kind: &ImageKind| match kind {
            ImageKind::Family { technique, .. } => Some(*technique),
            _ => None,
        };
        self.techniques = kinds.iter().filter_map(technique).collect();
        self.energies.push(images.iter().map(energy).collect());
        let Some(other) = self.waiting.take() else {
            self.waiting = Some(images);
            return;
        };
        if self.maps.is_empty() {
            self.maps = images.iter().map(|i| Image::new(i.width, i.height)).collect();
        }
        let mut pair = Pair { with_all: vec![0.0; images.len()], own: vec![0.0; images.len()], all: 0.0 };
        let pixels = images.first().map_or(0, |i| i.pixels.len());
        let mut differences = vec![0.0; images.len()];
        for i in 0..pixels {
            for c in 0..3 {
                for (t, difference) in differences.iter_mut().enumerate() {
                    *difference = f64::from(images[t].pixels[i][c]) - f64::from(other[t].pixels[i][c]);
                }
                let whole: f64 = differences.iter().sum();
                pair.all += whole * whole;
                for (t, difference) in differences.iter().enumerate() {
                    pair.with_all[t] += difference * whole;
                    pair.own[t] += difference * difference;
                    self.maps[t].pixels[i][c] += (0.5 * difference * difference) as f32;
                }
            }
        }
        self.pairs.push(pair);
    }

    /// A row a technique, in the order of the table of techniques; `times` are the shares of the time, by technique.
    pub fn rows(&self, times: &[(Technique, Estimate)]) -> Vec<TechniqueShare> {
        let row = |(t, technique): (usize, &Technique)| {
            let pairs = |top: &dyn Fn(&Pair) -> f64| {
                let values: Vec<[f64; 2]> = self.pairs.iter().map(|p| [top(p), p.all]).collect();
                ratio(&values)
            };
            let energies: Vec<[f64; 2]> = self.energies.iter().map(|e| [e[t], e.iter().sum()]).collect();
            TechniqueShare {
                technique: technique.info().key.to_owned(),
                energy: ratio(&energies).unwrap_or(Estimate { mean: f64::NAN, interval: None }),
                variance: pairs(&|p| p.own[t]),
                caused: pairs(&|p| p.with_all[t]),
                time: times.iter().find(|(other, _)| other == technique).map(|(_, share)| *share),
            }
        };
        self.techniques.iter().enumerate().map(row).collect()
    }

    /// The variance of each technique's image in one run, pixel by pixel; empty for a single run.
    pub fn maps(&self) -> Vec<(Technique, Image)> {
        let scale = 1.0 / self.pairs.len().max(1) as f32;
        let scaled = |image: &Image| Image {
            pixels: image.pixels.iter().map(|p| p.map(|v| v * scale)).collect(),
            ..*image
        };
        self.techniques.iter().copied().zip(self.maps.iter().map(scaled)).collect()
    }
}

/// Mean luminance.
fn energy(image: &Image) -> f64 {
    let luminance = |p: &[f32; 3]| f64::from(Rgb::from_array(*p).luminance());
    image.pixels.iter().map(luminance).sum::<f64>() / image.pixels.len().max(1) as f64
}

/// A sum over a sum, with the interval of the jackknife from 3 on [Efron & Stein 1981]; none where the lower one vanishes.
pub fn ratio(values: &[[f64; 2]]) -> Option<Estimate> {
    let sum = values.iter().fold([0.0; 2], |s, v| [s[0] + v[0], s[1] + v[1]]);
    let mean = sum[0] / sum[1];
    if !mean.is_finite() {
        return None;
    }
    let n = values.len() as f64;
    let without: Vec<f64> = values.iter().map(|v| (sum[0] - v[0]) / (sum[1] - v[1])).collect();
    let center = without.iter().sum::<f64>() / n;
    let variance = without.iter().map(|v| (v - center).powi(2)).sum::<f64>() * (n - 1.0) / n;
    let half = two_sided_quantile(CONFIDENCE, n - 1.0).map(|t| t * variance.sqrt());
    let half = half.filter(|h| values.len() >= LEAST && h.is_finite());
    Some(Estimate { mean, interval: half.map(|h| Interval { low: mean - h, high: mean + h }) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, CameraSettings, FovAxis};
    use crate::film::Sample;
    use crate::math::rng::{Stream, StreamKind};
    use crate::transport::settings::Settings;
    use crate::transport::technique::TechniqueSet;
    use glam::{Affine3A, UVec2};

    /// A run in which `hit` adds 1 ± 0.1 and `nee` adds 3 ± 0.2 with the same sign as `hit` half of the time, a pixel.
    fn run(number: u64) -> Film {
        let camera = Camera::new(&CameraSettings {
            size: UVec2::new(64, 64),
            crop: None,
            fov_axis: FovAxis::Horizontal,
            fov: 40.0,
            to_world: Affine3A::IDENTITY,
            lens: None,
            near: 0.0,
        });
        let set = TechniqueSet::of(&[Technique::Hit, Technique::NextEvent]);
        let mut film = Film::new(&camera.unwrap(), &Settings::new(set));
        film.iterate(1, |band| {
            let mut random = Stream::new(5, number, StreamKind::Other, band.index as u64);
            for pixel in 0..band.rows() * band.width {
                let sign = |u: f32| if u < 0.5 { -1.0 } else { 1.0 };
                let first = sign(random.next_1d());
                let second = if random.next_1d() < 0.5 { first } else { sign(random.next_1d()) };
                for (technique, value) in
                    [(Technique::Hit, 1.0 + 0.1 * first), (Technique::NextEvent, 3.0 + 0.2 * second)]
                {
                    let contribution = Rgb::splat(value);
                    band.record(pixel, &Sample { technique, s: 0, t: 2, contribution, weight: 1.0 });
                }
                band.settle(pixel);
            }
        });
        film
    }

    #[test]
    fn shares_of_what_is_known() {
        let mut shares = Shares::default();
        (0..12).for_each(|i| shares.add(&run(i)));
        let rows = shares.rows(&[]);
        // Variances 0.01 and 0.04, covariance 0.1 · 0.2 · ½ = 0.01: in all 0.07.
        for (row, energy, variance, caused) in
            [(&rows[0], 0.25, 1.0 / 7.0, 2.0 / 7.0), (&rows[1], 0.75, 4.0 / 7.0, 5.0 / 7.0)]
        {
            // 6 pairs of 4096 pixels see each to some half a per cent.
            for (name, value, expected) in [
                ("energy", row.energy, energy),
                ("variance", row.variance.unwrap(), variance),
                ("caused", row.caused.unwrap(), caused),
            ] {
                assert!((value.mean - expected).abs() < 0.02, "{name} {} {expected}", value.mean);
                let interval = value.interval.unwrap();
                assert!(
                    interval.low < value.mean
                        && value.mean < interval.high
                        && interval.high < expected + 0.05
                );
            }
        }
        assert!((rows.iter().map(|r| r.caused.unwrap().mean).sum::<f64>() - 1.0).abs() < 1e-9);
        for ((technique, map), expected) in shares.maps().iter().zip([0.01, 0.04]) {
            assert!((map.mean()[0] - expected).abs() < 0.02 * expected, "{technique:?}");
        }
    }

    #[test]
    fn a_single_run_has_energies_alone() {
        let mut shares = Shares::default();
        shares.add(&run(0));
        let rows = shares.rows(&[(Technique::Hit, Estimate { mean: 0.3, interval: None })]);
        assert!(rows[0].energy.mean > 0.2 && rows[0].energy.interval.is_none());
        assert!(rows[0].variance.is_none() && rows[0].caused.is_none() && shares.maps().is_empty());
        assert_eq!((rows[0].time.unwrap().mean, rows[1].time), (0.3, None));
        assert!(ratio(&[[1.0, 0.0]]).is_none());
    }
}
