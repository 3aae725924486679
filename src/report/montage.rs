//! Rows of labelled images as an SVG file of its own: for papers and slides.

use super::face;
use super::markup::{Markup, svg};
use super::palette::{Ink, Role};
use super::paper::{LEAST_IMAGE, Paper};
use super::picture::{Picture, SCALE_SHAPE};

/// An image with what is written under it.
#[derive(Default)]
pub(super) struct Tile {
    /// The image; an empty frame where there is none.
    pub picture: Option<Picture>,
    /// First line.
    pub label: String,
    /// Second line.
    pub fact: String,
    /// Whether its pixels are to be seen as squares.
    pub pixelated: bool,
    /// The colour of a line under the image.
    pub bar: Option<&'static str>,
}

/// The colours of a scale from its least value to its greatest, with what stands at either end.
pub(super) struct ScaleBar {
    /// The colours.
    pub ramp: Picture,
    /// At the left and at the right end.
    pub ends: [String; 2],
}

/// Tiles beside each other.
struct Row {
    name: String,
    /// Under the tiles.
    scale: Option<ScaleBar>,
    /// Of its images; none: as the montage's are.
    tile_width: Option<f64>,
    tiles: Vec<Tile>,
}

/// Rows of tiles, each row centred.
pub(super) struct Montage {
    title: String,
    tile_width: f64,
    rows: Vec<Row>,
}

/// What a montage is drawn with.
#[derive(Clone, Copy)]
struct Style {
    font: f64,
    line: f64,
    gap: f64,
    /// Width of the colours of a scale.
    ramp: f64,
    /// From the image down to what the first line under it stands on.
    first: f64,
    /// Height of the coloured line under an image.
    bar: f64,
    /// Width of a thin line.
    pen: f64,
    /// Lines that a label may take.
    lines: usize,
}

/// As large as its contents; in px.
const FREE: Style =
    Style { font: 11.0, line: 15.0, gap: 8.0, ramp: 160.0, first: 13.0, bar: 2.5, pen: 1.0, lines: 8 };
/// Room for the names of rows at their left, without a paper.
const NAME_WIDTH: f64 = 114.0;
/// On a paper, no label makes images wider than so many times the least.
const WIDER: f64 = 1.35;
/// On a paper, share of the width that an image of a row of its own has, and that any other has at most.
const WIDE: f64 = 0.62;
const ORDINARY: f64 = 0.5;

/// A row as it is drawn: on a paper, one of the parts of a row that was too long for it.
struct Line<'a> {
    heading: Vec<String>,
    tiles: &'a [Tile],
    scale: Option<&'a ScaleBar>,
    tile_width: f64,
    /// Where the first image starts.
    left: f64,
}

impl Style {
    fn on(paper: &Paper) -> Self {
        let font = paper.font;
        Self {
            font,
            line: paper.line(),
            gap: paper.gap(),
            ramp: (0.3 * paper.width).min(0.8 * SCALE_SHAPE as f64 * font),
            first: 1.1 * font,
            bar: 0.2 * font,
            pen: 0.5,
            lines: 3,
        }
    }
}

impl Montage {
    /// Nothing yet; every image will be so wide, in px, where there is no paper.
    pub fn new(title: String, tile_width: f64) -> Self {
        Self { title, tile_width, rows: Vec::new() }
    }

    /// Appends a tile to a row, which comes to be if it is not there.
    pub fn push(&mut self, row: usize, tile: Tile) {
        self.reach(row).tiles.push(tile);
    }

    /// What is written to the left of a row, or on paper above it.
    pub fn name_row(&mut self, row: usize, name: &str) {
        self.reach(row).name = name.to_owned();
    }

    /// How wide the images of a row are, where they differ from the others; on paper, these are wide.
    pub fn widen(&mut self, row: usize, tile_width: f64) {
        self.reach(row).tile_width = Some(tile_width);
    }

    /// The colours of a row's maps and what they stand for, under it.
    pub fn scale_row(&mut self, row: usize, scale: ScaleBar) {
        self.reach(row).scale = Some(scale);
    }

