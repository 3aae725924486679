//! The film: sums over iterations of what each technique contributed to each pixel.

use super::layout::{ImageKind, Layout};
use super::sums::{Part, Sums};
use crate::camera::{Camera, MAX_SIDE};
use crate::film::Image;
use crate::math::{Rgb, RgbExt, prefetch};
use crate::transport::settings::{MAX_LENGTH, Settings};
use crate::transport::technique::Technique;
use rayon::prelude::*;

/// One contribution of one technique to one pixel: the only way into a film.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// The technique that made the path.
    pub technique: Technique,
    /// Vertices of the light subpath.
    pub s: u32,
    /// Vertices of the camera subpath.
    pub t: u32,
    /// f / density as sampled, not weighted, already divided by the number of samples the technique has a pixel.
    pub contribution: Rgb,
    /// The multiple importance sampling weight, in [0, 1].
    pub weight: f32,
}

/// A sample of light tracing: its pixel is not the one being traced, so it is kept until it can be added in order.
/// Packed, as an iteration keeps a few for each light subpath.
#[derive(Clone, Copy, Debug)]
pub struct Splat {
    /// Pixel, counted from the first of its band, and above it s.
    place: u32,
    contribution: [f32; 3],
    weight: f32,
}

/// Bits of a pixel's number in its band.
const PIXEL_BITS: u32 = 20;

const _: () = assert!(size_of::<Splat>() == 20 && MAX_LENGTH < 1 << (32 - PIXEL_BITS));
const _: () = assert!(BAND_ROWS * MAX_SIDE as usize <= 1 << PIXEL_BITS);
const _: () = assert!(Technique::COUNT <= u16::BITS as usize, "a bit each in `Band::touched`");

impl Splat {
    /// The sample, of [`Technique::Lens`], on the pixel with this number in its band.
    #[inline]
    pub fn new(pixel: usize, sample: &Sample) -> Self {
        debug_assert!(sample.technique == Technique::Lens && sample.t == 1, "only the lens splats");
        let place = sample.s << PIXEL_BITS | pixel as u32;
        Self { place, contribution: sample.contribution.to_array(), weight: sample.weight }
    }

    /// The pixel, and what falls on it.
    #[inline]
    pub fn sample(&self) -> (usize, Sample) {
        let Self { place, contribution, weight } = *self;
        let (s, contribution) = (place >> PIXEL_BITS, contribution.into());
        let sample = Sample { technique: Technique::Lens, s, t: 1, contribution, weight };
        ((place & ((1 << PIXEL_BITS) - 1)) as usize, sample)
    }
}

/// Rows in a band: the unit of parallel work on a film. A constant, so that sums never depend on the threads.
pub const BAND_ROWS: usize = 8;

/// Contributions that were dropped as they were not finite, by technique.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped(pub [u64; Technique::COUNT]);

impl Dropped {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }
}

/// Sums over iterations, pixel by pixel, an image a technique (see [`Layout`]).
///
/// The combined image is the sum of the techniques' weighted images, so that their sum is the image to the bit.
#[derive(Clone, Debug)]
pub struct Film {
    layout: Layout,
    /// Origin of the crop window in the full frame, pixels.
    origin: [u32; 2],
    width: usize,
    height: usize,
    pub(super) sums: Sums,
    /// Sum over iterations of the square of the combined image.
    pub(super) squares: Vec<[f64; 3]>,
    /// The largest luminance of the combined image in one iteration, and that iteration, counted in this film.
    pub(super) outliers: Vec<Outlier>,
    pub(super) iterations: u64,
    pub(super) dropped: Dropped,
}

/// What one iteration added most to a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outlier {
    /// Luminance of all that the iteration added.
    pub luminance: f32,
    /// The iteration, from 0.
    pub iteration: u32,
}

impl Film {
    /// An empty film for the camera's crop window.
    pub fn new(camera: &Camera, settings: &Settings) -> Self {
        let crop = camera.crop();
        let (width, height) = (crop.width() as usize, crop.height() as usize);
        let layout = Layout::new(settings);
        let pixels = width * height;
        Self {
            origin: [crop.x0, crop.y0],
            width,
            height,
            sums: Sums::new(&layout, pixels),
            squares: vec![[0.0; 3]; pixels],
            outliers: vec![Outlier::default(); pixels],
            iterations: 0,
            dropped: Dropped::default(),
            layout,
        }
    }

