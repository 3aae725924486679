//! Densities made of noise. They are computed at the middles of a grid's voxels, and the medium is that grid: what is
//! between them is trilinear, exactly.

use super::volume::{Volume, cube};
use glam::{IVec3, UVec3, Vec3, Vec3A};
use rayon::prelude::*;

/// No grid is made with more voxels along an axis.
pub const MOST: u32 = 1024;

/// A function of the place on a grid over the box `min` … `max`, with `resolution` voxels along its longest edge and
/// about cubes for voxels. Values are cut off at 0 and 1.
///
/// # Errors
/// A box without a volume, or a resolution of none or too much.
pub fn bake(
    (min, max): (Vec3A, Vec3A),
    resolution: u32,
    density: impl Fn(Vec3A) -> f32 + Sync,
) -> Result<Volume, String> {
    let extent = max - min;
    if !(extent.is_finite() && extent.min_element() > 0.0) {
        return Err(format!("the box {min} … {max} is none: its first corner must be below the second"));
    }
    if resolution == 0 || resolution > MOST {
        return Err(format!("the resolution is {resolution}: it must be from 1 to {MOST}"));
    }
    let edge = extent.max_element() / resolution as f32;
    let size = (extent / edge).round().max(Vec3A::ONE).as_uvec3();
    let voxel = extent / size.as_vec3a();
    let slice = size.x as usize * size.y as usize;
    let mut numbers = vec![0.0; slice * size.z as usize];
    numbers.par_chunks_mut(slice).enumerate().for_each(|(z, slice)| {
        for (i, number) in slice.iter_mut().enumerate() {
            let voxels = UVec3::new(i as u32 % size.x, i as u32 / size.x, z as u32).as_vec3a();
            *number = density(min + voxel * (voxels + 0.5)).clamp(0.0, 1.0);
        }
    });
    Ok(Volume { size, channels: 1, numbers, from_unit: Some(cube(min, max)) })
}

/// Gradient noise [Perlin 1985] of several octaves.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    seed: u64,
    octaves: u32,
}

impl Noise {
    /// Each octave has details half as large and half as strong as the one before.
    pub fn new(seed: u64, octaves: u32) -> Self {
        Self { seed, octaves: octaves.clamp(1, 12) }
    }

    /// About −1 to 1, of mean 0, with features as large as 1.
    pub fn at(&self, p: Vec3A) -> f32 {
        let (mut sum, mut strength, mut p) = (0.0, 1.0, p);
        for octave in 0..self.octaves {
            sum += strength * self.octave(p, u64::from(octave));
            strength *= 0.5;
            // Octaves must not share their grids' points, where all are 0.
            p = p * 2.0 + 17.31;
        }
        sum
    }

    fn octave(&self, p: Vec3A, octave: u64) -> f32 {
        let cell = p.floor();
        let f = p - cell;
        let fade = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
        let cell = cell.as_ivec3();
        let mut sum = 0.0;
        for corner in 0..8 {
            let bits = IVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            let at = bits.as_vec3a();
            let weight = (at * fade + (1.0 - at) * (1.0 - fade)).to_array().into_iter().product::<f32>();
            sum += weight * self.gradient(cell + bits, octave).dot(f - at);
        }
        // At most about 1.
        1.4 * sum
    }

    /// A direction to the middle of an edge of a cube, which belongs to a point of the noise's grid.
    fn gradient(&self, at: IVec3, octave: u64) -> Vec3A {
        const A: f32 = std::f32::consts::FRAC_1_SQRT_2;
        let [x, y, z] = at.to_array().map(|i| i as u32 as u64 & 0x1F_FFFF);
        // Finalised as in SplitMix64.
        let mut hash = (x | y << 21 | z << 42)
            ^ (self.seed.wrapping_mul(8) + octave).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        hash = (hash ^ hash >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        hash = (hash ^ hash >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        hash ^= hash >> 31;
        let (s, t) = (if hash & 1 == 0 { A } else { -A }, if hash & 2 == 0 { A } else { -A });
        match (hash >> 8) % 3 {
            0 => Vec3A::new(0.0, s, t),
            1 => Vec3A::new(s, 0.0, t),
            _ => Vec3A::new(s, t, 0.0),
        }
    }
}

/// A round cloud about the middle of its box that its noise frays: `roughness` from 0, a smooth ball, to 1.
pub fn puff(centre: Vec3A, radius: f32, roughness: f32, noise: Noise) -> impl Fn(Vec3A) -> f32 + Sync {
    move |p| {
        let q = (p - centre) / radius;
        let distance = q.length();
        // Nothing reaches the faces of the box.
        let inside = 1.0 - distance;
        if inside <= 0.0 {
            return 0.0;
        }
        let frayed = 0.25 + 0.75 * (1.0 - roughness) - distance * (1.0 - 0.25 * roughness)
            + roughness * (0.35 + 0.6 * noise.at(q * 2.5));
        (3.0 * frayed).clamp(0.0, 1.0) * (8.0 * inside).min(1.0)
    }
}

/// A column of smoke from `base` along `up`, `height` long, which widens to `radius`, swirls and thins out.
pub fn plume(base: Vec3A, up: Vec3, height: f32, radius: f32, noise: Noise) -> impl Fn(Vec3A) -> f32 + Sync {
    let up = Vec3A::from(up.normalize());
    let (side, ahead) = Vec3::from(up).any_orthonormal_pair();
    let (side, ahead) = (Vec3A::from(side), Vec3A::from(ahead));
    move |p| {
        let h = (p - base).dot(up) / height;
        if !(0.0..1.0).contains(&h) {
            return 0.0;
        }
        // The column's axis sways, the more the higher.
        let sway = |k: f32| radius * 1.1 * h * noise.at(Vec3A::new(2.2 * h, k, 0.5 * k));
        let axis = base + up * (h * height) + side * sway(3.7) + ahead * sway(9.1);
        let width = radius * (0.12 + 0.75 * h.sqrt());
        let across = (p - axis).length() / width;
        let curls = noise.at((p - base - up * (0.3 * h * height)) / (0.55 * radius));
        let density = (1.0 - across + 0.9 * (0.3 + h) * curls) * 2.5;
        let ends = (h * 30.0).min(1.0) * ((1.0 - h) * 4.0).min(1.0);
        density.clamp(0.0, 1.0) * ends / (1.0 + 2.5 * h)
    }
}
