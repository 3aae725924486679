//! PNG files, and the way from linear radiance to 8 bits: exposure and a tone curve.

use super::image::Image;
use super::output::write_bytes;
use crate::error::{Error, Result};
use std::path::Path;

/// Shown for a pixel with a NaN or infinite channel: nothing that a tone curve would turn grey or white.
pub const NOT_FINITE: [u8; 3] = [255, 0, 255];

/// From exposed linear light to what a display shows, before the sRGB encoding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ToneCurve {
    /// Linear, clamped to [0, 1]: values can be compared by eye and read back.
    #[default]
    Srgb,
    /// A filmic shoulder and toe, channel by channel: highlights keep their structure.
    Filmic,
}

impl ToneCurve {
    /// Exposed linear light to display-linear [0, 1]; negative light is black.
    pub fn apply(self, x: f32) -> f32 {
        match self {
            Self::Srgb => x.clamp(0.0, 1.0),
            // 0.18 stays near where the linear curve has it.
            Self::Filmic => aces(0.6 * x),
        }
    }
}

/// A rational fit to the ACES reference and output transforms [Narkowicz 2016], clamped to [0, 1]; negative
/// values are 0.
pub fn aces(x: f32) -> f32 {
    // Beyond this the curve is at its clamp, while its square would overflow at 10^19.
    let x = x.clamp(0.0, 1e6);
    (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)).clamp(0.0, 1.0)
}

/// The sRGB encoding of a display-linear value in [0, 1] (IEC 61966-2-1).
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The inverse of [`srgb_encode`].
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// 8 bits a channel, sRGB-encoded; what a PNG file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DisplayImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` pixels; row 0 is the top one.
    pub pixels: Vec<[u8; 3]>,
}

impl DisplayImage {
    /// The image as the bytes of a PNG file; an error for an image without pixels or too large for the format.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let refused = |what: String| Error::usage(format!("cannot make a PNG image: {what}"));
        let size = |n: usize| u32::try_from(n).map_err(|e| refused(e.to_string()));
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size(self.width)?, size(self.height)?);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
        let mut writer = encoder.write_header().map_err(|e| refused(e.to_string()))?;
        writer.write_image_data(self.pixels.as_flattened()).map_err(|e| refused(e.to_string()))?;
        writer.finish().map_err(|e| refused(e.to_string()))?;
        Ok(bytes)
    }

    /// Writes the image to the PNG file at `path`, replacing it only when all is written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        let bytes = self.encode().map_err(|e| Error::file(path, e.to_string()))?;
        write_bytes(path, &bytes)
    }
}

/// The image multiplied by 2^`exposure_stops`, through the curve, in 8 bits. Pixels with a NaN or infinite
/// channel are [`NOT_FINITE`].
pub fn display(image: &Image, exposure_stops: f32, curve: ToneCurve) -> DisplayImage {
    let gain = exposure_stops.exp2();
    let channel = |v: f32| (srgb_encode(curve.apply(v * gain)) * 255.0).round() as u8;
    let pixel = |p: &[f32; 3]| {
        if p.iter().all(|v| v.is_finite()) { p.map(channel) } else { NOT_FINITE }
    };
    DisplayImage {
        width: image.width,
        height: image.height,
        pixels: image.pixels.iter().map(pixel).collect(),
    }
}

/// [`display`] as the bytes of a PNG file, for `data:` addresses and the like.
pub fn encode(image: &Image, exposure_stops: f32, curve: ToneCurve) -> Result<Vec<u8>> {
    display(image, exposure_stops, curve).encode()
}

/// [`display`] to the PNG file at `path`, replacing it only when all is written.
pub fn write(path: impl AsRef<Path>, image: &Image, exposure_stops: f32, curve: ToneCurve) -> Result<()> {
    display(image, exposure_stops, curve).write(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(bytes: &[u8]) -> (u32, u32, Vec<u8>) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        (info.width, info.height, pixels)
    }

    #[test]
    fn encodes_known_values() {
        // 0.21586 is the linear light of the sRGB value 128; a stop doubles it.
        let image = Image { width: 2, height: 1, pixels: vec![[0.0, 0.215_86, 1.0], [-1.0, 2.0, 0.107_93]] };
        let (width, height, pixels) = decode(&encode(&image, 0.0, ToneCurve::Srgb).unwrap());
        assert_eq!((width, height), (2, 1));
        assert_eq!(pixels[..5], [0, 128, 255, 0, 255]);
        let (.., brighter) = decode(&encode(&image, 1.0, ToneCurve::Srgb).unwrap());
        assert_eq!(brighter[5], 128);
    }

    #[test]
    fn every_float_has_a_colour() {
        for bits in (0..=u32::MAX).step_by(65_521) {
            let v = f32::from_bits(bits);
            for curve in [ToneCurve::Srgb, ToneCurve::Filmic] {
                let image = Image { width: 1, height: 1, pixels: vec![[v, 0.5, 0.5]] };
                let shown = display(&image, 3.0, curve).pixels[0];
                assert_eq!(shown == NOT_FINITE, !v.is_finite(), "{v} {shown:?}");
            }
        }
    }

    #[test]
    fn curves_increase_and_stay_within_bounds() {
        for curve in [ToneCurve::Srgb, ToneCurve::Filmic] {
            let values: Vec<f32> = (0..4000).map(|i| curve.apply((i as f32 * 0.01 - 20.0).exp2())).collect();
            assert!(values.is_sorted() && values[0] >= 0.0 && values[3999] == 1.0, "{curve:?}");
        }
        assert!(ToneCurve::Filmic.apply(4.0) < 1.0, "a highlight of 4 keeps its structure");
    }

    #[test]
    fn the_encoding_has_its_inverse() {
        for i in 0..=1000 {
            let v = i as f32 / 1000.0;
            assert!((srgb_decode(srgb_encode(v)) - v).abs() < 1e-5, "{v}");
        }
    }

    #[test]
    fn an_empty_image_is_an_error() {
        assert!(encode(&Image::new(0, 3), 0.0, ToneCurve::Srgb).is_err());
    }
}
