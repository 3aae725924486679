//! `tyndall compare IMAGE.exr REFERENCE.exr [--json]`: every metric of an image against its reference.

use crate::error::{Error, Result};
use crate::experiment::metrics::{Metric, TABLE};
use crate::film::exr::{read_layers, read_rgb};
use crate::film::{Image, exr::LayeredImage};
use serde::{Serialize, Serializer};
use std::fmt;
use std::path::Path;

/// The layer of a reference that holds the variance of each pixel's mean.
const VARIANCE_LAYER: &str = "variance";

/// What a metric says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// Which metric.
    pub metric: Metric,
    /// Its value for the whole image.
    pub value: f64,
    /// What the reference's own noise adds to the value; `None` where the reference's variance is not known, or
    /// the metric is not one to which it adds up.
    pub reference_noise: Option<f64>,
}

impl Value {
    /// Whether more than half of the value is the reference's own noise; not where the images are equal, and none of it is.
    pub fn is_dominated_by_reference(&self) -> bool {
        self.value != 0.0 && self.reference_noise.is_some_and(|noise| noise > 0.5 * self.value)
    }
}

/// An image against its reference. As JSON:
///
/// ```text
/// { "width": 64, "height": 48,
///   "metrics": { "mse": 0.1, … },           a key a metric, see the table of metrics
///   "reference_noise": { "mse": 0.01, … },  the metrics for which it is known
///   "mean": { "image": [R, G, B], "reference": [R, G, B], "bias": [R, G, B], "relative_bias": x } }
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Columns of both images.
    pub width: usize,
    /// Rows of both images.
    pub height: usize,
    /// Every metric, in the order of the table.
    #[serde(flatten, serialize_with = "serialize_values")]
    pub values: Vec<Value>,
    /// The means of both images.
    pub mean: Means,
}

/// The means of the image and its reference over all pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Means {
    /// Of the image, each channel.
    pub image: [f64; 3],
    /// Of the reference, each channel.
    pub reference: [f64; 3],
    /// Image minus reference, each channel.
    pub bias: [f64; 3],
    /// The mean over the channels of the bias, divided by that of the reference; `None` where the latter is 0.
    pub relative_bias: Option<f64>,
}

impl Comparison {
    /// Whether no pixel differs.
    pub fn are_equal(&self) -> bool {
        self.values.iter().any(|v| v.metric == Metric::Mae && v.value == 0.0)
    }
}

fn serialize_values<S: Serializer>(values: &[Value], serializer: S) -> Result<S::Ok, S::Error> {
    use serde::ser::SerializeMap;
    let metrics = values.iter().map(|v| (v.metric.description().key, v.value.into()));
    let noise = values.iter().filter_map(|v| Some((v.metric.description().key, v.reference_noise?.into())));
    let object = |entries: Vec<(&str, serde_json::Value)>| -> serde_json::Map<String, serde_json::Value> {
        entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    };
    let mut map = serializer.serialize_map(Some(2))?;
    map.serialize_entry("metrics", &object(metrics.collect()))?;
    map.serialize_entry("reference_noise", &object(noise.collect()))?;
    map.end()
}

/// Every metric of `image` against `reference`. An error where the sizes differ, there is no pixel, or one has
/// NaN or infinite values.
pub fn compare(image: &Image, reference: &Image) -> Result<Comparison> {
    compare_with_variance(image, reference, None)
}

/// [`compare`] with the variance of each pixel's mean in the reference, where it is known.
pub fn compare_with_variance(
    image: &Image,
    reference: &Image,
    variance: Option<&Image>,
) -> Result<Comparison> {
    let value = |metric: Metric| {
        let noise = variance.map(|v| metric.reference_noise(reference, v)).transpose()?;
        let value = metric.measure(image, reference)?.value;
        Ok(Value { metric, value, reference_noise: noise.flatten() })
    };
    let values = TABLE.iter().map(|row| value(row.metric)).collect::<Result<_>>()?;
    let (of_image, of_reference) = (image.mean(), reference.mean());
    let bias = [0, 1, 2].map(|c| of_image[c] - of_reference[c]);
    let whole: f64 = of_reference.iter().sum();
    let relative_bias = (whole != 0.0).then(|| bias.iter().sum::<f64>() / whole);
    let mean = Means { image: of_image, reference: of_reference, bias, relative_bias };
    Ok(Comparison { width: image.width, height: image.height, values, mean })
}

/// [`compare`] of the default layers of two EXR files. A layer `variance` in the reference's file is taken to be
/// the variance of each pixel's mean.
pub fn compare_files(image: impl AsRef<Path>, reference: impl AsRef<Path>) -> Result<Comparison> {
    let (image_path, reference_path) = (image.as_ref(), reference.as_ref());
    let image = read_rgb(image_path)?;
    let file: LayeredImage = read_layers(reference_path)?;
    let Some(reference) = file.layer("") else {
        // The same file again, for its message on which channels there are.
        return Err(read_rgb(reference_path)
            .err()
            .unwrap_or_else(|| Error::file(reference_path, "changed while it was read")));
    };
    compare_with_variance(&image, reference, file.layer(VARIANCE_LAYER)).map_err(|e| {
        Error::usage(format!("{} against {}: {e}", image_path.display(), reference_path.display()))
    })
}

