//! The curves of a plot: what they hold, and how they are drawn.

use super::axis::LogAxis;
use super::markup::Markup;
use super::palette::{Ink, Role, dashes, marker};

/// A point of a mean curve with its interval; no interval with one run.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeanPoint {
    /// Samples or seconds.
    pub x: f64,
    /// Mean error.
    pub y: f64,
    /// Lower and upper end of the interval.
    pub interval: Option<(f64, f64)>,
}

/// The curves of one estimator.
#[derive(Clone, Debug, Default)]
pub(super) struct Curve {
    /// Its name.
    pub label: String,
    /// Number of its marker and of its colour in the page.
    pub series: usize,
    /// Its colour on paper, `#rrggbb`.
    pub color: String,
    /// Each run alone: drawn faintly.
    pub runs: Vec<Vec<(f64, f64)>>,
    /// Mean over the runs.
    pub mean: Vec<MeanPoint>,
    /// A second line under the name, such as the fitted slope.
    pub remark: String,
}

/// An axis both ways.
pub(super) struct Axes {
    /// To the right.
    pub x: LogAxis,
    /// Upwards.
    pub y: LogAxis,
    /// Widths of lines and sizes of markers, in those of a plot without a paper.
    pub pen: f64,
}

impl Axes {
    /// Where a point lies.
    pub fn at(&self, x: f64, y: f64) -> (f64, f64) {
        (self.x.at(x), self.y.at(y))
    }
}

/// Whether a point has a place on logarithmic axes.
pub(super) fn drawable(x: f64, y: f64) -> bool {
    x.is_finite() && x > 0.0 && y.is_finite() && y > 0.0
}

/// A coordinate with as many decimals as can be seen.
#[derive(Clone, Copy)]
pub(super) struct Px(pub f64);

impl std::fmt::Display for Px {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.2}", self.0)
    }
}

/// Straight pieces through the points that can be drawn, broken where one cannot.
fn polyline(axes: &Axes, points: impl Iterator<Item = (f64, f64)>) -> String {
    let mut path = String::new();
    let mut pen_down = false;
    for (x, y) in points {
        if drawable(x, y) {
            let (px, py) = axes.at(x, y);
            path.push_str(&format!("{}{px:.2} {py:.2}", if pen_down { 'L' } else { 'M' }));
        }
        pen_down = drawable(x, y);
    }
    path
}

/// A dash pattern, or `none`, for lines so many times as wide.
pub(super) fn scaled_dashes(pattern: &str, by: f64) -> String {
    let scaled =
        pattern.split(' ').map(|n| n.parse().map_or_else(|_| n.to_owned(), |n: f64| (n * by).to_string()));
    scaled.collect::<Vec<_>>().join(" ")
}

/// Each run, faintly.
pub(super) fn draw_runs(m: &mut Markup, ink: Ink, axes: &Axes, curve: &Curve) {
    for run in &curve.runs {
        let path = polyline(axes, run.iter().copied());
        if !path.is_empty() {
            m.void(
                "path",
                &[
                    ("d", &path),
                    ("fill", &"none"),
                    ("stroke", &ink.series(curve.series, &curve.color)),
                    ("stroke-width", &axes.pen),
                    ("stroke-opacity", &0.3),
                    ("stroke-linejoin", &"round"),
                ],
            );
        }
    }
}

/// The interval of the mean as a band; of a single point as a bar.
pub(super) fn draw_band(m: &mut Markup, ink: Ink, axes: &Axes, curve: &Curve) {
    let clamp = |v: f64| v.clamp(10f64.powf(axes.y.low()), 10f64.powf(axes.y.high()));
    let points: Vec<_> = curve
        .mean
        .iter()
        .filter(|p| drawable(p.x, p.y))
        .filter_map(|p| p.interval.map(|(a, b)| (p.x, clamp(a), clamp(b))))
        .filter(|(_, a, b)| a.is_finite() && b.is_finite())
        .collect();
    let corner = |(x, y): (f64, f64)| {
        let (x, y) = axes.at(x, y);
        format!("{x:.2} {y:.2}")
    };
    let color = ink.series(curve.series, &curve.color);
    if let [(x, a, b)] = points[..] {
        let path = format!("M{}L{}", corner((x, a)), corner((x, b)));
        let width = 5.0 * axes.pen;
        m.void(
            "path",
            &[("d", &path), ("stroke", &color), ("stroke-width", &width), ("stroke-opacity", &0.25)],
        );
    } else if points.len() > 1 {
        let there = points.iter().map(|p| corner((p.0, p.2)));
        let back = points.iter().rev().map(|p| corner((p.0, p.1)));
        let path = format!("M{}Z", there.chain(back).collect::<Vec<_>>().join("L"));
        m.void("path", &[("d", &path), ("fill", &color), ("fill-opacity", &0.16)]);
    }
}

/// The mean, boldly, with a marker at each point.
pub(super) fn draw_mean(m: &mut Markup, ink: Ink, axes: &Axes, curve: &Curve) {
    let color = ink.series(curve.series, &curve.color);
    let path = polyline(axes, curve.mean.iter().map(|p| (p.x, p.y)));
    if !path.is_empty() {
        m.void(
            "path",
            &[
                ("d", &path),
                ("fill", &"none"),
                ("stroke", &color),
                ("stroke-width", &(2.4 * axes.pen)),
                ("stroke-linejoin", &"round"),
                ("stroke-dasharray", &scaled_dashes(dashes(curve.series), axes.pen)),
            ],
        );
    }
    let places = curve.mean.iter().filter(|p| drawable(p.x, p.y)).map(|p| axes.at(p.x, p.y));
    let markers: String = places.map(|(x, y)| marker(curve.series, x, y, axes.pen)).collect();
    if !markers.is_empty() {
        m.void(
            "path",
            &[
                ("d", &markers),
                ("fill", &color),
                ("stroke", &ink.color(Role::Ground)),
                ("stroke-width", &(0.8 * axes.pen)),
            ],
        );
    }
}
