//! Rows of labelled images as an SVG file of its own: for papers and slides.

use super::markup::Markup;
use super::numbers::shortened;
use super::palette::{Ink, Role};
use super::picture::Picture;

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
    /// Frames in the image: left, top, width and height as shares of it.
    pub frames: Vec<[f64; 4]>,
}

/// Tiles beside each other.
struct Row {
    name: String,
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

const GAP: f64 = 8.0;
const LINE: f64 = 15.0;
/// Height of the line under an image.
const BAR: f64 = 2.5;
/// Width of a letter, about.
const LETTER: f64 = 5.6;
const NAME_WIDTH: f64 = 130.0;

impl Montage {
    /// Nothing yet; every image will be so wide, in px.
    pub fn new(title: String, tile_width: f64) -> Self {
        Self { title, tile_width, rows: Vec::new() }
    }

    /// Appends a tile to a row, which comes to be if it is not there.
    pub fn push(&mut self, row: usize, tile: Tile) {
        self.reach(row).tiles.push(tile);
    }

    /// What is written to the left of a row.
    pub fn name_row(&mut self, row: usize, name: &str) {
        self.reach(row).name = name.to_owned();
    }

    /// How wide the images of a row are, where they differ from the others.
    pub fn widen(&mut self, row: usize, tile_width: f64) {
        self.reach(row).tile_width = Some(tile_width);
    }

    fn reach(&mut self, row: usize) -> &mut Row {
        while self.rows.len() <= row {
            self.rows.push(Row { name: String::new(), tile_width: None, tiles: Vec::new() });
        }
        &mut self.rows[row]
    }

    fn tile_width(&self, row: &Row) -> f64 {
        row.tile_width.unwrap_or(self.tile_width)
    }

    /// Height of a row: its images, and the lines under them.
    fn row_heights(&self, row: &Row) -> (f64, f64) {
        let width = self.tile_width(row);
        let image = row.tiles.iter().map(|t| t.height(width)).fold(0.0, f64::max);
        let lines =
            row.tiles.iter().map(|t| t.label_lines(width).len() as f64 + f64::from(!t.fact.is_empty()));
        (image, image + LINE * lines.fold(0.0, f64::max) + GAP)
    }

    /// The whole as the content of an SVG file.
    pub fn svg(&self) -> String {
        let lines = self.rows.iter().flat_map(|r| r.name.split('\n'));
        let longest = lines.map(|l| l.chars().count()).max().unwrap_or(0) as f64;
        let margin = if longest > 0.0 { (LETTER * longest + 2.0 * GAP).min(NAME_WIDTH) } else { GAP };
        let row_width = |r: &Row| r.tiles.len() as f64 * (self.tile_width(r) + GAP);
        let inner = self.rows.iter().map(row_width).fold(0.0, f64::max);
        let width = margin + inner + GAP;
        let height = GAP + self.rows.iter().map(|r| self.row_heights(r).1).sum::<f64>();
        let view = format!("0 0 {width:.0} {height:.0}");
        let mut m = Markup::default();
        m.tag(
            "svg",
            &[
                ("xmlns", &"http://www.w3.org/2000/svg"),
                ("viewBox", &view),
                ("width", &width.round()),
                ("height", &height.round()),
                ("font-family", &"'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif"),
                ("font-size", &11),
                ("fill", &Ink::Paper.color(Role::Text)),
            ],
            |m| {
                m.leaf("title", &[], &self.title);
                m.void(
                    "rect",
                    &[("width", &"100%"), ("height", &"100%"), ("fill", &Ink::Paper.color(Role::Ground))],
                );
                let mut y = GAP;
                for row in &self.rows {
                    let (image, whole) = self.row_heights(row);
                    for (i, line) in row.name.split('\n').enumerate() {
                        let y = y + 0.5 * image + LINE * i as f64;
                        m.leaf("text", &[("x", &GAP), ("y", &y)], shortened(line, 22));
                    }
                    let mut x = margin + 0.5 * (inner - row_width(row));
                    for tile in &row.tiles {
                        tile.draw(m, x, y, [self.tile_width(row), image]);
                        x += self.tile_width(row) + GAP;
                    }
                    y += whole;
                }
            },
        );
        m.into_string()
    }
}

impl Tile {
    fn height(&self, width: f64) -> f64 {
        self.picture.as_ref().map_or(width, |p| width * p.height as f64 / p.width as f64)
    }

    /// The label in lines that are no wider than the image.
    fn label_lines(&self, width: f64) -> Vec<String> {
        let most = (width / LETTER) as usize;
        let mut lines: Vec<String> = Vec::new();
        for word in self.label.split_whitespace() {
            match lines.last_mut() {
                Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(shortened(word, most).to_string()),
            }
        }
        lines
    }

    fn draw(&self, m: &mut Markup, x: f64, y: f64, [width, row_image]: [f64; 2]) {
        let height = self.height(width);
        let grid = Ink::Paper.color(Role::Grid);
        match &self.picture {
            Some(p) => {
                let style = if self.pixelated { "image-rendering:pixelated" } else { "image-rendering:auto" };
                m.void(
                    "image",
                    &[
                        ("x", &x),
                        ("y", &y),
                        ("width", &width),
                        ("height", &height),
                        ("href", &p.uri()),
                        ("style", &style),
                    ],
                );
            }
            None => frame(m, [x, y, width, height], [grid, "1"]),
        }
        for [left, top, w, h] in &self.frames {
            let place = [x + left * width, y + top * height, w * width, h * height];
            // Light on dark, so that it is seen on any image.
            frame(m, place, ["#000000", "3"]);
            frame(m, place, ["#ffffff", "1.5"]);
        }
        if let Some(color) = self.bar {
            let top = y + height;
            m.void("rect", &[("x", &x), ("y", &top), ("width", &width), ("height", &BAR), ("fill", &color)]);
        }
        let middle = x + 0.5 * width;
        let labels = self.label_lines(width).into_iter().map(|l| (l, Ink::Paper.color(Role::Text)));
        let fact = (!self.fact.is_empty()).then(|| {
            (shortened(&self.fact, (width / LETTER) as usize).to_string(), Ink::Paper.color(Role::Quiet))
        });
        for (i, (line, color)) in labels.chain(fact).enumerate() {
            let y = y + row_image + 13.0 + LINE * i as f64;
            m.leaf("text", &[("x", &middle), ("y", &y), ("text-anchor", &"middle"), ("fill", &color)], line);
        }
    }
}

fn frame(m: &mut Markup, [x, y, width, height]: [f64; 4], [stroke, thickness]: [&str; 2]) {
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

    #[test]
    fn rows_of_any_length_are_drawn() {
        let mut montage = Montage::new("a <title>".into(), 100.0);
        for row in 0..3 {
            for column in 0..=row {
                let picture = (column != 1).then(|| Picture::of(&Image::new(4, 2), 0.0, 10)).flatten();
                montage
                    .push(row, Tile { picture, label: "s & t".into(), pixelated: true, ..Tile::default() });
            }
            montage.name_row(row, "k\n×2");
        }
        let svg = montage.svg();
        assert_eq!(imbalance(&svg), None);
        assert_eq!(svg.matches("<image").count(), 4);
        assert_eq!(svg.matches("s &amp; t").count(), 6);
    }
}