/// A table for people; ends in a line break.
impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "{}x{} pixels", self.width, self.height)?;
        if self.are_equal() {
            writeln!(f, "the images are equal")?;
        }
        let any_noise = self.values.iter().any(|v| v.reference_noise.is_some());
        let noise_title = if any_noise { "  of that the reference's noise" } else { "" };
        writeln!(f, "\n{:<10} {:>13} {:<4}{noise_title}", "metric", "value", "unit")?;
        for v in &self.values {
            let row = v.metric.description();
            let mut line = format!("{:<10} {:>13} {:<4}", row.label, number(v.value), row.unit);
            if let Some(noise) = v.reference_noise {
                line += &format!("  {:>13}", number(noise));
            }
            if v.is_dominated_by_reference() {
                line += "  most of it: the reference is too noisy";
            }
            writeln!(f, "{}", line.trim_end())?;
        }
        writeln!(f, "\n{:<10} {:>13} {:>13} {:>13}", "mean", "R", "G", "B")?;
        let means =
            [("image", self.mean.image), ("reference", self.mean.reference), ("bias", self.mean.bias)];
        for (name, [r, g, b]) in means {
            writeln!(f, "{name:<10} {:>13} {:>13} {:>13}", number(r), number(g), number(b))?;
        }
        match self.mean.relative_bias {
            Some(bias) => {
                writeln!(f, "the image is {:+.4}% of the reference's mean away from it", 100.0 * bias)
            }
            None => writeln!(f, "the reference's mean is 0"),
        }
    }
}

/// Six significant digits.
fn number(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.5e}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::exr;

    fn images() -> (Image, Image) {
        let reference = Image::from_fn(8, 6, |x, y| [0.8, x as f32 * 0.1, y as f32]);
        let image = Image::from_fn(8, 6, |x, y| [0.9, x as f32 * 0.1, y as f32]);
        (image, reference)
    }

    #[test]
    fn json_has_every_metric_and_the_bias() {
        let (image, reference) = images();
        let json = serde_json::to_value(compare(&image, &reference).unwrap()).unwrap();
        for row in TABLE {
            assert!(json["metrics"][row.key].as_f64().unwrap() > 0.0, "{}: {json}", row.key);
        }
        assert!((json["metrics"]["mae"].as_f64().unwrap() - 0.1 / 3.0).abs() < 1e-7);
        assert!((json["mean"]["bias"][0].as_f64().unwrap() - 0.1).abs() < 1e-6);
        let relative = 0.1 / (0.8 + 0.35 + 2.5);
        assert!((json["mean"]["relative_bias"].as_f64().unwrap() - relative).abs() < 1e-6, "{json}");
        assert_eq!(json["width"], 8);
    }

    #[test]
    fn the_table_is_aligned_and_complete() {
        let (image, reference) = images();
        let text = compare(&image, &reference).unwrap().to_string();
        for row in TABLE {
            let line = text.lines().find(|l| l.starts_with(row.label)).unwrap();
            let value = line.split_whitespace().nth(1).unwrap();
            assert_eq!(line.find(value).unwrap() + value.len(), 24, "{text}");
        }
        assert!(text.contains("+2.7397%"), "{text}");
        let black = compare(&Image::new(4, 4), &Image::new(4, 4)).unwrap();
        assert_eq!(black.mean.relative_bias, None);
    }

    #[test]
    fn files_are_compared_with_the_references_own_noise() {
        let directory = tempfile::tempdir().unwrap();
        let (a, b) = (directory.path().join("a.exr"), directory.path().join("b.exr"));
        let (image, reference) = images();
        exr::write(&a, &LayeredImage::new(image.clone())).unwrap();
        let mut file = LayeredImage::new(reference);
        file.push(VARIANCE_LAYER, Image::from_fn(8, 6, |_, _| [0.01, 0.0, 0.0]));
        exr::write(&b, &file).unwrap();
        let found = compare_files(&a, &b).unwrap();
        assert!((found.values[0].reference_noise.unwrap() - 0.01 / 3.0).abs() < 1e-8);
        assert!(found.values[0].is_dominated_by_reference());
        assert!(found.to_string().contains("too noisy"));
        assert_eq!(found.values[2].reference_noise, None);
        // An image that is the reference has none of its noise.
        let same = compare_files(&b, &b).unwrap();
        assert!(same.are_equal() && !found.are_equal() && same.values[0].reference_noise > Some(0.0));
        let text = same.to_string();
        assert!(text.contains("the images are equal") && !text.contains("too noisy"), "{text}");
        let mut broken = image;
        broken.pixels[3] = [f32::NAN; 3];
        exr::write(&a, &LayeredImage::new(broken)).unwrap();
        let message = compare_files(&a, &b).unwrap_err().to_string();
        assert!(message.contains("a.exr") && message.contains("1 of its 48"), "{message}");
        let missing = compare_files(directory.path().join("no.exr"), &b).unwrap_err().to_string();
        assert!(missing.contains("no.exr"), "{missing}");
    }

    #[test]
    fn a_reference_without_a_default_layer_says_what_it_has() {
        let directory = tempfile::tempdir().unwrap();
        let (a, b) = (directory.path().join("a.exr"), directory.path().join("b.exr"));
        let (image, reference) = images();
        exr::write(&a, &LayeredImage::new(image)).unwrap();
        let mut file = LayeredImage::new(reference);
        file.layers[0].name = "direct".to_owned();
        exr::write(&b, &file).unwrap();
        let message = compare_files(&a, &b).unwrap_err().to_string();
        assert!(message.contains("b.exr") && message.contains("direct.R"), "{message}");
    }
}
