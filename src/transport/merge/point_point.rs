//! P-P3D: collisions in a ball [Jensen & Christensen 1998; Křivánek et al. 2014, 4.1].

use super::join::{self, Arm};
use super::photons::Photons;
use crate::bsdf::Mode;
use crate::film::Sample;
use crate::scene::{Collision, Scene};
use crate::transport::expression::Label;
use crate::transport::pass::Pass;
use crate::transport::sink::Meeting;
use crate::transport::technique::Technique;
use crate::transport::walk::Vertex;

/// Merges a camera vertex in a medium with the collisions of light subpaths about it.
#[inline]
pub fn gather(
    scene: &Scene,
    pass: &Pass,
    photons: &Photons,
    (vertex, collision): (&Vertex, &Collision),
    mut record: impl FnMut(&Sample, Meeting),
) {
    let radius = pass.gathers.of(Technique::PointPoint).radius;
    let arm = Arm::from(vertex);
    photons.collisions.within(collision.p, |id, d2| {
        let photon = photons.photon(id);
        let (light, camera) = ((photon.length(), photon.trail), (arm.length, arm.trail));
        if photon.medium() != Some(collision.medium) || !join::asked_for(pass, Label::Medium, light, camera) {
            return;
        }
        let Some(scattering) = vertex.scatter(scene, pass, Mode::Radiance, photon.to_previous.into()) else {
            return;
        };
        let kernel = pass.settings.merging.kernel.ball(d2 / (radius * radius));
        let arms = (&photon.arm(), &arm);
        let sample = join::sample(pass, Technique::PointPoint, Label::Medium, arms, &scattering, kernel);
        if let Some(sample) = sample {
            record(&sample, Meeting { path: photon.path, light: photon.p.into(), camera: collision.p });
        }
    });
}
