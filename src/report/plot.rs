//! Log-log plots of error against samples or time, as SVG written by hand.

use super::axis::LogAxis;
use super::curve::{Axes, Curve, Px, draw_band, draw_mean, draw_runs, drawable, scaled_dashes};
use super::face::{self, shortened, wrapped};
use super::markup::{Attribute, Markup, svg};
use super::palette::{Ink, Role, marker};
use super::paper::{CENTIMETRE, Paper};

/// A plot.
#[derive(Clone, Debug, Default)]
pub(super) struct Plot {
    /// Its name for those who cannot see it, and above the drawing.
    pub title: String,
    /// What runs to the right.
    pub x_label: String,
    /// What runs upwards.
    pub y_label: String,
    /// The estimators.
    pub curves: Vec<Curve>,
    /// A dashed line of this slope under the data.
    pub reference_slope: Option<f64>,
}

/// Size of the drawing without a paper.
const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 400.0;
/// The panel within it: left, top, right, bottom. To its right, the names of the curves.
const PANEL: [f64; 4] = [72.0, 34.0, 500.0, 346.0];
/// Height of a line of a name, or of its remark.
const LABEL_LINE: f64 = 15.0;
/// Width of the names in the letters of files: on a page they are of a font of the reader's and bold, some so much wider.
const NAMES: f64 = (WIDTH - PANEL[2] - 34.0) / 1.35;
/// Height of the panel over the width of the paper, and at most, in widths of a column of 8.5 cm.
const PANEL_SHAPE: [f64; 2] = [0.62, 0.75];

const FONT: &str = "system-ui, 'Segoe UI', 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif";

/// Where the parts of a plot are.
#[derive(Clone, Copy)]
pub(super) struct Place {
    panel: [f64; 4],
    font: f64,
    /// Of names and remarks.
    small: f64,
    /// Widths of lines and sizes of markers, in those of the plot without a paper.
    pub pen: f64,
    /// Whether there is a paper, with names below and the title in its caption.
    paper: Option<Paper>,
}

impl Place {
    /// Without a paper: as large as it is.
    const FREE: Self = Self { panel: PANEL, font: 13.0, small: 12.0, pen: 1.0, paper: None };

    /// On a paper: as wide as that, with room at the left for the numbers of the axis.
    fn on(paper: Paper, plot: &Plot) -> Self {
        let font = paper.font;
        let height = (PANEL_SHAPE[0] * paper.width).min(PANEL_SHAPE[1] * 8.5 * CENTIMETRE);
        let mut place = Self {
            panel: [0.0, 0.6 * font, paper.width - 1.8 * font, 0.6 * font + height],
            font,
            small: font,
            pen: 0.075 * font,
            paper: Some(paper),
        };
        let axes = plot.axes(&place);
        let labels = axes.map_or(Vec::new(), |a| a.y.ticks(place.room()[1]));
        let widths = labels.iter().filter_map(|t| t.label.as_ref()).map(|l| face::width(l, font));
        place.panel[0] = 2.0 * font + widths.fold(font, f64::max);
        place
    }

    /// Least distances of labels along the axes.
    fn room(&self) -> [f64; 2] {
        if self.paper.is_some() { [3.9 * self.font, 1.7 * self.font] } else { [44.0, 22.0] }
    }

    /// Where the label of the lower axis stands.
    fn x_label(&self) -> f64 {
        self.panel[3] + if self.paper.is_some() { 2.7 * self.font } else { 42.0 }
    }
}

/// A name and its remark below the plot, on a paper.
struct Note<'a> {
    curve: &'a Curve,
    name: String,
    remark: String,
}

impl Plot {
    /// How many values have no place on logarithmic axes: zero, negative or not finite.
    pub fn undrawable(&self) -> usize {
        let mean = self.curves.iter().flat_map(|c| c.mean.iter().map(|p| (p.x, p.y)));
        mean.chain(self.runs()).filter(|(x, y)| !drawable(*x, *y)).count()
    }

