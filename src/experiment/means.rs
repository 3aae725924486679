//! Means over the runs of a cell: of images and layers, and of error maps.

use crate::film::accumulator::mean_weight;
use crate::film::exr::{Layer, LayeredImage};
use crate::film::{Film, Image, ScalarImage};
use crate::render::files::{RUNS, VARIANCE};
use std::collections::BTreeMap;

/// Error maps as the layers of a file, by the metrics' keys.
pub(super) fn mean_of_maps(maps: &BTreeMap<String, ScalarImage>) -> LayeredImage {
    let image = |map: &ScalarImage| Image {
        width: map.width,
        height: map.height,
        pixels: map.values.iter().map(|v| [*v; 3]).collect(),
    };
    let layers: Vec<Layer> =
        maps.iter().map(|(key, map)| Layer { name: key.clone(), image: image(map) }).collect();
    let (width, height) = (layers[0].image.width, layers[0].image.height);
    LayeredImage { width, height, origin: [0, 0], full_size: [width, height], layers, metadata: Vec::new() }
}

/// Layers of several runs, added up.
#[derive(Default)]
pub(super) struct MeanLayers {
    runs: u32,
    /// The first run's, for all but the pixels.
    shape: Option<LayeredImage>,
    sums: Vec<Vec<[f64; 3]>>,
    /// Of each layer of mean weights, by its name: sum of the weights and number of samples, pixel by pixel.
    weights: BTreeMap<String, Vec<[f64; 2]>>,
}

impl MeanLayers {
    /// Adds a run: its layers, and its film for the weights, whose mean is over all samples.
    pub fn add(&mut self, file: LayeredImage, film: &Film) {
        for (kind, weights) in film.weights() {
            match self.weights.get_mut(&kind.name()) {
                None => drop(self.weights.insert(kind.name(), weights)),
                Some(sums) => {
                    sums.iter_mut().zip(weights).for_each(|(s, w)| *s = [s[0] + w[0], s[1] + w[1]]);
                }
            }
        }
        let wide = |p: &[f32; 3]| p.map(f64::from);
        self.runs += 1;
        let Some(shape) = &mut self.shape else {
            self.sums = file.layers.iter().map(|l| l.image.pixels.iter().map(wide).collect()).collect();
            self.shape = Some(file);
            return;
        };
        // A run of a single iteration has no variance: then the mean has none either.
        let keep: Vec<bool> = shape.layers.iter().map(|l| file.layer(&l.name).is_some()).collect();
        let mut flags = keep.iter();
        shape.layers.retain(|_| *flags.next().expect("one a layer"));
        let mut flags = keep.iter();
        self.sums.retain(|_| *flags.next().expect("one a layer"));
        for (layer, sum) in shape.layers.iter().zip(&mut self.sums) {
            let image = file.layer(&layer.name).expect("kept only where it is there");
            for (s, p) in sum.iter_mut().zip(&image.pixels) {
                (0..3).for_each(|c| s[c] += f64::from(p[c]));
            }
        }
    }

    /// The means; of variances, the variance of the mean; of weights, the mean over the samples of all runs.
    pub fn finish(&self) -> LayeredImage {
        let mut file = self.shape.clone().expect("there is at least one run");
        let runs = f64::from(self.runs);
        for (layer, sum) in file.layers.iter_mut().zip(&self.sums) {
            let scale = if layer.name == VARIANCE { 1.0 / (runs * runs) } else { 1.0 / runs };
            layer.image.pixels = match self.weights.get(&layer.name) {
                Some(sums) => sums.iter().map(|[w, n]| [mean_weight(*w, *n) as f32; 3]).collect(),
                None => sum.iter().map(|p| p.map(|v| (v * scale) as f32)).collect(),
            };
        }
        file.metadata.push((RUNS.into(), self.runs.to_string()));
        file
    }
}
