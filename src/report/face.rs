//! The one typeface of all figures, Ubuntu Light: how wide a text is, its outlines, and the part of the font that a PDF embeds.
//!
//! SVG, PDF and PNG set the same glyphs at the same places, so that what fits in one fits in all.

use std::collections::BTreeSet;
use std::sync::LazyLock;
use ttf_parser::{Face, GlyphId, OutlineBuilder, Tag};

/// The font.
pub(super) static FACE: LazyLock<Face> = LazyLock::new(|| {
    Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0).expect("the font that is compiled in is one")
});

/// Share of a letter's size that a raised one has, and by how much it is raised.
pub(super) const RAISED: [f64; 2] = [0.65, 0.36];
/// Bold letters are widened by this share of their size.
pub(super) const BOLD: f64 = 0.035;
/// Of letters above and below the line they stand on, as shares of their size.
pub(super) const EXTENT: [f64; 2] = [0.78, 0.22];

/// A glyph of a text; lengths in sizes of the text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placed {
    /// What is drawn.
    pub glyph: GlyphId,
    /// What it stands for where it is read.
    pub character: char,
    /// Whether it is small and above the line.
    pub raised: bool,
    /// Where it starts.
    pub x: f64,
}

/// The glyphs of a text and its width, both for a size of 1.
pub(super) fn set(text: &str) -> (Vec<Placed>, f64) {
    let mut x = 0.0;
    let mut out = Vec::new();
    for c in text.chars() {
        // The font has no raised minus; digits are raised in the same way, to match it.
        let raised = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻".chars().position(|r| r == c);
        let shown = match raised {
            Some(10) => '−',
            Some(digit) => char::from(b'0' + digit as u8),
            None if c.is_whitespace() => ' ',
            None => c,
        };
        let known = FACE.glyph_index(shown).map(|g| (g, shown));
        let (glyph, character) = known.unwrap_or((FACE.glyph_index('?').unwrap_or(GlyphId(0)), '?'));
        out.push(Placed { glyph, character, raised: raised.is_some(), x });
        let share = if raised.is_some() { RAISED[0] } else { 1.0 };
        x += share * advance(glyph);
    }
    (out, x)
}

/// Width of a glyph in sizes of the text.
pub(super) fn advance(glyph: GlyphId) -> f64 {
    f64::from(FACE.glyph_hor_advance(glyph).unwrap_or(0)) / f64::from(FACE.units_per_em())
}

/// Width of a text of a size.
pub(super) fn width(text: &str, size: f64) -> f64 {
    size * set(text).1
}

/// A text cut to what is no wider than this, with an ellipsis where something is missing.
pub(super) fn shortened(text: &str, most: f64, size: f64) -> String {
    if width(text, size) <= most {
        return text.to_owned();
    }
    let mut out: Vec<char> = text.chars().collect();
    while out.pop().is_some() {
        let start: String = out.iter().collect();
        let cut = format!("{}…", start.trim_end());
        if width(&cut, size) <= most {
            return cut;
        }
    }
    String::new()
}

/// A text in at most so many lines no wider than this, broken at spaces, and between letters where a word alone is too wide.
pub(super) fn wrapped(text: &str, most: f64, size: f64, lines: usize) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for word in text.split([' ', '\n', '\t']).filter(|w| !w.is_empty()) {
        // Where no line may end unless there is no other way.
        let pieces: Vec<&str> =
            if width(word, size) > most { word.split_inclusive('\u{a0}').collect() } else { vec![word] };
        for (i, piece) in pieces.into_iter().enumerate() {
            let glue = if i == 0 { " " } else { "" };
            match out.last_mut() {
                Some(line) if width(&format!("{line}{glue}{piece}"), size) <= most => {
                    line.push_str(glue);
                    line.push_str(piece);
                }
                _ => out.push(piece.to_owned()),
            }
        }
    }
    if out.len() > lines {
        let rest = out.split_off(lines.saturating_sub(1)).join(" ");
        out.push(rest);
    }
    out.iter().map(|l| shortened(l.trim_end_matches('\u{a0}'), most, size)).collect()
}

/// The widest word of a text.
pub(super) fn widest_word(text: &str, size: f64) -> f64 {
    text.split([' ', '\n', '\t']).map(|w| width(w, size)).fold(0.0, f64::max)
}