    fn runs(&self) -> impl Iterator<Item = (f64, f64)> {
        self.curves.iter().flat_map(|c| c.runs.iter().flatten().copied())
    }

    fn drawn(&self) -> impl Iterator<Item = (f64, f64)> {
        let mean = self.curves.iter().flat_map(|c| c.mean.iter().map(|p| (p.x, p.y)));
        mean.chain(self.runs()).filter(|(x, y)| drawable(*x, *y))
    }

    fn axes(&self, place: &Place) -> Option<Axes> {
        let [left, top, right, bottom] = place.panel;
        let (low, high) =
            self.drawn().fold((f64::INFINITY, 0f64), |(low, high), p| (low.min(p.1), high.max(p.1)));
        let band =
            self.curves.iter().flat_map(|c| &c.mean).filter_map(|p| p.interval).flat_map(|(a, b)| [a, b]);
        // An interval that says next to nothing must not stretch the axis by decades.
        let band = band.filter(|v| (0.5 * low..=2.0 * high).contains(v));
        let line = self.reference_line().map(|c| {
            let mean_x = self.drawn().map(|p| p.0.ln()).sum::<f64>() / self.drawn().count().max(1) as f64;
            (c.1 + c.0 * mean_x).exp()
        });
        let ys: Vec<f64> = self.drawn().map(|p| p.1).chain(band).chain(line).collect();
        Some(Axes {
            x: LogAxis::covering(self.drawn().map(|p| p.0), left, right)?,
            y: LogAxis::covering(ys, bottom, top)?,
            pen: place.pen,
        })
    }

    /// Slope and intercept (natural logarithms) of the line of the reference slope that lies just under all means.
    fn reference_line(&self) -> Option<(f64, f64)> {
        let slope = self.reference_slope?;
        let means = self.curves.iter().flat_map(|c| &c.mean).filter(|p| drawable(p.x, p.y));
        let lowest = means.map(|p| p.y.ln() - slope * p.x.ln()).fold(f64::INFINITY, f64::min);
        lowest.is_finite().then_some((slope, lowest - 2f64.ln()))
    }

