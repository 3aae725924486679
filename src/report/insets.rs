//! The figure of enlarged parts, as papers have it: an image with lettered frames, and beside it a row a part and a column an image, with
//! the error of each part under it.

use super::face;
use super::markup::{Markup, svg};
use super::montage::{frame, image};
use super::palette::{Ink, Role};
use super::paper::{LEAST_IMAGE, Paper};
use super::picture::Picture;

/// A part of the images.
pub(super) struct Part {
    /// Written in its frame.
    pub letter: String,
    /// Left, top, width and height as shares of the image.
    pub place: [f64; 4],
    /// Of its frame.
    pub color: &'static str,
    /// Height over width.
    pub shape: f64,
}

/// An image's parts.
pub(super) struct Column {
    /// What stands above them.
    pub label: String,
    /// Each part, and what is written under it.
    pub cells: Vec<(Option<Picture>, String)>,
}

/// The whole figure.
pub(super) struct Insets {
    /// For those who cannot see it.
    pub title: String,
    /// The image with the frames, and what stands above it.
    pub whole: Option<(Picture, String)>,
    /// What stands under it.
    pub note: String,
    /// In order.
    pub parts: Vec<Part>,
    /// In order.
    pub columns: Vec<Column>,
}

/// Without a paper: width of a column of the grid, and size of letters, in px.
const FREE_COLUMN: f64 = 128.0;
const FREE_FONT: f64 = 11.0;
/// What a word that is cut short weighs against empty paper, and height in widths.
const CUT: f64 = 0.1;
/// Lines that a name may take.
const LINES: usize = 3;

/// How the columns are placed: so many beside the whole image, the others below it.
#[derive(Clone, Copy, Debug)]
struct Plan {
    /// Width of a column.
    cell: f64,
    /// Width of the whole image.
    whole: f64,
    /// Columns beside it.
    beside: usize,
    /// Columns of the rows below it.
    below: usize,
}

impl Insets {
    /// The content of an SVG file: on a paper, a unit a point.
    pub fn svg(&self, paper: Option<Paper>) -> String {
        let free =
            || Paper { width: (FREE_COLUMN * (self.columns.len() as f64 + 2.5)).round(), font: FREE_FONT };
        let paper = paper.unwrap_or_else(free);
        let plan = self.plan(&paper);
        let height = self.height(&paper, &plan);
        svg(&self.title, [paper.width, height], paper.font, Ink::Paper, &[], |m| {
            let blocks = self.blocks(&plan);
            let mut y = 0.0;
            let edge = 0.5 * self.pen(&paper);
            for (i, columns) in blocks.iter().enumerate() {
                let mut left = 0.0;
                let mut height = self.block_height(&paper, &plan, columns);
                if i == 0 && self.whole.is_some() {
                    self.draw_whole(m, &paper, &plan, [edge, y + self.header(&paper, &plan, columns)]);
                    left = plan.whole + paper.gap();
                    height = height.max(self.whole_height(&paper, &plan, columns));
                }
                self.draw_block(m, &paper, &plan, columns, [left, y]);
                y += height + paper.gap();
            }
        })
    }

    fn pen(&self, paper: &Paper) -> f64 {
        0.13 * paper.font
    }

    /// What leaves least of the paper empty, and takes little of it.
    fn plan(&self, paper: &Paper) -> Plan {
        let (count, gap) = (self.columns.len().max(1), paper.gap());
        let words = self.columns.iter().flat_map(|c| c.cells.iter().map(|c| &c.1).chain([&c.label]));
        let word = words.map(|w| face::widest_word(w, paper.font)).fold(0.0, f64::max);
        let mut plans = Vec::new();
        let side = |cell: f64| Plan {
            cell,
            whole: paper.width - count as f64 * (cell + gap),
            beside: count,
            below: 1,
        };
        // All in one row, as high as the whole image.
        let (mut low, mut high) = (0.0, paper.width / count as f64 - gap);
        for _ in 0..40 {
            let plan = side(0.5 * (low + high));
            let excess = self.whole_height(paper, &plan, &self.columns)
                - self.block_height(paper, &plan, &self.columns);
            if excess > 0.0 { low = plan.cell } else { high = plan.cell }
        }
        plans.push(side(low.max(LEAST_IMAGE)));
        let most = ((paper.width + gap) / (LEAST_IMAGE + gap)).floor().max(1.0) as usize;
        for below in 2..=most {
            let cell = paper.share(below);
            let spans = 1..below;
            plans.extend(spans.map(|span| Plan {
                cell,
                whole: span as f64 * (cell + gap) - gap,
                beside: (below - span).min(count),
                below,
            }));
        }
        let score = |p: &Plan| {
            let height = self.height(paper, p);
            let used = self.used(paper, p) / (paper.width * height);
            let cut = if word > p.cell { CUT } else { 0.0 };
            (1.0 - used) + 0.35 * height / paper.width + cut
        };
        let fits = |p: &&Plan| p.whole >= 1.4 * p.cell;
        let best = plans.iter().filter(fits).min_by(|a, b| score(a).total_cmp(&score(b)));
        let narrow = Plan { cell: paper.share(2), whole: paper.share(2), beside: 1, below: 2 };
        *best.unwrap_or(&narrow)
    }

