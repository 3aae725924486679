//! Fresnel's equations for unpolarised light.

use crate::math::Rgb;

/// What a plane boundary between two dielectrics does with a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refraction {
    /// The share that is reflected, 0 to 1; exactly 1 in total internal reflection.
    pub reflectance: f32,
    /// The share that is transmitted, 0 to 1; exactly 0 in total internal reflection.
    pub transmittance: f32,
    /// Cosine of the refracted ray with the far side's normal, ≥ 0; 0 in total internal reflection.
    pub cos: f32,
}

/// What a boundary between two dielectrics does, for the cosine `cos` > 0 on the near side and
/// `eta` = η_far/η_near > 0.
#[inline]
pub fn dielectric(cos: f32, eta: f32) -> Refraction {
    // cos²θ_far = 1 − (1 − cos²)/η² = (cos² + (η² − 1))/η², in the form that does not cancel near grazing incidence.
    let cos2 = cos * cos + (eta - 1.0) * (eta + 1.0);
    if cos2 <= 0.0 && eta != 1.0 {
        return Refraction { reflectance: 1.0, transmittance: 0.0, cos: 0.0 };
    }
    between(cos, cos2.sqrt() / eta, eta)
}

/// The same where the cosine on the far side is known, too. The near and the far side can change places, and the
/// transmittance keeps its relative precision where it is small: a refracted path is the same from both ends.
#[inline]
pub fn between(near: f32, far: f32, eta: f32) -> Refraction {
    if eta == 1.0 {
        // No boundary. The formula would divide 0 by 0 at grazing incidence.
        return Refraction { reflectance: 0.0, transmittance: 1.0, cos: far };
    }
    let (s, p) = (1.0 / (near + eta * far), 1.0 / (eta * near + far));
    let (rs, rp) = ((near - eta * far) * s, (eta * near - far) * p);
    Refraction {
        reflectance: (0.5 * (rs * rs + rp * rp)).min(1.0),
        // 1 − r_s² = 4 η near far/(near + η far)², and the same for p.
        transmittance: (2.0 * eta * near * far * (s * s + p * p)).min(1.0),
        cos: far,
    }
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
    let modulus = (difference * difference + 4.0 * (eta * k) * (eta * k)).sqrt();
    let a = (0.5 * (modulus + difference)).max(Rgb::ZERO).sqrt();
    let (t1, t2) = (modulus + c2, 2.0 * c * a);
    let rs = (t1 - t2) / (t1 + t2);
    let (t3, t4) = (c2 * modulus + s2 * s2, t2 * s2);
    let rp = rs * (t3 - t4) / (t3 + t4);
    (0.5 * (rs + rp)).clamp(Rgb::ZERO, Rgb::ONE)
}