    /// The figure as an SVG element for the page.
    pub fn inline(&self) -> String {
        // Inline SVG needs no namespace, and the page is to hold no address at all.
        self.svg(Ink::Page, None).replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1)
    }

    /// The figure as the content of a file of its own, laid out for a paper where there is one.
    pub fn file(&self, paper: Option<Paper>) -> String {
        self.svg(Ink::Paper, paper)
    }

    fn svg(&self, ink: Ink, paper: Option<Paper>) -> String {
        let names: Vec<&str> = self.curves.iter().map(|c| c.label.as_str()).collect();
        let about = format!(
            "{}: {} against {} for {}, both axes logarithmic",
            self.title,
            self.y_label,
            self.x_label,
            names.join(", ")
        );
        let place = paper.map_or(Place::FREE, |paper| Place::on(paper, self));
        let notes = paper.map(|paper| self.notes(&paper)).unwrap_or_default();
        let [width, height] = match paper {
            Some(paper) => {
                [paper.width, place.x_label() + 0.4 * paper.font + self.notes_height(&paper, &notes)]
            }
            None => [WIDTH, HEIGHT],
        };
        let own: [Attribute; 2] = [("role", &"img"), ("font-family", &FONT)];
        svg(&about, [width, height], place.font, ink, &own, |m| {
            if paper.is_none() {
                m.leaf(
                    "text",
                    &[("x", &PANEL[0]), ("y", &20), ("font-size", &15), ("font-weight", &600)],
                    shortened(&self.title, WIDTH - PANEL[0] - 10.0, 15.0),
                );
            }
            match self.axes(&place) {
                Some(axes) => self.draw(m, ink, &place, &axes),
                None => Self::draw_nothing(m, ink, &place),
            }
            if let Some(paper) = paper {
                self.draw_notes(m, ink, &paper, &notes, place.x_label() + 0.4 * paper.font);
            }
        })
    }

    fn draw_nothing(m: &mut Markup, ink: Ink, place: &Place) {
        let [left, top, right, bottom] = place.panel;
        frame(m, ink, place);
        m.leaf(
            "text",
            &[
                ("x", &(0.5 * (left + right))),
                ("y", &(0.5 * (top + bottom))),
                ("text-anchor", &"middle"),
                ("fill", &ink.color(Role::Quiet)),
            ],
            "no positive finite value to draw",
        );
    }

    fn draw(&self, m: &mut Markup, ink: Ink, place: &Place, axes: &Axes) {
        self.draw_grid(m, ink, place, axes);
        self.draw_reference(m, ink, place, axes);
        for curve in &self.curves {
            draw_runs(m, ink, axes, curve);
        }
        for curve in &self.curves {
            draw_band(m, ink, axes, curve);
        }
        for curve in &self.curves {
            draw_mean(m, ink, axes, curve);
        }
        frame(m, ink, place);
        if place.paper.is_none() {
            self.draw_names(m, ink, axes);
        }
    }

    /// Names and remarks as they fit into the width of a paper.
    fn notes(&self, paper: &Paper) -> Vec<Note<'_>> {
        let font = paper.font;
        let notes = self.curves.iter().map(|curve| {
            let remark = if drawn_end(curve).is_some() { curve.remark.as_str() } else { "nothing to draw" };
            let most = paper.width - Note::MARKER * font;
            let remark = shortened(remark, 0.7 * most, font);
            let left = most - face::width(&remark, font) - Note::SPACE * font;
            Note { curve, name: shortened(&curve.label, left.max(3.0 * font), font), remark }
        });
        notes.collect()
    }

    /// How many notes stand beside each other, and how wide each is.
    fn note_columns(paper: &Paper, notes: &[Note]) -> (usize, f64) {
        let widest = notes.iter().map(|n| n.width(paper.font)).fold(1.0, f64::max);
        let gap = 1.5 * paper.font;
        let most = ((paper.width + gap) / (widest + gap)).floor().max(1.0) as usize;
        let rows = notes.len().max(1).div_ceil(most);
        (notes.len().max(1).div_ceil(rows), widest + gap)
    }

    fn notes_height(&self, paper: &Paper, notes: &[Note]) -> f64 {
        let (columns, _) = Self::note_columns(paper, notes);
        1.2 * paper.line() * notes.len().div_ceil(columns) as f64 + 0.3 * paper.font
    }

    fn draw_notes(&self, m: &mut Markup, ink: Ink, paper: &Paper, notes: &[Note], top: f64) {
        let (columns, step) = Self::note_columns(paper, notes);
        let font = paper.font;
        let left = 0.5 * (paper.width - step * columns as f64 + 1.5 * font).max(0.0);
        for (i, note) in notes.iter().enumerate() {
            let x = left + step * (i % columns) as f64;
            let y = top + 1.2 * paper.line() * ((i / columns) as f64 + 0.8);
            let color = ink.series(note.curve.series, &note.curve.color);
            let mark = marker(note.curve.series, x + 0.5 * font, y - 0.33 * font, 0.09 * font);
            m.void("path", &[("d", &mark), ("fill", &color)]);
            let x = x + Note::MARKER * font;
            m.leaf(
                "text",
                &[("x", &Px(x)), ("y", &Px(y)), ("font-weight", &600), ("fill", &color)],
                &note.name,
            );
            let x = x + face::width(&note.name, font) + Note::SPACE * font;
            m.leaf("text", &[("x", &Px(x)), ("y", &Px(y)), ("fill", &ink.color(Role::Quiet))], &note.remark);
        }
    }

    fn draw_grid(&self, m: &mut Markup, ink: Ink, place: &Place, axes: &Axes) {
        let [left, top, right, bottom] = place.panel;
        let (font, pen, paper) = (place.font, place.pen, place.paper.is_some());
        let (grid, text) = (ink.color(Role::Grid), ink.color(Role::Text));
        let below = bottom + if paper { 1.3 * font } else { 18.0 };
        let beside = left - if paper { 0.4 * font } else { 8.0 };
        let [room_x, room_y] = place.room();
        for tick in axes.x.ticks(room_x) {
            let x = Px(axes.x.at_log10(tick.exponent));
            let y2 = if tick.label.is_some() { top } else { bottom - 4.0 * pen };
            line(m, (x, Px(bottom)), (x, Px(y2)), grid, pen);
            if let Some(label) = tick.label {
                m.leaf("text", &[("x", &x), ("y", &Px(below)), ("text-anchor", &"middle")], label);
            }
        }
        for tick in axes.y.ticks(room_y) {
            let y = Px(axes.y.at_log10(tick.exponent));
            let x2 = if tick.label.is_some() { right } else { left + 4.0 * pen };
            line(m, (Px(left), y), (Px(x2), y), grid, pen);
            if let Some(label) = tick.label {
                let y = Px(y.0 + 0.35 * font);
                m.leaf("text", &[("x", &Px(beside)), ("y", &y), ("text-anchor", &"end")], label);
            }
        }
        let middle = Px(0.5 * (left + right));
        m.leaf(
            "text",
            &[("x", &middle), ("y", &Px(place.x_label())), ("text-anchor", &"middle"), ("fill", &text)],
            shortened(&self.x_label, right - left, font),
        );
        let (x, y) = (if paper { font } else { 16.0 }, 0.5 * (top + bottom));
        let turned = format!("rotate(-90 {x:.2} {y:.2})");
        m.leaf(
            "text",
            &[
                ("x", &Px(x)),
                ("y", &Px(y)),
                ("text-anchor", &"middle"),
                ("transform", &turned),
                ("fill", &text),
            ],
            shortened(&self.y_label, bottom - top, font),
        );
    }

    fn draw_reference(&self, m: &mut Markup, ink: Ink, place: &Place, axes: &Axes) {
        let Some((slope, intercept)) = self.reference_line() else { return };
        // In decimal logarithms: y = offset + slope · x.
        let offset = intercept / std::f64::consts::LN_10;
        let (y_of, x_of) = (|x: f64| offset + slope * x, |y: f64| (y - offset) / slope);
        // The part of the line within the panel; it falls to the right.
        let (start, end) = (axes.x.low().max(x_of(axes.y.high())), axes.x.high().min(x_of(axes.y.low())));
        if start >= end {
            return;
        }
        let at = |x: f64| (axes.x.at_log10(x), axes.y.at_log10(y_of(x)));
        let (a, b) = (at(start), at(end));
        let dashes = scaled_dashes("6 5", place.pen);
        m.void(
            "line",
            &[
                ("x1", &Px(a.0)),
                ("y1", &Px(a.1)),
                ("x2", &Px(b.0)),
                ("y2", &Px(b.1)),
                ("stroke", &ink.color(Role::Quiet)),
                ("stroke-width", &place.pen),
                ("stroke-dasharray", &dashes),
            ],
        );
        let (x, y) = (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1));
        let text = format!("slope {}", super::numbers::significant(slope, 1));
        // Within the panel, or not at all.
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        if place.paper.is_some() && dx.hypot(dy) < face::width(&text, place.small) + 4.0 * place.small {
            return;
        }
        let angle = dy.atan2(dx).to_degrees();
        m.leaf(
            "text",
            &[
                ("x", &Px(x)),
                ("y", &Px(y + 1.25 * place.small)),
                ("text-anchor", &"middle"),
                ("font-size", &place.small),
                ("fill", &ink.color(Role::Quiet)),
                ("transform", &format!("rotate({angle:.1} {x:.2} {y:.2})")),
            ],
            text,
        );
    }

    /// Names beside the panel, each at the end of its curve, moved apart where they would overlap.
    fn draw_names(&self, m: &mut Markup, ink: Ink, axes: &Axes) {
        let [_, top, right, bottom] = PANEL;
        let place = Place::FREE;
        let ends: Vec<Option<(f64, f64)>> =
            self.curves.iter().map(|c| drawn_end(c).map(|(x, y)| axes.at(x, y))).collect();
        let wanted: Vec<f64> = ends.iter().map(|e| e.map_or(bottom, |e| e.1)).collect();
        let lines: Vec<Vec<String>> =
            self.curves.iter().map(|c| wrapped(&c.label, NAMES, place.small, 2)).collect();
        let tallest = lines.iter().map(|l| l.len() + 1).max().unwrap_or(1) as f64;
        let room = (bottom - top + 40.0) / self.curves.len() as f64;
        // With many curves only the first line of each name fits; the page lists the slopes in a table too.
        let all_fit = room >= LABEL_LINE * tallest + 3.0;
        let height = if all_fit { LABEL_LINE * tallest + 3.0 } else { room.min(LABEL_LINE) };
        let places = spread(&wanted, top + 10.0, bottom + 50.0 - height, height);
        for (((curve, end), y), lines) in self.curves.iter().zip(&ends).zip(places).zip(&lines) {
            let color = ink.series(curve.series, &curve.color);
            if let Some(end) = end {
                let path = format!(
                    "M{:.1} {:.1}L{:.1} {:.1}L{:.1} {y:.1}",
                    end.0 + 6.0,
                    end.1,
                    right + 4.0,
                    end.1,
                    right + 14.0
                );
                m.void(
                    "path",
                    &[("d", &path), ("fill", &"none"), ("stroke", &color), ("stroke-opacity", &0.45)],
                );
            }
            m.void("path", &[("d", &marker(curve.series, right + 21.0, y, 1.0)), ("fill", &color)]);
            let x = right + 31.0;
            let shown = if all_fit { lines.as_slice() } else { &lines[..lines.len().min(1)] };
            let mut y = y + 4.5;
            for line in shown {
                let attributes: [super::markup::Attribute; 5] =
                    [("x", &x), ("y", &Px(y)), ("font-size", &12), ("font-weight", &600), ("fill", &color)];
                m.leaf("text", &attributes, line);
                y += LABEL_LINE;
            }
            if all_fit {
                let remark = if end.is_some() { curve.remark.as_str() } else { "nothing to draw" };
                let quiet = ink.color(Role::Quiet);
                m.leaf(
                    "text",
                    &[("x", &x), ("y", &Px(y - 0.5)), ("font-size", &11.5), ("fill", &quiet)],
                    remark,
                );
            }
        }
    }
}