    /// The columns that stand beside each other.
    fn blocks(&self, plan: &Plan) -> Vec<&[Column]> {
        let (first, rest) = self.columns.split_at(plan.beside.min(self.columns.len()));
        [first].into_iter().chain(rest.chunks(plan.below)).collect()
    }

    /// Room for names above columns.
    fn header(&self, paper: &Paper, plan: &Plan, columns: &[Column]) -> f64 {
        let lines = columns.iter().map(|c| label_lines(c, paper, plan).len());
        paper.line() * lines.max().unwrap_or(1).max(1) as f64 + 0.35 * paper.font
    }

    fn cell_height(&self, paper: &Paper, plan: &Plan, part: usize) -> f64 {
        plan.cell * self.parts[part].shape + 1.35 * paper.font + paper.gap()
    }

    fn block_height(&self, paper: &Paper, plan: &Plan, columns: &[Column]) -> f64 {
        let parts = (0..self.parts.len()).map(|i| self.cell_height(paper, plan, i)).sum::<f64>();
        self.header(paper, plan, columns) + parts
    }

    fn notes(&self, paper: &Paper, plan: &Plan) -> Vec<String> {
        face::wrapped(&self.note, plan.whole.max(1.0), paper.font, 6)
    }

    fn whole_height(&self, paper: &Paper, plan: &Plan, columns: &[Column]) -> f64 {
        let Some((picture, _)) = &self.whole else { return 0.0 };
        let notes = paper.line() * self.notes(paper, plan).len() as f64 + 0.4 * paper.font;
        self.header(paper, plan, columns) + shape(picture) * plan.whole + notes
    }

    fn height(&self, paper: &Paper, plan: &Plan) -> f64 {
        let blocks = self.blocks(plan);
        let heights = blocks.iter().enumerate().map(|(i, columns)| {
            let whole = if i == 0 { self.whole_height(paper, plan, columns) } else { 0.0 };
            self.block_height(paper, plan, columns).max(whole)
        });
        heights.sum::<f64>() + paper.gap() * (blocks.len() as f64 - 1.0)
    }

    /// Area with something in it.
    fn used(&self, paper: &Paper, plan: &Plan) -> f64 {
        let blocks = self.blocks(plan);
        let grid = blocks.iter().map(|c| c.len() as f64 * plan.cell * self.block_height(paper, plan, c));
        grid.sum::<f64>() + plan.whole * self.whole_height(paper, plan, blocks[0])
    }

    fn draw_whole(&self, m: &mut Markup, paper: &Paper, plan: &Plan, [x, y]: [f64; 2]) {
        let Some((picture, label)) = &self.whole else { return };
        let width = plan.whole - x;
        let height = shape(picture) * width;
        image(m, picture, [x, y, width, height], false);
        let font = paper.font;
        m.leaf(
            "text",
            &[
                ("x", &(x + 0.5 * width)),
                ("y", &(y - 0.55 * font)),
                ("text-anchor", &"middle"),
                ("font-weight", &600),
            ],
            face::shortened(label, width, font),
        );
        let mut taken: Vec<[f64; 4]> = Vec::new();
        for part in &self.parts {
            let [left, top, w, h] = part.place;
            let place = [x + left * width, y + top * height, w * width, h * height];
            // Dark about the colour, so that it is seen on any image.
            frame(m, place, "#000000", 2.2 * self.pen(paper));
            frame(m, place, part.color, 1.2 * self.pen(paper));
            taken.push(place);
        }
        let mut badges: Vec<[f64; 4]> = Vec::new();
        for (part, place) in self.parts.iter().zip(&taken) {
            let size = badge_size(&part.letter, font);
            let corner = corner(*place, size, [x, y, width, height], &badges);
            badge(m, part, corner, font);
            badges.push([corner[0], corner[1], size[0], size[1]]);
        }
        for (i, line) in self.notes(paper, plan).iter().enumerate() {
            let y = y + height + 1.2 * font + paper.line() * i as f64;
            m.leaf("text", &[("x", &x), ("y", &y), ("fill", &Ink::Paper.color(Role::Quiet))], line);
        }
    }

