//! P-B2D: collisions of light subpaths on a disc across a camera beam, the beam radiance estimate
//! [Jarosz et al. 2008; Křivánek et al. 2014, 4.1].

use super::join::{self, nearest, scatter_in};
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

/// Merges the part of a camera beam in one medium, with the depths kept along it, with the collisions about it. `count`: c
/// of the connection that ends the camera subpath before the collision, raised.
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
    let radius = pass.gathers.of(Technique::PointBeam).radius;
    let ray = Ray { t_max: stretch.length, ..Ray::new(stretch.origin, stretch.dir) };
    let medium = &scene.media[stretch.index as usize];
    photons.balls.along(ray.origin, ray.dir, ray.t_max, |entry| {
        let p = entry.p.into();
        let (t, d2) = nearest(&ray, p);
        if d2 > radius * radius || !(t > 0.0 && t < ray.t_max) {
            return;
        }
        let photon = photons.photon(entry.id);
        let (light, camera) = ((photon.length(), photon.trail), (flight.length + 1, flight.trail));
        if photon.medium() != Some(stretch.index) || !join::asked_for(pass, Label::Medium, light, camera) {
            return;
        }
        let at = medium.coefficients(p);
        let beam = (ray.origin, ray.dir, ray.t_max);
        let passage = stretch.before.then(medium.depth_along(depths, beam, t), true);
        let (rate, distance) = (at.sigma_t * medium.area(ray.dir), stretch.start + t);
        let Some(arm) = flight.arm(pass, Mode::Radiance, distance, &passage, rate, count) else { return };
        let scattering =
            scatter_in(pass, (stretch.index, medium), p, &at, photon.to_previous.into(), arm.back);
        let kernel = pass.settings.merging.kernel.disc(d2 / (radius * radius));
        let arms = (&photon.arm(), &arm);
        let sample = join::sample(pass, Technique::PointBeam, Label::Medium, arms, &scattering, kernel);
        if let Some(sample) = sample {
            record(&sample, Meeting { path: photon.path, light: p, camera: ray.at(t) });
        }
    });
}
