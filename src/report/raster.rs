//! Figures as PNG files: images, and labels in a small face of its own, for where no SVG with images in it is shown.

use crate::film::png::DisplayImage;
use std::collections::HashMap;
use std::sync::LazyLock;

/// Glyphs of 5 × 9 pixels, a line each: the character, and its rows from the top (the last two are below the line).
const FONT: &str = include_str!("font.txt");
/// From one character to the next, in pixels.
const ADVANCE: usize = 6;
/// From one line to the next, in pixels.
pub(super) const LEADING: usize = 11;

/// For each character the pixels that are set: (column, row).
static GLYPHS: LazyLock<HashMap<char, Vec<(usize, usize)>>> = LazyLock::new(|| {
    let glyph = |line: &str| {
        let mut characters = line.chars();
        let key = characters.next()?;
        let rows = characters.as_str().trim().split('|').enumerate();
        let set = rows.flat_map(|(y, row)| {
            row.chars().enumerate().filter(|(_, c)| *c == '#').map(move |(x, _)| (x, y))
        });
        Some((key, set.collect()))
    };
    FONT.lines().filter_map(glyph).collect()
});

/// What is drawn for a character without a glyph: a frame.
fn unknown() -> Vec<(usize, usize)> {
    (0..7).flat_map(|y| (0..5).map(move |x| (x, y))).filter(|(x, y)| x % 4 == 0 || y % 6 == 0).collect()
}

/// A picture that is drawn on.
pub(super) struct Canvas {
    image: DisplayImage,
}

impl Canvas {
    /// Of this size, in one colour.
    pub fn new(width: usize, height: usize, color: [u8; 3]) -> Self {
        Self { image: DisplayImage { width, height, pixels: vec![color; width * height] } }
    }

    /// What was drawn.
    pub fn finish(self) -> DisplayImage {
        self.image
    }

    fn set(&mut self, x: usize, y: usize, color: [u8; 3]) {
        if x < self.image.width && y < self.image.height {
            self.image.pixels[y * self.image.width + x] = color;
        }
    }

    /// A filled rectangle.
    pub fn fill(&mut self, [x, y]: [usize; 2], [width, height]: [usize; 2], color: [u8; 3]) {
        for row in y..y + height {
            (x..x + width).for_each(|column| self.set(column, row, color));
        }
    }

    /// An image with its left upper corner here, each pixel a square of `scale` pixels.
    pub fn draw(&mut self, image: &DisplayImage, [x, y]: [usize; 2], scale: usize) {
        for row in 0..image.height {
            for column in 0..image.width {
                let color = image.pixels[row * image.width + column];
                self.fill([x + column * scale, y + row * scale], [scale, scale], color);
            }
        }
    }

    /// A line of text with the middle of its upper edge here, each pixel of its face a square of `scale` pixels.
    pub fn text(&mut self, text: &str, [middle, y]: [usize; 2], scale: usize, color: [u8; 3]) {
        let left = middle.saturating_sub(width(text, scale) / 2);
        for (i, character) in text.chars().enumerate().filter(|(_, c)| !c.is_whitespace()) {
            let unknown = unknown();
            let character = if character == '−' { '-' } else { character };
            for (column, row) in GLYPHS.get(&character).unwrap_or(&unknown) {
                let corner = [left + (i * ADVANCE + column) * scale, y + row * scale];
                self.fill(corner, [scale, scale], color);
            }
        }
    }
}

/// Width of a line in pixels.
fn width(text: &str, scale: usize) -> usize {
    (text.chars().count() * ADVANCE).saturating_sub(1) * scale
}

/// A text in lines of at most so many pixels, broken between words; a word that is wider has a line of its own.
pub(super) fn lines(text: &str, scale: usize, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width(line, scale) + (word.chars().count() + 1) * ADVANCE * scale <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The colour `#rrggbb`; grey where it is none.
pub(super) fn rgb(hex: &str) -> [u8; 3] {
    let channel = |i: usize| hex.get(i..i + 2).and_then(|d| u8::from_str_radix(d, 16).ok());
    match [channel(1), channel(3), channel(5)] {
        [Some(r), Some(g), Some(b)] => [r, g, b],
        _ => [128; 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::technique::{PRESETS, TECHNIQUES};

    #[test]
    fn every_glyph_has_rows_of_five_and_is_unlike_the_others() {
        let mut seen = HashMap::new();
        for line in FONT.lines() {
            let (key, rows) = line.split_once(' ').unwrap();
            assert_eq!(key.chars().count(), 1, "{line}");
            let rows: Vec<&str> = rows.split('|').collect();
            assert!((7..=9).contains(&rows.len()), "{line}");
            assert!(rows.iter().all(|r| r.len() == 5 && r.chars().all(|c| "#.".contains(c))), "{line}");
            let other = seen.insert(rows, key.to_owned());
            assert!(other.is_none(), "{key} is {other:?}");
        }
        assert_eq!(GLYPHS.len(), FONT.lines().count(), "a character is there twice");
    }

    #[test]
    fn what_figures_say_has_glyphs() {
        let labels = TECHNIQUES.iter().map(|t| t.label).chain(PRESETS.iter().map(|p| p.label));
        for text in labels.chain(["0123456789.,%", "<0.1 %"]) {
            for c in text.chars().filter(|c| !c.is_whitespace()) {
                assert!(GLYPHS.contains_key(&c), "'{c}' of '{text}'");
            }
        }
    }

    #[test]
    fn lines_break_between_words() {
        assert_eq!(lines("next-event estimation", 2, 130), ["next-event", "estimation"]);
        assert_eq!(lines("next-event estimation", 1, 130), ["next-event estimation"]);
        assert_eq!(lines("incomprehensibilities of it", 1, 20), ["incomprehensibilities", "of", "it"]);
        assert!(lines("", 1, 20).is_empty());
    }

    #[test]
    fn drawing_stays_inside_and_hits_its_pixels() {
        let mut canvas = Canvas::new(20, 12, [255; 3]);
        let dot = DisplayImage { width: 1, height: 1, pixels: vec![[1, 2, 3]] };
        canvas.draw(&dot, [18, 10], 4);
        canvas.text("-", [10, 0], 2, [9; 3]);
        let image = canvas.finish();
        let count = |color| image.pixels.iter().filter(|p| **p == color).count();
        assert_eq!((count([1, 2, 3]), count([9; 3])), (4, 3 * 4));
        // The three dots of the fourth row, of a glyph that starts at 10 − 5.
        assert_eq!(image.pixels[6 * 20 + 7], [9; 3]);
        assert_eq!((rgb("#0a10ff"), rgb("red")), ([10, 16, 255], [128; 3]));
    }
}
