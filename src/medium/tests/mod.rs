//! Phase functions, free flight and emission against their definitions.

mod flakes;
mod free_flight;
mod grid;
mod height;
mod homogeneous;
mod majorants;
mod phase;
mod tracking;
mod varying;
mod volume;

use super::{Homogeneous, Medium, Phase};
use crate::math::Rgb;

/// A medium of this extinction that scatters the share `albedo` alike in all directions.
fn medium(sigma_t: [f32; 3], albedo: f32) -> Medium {
    let built = Homogeneous::with_albedo(sigma_t.into(), Rgb::splat(albedo), Rgb::ZERO, Phase::Isotropic);
    Medium::Homogeneous(built.expect("a medium"))
}
