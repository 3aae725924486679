//! Figures as PDF files, for papers: the same drawing as the SVG, with its text as text and its images without loss.
//!
//! It reads the SVG that this report writes, which uses a handful of elements: `rect`, `line`, `path`, `text` and `image`. Text is set in
//! Helvetica, which every reader of PDF has; characters that its encoding lacks are put together from others.

use super::path::{Step, steps};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;

/// Points of a centimetre.
const CENTIMETRE: f64 = 72.0 / 2.54;
/// Points of a pixel of an SVG without a width of its own.
const PIXEL: f64 = 0.75;
/// Share of a letter's size that a raised one has, and by how much it is raised.
pub(super) const RAISED: [f64; 2] = [0.65, 0.36];

/// Widths of the characters from the space to `~` in Helvetica, in thousandths of the size.
#[rustfmt::skip]
const WIDTHS: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556, 556, 556, 556,
    556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833, 722, 778,
    667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500, 556, 556, 278, 556,
    556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];

/// An element of the SVG: its name, its attributes, and the text in it.
pub(super) struct Element<'a> {
    pub name: &'a str,
    pub attributes: BTreeMap<&'a str, &'a str>,
    pub text: &'a str,
}

impl Element<'_> {
    pub fn number(&self, key: &str) -> Option<f64> {
        self.attributes.get(key)?.parse().ok()
    }
    pub fn or(&self, key: &str, default: f64) -> f64 {
        self.number(key).unwrap_or(default)
    }
}

/// The elements in order. The report's own markup is well-formed, and has no `>` in attributes.
pub(super) fn elements(svg: &str) -> Vec<Element<'_>> {
    let mut found = Vec::new();
    for piece in svg.split('<').skip(1) {
        let Some((tag, text)) = piece.split_once('>') else { continue };
        let tag = tag.trim_end_matches('/');
        let (name, mut rest) = tag.split_once(' ').unwrap_or((tag, ""));
        if name.starts_with('/') {
            continue;
        }
        let mut attributes = BTreeMap::new();
        while let Some((key, after)) = rest.split_once("=\"") {
            let Some((value, next)) = after.split_once('"') else { break };
            attributes.insert(key.trim(), value);
            rest = next;
        }
        found.push(Element { name, attributes, text });
    }
    found
}

/// The SVG with a width in centimetres, where one is wanted: what is in it keeps its proportions.
pub(super) fn sized(svg: &str, centimetres: Option<f64>) -> String {
    let Some((width, [w, h])) = centimetres.zip(view(svg)) else { return svg.to_owned() };
    let Some((head, rest)) = svg.split_once('>') else { return svg.to_owned() };
    let mut out = String::new();
    for part in head.split(' ') {
        match part.split_once('=').map(|p| p.0) {
            Some("width") => _ = write!(out, "width=\"{width:.3}cm\" "),
            Some("height") => _ = write!(out, "height=\"{:.3}cm\" ", width * h / w),
            _ => _ = write!(out, "{part} "),
        }
    }
    format!("{}>{rest}", out.trim_end())
}

/// Width and height of the view box.
pub(super) fn view(svg: &str) -> Option<[f64; 2]> {
    let text = svg.split("viewBox=\"").nth(1)?.split('"').next()?;
    let numbers: Vec<f64> = text.split(' ').filter_map(|n| n.parse().ok()).collect();
    let [_, _, w, h] = numbers[..] else { return None };
    (w > 0.0 && h > 0.0).then_some([w, h])
}

/// A PDF of one page with the drawing of an SVG of this report on it, so many centimetres wide; `None` for what is none.
pub(super) fn pdf(svg: &str, centimetres: Option<f64>) -> Option<Vec<u8>> {
    let [width, height] = view(svg)?;
    let scale = centimetres.map_or(PIXEL, |cm| cm * CENTIMETRE / width);
    let mut page = Page { size: 13.0, ..Page::default() };
    let _ = writeln!(page.content, "{scale:.6} 0 0 {:.6} 0 {:.3} cm", -scale, scale * height);
    for element in elements(svg) {
        page.draw(&element);
    }
    Some(page.finish(scale * width, scale * height))
}

