//! Texts of a figure as outlines, for its SVG file.
//!
//! A font within an SVG (`@font-face`) is read by browsers, but neither by Inkscape nor by what most programs that set papers convert SVG
//! with: they would take another font, of other widths. Outlines look the same in all of them; the PDF has its text as text. What is
//! written stays in the element's label, for those who cannot see it.

use super::face::{self, BOLD};
use super::markup::Markup;
use super::pdf::{Element, elements, unescaped};
use std::fmt::Write as _;
use ttf_parser::OutlineBuilder;

/// An SVG of this report with each `text` as a `path`.
pub(super) fn outlined(svg: &str) -> String {
    let mut size = 13.0;
    let mut ink = "#000000";
    let mut out = String::with_capacity(svg.len());
    let mut rest = svg;
    if let Some(root) = elements(svg).first() {
        size = root.or("font-size", size);
        ink = root.attributes.get("fill").copied().unwrap_or(ink);
    }
    while let Some(at) = rest.find("<text ") {
        out.push_str(&rest[..at]);
        let end = rest.find("</text>").map_or(rest.len(), |e| e + "</text>".len());
        if let Some(element) = elements(&rest[at..end]).first() {
            out.push_str(&path(element, size, ink));
        }
        rest = &rest[end..];
    }
    out.push_str(rest);
    out
}

fn path(e: &Element, size: f64, ink: &str) -> String {
    let size = e.or("font-size", size);
    let text = unescaped(e.text);
    let (mut pen, start) = (Data::default(), e.or("x", 0.0) + e.shift(face::width(&text, size)));
    (pen.x, pen.y) = (start, e.or("y", 0.0));
    face::outline(&text, size, &mut pen);
    let fill = e.attributes.get("fill").copied().unwrap_or(ink);
    let width = (1000.0 * BOLD * size).round() / 1000.0;
    let turn = e.attributes.get("transform").copied().unwrap_or_default();
    let mut attributes: Vec<super::markup::Attribute> =
        vec![("role", &"img"), ("aria-label", &text), ("d", &pen.text), ("fill", &fill)];
    if e.is_bold() {
        attributes.extend::<[super::markup::Attribute; 2]>([("stroke", &fill), ("stroke-width", &width)]);
    }
    if !turn.is_empty() {
        attributes.push(("transform", &turn));
    }
    let mut m = Markup::default();
    m.void("path", &attributes);
    m.into_string()
}

/// Path data.
#[derive(Default)]
struct Data {
    text: String,
    x: f64,
    y: f64,
}

impl Data {
    fn step(&mut self, letter: char, points: &[(f32, f32)]) {
        self.text.push(letter);
        for (i, (x, y)) in points.iter().enumerate() {
            let space = if i == 0 { "" } else { " " };
            let _ = write!(self.text, "{space}{:.2} {:.2}", self.x + f64::from(*x), self.y + f64::from(*y));
        }
    }
}

impl OutlineBuilder for Data {
    fn move_to(&mut self, x: f32, y: f32) {
        self.step('M', &[(x, y)]);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        self.step('L', &[(x, y)]);
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.step('Q', &[(x1, y1), (x, y)]);
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.step('C', &[(x1, y1), (x2, y2), (x, y)]);
    }
    fn close(&mut self) {
        self.step('Z', &[]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_become_outlines_where_they_stand() {
        let svg = "<svg viewBox=\"0 0 100 50\" font-size=\"10\" fill=\"#010203\"><text x=\"50\" y=\"20\" text-anchor=\"middle\">HH &amp; \
                   H</text><rect width=\"1\" height=\"2\"/><text x=\"5\" y=\"40\" font-weight=\"600\">b</text></svg>";
        let out = outlined(svg);
        assert_eq!(super::super::markup::imbalance(&out), None);
        assert!(!out.contains("<text") && out.contains("aria-label=\"HH &amp; H\"") && out.contains("<rect"));
        assert_eq!(out.matches("fill=\"#010203\"").count(), 3, "{out}");
        assert_eq!(out.matches("stroke-width=\"0.35\"").count(), 1);
        let first = out.split(" d=\"").nth(1).unwrap().split('"').next().unwrap();
        let numbers: Vec<f64> = first
            .split(|c: char| c.is_ascii_alphabetic() || c == ' ')
            .filter_map(|n| n.parse().ok())
            .collect();
        let xs: Vec<f64> = numbers.iter().step_by(2).copied().collect();
        let (low, high) = (xs.iter().copied().fold(100.0, f64::min), xs.iter().copied().fold(0.0, f64::max));
        assert!((low + high - 100.0).abs() < 1.0 && high - low > 20.0, "centred: {low} {high}");
    }
}
