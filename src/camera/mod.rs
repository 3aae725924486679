//! The camera: a pinhole or a thin lens before a rectangular film, and the densities of the rays that it makes.
//!
//! The image's row 0 is on top. Looking along `forward`, `right = forward × up` is on the right side of the image.
//! A film point is named by its direction through the middle of the lens, `forward + x·right + y·up`: `(x, y)` in
//! `[-tan_x, tan_x] × [-tan_y, tan_y]`, the image at distance 1. On the focus plane that image is uniform, so that a
//! ray at the angle θ to `forward` has the density 1/(A₁ cos³θ) per solid angle with A₁ = 4·tan_x·tan_y,
//! for the thin lens from every lens point as for the pinhole: the image's area in the focus plane at the distance f
//! is f²·A₁, a point there is f/cosθ away and seen under cosθ, hence (f/cosθ)² / (cosθ · f² A₁).

mod settings;

#[cfg(test)]
mod tests;

pub use settings::{CameraSettings, FovAxis, Lens, MAX_SIDE, look_at};

use crate::geometry::Aabb;
use crate::math::warp;
use glam::{UVec2, Vec2, Vec3A};
use std::f32::consts::PI;

/// A ray that leaves the lens.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// On the lens.
    pub origin: Vec3A,
    /// Unit, into the scene.
    pub dir: Vec3A,
    /// [`Camera::pdf_direction`] of `dir`: per solid angle, over the whole image.
    pub pdf: f32,
}

/// Pixels from `(x0, y0)` inclusive to `(x1, y1)` exclusive, in full-frame coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CropWindow {
    /// First column.
    pub x0: u32,
    /// First row, counted from the top.
    pub y0: u32,
    /// One past the last column.
    pub x1: u32,
    /// One past the last row.
    pub y1: u32,
}

impl CropWindow {
    /// Columns in the window.
    pub fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Rows in the window.
    pub fn height(&self) -> u32 {
        self.y1 - self.y0
    }

    /// Whether a full-frame pixel lies in the window.
    #[inline]
    pub fn contains(&self, pixel: UVec2) -> bool {
        pixel.x >= self.x0 && pixel.x < self.x1 && pixel.y >= self.y0 && pixel.y < self.y1
    }
}

/// A perspective camera with a box pixel filter. Its rays have the weight 1: a pixel's value is the mean radiance
/// over the pixel and over the lens.
#[derive(Clone, Debug)]
pub struct Camera {
    size: UVec2,
    crop: CropWindow,
    position: Vec3A,
    right: Vec3A,
    up: Vec3A,
    forward: Vec3A,
    /// Half the image's extent at distance 1.
    tan: Vec2,
    /// 1/A₁.
    inv_area: f32,
    /// Zero for the pinhole.
    lens_radius: f32,
    /// Distance of the focus plane; 1 for the pinhole, where it has no effect.
    focus: f32,
    /// Distance of the plane where rays begin, along the viewing direction.
    near: f32,
    /// How far film points keep from the frame's edge, in pixels, for a ray to be found inside in spite of rounding.
    margin: Vec2,
}

impl Camera {
    /// Size of the full frame in pixels, (width, height).
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// What of the frame is rendered.
    pub fn crop(&self) -> CropWindow {
        self.crop
    }

    /// Unit viewing direction.
    pub fn forward(&self) -> Vec3A {
        self.forward
    }

    /// Middle of the lens.
    pub fn position(&self) -> Vec3A {
        self.position
    }

    /// Distance in metres from the lens to where a ray in the unit direction `dir` (into the scene) begins: what is before
    /// that is not there for the camera. 0 unless the camera has a near plane.
    #[inline]
    pub fn skipped(&self, dir: Vec3A) -> f32 {
        // Without a division before a path can begin.
        if self.near > 0.0 { self.near / dir.dot(self.forward) } else { 0.0 }
    }

    /// The middle of the plane where rays begin.
    pub fn near_point(&self) -> Vec3A {
        self.position + self.forward * self.near
    }

