//! Blocks of iterations of a reference, and the whole that they make up.

use crate::film::Image;
use crate::film::exr::LayeredImage;
use crate::render::Spent;
use crate::render::files::VARIANCE;

/// Some iterations of a render.
pub(super) struct Block {
    /// How many.
    pub iterations: u64,
    /// Seconds that they took.
    pub seconds: f64,
    mean: Image,
    /// Of the mean; none for a single iteration.
    variance: Option<Image>,
}

impl Block {
    /// Of a block's file with so many iterations, which took so long.
    pub fn of(file: &LayeredImage, iterations: u64, seconds: f64) -> Self {
        let mean = file.layer("").expect("checked by the readers, and there in what was rendered").clone();
        let variance = file.layer(VARIANCE).filter(|_| iterations > 1).cloned();
        Self { iterations, seconds, mean, variance }
    }
}

/// Blocks put together [Chan et al. 1979].
pub(super) struct Sum {
    size: (usize, usize),
    /// Iterations of all blocks.
    pub iterations: u64,
    /// Seconds of all blocks.
    pub seconds: f64,
    mean: Vec<[f64; 3]>,
    /// Sum of the squared deviations of the iterations from their mean.
    deviations: Vec<[f64; 3]>,
}

impl Sum {
    /// Nothing yet.
    pub fn new(size: (usize, usize)) -> Self {
        let pixels = vec![[0.0; 3]; size.0 * size.1];
        Self { size, iterations: 0, seconds: 0.0, mean: pixels.clone(), deviations: pixels }
    }

    /// How many pixels it has.
    pub fn pixels(&self) -> usize {
        self.mean.len()
    }

    /// What its blocks used up.
    pub fn spent(&self) -> Spent {
        Spent::new(self.iterations, self.seconds)
    }

    /// Adds a block.
    pub fn add(&mut self, block: &Block) {
        let (a, b) = (self.iterations as f64, block.iterations as f64);
        let n = a + b;
        for (i, pixel) in block.mean.pixels.iter().enumerate() {
            for (c, value) in pixel.iter().enumerate() {
                let variance = block.variance.as_ref().map_or(0.0, |v| f64::from(v.pixels[i][c]));
                let step = f64::from(*value) - self.mean[i][c];
                // The variance of a mean of b iterations is their squared deviations over b (b − 1).
                self.deviations[i][c] += variance * b * (b - 1.0) + step * step * a * b / n;
                self.mean[i][c] += step * b / n;
            }
        }
        self.iterations += block.iterations;
        self.seconds += block.seconds;
    }

    /// The mean, and the variance of the mean.
    pub fn images(&self) -> (Image, Image) {
        let n = self.iterations as f64;
        let image = |pixels: &[[f64; 3]], scale: f64| Image {
            width: self.size.0,
            height: self.size.1,
            pixels: pixels.iter().map(|p| p.map(|v| (v * scale) as f32)).collect(),
        };
        (image(&self.mean, 1.0), image(&self.deviations, 1.0 / (n * (n - 1.0)).max(1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::{Stream, StreamKind};

    /// Mean and variance of the mean over values.
    fn block(values: &[f32]) -> Block {
        let n = values.len() as f64;
        let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
        let squares = values.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>();
        let image = |v: f64| Image { width: 1, height: 1, pixels: vec![[v as f32; 3]] };
        let variance = (n > 1.0).then(|| image(squares / (n * (n - 1.0))));
        Block { iterations: values.len() as u64, seconds: n, mean: image(mean), variance }
    }

    #[test]
    fn blocks_of_any_length_add_up_to_the_whole() {
        let mut stream = Stream::new(1, 0, StreamKind::Other, 0);
        let values: Vec<f32> = (0..100).map(|_| stream.next_1d()).collect();
        let whole = block(&values);
        let mut sum = Sum::new((1, 1));
        for part in [&values[..1], &values[1..2], &values[2..50], &values[50..]] {
            sum.add(&block(part));
        }
        let (mean, variance) = sum.images();
        assert_eq!(sum.iterations, 100);
        assert!((mean.pixels[0][0] - whole.mean.pixels[0][0]).abs() < 1e-6);
        let expected = whole.variance.unwrap().pixels[0][0];
        assert!((variance.pixels[0][0] / expected - 1.0).abs() < 1e-5, "{variance:?} {expected}");
    }
}
