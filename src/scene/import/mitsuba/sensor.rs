//! Sensors and films.

use super::super::Far;
use super::super::numbers::{array, number};
use super::Translator;
use super::tree::Element;
use crate::error::Result;

const SENSOR: [&str; 17] = [
    "to_world",
    "fov",
    "fov_axis",
    "focal_length",
    "near_clip",
    "far_clip",
    "focus_distance",
    "aperture_radius",
    "principal_point_offset_x",
    "principal_point_offset_y",
    "shutter_open",
    "shutter_close",
    "medium",
    "film",
    "sampler",
    "srf",
    "id",
];
const FILM: [&str; 15] = [
    "width",
    "height",
    "crop_offset_x",
    "crop_offset_y",
    "crop_width",
    "crop_height",
    "pixel_format",
    "component_format",
    "file_format",
    "sample_border",
    "high_quality_edges",
    "compensate",
    "banner",
    "rfilter",
    "filter",
];

impl Translator<'_> {
    /// `[film]` and `[camera]`.
    pub(super) fn sensor(&mut self, sensor: &Element) -> Result<()> {
        let lens = match sensor.kind()? {
            "perspective" => false,
            "thinlens" => true,
            _ => return Err(sensor.unsupported("only perspective and thinlens sensors are supported")),
        };
        sensor.only(&SENSOR)?;
        for shift in ["principal_point_offset_x", "principal_point_offset_y"] {
            if sensor.number_or(shift, 0.0)? != 0.0 {
                return Err(sensor.unsupported(&format!("`{shift}` is not supported")));
            }
        }
        let near = sensor.number_or("near_clip", 0.01)?;
        if near <= 0.0 {
            return Err(sensor.error(format!("`near_clip` is {near}; it must be positive")));
        }
        let far = sensor.number_or("far_clip", 10_000.0)?;
        if far <= near {
            return Err(sensor.error(format!("`far_clip` is {far}; it must be behind `near_clip`, {near}")));
        }
        let place = sensor.property("far_clip").map_or(&sensor.place, |clip| &clip.place).clone();
        self.document.far = Some(Far { distance: far, place });
        if sensor.property("srf").is_some() {
            return Err(sensor.unsupported("a spectral response `srf` is not supported"));
        }
        let (width, height) = self.film(sensor)?;
        let (fov, axis) = field_of_view(sensor, f64::from(width) / f64::from(height))?;
        let to_world = sensor.transform("to_world")?;
        let (m, origin) = (to_world.matrix3, to_world.translation);
        let lengths = [m.x_axis.length(), m.y_axis.length(), m.z_axis.length()];
        if lengths.iter().any(|l| (l - 1.0).abs() > 1e-3) {
            return Err(sensor.unsupported("its `to_world` scales, which a sensor must not"));
        }
        if m.determinant() < 0.0 {
            return Err(sensor.unsupported("its `to_world` mirrors the picture, which is not supported"));
        }
        // Far enough for the direction to keep its digits in single precision.
        let target = origin + m.z_axis * origin.length().max(1.0);
        self.document.table(&sensor.place, "[camera]");
        self.document.line(format!("origin = {}", array(&origin.to_array())));
        self.document.line(format!("target = {}", array(&target.to_array())));
        self.document.line(format!("up = {}", array(&m.y_axis.to_array())));
        self.document.line(format!("fov = {}\nfov_axis = \"{axis}\"", number(fov)));
        self.document.line(format!("near = {}", number(near)));
        if lens {
            let radius = sensor.property("aperture_radius");
            let radius =
                radius.ok_or_else(|| sensor.error("a thin lens has no `aperture_radius`"))?.number()?;
            let distance = sensor.number_or("focus_distance", 10_000.0)?;
            self.document.line(format!(
                "lens_radius = {}\nfocus_distance = {}",
                number(radius),
                number(distance)
            ));
        }
        Ok(())
    }

    /// The film; its size.
    fn film(&mut self, sensor: &Element) -> Result<(u32, u32)> {
        let films = self.below(sensor, "film")?;
        let Some(film) = films.first() else {
            self.document.warn(&sensor.place, "without a film: 768x576 pixels, as Mitsuba has it");
            self.document.table(&sensor.place, "[film]\nwidth = 768\nheight = 576");
            return Ok((768, 576));
        };
        if film.kind()? != "hdrfilm" {
            return Err(film.unsupported("only hdrfilm is supported"));
        }
        film.only(&FILM)?;
        let filters = self.below(film, "rfilter")?;
        let filter = filters.first().map_or(Ok("gaussian"), |f| f.kind())?.to_owned();
        if filter != "box" {
            let place = filters.first().map_or(&film.place, |f| &f.place).clone();
            let message = format!(
                "the reconstruction filter is a box here, not `{filter}`: edges are a little sharper, means are the same"
            );
            self.document.warn(&place, message);
        }
        let size = |name: &str, default: i64| {
            let n = film.integer(name)?.unwrap_or(default);
            u32::try_from(n).map_err(|_| film.error(format!("`{name}` is {n}")))
        };
        let (width, height) = (size("width", 768)?, size("height", 576)?);
        if width == 0 || height == 0 {
            return Err(film.error("a film without pixels"));
        }
        self.document.table(&film.place, format!("[film]\nwidth = {width}\nheight = {height}"));
        let (x, y) = (size("crop_offset_x", 0)?, size("crop_offset_y", 0)?);
        let (w, h) = (size("crop_width", width.into())?, size("crop_height", height.into())?);
        if (x, y, w, h) != (0, 0, width, height) {
            let (right, bottom) = (u64::from(x) + u64::from(w), u64::from(y) + u64::from(h));
            self.document.line(format!("crop = [{x}, {y}, {right}, {bottom}]"));
        }
        Ok((width, height))
    }
}

/// The angle in degrees, and the axis that it is along.
fn field_of_view(sensor: &Element, aspect: f64) -> Result<(f64, &'static str)> {
    let (fov, axis) = match (sensor.property("fov"), sensor.string("focal_length")?) {
        (Some(_), Some(_)) => {
            return Err(sensor.error("both `fov` and `focal_length`: one of them is enough"));
        }
        (Some(fov), None) => (fov.number()?, sensor.string("fov_axis")?.unwrap_or("x")),
        (None, length) => {
            // Of the diagonal of a film of 36 by 24 millimetres.
            let text = length.unwrap_or("50mm");
            let millimetres =
                text.trim().trim_end_matches("mm").trim().parse::<f64>().ok().filter(|l| *l > 0.0);
            let length = millimetres
                .ok_or_else(|| sensor.error(format!("`{text}` is not a focal length such as 50mm")))?;
            let diagonal = (36.0f64 * 36.0 + 24.0 * 24.0).sqrt();
            (2.0 * (diagonal / (2.0 * length)).atan().to_degrees(), "diagonal")
        }
    };
    match axis {
        "x" => Ok((fov, "horizontal")),
        "y" => Ok((fov, "vertical")),
        "smaller" => Ok((fov, if aspect > 1.0 { "vertical" } else { "horizontal" })),
        "larger" => Ok((fov, if aspect > 1.0 { "horizontal" } else { "vertical" })),
        "diagonal" => {
            let diagonal = (fov.to_radians() / 2.0).tan();
            let width = diagonal / (1.0 + 1.0 / (aspect * aspect)).sqrt();
            Ok((2.0 * width.atan().to_degrees(), "horizontal"))
        }
        other => Err(sensor.error(format!("`{other}` is no `fov_axis`: x, y, diagonal, smaller or larger"))),
    }
}
