//! What a film adds up, pixel by pixel, laid out for samples that come one by one.
//!
//! Memory is what costs: each iteration goes through most of it. So what belongs to one sample lies together, and only what
//! the image is made of is in f64, the techniques' weighted contributions. All else is looked at, and nothing is made of it:
//! it is in f32. Rounded to nearest, a sum of n samples like one another has a relative error of about √n · 3e-8 there.

use super::layout::{Layout, Place};
use crate::math::{Rgb, prefetch};
use glam::Vec4;

/// A film's sums.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    families: usize,
    layers: bool,
    pairs: usize,
    /// `[pixel][technique]`: weighted contribution.
    weighted: Vec<[f64; 3]>,
    /// `[pixel][technique]`, where layers are kept: unweighted contribution, sum of the weights, number of samples.
    beside: Vec<[f32; 5]>,
    /// `[pixel][(s, t)]`: weighted and unweighted contribution.
    by_pair: Vec<[f32; 6]>,
}

/// The sums of some pixels.
pub(super) struct Part<'a> {
    families: usize,
    pairs: usize,
    weighted: &'a mut [[f64; 3]],
    beside: &'a mut [[f32; 5]],
    by_pair: &'a mut [[f32; 6]],
}

impl Sums {
    pub(super) fn new(layout: &Layout, pixels: usize) -> Self {
        let (families, layers, pairs) = (layout.families(), layout.has_layers(), layout.pairs());
        Self {
            families,
            layers,
            pairs,
            weighted: vec![[0.0; 3]; pixels * families],
            beside: vec![[0.0; 5]; if layers { pixels * families } else { 0 }],
            by_pair: vec![[0.0; 6]; pixels * pairs],
        }
    }

    pub(super) fn clear(&mut self) {
        self.weighted.fill([0.0; 3]);
        self.beside.fill([0.0; 5]);
        self.by_pair.fill([0.0; 6]);
    }

    /// Whether the other's are of as many images and pixels.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let shape = |s: &Self| (s.families, s.weighted.len(), s.beside.len(), s.by_pair.len());
        shape(self) == shape(other)
    }

    /// Adds those of a film of the same layout.
    pub(super) fn append(&mut self, later: &Self) {
        let add = |sums: &mut [f32], more: &[f32]| sums.iter_mut().zip(more).for_each(|(a, b)| *a += b);
        let weighted = self.weighted.as_flattened_mut().iter_mut();
        weighted.zip(later.weighted.as_flattened()).for_each(|(a, b)| *a += b);
        add(self.beside.as_flattened_mut(), later.beside.as_flattened());
        add(self.by_pair.as_flattened_mut(), later.by_pair.as_flattened());
    }

    /// The weighted contributions of a pixel, technique by technique.
    #[inline]
    pub(super) fn weighted(&self, pixel: usize) -> &[[f64; 3]] {
        &self.weighted[pixel * self.families..][..self.families]
    }

    /// What an image has at a pixel; of an [`super::ImageKind::Weight`] the sum of the weights, the number of samples, and 0.
    #[inline]
    pub(super) fn get(&self, pixel: usize, place: Place) -> [f64; 3] {
        let beside = |family: usize| self.beside[pixel * self.families + family].map(f64::from);
        match place {
            Place::Weighted(family) => self.weighted[pixel * self.families + family],
            Place::Unweighted(family) => {
                let [r, g, b, ..] = beside(family);
                [r, g, b]
            }
            Place::Weights(family) => {
                let [.., weights, samples] = beside(family);
                [weights, samples, 0.0]
            }
            Place::Pair { pair, first } => {
                let entry = &self.by_pair[pixel * self.pairs + pair];
                std::array::from_fn(|c| f64::from(entry[first + c]))
            }
        }
    }

    /// Makes [`Self::get`] give `value`, which came from there.
    pub(super) fn set(&mut self, pixel: usize, place: Place, value: [f64; 3]) {
        let [x, y, z] = value.map(|v| v as f32);
        let at = |family: usize| pixel * self.families + family;
        match place {
            Place::Weighted(family) => self.weighted[at(family)] = value,
            Place::Unweighted(family) => self.beside[at(family)][..3].copy_from_slice(&[x, y, z]),
            Place::Weights(family) => self.beside[at(family)][3..].copy_from_slice(&[x, y]),
            Place::Pair { pair, first } => {
                self.by_pair[pixel * self.pairs + pair][first..][..3].copy_from_slice(&[x, y, z]);
            }
        }
    }

    /// In parts of so many pixels.
    pub(super) fn parts(&mut self, pixels: usize) -> Vec<Part<'_>> {
        let (families, pairs) = (self.families, self.pairs);
        let beside_size = if self.layers { pixels * families } else { 0 };
        let (mut weighted, mut beside) = (&mut self.weighted[..], &mut self.beside[..]);
        let mut by_pair = &mut self.by_pair[..];
        let mut parts = Vec::new();
        while !weighted.is_empty() {
            parts.push(Part {
                families,
                pairs,
                weighted: first(&mut weighted, pixels * families),
                beside: first(&mut beside, beside_size),
                by_pair: first(&mut by_pair, pixels * pairs),
            });
        }
        parts
    }
}