    fn draw_block(
        &self,
        m: &mut Markup,
        paper: &Paper,
        plan: &Plan,
        columns: &[Column],
        [left, top]: [f64; 2],
    ) {
        let font = paper.font;
        let header = self.header(paper, plan, columns);
        let pen = self.pen(paper);
        for (n, column) in columns.iter().enumerate() {
            let x = left + n as f64 * (plan.cell + paper.gap());
            let middle = x + 0.5 * plan.cell;
            let lines = label_lines(column, paper, plan);
            for (i, line) in lines.iter().rev().enumerate() {
                let y = top + header - 0.55 * font - paper.line() * i as f64;
                m.leaf(
                    "text",
                    &[("x", &middle), ("y", &y), ("text-anchor", &"middle"), ("font-weight", &600)],
                    line,
                );
            }
            let mut y = top + header;
            for (i, (part, (picture, text))) in self.parts.iter().zip(&column.cells).enumerate() {
                // The frame lies within the cell.
                let place = [x + 0.5 * pen, y + 0.5 * pen, plan.cell - pen, plan.cell * part.shape - pen];
                match picture {
                    Some(p) => image(m, p, place, true),
                    None => frame(m, place, Ink::Paper.color(Role::Grid), 0.5 * pen),
                }
                frame(m, place, part.color, pen);
                if n == 0 {
                    badge(m, part, [x, y], font);
                }
                let below = y + plan.cell * part.shape + 1.05 * font;
                let shown = face::shortened(text, plan.cell, font);
                if !shown.is_empty() {
                    let quiet = Ink::Paper.color(Role::Quiet);
                    m.leaf(
                        "text",
                        &[("x", &middle), ("y", &below), ("text-anchor", &"middle"), ("fill", &quiet)],
                        shown,
                    );
                }
                y += self.cell_height(paper, plan, i);
            }
        }
    }
}

/// What bold letters are wider by, at most.
const BOLD_EXTRA: f64 = 0.4;

/// The name of a column, in bold lines no wider than it.
fn label_lines(column: &Column, paper: &Paper, plan: &Plan) -> Vec<String> {
    face::wrapped(&column.label, plan.cell - BOLD_EXTRA, paper.font, LINES)
}

fn shape(picture: &Picture) -> f64 {
    picture.height as f64 / picture.width.max(1) as f64
}

fn badge_size(letter: &str, font: f64) -> [f64; 2] {
    [face::width(letter, font) + 0.5 * font, 1.15 * font]
}

/// A letter on its part's colour, with this upper left corner.
fn badge(m: &mut Markup, part: &Part, [x, y]: [f64; 2], font: f64) {
    let [width, height] = badge_size(&part.letter, font);
    m.void("rect", &[("x", &x), ("y", &y), ("width", &width), ("height", &height), ("fill", &part.color)]);
    m.leaf(
        "text",
        &[
            ("x", &(x + 0.5 * width)),
            ("y", &(y + 0.93 * font)),
            ("text-anchor", &"middle"),
            ("font-weight", &600),
            ("fill", &"#000000"),
        ],
        &part.letter,
    );
}

