//! An image in memory: linear RGB, and maps of one value a pixel.

use crate::error::{Error, Result};
use crate::math::{Rgb, RgbExt};

/// Linear RGB (Rec. 709 primaries), rows from the top, each from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` pixels; row 0 is the top one.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// A black image.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![[0.0; 3]; width * height] }
    }

    /// An image whose pixel at column `x` and row `y` is `f(x, y)`.
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> [f32; 3]) -> Self {
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            pixels.extend((0..width).map(|x| f(x, y)));
        }
        Self { width, height, pixels }
    }

    /// The pixel at column `x` and row `y`.
    ///
    /// # Panics
    /// Outside the image.
    pub fn get(&self, x: usize, y: usize) -> [f32; 3] {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) is outside {}", self.size_text());
        self.pixels[y * self.width + x]
    }

    /// The mean of each channel over the pixels; NaN for an image without pixels.
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for pixel in &self.pixels {
            for (s, v) in sum.iter_mut().zip(pixel) {
                *s += f64::from(*v);
            }
        }
        sum.map(|s| s / self.pixels.len() as f64)
    }

    /// How many pixels have a channel that is NaN or infinite.
    pub fn count_non_finite(&self) -> usize {
        self.pixels.iter().filter(|p| p.iter().any(|v| !v.is_finite())).count()
    }

    /// Relative luminance, pixel by pixel.
    pub fn luminance(&self) -> ScalarImage {
        let values = self.pixels.iter().map(|p| Rgb::from_array(*p).luminance()).collect();
        ScalarImage { width: self.width, height: self.height, values }
    }

    /// The rectangle of `width`×`height` pixels whose top left one is (`x`, `y`); an error where it does not
    /// lie inside the image.
    pub fn crop(&self, x: usize, y: usize, width: usize, height: usize) -> Result<Self> {
        let inside = |start: usize, length: usize, whole: usize| {
            start.checked_add(length).is_some_and(|end| end <= whole)
        };
        if !inside(x, width, self.width) || !inside(y, height, self.height) {
            return Err(Error::usage(format!(
                "a crop of {width}x{height} at ({x}, {y}) does not lie inside an image of {}",
                self.size_text()
            )));
        }
        let rows = (y..y + height).flat_map(|row| {
            let start = row * self.width + x;
            self.pixels[start..start + width].iter().copied()
        });
        Ok(Self { width, height, pixels: rows.collect() })
    }

    /// An error unless both images have the same width and height.
    pub fn check_same_size(&self, other: &Self) -> Result<()> {
        if (self.width, self.height) == (other.width, other.height) {
            return Ok(());
        }
        Err(Error::usage(format!(
            "images of different sizes cannot be compared: {} and {}",
            self.size_text(),
            other.size_text()
        )))
    }

    /// `512x256`, for messages.
    pub fn size_text(&self) -> String {
        format!("{}x{}", self.width, self.height)
    }
}

/// One value a pixel: an error map, a luminance, a count.
#[derive(Clone, Debug, PartialEq)]
pub struct ScalarImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` values; row 0 is the top one.
    pub values: Vec<f32>,
}

impl ScalarImage {
    /// The mean value; NaN for a map without pixels.
    pub fn mean(&self) -> f64 {
        self.values.iter().map(|v| f64::from(*v)).sum::<f64>() / self.values.len() as f64
    }

    /// The largest finite value; 0 where there is none.
    pub fn max(&self) -> f32 {
        let finite = self.values.iter().copied().filter(|v| v.is_finite());
        finite.reduce(f32::max).unwrap_or(0.0)
    }

    /// The value that the share `q` in [0, 1] of the finite values does not exceed (nearest rank); 0 where
    /// there is none. The 0.99 quantile makes a better white point for an error map than its maximum.
    pub fn quantile(&self, q: f64) -> f32 {
        let mut sorted: Vec<f32> = self.values.iter().copied().filter(|v| v.is_finite()).collect();
        if sorted.is_empty() {
            return 0.0;
        }
        let rank = (q.clamp(0.0, 1.0) * sorted.len() as f64).ceil() as usize;
        let index = rank.clamp(1, sorted.len()) - 1;
        *sorted.select_nth_unstable_by(index, f32::total_cmp).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered() -> Image {
        Image::from_fn(3, 2, |x, y| [x as f32, y as f32, 1.0])
    }

    #[test]
    fn rows_run_from_the_top() {
        let image = numbered();
        assert_eq!(image.pixels[4], [1.0, 1.0, 1.0]);
        assert_eq!(image.get(2, 1), [2.0, 1.0, 1.0]);
        assert_eq!(image.mean(), [1.0, 0.5, 1.0]);
    }

    #[test]
    fn crops_and_refuses_what_lies_outside() {
        let crop = numbered().crop(1, 1, 2, 1).unwrap();
        assert_eq!(crop.pixels, vec![[1.0, 1.0, 1.0], [2.0, 1.0, 1.0]]);
        assert!(numbered().crop(2, 0, 2, 1).is_err());
        assert!(numbered().crop(usize::MAX, 0, 2, 1).is_err());
    }

    #[test]
    fn counts_pixels_that_are_not_finite_once() {
        let mut image = numbered();
        image.pixels[1] = [f32::NAN, f32::INFINITY, 0.0];
        image.pixels[3] = [0.0, 0.0, f32::NEG_INFINITY];
        assert_eq!(image.count_non_finite(), 2);
    }

    #[test]
    fn quantiles_pass_over_nan() {
        let values = vec![4.0, f32::NAN, 1.0, 3.0, 2.0];
        let map = ScalarImage { width: 5, height: 1, values };
        assert_eq!(map.quantile(0.5), 2.0);
        assert_eq!(map.quantile(1.0), 4.0);
        assert_eq!(map.quantile(0.0), 1.0);
        assert_eq!(map.max(), 4.0);
    }
}
