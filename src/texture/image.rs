//! An image as a texture: bilinear between texel centres, repeated or clamped outside.

use super::load::{self, Encoding};
use crate::Result;
use crate::math::Rgb;
use glam::{Affine2, Vec2, Vec3};
use std::path::Path;

/// What lies outside of the unit square of (u, v).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The nearest texel of the edge.
    Clamp,
}

/// Linear RGB texels, 12 bytes each.
#[derive(Clone, Debug)]
pub struct ImageTexture {
    width: u32,
    height: u32,
    wrap: Wrap,
    /// Row by row, the upper row (v = 1) first.
    texels: Vec<Vec3>,
    average: Vec3,
    min: Vec3,
    max: Vec3,
    /// What becomes of texture coordinates first.
    uv: Option<Affine2>,
}

impl ImageTexture {
    /// From linear RGB texels, row by row, the upper row (v = 1) first. An error where the number of texels is not
    /// width × height, is 0, or a value is not finite.
    pub fn new(width: u32, height: u32, texels: Vec<[f32; 3]>, wrap: Wrap) -> Result<Self, String> {
        if texels.is_empty() || texels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(format!("an image of {width}x{height} cannot have {} texels", texels.len()));
        }
        let texels: Vec<Vec3> = texels.into_iter().map(Vec3::from).collect();
        let bad = texels.iter().filter(|t| !t.is_finite()).count();
        if bad > 0 {
            return Err(format!("{bad} of {} texels are not finite numbers", texels.len()));
        }
        let sum = texels.iter().fold(glam::DVec3::ZERO, |sum, t| sum + t.as_dvec3());
        let average = (sum / texels.len() as f64).as_vec3();
        let min = texels.iter().copied().reduce(Vec3::min).expect("there are texels");
        let max = texels.iter().copied().reduce(Vec3::max).expect("there are texels");
        Ok(Self { width, height, wrap, texels, average, min, max, uv: None })
    }

    /// From a PNG, EXR or HDR file; see [`load::read`] for what is understood and what fails.
    pub fn load(path: &Path, encoding: Encoding, wrap: Wrap) -> Result<Self> {
        let raster = load::read(path, encoding)?;
        Self::new(raster.width, raster.height, raster.texels, wrap).map_err(|e| crate::Error::file(path, e))
    }

    /// The same with texture coordinates that go through `uv` first.
    pub fn with_uv(mut self, uv: Affine2) -> Self {
        self.uv = Some(uv);
        self
    }

    /// Width in texels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in texels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The texel in column `x` from the left and row `y` from the top.
    pub fn texel(&self, x: u32, y: u32) -> Rgb {
        Rgb::from(self.texels[y as usize * self.width as usize + x as usize])
    }

    /// Mean of all texels.
    pub fn average(&self) -> Rgb {
        self.average.into()
    }

    /// The smallest value of each channel.
    pub fn min(&self) -> Rgb {
        self.min.into()
    }

    /// The largest value of each channel.
    pub fn max(&self) -> Rgb {
        self.max.into()
    }

    /// The two texels along one axis that `t` lies between, and the share of the second.
    #[inline]
    fn neighbours(&self, t: f32, size: u32) -> (usize, usize, f32) {
        let t = match self.wrap {
            Wrap::Repeat => t - t.floor(),
            Wrap::Clamp => t.clamp(0.0, 1.0),
        };
        let x = t * size as f32 - 0.5;
        let floor = x.floor();
        let last = size - 1;
        // `as` saturates, and takes NaN to 0: no coordinate can lead out of the image.
        let (low, high) = match self.wrap {
            _ if floor >= 0.0 => (floor as u32, floor as u32 + 1),
            Wrap::Repeat => (last, 0),
            Wrap::Clamp => (0, 0),
        };
        let high = match self.wrap {
            _ if high <= last => high,
            Wrap::Repeat => 0,
            Wrap::Clamp => last,
        };
        (low.min(last) as usize, high as usize, x - floor)
    }

    /// The colour at `uv`, bilinear between texel centres.
    #[inline]
    pub fn eval(&self, uv: Vec2) -> Rgb {
        let uv = self.uv.map_or(uv, |map| map.transform_point2(uv));
        if !uv.is_finite() {
            return self.average();
        }
        let (x0, x1, fx) = self.neighbours(uv.x, self.width);
        let (y0, y1, fy) = self.neighbours(1.0 - uv.y, self.height);
        let (row0, row1) = (y0 * self.width as usize, y1 * self.width as usize);
        let at = |i: usize| Rgb::from(self.texels[i]);
        let top = at(row0 + x0).lerp(at(row0 + x1), fx);
        let bottom = at(row1 + x0).lerp(at(row1 + x1), fx);
        top.lerp(bottom, fy)
    }
}
