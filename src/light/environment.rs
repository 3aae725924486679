//! Radiance from all directions at infinity: constant, or a latitude-longitude image.
//!
//! An image's top row is about the +y direction of the light's own frame and its bottom row about −y; its left edge,
//! and its right edge, look along −z, a quarter from the left along +x, its middle along +z: seen from within, the
//! image is not mirrored. (The same as Mitsuba's, but for where pixels lie: here pixel i of n covers
//! [i/n, (i+1)/n] and its centre has its value.)
//!
//! Radiance is interpolated bilinearly between pixel centres, around the image's left and right edge; beyond the
//! first and the last row's centres it is constant along meridians. Directions are sampled by pixel, with the
//! pixel's solid angle times the luminance of the mean of the interpolated radiance over the pixel, and uniformly
//! per solid angle within the pixel. That mean contains every neighbour that the interpolation within the pixel can
//! reach, hence the density is positive wherever the radiance is, and it has no pole.

use super::check_colour;
use crate::math::{Piecewise2d, Rgb, RgbExt, warp};
use glam::{Mat3A, Vec2, Vec3A};
use std::f32::consts::PI;

/// An environment light.
#[derive(Clone, Debug)]
pub struct EnvironmentLight(Kind);

#[derive(Clone, Debug)]
enum Kind {
    Constant(Rgb),
    Image(Box<LatLong>),
}

#[derive(Clone, Debug)]
struct LatLong {
    width: usize,
    height: usize,
    /// Radiance, row by row from the top, with the scale multiplied in.
    pixels: Vec<[f32; 3]>,
    /// `None` for a black image.
    density: Option<Piecewise2d>,
    /// Cosine to +y of the rows' edges, `height + 1` of them. In f64, as they lie close near the poles.
    cos_edges: Vec<f64>,
    /// 1 / (solid angle of a pixel · number of pixels) in each row: per unit square → per solid angle.
    per_solid_angle: Vec<f32>,
    /// ∫ radiance dω.
    integral: Rgb,
    to_world: Mat3A,
    to_local: Mat3A,
}

impl EnvironmentLight {
    /// The same `radiance` \[W/(sr m²)\] from everywhere.
    ///
    /// # Errors
    /// Where the radiance is negative or not finite.
    pub fn constant(radiance: Rgb) -> Result<Self, String> {
        check_colour("environment", "radiance", radiance)?;
        Ok(Self(Kind::Constant(radiance)))
    }

    /// A latitude-longitude image of `width * height` pixels of linear RGB, row 0 on top, times `scale`, rotated by
    /// `to_world` (see the module about where its pixels lie).
    ///
    /// # Errors
    /// Where the number of pixels is wrong, a pixel or the scale is negative or not finite, or the matrix is neither a
    /// rotation nor a rotation with a reflection.
    pub fn image(
        width: usize,
        height: usize,
        mut pixels: Vec<[f32; 3]>,
        to_world: Mat3A,
        scale: f32,
    ) -> Result<Self, String> {
        if width == 0 || height == 0 || pixels.len() != width * height {
            let n = pixels.len();
            return Err(format!("environment light: {n} pixels for an image of {width}x{height}"));
        }
        if !(scale >= 0.0 && scale.is_finite()) {
            return Err(format!("environment light: the scale {scale} must be finite and not negative"));
        }
        let to_local = to_world.transpose();
        if !to_world.is_finite() || !(to_world * to_local).abs_diff_eq(Mat3A::IDENTITY, 1e-4) {
            return Err("environment light: the transform must be a rotation (no scale or shear)".into());
        }
        for (i, pixel) in pixels.iter_mut().enumerate() {
            for c in pixel.iter_mut() {
                if !(*c >= 0.0 && (*c * scale).is_finite()) {
                    let (x, y) = (i % width, i / width);
                    return Err(format!(
                        "environment light: the image has {c} at column {x}, row {y}; it must be finite and not negative"
                    ));
                }
                *c *= scale;
            }
        }
        Ok(Self(Kind::Image(Box::new(LatLong::new(width, height, pixels, to_world)))))
    }

    /// ∫ radiance dω over the sphere, each channel, in W/m².
    pub fn integral(&self) -> Rgb {
        match &self.0 {
            Kind::Constant(radiance) => *radiance * (4.0 * PI),
            Kind::Image(image) => image.integral,
        }
    }

    /// Radiance from the unit direction `toward` (from the scene to the light).
    #[inline]
    pub fn radiance(&self, toward: Vec3A) -> Rgb {
        match &self.0 {
            Kind::Constant(radiance) => *radiance,
            Kind::Image(image) => image.radiance(image.uv(toward)),
        }
    }

    /// Density of [`Self::sample`] per solid angle.
    #[inline]
    pub fn pdf(&self, toward: Vec3A) -> f32 {
        match &self.0 {
            Kind::Constant(_) => warp::UNIFORM_SPHERE_PDF,
            Kind::Image(image) => image.pdf(image.uv(toward)),
        }
    }

    /// A direction toward the light, its density per solid angle and its radiance, both exactly as [`Self::pdf`] and
    /// [`Self::radiance`] tell them. `None` if the environment is black.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Option<(Vec3A, f32, Rgb)> {
        match &self.0 {
            Kind::Constant(radiance) => Some((warp::uniform_sphere(u), warp::UNIFORM_SPHERE_PDF, *radiance)),
            Kind::Image(image) => {
                let toward = image.sample(u)?;
                let uv = image.uv(toward);
                let pdf = image.pdf(uv);
                // Rounding can carry a direction over a pixel's edge, to where none is sampled.
                (pdf > 0.0).then(|| (toward, pdf, image.radiance(uv)))
            }
        }
    }
}