/// Hands the outlines of a text of this size to a pen, from the origin, y down.
pub(super) fn outline(text: &str, size: f64, pen: &mut dyn OutlineBuilder) -> f64 {
    let (glyphs, width) = set(text);
    let unit = size / f64::from(FACE.units_per_em());
    for g in glyphs {
        let (share, rise) = if g.raised { (RAISED[0], RAISED[1] * size) } else { (1.0, 0.0) };
        let (scale, x, y) = ((unit * share) as f32, (size * g.x) as f32, -rise as f32);
        FACE.outline_glyph(g.glyph, &mut Moved { pen, scale, x, y });
    }
    size * width
}

/// Letters where they stand.
struct Moved<'a> {
    pen: &'a mut dyn OutlineBuilder,
    scale: f32,
    x: f32,
    y: f32,
}

impl Moved<'_> {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        (self.x + self.scale * x, self.y - self.scale * y)
    }
}

impl OutlineBuilder for Moved<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.pen.move_to(x, y);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.pen.line_to(x, y);
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.at(x1, y1), self.at(x, y));
        self.pen.quad_to(x1, y1, x, y);
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.pen.curve_to(x1, y1, x2, y2, x, y);
    }
    fn close(&mut self) {
        self.pen.close();
    }
}

/// A TrueType file with the outlines of these glyphs alone; all keep their numbers. It has no table of characters: a PDF names glyphs.
pub(super) fn subset(glyphs: &BTreeSet<u16>) -> Vec<u8> {
    let table = |tag: &[u8; 4]| FACE.raw_face().table(Tag::from_bytes(tag)).unwrap_or_default();
    let (glyf, loca) = (table(b"glyf"), table(b"loca"));
    let long = table(b"head").get(51) == Some(&1);
    let place = |glyph: usize| -> usize {
        if long { number(loca, 4 * glyph, 4) } else { 2 * number(loca, 2 * glyph, 2) }
    };
    let outline = |glyph: u16| {
        let glyph = usize::from(glyph);
        glyf.get(place(glyph)..place(glyph + 1)).unwrap_or_default()
    };
    let mut kept = BTreeSet::from([0]);
    let mut left: Vec<u16> = glyphs.iter().copied().collect();
    while let Some(glyph) = left.pop() {
        if kept.insert(glyph) {
            left.extend(components(outline(glyph)));
        }
    }
    let (mut outlines, mut places) = (Vec::new(), Vec::new());
    for glyph in 0..FACE.number_of_glyphs() {
        places.extend_from_slice(&(outlines.len() as u32).to_be_bytes());
        if kept.contains(&glyph) {
            outlines.extend_from_slice(outline(glyph));
            outlines.resize(outlines.len().next_multiple_of(4), 0);
        }
    }
    places.extend_from_slice(&(outlines.len() as u32).to_be_bytes());
    let mut head = table(b"head").to_vec();
    // Sum over the file, which is filled in at the end; places in four bytes.
    head[8..12].fill(0);
    head[51] = 1;
    let plain = |tag: &'static [u8; 4]| (tag, table(tag).to_vec());
    // In the order of their tags.
    let tables = [
        plain(b"cvt "),
        plain(b"fpgm"),
        (b"glyf", outlines),
        (b"head", head),
        plain(b"hhea"),
        plain(b"hmtx"),
        (b"loca", places),
        plain(b"maxp"),
        plain(b"prep"),
    ];
    font_file(&tables)
}

/// Big-endian.
fn number(bytes: &[u8], at: usize, length: usize) -> usize {
    bytes.get(at..at + length).unwrap_or_default().iter().fold(0, |n, b| n << 8 | usize::from(*b))
}

/// The glyphs that one is put together from.
fn components(outline: &[u8]) -> Vec<u16> {
    let mut out = Vec::new();
    // A negative number of contours.
    if outline.first().is_none_or(|b| b & 0x80 == 0) {
        return out;
    }
    let mut at = 10;
    loop {
        let flags = number(outline, at, 2);
        out.push(number(outline, at + 2, 2) as u16);
        let arguments = if flags & 1 != 0 { 4 } else { 2 };
        let scale = match flags {
            f if f & 0x8 != 0 => 2,
            f if f & 0x40 != 0 => 4,
            f if f & 0x80 != 0 => 8,
            _ => 0,
        };
        at += 4 + arguments + scale;
        if flags & 0x20 == 0 {
            return out;
        }
    }
}

