//! How far an image is from its reference: one table of metrics, each with a value for the whole image and an
//! error map.
//!
//! Images are linear RGB. Images of different sizes, without pixels, or with NaN or infinite channels are
//! refused: a metric that passes over them would call a broken image good.

pub mod flip;
pub mod mae;
pub mod mse;
pub mod relmse;
pub mod smape;

use crate::error::{Error, Result};
use crate::film::{Image, ScalarImage};
use crate::scene::file::source::allowed;

/// An error metric between an image and its reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Metric {
    /// Mean squared error ([`mse`]).
    Mse,
    /// Relative mean squared error ([`relmse`]).
    RelMse,
    /// Mean absolute error ([`mae`]).
    Mae,
    /// Symmetric mean absolute percentage error ([`smape`]).
    Smape,
    /// HDR-FLIP over the reference's range of exposures ([`flip`]).
    Flip,
    /// LDR-FLIP of what a display shows at exposure 0 ([`flip`]).
    LdrFlip,
}

/// A row of the table of metrics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Description {
    /// The metric of this row.
    pub metric: Metric,
    /// Its name in files and on the command line.
    pub key: &'static str,
    /// Its name in tables and figures.
    pub label: &'static str,
    /// The unit of the value; `L` is the unit of the image's pixels, empty where there is none.
    pub unit: &'static str,
    /// Whether the smaller of two values is the better one.
    pub lower_is_better: bool,
    /// The definition, for an image x and a reference r.
    pub formula: &'static str,
    /// Who defined it.
    pub source: &'static str,
}

/// Every metric, in the order in which they are shown.
pub const TABLE: [Description; 6] = [
    Description {
        metric: Metric::Mse,
        key: "mse",
        label: "MSE",
        unit: "L²",
        lower_is_better: true,
        formula: "mean over pixels and channels of (x − r)²",
        source: "common",
    },
    Description {
        metric: Metric::RelMse,
        key: "relmse",
        label: "relMSE",
        unit: "",
        lower_is_better: true,
        formula: "mean over pixels and channels of (x − r)² / (r² + 0.01)",
        source: "Rousselle et al. 2011",
    },
    Description {
        metric: Metric::Mae,
        key: "mae",
        label: "MAE",
        unit: "L",
        lower_is_better: true,
        formula: "mean over pixels and channels of |x − r|",
        source: "common",
    },
    Description {
        metric: Metric::Smape,
        key: "smape",
        label: "SMAPE",
        unit: "",
        lower_is_better: true,
        formula: "mean over pixels and channels of 2 |x − r| / (|x| + |r|), 0 where both are 0",
        source: "Vogels et al. 2018, doubled",
    },
    Description {
        metric: Metric::Flip,
        key: "flip",
        label: "HDR-FLIP",
        unit: "",
        lower_is_better: true,
        formula: "mean over pixels of the largest LDR-FLIP over the reference's exposures, ACES curve, 67 pixels a degree",
        source: "Andersson et al. 2021",
    },
    Description {
        metric: Metric::LdrFlip,
        key: "ldr-flip",
        label: "LDR-FLIP",
        unit: "",
        lower_is_better: true,
        formula: "mean over pixels of FLIP of the images clamped to [0, 1], 67 pixels a degree",
        source: "Andersson et al. 2020",
    },
];

/// What a metric says about an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// The value for the whole image.
    pub value: f64,
    /// The error of each pixel, the mean over its channels; its mean is the value (up to rounding).
    pub map: ScalarImage,
}

impl Metric {
    /// The metric's row of the table.
    pub fn description(self) -> &'static Description {
        &TABLE[self as usize]
    }

    /// The metric of that key.
    pub fn from_key(key: &str) -> Result<Self> {
        if let Some(row) = TABLE.iter().find(|row| row.key == key) {
            return Ok(row.metric);
        }
        let keys: Vec<&str> = TABLE.iter().map(|row| row.key).collect();
        Err(Error::usage(format!("there is no metric `{key}`; {}", allowed("metric", key, &keys))))
    }

    /// The metric's value and error map. Errors as the module says.
    pub fn measure(self, image: &Image, reference: &Image) -> Result<Measurement> {
        check(image, reference)?;
        Ok(match self {
            Self::Mse => pointwise(image, reference, mse::error),
            Self::RelMse => pointwise(image, reference, relmse::error),
            Self::Mae => pointwise(image, reference, mae::error),
            Self::Smape => pointwise(image, reference, smape::error),
            Self::Flip => from_map(flip::hdr(image, reference)),
            Self::LdrFlip => from_map(flip::ldr(image, reference)),
        })
    }

    /// What the noise of the reference alone adds to the metric: subtract it from a value to estimate the error
    /// against the true image. `variance` is that of the reference's pixels, i.e. of the mean over its samples.
    ///
    /// `None` for a metric to which the reference's variance does not simply add up. For relMSE the noise of the
    /// denominator is left out, which is of higher order in the noise.
    pub fn reference_noise(self, reference: &Image, variance: &Image) -> Result<Option<f64>> {
        check(variance, reference)?;
        let mean = |f: fn(f64, f64) -> f64| Some(pointwise(variance, reference, f).value);
        Ok(match self {
            Self::Mse => mean(|v, _| v),
            Self::RelMse => mean(|v, r| v / (r * r + relmse::EPSILON)),
            Self::Mae | Self::Smape | Self::Flip | Self::LdrFlip => None,
        })
    }
}

/// Refuses what no metric can be computed of.
fn check(image: &Image, reference: &Image) -> Result<()> {
    image.check_same_size(reference)?;
    if image.pixels.is_empty() {
        return Err(Error::usage("images without pixels cannot be compared"));
    }
    for (what, which) in [("image", image), ("reference", reference)] {
        let bad = which.count_non_finite();
        if bad > 0 {
            let all = which.pixels.len();
            return Err(Error::usage(format!(
                "the {what} has NaN or infinite values in {bad} of its {all} pixels; it cannot be compared"
            )));
        }
    }
    Ok(())
}

