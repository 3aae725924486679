//! The filters of FLIP: contrast sensitivity and feature detection, as sums of separable kernels.

use rayon::prelude::*;
use std::f32::consts::PI;

/// One value a pixel, row by row.
pub type Plane = Vec<f32>;

/// Width and height of planes.
#[derive(Clone, Copy)]
pub struct Size {
    pub width: usize,
    pub height: usize,
}

/// A Gaussian of standard deviation `sigma` pixels over −radius..=radius, not normalised.
fn gaussian(sigma: f32, radius: usize) -> Vec<f32> {
    offsets(radius).map(|x| (-0.5 * (x / sigma).powi(2)).exp()).collect()
}

fn offsets(radius: usize) -> impl Iterator<Item = f32> {
    (0..=2 * radius).map(move |i| i as f32 - radius as f32)
}

/// Scales positive weights to the sum 1 and negative ones to the sum −1.
fn normalise_by_sign(kernel: &mut [f32]) {
    let positive: f32 = kernel.iter().filter(|v| **v > 0.0).sum();
    let negative: f32 = kernel.iter().filter(|v| **v < 0.0).sum();
    for v in kernel {
        *v /= if *v > 0.0 {
            positive
        } else if *v < 0.0 {
            -negative
        } else {
            1.0
        };
    }
}

/// The contrast sensitivity of one channel of YCxCz [Andersson et al. 2020 (table 1)]: Gaussians in space.
pub struct Sensitivity {
    /// Share of the whole, and the normalised kernel that is applied along rows and columns.
    terms: Vec<(f32, Vec<f32>)>,
}

impl Sensitivity {
    /// From (a, b) of each Gaussian a √(π/b) exp(−π² x² / b), x in degrees. The paper takes one radius for all
    /// channels, which the widest of them sets at three standard deviations; beyond six of its own a narrower
    /// Gaussian has no weight left in single precision.
    fn new(parameters: &[(f32, f32)], pixels_per_degree: f32) -> Self {
        let sigma = |b: f32| (b / (2.0 * PI * PI)).sqrt() * pixels_per_degree;
        let widest = (3.0 * sigma(0.04)).ceil() as usize;
        let mut terms = Vec::new();
        for &(a, b) in parameters {
            let radius = widest.min((6.0 * sigma(b)).ceil() as usize);
            let mut kernel = gaussian(sigma(b), radius);
            let sum: f32 = kernel.iter().sum();
            kernel.iter_mut().for_each(|v| *v /= sum);
            terms.push((a * (PI / b).sqrt() * sum * sum, kernel));
        }
        let whole: f32 = terms.iter().map(|(share, _)| share).sum();
        terms.iter_mut().for_each(|(share, _)| *share /= whole);
        Self { terms }
    }

    /// For luminance, red-green and blue-yellow.
    pub fn channels(pixels_per_degree: f32) -> [Self; 3] {
        [
            Self::new(&[(1.0, 0.0047)], pixels_per_degree),
            Self::new(&[(1.0, 0.0053)], pixels_per_degree),
            Self::new(&[(34.1, 0.04), (13.5, 0.025)], pixels_per_degree),
        ]
    }

    /// The channel as an observer resolves it.
    pub fn apply(&self, plane: &[f32], size: Size) -> Plane {
        let mut total = vec![0.0; plane.len()];
        for (share, kernel) in &self.terms {
            let filtered = columns(&rows(plane, size, kernel), size, kernel);
            total.iter_mut().zip(&filtered).for_each(|(t, f)| *t += share * f);
        }
        total
    }
}

/// The detectors of edges and points: derivatives of a Gaussian as wide as the features that an eye finds.
pub struct Features {
    smooth: Vec<f32>,
    first: Vec<f32>,
    second: Vec<f32>,
}