/// Sum of the four-byte words.
fn checksum(bytes: &[u8]) -> u32 {
    let word = |w: &[u8]| {
        let mut four = [0; 4];
        four[..w.len()].copy_from_slice(w);
        u32::from_be_bytes(four)
    };
    bytes.chunks(4).fold(0u32, |sum, w| sum.wrapping_add(word(w)))
}

/// Tables with their directory.
fn font_file(tables: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let count = tables.len() as u16;
    let power = count.ilog2() as u16;
    let mut out = 0x0001_0000u32.to_be_bytes().to_vec();
    for v in [count, 16 << power, power, 16 * count - (16 << power)] {
        out.extend_from_slice(&v.to_be_bytes());
    }
    let mut at = 12 + 16 * tables.len();
    for (tag, bytes) in tables {
        out.extend_from_slice(*tag);
        for v in [checksum(bytes), at as u32, bytes.len() as u32] {
            out.extend_from_slice(&v.to_be_bytes());
        }
        at += bytes.len().next_multiple_of(4);
    }
    let mut head = None;
    for (tag, bytes) in tables {
        if *tag == b"head" {
            head = Some(out.len());
        }
        out.extend_from_slice(bytes);
        out.resize(out.len().next_multiple_of(4), 0);
    }
    if let Some(head) = head {
        let adjustment = 0xb1b0_afbau32.wrapping_sub(checksum(&out));
        out[head + 8..head + 12].copy_from_slice(&adjustment.to_be_bytes());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every character that the figures use beside ASCII is there, and none is shown as a question mark.
    #[test]
    fn what_figures_write_can_be_shown() {
        let (glyphs, _) = set("×±·−–—…≥≤∞αβγσμ⁰¹²³⁴⁵⁶⁷⁸⁹⁻\u{a0}\u{202f}é");
        assert!(glyphs.iter().all(|g| g.character != '?' && g.glyph != GlyphId(0)), "{glyphs:?}");
        assert_eq!(set("\u{4e2d}").0[0].character, '?');
        assert!(width("10⁻³", 10.0) < width("10−3", 10.0));
    }

    #[test]
    fn texts_fit_where_they_are_put() {
        let text = "bidirectional path tracing with (1.234\u{a0}±\u{a0}0.056)×10⁻³ and more";
        for most in [20.0, 50.0, 90.0, 400.0] {
            for lines in 1..5 {
                let out = wrapped(text, most, 7.0, lines);
                assert!(out.len() <= lines && out.iter().all(|l| width(l, 7.0) <= most), "{out:?}");
            }
        }
        assert_eq!(wrapped("one two", 400.0, 7.0, 2), ["one two"]);
        assert_eq!(wrapped("", 40.0, 7.0, 2), [""; 0]);
        assert!(shortened("estimator", 20.0, 7.0).ends_with('…'));
    }

    /// The part is a font: it has the same outlines and widths, and nothing of the other glyphs.
    #[test]
    fn the_part_of_the_font_is_one() {
        let glyph = |c: char| FACE.glyph_index(c).unwrap();
        let kept: BTreeSet<u16> = "Aé±α".chars().map(|c| glyph(c).0).collect();
        let bytes = subset(&kept);
        assert!(bytes.len() < 40_000, "{}", bytes.len());
        assert_eq!(checksum(&bytes), 0xb1b0_afba);
        let part = Face::parse(&bytes, 0).unwrap();
        struct Count(usize);
        impl OutlineBuilder for Count {
            fn move_to(&mut self, _: f32, _: f32) {
                self.0 += 1;
            }
            fn line_to(&mut self, _: f32, _: f32) {
                self.0 += 1;
            }
            fn quad_to(&mut self, _: f32, _: f32, _: f32, _: f32) {
                self.0 += 1;
            }
            fn curve_to(&mut self, _: f32, _: f32, _: f32, _: f32, _: f32, _: f32) {}
            fn close(&mut self) {}
        }
        let steps = |face: &Face, c: char| {
            let mut count = Count(0);
            face.outline_glyph(glyph(c), &mut count);
            count.0
        };
        for c in "Aé±α".chars() {
            assert!(steps(&part, c) > 3 && steps(&part, c) == steps(&FACE, c), "{c}");
            assert_eq!(part.glyph_hor_advance(glyph(c)), FACE.glyph_hor_advance(glyph(c)));
        }
        assert_eq!(steps(&part, 'B'), 0);
    }
}
