//! Rows of labelled images as an SVG file of its own: for papers and slides.

use super::markup::Markup;
use super::numbers::shortened;
use super::palette::{Ink, Role};
use super::picture::Picture;

/// An image with what is written under it.
pub(super) struct Tile {
    /// The image; an empty frame where there is none.
    pub picture: Option<Picture>,
    /// First line.
    pub label: String,
    /// Second line.
    pub fact: String,
    /// Whether its pixels are to be seen as squares.
    pub pixelated: bool,
}

/// Rows of tiles, each row centred.
pub(super) struct Montage {
    title: String,
    tile_width: f64,
    rows: Vec<(String, Vec<Tile>)>,
}

const GAP: f64 = 8.0;
const LINE: f64 = 15.0;
const NAME_WIDTH: f64 = 130.0;

impl Montage {
    /// Nothing yet; every image will be so wide, in px.
    pub fn new(title: String, tile_width: f64) -> Self {
        Self { title, tile_width, rows: Vec::new() }
    }

    /// Appends a tile to a row, which comes to be if it is not there.
    pub fn push(&mut self, row: usize, tile: Tile) {
        self.reach(row).1.push(tile);
    }

    /// What is written to the left of a row.
    pub fn name_row(&mut self, row: usize, name: &str) {
        self.reach(row).0 = name.to_owned();
    }

    fn reach(&mut self, row: usize) -> &mut (String, Vec<Tile>) {
        while self.rows.len() <= row {
            self.rows.push((String::new(), Vec::new()));
        }
        &mut self.rows[row]
    }

    fn tile_height(&self, tile: &Tile) -> f64 {
        tile.picture.as_ref().map_or(self.tile_width, |p| self.tile_width * p.height as f64 / p.width as f64)
    }

    /// Height of a row: its images, and the lines under them.
    fn row_heights(&self, tiles: &[Tile]) -> (f64, f64) {
        let image = tiles.iter().map(|t| self.tile_height(t)).fold(0.0, f64::max);
        let lines = tiles.iter().map(|t| f64::from(!t.label.is_empty()) + f64::from(!t.fact.is_empty()));
        (image, image + LINE * lines.fold(0.0, f64::max) + GAP)
    }

    /// The whole as the content of an SVG file.
    pub fn svg(&self) -> String {
        let margin = if self.rows.iter().any(|r| !r.0.is_empty()) { NAME_WIDTH } else { GAP };
        let most = self.rows.iter().map(|r| r.1.len()).max().unwrap_or(0) as f64;
        let width = margin + most * (self.tile_width + GAP) + GAP;
        let height = GAP + self.rows.iter().map(|r| self.row_heights(&r.1).1).sum::<f64>();
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
                for (name, tiles) in &self.rows {
                    let (image, whole) = self.row_heights(tiles);
                    for (i, line) in name.split('\n').enumerate() {
                        let y = y + 0.5 * image + LINE * i as f64;
                        m.leaf("text", &[("x", &GAP), ("y", &y)], shortened(line, 22));
                    }
                    let mut x = margin + 0.5 * (most - tiles.len() as f64) * (self.tile_width + GAP);
                    for tile in tiles {
                        self.tile(m, tile, x, y, image);
                        x += self.tile_width + GAP;
                    }
                    y += whole;
                }
            },
        );
        m.into_string()
    }

    fn tile(&self, m: &mut Markup, tile: &Tile, x: f64, y: f64, row_image: f64) {
        let height = self.tile_height(tile);
        match &tile.picture {
            Some(p) => {
                let style = if tile.pixelated { "image-rendering:pixelated" } else { "image-rendering:auto" };
                m.void(
                    "image",
                    &[
                        ("x", &x),
                        ("y", &y),
                        ("width", &self.tile_width),
                        ("height", &height),
                        ("href", &p.uri()),
                        ("style", &style),
                    ],
                );
            }
            None => m.void(
                "rect",
                &[
                    ("x", &x),
                    ("y", &y),
                    ("width", &self.tile_width),
                    ("height", &height),
                    ("fill", &"none"),
                    ("stroke", &Ink::Paper.color(Role::Grid)),
                ],
            ),
        }
        let middle = x + 0.5 * self.tile_width;
        let characters = (self.tile_width / 5.6) as usize;
        let quiet = Ink::Paper.color(Role::Quiet);
        let lines = [(&tile.label, Ink::Paper.color(Role::Text)), (&tile.fact, quiet)];
        for (i, (line, color)) in lines.iter().filter(|l| !l.0.is_empty()).enumerate() {
            let y = y + row_image + 12.0 + LINE * i as f64;
            m.leaf(
                "text",
                &[("x", &middle), ("y", &y), ("text-anchor", &"middle"), ("fill", color)],
                shortened(line, characters),
            );
        }
    }
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
                    .push(row, Tile { picture, label: "s & t".into(), fact: String::new(), pixelated: true });
            }
            montage.name_row(row, "k\n×2");
        }
        let svg = montage.svg();
        assert_eq!(imbalance(&svg), None);
        assert_eq!(svg.matches("<image").count(), 4);
        assert_eq!(svg.matches("s &amp; t").count(), 6);
    }
}
