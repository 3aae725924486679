//! The paper that a figure is laid out on: how wide it is, and how large letters are on it.
//!
//! A unit of such a figure is a point: its SVG, PDF and PNG are that large in print.

use crate::experiment::results::Figures;

/// Points of a centimetre.
pub(super) const CENTIMETRE: f64 = 72.0 / 2.54;
/// No image gets narrower than this, in points: rows are wrapped instead.
pub(super) const LEAST_IMAGE: f64 = 1.8 * CENTIMETRE;
/// Size of letters where the experiment states none, in points.
const FONT: f64 = 7.0;

/// A width of paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Paper {
    /// In points.
    pub width: f64,
    /// Size of all letters, in points.
    pub font: f64,
}

impl Paper {
    /// What the experiment asks for; none: figures are as large as what is in them.
    pub fn of(figures: &Figures) -> Option<Self> {
        let width = figures.width_cm.filter(|w| *w > 0.0)? * CENTIMETRE;
        Some(Self { width, font: figures.font_pt.filter(|f| *f > 0.0).unwrap_or(FONT) })
    }

    /// Height of a line.
    pub fn line(&self) -> f64 {
        1.2 * self.font
    }

    /// Between images.
    pub fn gap(&self) -> f64 {
        0.45 * self.font
    }

    /// How many images stand beside each other where there are `count`, none narrower than `least`: rows of equal length.
    pub fn columns(&self, count: usize, least: f64) -> usize {
        let most = ((self.width + self.gap()) / (least + self.gap())).floor().max(1.0) as usize;
        let rows = count.max(1).div_ceil(most);
        count.max(1).div_ceil(rows)
    }

    /// Width of each of so many images beside each other.
    pub fn share(&self, columns: usize) -> f64 {
        (self.width - self.gap() * (columns as f64 - 1.0)) / columns as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_wrapped_before_images_are_too_narrow() {
        let column = Paper { width: 8.5 * CENTIMETRE, font: 7.0 };
        let page = Paper { width: 17.8 * CENTIMETRE, font: 7.0 };
        assert_eq!([1, 3, 4, 5, 9].map(|n| column.columns(n, LEAST_IMAGE)), [1, 3, 4, 3, 3]);
        assert_eq!([3, 4, 9, 10].map(|n| page.columns(n, LEAST_IMAGE)), [3, 4, 9, 5]);
        for n in 1..30 {
            assert!(column.share(column.columns(n, LEAST_IMAGE)) >= LEAST_IMAGE);
        }
    }
}