/// The page as it is drawn.
#[derive(Default)]
struct Page {
    content: String,
    /// Size and colour of text that has none of its own.
    size: f64,
    fill: String,
    /// By opacity in per cent: of fills, of strokes.
    opacities: Vec<[u8; 2]>,
    /// Width, height and deflated RGB.
    images: Vec<(u32, u32, Vec<u8>)>,
}

/// `r g b` of `#rrggbb`; nothing for `none`.
fn color(text: &str) -> Option<String> {
    let channel = |i: usize| u8::from_str_radix(text.strip_prefix('#')?.get(2 * i..2 * i + 2)?, 16).ok();
    let [r, g, b] = [channel(0)?, channel(1)?, channel(2)?].map(|v| f64::from(v) / 255.0);
    Some(format!("{r:.3} {g:.3} {b:.3}"))
}

impl Page {
    fn draw(&mut self, e: &Element) {
        match e.name {
            "svg" => {
                self.size = e.or("font-size", self.size);
                self.fill = e.attributes.get("fill").copied().unwrap_or("#000000").to_owned();
            }
            "rect" => {
                let [x, y, w, h] = ["x", "y", "width", "height"].map(|k| e.or(k, 0.0));
                self.shape(e, &format!("{x:.2} {y:.2} {w:.2} {h:.2} re"));
            }
            "line" => {
                let [x1, y1, x2, y2] = ["x1", "y1", "x2", "y2"].map(|k| e.or(k, 0.0));
                self.shape(e, &format!("{x1:.2} {y1:.2} m {x2:.2} {y2:.2} l"));
            }
            "path" => {
                let path = path(e.attributes.get("d").copied().unwrap_or_default());
                self.shape(e, &path);
            }
            "text" => self.text(e),
            "image" => self.image(e),
            _ => {}
        }
    }

    /// A shape, filled and stroked as its attributes say.
    fn shape(&mut self, e: &Element, shape: &str) {
        // A line has no inside.
        let fill =
            if e.name == "line" { None } else { color(e.attributes.get("fill").unwrap_or(&"#000000")) };
        let stroke = e.attributes.get("stroke").and_then(|s| color(s));
        let paint = match (&fill, &stroke) {
            (None, None) => return,
            (Some(_), None) => "f",
            (None, Some(_)) => "S",
            (Some(_), Some(_)) => "B",
        };
        let _ = write!(self.content, "q 1 j ");
        let opacity = ["fill-opacity", "stroke-opacity"].map(|k| (100.0 * e.or(k, 1.0)).round() as u8);
        if opacity != [100, 100] {
            let known = self.opacities.iter().position(|o| *o == opacity);
            let place = known.unwrap_or_else(|| {
                self.opacities.push(opacity);
                self.opacities.len() - 1
            });
            let _ = write!(self.content, "/G{place} gs ");
        }
        if let Some(dashes) = e.attributes.get("stroke-dasharray").filter(|d| **d != "none") {
            let _ = write!(self.content, "[{dashes}] 0 d ");
        }
        let _ = write!(self.content, "{:.2} w ", e.or("stroke-width", 1.0));
        fill.iter().for_each(|c| _ = write!(self.content, "{c} rg "));
        stroke.iter().for_each(|c| _ = write!(self.content, "{c} RG "));
        let _ = writeln!(self.content, "{shape} {paint} Q");
    }

