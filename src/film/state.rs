//! A film's sums put together from those of several stretches of iterations, and written down to go on with later.
//!
//! Sums are put together plane by plane, in f64 and in the order in which they are given, so that stretches of the same
//! lengths make the same film to the bit, whether they were rendered in one go, after a crash or on several machines.

use super::accumulator::{Dropped, Film, Outlier};
use super::image::Image;
use std::io::{self, Write};

/// Bytes of a pixel of a plane.
const PIXEL: usize = 24;

/// Bytes of a pixel's outlier.
const OUTLIER: usize = 8;

/// Which planes of a film hold anything: the layout's images in order, then the squares. Those that are zero everywhere
/// are not written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Planes(pub Vec<bool>);

impl Film {
    /// Forgets everything.
    pub fn clear(&mut self) {
        self.sums.clear();
        self.squares.fill([0.0; 3]);
        self.outliers.fill(Outlier::default());
        self.iterations = 0;
        self.dropped = Dropped::default();
    }

    /// Takes over how many contributions were dropped in the iterations that were read.
    pub fn set_dropped(&mut self, dropped: Dropped) {
        self.dropped = dropped;
    }

    /// Adds the iterations of another film of the same layout, which come after those of this one.
    ///
    /// # Panics
    /// For a film of another size or layout.
    pub fn append(&mut self, later: &Self) {
        assert!(self.size() == later.size() && self.sums.is_like(&later.sums), "films of one layout");
        self.sums.append(&later.sums);
        for (sum, value) in self.squares.iter_mut().zip(&later.squares) {
            (0..3).for_each(|c| sum[c] += value[c]);
        }
        for (own, other) in self.outliers.iter_mut().zip(&later.outliers) {
            if other.luminance > own.luminance {
                *own = Outlier { iteration: other.iteration + self.iterations as u32, ..*other };
            }
        }
        self.iterations += later.iterations;
        for (total, new) in self.dropped.0.iter_mut().zip(later.dropped.0) {
            *total += new;
        }
    }

    /// [`Self::image`] of this film with the iterations of `later` added, without adding them: the same to the bit.
    pub fn image_with(&self, later: &Self) -> Image {
        let scale = 1.0 / (self.iterations + later.iterations).max(1) as f64;
        let (width, height) = self.size();
        let pixel = |i: usize| {
            let mut sum = [0.0; 3];
            for (a, b) in self.sums.weighted(i).iter().zip(later.sums.weighted(i)) {
                (0..3).for_each(|c| sum[c] += a[c] + b[c]);
            }
            sum.map(|v| (v * scale) as f32)
        };
        Image { width, height, pixels: (0..width * height).map(pixel).collect() }
    }

    /// Which planes hold anything.
    pub fn planes(&self) -> Planes {
        let pixels = self.squares.len();
        let holds = |image: usize| {
            let place = self.layout().place(image);
            (0..pixels).any(|i| self.sums.get(i, place) != [0.0; 3])
        };
        let mut kept: Vec<bool> = (0..self.layout().images().len()).map(holds).collect();
        kept.push(self.squares.iter().any(|v| *v != [0.0; 3]));
        Planes(kept)
    }