/// The last point of a curve's mean that can be drawn.
fn drawn_end(curve: &Curve) -> Option<(f64, f64)> {
    curve.mean.iter().rev().find(|p| drawable(p.x, p.y)).map(|p| (p.x, p.y))
}

fn line(m: &mut Markup, a: (Px, Px), b: (Px, Px), color: &str, width: f64) {
    m.void(
        "line",
        &[
            ("x1", &a.0),
            ("y1", &a.1),
            ("x2", &b.0),
            ("y2", &b.1),
            ("stroke", &color),
            ("stroke-width", &width),
        ],
    );
}

fn frame(m: &mut Markup, ink: Ink, place: &Place) {
    let [left, top, right, bottom] = place.panel;
    m.void(
        "rect",
        &[
            ("x", &left),
            ("y", &top),
            ("width", &(right - left)),
            ("height", &(bottom - top)),
            ("fill", &"none"),
            ("stroke", &ink.color(Role::Quiet)),
            ("stroke-width", &place.pen),
        ],
    );
}

impl Note<'_> {
    /// Room for the marker, and between name and remark, in sizes of the letters.
    const MARKER: f64 = 1.4;
    const SPACE: f64 = 0.8;

    fn width(&self, font: f64) -> f64 {
        let texts = face::width(&self.name, font) + face::width(&self.remark, font);
        texts + (Self::MARKER + Self::SPACE) * font
    }
}