    fn text(&mut self, e: &Element) {
        let [x, y] = ["x", "y"].map(|k| e.or(k, 0.0));
        let size = e.or("font-size", self.size);
        let runs = runs(&unescaped(e.text));
        let width = size * runs.iter().map(Run::width).sum::<f64>();
        let shift = match e.attributes.get("text-anchor").copied() {
            Some("middle") => -0.5 * width,
            Some("end") => -width,
            _ => 0.0,
        };
        let ink = e.attributes.get("fill").and_then(|c| color(c)).or_else(|| color(&self.fill));
        let font = if e.number("font-weight").is_some_and(|w| w >= 600.0) { "F1" } else { "F0" };
        let _ = write!(self.content, "q {} rg ", ink.unwrap_or_else(|| "0 0 0".into()));
        if let Some(turn) = e.attributes.get("transform").and_then(|t| t.strip_prefix("rotate(")) {
            let numbers: Vec<f64> =
                turn.trim_end_matches(')').split([' ', ',']).filter_map(|n| n.parse().ok()).collect();
            if let [angle, cx, cy] = numbers[..] {
                let (s, c) = angle.to_radians().sin_cos();
                let (dx, dy) = (cx - c * cx + s * cy, cy - s * cx - c * cy);
                let _ = write!(self.content, "{c:.5} {s:.5} {:.5} {c:.5} {dx:.3} {dy:.3} cm ", -s);
            }
        }
        // The page is upside down, letters are not.
        let _ = write!(self.content, "BT 1 0 0 -1 {:.2} {y:.2} Tm ", x + shift);
        for run in &runs {
            let (share, rise) = if run.raised { (RAISED[0], RAISED[1] * size) } else { (1.0, 0.0) };
            let _ = write!(self.content, "/{font} {:.2} Tf {rise:.2} Ts <", share * size);
            run.bytes.iter().for_each(|b| _ = write!(self.content, "{b:02x}"));
            let _ = write!(self.content, "> Tj ");
        }
        let _ = writeln!(self.content, "ET Q");
    }

    fn image(&mut self, e: &Element) {
        let [x, y, w, h] = ["x", "y", "width", "height"].map(|k| e.or(k, 0.0));
        let data = e.attributes.get("href").and_then(|h| h.strip_prefix("data:image/png;base64,"));
        let Some(image) = data.and_then(|d| rgb(&from_base64(d))) else { return };
        let place = self.images.len();
        self.images.push(image);
        let _ = writeln!(self.content, "q {w:.2} 0 0 {:.2} {x:.2} {:.2} cm /I{place} Do Q", -h, y + h);
    }

    fn finish(self, width: f64, height: f64) -> Vec<u8> {
        let font = |name: &str| {
            format!("<</Type/Font/Subtype/Type1/BaseFont/{name}/Encoding/WinAnsiEncoding>>").into_bytes()
        };
        let (states, images) = (7, 7 + self.opacities.len());
        let mut resources = String::from("<</Font<</F0 5 0 R/F1 6 0 R>>/ExtGState<<");
        (0..self.opacities.len()).for_each(|i| _ = write!(resources, "/G{i} {} 0 R", states + i));
        resources.push_str(">>/XObject<<");
        (0..self.images.len()).for_each(|i| _ = write!(resources, "/I{i} {} 0 R", images + i));
        resources.push_str(">>>>");
        let page = format!(
            "<</Type/Page/Parent 2 0 R/MediaBox[0 0 {width:.3} {height:.3}]/Contents 4 0 R/Resources{resources}>>"
        );
        let mut objects: Vec<Vec<u8>> = vec![
            b"<</Type/Catalog/Pages 2 0 R>>".to_vec(),
            b"<</Type/Pages/Kids[3 0 R]/Count 1>>".to_vec(),
            page.into_bytes(),
            stream("/Filter/FlateDecode", &deflated(self.content.as_bytes())),
            font("Helvetica"),
            font("Helvetica-Bold"),
        ];
        for [fill, stroke] in &self.opacities {
            let [fill, stroke] = [fill, stroke].map(|v| f64::from(*v) / 100.0);
            objects.push(format!("<</Type/ExtGState/ca {fill:.2}/CA {stroke:.2}>>").into_bytes());
        }
        for (w, h, pixels) in &self.images {
            let about = format!(
                "/Type/XObject/Subtype/Image/Width {w}/Height {h}/ColorSpace/DeviceRGB/BitsPerComponent 8/Filter/FlateDecode"
            );
            objects.push(stream(&about, pixels));
        }
        file(&objects)
    }
}

