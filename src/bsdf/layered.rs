//! A sum of other materials by fixed weights: f = Σ w_i f_i.
//!
//! Walks choose a component with a probability in proportion to w_i times its mean albedo's largest channel: fixed
//! numbers, so that the densities are known from both ends.

use super::{BsdfSample, BsdfValue, Material, Mode, Site};
use crate::math::Rgb;
use glam::{Vec2, Vec3A};

/// A weighted sum of materials.
#[derive(Clone, Debug)]
pub struct Layered {
    components: Box<[Component]>,
}

#[derive(Clone, Debug)]
struct Component {
    weight: f32,
    probability: f32,
    material: Material,
}

impl Layered {
    /// From weights, none negative, and materials; neither Null nor Layered, and at least one. Weights whose
    /// albedos sum to more than 1 are not refused, see [`Material::albedo_bound`].
    pub fn new(components: Vec<(f32, Material)>) -> Result<Self, String> {
        if components.is_empty() {
            return Err("a layered material needs at least one component".to_owned());
        }
        for (i, (weight, material)) in components.iter().enumerate() {
            if !(weight.is_finite() && *weight >= 0.0) {
                return Err(format!(
                    "weight {} of a layered material must not be negative, found {weight}",
                    i + 1
                ));
            }
            if matches!(material, Material::Null | Material::Layered(_)) {
                return Err(
                    "a component of a layered material can be neither null nor layered itself".to_owned()
                );
            }
        }
        let shares: Vec<f64> = components
            .iter()
            .map(|(w, m)| f64::from(*w) * f64::from(m.mean_albedo().max_element()))
            .collect();
        let total: f64 = shares.iter().sum();
        let components = components
            .into_iter()
            .zip(shares)
            // What has no share is black: it is never chosen, and adds nothing where it is evaluated.
            .filter(|(_, share)| *share > 0.0)
            .map(|((weight, material), share)| Component {
                weight,
                probability: (share / total) as f32,
                material,
            })
            .collect();
        Ok(Self { components })
    }

    #[inline]
    pub(super) fn evaluate(&self, site: Site, wl: Vec3A, wc: Vec3A) -> BsdfValue {
        let mut sum = BsdfValue::ZERO;
        for component in &self.components {
            let value = component.material.evaluate(site, wl, wc);
            sum.f += component.weight * value.f;
            sum.pdf_lc += component.probability * value.pdf_lc;
            sum.pdf_cl += component.probability * value.pdf_cl;
        }
        sum
    }

    /// A specular sample stands for its own component alone. Two components may reflect into the same direction; as
    /// both have the same ratio of densities, the weights of paths do not depend on which one it was.
    pub(super) fn sample(&self, site: Site, from: Vec3A, mode: Mode, u: (f32, Vec2)) -> Option<BsdfSample> {
        let (last, rest) = self.components.split_last()?;
        let mut left = u.0;
        let mut chosen = last;
        for component in rest {
            if left < component.probability {
                chosen = component;
                break;
            }
            left -= component.probability;
        }
        // What is left of u is uniform in [0, 1) again.
        let left = (left / chosen.probability).clamp(0.0, 1.0 - f32::EPSILON / 2.0);
        let sample = chosen.material.sample(site, from, mode, (left, u.1))?;
        if sample.specular {
            return Some(BsdfSample {
                weight: sample.weight * (chosen.weight / chosen.probability),
                pdf: sample.pdf * chosen.probability,
                pdf_rev: sample.pdf_rev * chosen.probability,
                ..sample
            });
        }
        let (wl, wc) = mode.order(from, sample.to);
        BsdfSample::smooth(&self.evaluate(site, wl, wc), mode, sample.to)
    }

    pub(super) fn albedo(&self, uv: Vec2) -> Rgb {
        self.components.iter().map(|c| c.weight * c.material.albedo(uv)).sum()
    }

    pub(super) fn mean_albedo(&self) -> Rgb {
        self.components.iter().map(|c| c.weight * c.material.mean_albedo()).sum()
    }

    pub(super) fn albedo_bound(&self) -> f32 {
        self.components.iter().map(|c| c.weight * c.material.albedo_bound()).sum()
    }

    /// That of the first component that refracts.
    pub(super) fn refraction(&self) -> Option<(f32, f32)> {
        self.components.iter().find_map(|c| c.material.refraction())
    }

    #[inline]
    pub(super) fn has_smooth(&self) -> bool {
        self.components.iter().any(|c| c.material.has_smooth())
    }

    #[inline]
    pub(super) fn has_specular(&self) -> bool {
        self.components.iter().any(|c| c.material.has_specular())
    }
}
