//! EXR files: layers of R, G, B channels in 32-bit floats, and string metadata.
//!
//! A file of ours has one part. The default layer's channels are plainly `R`, `G`, `B`, so that any tool shows
//! it; those of a layer `name` are `name.R`, `name.G`, `name.B`, but for `outliers`, which has no colours: see [`OUTLIERS`]. A render of a crop window keeps its place:
//! the display window is the full frame, the data window the crop. Files of others may have several parts and
//! channels of 16-bit floats or integers too.

use super::image::Image;
use super::output::write_atomically;
use crate::error::{Error, Result};
use exr::image::{AnyChannel, AnyChannels, Encoding, FlatImage, FlatSamples, Layer as Part};
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, IntegerBounds, LineOrder, Text};
use exr::meta::header::{ImageAttributes, LayerAttributes};
use exr::prelude::{Compression, ReadChannels, ReadLayers, WritableImage};
use std::collections::BTreeMap;
use std::io::{Cursor, Error as IoError};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Name of the layer with the largest sample of each pixel. Its three numbers are the channels `outliers.luminance`,
/// `outliers.iteration` and `outliers.share`; as `R`, `G` and `B`, which files of before have, they are read as well.
pub const OUTLIERS: &str = "outliers";

/// The channels of colours.
const COLORS: [&str; 3] = ["R", "G", "B"];

/// The channels of a layer, as they are written.
fn channels_of(layer: &str) -> [&'static str; 3] {
    if layer == OUTLIERS { ["luminance", "iteration", "share"] } else { COLORS }
}

/// One image of a file, by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// ASCII; empty for the default layer. Dots make a hierarchy that some tools show.
    pub name: String,
    /// The pixels of the data window.
    pub image: Image,
}

/// What an EXR file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct LayeredImage {
    /// Columns of the data window, hence of every layer.
    pub width: usize,
    /// Rows of the data window, hence of every layer.
    pub height: usize,
    /// Where the data window's top left pixel lies in the full frame.
    pub origin: [i32; 2],
    /// Width and height of the full frame (the display window).
    pub full_size: [usize; 2],
    /// The layers; the default one, if any, has an empty name.
    pub layers: Vec<Layer>,
    /// Names (ASCII) and texts (UTF-8), written as string attributes.
    pub metadata: Vec<(String, String)>,
}

impl LayeredImage {
    /// A file with this default layer alone, not cropped.
    pub fn new(image: Image) -> Self {
        let (width, height) = (image.width, image.height);
        let layers = vec![Layer { name: String::new(), image }];
        Self { width, height, origin: [0, 0], full_size: [width, height], layers, metadata: Vec::new() }
    }

    /// The layer of that name.
    pub fn layer(&self, name: &str) -> Option<&Image> {
        self.layers.iter().find(|layer| layer.name == name).map(|layer| &layer.image)
    }

    /// Adds a layer.
    pub fn push(&mut self, name: impl Into<String>, image: Image) {
        self.layers.push(Layer { name: name.into(), image });
    }

    /// The text of that name.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.metadata.iter().find(|(key, _)| key == name).map(|(_, text)| text.as_str())
    }
}

/// The default layer (channels `R`, `G`, `B`) of the EXR file at `path`: its data window, as 32-bit floats.
///
/// An error where the file is missing, is not an EXR, is cut short or damaged, or lacks one of these channels.
pub fn read_rgb(path: impl AsRef<Path>) -> Result<Image> {
    let path = path.as_ref();
    let file = read_file(path)?;
    if let Some(index) = file.layers.iter().position(|layer| layer.name.is_empty()) {
        return Ok(file.layers.into_iter().nth(index).expect("found above").image);
    }
    Err(no_rgb(path, &file.channels))
}