    fn reach(&mut self, row: usize) -> &mut Row {
        while self.rows.len() <= row {
            self.rows.push(Row { name: String::new(), scale: None, tile_width: None, tiles: Vec::new() });
        }
        &mut self.rows[row]
    }

    /// The whole as the content of an SVG file, as large as its contents.
    pub fn svg(&self) -> String {
        let names = self.rows.iter().flat_map(|r| r.name.split('\n'));
        let longest = names.map(|l| face::width(l, FREE.font)).fold(0.0, f64::max);
        // Not from the margin, whose rounding could be what a name lacks.
        let room = longest.min(NAME_WIDTH);
        let margin = if longest > 0.0 { room + 2.0 * FREE.gap } else { FREE.gap };
        let tile_width = |r: &Row| r.tile_width.unwrap_or(self.tile_width);
        let row_width = |r: &Row| r.tiles.len() as f64 * (tile_width(r) + FREE.gap);
        let inner = self.rows.iter().map(row_width).fold(0.0, f64::max);
        let lines = self.rows.iter().map(|row| Line {
            heading: Vec::new(),
            tiles: &row.tiles,
            scale: row.scale.as_ref(),
            tile_width: tile_width(row),
            left: margin + 0.5 * (inner - row_width(row)),
        });
        let lines: Vec<Line> = lines.collect();
        let mut names = Markup::default();
        let mut y = FREE.gap;
        for (row, line) in self.rows.iter().zip(&lines) {
            for (i, name) in row.name.split('\n').filter(|n| !n.is_empty()).enumerate() {
                let y = y + 0.5 * line.image() + FREE.line * i as f64;
                let shown = face::shortened(name, room, FREE.font);
                names.leaf("text", &[("x", &FREE.gap), ("y", &y)], shown);
            }
            y += line.height(&FREE);
        }
        self.drawn(&FREE, (margin + inner + FREE.gap).round(), FREE.gap, &lines, &names.into_string())
    }

    /// The whole as the content of an SVG file for a paper, a unit a point: rows that are too long for it are wrapped.
    pub fn on(&self, paper: Option<Paper>) -> String {
        let Some(paper) = paper else { return self.svg() };
        let style = Style::on(&paper);
        let ordinary = || self.rows.iter().filter(|r| r.tile_width.is_none());
        let longest = ordinary().map(|r| r.tiles.len()).max().unwrap_or(1);
        let words = ordinary().flat_map(|r| &r.tiles).flat_map(|t| [&t.label, &t.fact]);
        let word = words.map(|w| face::widest_word(w, paper.font)).fold(0.0, f64::max);
        let columns = paper.columns(longest, word.clamp(LEAST_IMAGE, WIDER * LEAST_IMAGE));
        let mut lines = Vec::new();
        for row in self.rows.iter().filter(|r| !r.tiles.is_empty()) {
            let (columns, tile_width) = match row.tile_width {
                Some(_) => (1, WIDE * paper.width),
                None => (columns, paper.share(columns).min(ORDINARY * paper.width)),
            };
            // A name of several lines is one line here.
            let name = row.name.replacen('\n', ", ", 1).replace('\n', " ");
            let mut heading = face::wrapped(&name, 0.95 * paper.width, paper.font, 2);
            let wide = |count: usize| count as f64 * (tile_width + style.gap) - style.gap;
            let most = columns.min(row.tiles.len());
            let parts = row.tiles.chunks(columns);
            let last = parts.len() - 1;
            for (part, tiles) in parts.enumerate() {
                // Parts of a row start below each other.
                let left = 0.5 * (paper.width - wide(most));
                let scale = row.scale.as_ref().filter(|_| part == last);
                lines.push(Line { heading: std::mem::take(&mut heading), tiles, scale, tile_width, left });
            }
        }
        self.drawn(&style, paper.width, style.pen, &lines, "")
    }

