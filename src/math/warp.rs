//! Maps from the unit square to the domains that are sampled, each with its density.

use super::choose;
use super::trig::{sin_cos_quarter, sin_cos_turns};
use glam::{Vec2, Vec3A};
use std::f32::consts::{FRAC_1_PI, PI};

/// Uniform on the unit disc, by the concentric map [Shirley & Chiu 1997]; density 1/π per area.
#[inline]
pub fn concentric_disc(u: Vec2) -> Vec2 {
    let o = 2.0 * u - Vec2::ONE;
    // The radius is the longer coordinate, and the quotient says how far the point is turned from that axis. Which is
    // longer no processor can foretell: so without a branch.
    let wide = o.x.abs() > o.y.abs();
    let (long, short) = (choose(wide, o.x, o.y), choose(wide, o.y, o.x));
    let quotient = if long == 0.0 { 0.0 } else { short / long };
    let (sin, cos) = sin_cos_quarter(0.5 * quotient);
    let (along, across) = (long * cos, long * sin);
    Vec2::new(choose(wide, along, across), choose(wide, across, along))
}

/// Cosine-weighted on the upper hemisphere; density [`cosine_hemisphere_pdf`] per solid angle.
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3A {
    let d = concentric_disc(u);
    Vec3A::new(d.x, d.y, (1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Cosine-weighted on the hemisphere about the unit vector `n`, without a frame: toward a point of the sphere that touches the
/// surface from above. Not a number where that point is the one that touches it.
#[inline(always)]
pub fn cosine_about(n: Vec3A, u: Vec2) -> Vec3A {
    let v = n + uniform_sphere(u);
    v * v.length_recip()
}

/// Density of [`cosine_hemisphere`] and of [`cosine_about`] per solid angle; 0 below the horizon.
#[inline]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Uniform on the unit sphere; density 1/(4π) per solid angle.
#[inline]
pub fn uniform_sphere(u: Vec2) -> Vec3A {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = sin_cos_turns(u.y);
    Vec3A::new(r * cos, r * sin, z)
}

/// Density of [`uniform_sphere`] per solid angle.
pub const UNIFORM_SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// Uniform in the cone about +z of half-angle θ, given 1 − cos θ (kept so, as it is small for narrow cones);
/// density [`uniform_cone_pdf`] per solid angle.
#[inline]
pub fn uniform_cone(u: Vec2, one_minus_cos_max: f32) -> Vec3A {
    let h = u.x * one_minus_cos_max;
    let r = (h * (2.0 - h)).max(0.0).sqrt();
    let (sin, cos) = sin_cos_turns(u.y);
    Vec3A::new(r * cos, r * sin, 1.0 - h)
}

/// Density of [`uniform_cone`] per solid angle, inside the cone.
#[inline]
pub fn uniform_cone_pdf(one_minus_cos_max: f32) -> f32 {
    1.0 / (2.0 * PI * one_minus_cos_max)
}

/// Barycentric coordinates (of the second and third corner) uniform over a triangle.
#[inline]
pub fn uniform_triangle(u: Vec2) -> Vec2 {
    let s = u.x.sqrt();
    Vec2::new(s * (1.0 - u.y), s * u.y)
}
