//! B-B1D: photon beams and camera beams that pass each other [Jarosz et al. 2011; Křivánek et al. 2014, 4.1].

use super::join::{self, scatter_in};
use super::photons::Photons;
use crate::bsdf::Mode;
use crate::film::Sample;
use crate::geometry::Ray;
use crate::scene::{Scene, Stretch};
use crate::transport::expression::Label;
use crate::transport::pass::Pass;
use crate::transport::sink::Meeting;
use crate::transport::technique::Technique;
use crate::transport::walk::Flight;

/// Square of the least sine of the angle between two beams that pass each other: below, where they pass is all rounding.
const PARALLEL: f32 = 1e-10;

/// Merges the part of a camera beam in one medium, with the depths kept along it, with the photon beams that pass it.
/// `count`: c of the connection that ends the camera subpath before the collision, raised.
#[inline]
pub fn gather(
    scene: &Scene,
    pass: &Pass,
    photons: &Photons,
    flight: &Flight,
    (stretch, depths): (&Stretch, &[f32]),
    count: f32,
    mut record: impl FnMut(&Sample, Meeting),
) {
    let radius = pass.gathers.of(Technique::BeamBeam).radius;
    let camera_ray = Ray { t_max: stretch.length, ..Ray::new(stretch.origin, stretch.dir) };
    let medium = &scene.media[stretch.index as usize];
    photons.beams_for_beams.along(camera_ray.origin, camera_ray.dir, camera_ray.t_max, |piece| {
        if piece.medium != stretch.index {
            return;
        }
        let light_ray = Ray::new(piece.origin.into(), piece.dir.into());
        let Some((t, s, d2)) = pass_by(&camera_ray, &light_ray) else { return };
        let here = s >= piece.from && s < piece.to;
        if d2 > radius * radius || !here || !(t > 0.0 && t < camera_ray.t_max) {
            return;
        }
        let beam = photons.beam(piece.id);
        let arriving = (beam.edges() + 1, beam.trail);
        if !join::asked_for(pass, Label::Medium, arriving, (flight.length + 1, flight.trail)) {
            return;
        }
        let point = camera_ray.at(t);
        let at = medium.coefficients(point);
        let Some(light) = photons.arm(scene, pass, beam, s, &at) else { return };
        let camera_beam = (camera_ray.origin, camera_ray.dir, camera_ray.t_max);
        let depth = medium.depth_along(depths, camera_beam, t);
        let passage = stretch.before.then(depth, true);
        let (rate, distance) = (at.sigma_t * medium.area(camera_ray.dir), stretch.start + t);
        let Some(camera) = flight.arm(pass, Mode::Radiance, distance, &passage, rate, count) else { return };
        let scattering = scatter_in(pass, (stretch.index, medium), point, &at, light.back, camera.back);
        let kernel = pass.settings.merging.kernel.line(d2 / (radius * radius));
        let arms = (&light, &camera);
        let sample = join::sample(pass, Technique::BeamBeam, Label::Medium, arms, &scattering, kernel);
        if let Some(sample) = sample {
            record(&sample, Meeting { path: beam.path, light: light_ray.at(s), camera: point });
        }
    });
}

/// Where two lines are nearest to each other: the distances along each, and the square of that between them. `None` for
/// parallel ones.
#[inline]
fn pass_by(a: &Ray, b: &Ray) -> Option<(f32, f32, f32)> {
    let across = a.dir.cross(b.dir);
    let sine2 = across.length_squared();
    if sine2 < PARALLEL {
        return None;
    }
    let between = b.origin - a.origin;
    let apart = between.dot(across);
    let t = between.cross(b.dir).dot(across) / sine2;
    let s = between.cross(a.dir).dot(across) / sine2;
    Some((t, s, apart * apart / sine2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Stream, StreamKind, warp};
    use glam::Vec3A;

    #[test]
    fn lines_are_nearest_where_the_line_between_is_square_to_both() {
        let mut s = Stream::new(5, 0, StreamKind::Other, 0);
        let mut direction = || warp::uniform_sphere(s.next_2d());
        for _ in 0..1000 {
            let a = Ray::new(direction() * 2.0, direction());
            let b = Ray::new(direction() * 2.0, direction());
            let Some((t, u, d2)) = pass_by(&a, &b) else { continue };
            let between: Vec3A = b.at(u) - a.at(t);
            if a.dir.cross(b.dir).length() < 0.05 {
                continue;
            }
            assert!((between.length_squared() - d2).abs() < 1e-3 * d2.max(0.01), "{between} {d2}");
            assert!(between.dot(a.dir).abs() < 1e-3 && between.dot(b.dir).abs() < 1e-3);
        }
    }
}
