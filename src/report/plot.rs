//! Log-log plots of error against samples or time, as SVG written by hand.

use super::axis::LogAxis;
use super::curve::{Axes, Curve, Px, draw_band, draw_mean, draw_runs, drawable};
use super::markup::Markup;
use super::numbers::shortened;
use super::palette::{Ink, Role, marker};

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

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 400.0;
/// The panel within the figure: left, top, right, bottom. To its right, the names of the curves.
const PANEL: [f64; 4] = [72.0, 34.0, 500.0, 346.0];
/// Characters of a line of a name that fit beside the panel.
const NAME_LENGTH: usize = 22;
/// Height of a line of a name, or of its remark.
const LABEL_LINE: f64 = 15.0;
const FONT: &str = "system-ui, 'Segoe UI', 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif";

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

    fn axes(&self) -> Option<Axes> {
        let low = self.drawn().map(|p| p.1).fold(f64::INFINITY, f64::min);
        let band =
            self.curves.iter().flat_map(|c| &c.mean).filter_map(|p| p.interval).flat_map(|(a, b)| [a, b]);
        // An interval that reaches down to nothing must not stretch the axis by decades.
        let band = band.filter(|v| *v >= 0.5 * low);
        let line = self.reference_line().map(|c| {
            let mean_x = self.drawn().map(|p| p.0.ln()).sum::<f64>() / self.drawn().count().max(1) as f64;
            (c.1 + c.0 * mean_x).exp()
        });
        let ys: Vec<f64> = self.drawn().map(|p| p.1).chain(band).chain(line).collect();
        Some(Axes {
            x: LogAxis::covering(self.drawn().map(|p| p.0), PANEL[0], PANEL[2])?,
            y: LogAxis::covering(ys, PANEL[3], PANEL[1])?,
        })
    }

    /// Slope and intercept (natural logarithms) of the line of the reference slope that lies just under all means.
    fn reference_line(&self) -> Option<(f64, f64)> {
        let slope = self.reference_slope?;
        let means = self.curves.iter().flat_map(|c| &c.mean).filter(|p| drawable(p.x, p.y));
        let lowest = means.map(|p| p.y.ln() - slope * p.x.ln()).fold(f64::INFINITY, f64::min);
        lowest.is_finite().then_some((slope, lowest - 2f64.ln()))
    }

    /// The figure as an SVG element; with `Ink::Paper`, as the content of a file of its own.
    pub fn svg(&self, ink: Ink) -> String {
        let names: Vec<&str> = self.curves.iter().map(|c| c.label.as_str()).collect();
        let about = format!(
            "{}: {} against {} for {}, both axes logarithmic",
            self.title,
            self.y_label,
            self.x_label,
            names.join(", ")
        );
        let view = format!("0 0 {WIDTH} {HEIGHT}");
        let mut m = Markup::default();
        m.tag(
            "svg",
            &[
                ("xmlns", &"http://www.w3.org/2000/svg"),
                ("viewBox", &view),
                ("width", &WIDTH),
                ("height", &HEIGHT),
                ("role", &"img"),
                ("font-family", &FONT),
                ("font-size", &13),
                ("fill", &ink.color(Role::Text)),
            ],
            |m| {
                m.leaf("title", &[], &about);
                if ink == Ink::Paper {
                    m.void(
                        "rect",
                        &[("width", &WIDTH), ("height", &HEIGHT), ("fill", &ink.color(Role::Ground))],
                    );
                }
                m.leaf(
                    "text",
                    &[("x", &PANEL[0]), ("y", &20), ("font-size", &15), ("font-weight", &600)],
                    shortened(&self.title, 70),
                );
                match self.axes() {
                    Some(axes) => self.draw(m, ink, &axes),
                    None => Self::draw_nothing(m, ink),
                }
            },
        );
        let mut text = m.into_string();
        if ink == Ink::Page {
            // Inline SVG needs no namespace, and the page is to hold no address at all.
            text = text.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1);
        }
        text
    }

    fn draw_nothing(m: &mut Markup, ink: Ink) {
        let [left, top, right, bottom] = PANEL;
        frame(m, ink);
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

    fn draw(&self, m: &mut Markup, ink: Ink, axes: &Axes) {
        self.draw_grid(m, ink, axes);
        self.draw_reference(m, ink, axes);
        for curve in &self.curves {
            draw_runs(m, ink, axes, curve);
        }
        for curve in &self.curves {
            draw_band(m, ink, axes, curve);
        }
        for curve in &self.curves {
            draw_mean(m, ink, axes, curve);
        }
        frame(m, ink);
        self.draw_names(m, ink, axes);
    }

    fn draw_grid(&self, m: &mut Markup, ink: Ink, axes: &Axes) {
        let [left, top, right, bottom] = PANEL;
        let (grid, text) = (ink.color(Role::Grid), ink.color(Role::Text));
        for tick in axes.x.ticks(44.0) {
            let x = Px(axes.x.at_log10(tick.exponent));
            let (y2, width) = if tick.label.is_some() { (top, 1.0) } else { (bottom - 4.0, 1.0) };
            line(m, (x, Px(bottom)), (x, Px(y2)), grid, width);
            if let Some(label) = tick.label {
                m.leaf("text", &[("x", &x), ("y", &(bottom + 18.0)), ("text-anchor", &"middle")], label);
            }
        }
        for tick in axes.y.ticks(22.0) {
            let y = Px(axes.y.at_log10(tick.exponent));
            let x2 = if tick.label.is_some() { right } else { left + 4.0 };
            line(m, (Px(left), y), (Px(x2), y), grid, 1.0);
            if let Some(label) = tick.label {
                m.leaf(
                    "text",
                    &[("x", &(left - 8.0)), ("y", &Px(y.0 + 4.5)), ("text-anchor", &"end")],
                    label,
                );
            }
        }
        let middle = 0.5 * (left + right);
        m.leaf(
            "text",
            &[("x", &middle), ("y", &(bottom + 42.0)), ("text-anchor", &"middle"), ("fill", &text)],
            &self.x_label,
        );
        let turned = format!("rotate(-90 16 {:.1})", 0.5 * (top + bottom));
        m.leaf(
            "text",
            &[
                ("x", &16),
                ("y", &Px(0.5 * (top + bottom))),
                ("text-anchor", &"middle"),
                ("transform", &turned),
                ("fill", &text),
            ],
            &self.y_label,
        );
    }

    fn draw_reference(&self, m: &mut Markup, ink: Ink, axes: &Axes) {
        let Some((slope, intercept)) = self.reference_line() else { return };
        // In decimal logarithms: y = offset + slope · x.
        let offset = intercept / std::f64::consts::LN_10;
        let (y_of, x_of) = (|x: f64| offset + slope * x, |y: f64| (y - offset) / slope);
        // The part of the line within the panel; it falls to the right.
        let (start, end) = (axes.x.low().max(x_of(axes.y.high())), axes.x.high().min(x_of(axes.y.low())));
        if start >= end {
            return;
        }
        let place = |x: f64| (axes.x.at_log10(x), axes.y.at_log10(y_of(x)));
        let (a, b) = (place(start), place(end));
        m.void(
            "line",
            &[
                ("x1", &Px(a.0)),
                ("y1", &Px(a.1)),
                ("x2", &Px(b.0)),
                ("y2", &Px(b.1)),
                ("stroke", &ink.color(Role::Quiet)),
                ("stroke-dasharray", &"6 5"),
            ],
        );
        let (x, y) = (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1));
        let angle = (b.1 - a.1).atan2(b.0 - a.0).to_degrees();
        m.leaf(
            "text",
            &[
                ("x", &Px(x)),
                ("y", &Px(y + 15.0)),
                ("text-anchor", &"middle"),
                ("font-size", &12),
                ("fill", &ink.color(Role::Quiet)),
                ("transform", &format!("rotate({angle:.1} {x:.1} {y:.1})")),
            ],
            format!("slope {}", super::numbers::significant(slope, 1)),
        );
    }

    /// Names beside the panel, each at the end of its curve, moved apart where they would overlap.
    fn draw_names(&self, m: &mut Markup, ink: Ink, axes: &Axes) {
        let [_, top, right, bottom] = PANEL;
        let ends: Vec<Option<(f64, f64)>> = self
            .curves
            .iter()
            .map(|c| c.mean.iter().rev().find(|p| drawable(p.x, p.y)).map(|p| axes.at(p.x, p.y)))
            .collect();
        let wanted: Vec<f64> = ends.iter().map(|e| e.map_or(bottom, |e| e.1)).collect();
        let lines: Vec<Vec<String>> = self.curves.iter().map(|c| wrapped(&c.label, NAME_LENGTH)).collect();
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
            m.void("path", &[("d", &marker(curve.series, right + 21.0, y)), ("fill", &color)]);
            let x = right + 31.0;
            let shown = if all_fit { lines.as_slice() } else { &lines[..1] };
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

fn frame(m: &mut Markup, ink: Ink) {
    let [left, top, right, bottom] = PANEL;
    m.void(
        "rect",
        &[
            ("x", &left),
            ("y", &top),
            ("width", &(right - left)),
            ("height", &(bottom - top)),
            ("fill", &"none"),
            ("stroke", &ink.color(Role::Quiet)),
        ],
    );
}

/// A name on one line or two, broken between words; cut where it is longer.
fn wrapped(name: &str, length: usize) -> Vec<String> {
    if name.chars().count() <= length {
        return vec![name.to_owned()];
    }
    let mut first = String::new();
    for word in name.split_whitespace() {
        if !first.is_empty() && first.chars().count() + 1 + word.chars().count() > length {
            break;
        }
        if !first.is_empty() {
            first.push(' ');
        }
        first.push_str(word);
    }
    // As many words as went to the first line.
    let rest: Vec<&str> = name.split_whitespace().skip(first.split_whitespace().count()).collect();
    let lines = [first, rest.join(" ")];
    lines.iter().filter(|l| !l.is_empty()).map(|l| shortened(l, length)).collect()
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
        let svg = plot(vec![curve("pt", 0, 1.0), curve("bpt <&>", 1, 0.5)]).svg(Ink::Paper);
        assert_eq!(imbalance(&svg), None);
        assert!(svg.contains("bpt &lt;&amp;&gt;") && svg.contains("slope −1.00 ± 0.05"));
        assert!(svg.contains("stroke-dasharray=\"6 5\""), "the reference line");
        assert!(!svg.contains("var(") && !svg.contains("NaN") && !svg.contains("inf"));
        assert!(plot(vec![curve("pt", 0, 1.0)]).svg(Ink::Page).contains("var(--series-0)"));
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
        let svg = p.svg(Ink::Paper);
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        let mut c = curve("pt", 0, 1.0);
        c.mean.iter_mut().for_each(|p| p.y = 0.0);
        c.runs.clear();
        let svg = plot(vec![c]).svg(Ink::Paper);
        assert!(svg.contains("no positive finite value") && imbalance(&svg).is_none());
    }

    #[test]
    fn very_different_magnitudes_fit() {
        let svg = plot(vec![curve("a", 0, 1e-9), curve("b", 1, 1e9)]).svg(Ink::Paper);
        for value in svg.split(['"', ' ', 'L', 'M']).filter_map(|s| s.parse::<f64>().ok()) {
            assert!((-70.0..=800.0).contains(&value), "{value} is off the figure");
        }
    }

    #[test]
    fn long_names_take_two_lines() {
        assert_eq!(wrapped("path tracing", 22), ["path tracing"]);
        assert_eq!(wrapped("bidirectional path tracing", 22), ["bidirectional path", "tracing"]);
        assert_eq!(wrapped("x".repeat(30).as_str(), 5), ["xxxx…"]);
        assert_eq!(wrapped("one two three four five six seven", 9), ["one two", "three fo…"]);
        assert_eq!(wrapped("", 9), [""]);
    }

    #[test]
    fn many_curves_keep_their_names_apart() {
        let curves: Vec<Curve> = (0..14).map(|i| curve(&format!("estimator number {i}"), i, 1.0)).collect();
        let svg = plot(curves).svg(Ink::Paper);
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