    /// The drawing: lines under each other, and what was drawn beside them.
    fn drawn(&self, style: &Style, width: f64, top: f64, lines: &[Line], beside: &str) -> String {
        let height = top + lines.iter().map(|l| l.height(style)).sum::<f64>();
        let height = if width.fract() == 0.0 { height.round() } else { height };
        svg(&self.title, [width, height], style.font, Ink::Paper, &[], |m| {
            m.raw(beside);
            let mut y = top;
            for line in lines {
                line.draw(m, style, y);
                y += line.height(style);
            }
        })
    }
}

impl Line<'_> {
    fn heading_height(&self, style: &Style) -> f64 {
        if self.heading.is_empty() { 0.0 } else { style.line * self.heading.len() as f64 + 0.3 * style.font }
    }

    /// Height of the highest image; places without one are as high.
    fn image(&self) -> f64 {
        self.tiles
            .iter()
            .filter_map(|t| t.height(self.tile_width))
            .reduce(f64::max)
            .unwrap_or(self.tile_width)
    }

    /// Of all: heading, images, and the lines under them.
    fn height(&self, style: &Style) -> f64 {
        let lines = self.tiles.iter().map(|t| t.lines(self.tile_width, style).len() as f64);
        let scale = self.scale.map_or(0.0, |_| style.line + style.gap);
        self.heading_height(style) + self.image() + style.line * lines.fold(0.0, f64::max) + scale + style.gap
    }

    /// The scale, in the middle under the tiles.
    fn draw_scale(&self, scale: &ScaleBar, m: &mut Markup, style: &Style, bottom: f64) {
        let whole = self.tiles.len() as f64 * (self.tile_width + style.gap) - style.gap;
        // With room for what stands at its ends, however narrow the tiles are.
        let width = style.ramp.min(whole - 8.0 * style.font).max(style.font);
        let height = width / SCALE_SHAPE as f64;
        let left = self.left + 0.5 * (whole - width);
        let base = bottom - style.gap - 0.3 * style.line;
        image(m, &scale.ramp, [left, base - height, width, height], false);
        frame(m, [left, base - height, width, height], Ink::Paper.color(Role::Grid), style.pen);
        let [low, high] = &scale.ends;
        let ends = [(left - 0.5 * style.gap, "end", low), (left + width + 0.5 * style.gap, "start", high)];
        for (x, anchor, text) in ends {
            m.leaf("text", &[("x", &x), ("y", &base), ("text-anchor", &anchor)], text);
        }
    }

    fn draw(&self, m: &mut Markup, style: &Style, y: f64) {
        for (i, text) in self.heading.iter().enumerate() {
            let y = y + style.font + style.line * i as f64;
            m.leaf("text", &[("x", &style.pen), ("y", &y), ("font-weight", &600)], text);
        }
        let y = y + self.heading_height(style);
        for (i, tile) in self.tiles.iter().enumerate() {
            let x = self.left + (self.tile_width + style.gap) * i as f64;
            tile.draw(m, style, [x, y], [self.tile_width, self.image()]);
        }
        if let Some(scale) = self.scale {
            self.draw_scale(scale, m, style, y - self.heading_height(style) + self.height(style));
        }
    }
}

impl Tile {
    /// Of the image, if there is one.
    fn height(&self, width: f64) -> Option<f64> {
        self.picture.as_ref().map(|p| width * p.height as f64 / p.width as f64)
    }

    /// What is written under the image, in lines no wider than it.
    fn lines(&self, width: f64, style: &Style) -> Vec<(String, &'static str)> {
        let ink = |text: &str, role: Role| {
            let lines = face::wrapped(text, width, style.font, style.lines);
            lines.into_iter().map(move |line| (line, Ink::Paper.color(role)))
        };
        ink(&self.label, Role::Text).chain(ink(&self.fact, Role::Quiet)).collect()
    }