/// The mean of `error(x, r)` over pixels and channels, summed in f64, and its map.
fn pointwise(image: &Image, reference: &Image, error: fn(f64, f64) -> f64) -> Measurement {
    let mut sum = 0.0;
    let mut values = Vec::with_capacity(image.pixels.len());
    for (x, r) in image.pixels.iter().zip(&reference.pixels) {
        let of_channel = |c: usize| error(f64::from(x[c]), f64::from(r[c]));
        let mean = (of_channel(0) + of_channel(1) + of_channel(2)) / 3.0;
        sum += mean;
        values.push(mean.min(f64::from(f32::MAX)) as f32);
    }
    let map = ScalarImage { width: image.width, height: image.height, values };
    Measurement { value: sum / image.pixels.len() as f64, map }
}

fn from_map(map: ScalarImage) -> Measurement {
    Measurement { value: map.mean(), map }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn images() -> (Image, Image) {
        let image = Image { width: 2, height: 1, pixels: vec![[1.0, 0.0, 3.0], [0.0, 0.0, 0.0]] };
        let reference = Image { width: 2, height: 1, pixels: vec![[2.0, 0.0, 1.0], [0.0, 0.1, 0.0]] };
        (image, reference)
    }

    #[test]
    fn the_table_is_in_the_order_of_the_enum_with_unique_keys() {
        for (index, row) in TABLE.iter().enumerate() {
            assert_eq!(row.metric as usize, index);
            assert_eq!(Metric::from_key(row.key).unwrap(), row.metric);
            assert_eq!(row.metric.description(), row);
        }
        let message = Metric::from_key("relmsa").unwrap_err().to_string();
        assert!(message.contains("did you mean `relmse`"), "{message}");
    }

    #[test]
    fn values_by_hand() {
        let (x, r) = images();
        let near = |metric: Metric, expected: f64| {
            let measured = metric.measure(&x, &r).unwrap();
            assert!((measured.value - expected).abs() < 1e-7, "{metric:?} {}", measured.value);
            assert!((measured.map.mean() - measured.value).abs() < 1e-6, "{metric:?}");
        };
        near(Metric::Mse, (1.0 + 4.0 + 0.01) / 6.0);
        near(Metric::RelMse, (1.0 / 4.01 + 4.0 / 1.01 + 0.01 / 0.02) / 6.0);
        near(Metric::Mae, (1.0 + 2.0 + 0.1) / 6.0);
        near(Metric::Smape, (2.0 / 3.0 + 1.0 + 2.0) / 6.0);
        let map = Metric::Mae.measure(&x, &r).unwrap().map;
        assert_eq!(map.values, [1.0, 0.1 / 3.0]);
    }

    #[test]
    fn an_image_has_no_error_against_itself() {
        let image = Image::from_fn(24, 17, |x, y| [x as f32 * 0.1, y as f32, (x * y) as f32 * 0.01]);
        for row in TABLE {
            let measured = row.metric.measure(&image, &image).unwrap();
            assert_eq!(measured.value, 0.0, "{}", row.key);
            assert!(measured.map.values.iter().all(|v| *v == 0.0), "{}", row.key);
        }
    }

    #[test]
    fn nan_and_sizes_are_refused_with_the_count() {
        let (mut x, r) = images();
        x.pixels[1][2] = f32::NAN;
        for row in TABLE {
            let message = row.metric.measure(&x, &r).unwrap_err().to_string();
            assert!(message.contains("image has NaN") && message.contains("1 of its 2"), "{message}");
            let message = row.metric.measure(&r, &x).unwrap_err().to_string();
            assert!(message.contains("reference has NaN"), "{message}");
            let message = row.metric.measure(&r, &Image::new(1, 2)).unwrap_err().to_string();
            assert!(message.contains("2x1") && message.contains("1x2"), "{message}");
            assert!(row.metric.measure(&Image::new(0, 0), &Image::new(0, 0)).is_err());
        }
    }

    #[test]
    fn the_references_noise_is_what_it_adds() {
        // References of the true image 1 ± 0.1 with equal frequency: the variance is 0.01.
        let sign = |x: usize, y: usize| if (x + y).is_multiple_of(2) { 0.1 } else { -0.1 };
        let truth = Image::from_fn(8, 8, |_, _| [1.0; 3]);
        let reference = Image::from_fn(8, 8, |x, y| [1.0 + sign(x, y); 3]);
        let variance = Image::from_fn(8, 8, |_, _| [0.01; 3]);
        for (metric, tolerance) in [(Metric::Mse, 1e-8), (Metric::RelMse, 1e-8)] {
            let noise = metric.reference_noise(&reference, &variance).unwrap().unwrap();
            let measured = metric.measure(&truth, &reference).unwrap().value;
            assert!((noise - measured).abs() < tolerance, "{metric:?} {noise} {measured}");
        }
        assert_eq!(Metric::Flip.reference_noise(&reference, &variance).unwrap(), None);
        assert!(Metric::Mse.reference_noise(&reference, &Image::new(1, 1)).is_err());
    }

    #[test]
    fn huge_values_stay_finite() {
        let huge = Image { width: 1, height: 1, pixels: vec![[f32::MAX; 3]] };
        for row in TABLE {
            for (x, r) in [(&huge, &Image::new(1, 1)), (&Image::new(1, 1), &huge)] {
                let measured = row.metric.measure(x, r).unwrap();
                assert!(measured.value.is_finite() && measured.map.values[0].is_finite(), "{}", row.key);
            }
        }
    }
}
