//! Haze over a level.

use crate::math::Rgb;
use crate::medium::height::HeightFog;
use crate::medium::varying::{Density, Emission, Extinction, Scattering, Varying};
use crate::medium::{Medium, Phase};
use glam::Vec3A;

/// σ_t = (0.5, 2, 1) exp(−y/3) 1/m above the ground, and as there below it.
fn haze() -> Medium {
    let density = Density::Height(HeightFog::new(Vec3A::Y, 0.0, 3.0).expect("haze"));
    let extinction = Extinction::Scaled(density, Rgb::new(0.5, 2.0, 1.0));
    let built =
        Varying::new(extinction, Scattering::Albedo(Rgb::splat(0.9)), Emission::None, Phase::Isotropic);
    Medium::Varying(Box::new(built.expect("a medium")))
}

#[test]
fn depths_are_integrals_of_the_extinction() {
    let haze = haze();
    for (origin, dir, t1) in [
        (Vec3A::new(1.0, 0.5, 2.0), Vec3A::Y, 4.0),
        (Vec3A::new(0.0, 5.0, 0.0), Vec3A::new(0.6, -0.8, 0.0), 9.0),
        (Vec3A::new(0.0, 2.0, 0.0), Vec3A::X, 3.0),
    ] {
        let steps = 20_000;
        let dt = t1 / steps as f32;
        let sum: f64 = (0..steps)
            .map(|i| f64::from(haze.coefficients(origin + dir * ((i as f32 + 0.5) * dt)).sigma_t.y * dt))
            .sum();
        let depth = f64::from(haze.optical_depth(origin, dir, 0.0, t1).y);
        assert!((depth - sum).abs() < 2e-4 * sum, "{origin} {dir}: {depth} {sum}");
        let t = haze.invert(origin, dir, 0.0, t1, 1, 0.5 * depth as f32).expect("within");
        let half = f64::from(haze.optical_depth(origin, dir, 0.0, t).y);
        assert!((half - 0.5 * depth).abs() < 1e-5 * depth, "{half} {depth}");
    }
}

/// A beam into the sky ends where nothing is left, not at the end of the world; one into the ground where all is lost.
#[test]
fn beams_end_where_nothing_is_left() {
    let haze = haze();
    let origin = Vec3A::new(0.0, 1.0, 0.0);
    for dir in [Vec3A::Y, Vec3A::new(0.8, 0.6, 0.0)] {
        let end = haze.reach(origin, dir, f32::INFINITY, 17.0);
        // exp(−h/3) = 1e-7 at 48 m.
        assert!((20.0..120.0).contains(&end), "{dir}: {end}");
        let rest = haze.optical_depth(origin, dir, end, f32::INFINITY).max_element();
        assert!(rest < 2e-6, "{dir}: {rest}");
    }
    let end = haze.reach(origin, Vec3A::NEG_Y, f32::INFINITY, 17.0);
    let depth = haze.optical_depth(origin, Vec3A::NEG_Y, 0.0, end).min_element();
    assert!((16.9..17.1).contains(&depth), "{depth}");
}