impl Features {
    /// For features of 0.082 degrees [Andersson et al. 2020 (section 4.2)].
    pub fn new(pixels_per_degree: f32) -> Self {
        let sigma = 0.5 * 0.082 * pixels_per_degree;
        let radius = (3.0 * sigma).ceil() as usize;
        let mut smooth = gaussian(sigma, radius);
        let weighted = |f: &dyn Fn(f32) -> f32| -> Vec<f32> {
            let mut kernel: Vec<f32> = offsets(radius).zip(&smooth).map(|(x, g)| f(x) * g).collect();
            normalise_by_sign(&mut kernel);
            kernel
        };
        let first = weighted(&|x| -x);
        let second = weighted(&|x| (x / sigma).powi(2) - 1.0);
        normalise_by_sign(&mut smooth);
        Self { smooth, first, second }
    }

    /// The strengths of edges and of points in a plane of relative luminance.
    pub fn strengths(&self, plane: &[f32], size: Size) -> (Plane, Plane) {
        let smooth = rows(plane, size, &self.smooth);
        let magnitude = |kernel: &[f32]| {
            let along_rows = columns(&rows(plane, size, kernel), size, &self.smooth);
            let mut strength = columns(&smooth, size, kernel);
            strength.iter_mut().zip(&along_rows).for_each(|(s, a)| *s = s.hypot(*a));
            strength
        };
        (magnitude(&self.first), magnitude(&self.second))
    }
}

/// Filters each row; beyond its ends a row goes on as its last pixel.
fn rows(plane: &[f32], size: Size, kernel: &[f32]) -> Plane {
    let radius = kernel.len() / 2;
    let mut out = vec![0.0; plane.len()];
    out.par_chunks_mut(size.width).zip(plane.par_chunks(size.width)).for_each_init(
        Vec::new,
        |padded, (out, row)| {
            padded.clear();
            padded.resize(radius, row[0]);
            padded.extend_from_slice(row);
            padded.resize(radius + row.len() + radius, row[row.len() - 1]);
            for (k, weight) in kernel.iter().enumerate() {
                out.iter_mut().zip(&padded[k..]).for_each(|(o, v)| *o += weight * v);
            }
        },
    );
    out
}

/// Filters each column; beyond its ends a column goes on as its last pixel.
fn columns(plane: &[f32], size: Size, kernel: &[f32]) -> Plane {
    let radius = kernel.len() / 2;
    let mut out = vec![0.0; plane.len()];
    out.par_chunks_mut(size.width).enumerate().for_each(|(y, out)| {
        for (k, weight) in kernel.iter().enumerate() {
            let source = (y + k).saturating_sub(radius).min(size.height - 1);
            let row = &plane[source * size.width..][..size.width];
            out.iter_mut().zip(row).for_each(|(o, v)| *o += weight * v);
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensitivity_keeps_a_constant_and_features_find_none() {
        let size = Size { width: 9, height: 5 };
        let plane = vec![0.7; 45];
        for channel in Sensitivity::channels(67.0) {
            assert!(channel.apply(&plane, size).iter().all(|v| (v - 0.7).abs() < 1e-5));
        }
        let (edges, points) = Features::new(67.0).strengths(&plane, size);
        assert!(edges.iter().chain(&points).all(|v| v.abs() < 1e-5));
    }

    #[test]
    fn a_step_is_an_edge_of_its_height_in_either_direction() {
        let size = Size { width: 40, height: 40 };
        let horizontal: Plane = (0..1600).map(|i| if i % 40 < 20 { 0.0 } else { 1.0 }).collect();
        let vertical: Plane = (0..1600).map(|i| if i / 40 < 20 { 0.0 } else { 1.0 }).collect();
        for plane in [horizontal, vertical] {
            let (edges, _) = Features::new(67.0).strengths(&plane, size);
            let strongest = edges.iter().copied().fold(0.0, f32::max);
            // The weights on one side of the centre sum to 1, so the pixel at the step sees its whole height.
            assert!((strongest - 1.0).abs() < 1e-4, "{strongest}");
            assert!(edges[20 * 40 + 2].min(edges[2 * 40 + 20]) < 1e-5);
        }
    }
}