/// Positions near the wanted ones, at least `gap` apart, within `low` and `high` where they fit.
fn spread(wanted: &[f64], low: f64, high: f64, gap: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|a, b| wanted[*a].total_cmp(&wanted[*b]));
    let mut out = wanted.to_vec();
    let mut least = low;
    for &i in &order {
        out[i] = wanted[i].max(least);
        least = out[i] + gap;
    }
    let mut most = high;
    for &i in order.iter().rev() {
        out[i] = out[i].min(most);
        most = out[i] - gap;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::curve::MeanPoint;
    use super::super::markup::imbalance;
    use super::*;

    fn curve(label: &str, series: usize, scale: f64) -> Curve {
        let mean = (0..6).map(|i| {
            let x = 2f64.powi(i);
            MeanPoint { x, y: scale / x, interval: Some((0.8 * scale / x, 1.2 * scale / x)) }
        });
        let mean: Vec<_> = mean.collect();
        let runs = vec![mean.iter().map(|p| (p.x, 1.1 * p.y)).collect(); 3];
        Curve {
            label: label.into(),
            series,
            color: "#0072b2".into(),
            runs,
            mean,
            remark: "slope −1.00 ± 0.05".into(),
        }
    }

    fn plot(curves: Vec<Curve>) -> Plot {
        Plot {
            title: "relMSE against samples".into(),
            x_label: "samples per pixel".into(),
            y_label: "relMSE".into(),
            curves,
            reference_slope: Some(-1.0),
        }
    }

    #[test]
    fn draws_what_it_is_given() {
        let svg = plot(vec![curve("pt", 0, 1.0), curve("bpt <&>", 1, 0.5)]).file(None);
        assert_eq!(imbalance(&svg), None);
        assert!(svg.contains("bpt &lt;&amp;&gt;") && svg.contains("slope −1.00 ± 0.05"));
        assert!(svg.contains("stroke-dasharray=\"6 5\""), "the reference line");
        assert!(!svg.contains("var(") && !svg.contains("NaN") && !svg.contains("inf"));
        assert!(plot(vec![curve("pt", 0, 1.0)]).inline().contains("var(--series-0)"));
    }

    #[test]
    fn zero_nan_and_infinity_leave_a_plot() {
        let mut c = curve("pt", 0, 1.0);
        c.mean[2].y = 0.0;
        c.mean[3].y = f64::NAN;
        c.runs[0][1].1 = f64::INFINITY;
        c.mean[4].interval = Some((-1.0, f64::NAN));
        let p = plot(vec![c]);
        assert_eq!(p.undrawable(), 3);
        let svg = p.file(None);
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        let mut c = curve("pt", 0, 1.0);
        c.mean.iter_mut().for_each(|p| p.y = 0.0);
        c.runs.clear();
        let svg = plot(vec![c]).file(None);
        assert!(svg.contains("no positive finite value") && imbalance(&svg).is_none());
    }

    #[test]
    fn very_different_magnitudes_fit() {
        let svg = plot(vec![curve("a", 0, 1e-9), curve("b", 1, 1e9)]).file(None);
        for value in svg.split(['"', ' ', 'L', 'M']).filter_map(|s| s.parse::<f64>().ok()) {
            assert!((-70.0..=800.0).contains(&value), "{value} is off the figure");
        }
    }

    #[test]
    fn many_curves_keep_their_names_apart() {
        let curves: Vec<Curve> = (0..14).map(|i| curve(&format!("estimator number {i}"), i, 1.0)).collect();
        let svg = plot(curves).file(None);
        let names = svg.split("<text ").filter(|t| t.contains(">estimator number"));
        let mut ys: Vec<f64> = names
            .map(|t| t.split("y=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap())
            .collect();
        ys.sort_by(f64::total_cmp);
        assert_eq!(ys.len(), 14);
        assert!(ys.windows(2).all(|w| w[1] - w[0] > 13.9) && ys[13] < HEIGHT, "{ys:?}");
    }

    #[test]
    fn labels_are_spread() {
        let out = spread(&[10.0, 11.0, 12.0, 300.0], 0.0, 310.0, 34.0);
        let mut sorted = out.clone();
        sorted.sort_by(f64::total_cmp);
        assert!(sorted.windows(2).all(|w| w[1] - w[0] >= 33.999), "{out:?}");
        assert_eq!(spread(&[300.0, 301.0], 0.0, 310.0, 34.0), [276.0, 310.0]);
    }
}
