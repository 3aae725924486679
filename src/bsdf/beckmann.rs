//! The Beckmann distribution of microfacet normals with Smith's masking [Walter et al. 2007], and sampling of the normals
//! that are visible from a direction [Heitz & d'Eon 2014].
//!
//! Slopes of facets are normally distributed, with the variance α²/2. Smith's masking is exact, with the error function
//! [Walter et al. 2007 (26)], and not its rational fit (27), which Mitsuba takes and which is up to 0.4% off. It is
//! written with the projected area of what w sees, cos θ_w/G₁(w) = cos θ (1 + erf a)/2 + α sin θ e^{−a²}/(2√π) with
//! a = 1/(α tan θ), in which nothing is divided by a cosine.

use super::microfacet::{Masking, Microfacets};
use glam::{Vec2, Vec3A};
use std::f32::consts::FRAC_1_PI;

/// 1/√π.
const FRAC_1_SQRT_PI: f32 = 0.564_189_6;

/// An isotropic rough surface of slopes with a normal distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beckmann {
    alpha: f32,
    masking: Masking,
}

impl Beckmann {
    /// From the roughness α, from [`super::microfacet::SMOOTH_BELOW`] to 1.
    pub fn new(alpha: f32, masking: Masking) -> Self {
        Self { alpha, masking }
    }

    /// The roughness α.
    pub fn alpha(&self) -> f32 {
        self.alpha
    }

    /// How masking and shadowing go together.
    pub fn masking(&self) -> Masking {
        self.masking
    }

    /// cos θ_w/G₁(w), see the module.
    #[inline]
    fn projected(&self, w: Vec3A) -> f32 {
        Slopes { cos: w.z.abs(), sin: self.alpha * sine(w) }.all()
    }
}

impl Microfacets for Beckmann {
    /// [Walter et al. 2007 (25)].
    #[inline]
    fn d(&self, m: Vec3A) -> f32 {
        let cos2 = m.z * m.z;
        let a2 = self.alpha * self.alpha;
        let exponent = (m.x * m.x + m.y * m.y) / (a2 * cos2);
        // Past this the exponential is 0 in single precision, and cos⁴ may be.
        if exponent < 87.0 { (-exponent).exp() * FRAC_1_PI / (a2 * cos2 * cos2) } else { 0.0 }
    }

    #[inline]
    fn g1_over_cos(&self, w: Vec3A) -> f32 {
        1.0 / self.projected(w)
    }

    #[inline]
    fn g2_reflect_over_cos(&self, a: Vec3A, b: Vec3A) -> f32 {
        match self.masking {
            // 1 + Λ_a + Λ_b = p_a/c_a + p_b/c_b − 1, and p ≥ c.
            Masking::Correlated => {
                let (cos_a, cos_b) = (a.z.abs(), b.z.abs());
                1.0 / (self.projected(a) * cos_b + self.projected(b) * cos_a - cos_a * cos_b)
            }
            Masking::Separable => self.g1_over_cos(a) * self.g1_over_cos(b),
        }
    }

    /// In the space where α is 1, the slope along w and the one across it are independent; the latter is not masked.
    #[inline]
    fn sample_visible(&self, w: Vec3A, u: Vec2) -> Vec3A {
        let w = (w * Vec3A::new(self.alpha, self.alpha, 1.0)).normalize();
        let sin = sine(w);
        let along = Slopes { cos: w.z, sin }.sample(u.x);
        // A normal distribution is what w = z sees; the lower half of it is solved for more quickly.
        let lower = Slopes { cos: 1.0, sin: 0.0 }.sample(u.y.min(1.0 - u.y));
        let across = if u.y < 0.5 { lower } else { -lower };
        let (x, y) = if sin > 0.0 { (w.x / sin, w.y / sin) } else { (1.0, 0.0) };
        let slope = self.alpha * Vec2::new(along * x - across * y, along * y + across * x);
        Vec3A::new(-slope.x, -slope.y, 1.0).normalize()
    }
}

/// sin θ.
#[inline]
fn sine(w: Vec3A) -> f32 {
    (w.x * w.x + w.y * w.y).sqrt()
}

/// The slopes x along w, for α = 1, as w sees them: with the density (cos θ − x sin θ) e^{−x²}/√π for x < cot θ, which is
/// cos θ/G₁(w) in all. `sin` and `cos` need not belong to one angle: α sin θ for sin θ gives the surface of roughness α.
#[derive(Clone, Copy)]
struct Slopes {
    cos: f32,
    sin: f32,
}

