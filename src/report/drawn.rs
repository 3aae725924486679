//! Figures as PNG files: the same drawing as the SVG, for slides and pages that take neither SVG nor PDF.
//!
//! As [`super::pdf`] it reads the SVG that this report writes. Letters are outlines of its font.

use super::face::{self, BOLD};
use super::path::{Step, steps};
use super::pdf::{Element, elements, from_base64, unescaped, view};
use tiny_skia::{
    Color, FillRule, FilterQuality, IntSize, LineJoin, Paint, Path, PathBuilder, Pixmap, PixmapPaint, Rect,
    Stroke, StrokeDash, Transform,
};
use ttf_parser::OutlineBuilder;

/// Dots per inch of a figure with a width in centimetres.
const DPI: f64 = 300.0;
/// Pixels of the PNG a unit of the drawing, without a width.
const PIXELS: f64 = 2.0;
/// No figure is drawn wider or higher than this, in pixels.
const MOST: f64 = 16_384.0;
/// The drawing of an SVG of this report, so many centimetres wide at 300 dots per inch, or at twice its size; `None`
/// for what is none.
pub(super) fn png(svg: &str, centimetres: Option<f64>) -> Option<Vec<u8>> {
    let [width, height] = view(svg)?;
    let wanted = centimetres.map_or(PIXELS, |cm| cm / 2.54 * DPI / width);
    let scale = wanted.min(MOST / width.max(height));
    let mut pixmap = Pixmap::new((scale * width).round() as u32, (scale * height).round() as u32)?;
    pixmap.fill(Color::WHITE);
    let mut sheet =
        Sheet { pixmap, scale: Transform::from_scale(scale as f32, scale as f32), size: 13.0, ink: None };
    elements(svg).iter().for_each(|e| sheet.element(e));
    encode(&sheet.pixmap, centimetres.map(|cm| width * scale / cm * 100.0))
}

/// As a PNG, with so many pixels a metre where it has a size.
fn encode(pixmap: &Pixmap, per_metre: Option<f64>) -> Option<Vec<u8>> {
    let pixels: Vec<u8> = pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, pixmap.width(), pixmap.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    if let Some(number) = per_metre.map(|n| n.round() as u32) {
        let unit = png::Unit::Meter;
        encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: number, yppu: number, unit }));
    }
    encoder.write_header().and_then(|mut w| w.write_image_data(&pixels)).ok()?;
    Some(bytes)
}

/// What is drawn on.
struct Sheet {
    pixmap: Pixmap,
    /// From units of the drawing to pixels.
    scale: Transform,
    /// Size and colour of text that has none of its own.
    size: f64,
    ink: Option<[u8; 3]>,
}

/// `#rrggbb`; nothing for `none`.
fn color(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#')?;
    let channel = |i: usize| u8::from_str_radix(digits.get(2 * i..2 * i + 2)?, 16).ok();
    Some([channel(0)?, channel(1)?, channel(2)?])
}

fn paint([r, g, b]: [u8; 3], opacity: f64) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (255.0 * opacity).round() as u8);
    paint
}

/// A length in the drawing, which may be a share of the whole.
fn length(e: &Element, key: &str, whole: f32) -> Option<f32> {
    let text = e.attributes.get(key)?;
    match text.strip_suffix('%') {
        Some(share) => share.parse::<f32>().ok().map(|s| 0.01 * s * whole),
        None => text.parse().ok(),
    }
}

impl Sheet {
    /// What cannot be drawn is left out.
    fn element(&mut self, e: &Element) {
        let _ = self.draw(e);
    }

    fn draw(&mut self, e: &Element) -> Option<()> {
        match e.name {
            "svg" => {
                self.size = e.or("font-size", self.size);
                self.ink = e.attributes.get("fill").and_then(|c| color(c));
                Some(())
            }
            "rect" => {
                let whole =
                    [self.pixmap.width() as f32, self.pixmap.height() as f32].map(|v| v / self.scale.sx);
                let [x, y] = ["x", "y"].map(|k| e.or(k, 0.0) as f32);
                let (w, h) = (length(e, "width", whole[0])?, length(e, "height", whole[1])?);
                self.shape(e, &PathBuilder::from_rect(Rect::from_xywh(x, y, w, h)?));
                Some(())
            }
            "line" => {
                let [x1, y1, x2, y2] = ["x1", "y1", "x2", "y2"].map(|k| e.or(k, 0.0) as f32);
                let mut path = PathBuilder::new();
                path.move_to(x1, y1);
                path.line_to(x2, y2);
                self.shape(e, &path.finish()?);
                Some(())
            }
            "path" => {
                self.shape(e, &path(e.attributes.get("d")?)?);
                Some(())
            }
            "text" => self.text(e),
            "image" => self.image(e),
            _ => None,
        }
    }

