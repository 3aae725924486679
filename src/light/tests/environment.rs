//! Images at infinity: where pixels lie, interpolation, density.

use super::*;
use crate::math::RgbExt;
use crate::math::testing::{assert_mean, stream};

fn one_pixel(width: usize, height: usize, x: usize, y: usize) -> EnvironmentLight {
    let mut pixels = vec![[0.0; 3]; width * height];
    pixels[y * width + x] = [1.0, 2.0, 3.0];
    EnvironmentLight::image(width, height, pixels, Mat3A::IDENTITY, 2.0).unwrap()
}

#[test]
fn pixels_lie_where_the_documentation_says() {
    use std::f32::consts::PI;
    let (w, h) = (8, 4);
    for (x, y) in [(0, 0), (1, 1), (2, 2), (4, 1), (6, 2), (7, 3)] {
        let e = one_pixel(w, h, x, y);
        // The pixel's centre: turned from −z toward +x by u of a full turn, down from +y by v of half a turn.
        let (phi, theta) = (2.0 * PI * (x as f32 + 0.5) / w as f32, PI * (y as f32 + 0.5) / h as f32);
        let d = Vec3A::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
        assert!((e.radiance(d) - Rgb::new(2.0, 4.0, 6.0)).length() < 1e-4, "({x}, {y}): {}", e.radiance(d));
        // Half way to the neighbour on the right it is a half, one pixel away nothing.
        let right = |pixels: f32| {
            let phi = phi + 2.0 * PI * pixels / w as f32;
            Vec3A::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
        };
        assert!((e.radiance(right(0.5)) - Rgb::new(1.0, 2.0, 3.0)).length() < 1e-4);
        assert!(e.radiance(right(1.001)).length() < 1e-4);
    }
    // A quarter from the left is +x, whatever the rows.
    let e = one_pixel(4, 1, 1, 0);
    assert!(e.radiance(Vec3A::new(1.0, 0.0, 1.0).normalize()).x > 1.99);
}

#[test]
fn the_transform_turns_the_image() {
    let turn = Mat3A::from_rotation_z(0.7) * Mat3A::from_rotation_y(-2.0);
    let pixels: Vec<[f32; 3]> = (0..32).map(|i| [i as f32, 1.0, 2.0]).collect();
    let a = EnvironmentLight::image(8, 4, pixels.clone(), Mat3A::IDENTITY, 1.0).unwrap();
    let b = EnvironmentLight::image(8, 4, pixels, turn, 1.0).unwrap();
    let mut s = stream(20);
    for _ in 0..1000 {
        let d = crate::math::warp::uniform_sphere(s.next_2d());
        assert!((a.radiance(d) - b.radiance(turn * d)).length() < 1e-3);
    }
}

#[test]
fn the_density_is_positive_where_the_radiance_is() {
    let mut s = stream(21);
    for e in
        [image(), one_pixel(8, 4, 0, 0), one_pixel(8, 4, 7, 2), one_pixel(5, 1, 3, 0), one_pixel(1, 5, 0, 4)]
    {
        for _ in 0..20_000 {
            let d = crate::math::warp::uniform_sphere(s.next_2d());
            let (radiance, pdf) = (e.radiance(d).luminance(), e.pdf(d));
            // Rounding may see a last glimmer beyond the pixel that it belongs to.
            assert!(pdf > 0.0 || radiance < 1e-4, "{d}: {radiance}");
            // Beside a bright pixel the density is too low per luminance, in the corner by a factor of about 16.
            let share = f64::from(pdf) * f64::from(e.integral().luminance());
            assert!(24.0 * share >= f64::from(radiance) - 1e-3, "{d}");
        }
        for pole in [Vec3A::Y, Vec3A::NEG_Y, Vec3A::X, Vec3A::NEG_Z] {
            assert!(e.radiance(pole).is_finite() && e.pdf(pole).is_finite());
        }
    }
}

#[test]
fn samples_see_the_mean_radiance() {
    for (name, e) in [("image", image()), ("pole", one_pixel(8, 4, 3, 0)), ("ring", one_pixel(1, 5, 0, 2))] {
        for channel in 0..3 {
            let integral = over_sphere(|d| f64::from(e.radiance(d)[channel]));
            assert!((f64::from(e.integral()[channel]) / integral - 1.0).abs() < 1e-3, "{name}");
            assert_mean(&format!("{name} {channel}"), integral, 400_000, |s| {
                e.sample(s.next_2d())
                    .map_or(0.0, |(_, pdf, radiance)| f64::from(radiance[channel]) / f64::from(pdf))
            });
        }
    }
}

#[test]
fn one_white_pixel_is_a_constant() {
    let e = EnvironmentLight::image(1, 1, vec![[0.5; 3]], Mat3A::IDENTITY, 2.0).unwrap();
    let mut s = stream(22);
    for _ in 0..1000 {
        let (d, pdf, radiance) = e.sample(s.next_2d()).unwrap();
        assert!(same(pdf, 0.25 * std::f32::consts::FRAC_1_PI) && same(e.pdf(d), pdf));
        assert_eq!(radiance, Rgb::ONE);
    }
    assert!((e.integral() / (4.0 * std::f32::consts::PI) - Rgb::ONE).length() < 1e-5);
}

#[test]
fn samples_of_a_large_image_keep_near_the_pole() {
    // The first row of a tall image is a cap of 1e-7 sr: its directions must not collapse onto the pole.
    let e = one_pixel(4, 8192, 2, 0);
    let mut s = stream(23);
    let mut mean = 0.0;
    for _ in 0..10_000 {
        let (d, pdf, _) = e.sample(s.next_2d()).unwrap();
        assert!(pdf > 0.0 && d.y > 0.999);
        mean += f64::from(d.x.hypot(d.z)) / 10_000.0;
    }
    let row = std::f64::consts::PI / 8192.0;
    assert!(mean > 0.4 * row && mean < 2.0 * row, "{}", mean / row);
}
