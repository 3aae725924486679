//! Image files as linear RGB: PNG (8 and 16 bits), JPEG, OpenEXR and Radiance HDR.

use crate::{Error, Result};
use std::path::Path;

/// How a file's numbers stand for light. Only PNG and JPEG have a choice: EXR and HDR files are linear.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoding {
    /// Colours: their values are decoded by the sRGB curve.
    #[default]
    Srgb,
    /// Data: their values are divided by their maximum and nothing else.
    Linear,
}

/// Linear RGB, row by row from the top.
#[derive(Clone, Debug)]
pub struct Raster {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` of them.
    pub texels: Vec<[f32; 3]>,
}

/// The sRGB curve's inverse: from an encoded value to a linear one, both 0 to 1 [IEC 61966-2-1].
pub fn srgb_to_linear(encoded: f32) -> f32 {
    let x = f64::from(encoded);
    let linear = if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
    linear as f32
}

/// Reads a PNG, JPEG, EXR or HDR file (by its ending, in any case). Grey images fill all three channels; alpha is ignored.
/// An error names the file where it is missing, of another kind, damaged or cut short.
pub fn read(path: &Path, encoding: Encoding) -> Result<Raster> {
    if kind(path).is_none() {
        return Err(unknown(path));
    }
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read the image", &e))?;
    decode(path, &bytes, encoding)
}

/// As [`read`], of a file's bytes; `path` is for its ending and for messages.
pub fn decode(path: &Path, bytes: &[u8], encoding: Encoding) -> Result<Raster> {
    match kind(path) {
        Some(Kind::Png) => read_low(path, bytes, image::ImageFormat::Png, encoding),
        Some(Kind::Jpeg) => read_low(path, bytes, image::ImageFormat::Jpeg, encoding),
        Some(Kind::Hdr) => read_hdr(path, bytes),
        Some(Kind::Exr) => read_exr(path, bytes),
        None => Err(unknown(path)),
    }
}

enum Kind {
    Png,
    Jpeg,
    Hdr,
    Exr,
}

fn kind(path: &Path) -> Option<Kind> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    match ending.as_str() {
        "png" => Some(Kind::Png),
        "jpg" | "jpeg" => Some(Kind::Jpeg),
        "hdr" => Some(Kind::Hdr),
        "exr" => Some(Kind::Exr),
        _ => None,
    }
}

fn unknown(path: &Path) -> Error {
    Error::file(path, "not a kind of image that can be read; use .png, .jpg, .exr or .hdr")
}

/// PNG and JPEG: numbers of few bits.
fn read_low(path: &Path, bytes: &[u8], format: image::ImageFormat, encoding: Encoding) -> Result<Raster> {
    let name = if format == image::ImageFormat::Png { "PNG" } else { "JPEG" };
    let image = image::load_from_memory_with_format(bytes, format)
        .map_err(|e| Error::file(path, format!("cannot read the {name} image: {e}")))?;
    let decode = |v: f32| match encoding {
        Encoding::Srgb => srgb_to_linear(v),
        Encoding::Linear => v,
    };
    let (width, height) = (image.width(), image.height());
    // Eight bits have 256 values: a table costs less than a power for each.
    let texels = match image.color().bytes_per_pixel() / image.color().channel_count() {
        1 => {
            let table: Vec<f32> = (0..=255u8).map(|v| decode(f32::from(v) / 255.0)).collect();
            image.into_rgb8().pixels().map(|p| p.0.map(|v| table[usize::from(v)])).collect()
        }
        _ => image.into_rgb16().pixels().map(|p| p.0.map(|v| decode(f32::from(v) / 65535.0))).collect(),
    };
    Ok(Raster { width, height, texels })
}

fn read_hdr(path: &Path, bytes: &[u8]) -> Result<Raster> {
    let image = image::load_from_memory_with_format(bytes, image::ImageFormat::Hdr)
        .map_err(|e| Error::file(path, format!("cannot read the HDR image: {e}")))?;
    let (width, height) = (image.width(), image.height());
    Ok(Raster { width, height, texels: image.into_rgb32f().pixels().map(|p| p.0).collect() })
}

fn read_exr(path: &Path, bytes: &[u8]) -> Result<Raster> {
    use exr::prelude::*;
    let failed =
        |e: &dyn std::fmt::Display| crate::Error::file(path, format!("cannot read the EXR image: {e}"));
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(bytes))
        .map_err(|e| failed(&e))?;
    let size = image.layer_data.size;
    let channels = &image.layer_data.channel_data.list;
    let find = |name: &str| channels.iter().find(|c| c.name.eq_case_insensitive(name));
    let planes = match (find("R"), find("G"), find("B"), find("Y")) {
        (Some(r), Some(g), Some(b), _) => [r, g, b],
        (None, None, None, Some(y)) => [y, y, y],
        _ => return Err(failed(&"its first layer has neither the channels R, G, B nor Y")),
    };
    if planes.iter().any(|c| c.sample_data.len() != size.area()) {
        return Err(failed(&"its channels are subsampled"));
    }
    let texels =
        (0..size.area()).map(|i| planes.map(|c| c.sample_data.value_by_flat_index(i).to_f32())).collect();
    let too_large = |_| failed(&"it has too many rows or columns");
    let width = u32::try_from(size.width()).map_err(too_large)?;
    let height = u32::try_from(size.height()).map_err(too_large)?;
    Ok(Raster { width, height, texels })
}