    /// A shape, filled and stroked as its attributes say.
    fn shape(&mut self, e: &Element, path: &Path) {
        let fill =
            if e.name == "line" { None } else { color(e.attributes.get("fill").unwrap_or(&"#000000")) };
        if let Some(c) = fill {
            let paint = paint(c, e.or("fill-opacity", 1.0));
            self.pixmap.fill_path(path, &paint, FillRule::Winding, self.scale, None);
        }
        if let Some(c) = e.attributes.get("stroke").and_then(|s| color(s)) {
            let dashes = e.attributes.get("stroke-dasharray").filter(|d| **d != "none");
            let dashes: Vec<f32> = dashes
                .map_or_else(Vec::new, |d| d.split([' ', ',']).filter_map(|n| n.parse().ok()).collect());
            let stroke = Stroke {
                width: e.or("stroke-width", 1.0) as f32,
                line_join: LineJoin::Round,
                dash: StrokeDash::new(dashes, 0.0),
                ..Stroke::default()
            };
            self.pixmap.stroke_path(path, &paint(c, e.or("stroke-opacity", 1.0)), &stroke, self.scale, None);
        }
    }

    fn text(&mut self, e: &Element) -> Option<()> {
        let [x, y] = ["x", "y"].map(|k| e.or(k, 0.0));
        let size = e.or("font-size", self.size);
        let mut pen = Pen(PathBuilder::new());
        let shift = e.shift(face::outline(&unescaped(e.text), size, &mut pen));
        let mut place = self.scale;
        if let Some(turn) = e.attributes.get("transform").and_then(|t| t.strip_prefix("rotate(")) {
            let numbers: Vec<f32> =
                turn.trim_end_matches(')').split([' ', ',']).filter_map(|n| n.parse().ok()).collect();
            if let [angle, cx, cy] = numbers[..] {
                place = place.pre_concat(Transform::from_rotate_at(angle, cx, cy));
            }
        }
        let place = place.pre_translate((x + shift) as f32, y as f32);
        let paint = paint(e.attributes.get("fill").and_then(|c| color(c)).or(self.ink)?, 1.0);
        let outline = pen.0.finish()?;
        self.pixmap.fill_path(&outline, &paint, FillRule::Winding, place, None);
        if e.is_bold() {
            let stroke = Stroke { width: (BOLD * size) as f32, ..Stroke::default() };
            self.pixmap.stroke_path(&outline, &paint, &stroke, place, None);
        }
        Some(())
    }

    fn image(&mut self, e: &Element) -> Option<()> {
        let [x, y, w, h] = ["x", "y", "width", "height"].map(|k| e.or(k, 0.0) as f32);
        let data = e.attributes.get("href")?.strip_prefix("data:image/png;base64,")?;
        let image = decode(&from_base64(data))?;
        let factor = image.width() as f32 / (w * self.scale.sx);
        let image = if factor >= 2.0 { shrunk(&image, factor as u32)? } else { image };
        let pixelated = e.attributes.get("style").is_some_and(|s| s.contains("pixelated"));
        let scale = [w / image.width() as f32, h / image.height() as f32];
        let quality = if pixelated { FilterQuality::Nearest } else { FilterQuality::Bicubic };
        let how = PixmapPaint { quality, ..PixmapPaint::default() };
        let place = self.scale.pre_translate(x, y).pre_scale(scale[0], scale[1]);
        self.pixmap.draw_pixmap(0, 0, image.as_ref(), &how, place, None);
        Some(())
    }
}

/// One of our own PNGs.
fn decode(bytes: &[u8]) -> Option<Pixmap> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().ok()?;
    let mut pixels = vec![0; reader.output_buffer_size()?];
    let info = reader.next_frame(&mut pixels).ok()?;
    let plain = info.color_type == png::ColorType::Rgb && info.bit_depth == png::BitDepth::Eight;
    let rgb = pixels.get(..info.buffer_size()).filter(|_| plain)?;
    let rgba = rgb.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect();
    Pixmap::from_vec(rgba, IntSize::from_wh(info.width, info.height)?)
}

/// Means over squares of `factor` pixels, so that none is left out.
fn shrunk(image: &Pixmap, factor: u32) -> Option<Pixmap> {
    let (width, height) = (image.width() / factor, image.height() / factor);
    let mut small = Pixmap::new(width, height)?;
    for (i, pixel) in small.data_mut().chunks_exact_mut(4).enumerate() {
        let (x, y) = (i as u32 % width * factor, i as u32 / width * factor);
        let inside = (0..factor * factor).filter_map(|n| image.pixel(x + n % factor, y + n / factor));
        let sum = inside.fold([0; 3], |s: [u32; 3], p| {
            [s[0] + u32::from(p.red()), s[1] + u32::from(p.green()), s[2] + u32::from(p.blue())]
        });
        let [r, g, b] = sum.map(|s| ((s + factor * factor / 2) / (factor * factor)) as u8);
        pixel.copy_from_slice(&[r, g, b, 255]);
    }
    Some(small)
}