/// Upper left corner of a badge at a frame: in it where that is large, else beside it, within the image and clear of other badges.
fn corner(
    [x, y, w, h]: [f64; 4],
    [width, height]: [f64; 2],
    image: [f64; 4],
    others: &[[f64; 4]],
) -> [f64; 2] {
    let inside = [[x, y], [x + w - width, y], [x, y + h - height], [x + w - width, y + h - height]];
    let outside = [[x, y - height], [x, y + h], [x - width, y], [x + w, y]];
    let large = w >= 2.0 * width && h >= 2.0 * height;
    let order: Vec<[f64; 2]> = if large {
        inside.into_iter().chain(outside).collect()
    } else {
        outside.into_iter().chain(inside).collect()
    };
    let within = |[a, b]: &[f64; 2]| {
        *a >= image[0]
            && *b >= image[1]
            && a + width <= image[0] + image[2]
            && b + height <= image[1] + image[3]
    };
    let clear = |[a, b]: &[f64; 2]| {
        others
            .iter()
            .all(|o| a + width <= o[0] || o[0] + o[2] <= *a || b + height <= o[1] || o[1] + o[3] <= *b)
    };
    let found = order.iter().find(|c| within(c) && clear(c)).or_else(|| order.iter().find(|c| within(c)));
    *found.unwrap_or(&[image[0], image[1]])
}

#[cfg(test)]
mod tests {
    use super::super::paper::CENTIMETRE;
    use super::*;
    use crate::film::Image;

    fn insets(columns: usize, parts: usize) -> Insets {
        let picture = |w, h| Picture::of(&Image::new(w, h), 0.0, 100);
        Insets {
            title: "parts".into(),
            whole: picture(16, 12).map(|p| (p, "Reference".into())),
            note: "A glass, B mug. Under each part: its relMSE, mean of 3 runs".into(),
            parts: (0..parts)
                .map(|i| Part {
                    letter: char::from(b'A' + i as u8).to_string(),
                    place: [0.1 + 0.3 * i as f64, 0.2, 0.2, 0.2],
                    color: "#e69f00",
                    shape: 1.0,
                })
                .collect(),
            columns: (0..columns)
                .map(|i| Column {
                    label: format!("estimator {i}"),
                    cells: vec![(picture(8, 8), "1.23×10⁻³".into()); parts],
                })
                .collect(),
        }
    }

    #[test]
    fn columns_are_wide_enough_and_all_there() {
        for width in [8.5, 17.8] {
            for columns in [2, 3, 4, 5, 10] {
                for parts in 1..4 {
                    let paper = Paper { width: width * CENTIMETRE, font: 7.0 };
                    let insets = insets(columns, parts);
                    let plan = insets.plan(&paper);
                    assert!(plan.cell >= LEAST_IMAGE && plan.whole >= 1.4 * plan.cell, "{plan:?}");
                    let shown: usize = insets.blocks(&plan).iter().map(|b| b.len()).sum();
                    assert_eq!(shown, columns);
                    let right = plan.whole + plan.beside as f64 * (plan.cell + paper.gap());
                    assert!(right <= paper.width + 1e-6, "{plan:?}");
                    assert_eq!(insets.svg(Some(paper)).matches("<image").count(), 1 + columns * parts);
                }
            }
        }
    }

    /// Bug that this keeps out: a name that fits its column on one line but for what bold letters are wider by was cut, where it has
    /// room on two.
    #[test]
    fn names_are_wrapped_before_they_are_cut() {
        let paper = Paper { width: 8.5 * CENTIMETRE, font: 7.0 };
        let column = Column { label: "points, beams and paths".into(), cells: Vec::new() };
        let mut lines = std::collections::BTreeSet::new();
        for cell in (400..1000).map(|tenths| 0.1 * f64::from(tenths)) {
            let plan = Plan { cell, whole: 100.0, beside: 1, below: 1 };
            let shown = label_lines(&column, &paper, &plan);
            assert_eq!(shown.join(" "), column.label, "{cell}");
            lines.insert(shown.len());
        }
        assert!(lines.contains(&1) && lines.contains(&2), "{lines:?}");
    }

    #[test]
    fn badges_keep_clear_of_each_other() {
        let image = [0.0, 0.0, 100.0, 80.0];
        let size = [6.0, 8.0];
        assert_eq!(corner([10.0, 10.0, 30.0, 30.0], size, image, &[]), [10.0, 10.0]);
        assert_eq!(corner([10.0, 10.0, 5.0, 5.0], size, image, &[]), [10.0, 2.0], "above what is small");
        assert_eq!(corner([10.0, 1.0, 5.0, 5.0], size, image, &[]), [10.0, 6.0], "below at the edge");
        assert_ne!(corner([10.0, 10.0, 30.0, 30.0], size, image, &[[8.0, 8.0, 6.0, 8.0]]), [10.0, 10.0]);
    }
}
