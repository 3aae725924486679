//! The page's viewer: images as floating-point data within the page, and the program that shows them.
//!
//! Each image is three planes of half floats (IEEE 754 binary16), high bytes first and then low bytes, deflated (zlib) and in base64, in
//! a `script` element of a type that no browser runs. Where all images together would take too much, mantissas are
//! rounded, which noise does not show and deflate does; the page says to how many bits. A list of the images in JSON names the
//! EXR, the layer and the element of each.

use super::context::SceneView;
use super::markup::Markup;
use super::picture::{base64, factor, shrunk};
use crate::film::Image;
use crate::film::false_color::{diverging, sequential};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;
use serde::Serialize;
use std::io::Write;

/// What runs in the page.
const SCRIPT: &str = include_str!("viewer.js");
/// Bytes of data, before base64, that the images of a page may take in all.
const MOST_BYTES: usize = 30_000_000;
/// Mantissa bits that are tried in turn.
const MANTISSAS: [u32; 4] = [10, 7, 5, 3];
/// Pixels of a page's layers of techniques and of (s, t) in all; beyond, they are shrunk.
const MOST_LAYER_PIXELS: usize = 4_000_000;

/// What an image is to the viewer, in the order of its list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Role {
    /// What the others are compared with.
    Reference,
    /// A run of an estimator.
    Estimate,
    /// A layer of an estimator.
    Layer,
}

/// An image as the viewer has it.
struct Item {
    scene: String,
    label: String,
    exr: String,
    layer: String,
    role: Role,
    image: Image,
}

/// The images of a page.
#[derive(Default)]
pub(super) struct Viewer {
    items: Vec<Item>,
}

/// What the page's program is told of an image.
#[derive(Serialize)]
struct Entry<'a> {
    label: &'a str,
    exr: &'a str,
    layer: &'a str,
    role: Role,
    width: usize,
    height: usize,
    data: String,
}

/// … and of a scene.
#[derive(Serialize)]
struct SceneEntry<'a> {
    key: &'a str,
    label: &'a str,
    exposure: f32,
    width: usize,
    height: usize,
    images: Vec<Entry<'a>>,
}

/// … and of the page.
#[derive(Serialize)]
struct Manifest<'a> {
    mantissa: u32,
    scenes: Vec<SceneEntry<'a>>,
    /// 256 colours from 0 to 1, and from −1 to 1.
    sequential: String,
    diverging: String,
}

impl Viewer {
    /// Adds an image of a scene; one that is there already is not there twice.
    pub fn add(&mut self, view: &SceneView, role: Role, label: &str, file: (&str, &str), image: &Image) {
        let (exr, layer) = file;
        if image.pixels.is_empty() || self.items.iter().any(|i| i.exr == exr && i.layer == layer) {
            return;
        }
        let (exr, layer) = (exr.to_owned(), layer.to_owned());
        let (scene, label) = (view.scene.key.clone(), label.to_owned());
        self.items.push(Item { scene, label, exr, layer, role, image: image.clone() });
    }

    /// Writes data, list and program. Nothing where there is no image.
    pub fn write(mut self, scenes: &[SceneView], m: &mut Markup) {
        if self.items.is_empty() {
            return;
        }
        self.shrink_layers();
        let (mantissa, data) = self.packed();
        for (i, data) in data.iter().enumerate() {
            let id = format!("px-{i}");
            m.tag("script", &[("type", &"text/plain"), ("id", &id)], |m| m.raw(&base64(data)));
            m.newline();
        }
        let ramp = |color: &dyn Fn(f32) -> [u8; 3]| {
            base64(&(0..256).flat_map(|i| color(i as f32 / 255.0)).collect::<Vec<u8>>())
        };
        let manifest = Manifest {
            mantissa,
            scenes: scenes.iter().map(|view| self.scene(view)).collect(),
            sequential: ramp(&sequential),
            diverging: ramp(&|t| diverging(2.0 * t - 1.0)),
        };
        // Within a script a '<' could end it.
        let json = serde_json::to_string(&manifest).expect("plain structs have a JSON form");
        let json = json.replace('<', "\\u003c");
        m.tag("script", &[("type", &"application/json"), ("id", &"viewer-data")], |m| m.raw(&json));
        m.tag("script", &[], |m| m.raw(SCRIPT));
    }

    fn scene<'a>(&'a self, view: &'a SceneView) -> SceneEntry<'a> {
        let of_scene = self.items.iter().enumerate().filter(|(_, item)| item.scene == view.scene.key);
        // The number keys lead to the first ten: the reference and the estimators, whatever the page shows first.
        let mut of_scene: Vec<(usize, &Item)> = of_scene.collect();
        of_scene.sort_by_key(|(_, item)| item.role);
        SceneEntry {
            key: &view.scene.key,
            label: &view.scene.label,
            exposure: view.scene.exposure,
            width: view.scene.width,
            height: view.scene.height,
            images: of_scene
                .into_iter()
                .map(|(i, item)| Entry {
                    label: &item.label,
                    exr: &item.exr,
                    layer: &item.layer,
                    role: item.role,
                    width: item.image.width,
                    height: item.image.height,
                    data: format!("px-{i}"),
                })
                .collect(),
        }
    }

