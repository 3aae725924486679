//! Emitters that are no shapes.

use super::super::numbers::{array, color, number, quoted};
use super::tree::Element;
use super::{Translator, file_of, matrix, used_at};
use crate::error::{Error, Result};
use crate::scene::file::assets::Asset;
use crate::texture::load::{self, Encoding, Raster};
use glam::{DAffine3, DVec3};

impl Translator<'_> {
    /// `[[light]]`.
    pub(super) fn emitter(&mut self, emitter: &Element) -> Result<()> {
        let light = match emitter.kind()? {
            "point" => {
                emitter.only(&["position", "to_world", "intensity", "sampling_weight"])?;
                let position = match emitter.point("position")? {
                    Some(position) => position,
                    None => emitter.transform("to_world")?.translation,
                };
                let intensity = emitter.color_or("intensity", 1.0)?;
                format!(
                    "point = {{ position = {}, intensity = {} }}",
                    array(&position.to_array()),
                    color(intensity)
                )
            }
            "spot" => spot(emitter)?,
            "directional" => {
                emitter.only(&["direction", "to_world", "irradiance", "sampling_weight"])?;
                let direction = match emitter.point("direction")? {
                    Some(direction) => direction,
                    None => emitter.transform("to_world")?.matrix3.z_axis,
                };
                let irradiance = emitter.color_or("irradiance", 1.0)?;
                let direction = array(&direction.to_array());
                format!("directional = {{ direction = {direction}, irradiance = {} }}", color(irradiance))
            }
            "constant" => {
                emitter.only(&["radiance", "sampling_weight"])?;
                format!("environment = {{ radiance = {} }}", color(emitter.color_or("radiance", 1.0)?))
            }
            "envmap" => self.envmap(emitter)?,
            _ => return Err(emitter.unsupported("this kind of emitter is not supported")),
        };
        self.document.table(&emitter.place, "[[light]]");
        if let Some(id) = emitter.attribute("id") {
            self.document.line(format!("name = {}", quoted(id)));
        }
        self.document.line(light);
        Ok(())
    }

    fn envmap(&mut self, emitter: &Element) -> Result<String> {
        emitter.only(&["filename", "scale", "to_world", "sampling_weight", "mis_compensation"])?;
        let path = file_of(self.tree, emitter)?;
        let raster = load::read(&path, Encoding::Srgb).map_err(|e| used_at(emitter, e))?;
        let message = "the environment's rows are interpolated anew, as ours do not stand on the poles: between them it \
                       differs by up to an eighth of their second differences";
        self.document.warn(&emitter.place, message);
        let bytes = without_poles(&raster).map_err(|e| used_at(emitter, e))?;
        self.document.read_file(&path);
        let stem = path.file_stem().map_or("sky".into(), |s| s.to_string_lossy()).into_owned();
        let file = self.document.asset(&stem, "exr", Asset::Bytes(bytes));
        let mut light = format!("environment = {{ image = {}", quoted(&file));
        let scale = emitter.number_or("scale", 1.0)?;
        if scale != 1.0 {
            light.push_str(&format!(", scale = {}", number(scale)));
        }
        let mut to_world = emitter.transform("to_world")?;
        to_world.translation = DVec3::ZERO;
        if to_world != DAffine3::IDENTITY {
            light.push_str(&format!(", transform = [{{ matrix = {} }}]", matrix(&to_world)));
        }
        light.push_str(" }");
        Ok(light)
    }
}

/// The picture with twice the rows less two, as an EXR file. Mitsuba's first and last rows stand on the poles, so that row j
/// of n is at j/(n − 1) of the way down; ours are in the middle of their share of it. What lies between two of its rows is kept
/// but for the quarter next to each, where the corner is cut.
fn without_poles(raster: &Raster) -> Result<Vec<u8>> {
    use exr::prelude::{Image, SpecificChannels, Vec2, WritableImage};
    let (width, rows) = (raster.width as usize, raster.height as usize);
    let height = (2 * rows).saturating_sub(2).max(1);
    let pixel = |at: Vec2<usize>| {
        let y = if rows > 1 { 0.5 * at.y() as f32 + 0.25 } else { 0.0 };
        let (above, share) = (y as usize, y.fract());
        let below = (above + 1).min(rows - 1);
        let [a, b] = [above, below].map(|row| raster.texels[row * width + at.x()]);
        let mix = |i: usize| a[i] + (b[i] - a[i]) * share;
        (mix(0), mix(1), mix(2))
    };
    let image = Image::from_channels((width, height), SpecificChannels::rgb(pixel));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image
        .write()
        .to_buffered(&mut bytes)
        .map_err(|e| Error::usage(format!("the environment's picture: {e}")))?;
    Ok(bytes.into_inner())
}

fn spot(emitter: &Element) -> Result<String> {
    emitter.only(&["to_world", "intensity", "cutoff_angle", "beam_width", "sampling_weight", "texture"])?;
    if let Some(texture) = emitter.property("texture") {
        return Err(texture.unsupported("a texture of a spot is not supported"));
    }
    let to_world = emitter.transform("to_world")?;
    let position = to_world.translation;
    let axis = to_world.matrix3.z_axis.try_normalize();
    let axis = axis.ok_or_else(|| emitter.error("its `to_world` leaves the spot no direction"))?;
    // Far enough for the direction to keep its digits in single precision.
    let target = position + axis * position.length().max(1.0);
    let cutoff = emitter.number_or("cutoff_angle", 20.0)?;
    let inner = emitter.number_or("beam_width", 0.75 * cutoff)?;
    Ok(format!(
        "spot = {{ position = {}, target = {}, intensity = {}, inner = {}, cutoff = {}, falloff = \"linear\" }}",
        array(&position.to_array()),
        array(&target.to_array()),
        color(emitter.color_or("intensity", 1.0)?),
        number(inner),
        number(cutoff)
    ))
}