    /// A box about all points where rays begin: of the lens as it is moved to the near plane.
    pub fn near_bounds(&self) -> Aabb {
        let corners = [Vec2::new(-1.0, -1.0), Vec2::new(1.0, -1.0), Vec2::new(-1.0, 1.0), Vec2::ONE];
        // Rays of a lens start within its radius of those of its middle, as they all go ahead by the same depth.
        let spread = self.near * self.tan + Vec2::splat(self.lens_radius * (1.0 + self.near / self.focus));
        Aabb::of(
            corners.map(|c| self.near_point() + self.right * (c.x * spread.x) + self.up * (c.y * spread.y)),
        )
    }

    /// The lens's area in m²; `None` for the pinhole.
    pub fn lens_area(&self) -> Option<f32> {
        (self.lens_radius > 0.0).then_some(PI * self.lens_radius * self.lens_radius)
    }

    /// A point of the lens, uniform over its area (the pinhole's one point).
    #[inline]
    pub fn sample_lens(&self, u: Vec2) -> Vec3A {
        if self.lens_radius == 0.0 {
            return self.position;
        }
        let l = self.lens_radius * warp::concentric_disc(u);
        self.position + self.right * l.x + self.up * l.y
    }

    /// The ray of a full-frame pixel: uniform over the pixel by `u_film` (x to the right, y down) and over the
    /// lens by `u_lens`. Film points within the margin of the frame's edge, about 1e-4 pixels, are moved to the margin.
    #[inline]
    pub fn sample_ray(&self, pixel: UVec2, u_film: Vec2, u_lens: Vec2) -> CameraRay {
        let size = self.size.as_vec2();
        let film = (pixel.as_vec2() + u_film).clamp(self.margin, size - self.margin) / size;
        let x = (2.0 * film.x - 1.0) * self.tan.x;
        let y = (1.0 - 2.0 * film.y) * self.tan.y;
        let (origin, x, y) = if self.lens_radius == 0.0 {
            (self.position, x, y)
        } else {
            let l = self.lens_radius * warp::concentric_disc(u_lens);
            let origin = self.position + self.right * l.x + self.up * l.y;
            (origin, x - l.x / self.focus, y - l.y / self.focus)
        };
        let inv_cos = (x * x + y * y + 1.0).sqrt();
        let dir = (self.forward + self.right * x + self.up * y) / inv_cos;
        CameraRay { origin, dir, pdf: self.inv_area * inv_cos * inv_cos * inv_cos }
    }

    /// Density per solid angle with which a ray from the lens point `lens_p` takes the direction `dir`, where each
    /// pixel of the whole frame (not of the crop window) is as likely as any other. 0 outside the frame.
    #[inline]
    pub fn pdf_direction(&self, lens_p: Vec3A, dir: Vec3A) -> f32 {
        let Some(film) = self.film_of(lens_p, dir) else { return 0.0 };
        if film.x < 0.0 || film.y < 0.0 || film.x >= self.size.x as f32 || film.y >= self.size.y as f32 {
            return 0.0;
        }
        let cos = dir.dot(self.forward);
        self.inv_area / (cos * cos * cos)
    }

    /// The full-frame pixel on which a ray from `lens_p` along `dir` (into the scene) lands; `None` outside the frame.
    #[inline]
    pub fn pixel_of(&self, lens_p: Vec3A, dir: Vec3A) -> Option<UVec2> {
        let film = self.film_of(lens_p, dir)?;
        let inside =
            film.x >= 0.0 && film.y >= 0.0 && film.x < self.size.x as f32 && film.y < self.size.y as f32;
        inside.then(|| film.as_uvec2())
    }

    /// The film point of a ray in pixels, right and down from the frame's top left corner; `None` for a ray that
    /// does not go forward.
    #[inline]
    fn film_of(&self, lens_p: Vec3A, dir: Vec3A) -> Option<Vec2> {
        let cos = dir.dot(self.forward);
        if cos <= 0.0 {
            return None;
        }
        let mut x = dir.dot(self.right) / cos;
        let mut y = dir.dot(self.up) / cos;
        if self.lens_radius > 0.0 {
            let l = lens_p - self.position;
            x += l.dot(self.right) / self.focus;
            y += l.dot(self.up) / self.focus;
        }
        Some(0.5 * Vec2::new(1.0 + x / self.tan.x, 1.0 - y / self.tan.y) * self.size.as_vec2())
    }
}
