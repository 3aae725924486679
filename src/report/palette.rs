//! Colours and markers of figures: told apart by people with any colour vision [Okabe & Ito 2008], by marker and by
//! dashes too, so that they survive a black-and-white print.

/// Where a figure is shown: it then takes its colours from the page, or carries its own.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Ink {
    /// In the page: CSS variables, which follow the reader's light or dark setting.
    Page,
    /// A file of its own, on white paper; programs that read SVG rarely know CSS variables.
    Paper,
}

/// What is drawn.
#[derive(Clone, Copy)]
pub(super) enum Role {
    /// Text and axes.
    Text,
    /// Secondary text.
    Quiet,
    /// Grid lines and frames.
    Grid,
    /// Behind everything.
    Ground,
}

/// Colours for estimators whose own is not a colour.
const SERIES: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#b0578f", "#b58900", "#3f8fbf", "#5c5c5c"];

/// The colour `#rrggbb`, or where the text is none, that of the n-th estimator.
pub(super) fn series_color(color: &str, i: usize) -> String {
    let digits = color.strip_prefix('#').unwrap_or_default();
    if digits.len() == 6 && digits.chars().all(|c| c.is_ascii_hexdigit()) {
        color.to_ascii_lowercase()
    } else {
        SERIES[i % SERIES.len()].into()
    }
}

/// Dashes of the second, third … round through the colours.
const DASHES: [&str; 4] = ["none", "7 3", "2 3", "9 3 2 3"];

impl Ink {
    /// The colour of what is drawn, as an SVG attribute's value.
    pub fn color(self, role: Role) -> &'static str {
        let (variable, paper) = match role {
            Role::Text => ("var(--text)", "#1b1f24"),
            Role::Quiet => ("var(--quiet)", "#59636e"),
            Role::Grid => ("var(--grid)", "#d5dae0"),
            Role::Ground => ("var(--ground)", "#ffffff"),
        };
        if self == Self::Page { variable } else { paper }
    }

    /// The colour of the n-th estimator, which is `paper` on paper.
    pub fn series(self, i: usize, paper: &str) -> String {
        if self == Self::Page { format!("var(--series-{i})") } else { paper.to_owned() }
    }
}

/// Dash pattern of the n-th estimator's line.
pub(super) fn dashes(i: usize) -> &'static str {
    DASHES[i / SERIES.len() % DASHES.len()]
}

/// Outline of the n-th estimator's marker about a point, so many times as large, as SVG path data.
pub(super) fn marker(i: usize, x: f64, y: f64, scale: f64) -> String {
    let polygon = |corners: &[(f64, f64)]| {
        let points: Vec<String> =
            corners.iter().map(|(dx, dy)| format!("{:.2} {:.2}", x + scale * dx, y + scale * dy)).collect();
        format!("M{}Z", points.join("L"))
    };
    match i % SERIES.len() {
        0 => {
            let (r, d) = (3.6 * scale, 7.2 * scale);
            format!("M{:.2} {y:.2}a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0Z", x - r)
        }
        1 => polygon(&[(-3.2, -3.2), (3.2, -3.2), (3.2, 3.2), (-3.2, 3.2)]),
        2 => polygon(&[(0.0, -4.4), (4.2, 3.0), (-4.2, 3.0)]),
        3 => polygon(&[(0.0, -4.6), (4.6, 0.0), (0.0, 4.6), (-4.6, 0.0)]),
        4 => polygon(&[(0.0, 4.4), (4.2, -3.0), (-4.2, -3.0)]),
        5 => polygon(&[(-2.2, -4.0), (2.2, -4.0), (4.4, 0.0), (2.2, 4.0), (-2.2, 4.0), (-4.4, 0.0)]),
        _ => polygon(&[(-4.4, 3.4), (0.0, -1.0), (4.4, 3.4), (4.4, -0.4), (0.0, -4.8), (-4.4, -0.4)]),
    }
}

/// The page's colour variables of the estimators: on a light ground as they are, on a dark one mixed with white.
pub(super) fn css_variables(colors: &[String]) -> String {
    let list = |color: fn(&str) -> String| -> String {
        colors.iter().enumerate().map(|(i, c)| format!("--series-{i}:{};", color(c))).collect()
    };
    let light = list(|c| c.to_owned());
    let dark = list(|c| format!("color-mix(in oklab,{c} 68%,white)"));
    format!(":root{{{light}}}@media (prefers-color-scheme:dark){{:root{{{dark}}}}}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_colours_reach_the_page() {
        assert_eq!(series_color("#AABB09", 0), "#aabb09");
        for bad in ["", "red", "#12345", "#12345g", "#1234567", "#123456;}"] {
            assert_eq!(series_color(bad, 8), SERIES[1], "{bad}");
        }
    }
}