/// Path data.
fn path(d: &str) -> Option<Path> {
    let mut out = PathBuilder::new();
    let near = |p: [f64; 2]| p.map(|v| v as f32);
    for step in steps(d) {
        match step {
            Step::Move(p) => {
                let [x, y] = near(p);
                out.move_to(x, y);
            }
            Step::Line(p) => {
                let [x, y] = near(p);
                out.line_to(x, y);
            }
            Step::Curve(points) => {
                let [[ax, ay], [bx, by], [x, y]] = points.map(near);
                out.cubic_to(ax, ay, bx, by, x, y);
            }
            Step::Close => out.close(),
        }
    }
    out.finish()
}

/// Outlines of letters.
struct Pen(PathBuilder);

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.0.move_to(x, y);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        self.0.line_to(x, y);
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.0.quad_to(x1, y1, x, y);
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.0.cubic_to(x1, y1, x2, y2, x, y);
    }
    fn close(&mut self) {
        self.0.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawing(width: Option<f64>, body: &str) -> (Pixmap, Vec<u8>) {
        let svg = format!("<svg viewBox=\"0 0 100 50\" width=\"100\" fill=\"#000000\">{body}</svg>");
        let bytes = png(&svg, width).unwrap();
        (decode(&bytes).unwrap(), bytes)
    }

    fn at(pixmap: &Pixmap, x: u32, y: u32) -> [u8; 3] {
        let p = pixmap.pixel(x, y).unwrap();
        [p.red(), p.green(), p.blue()]
    }

    #[test]
    fn shapes_are_where_the_drawing_has_them() {
        let (p, _) = drawing(
            None,
            "<rect x=\"10\" y=\"10\" width=\"20\" height=\"10\" fill=\"#ff0000\"/>\
             <line x1=\"50\" y1=\"0\" x2=\"50\" y2=\"50\" stroke=\"#0000ff\" stroke-width=\"4\"/>\
             <path d=\"M70 10L90 10L90 30L70 30Z\" fill=\"#00ff00\" fill-opacity=\"0.5\"/>",
        );
        assert_eq!((p.width(), p.height()), (200, 100));
        assert_eq!([at(&p, 40, 30), at(&p, 18, 30), at(&p, 62, 30)], [[255, 0, 0], [255; 3], [255; 3]]);
        assert_eq!([at(&p, 97, 50), at(&p, 94, 50)], [[0, 0, 255], [255; 3]]);
        let green = at(&p, 160, 40);
        assert!(green[1] == 255 && green[0].abs_diff(127) <= 1, "half of it: {green:?}");
    }

    #[test]
    fn a_width_in_centimetres_is_one_in_print() {
        let (p, bytes) = drawing(Some(2.54), "");
        assert_eq!((p.width(), p.height()), (300, 150));
        let reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let dims = reader.info().pixel_dims.unwrap();
        assert_eq!((dims.xppu, dims.unit), (11_811, png::Unit::Meter));
    }

    #[test]
    fn texts_are_written_and_anchored() {
        let ink = |body: &str| {
            let (p, _) = drawing(None, body);
            let dark = |x: u32| (0..p.height()).any(|y| at(&p, x, y)[0] < 128);
            let columns: Vec<u32> = (0..p.width()).filter(|x| dark(*x)).collect();
            (columns[0], columns[columns.len() - 1])
        };
        let (start, end) = ink("<text x=\"50\" y=\"30\" font-size=\"12\">HHHH</text>");
        assert!((100..106).contains(&start) && end > 150, "{start} {end}");
        let (a, b) = ink("<text x=\"50\" y=\"30\" font-size=\"12\" text-anchor=\"middle\">HHHH</text>");
        assert!(a.abs_diff(200 - b) <= 3, "centred: {a} {b}");
        let (a, b) = ink(
            "<text x=\"50\" y=\"25\" font-size=\"12\" text-anchor=\"middle\" transform=\"rotate(-90 50 25)\">HHHH</text>",
        );
        assert!(b - a < 24, "on its side it is as wide as letters are high: {a} {b}");
        // Whatever the report writes has a glyph.
        for c in "aé×±−–—…≥≤∞·%&²³".chars() {
            assert!(face::FACE.glyph_index(c).is_some(), "{c}");
        }
    }
}
