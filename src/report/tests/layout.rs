//! Figures as they are laid out for a paper: letters of one size, everything on the page, no text over another.

use super::super::context::Context;
use super::super::face::{EXTENT, set};
use super::super::page;
use super::super::paper::{CENTIMETRE, LEAST_IMAGE};
use super::super::pdf::{Element, elements, unescaped, view};
use super::synthetic::{Options, results};
use crate::experiment::results::{Crop, Results};
use std::path::Path;

const NAMES: [(&str, &str); 9] = [
    ("pt", "path tracing"),
    ("lt", "light tracing"),
    ("bpt", "bidirectional path tracing"),
    ("upbp", "UPBP"),
    ("beams", "BPT + photon beams"),
    ("vcm", "vertex connection and merging with a long name"),
    ("sppm", "SPPM"),
    ("unbroken", "Unbreakableestimatornameofmanyletters"),
    ("last", "one more"),
];

/// The figures of a page with so many estimators and letters of a size.
fn figures(dir: &Path, count: usize, width_cm: f64, font_pt: Option<f64>) -> Vec<(String, String)> {
    let estimators = NAMES[..count].to_vec();
    let mut r: Results = results(dir, &Options { estimators, size: (24, 18), ..Options::default() });
    (r.figures.width_cm, r.figures.font_pt) = (Some(width_cm), font_pt);
    let crop = |name: &str, x, y| Crop { name: name.into(), x, y, width: 6, height: 6 };
    r.scenes[0].crops = vec![crop("ball", 5, 8), crop("wall", 1, 2), crop("light", 10, 0)];
    let mut context = Context::new(dir, &r);
    page::page(&mut context);
    assert!(context.figures.len() >= 8, "{}", context.figures.len());
    context.figures
}

/// Left, top, right and bottom of an area.
type Area = [f64; 4];

fn size(e: &Element, whole: f64) -> f64 {
    e.or("font-size", whole)
}

/// Where a text is, by its glyphs; turned ones by the area about them.
fn area(e: &Element, size: f64) -> Area {
    let width = size * set(&unescaped(e.text)).1;
    let (x, y) = (e.or("x", 0.0) + e.shift(width), e.or("y", 0.0));
    let plain = [x, y - EXTENT[0] * size, x + width, y + EXTENT[1] * size];
    let Some(turn) = e.attributes.get("transform").and_then(|t| t.strip_prefix("rotate(")) else {
        return plain;
    };
    let numbers: Vec<f64> = turn.trim_end_matches(')').split(' ').map(|n| n.parse().unwrap()).collect();
    let ((sin, cos), [cx, cy]) = (numbers[0].to_radians().sin_cos(), [numbers[1], numbers[2]]);
    let corners = [[0, 1], [2, 1], [2, 3], [0, 3]].map(|[i, j]| {
        let (dx, dy) = (plain[i] - cx, plain[j] - cy);
        [cx + cos * dx - sin * dy, cy + sin * dx + cos * dy]
    });
    let of = |i: usize, f: fn(f64, f64) -> f64| corners.iter().map(|c| c[i]).reduce(f).unwrap();
    [of(0, f64::min), of(1, f64::min), of(0, f64::max), of(1, f64::max)]
}

fn inside(a: &Area, page: [f64; 2]) -> bool {
    const ROUNDING: f64 = 0.05;
    a[0] >= -ROUNDING && a[1] >= -ROUNDING && a[2] <= page[0] + ROUNDING && a[3] <= page[1] + ROUNDING
}

fn overlap(a: &Area, b: &Area) -> bool {
    const ROUNDING: f64 = 0.05;
    a[0] < b[2] - ROUNDING && b[0] < a[2] - ROUNDING && a[1] < b[3] - ROUNDING && b[1] < a[3] - ROUNDING
}