    /// Layers take so much room together, each no more than another.
    fn shrink_layers(&mut self) {
        let layers = || self.items.iter().filter(|i| i.role == Role::Layer);
        let pixels: usize = layers().map(|i| i.image.pixels.len()).sum();
        let by = (pixels as f64 / MOST_LAYER_PIXELS as f64).sqrt().ceil().max(1.0) as usize;
        if by > 1 {
            for item in self.items.iter_mut().filter(|i| i.role == Role::Layer) {
                let most = item.image.width.max(item.image.height).div_ceil(by);
                item.image = shrunk(&item.image, factor(item.image.width, item.image.height, most));
            }
        }
    }

    /// The images as they lie in the page, with as many bits of mantissa as there is room for.
    fn packed(&self) -> (u32, Vec<Vec<u8>>) {
        let mut last = (0, Vec::new());
        for bits in MANTISSAS {
            let data: Vec<Vec<u8>> = self.items.par_iter().map(|i| pack(&i.image, bits)).collect();
            let fits = data.iter().map(Vec::len).sum::<usize>() <= MOST_BYTES;
            last = (bits, data);
            if fits {
                break;
            }
        }
        last
    }
}

/// Planes of half floats, high bytes before low ones, deflated.
fn pack(image: &Image, mantissa: u32) -> Vec<u8> {
    let count = image.pixels.len();
    let mut bytes = vec![0; 6 * count];
    let (high, low) = bytes.split_at_mut(3 * count);
    for c in 0..3 {
        for (i, pixel) in image.pixels.iter().enumerate() {
            let [h, l] = half(pixel[c], mantissa).to_be_bytes();
            (high[c * count + i], low[c * count + i]) = (h, l);
        }
    }
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(6));
    encoder.write_all(&bytes).and_then(|()| encoder.finish()).expect("writing into memory does not fail")
}

/// The half float nearest to a value, with the mantissa rounded to so many bits. What is too large becomes the largest finite one: an
/// infinite pixel is shown as such only where it was one.
fn half(value: f32, mantissa: u32) -> u16 {
    let sign = ((value.to_bits() >> 16) & 0x8000) as u16;
    let size = value.abs();
    if size.is_nan() {
        return sign | 0x7e00;
    }
    if size == f32::INFINITY {
        return sign | 0x7c00;
    }
    // In units of the least half float, 2^-24, of which those below 2^-14 are whole multiples.
    let exponent = ((size.to_bits() >> 23) as i32 - 127).max(-14);
    let step = f32::from_bits(((exponent - mantissa as i32 + 127) as u32) << 23);
    let rounded = (size / step).round_ties_even() * step;
    if rounded >= 65_504.0 {
        return sign | 0x7bff;
    }
    let bits = rounded.to_bits();
    let exponent = (bits >> 23) as i32 - 127;
    if exponent < -14 {
        return sign | (rounded * 16_777_216.0) as u16;
    }
    sign | (((exponent + 15) as u16) << 10) | ((bits >> 13) & 0x3ff) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    fn float(half: u16) -> f32 {
        let (exponent, mantissa) = (i32::from(half >> 10 & 31), f32::from(half & 0x3ff));
        let size = match exponent {
            0 => mantissa * 2f32.powi(-24),
            31 => {
                if mantissa == 0.0 {
                    f32::INFINITY
                } else {
                    f32::NAN
                }
            }
            e => (1.0 + mantissa / 1024.0) * 2f32.powi(e - 15),
        };
        if half & 0x8000 == 0 { size } else { -size }
    }

    #[test]
    fn halves_are_the_nearest() {
        for (value, bits) in [
            (0.0, 0x0000),
            (1.0, 0x3c00),
            (-2.0, 0xc000),
            (65504.0, 0x7bff),
            (1e30, 0x7bff),
            (f32::INFINITY, 0x7c00),
            (6e-8, 0x0001),
            (1e-9, 0x0000),
            (0.333_251_95, 0x3555),
            (6.097_555e-5, 0x03ff),
            (6.103_516e-5, 0x0400),
        ] {
            assert_eq!(half(value, 10), bits, "{value}");
        }
        assert!(float(half(f32::NAN, 10)).is_nan());
        for bits in (0..0x7c00u16).step_by(7) {
            assert_eq!(half(float(bits), 10), bits);
        }
        // The least change of an exponent that rounding brings about.
        for i in 0..2000 {
            let value = 1.0005f32.powi(i) * 1e-3;
            for mantissa in MANTISSAS {
                let error = (float(half(value, mantissa)) / value - 1.0).abs();
                assert!(error <= 0.5001 * 2f32.powi(-(mantissa as i32)), "{value} {mantissa}: {error}");
            }
        }
    }

    #[test]
    fn fewer_bits_take_less_room() {
        let mut random = crate::math::Stream::new(1, 0, crate::math::StreamKind::Other, 0);
        let image = Image::from_fn(64, 64, |_, _| [0; 3].map(|_| random.next_1d()));
        let sizes = MANTISSAS.map(|bits| pack(&image, bits).len());
        assert!(sizes.is_sorted_by(|a, b| a > b) && sizes[0] < 6 * 64 * 64, "{sizes:?}");
    }
}
