//! What a camera is made from, and what is refused.

use super::{Camera, CropWindow};
use glam::{Affine3A, UVec2, Vec2, Vec3A};

/// Which extent of the image the field of view measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FovAxis {
    /// From the left edge to the right edge.
    Horizontal,
    /// From the top edge to the bottom edge.
    Vertical,
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius in metres, positive.
    pub radius: f32,
    /// Distance of the focus plane from the lens along the viewing direction, in metres, positive.
    pub focus_distance: f32,
}

/// All that defines a [`Camera`].
#[derive(Clone, Debug)]
pub struct CameraSettings {
    /// Size of the full frame in pixels, (width, height).
    pub size: UVec2,
    /// What of the frame is rendered; `None` for all of it.
    pub crop: Option<CropWindow>,
    /// What `fov` measures.
    pub fov_axis: FovAxis,
    /// Full angle of view in degrees, in (0, 180).
    pub fov: f32,
    /// Camera to world. The camera looks along its −z, with +y up and +x to the right; a rotation with a
    /// translation. A uniform scale is ignored. See [`look_at`].
    pub to_world: Affine3A,
    /// A thin lens; `None` for the pinhole.
    pub lens: Option<Lens>,
    /// Distance of the plane where rays begin, along the viewing direction in metres; 0: they begin at the lens. Surfaces and
    /// media before it are not there for the camera.
    pub near: f32,
}

/// The largest frame side that is accepted, in pixels.
pub const MAX_SIDE: u32 = 1 << 16;

/// The camera-to-world transform of a camera at `position` that looks at `target`, with `up` upwards in the image.
///
/// # Errors
/// Where the target is the position, or `up` is zero or parallel to the view, or a number is not finite.
pub fn look_at(position: Vec3A, target: Vec3A, up: Vec3A) -> Result<Affine3A, String> {
    if !(position.is_finite() && target.is_finite() && up.is_finite()) {
        return Err("camera: position, target and up must be finite".into());
    }
    let forward = (target - position)
        .try_normalize()
        .ok_or_else(|| format!("camera: the target {target} is at the camera's position"))?;
    let unit_up = up.try_normalize().ok_or("camera: up must not be zero")?;
    let right = forward.cross(unit_up);
    if right.length() < 1e-4 {
        return Err(format!("camera: up {up} is parallel to the viewing direction {forward}"));
    }
    let right = right.normalize();
    let up = right.cross(forward);
    Ok(Affine3A { matrix3: glam::Mat3A::from_cols(right, up, -forward), translation: position })
}

/// The rotation's columns, right, up and backward, where the transform is a similarity without a reflection.
fn orthonormal(to_world: &Affine3A) -> Result<[Vec3A; 3], String> {
    if !to_world.is_finite() {
        return Err("camera: the transform must be finite".into());
    }
    let m = to_world.matrix3;
    let scale = m.x_axis.length();
    let inv = 1.0 / scale;
    let (x, y, z) = (m.x_axis * inv, m.y_axis * inv, m.z_axis * inv);
    let skew = x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs());
    let stretch = (y.length() - 1.0).abs().max((z.length() - 1.0).abs());
    // Written so that NaN (from a scale of zero) is refused too.
    if !(inv.is_finite() && skew < 1e-3 && stretch < 1e-3) {
        return Err(
            "camera: the transform must be a rotation and a translation (no shear, no uneven or zero scale)"
                .into(),
        );
    }
    if x.cross(y).dot(z) < 0.0 {
        return Err("camera: the transform mirrors the image; it must be a rotation and a translation".into());
    }
    // Once more orthonormal, to the last bit that f32 has: matrices in files have few digits.
    let z = z.normalize();
    let x = (x - z * x.dot(z)).normalize();
    Ok([x, z.cross(x), z])
}

impl Camera {
    /// A camera from its settings.
    ///
    /// # Errors
    /// With a message for the user where a setting is out of its range.
    pub fn new(settings: &CameraSettings) -> Result<Self, String> {
        let size = settings.size;
        if size.x == 0 || size.y == 0 || size.x > MAX_SIDE || size.y > MAX_SIDE {
            return Err(format!(
                "camera: the film is {}x{} pixels; each side must be in 1..={MAX_SIDE}",
                size.x, size.y
            ));
        }
        let full = CropWindow { x0: 0, y0: 0, x1: size.x, y1: size.y };
        let crop = settings.crop.unwrap_or(full);
        if crop.x0 >= crop.x1 || crop.y0 >= crop.y1 || crop.x1 > size.x || crop.y1 > size.y {
            return Err(format!(
                "camera: the crop window ({}, {})..({}, {}) must be a non-empty part of the {}x{} film",
                crop.x0, crop.y0, crop.x1, crop.y1, size.x, size.y
            ));
        }
        if !(settings.fov > 0.0 && settings.fov < 180.0) {
            return Err(format!(
                "camera: the field of view must be in (0, 180) degrees, not {}",
                settings.fov
            ));
        }
        let (lens_radius, focus) = match settings.lens {
            None => (0.0, 1.0),
            Some(Lens { radius, focus_distance }) => {
                if !(radius > 0.0 && radius.is_finite()) {
                    return Err(format!("camera: the lens radius must be positive, not {radius}"));
                }
                if !(focus_distance > 0.0 && focus_distance.is_finite()) {
                    return Err(format!("camera: the focus distance must be positive, not {focus_distance}"));
                }
                (radius, focus_distance)
            }
        };
        if !(settings.near >= 0.0 && settings.near.is_finite()) {
            return Err(format!(
                "camera: the near plane's distance must not be negative, as {} is",
                settings.near
            ));
        }
        let [right, up, backward] = orthonormal(&settings.to_world)?;
        let position = settings.to_world.translation;

        let half = (f64::from(settings.fov).to_radians() * 0.5).tan();
        let aspect = f64::from(size.x) / f64::from(size.y);
        let (tan_x, tan_y) = match settings.fov_axis {
            FovAxis::Horizontal => (half, half / aspect),
            FovAxis::Vertical => (half * aspect, half),
        };
        let tan = Vec2::new(tan_x as f32, tan_y as f32);
        let inv_area = (0.25 / (tan_x * tan_y)) as f32;
        if !(tan.is_finite() && tan.min_element() > 0.0 && inv_area.is_finite() && inv_area > 0.0) {
            return Err(format!(
                "camera: a field of view of {} degrees is beyond what can be computed",
                settings.fov
            ));
        }
        let margin = margin(size, tan, position, lens_radius, focus);
        Ok(Self {
            size,
            crop,
            position,
            right,
            up,
            forward: -backward,
            tan,
            inv_area,
            lens_radius,
            focus,
            near: settings.near,
            margin,
        })
    }
}

/// Bounds the rounding of [`Camera::pixel_of`] in pixels: of the direction's components, and, for a lens, of the
/// lens point in world coordinates. Never more than a hundredth of a pixel.
fn margin(size: UVec2, tan: Vec2, position: Vec3A, lens_radius: f32, focus: f32) -> Vec2 {
    let reach = 1.0 + tan.length_squared();
    let mut error = Vec2::splat(8.0 * f32::EPSILON) * (reach + tan) / tan;
    if lens_radius > 0.0 {
        let lens_error = 4.0 * f32::EPSILON * (position.abs().max_element() + lens_radius) / focus;
        error += lens_error / tan;
    }
    (0.5 * error * size.as_vec2()).min(Vec2::splat(0.01))
}
