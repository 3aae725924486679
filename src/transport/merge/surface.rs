//! Surface merging: vertices on a disc [Jensen 1996; Georgiev et al. 2012].

use super::join::{self, Arm};
use super::photons::Photons;
use crate::bsdf::Mode;
use crate::film::Sample;
use crate::scene::Scene;
use crate::transport::expression::Label;
use crate::transport::pass::Pass;
use crate::transport::sink::Meeting;
use crate::transport::technique::Technique;
use crate::transport::walk::Vertex;

/// Merges a camera vertex on a surface with the light vertices about it.
#[inline]
pub fn gather(
    scene: &Scene,
    pass: &Pass,
    photons: &Photons,
    vertex: &Vertex,
    mut record: impl FnMut(&Sample, Meeting),
) {
    let radius = pass.gathers.of(Technique::Surface).radius;
    let here = vertex.place.position();
    let arm = Arm::from(vertex);
    photons.surface.within(here, |id, d2| {
        let photon = photons.photon(id);
        let (light, camera) = ((photon.length(), photon.trail), (arm.length, arm.trail));
        if !join::asked_for(pass, Label::Surface, light, camera) {
            return;
        }
        let Some(scattering) = vertex.scatter(scene, pass, Mode::Radiance, photon.to_previous.into()) else {
            return;
        };
        let kernel = pass.settings.merging.kernel.disc(d2 / (radius * radius));
        let arms = (&photon.arm(), &arm);
        let sample = join::sample(pass, Technique::Surface, Label::Surface, arms, &scattering, kernel);
        if let Some(sample) = sample {
            record(&sample, Meeting { path: photon.path, light: photon.p.into(), camera: here });
        }
    });
}