impl LatLong {
    fn new(width: usize, height: usize, pixels: Vec<[f32; 3]>, to_world: Mat3A) -> Self {
        let cos_edges: Vec<f64> =
            (0..=height).map(|y| (std::f64::consts::PI * y as f64 / height as f64).cos()).collect();
        let column = 2.0 * std::f64::consts::PI / width as f64;
        let solid_angles: Vec<f64> = cos_edges.windows(2).map(|e| column * (e[0] - e[1])).collect();
        let n = (width * height) as f64;
        let mut integral = glam::DVec3::ZERO;
        let mut weights = Vec::with_capacity(width * height);
        for (y, &solid_angle) in solid_angles.iter().enumerate() {
            let rows = row_shares(y, height);
            for x in 0..width {
                let mean = mean_over_pixel(&pixels, width, x, rows);
                integral += mean.as_dvec3() * solid_angle;
                weights.push(f64::from(mean.luminance()) * solid_angle);
            }
        }
        let density = Piecewise2d::new(&weights, width, height);
        let per_solid_angle = solid_angles.iter().map(|s| (1.0 / (s * n)) as f32).collect();
        let integral = integral.as_vec3a();
        let to_local = to_world.transpose();
        Self { width, height, pixels, density, cos_edges, per_solid_angle, integral, to_world, to_local }
    }

    /// The point of the unit square for a world direction.
    #[inline]
    fn uv(&self, toward: Vec3A) -> Vec2 {
        let d = self.to_local * toward;
        let turn = d.x.atan2(-d.z) * (0.5 / PI);
        let u = if turn < 0.0 { turn + 1.0 } else { turn };
        let v = d.x.hypot(d.z).atan2(d.y) * (1.0 / PI);
        // A tiny negative turn plus one rounds to one.
        Vec2::new(u, v).min(Vec2::splat(1.0 - f32::EPSILON / 2.0))
    }

    #[inline]
    fn pixel(&self, x: usize, y: usize) -> Rgb {
        Rgb::from_array(self.pixels[y * self.width + x])
    }

    #[inline]
    fn radiance(&self, uv: Vec2) -> Rgb {
        let x = uv.x * self.width as f32 - 0.5;
        let y = (uv.y * self.height as f32 - 0.5).clamp(0.0, (self.height - 1) as f32);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let left = if x0 < 0.0 { self.width - 1 } else { (x0 as usize).min(self.width - 1) };
        let right = if left + 1 == self.width { 0 } else { left + 1 };
        let top = y0 as usize;
        let bottom = (top + 1).min(self.height - 1);
        let a = self.pixel(left, top).lerp(self.pixel(right, top), fx);
        let b = self.pixel(left, bottom).lerp(self.pixel(right, bottom), fx);
        a.lerp(b, fy)
    }

    #[inline]
    fn pdf(&self, uv: Vec2) -> f32 {
        let Some(density) = &self.density else { return 0.0 };
        let row = ((uv.y * self.height as f32) as usize).min(self.height - 1);
        density.pdf(uv) * self.per_solid_angle[row]
    }

    #[inline]
    fn sample(&self, u: Vec2) -> Option<Vec3A> {
        let (p, _) = self.density.as_ref()?.sample(u);
        let y = p.y * self.height as f32;
        let row = (y as usize).min(self.height - 1);
        let (above, below) = (self.cos_edges[row], self.cos_edges[row + 1]);
        let cos = above + f64::from(y - row as f32) * (below - above);
        let sin = ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt() as f32;
        let (s, c) = (2.0 * PI * p.x).sin_cos();
        Some(self.to_world * Vec3A::new(sin * s, cos as f32, -sin * c))
    }
}

/// The rows that the interpolation within row `y` takes from, each with its share of the row's mean by solid angle.
fn row_shares(y: usize, height: usize) -> [(usize, f32); 3] {
    const STEPS: usize = 64;
    let (mut above, mut below, mut total) = (0.0, 0.0, 0.0);
    for i in 0..STEPS {
        // From the row's upper edge, 0, to its lower edge, 1; its centre's values stand at 1/2.
        let t = (i as f64 + 0.5) / STEPS as f64;
        let sin = (std::f64::consts::PI * (y as f64 + t) / height as f64).sin();
        above += sin * (0.5 - t).max(0.0);
        below += sin * (t - 0.5).max(0.0);
        total += sin;
    }
    let (above, below) = ((above / total) as f32, (below / total) as f32);
    [(y.saturating_sub(1), above), (y, 1.0 - above - below), ((y + 1).min(height - 1), below)]
}

/// Mean by solid angle of the interpolated radiance over a pixel. Across columns the interpolation takes 3/4 of the
/// pixel itself and 1/8 of either neighbour.
fn mean_over_pixel(pixels: &[[f32; 3]], width: usize, x: usize, rows: [(usize, f32); 3]) -> Rgb {
    let columns = [((x + width - 1) % width, 0.125), (x, 0.75), ((x + 1) % width, 0.125)];
    let mut mean = Rgb::ZERO;
    for (row, of_row) in rows {
        for (column, of_column) in columns {
            mean += Rgb::from_array(pixels[row * width + column]) * (of_row * of_column);
        }
    }
    mean
}
