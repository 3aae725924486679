//! Images for the page: shrunk where they are large (which is said), as PNG in `data:` addresses.

use super::markup::{Attribute, Markup};
use crate::film::png::{DisplayImage, ToneCurve, display};
use crate::film::{Image, ScalarImage, false_color};

/// An image ready to be shown.
#[derive(Clone)]
pub(super) struct Picture {
    /// `data:image/png;base64,…`
    uri: String,
    /// Width in pixels as it is stored in the page.
    pub width: usize,
    /// Height likewise.
    pub height: usize,
    /// Pixels of the original on a side of one of these: 1 where nothing was shrunk.
    factor: usize,
}

/// By how much pictures of scales are wider than high.
pub(super) const SCALE_SHAPE: usize = 16;

impl Picture {
    /// An image through 2^`stops` and the sRGB curve, at most `most` pixels wide or high; `None` for an empty one.
    pub fn of(image: &Image, stops: f32, most: usize) -> Option<Self> {
        Self::encode(&displayed(image, stops, most), factor(image.width, image.height, most))
    }

    /// A map in false colour, likewise.
    pub fn of_map(map: &ScalarImage, scale: false_color::Scale, most: usize) -> Option<Self> {
        let factor = factor(map.width, map.height, most);
        if factor == 1 {
            return Self::encode(&false_color::paint(map, scale), 1);
        }
        let grey = Image {
            width: map.width,
            height: map.height,
            pixels: map.values.iter().map(|v| [*v; 3]).collect(),
        };
        let small = shrunk(&grey, factor);
        let values = small.pixels.iter().map(|p| p[0]).collect();
        let map = ScalarImage { width: small.width, height: small.height, values };
        Self::encode(&false_color::paint(&map, scale), factor)
    }

    /// The colours of a scale that is not logarithmic from its least value to its greatest; [`SCALE_SHAPE`] times as wide as high.
    pub fn of_scale(scale: false_color::Scale) -> Option<Self> {
        const STEPS: usize = 256;
        let (low, high) = scale.ends();
        let value = |i: usize| low + (high - low) * (i % STEPS) as f32 / (STEPS - 1) as f32;
        let height = STEPS / SCALE_SHAPE;
        let ramp = ScalarImage { width: STEPS, height, values: (0..STEPS * height).map(value).collect() };
        Self::encode(&false_color::paint(&ramp, scale), 1)
    }

    fn encode(shown: &DisplayImage, factor: usize) -> Option<Self> {
        let uri = format!("data:image/png;base64,{}", base64(&shown.encode().ok()?));
        Some(Self { uri, width: shown.width, height: shown.height, factor })
    }

    /// The address.
    pub fn uri(&self) -> &str {
        &self.uri
    }

    /// An `img` with a text for those who cannot see it, and what else is to be known of it.
    pub fn img(&self, m: &mut Markup, alt: &str, more: &[Attribute]) {
        let mut attributes: Vec<Attribute> =
            vec![("src", &self.uri), ("alt", &alt), ("width", &self.width), ("height", &self.height)];
        if self.factor > 1 {
            attributes.push(("data-shrunk", &self.factor));
        }
        attributes.extend_from_slice(more);
        m.void("img", &attributes);
    }
}

/// An image through 2^`stops` and the sRGB curve in 8 bits, shrunk to at most `most` pixels wide and high.
pub(super) fn displayed(image: &Image, stops: f32, most: usize) -> DisplayImage {
    match factor(image.width, image.height, most) {
        1 => display(image, stops, ToneCurve::Srgb),
        factor => display(&shrunk(image, factor), stops, ToneCurve::Srgb),
    }
}

/// By how much an image is shrunk to be at most so wide and high.
pub(super) fn factor(width: usize, height: usize, most: usize) -> usize {
    width.max(height).div_ceil(most.max(1)).max(1)
}

/// Means over squares of `factor` pixels, in linear light; at the right and lower edge over what is there.
pub(super) fn shrunk(image: &Image, factor: usize) -> Image {
    Image::from_fn(image.width.div_ceil(factor), image.height.div_ceil(factor), |x, y| {
        let mut sum = [0.0f64; 3];
        let mut n = 0.0;
        for row in y * factor..((y + 1) * factor).min(image.height) {
            for column in x * factor..((x + 1) * factor).min(image.width) {
                let pixel = image.pixels[row * image.width + column];
                for (s, v) in sum.iter_mut().zip(pixel) {
                    *s += f64::from(v);
                }
                n += 1.0;
            }
        }
        sum.map(|s| (s / n) as f32)
    })
}

/// Base64 with padding (RFC 4648, 4).
pub(super) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let n = chunk.iter().fold(0u32, |n, b| n << 8 | u32::from(*b)) << (8 * (3 - chunk.len()));
        for i in 0..4 {
            if i <= chunk.len() {
                out.push(char::from(DIGITS[(n >> (18 - 6 * i)) as usize & 63]));
            } else {
                out.push('=');
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_standard() {
        for (plain, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xfe]), "+//+");
    }

    #[test]
    fn shrinking_keeps_the_mean_and_says_so() {
        let image = Image::from_fn(8, 4, |x, y| [x as f32, y as f32, 1.0]);
        let small = shrunk(&image, 2);
        assert_eq!((small.width, small.height), (4, 2));
        assert_eq!(small.pixels[0], [0.5, 0.5, 1.0]);
        assert_eq!(small.mean(), image.mean());
        assert_eq!(shrunk(&image, 3).get(2, 1), [6.5, 3.0, 1.0], "squares at the edge are smaller");
        let picture = Picture::of(&image, 0.0, 3).unwrap();
        assert_eq!((picture.width, picture.height, picture.factor), (3, 2, 3));
        assert_eq!(Picture::of(&image, 0.0, 8).unwrap().factor, 1);
        assert!(Picture::of(&Image::new(0, 0), 0.0, 8).is_none());
    }
}