fn check(name: &str, svg: &str, width_cm: f64, font: f64) {
    let page = view(svg).unwrap();
    assert!((page[0] - width_cm * CENTIMETRE).abs() < 1e-3, "{name} is not laid out at its width");
    let all = elements(svg);
    let whole = all[0].or("font-size", 0.0);
    let texts: Vec<(String, Area)> = all
        .iter()
        .filter(|e| e.name == "text")
        .map(|e| {
            assert_eq!(size(e, whole), font, "{name}: {}", e.text);
            (e.text.to_owned(), area(e, font))
        })
        .collect();
    assert!(!texts.is_empty(), "{name} has no text");
    for (i, (text, a)) in texts.iter().enumerate() {
        assert!(inside(a, page), "{name}: '{text}' at {a:?} is not on the page {page:?}");
        for (other, b) in &texts[i + 1..] {
            assert!(!overlap(a, b), "{name}: '{text}' at {a:?} and '{other}' at {b:?}");
        }
    }
    for e in all.iter().filter(|e| e.name == "image") {
        let [x, y, w, h] = ["x", "y", "width", "height"].map(|k| e.number(k).unwrap());
        assert!(inside(&[x, y, x + w, y + h], page), "{name}: an image is not on the page");
        assert!(w >= LEAST_IMAGE - font, "{name}: an image of {w} points");
    }
}

#[test]
fn figures_are_laid_out_for_columns_and_pages() {
    for (count, width_cm, font) in [
        (3, 8.5, None),
        (4, 8.5, None),
        (9, 8.5, None),
        (3, 17.8, None),
        (4, 17.8, None),
        (9, 17.8, None),
        (4, 8.5, Some(9.5)),
    ] {
        let dir = tempfile::tempdir().unwrap();
        for (name, svg) in figures(dir.path(), count, width_cm, font) {
            check(&format!("{count} at {width_cm} cm, {name}"), &svg, width_cm, font.unwrap_or(7.0));
        }
    }
}

#[test]
fn parts_have_letters_and_errors() {
    let dir = tempfile::tempdir().unwrap();
    let all = figures(dir.path(), 4, 8.5, None);
    let (_, crops) = all.iter().find(|(name, _)| name.ends_with("-crops")).unwrap();
    for letter in ["A", "B", "C"] {
        let there = crops.matches(&format!(">{letter}</text>")).count();
        assert!(there >= 2, "{letter} in the image and at its row: {there}");
    }
    assert!(crops.contains("relMSE"), "it says which error it is");
    // Three parts of each of four estimators have a number, the reference has none.
    let numbers = elements(crops).into_iter().filter(|e| {
        e.name == "text" && e.text.starts_with(|c: char| c.is_ascii_digit()) && !e.text.contains(' ')
    });
    assert_eq!(numbers.count(), 12);
}

/// A figure may stand without the page that says what its slopes leave out.
#[test]
fn slopes_without_the_set_up_are_said_to_be() {
    let dir = tempfile::tempdir().unwrap();
    let all = figures(dir.path(), 3, 8.5, None);
    let says = |end: &str| {
        let (_, plot) = all.iter().find(|(name, _)| name.ends_with(end)).unwrap();
        plot.contains(">seconds of rendering; slopes without set-up</text>")
    };
    assert!(says("-relmse-time") && !says("-relmse-samples"));
}

/// Bug that this keeps out: a column and the image beside it both headed "Reference".
#[test]
fn names_are_there_once() {
    let dir = tempfile::tempdir().unwrap();
    let all = figures(dir.path(), 4, 17.8, None);
    let (_, crops) = all.iter().find(|(name, _)| name.ends_with("-crops")).unwrap();
    for name in ["Reference", "Two balls in a box"] {
        assert_eq!(crops.matches(&format!(">{name}</text>")).count(), 1, "{name}");
    }
}

#[test]
fn bands_lie_within_the_plot_and_names_below_it() {
    let dir = tempfile::tempdir().unwrap();
    let all = figures(dir.path(), 4, 8.5, None);
    let (_, plot) = all.iter().find(|(name, _)| name.ends_with("-relmse-samples")).unwrap();
    let page = view(plot).unwrap();
    let all = elements(plot);
    let panel = all.iter().rfind(|e| e.name == "rect").unwrap();
    let (top, bottom) = (panel.or("y", 0.0), panel.or("y", 0.0) + panel.or("height", 0.0));
    assert!(panel.or("width", 0.0) > 0.8 * page[0], "the panel has most of the width");
    for (_, label) in &NAMES[..4] {
        let name = all.iter().find(|e| e.name == "text" && e.text == *label).expect(label);
        assert!(name.or("y", 0.0) > bottom, "{label}");
    }
    for band in all.iter().filter(|e| e.attributes.contains_key("fill-opacity")) {
        for piece in band.attributes["d"].trim_start_matches('M').trim_end_matches('Z').split('L') {
            let y: f64 = piece.split(' ').nth(1).unwrap().parse().unwrap();
            assert!((top - 0.1..=bottom + 0.1).contains(&y), "{y} is not in {top} to {bottom}");
        }
    }
}
