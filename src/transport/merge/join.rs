//! A light and a camera subpath that meet at x_i: the sample that comes of it.

use crate::bsdf::Mode;
use crate::film::Sample;
use crate::geometry::Ray;
use crate::math::{Rgb, RgbExt};
use crate::medium::{Coefficients, Medium, Passage};
use crate::transport::expression::{Expression, Label};
use crate::transport::mis::{Link, merge_weight};
use crate::transport::pass::Pass;
use crate::transport::technique::Technique;
use crate::transport::walk::{Scattering, Vertex};
use glam::Vec3A;

/// A subpath as it arrives at x_i.
#[derive(Clone, Copy, Debug)]
pub struct Arm {
    /// Unit direction back to x_{i-1} (x_{i+1} on a camera subpath).
    pub back: Vec3A,
    /// Contribution over density up to here.
    pub throughput: Rgb,
    /// What the weights need.
    pub link: Link,
    /// b of the edge, raised; 0 on a surface.
    pub beam: f32,
    /// Edges of the subpath.
    pub length: u32,
    /// What the light path expression needs of the vertices before this one.
    pub trail: u32,
}

impl From<&Vertex> for Arm {
    #[inline]
    fn from(vertex: &Vertex) -> Self {
        Self {
            back: vertex.to_previous,
            throughput: vertex.throughput,
            link: vertex.link,
            beam: vertex.beam,
            length: vertex.length,
            trail: vertex.trail,
        }
    }
}

/// What the medium with this index does to light at a point `p` of it, where its coefficients are `at`.
#[inline(always)]
pub fn scatter_in(
    pass: &Pass,
    (index, medium): (u32, &Medium),
    p: Vec3A,
    at: &Coefficients,
    wl: Vec3A,
    wc: Vec3A,
) -> Scattering {
    let phase = medium.phase_densities(p, wl, wc);
    Scattering {
        value: at.sigma_s * phase.value,
        pdf_light: phase.light * pass.continuation(Mode::Importance, (index, medium), at),
        pdf_camera: phase.camera * pass.continuation(Mode::Radiance, (index, medium), at),
    }
}

/// Whether the path of two subpaths that meet is asked for, by its length and its vertices: each has so many edges and such a
/// trail. Asked before anything is computed of the pair.
#[inline]
pub fn asked_for(pass: &Pass, label: Label, light: (u32, u32), camera: (u32, u32)) -> bool {
    let settings = &pass.settings;
    (settings.min_length..=settings.max_length).contains(&(light.0 + camera.0))
        && Expression::accepts(settings.paths.step(camera.1 as u8, label), light.1)
}

/// The sample of two arms that meet by `technique`, whose kernel is `kernel` times the constant one for this pair.
/// `None` where nothing comes through. That it is [`asked_for`] is known.
#[inline]
pub fn sample(
    pass: &Pass,
    technique: Technique,
    label: Label,
    arms: (&Arm, &Arm),
    scattering: &Scattering,
    kernel: f32,
) -> Option<Sample> {
    let (light, camera) = arms;
    let settings = &pass.settings;
    let sine = sine(light.back, camera.back);
    let constant = match technique {
        Technique::BeamBeam => pass.gathers.of(technique).density(technique) * sine,
        _ => pass.gathers.of(technique).density(technique),
    };
    let contribution = light.throughput * camera.throughput * scattering.value * (kernel / constant);
    if contribution.is_black() {
        return None;
    }
    let merges = &pass.merges;
    let raised_sine = if merges.beam_beam > 0.0 { pass.raise(sine) } else { 0.0 };
    let (own, all) = if label == Label::Surface {
        (merges.surface, merges.surface)
    } else {
        let own = match technique {
            Technique::PointBeam => merges.point_beam * camera.beam,
            Technique::BeamPoint => merges.beam_point * light.beam,
            Technique::BeamBeam => merges.beam_beam * raised_sine * light.beam * camera.beam,
            _ => merges.point_point,
        };
        (own, merges.from_light(light.beam, raised_sine).with(camera.beam))
    };
    let weight = if settings.merging.first {
        // No other place of the path can be merged at, and nothing connected.
        own / all
    } else {
        let light_side = light.link.apart(pass.raise(scattering.pdf_camera));
        let camera_side = camera.link.apart(pass.raise(scattering.pdf_light));
        merge_weight(own, all, light_side, camera_side)
    };
    Some(Sample { technique, s: light.length, t: camera.length + 1, contribution, weight })
}

/// Sine of the angle between two unit vectors.
#[inline]
pub fn sine(a: Vec3A, b: Vec3A) -> f32 {
    a.cross(b).length()
}

/// The parameter at which a ray is nearest to a point, and the square of the distance there.
#[inline]
pub fn nearest(ray: &Ray, point: Vec3A) -> (f32, f32) {
    let to = point - ray.origin;
    let t = to.dot(ray.dir);
    (t, (to - ray.dir * t).length_squared())
}

/// Whether nothing that counts gets through.
#[inline]
pub fn is_negligible(passage: &Passage) -> bool {
    passage.transmittance.max_element() < 1e-7
}
