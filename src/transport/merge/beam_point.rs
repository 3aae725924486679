//! B-P2D: collisions of camera subpaths on a disc across a photon beam [Jarosz et al. 2011; Křivánek et al. 2014, 4.1].

use super::join::{self, Arm, nearest};
use super::photons::Photons;
use crate::bsdf::Mode;
use crate::film::Sample;
use crate::geometry::Ray;
use crate::scene::{Collision, Scene};
use crate::transport::expression::Label;
use crate::transport::pass::Pass;
use crate::transport::sink::Meeting;
use crate::transport::technique::Technique;
use crate::transport::walk::Vertex;

/// Merges a camera vertex in a medium with the photon beams that pass it.
#[inline]
pub fn gather(
    scene: &Scene,
    pass: &Pass,
    photons: &Photons,
    (vertex, collision): (&Vertex, &Collision),
    mut record: impl FnMut(&Sample, Meeting),
) {
    let radius = pass.gathers.of(Technique::BeamPoint).radius;
    let camera = Arm::from(vertex);
    photons.beams_for_points.about(collision.p, |piece| {
        let ray = Ray::new(piece.origin.into(), piece.dir.into());
        let (t, d2) = nearest(&ray, collision.p);
        if piece.medium != collision.medium || d2 > radius * radius || !(t >= piece.from && t < piece.to) {
            return;
        }
        let beam = photons.beam(piece.id);
        let arriving = (beam.edges() + 1, beam.trail);
        if !join::asked_for(pass, Label::Medium, arriving, (camera.length, camera.trail)) {
            return;
        }
        let Some(light) = photons.arm(scene, pass, beam, t, &collision.coefficients) else { return };
        let Some(scattering) = vertex.scatter(scene, pass, Mode::Radiance, light.back) else { return };
        let kernel = pass.settings.merging.kernel.disc(d2 / (radius * radius));
        let arms = (&light, &camera);
        let sample = join::sample(pass, Technique::BeamPoint, Label::Medium, arms, &scattering, kernel);
        if let Some(sample) = sample {
            record(&sample, Meeting { path: beam.path, light: ray.at(t), camera: collision.p });
        }
    });
}