impl Slopes {
    /// The density, not normalised, and its integral up to x: cos θ (1 + erf x)/2 + sin θ e^{−x²}/(2√π), without cancellation
    /// for x < 0.
    #[inline]
    fn at(self, x: f32) -> (f32, f32) {
        let bell = (-x * x).exp();
        let sin = self.sin * FRAC_1_SQRT_PI;
        let below = if x < 0.0 {
            0.5 * bell * (self.cos * scaled_erfc(-x) + sin)
        } else {
            self.cos + 0.5 * bell * (sin - self.cos * scaled_erfc(x))
        };
        ((self.cos - x * self.sin) * bell * FRAC_1_SQRT_PI, below)
    }

    /// The integral of the density.
    #[inline]
    fn all(self) -> f32 {
        // Of the slopes of a direction as steep as this, what faces away from it weighs 2e-10: nothing in single precision.
        if self.cos > 4.0 * self.sin { self.cos } else { self.at(self.cos / self.sin).1 }
    }

    /// The slope below which the share `u` of all lies, by Newton's method as [Jakob 2014], but for the logarithm of the
    /// share. That is concave, as the density is, by its logarithm: from the left each step stays on the left, and
    /// none has to be caught.
    #[inline]
    fn sample(self, u: f32) -> f32 {
        // Half of what uniforms are apart stands for the 0, whose slope is infinite.
        let share = u.max(0.5f32.powi(25)) * self.all();
        let end = self.cos / self.sin;
        // Up to x < 0 lies at most e^{−x²} of what lies up to 0: this is on the left.
        let up_to_0 = 0.5 * (self.cos + self.sin * FRAC_1_SQRT_PI);
        let mut x = if share < up_to_0 { -(up_to_0 / share).ln().sqrt() } else { 0.0 };
        for _ in 0..24 {
            let (density, below) = self.at(x);
            let step = (share / below).ln() * below / density;
            // The density falls to 0 at the end; there rounding is all that is left.
            if !step.is_finite() || density <= 0.0 {
                break;
            }
            x = (x + step).min(end);
            // What is left is of the order of its square; or, at the end, where there is next to no density, of its size.
            if step.abs() < 3e-4 {
                break;
            }
        }
        x
    }
}

/// e^{x²} erfc(x) for x ≥ 0, as a polynomial in 1/(1 + 0.45 x), fitted to a relative error of 4e-8.
#[inline]
fn scaled_erfc(x: f32) -> f32 {
    const FIT: [f32; 10] = [
        0.253_885_33,
        0.253_883_15,
        0.228_271_65,
        0.175_252_02,
        0.119_951_13,
        -0.022_360_329,
        0.142_405_63,
        -0.300_587_62,
        0.190_690_89,
        -0.041_391_823,
    ];
    let t = 1.0 / (1.0 + 0.45 * x);
    t * FIT.iter().rev().fold(0.0, |sum, c| sum * t + c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::function::erf::{erf, erfc};

    #[test]
    fn the_fit_is_the_scaled_error_function() {
        for i in 0..=800 {
            let x = i as f32 / 160.0;
            let theirs = f64::from(x).powi(2).exp() * erfc(x.into());
            assert!((f64::from(scaled_erfc(x)) / theirs - 1.0).abs() < 4e-7, "{x}: {theirs}");
        }
        // e^{x²} erfc x → 1/(x√π).
        for x in [1e3, 1e6, 1e18] {
            assert!((scaled_erfc(x) * x / FRAC_1_SQRT_PI - 1.0).abs() < 2e-6, "{x}");
        }
        assert_eq!(scaled_erfc(f32::INFINITY), 0.0);
    }

    #[test]
    fn slopes_are_those_of_their_shares() {
        for cos in [1.0, 1.0 - 1e-6, 0.99, 0.8, 0.5, 0.1, 1e-3, 1e-6, 0.0f32] {
            let slopes = Slopes { cos, sin: (1.0 - cos * cos).sqrt() };
            let (c, s) = (f64::from(slopes.cos), f64::from(slopes.sin));
            let below =
                |x: f64| 0.5 * (c * (1.0 + erf(x)) + s * (-x * x).exp() / std::f64::consts::PI.sqrt());
            let all = if s > 0.0 { below(c / s) } else { c };
            assert!((f64::from(slopes.all()) / all - 1.0).abs() < 1e-6, "{cos}");
            let mut last = f32::NEG_INFINITY;
            for i in 0..4000 {
                let u = i as f32 / 4000.0;
                let x = slopes.sample(u);
                assert!(x > last && slopes.cos - x * slopes.sin >= -1e-6, "{cos} {u}: {x} after {last}");
                assert!((below(x.into()) / all - f64::from(u)).abs() < 5e-7, "{cos} {u}: {x}");
                last = x;
            }
            // The ends of what uniforms there are.
            let (first, last) = (slopes.sample(0.0), slopes.sample(1.0 - f32::EPSILON / 2.0));
            assert!((-5.0..-3.5).contains(&first), "{cos}: {first}");
            assert!(last.is_finite() && slopes.cos - last * slopes.sin >= -1e-6, "{cos}: {last}");
        }
    }
}
