//! Fresnel's equations for unpolarised light.

use crate::math::Rgb;

/// What a plane boundary between two dielectrics does with a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refraction {
    /// The share that is reflected, 0 to 1; exactly 1 in total internal reflection.
    pub reflectance: f32,
    /// Cosine of the refracted ray with the far side's normal, ≥ 0; 0 in total internal reflection.
    pub cos: f32,
}

/// Reflectance of a boundary between two dielectrics, for the cosine `cos` > 0 on the near side and
/// `eta` = η_far/η_near > 0.
#[inline]
pub fn dielectric(cos: f32, eta: f32) -> Refraction {
    if eta == 1.0 {
        // No boundary. The formula would divide 0 by 0 at grazing incidence.
        return Refraction { reflectance: 0.0, cos };
    }
    // cos²θ_far = 1 − (1 − cos²)/η² = (cos² + (η² − 1))/η², in the form that does not cancel near grazing incidence.
    let cos2 = cos * cos + (eta - 1.0) * (eta + 1.0);
    if cos2 <= 0.0 {
        return Refraction { reflectance: 1.0, cos: 0.0 };
    }
    let far = cos2.sqrt() / eta;
    let s = (cos - eta * far) / (cos + eta * far);
    let p = (eta * cos - far) / (eta * cos + far);
    Refraction { reflectance: (0.5 * (s * s + p * p)).min(1.0), cos: far }
}

/// Reflectance of a metal of complex index η + ik (relative to the medium in front of it), a channel each, for the
/// cosine `cos` of incidence.
#[inline]
pub fn conductor(cos: f32, eta: Rgb, k: Rgb) -> Rgb {
    // Exactly grazing would be 0/0 for a "metal" of index 1.
    let c = cos.clamp(1e-6, 1.0);
    let (c2, s2) = (c * c, (1.0 - c) * (1.0 + c));
    // (a + ib)² = (η + ik)² − sin²θ: the refracted wave's normal component.
    let difference = eta * eta - k * k - s2;
    let modulus = (difference * difference + 4.0 * (eta * k) * (eta * k)).map(f32::sqrt);
    let a = (0.5 * (modulus + difference)).max(Rgb::ZERO).map(f32::sqrt);
    let (t1, t2) = (modulus + c2, 2.0 * c * a);
    let rs = (t1 - t2) / (t1 + t2);
    let (t3, t4) = (c2 * modulus + s2 * s2, t2 * s2);
    let rp = rs * (t3 - t4) / (t3 + t4);
    (0.5 * (rs + rp)).clamp(Rgb::ZERO, Rgb::ONE)
}