/// Every layer of R, G, B channels in the EXR file at `path`, and the file's string attributes; the default
/// layer first, the others by name. Channels that are not one of such a triple (alpha, depth) are passed over.
///
/// Errors as in [`read_rgb`]; a file without any such triple is one.
pub fn read_layers(path: impl AsRef<Path>) -> Result<LayeredImage> {
    let path = path.as_ref();
    let file = read_file(path)?;
    let Some(first) = file.layers.first() else { return Err(no_rgb(path, &file.channels)) };
    Ok(LayeredImage {
        width: first.image.width,
        height: first.image.height,
        origin: file.origin,
        full_size: file.full_size,
        layers: file.layers,
        metadata: file.metadata,
    })
}

/// A string attribute of the EXR file at `path`, of which no pixel is read; `None` where it has none of this name, and where the
/// file is missing or its header damaged.
pub fn read_text(path: impl AsRef<Path>, name: &str) -> Option<String> {
    let path = path.as_ref();
    // As where pixels are read: some damaged files are answered with a panic.
    let meta = catch_unwind(|| MetaData::read_from_file(path, false)).ok()?.ok()?;
    let mut attributes = meta
        .headers
        .iter()
        .flat_map(|h| texts(&h.own_attributes.other).chain(texts(&h.shared_attributes.other)));
    attributes.find(|(key, _)| key == name).map(|(_, text)| text)
}

/// Writes `image` to `path`, replacing it only when all is written. Lossless: every layer in 32-bit floats,
/// compressed by PIZ: on nine noisy layers of 512×512 pixels it took 7% less space than ZIP and a third of the
/// time to write, though four times the time to read.
///
/// An error where the file cannot be written, or a layer has another size than the image, a name that is not
/// ASCII or is there twice; likewise for metadata, whose names must not be among the format's own.
pub fn write(path: impl AsRef<Path>, image: &LayeredImage) -> Result<()> {
    write_compressed(path.as_ref(), image, Compression::PIZ)
}

fn write_compressed(path: &Path, image: &LayeredImage, compression: Compression) -> Result<()> {
    let part = part_of(path, image, compression)?;
    let [width, height] = image.full_size;
    let display_window = IntegerBounds::new(Vec2(0, 0), Vec2(width, height));
    let file =
        exr::image::Image { attributes: ImageAttributes::new(display_window), layer_data: smallvec_of(part) };
    write_atomically(path, |output| {
        // The crate checks what it is given partly by panics; the file must end in an error all the same.
        catch_unwind(AssertUnwindSafe(|| file.write().to_buffered(output)))
            .unwrap_or_else(|_| Err(exr::error::Error::Invalid("the encoder failed".into())))
            .map_err(|e| match e {
                exr::error::Error::Io(e) => e,
                other => IoError::other(other.to_string()),
            })
    })
}

fn smallvec_of<T>(part: Part<T>) -> exr::image::Layers<T> {
    std::iter::once(part).collect()
}

/// The one part of a file of ours: all layers' channels, sorted, and the metadata.
fn part_of(
    path: &Path,
    image: &LayeredImage,
    compression: Compression,
) -> Result<Part<AnyChannels<FlatSamples>>> {
    if image.width == 0 || image.height == 0 || image.layers.is_empty() {
        return Err(Error::file(path, "an EXR file needs at least one pixel and one layer"));
    }
    let mut channels = BTreeMap::new();
    for layer in &image.layers {
        let Layer { name, image: pixels } = layer;
        if (pixels.width, pixels.height) != (image.width, image.height) {
            let (size, file) = (pixels.size_text(), format!("{}x{}", image.width, image.height));
            return Err(Error::file(path, format!("layer `{name}` has {size} pixels in a file of {file}")));
        }
        if !name.is_ascii() || name.bytes().any(|b| b.is_ascii_control()) || name.len() > 250 {
            return Err(Error::file(
                path,
                format!("`{name}` cannot name a layer: at most 250 ASCII characters"),
            ));
        }
        for (index, channel) in channels_of(name).into_iter().enumerate() {
            let full = if name.is_empty() { channel.to_owned() } else { format!("{name}.{channel}") };
            let samples = pixels.pixels.iter().map(|p| p[index]).collect();
            if channels.insert(full, FlatSamples::F32(samples)).is_some() {
                return Err(Error::file(path, format!("two layers have the name `{name}`")));
            }
        }
    }
    let list =
        channels.into_iter().map(|(name, samples)| AnyChannel::new(Text::from(name.as_str()), samples));
    let encoding =
        Encoding { compression, blocks: exr::image::Blocks::ScanLines, line_order: LineOrder::Increasing };
    let attributes = attributes_of(path, image)?;
    let size = Vec2(image.width, image.height);
    Ok(Part::new(size, attributes, encoding, AnyChannels::sort(list.collect())))
}