/// Numbered objects, and the table of where they are.
fn file(objects: &[Vec<u8>]) -> Vec<u8> {
    let mut out = b"%PDF-1.5\n%\xe2\xe3\xcf\xd3\n".to_vec();
    let mut places = Vec::new();
    for (i, object) in objects.iter().enumerate() {
        places.push(out.len());
        out.extend_from_slice(format!("{} 0 obj\n", i + 1).as_bytes());
        out.extend_from_slice(object);
        out.extend_from_slice(b"\nendobj\n");
    }
    let table = out.len();
    let mut end = format!("xref\n0 {}\n0000000000 65535 f \n", objects.len() + 1);
    places.iter().for_each(|p| _ = writeln!(end, "{p:010} 00000 n "));
    let _ = write!(end, "trailer\n<</Size {}/Root 1 0 R>>\nstartxref\n{table}\n%%EOF\n", objects.len() + 1);
    out.extend_from_slice(end.as_bytes());
    out
}

fn stream(about: &str, bytes: &[u8]) -> Vec<u8> {
    let mut out = format!("<<{about}/Length {}>>\nstream\n", bytes.len()).into_bytes();
    out.extend_from_slice(bytes);
    out.extend_from_slice(b"\nendstream");
    out
}

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(6));
    encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("writing into memory does not fail")
}

/// Path data as operators.
fn path(d: &str) -> String {
    let mut out = String::new();
    for step in steps(d) {
        let _ = match step {
            Step::Move([x, y]) => write!(out, "{x:.2} {y:.2} m "),
            Step::Line([x, y]) => write!(out, "{x:.2} {y:.2} l "),
            Step::Curve([[ax, ay], [bx, by], [x, y]]) => {
                write!(out, "{ax:.2} {ay:.2} {bx:.2} {by:.2} {x:.2} {y:.2} c ")
            }
            Step::Close => write!(out, "h "),
        };
    }
    out
}

pub(super) fn unescaped(text: &str) -> String {
    let plain = text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&#39;", "'");
    plain.replace("&amp;", "&")
}

/// Characters of one size.
struct Run {
    raised: bool,
    /// In the encoding of Windows' western Europe.
    bytes: Vec<u8>,
}

impl Run {
    /// In units of the text's size.
    fn width(&self) -> f64 {
        let width = |b: &u8| match b {
            0x20..=0x7e => f64::from(WIDTHS[usize::from(b - 0x20)]),
            0xa0 | 0xb7 => 278.0,
            0xb2 | 0xb3 | 0xb9 => 333.0,
            0xb1 | 0xd7 => 584.0,
            0x85 => 1000.0,
            _ => 556.0,
        };
        let share = if self.raised { RAISED[0] } else { 1.0 };
        share * self.bytes.iter().map(width).sum::<f64>() / 1000.0
    }
}

fn runs(text: &str) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for c in text.chars() {
        let raised = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻".chars().position(|r| r == c);
        let bytes: Vec<u8> = match (raised, c) {
            (Some(10), _) => vec![0x96],
            (Some(digit), _) => vec![b'0' + digit as u8],
            (_, '−' | '–') => vec![0x96],
            (_, '—') => vec![0x97],
            (_, '…') => vec![0x85],
            (_, '\u{202f}') => vec![0xa0],
            (_, '≥') => b">=".to_vec(),
            (_, '≤') => b"<=".to_vec(),
            (_, '∞') => b"inf".to_vec(),
            (_, ' '..='~' | '\u{a0}'..='ÿ') => vec![c as u32 as u8],
            _ => vec![b'?'],
        };
        match runs.last_mut().filter(|r| r.raised == raised.is_some()) {
            Some(run) => run.bytes.extend(bytes),
            None => runs.push(Run { raised: raised.is_some(), bytes }),
        }
    }
    runs
}

pub(super) fn from_base64(text: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => Some(c - b'A'),
        b'a'..=b'z' => Some(c - b'a' + 26),
        b'0'..=b'9' => Some(c - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    };
    let digits: Vec<u8> = text.bytes().filter_map(digit).collect();
    let mut out = Vec::with_capacity(digits.len() * 3 / 4);
    for four in digits.chunks(4) {
        let n = four.iter().fold(0u32, |n, d| n << 6 | u32::from(*d)) << (6 * (4 - four.len()));
        out.extend_from_slice(&n.to_be_bytes()[1..four.len()]);
    }
    out
}