    /// Width and height of the crop window in pixels.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Upper left corner of the crop window in the full frame.
    pub fn origin(&self) -> [u32; 2] {
        self.origin
    }

    /// Which images are kept.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Iterations that are complete.
    pub fn iterations(&self) -> u64 {
        self.iterations
    }

    /// What was dropped as it was not finite.
    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    /// Number of bands.
    pub fn bands(&self) -> usize {
        self.height.div_ceil(BAND_ROWS)
    }

    /// Runs `work`, which is so many iterations, on each band of rows, in parallel. Bands are disjoint and each is worked
    /// through by one thread, so the result does not depend on how many there are.
    pub fn iterate(&mut self, iterations: usize, work: impl Fn(&mut Band) + Sync) {
        let width = self.width;
        let layout = &self.layout;
        let first_iteration = self.iterations as u32;
        let size = BAND_ROWS * width;
        let parts = self.sums.parts(size);
        let pixels = self.squares.par_chunks_mut(size).zip(self.outliers.par_chunks_mut(size));
        let dropped = parts
            .into_par_iter()
            .zip(pixels)
            .enumerate()
            // Else rayon hands out several bands as one, and a thread waits while another has some left.
            .with_max_len(1)
            .map_init(Vec::new, |splats, (index, (sums, (squares, outliers)))| {
                splats.resize(squares.len(), [0.0; 3]);
                let mut band = Band {
                    layout,
                    index,
                    first_row: index * BAND_ROWS,
                    width,
                    first_iteration,
                    iteration: first_iteration,
                    sums,
                    squares,
                    outliers,
                    splats,
                    splatted: false,
                    gathered: [[0.0; 4]; Technique::COUNT],
                    dropped: Dropped::default(),
                };
                work(&mut band);
                band.settle_splats();
                band.dropped
            })
            .reduce(Dropped::default, |a, b| Dropped(std::array::from_fn(|i| a.0[i] + b.0[i])));
        for (total, new) in self.dropped.0.iter_mut().zip(dropped.0) {
            *total += new;
        }
        self.iterations += iterations as u64;
    }

    /// Sum over iterations of the combined image at a pixel (counted along rows).
    fn combined_sum(&self, pixel: usize) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for value in self.sums.weighted(pixel) {
            for c in 0..3 {
                sum[c] += value[c];
            }
        }
        sum
    }

    fn map_pixels(&self, f: impl Fn(usize) -> [f64; 3]) -> Image {
        let pixels = (0..self.width * self.height).map(|i| f(i).map(|v| v as f32)).collect();
        Image { width: self.width, height: self.height, pixels }
    }

    /// The mean over iterations of the combined image; black where there is no iteration yet.
    pub fn image(&self) -> Image {
        let scale = 1.0 / self.iterations.max(1) as f64;
        self.map_pixels(|i| self.combined_sum(i).map(|v| v * scale))
    }

    /// The unbiased estimate of the variance of [`Self::image`], per pixel and channel: the sample variance over
    /// iterations divided by their number. Infinite where there are fewer than two.
    pub fn variance(&self) -> Image {
        let n = self.iterations as f64;
        self.map_pixels(|i| {
            if n < 2.0 {
                return [f64::INFINITY; 3];
            }
            let sum = self.combined_sum(i);
            std::array::from_fn(|c| {
                let mean = sum[c] / n;
                ((self.squares[i][c] / n - mean * mean) / (n - 1.0)).max(0.0)
            })
        })
    }

    /// The images beside the combined one: contributions as means over iterations, mean weights over all samples (see
    /// [`ImageKind::Weight`]) in all three channels.
    pub fn layers(&self) -> Vec<(ImageKind, Image)> {
        self.layers_where(|_| true)
    }

    /// Those of [`Self::layers`] that are wanted.
    pub fn layers_where(&self, wanted: impl Fn(&ImageKind) -> bool) -> Vec<(ImageKind, Image)> {
        let scale = 1.0 / self.iterations.max(1) as f64;
        let kinds = self.layout.images();
        let sum = |i: usize, l: usize| self.sums.get(i, self.layout.place(l));
        let image = |l: usize, kind: &ImageKind| match kind {
            ImageKind::Weight { .. } => self.map_pixels(|i| {
                let [weights, samples, _] = sum(i, l);
                [mean_weight(weights, samples); 3]
            }),
            _ => self.map_pixels(|i| sum(i, l).map(|v| v * scale)),
        };
        let chosen = kinds.iter().enumerate().filter(|(_, kind)| wanted(kind));
        chosen.map(|(l, kind)| (*kind, image(l, kind))).collect()
    }

    /// For each pixel what one iteration added most: its luminance, the number of that iteration, and its share of all that
    /// the pixel got, as R, G and B.
    pub fn outliers(&self) -> Image {
        let image = self.image();
        let pixels = self.outliers.iter().zip(&image.pixels).map(|(outlier, mean)| {
            let whole = Rgb::from_array(*mean).luminance() * self.iterations as f32;
            let share = if whole > 0.0 { outlier.luminance / whole } else { 0.0 };
            [outlier.luminance, outlier.iteration as f32, share]
        });
        Image { width: self.width, height: self.height, pixels: pixels.collect() }
    }

    /// What the mean weights are made of, to put several films together: for each technique, where layers are kept, the sum
    /// of the weights and the number of samples, pixel by pixel.
    pub fn weights(&self) -> Vec<(ImageKind, Vec<[f64; 2]>)> {
        let pixels = self.width * self.height;
        let of = |l: usize| {
            let place = self.layout.place(l);
            (0..pixels).map(move |i| self.sums.get(i, place)).map(|[weights, samples, _]| [weights, samples])
        };
        let kinds = self.layout.images().iter().enumerate();
        let weights = kinds.filter(|(_, k)| matches!(k, ImageKind::Weight { .. }));
        weights.map(|(l, kind)| (*kind, of(l).collect())).collect()
    }
}