/// The place of the data window, and the metadata as string attributes.
fn attributes_of(path: &Path, image: &LayeredImage) -> Result<LayerAttributes> {
    let mut attributes = LayerAttributes {
        layer_position: Vec2(image.origin[0], image.origin[1]),
        ..LayerAttributes::default()
    };
    for (key, text) in &image.metadata {
        if key.is_empty() || key.len() > 250 || !key.bytes().all(|b| b.is_ascii_graphic()) {
            return Err(Error::file(path, format!("`{key}` cannot name metadata of an EXR file")));
        }
        let text = Text::from_slice_unchecked(text.as_bytes());
        // The crate has a field for some standard texts, and refuses the names that the format itself uses.
        let previous = match key.as_str() {
            "comments" => attributes.comments.replace(text).is_some(),
            "owner" => attributes.owner.replace(text).is_some(),
            "software" => attributes.software_name.replace(text).is_some(),
            _ => attributes.other.insert(Text::from(key.as_str()), AttributeValue::Text(text)).is_some(),
        };
        if previous {
            return Err(Error::file(path, format!("two metadata texts have the name `{key}`")));
        }
    }
    Ok(attributes)
}

/// What was read: the layers that are R, G, B triples, and the names of all channels.
struct Contents {
    origin: [i32; 2],
    full_size: [usize; 2],
    layers: Vec<Layer>,
    channels: Vec<String>,
    metadata: Vec<(String, String)>,
}

fn read_file(path: &Path) -> Result<Contents> {
    let bytes = std::fs::read(path).map_err(|e| Error::unreadable(path, &e))?;
    decode(&bytes).map_err(|message| Error::file(path, message))
}

/// The contents of an EXR file, or what is wrong with it.
fn decode(bytes: &[u8]) -> Result<Contents, String> {
    if !bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        return Err("is not an EXR image (it does not begin as one)".to_owned());
    }
    // The crate answers some damaged files with a panic. Blocks are decoded on this thread, since a panic in
    // one of its worker threads would end the process.
    let decoded = catch_unwind(|| {
        check_claimed_size(bytes)?;
        exr::image::read::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .non_parallel()
            .from_buffered(Cursor::new(bytes))
            .map_err(|e| damage(&e))
    });
    contents(decoded.unwrap_or_else(|_| Err("cannot be decoded: the file is damaged".to_owned()))?)
}

fn damage(error: &exr::error::Error) -> String {
    match error {
        exr::error::Error::NotSupported(what) => format!("is an EXR file of an unsupported kind: {what}"),
        exr::error::Error::Invalid(what) => format!("is cut short or damaged: {what}"),
        other => format!("cannot be decoded: {other}"),
    }
}

/// Refuses a header that claims more pixels than the rest of the file could hold, before memory is taken for
/// them. No compression of the format gains more than deflate's 1032 to 1, but for blocks that are all one
/// value; 4096 leaves room for these.
fn check_claimed_size(bytes: &[u8]) -> Result<(), String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| damage(&e))?;
    let claimed = meta.headers.iter().fold(0u128, |sum, header| {
        let pixels = header.layer_size.0 as u128 * header.layer_size.1 as u128;
        sum.saturating_add(pixels.saturating_mul(u128::from(header.channels.bytes_per_pixel as u64)))
    });
    if claimed > bytes.len() as u128 * 4096 {
        let held = bytes.len();
        return Err(format!(
            "is cut short or damaged: it claims {claimed} bytes of pixels in a file of {held}"
        ));
    }
    Ok(())
}