/// The first elements of a slice, so many or as many as there are, which is left with the others.
fn first<'a, T>(slice: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let all = std::mem::take(slice);
    let (first, rest) = all.split_at_mut(count.min(all.len()));
    *slice = rest;
    first
}

/// Brings near `items` of a pixel, so many a pixel.
#[inline]
fn prefetch_row<T>(row: &[T], pixel: usize, items: usize) {
    // A prefetch brings two lines of 64 bytes, which is five entries of 24.
    let (mut next, end) = (pixel * items, pixel * items + items);
    while next < end {
        prefetch(row, next);
        next += 5;
    }
}

impl Part<'_> {
    /// Brings near what is kept of a pixel.
    #[inline]
    pub(super) fn expect_pixel(&self, pixel: usize) {
        prefetch_row(self.weighted, pixel, self.families);
        if !self.beside.is_empty() {
            prefetch(self.beside, pixel * self.families);
        }
        prefetch_row(self.by_pair, pixel, self.pairs);
    }

    /// Brings near what is kept of a sample beside its weighted contribution.
    #[inline]
    pub(super) fn expect(&self, pixel: usize, family: usize, pair: Option<usize>) {
        prefetch(self.beside, pixel * self.families + family);
        if let Some(pair) = pair {
            prefetch(self.by_pair, pixel * self.pairs + pair);
        }
    }

    /// The weighted contributions of a pixel, technique by technique.
    #[inline]
    pub(super) fn of_pixel(&mut self, pixel: usize) -> &mut [[f64; 3]] {
        &mut self.weighted[pixel * self.families..][..self.families]
    }

    /// Adds what is kept of a technique's sample beside its weighted contribution, where layers are kept.
    #[inline]
    pub(super) fn add_beside(&mut self, pixel: usize, family: usize, unweighted: Rgb, weight: f32) {
        // What is black does not count for the mean weight.
        let (weight, one) = if unweighted == Rgb::ZERO { (0.0, 0.0) } else { (weight, 1.0) };
        let [first @ .., samples] = &mut self.beside[pixel * self.families + family];
        // Four at a time.
        *first = (Vec4::from_array(*first) + unweighted.extend(weight)).to_array();
        *samples += one;
    }

    /// Adds a sample of (s, t).
    #[inline]
    pub(super) fn add_pair(&mut self, pixel: usize, pair: usize, weighted: [f32; 3], unweighted: [f32; 3]) {
        let entry = &mut self.by_pair[pixel * self.pairs + pair];
        let ([r, g, b], [x, y, z]) = (weighted, unweighted);
        entry.iter_mut().zip([r, g, b, x, y, z]).for_each(|(sum, v)| *sum += v);
    }
}