    fn draw(&self, m: &mut Markup, style: &Style, [x, y]: [f64; 2], [width, row_image]: [f64; 2]) {
        let height = self.height(width).unwrap_or(row_image);
        match &self.picture {
            Some(p) => image(m, p, [x, y, width, height], self.pixelated),
            None => frame(m, [x, y, width, height], Ink::Paper.color(Role::Grid), style.pen),
        }
        if let Some(color) = self.bar {
            let top = y + height;
            m.void(
                "rect",
                &[("x", &x), ("y", &top), ("width", &width), ("height", &style.bar), ("fill", &color)],
            );
        }
        let middle = x + 0.5 * width;
        let bar = if self.bar.is_some() { style.bar } else { 0.0 };
        let first = style.first.max(bar + style.font);
        for (i, (line, color)) in self.lines(width, style).into_iter().enumerate() {
            let y = y + row_image + first + style.line * i as f64;
            m.leaf("text", &[("x", &middle), ("y", &y), ("text-anchor", &"middle"), ("fill", &color)], line);
        }
    }
}

/// An image at a place: left, top, width and height.
pub(super) fn image(m: &mut Markup, picture: &Picture, [x, y, width, height]: [f64; 4], pixelated: bool) {
    let style = if pixelated { "image-rendering:pixelated" } else { "image-rendering:auto" };
    m.void(
        "image",
        &[
            ("x", &x),
            ("y", &y),
            ("width", &width),
            ("height", &height),
            ("href", &picture.uri()),
            ("style", &style),
        ],
    );
}

/// A frame at a place.
pub(super) fn frame(m: &mut Markup, [x, y, width, height]: [f64; 4], stroke: &str, thickness: f64) {
    m.void(
        "rect",
        &[
            ("x", &x),
            ("y", &y),
            ("width", &width),
            ("height", &height),
            ("fill", &"none"),
            ("stroke", &stroke),
            ("stroke-width", &thickness),
        ],
    );
}

#[cfg(test)]
mod tests {
    use super::super::markup::imbalance;
    use super::*;
    use crate::film::Image;
    use crate::film::false_color::Scale;

    #[test]
    fn rows_of_any_length_are_drawn() {
        let mut montage = Montage::new("a <title>".into(), 100.0);
        for row in 0..3 {
            for column in 0..=row {
                let picture = (column != 1).then(|| Picture::of(&Image::new(4, 2), 0.0, 10)).flatten();
                montage
                    .push(row, Tile { picture, label: "s & t".into(), pixelated: true, ..Tile::default() });
            }
            if row == 1 {
                let ramp = Picture::of_scale(Scale::Signed(0.5)).unwrap();
                montage.scale_row(row, ScaleBar { ramp, ends: ["−0.5".into(), "0.5".into()] });
            }
            montage.name_row(row, "k\n×2");
        }
        let svg = montage.svg();
        assert_eq!(imbalance(&svg), None);
        assert_eq!(svg.matches("<image").count(), 5);
        assert_eq!(
            svg.matches("width=\"120\" height=\"7.5\"").count(),
            2,
            "the colours and their frame: {svg}"
        );
        assert!(svg.contains(">−0.5<") && svg.contains(">0.5<"));
        assert_eq!(svg.matches("s &amp; t").count(), 6);
        assert_eq!(svg.matches("height=\"50\"").count(), 6, "places without an image are as high: {svg}");
    }

    #[test]
    fn names_of_rows_that_there_is_room_for_are_whole() {
        // As sizes of letters have no end in binary, some names are a rounding wider than the room made for them.
        for name in [
            "mean weight",
            "−0.27 blue,",
            "weighted",
            "unweighted",
            "k = 12",
            "variance",
            "0 to 0.15",
            "bias",
        ] {
            let mut montage = Montage::new(String::new(), 100.0);
            montage.push(0, Tile::default());
            montage.name_row(0, name);
            assert!(montage.svg().contains(name), "{name}");
        }
        let mut montage = Montage::new(String::new(), 100.0);
        montage.push(0, Tile::default());
        montage.name_row(0, &"long ".repeat(20));
        assert!(montage.svg().contains('…'));
    }
}