fn contents(file: FlatImage) -> Result<Contents, String> {
    let Vec2(width, height) = file.attributes.display_window.size;
    let plain = |part: &Part<AnyChannels<FlatSamples>>| {
        COLORS.iter().all(|c| part.channel_data.list.iter().any(|x| text_of(&x.name) == *c))
    };
    // In a file of several parts, a part's name stands for the layer; but what other tools show first, the
    // first part with plain R, G, B, is the default layer.
    let default = file.layer_data.iter().position(plain).unwrap_or(0);
    let origin = file.layer_data.first().map_or(Vec2(0, 0), |part| part.attributes.layer_position);
    let size = file.layer_data.first().map_or(Vec2(0, 0), |part| part.size);
    let metadata = metadata_of(&file);
    let mut channels = Vec::new();
    let mut found: BTreeMap<String, [Option<FlatSamples>; 3]> = BTreeMap::new();
    for (index, part) in file.layer_data.into_iter().enumerate() {
        let part_name = part.attributes.layer_name.as_ref().map(text_of).filter(|_| index != default);
        let part_name = part_name.unwrap_or_default();
        if part.size != size {
            return Err("has parts of different sizes, which is not supported".to_owned());
        }
        for channel in part.channel_data.list {
            let name = text_of(&channel.name);
            let (prefix, last) = name.rsplit_once('.').unwrap_or(("", &name));
            let layer = if prefix.is_empty() { part_name.as_str() } else { prefix };
            let index =
                [COLORS, channels_of(layer)].iter().find_map(|names| names.iter().position(|c| *c == last));
            if let Some(index) = index {
                let triple = found.entry(layer.to_owned()).or_default();
                triple[index].get_or_insert(channel.sample_data);
            }
            channels.push(name);
        }
    }
    let mut layers = Vec::new();
    for (name, triple) in found {
        if let [Some(r), Some(g), Some(b)] = triple {
            layers.push(Layer { name, image: interleave(size, [r, g, b])? });
        }
    }
    Ok(Contents { origin: [origin.0, origin.1], full_size: [width, height], layers, channels, metadata })
}

fn interleave(size: Vec2<usize>, samples: [FlatSamples; 3]) -> Result<Image, String> {
    let Vec2(width, height) = size;
    let mut image = Image::new(width, height);
    for (index, channel) in samples.iter().enumerate() {
        if channel.len() != image.pixels.len() {
            return Err("has subsampled R, G or B channels, which is not supported".to_owned());
        }
        for (pixel, value) in image.pixels.iter_mut().zip(channel.values_as_f32()) {
            pixel[index] = value;
        }
    }
    Ok(image)
}

/// The string attributes of the first part, by name.
fn metadata_of(file: &FlatImage) -> Vec<(String, String)> {
    let own = file.layer_data.first().into_iter().flat_map(|part| {
        let a = &part.attributes;
        let known = [("comments", &a.comments), ("owner", &a.owner), ("software", &a.software_name)];
        let known = known.into_iter().filter_map(|(k, t)| t.as_ref().map(|t| (k.to_owned(), text_of(t))));
        known.chain(texts(&a.other))
    });
    let all: BTreeMap<String, String> = texts(&file.attributes.other).chain(own).collect();
    all.into_iter().collect()
}

fn texts<'a>(
    attributes: impl IntoIterator<Item = (&'a Text, &'a AttributeValue)>,
) -> impl Iterator<Item = (String, String)> {
    attributes.into_iter().filter_map(|(name, value)| match value {
        AttributeValue::Text(text) => Some((text_of(name), text_of(text))),
        _ => None,
    })
}

fn text_of(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

fn no_rgb(path: &Path, channels: &[String]) -> Error {
    let there = if channels.is_empty() { "none".to_owned() } else { channels.join(", ") };
    Error::file(
        path,
        format!("has no channels R, G and B in its default layer; the channels there are: {there}"),
    )
}

#[cfg(test)]
#[path = "exr_tests.rs"]
mod tests;