/// A few rows of a film, being worked on by one thread.
pub struct Band<'a> {
    layout: &'a Layout,
    /// Number of the band, from the top.
    pub index: usize,
    /// First row in the crop window.
    pub first_row: usize,
    /// Pixels a row.
    pub width: usize,
    /// Numbers in this film of the first iteration of several in one go, and of the one that is under way.
    first_iteration: u32,
    iteration: u32,
    sums: Part<'a>,
    squares: &'a mut [[f64; 3]],
    outliers: &'a mut [Outlier],
    /// Splats on pixels that are not settled yet; black before and after an iteration.
    splats: &'a mut [[f64; 3]],
    /// Whether there are any.
    splatted: bool,
    /// What the pixel that is being traced got, by technique as in the film: most samples fall on one pixel after the other,
    /// and are added up here, where the processor has them at hand. Black between pixels. A fourth number, 0, as the
    /// processor adds two at a time.
    gathered: [[f64; 4]; Technique::COUNT],
    dropped: Dropped,
}

impl Band<'_> {
    /// Rows in it.
    pub fn rows(&self) -> usize {
        self.splats.len() / self.width
    }

    /// Of several iterations in one go the one with this number begins, for some pixels.
    #[inline]
    pub fn begin(&mut self, number: usize) {
        self.iteration = self.first_iteration + number as u32;
    }

    /// Says that [`Self::settle`] will be asked for the pixel `pixel` soon.
    #[inline]
    pub fn expect_pixel(&self, pixel: usize) {
        prefetch(self.squares, pixel);
        prefetch(self.outliers, pixel);
        self.sums.expect_pixel(pixel);
    }

    /// Takes splats, which fall on the band's pixels in no order. All of an iteration, in a few calls, before pixels are settled.
    pub fn record_splats(&mut self, splats: &[Splat]) {
        // What a splat is added to beside the band's own sums, which are at hand, is asked for so many splats before.
        const AHEAD: usize = 16;
        let Some(family) = self.layout.family(Technique::Lens) else { return };
        let layers = self.layout.has_layers();
        let expect = |sums: &Part, next: &Splat| {
            let (pixel, sample) = next.sample();
            sums.expect(pixel, family, self.layout.pair(sample.s, sample.t));
        };
        if layers {
            splats.iter().take(AHEAD).for_each(|next| expect(&self.sums, next));
        }
        self.splatted |= !splats.is_empty();
        for (i, splat) in splats.iter().enumerate() {
            if layers && let Some(next) = splats.get(i + AHEAD) {
                expect(&self.sums, next);
            }
            let (pixel, sample) = splat.sample();
            if let Some(weighted) = self.checked(&sample) {
                let sum = &mut self.splats[pixel];
                sum.iter_mut().zip(weighted.to_array()).for_each(|(sum, v)| *sum += f64::from(v));
                if layers {
                    self.record_layers(pixel, &sample, weighted);
                }
            }
        }
    }

    /// Takes a sample of the pixel `pixel` (counted from the band's first), which becomes part of the film with
    /// [`Self::settle`]. What is not finite is counted and left out.
    #[inline(always)]
    pub fn record(&mut self, pixel: usize, sample: &Sample) {
        let family = self.layout.family(sample.technique);
        debug_assert!(family.is_some(), "only techniques that are on make samples");
        let Some(family) = family else { return };
        if let Some(weighted) = self.checked(sample) {
            let sum = &mut self.gathered[family];
            let [r, g, b] = weighted.to_array().map(f64::from);
            let [x, y, z, w] = *sum;
            *sum = [x + r, y + g, z + b, w];
            if self.layout.has_layers() {
                self.record_layers(pixel, sample, weighted);
            }
        }
    }

    /// Adds the samples since the last call, and the splats on it, to the pixel `pixel`: to its techniques' sums, and what they
    /// come to in all to its variance. Once a pixel and iteration, as its part of the film comes by once then.
    #[inline]
    pub fn settle(&mut self, pixel: usize) {
        if self.splatted
            && let Some(lens) = self.layout.family(Technique::Lens)
        {
            let splats = std::mem::take(&mut self.splats[pixel]);
            self.gathered[lens].iter_mut().zip(splats).for_each(|(sum, v)| *sum += v);
        }
        let mut whole = [0.0; 4];
        // In the order of the film: so the sum of the images is this one to the bit. Also what got nothing: to find out which
        // did would take longer.
        for (sum, gathered) in self.sums.of_pixel(pixel).iter_mut().zip(&mut self.gathered) {
            let gathered = std::mem::take(gathered);
            sum.iter_mut().zip(gathered).for_each(|(sum, v)| *sum += v);
            whole.iter_mut().zip(gathered).for_each(|(sum, v)| *sum += v);
        }
        let [r, g, b, _] = whole;
        self.squares[pixel].iter_mut().zip([r, g, b]).for_each(|(sum, v)| *sum += v * v);
        let luminance = Rgb::new(r as f32, g as f32, b as f32).luminance();
        let outlier = &mut self.outliers[pixel];
        if luminance > outlier.luminance {
            *outlier = Outlier { luminance, iteration: self.iteration };
        }
    }

    /// Settles the pixels with splats that no camera subpath was traced for.
    fn settle_splats(&mut self) {
        debug_assert!(self.gathered.as_flattened().iter().all(|v| *v == 0.0), "all pixels are settled");
        if !self.splatted {
            return;
        }
        for pixel in 0..self.splats.len() {
            if self.splats[pixel] != [0.0; 3] {
                self.settle(pixel);
            }
        }
    }

    /// The weighted contribution, where all of the sample is finite.
    #[inline]
    fn checked(&mut self, sample: &Sample) -> Option<Rgb> {
        // Finite only where both factors are: ∞ · 0 is not.
        let weighted = sample.contribution * sample.weight;
        let finite = weighted.is_finite();
        if !finite {
            self.dropped.0[sample.technique.index()] += 1;
        }
        finite.then_some(weighted)
    }

    /// Adds a sample to what is kept where there are layers. Not inlined: there are many places that record.
    #[inline(never)]
    fn record_layers(&mut self, pixel: usize, sample: &Sample, weighted: Rgb) {
        let Some(family) = self.layout.family(sample.technique) else { return };
        self.sums.add_beside(pixel, family, sample.contribution, sample.weight);
        if let Some(pair) = self.layout.pair(sample.s, sample.t) {
            self.sums.add_pair(pixel, pair, weighted.to_array(), sample.contribution.to_array());
        }
    }
}

/// The mean of weights with this sum; 0 of none.
pub fn mean_weight(sum: f64, samples: f64) -> f64 {
    if samples > 0.0 { sum / samples } else { 0.0 }
}