/// The pixels of one of our own PNGs, deflated.
fn rgb(png: &[u8]) -> Option<(u32, u32, Vec<u8>)> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().ok()?;
    let mut pixels = vec![0; reader.output_buffer_size()?];
    let info = reader.next_frame(&mut pixels).ok()?;
    let plain = info.color_type == png::ColorType::Rgb && info.bit_depth == png::BitDepth::Eight;
    pixels.truncate(info.buffer_size());
    plain.then(|| (info.width, info.height, deflated(&pixels)))
}

#[cfg(test)]
mod tests {
    use super::super::montage::{Montage, Tile};
    use super::super::picture::{Picture, base64};
    use super::*;
    use crate::film::Image;

    fn figure() -> String {
        let mut montage = Montage::new("a <figure>".into(), 120.0);
        let picture =
            Picture::of(&Image::from_fn(6, 4, |x, y| [x as f32 / 5.0, y as f32 / 3.0, 0.5]), 0.0, 10);
        let label = "(1.2 ± 0.1)×10⁻³".to_owned();
        montage.push(0, Tile { picture, label, fact: "−0.98 & more".into(), ..Tile::default() });
        montage.svg()
    }

    /// Every entry of the table leads to its object, and the streams are as long as they say.
    #[test]
    fn the_file_holds_together() {
        let bytes = pdf(&figure(), Some(8.0)).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.starts_with("%PDF-1.5") && text.ends_with("%%EOF\n"));
        let find = |needle: &[u8], from: usize| {
            bytes[from..].windows(needle.len()).position(|w| w == needle).map(|p| from + p)
        };
        let start: usize =
            text.rsplit("startxref\n").next().unwrap().lines().next().unwrap().parse().unwrap();
        assert_eq!(&bytes[start..start + 4], b"xref");
        let table = String::from_utf8_lossy(&bytes[start..]).into_owned();
        let places: Vec<usize> =
            table.lines().filter(|l| l.ends_with(" n ")).map(|l| l[..10].parse().unwrap()).collect();
        assert_eq!(places.len(), 7, "six objects and an image");
        for (i, place) in places.iter().enumerate() {
            assert!(bytes[*place..].starts_with(format!("{} 0 obj", i + 1).as_bytes()));
        }
        let content = find(b"stream\n", places[3]).unwrap() + 7;
        let length = find(b"/Length ", places[3]).unwrap() + 8;
        let length: usize =
            String::from_utf8_lossy(&bytes[length..length + 10]).split('>').next().unwrap().parse().unwrap();
        assert_eq!(&bytes[content + length..content + length + 10], b"\nendstream");
        let width = 8.0 * CENTIMETRE;
        assert!(text.contains(&format!("/MediaBox[0 0 {width:.3} ")), "8 cm wide");
        let mut drawn = String::new();
        std::io::Read::read_to_string(
            &mut flate2::read::ZlibDecoder::new(&bytes[content..content + length]),
            &mut drawn,
        )
        .unwrap();
        assert!(
            drawn.contains("/I0 Do") && drawn.matches(" Tj").count() >= 3 && drawn.contains(" Ts <9633>"),
            "{drawn}"
        );
        assert_eq!(drawn.matches("q ").count(), drawn.matches(" Q").count());
        assert!(pdf("<p>no figure</p>", None).is_none());
    }

    #[test]
    fn widths_are_said_in_centimetres() {
        let svg = sized(&figure(), Some(8.5));
        assert!(svg.contains("width=\"8.500cm\"") && svg.contains("height=\""), "{}", &svg[..200]);
        assert_eq!(super::super::markup::imbalance(&svg), None);
        assert_eq!(sized(&figure(), None), figure());
        assert_eq!(view(&svg), view(&figure()));
    }

    #[test]
    fn paths_texts_and_base64() {
        assert_eq!(path("M1 2L3 4Z"), "1.00 2.00 m 3.00 4.00 l h ");
        assert_eq!(path("M0 0a2 2 0 1 0 4 0").matches(" c ").count(), 2);
        for bytes in [&b""[..], b"f", b"fo", b"foo", &[255, 0, 254, 7]] {
            assert_eq!(from_base64(&base64(bytes)), bytes);
        }
        let width: f64 = runs("Hi").iter().map(Run::width).sum();
        assert!((width - 0.944).abs() < 1e-9);
        assert_eq!(runs("10⁻³").len(), 2);
    }
}