    /// Writes the planes that are kept, one after the other, in little-endian f64, then the outliers.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_planes(&self, planes: &Planes, out: &mut impl Write) -> io::Result<()> {
        let (squares, images) = planes.0.split_last().expect("the squares are always there");
        let count = images.len();
        let mut bytes = Vec::with_capacity(self.squares.len() * PIXEL);
        let mut write = |pixels: &mut dyn Iterator<Item = [f64; 3]>| {
            bytes.clear();
            pixels.flatten().for_each(|v| bytes.extend_from_slice(&v.to_le_bytes()));
            out.write_all(&bytes)
        };
        for plane in (0..count).filter(|p| images[*p]) {
            let place = self.layout().place(plane);
            write(&mut (0..self.squares.len()).map(|i| self.sums.get(i, place)))?;
        }
        if *squares {
            write(&mut self.squares.iter().copied())?;
        }
        bytes.clear();
        for outlier in &self.outliers {
            bytes.extend_from_slice(&outlier.luminance.to_le_bytes());
            bytes.extend_from_slice(&outlier.iteration.to_le_bytes());
        }
        out.write_all(&bytes)
    }

    /// Bytes that [`Self::write_planes`] writes.
    pub fn bytes_of(&self, planes: &Planes) -> usize {
        (planes.0.iter().filter(|kept| **kept).count() * PIXEL + OUTLIER) * self.squares.len()
    }

    /// Takes the sums of `iterations` iterations from what [`Self::write_planes`] wrote. `None`, and an empty film, where that
    /// was a film of another layout.
    pub fn read_planes(&mut self, iterations: u64, planes: &Planes, bytes: &[u8]) -> Option<()> {
        self.clear();
        let count = self.layout().images().len();
        if planes.0.len() != count + 1 || bytes.len() != self.bytes_of(planes) {
            return None;
        }
        let (bytes, outliers) = bytes.split_at(bytes.len() - self.outliers.len() * OUTLIER);
        for (outlier, bytes) in self.outliers.iter_mut().zip(outliers.chunks_exact(OUTLIER)) {
            let half = |b: &[u8]| u32::from_le_bytes(b.try_into().expect("four bytes"));
            *outlier = Outlier { luminance: f32::from_bits(half(&bytes[..4])), iteration: half(&bytes[4..]) };
        }
        let size = self.squares.len() * PIXEL;
        for (plane, bytes) in (0..=count).filter(|p| planes.0[*p]).zip(bytes.chunks_exact(size.max(1))) {
            let value = |b: &[u8]| f64::from_le_bytes(b.try_into().expect("eight bytes"));
            let pixels = bytes.chunks_exact(PIXEL).map(|p| [&p[..8], &p[8..16], &p[16..]].map(value));
            if plane < count {
                let place = self.layout().place(plane);
                pixels.enumerate().for_each(|(i, p)| self.sums.set(i, place, p));
            } else {
                self.squares.iter_mut().zip(pixels).for_each(|(s, p)| *s = p);
            }
        }
        self.iterations = iterations;
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, CameraSettings, FovAxis};
    use crate::film::Sample;
    use crate::math::Rgb;
    use crate::math::rng::{Stream, StreamKind};
    use crate::transport::settings::{Layers, Settings};
    use crate::transport::technique::{Technique, TechniqueSet};
    use glam::{Affine3A, UVec2};

    fn film() -> Film {
        let camera = Camera::new(&CameraSettings {
            size: UVec2::new(13, 9),
            crop: None,
            fov_axis: FovAxis::Horizontal,
            fov: 40.0,
            to_world: Affine3A::IDENTITY,
            lens: None,
            near: 0.0,
        })
        .unwrap();
        let mut settings =
            Settings::new(TechniqueSet::of(&[Technique::Hit, Technique::NextEvent, Technique::Lens]));
        settings.layers = Layers::Families;
        Film::new(&camera, &settings)
    }

    fn iterate(film: &mut Film, iterations: std::ops::Range<u64>) {
        for i in iterations {
            film.iterate(1, |band| {
                let mut random = Stream::new(1, i, StreamKind::Other, band.index as u64);
                for pixel in 0..band.rows() * band.width {
                    let technique =
                        if random.next_1d() < 0.5 { Technique::Hit } else { Technique::NextEvent };
                    let contribution = Rgb::new(random.next_1d(), random.next_1d(), 1e3 * random.next_1d());
                    band.record(
                        pixel,
                        &Sample { technique, s: 1, t: 2, contribution, weight: random.next_1d() },
                    );
                    band.settle(pixel);
                }
            });
        }
    }

    #[test]
    fn stretches_add_up_and_come_back() {
        let (mut all, mut later) = (film(), film());
        iterate(&mut all, 0..3);
        iterate(&mut later, 3..5);
        let together = all.image_with(&later);
        all.append(&later);
        assert_eq!((all.iterations(), &all.image()), (5, &together));
        let mut whole = film();
        iterate(&mut whole, 0..5);
        for (a, b) in all.variance().pixels.iter().zip(&whole.variance().pixels) {
            (0..3).for_each(|c| assert!((a[c] - b[c]).abs() <= 1e-5 * b[c], "{a:?} {b:?}"));
        }
        let planes = all.planes();
        assert_eq!(planes.0.iter().filter(|k| !**k).count(), 3, "nothing came by the lens, in three images");
        let mut bytes = Vec::new();
        all.write_planes(&planes, &mut bytes).unwrap();
        let mut back = film();
        back.read_planes(5, &planes, &bytes).unwrap();
        assert_eq!((back.layers(), back.variance()), (all.layers(), all.variance()));
        assert_eq!((back.outliers(), all.outliers()), (whole.outliers(), whole.outliers()));
        assert!(whole.outliers().pixels.iter().any(|p| p[1] == 4.0), "some are of the last iteration");
        assert!(back.read_planes(5, &planes, &bytes[1..]).is_none() && back.iterations() == 0);
    }
}
