//! Haze that thins out with height: the density is 1 up to a level, and above it exp(−h/H) at the height h over the level.
//!
//! Along a ray the height is linear in the distance, so the integral of the density is in closed form, and so is its inverse.

use glam::{DVec3, Vec3A};

/// The density of haze over a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightFog {
    up: DVec3,
    level: f64,
    scale: f64,
}

impl HeightFog {
    /// Full up to the height `level` along `up`, and e times less every `scale` metres above it.
    ///
    /// # Errors
    /// A direction of no length, or a scale that is not above 0.
    pub fn new(up: Vec3A, level: f32, scale: f32) -> Result<Self, String> {
        let Some(up) = up.as_dvec3().try_normalize() else {
            return Err("`up` has no length".into());
        };
        if !(scale > 0.0 && scale.is_finite() && level.is_finite()) {
            return Err(format!("the height over which haze thins out must be above 0, found {scale}"));
        }
        Ok(Self { up, level: level.into(), scale: scale.into() })
    }

    /// The density at a point, at most 1.
    #[inline]
    pub fn value(&self, p: Vec3A) -> f32 {
        let height = (p.as_dvec3().dot(self.up) - self.level) / self.scale;
        (-height.max(0.0)).exp() as f32
    }

    /// The ray's height in units of the scale: h + t·slope.
    fn heights(&self, origin: Vec3A, dir: Vec3A) -> (f64, f64) {
        let height = (origin.as_dvec3().dot(self.up) - self.level) / self.scale;
        (height, dir.as_dvec3().dot(self.up) / self.scale)
    }

    /// The integral of the density over `t0`..`t1` of `origin` + t·`dir`; `t1` may be infinite, and so may the integral.
    pub fn integral(&self, origin: Vec3A, dir: Vec3A, t0: f32, t1: f32) -> f64 {
        let (h, slope) = self.heights(origin, dir);
        pieces(h, slope, t0.into(), t1.into()).into_iter().map(|p| p.integral(slope)).sum()
    }

    /// Where on the stretch the integral from `t0` on reaches `target`.
    ///
    /// # Errors
    /// Where it does not, the integral over all of it.
    pub fn invert(&self, origin: Vec3A, dir: Vec3A, t0: f32, t1: f32, target: f64) -> Result<f32, f64> {
        let (h, slope) = self.heights(origin, dir);
        let mut sum = 0.0;
        for piece in pieces(h, slope, t0.into(), t1.into()) {
            let own = piece.integral(slope);
            if sum + own > target {
                let t = piece.from + piece.invert(slope, target - sum);
                let rounded = t as f32;
                let rounded = if f64::from(rounded) > t { rounded.next_down() } else { rounded };
                return Ok(rounded.max(t0).min(t1.next_down()));
            }
            sum += own;
        }
        Err(sum)
    }
}

/// A part of a ray over the level, or under it.
#[derive(Clone, Copy, Debug)]
struct Piece {
    from: f64,
    length: f64,
    /// Density at its start; constant where the ray is level or the piece under the level.
    density: f64,
    constant: bool,
}

/// The parts of a ray under and over the level, in order; empty ones have the length 0.
fn pieces(h: f64, slope: f64, t0: f64, t1: f64) -> [Piece; 2] {
    let piece = |from: f64, to: f64, under: bool| {
        let height = if under { 0.0 } else { (h + slope * from).max(0.0) };
        Piece {
            from,
            length: (to - from).max(0.0),
            density: (-height).exp(),
            constant: under || slope == 0.0,
        }
    };
    // Where it crosses the level.
    let crossing = if slope == 0.0 { t1 } else { (-h / slope).clamp(t0, t1) };
    // Under the level first where it rises, and last where it falls.
    let under_first = if slope == 0.0 { h < 0.0 } else { slope > 0.0 };
    [piece(t0, crossing, under_first), piece(crossing, t1, !under_first)]
}

impl Piece {
    fn integral(&self, slope: f64) -> f64 {
        if self.length == 0.0 {
            0.0
        } else if self.constant {
            self.density * self.length
        } else {
            // ρ (1 − exp(−slope·d))/slope
            self.density * -(-slope * self.length).exp_m1() / slope
        }
    }

    fn invert(&self, slope: f64, wanted: f64) -> f64 {
        let ratio = wanted / self.density;
        let t = if self.constant { ratio } else { -(-slope * ratio).ln_1p() / slope };
        t.min(self.length)
    }
}
