//! A medium that is the same everywhere: all integrals along a ray are in closed form.

use super::{Coefficients, MediumSummary, Phase};
use crate::math::{Rgb, RgbExt};
use glam::Vec3A;

/// Constant coefficients and emission.
#[derive(Clone, Debug)]
pub struct Homogeneous {
    coefficients: Coefficients,
    emission: Rgb,
    phase: Phase,
    scatters: bool,
    /// [`Phase::is_directional`], so that nothing asks the phase function where it is not.
    directional: bool,
    /// Of a walk, see [`super::Medium::continuation`].
    continuation: f32,
}

impl Homogeneous {
    /// With the absorption `sigma_a` and the scattering `sigma_s` (1/m) and the emission (radiance a metre,
    /// W/(sr m³)).
    ///
    /// # Errors
    /// What is negative, not finite, or too large to be added.
    pub fn new(sigma_a: Rgb, sigma_s: Rgb, emission: Rgb, phase: Phase) -> Result<Self, String> {
        check("sigma_a", sigma_a)?;
        check("sigma_s", sigma_s)?;
        check("emission", emission)?;
        let sigma_t = sigma_a + sigma_s;
        check("sigma_a + sigma_s", sigma_t)?;
        Ok(Self::of(Coefficients { sigma_t, sigma_s }, emission, phase))
    }

    /// With the extinction `sigma_t` (1/m) of which the share `albedo` is scattered.
    ///
    /// # Errors
    /// As [`Self::new`], and an albedo above 1.
    pub fn with_albedo(sigma_t: Rgb, albedo: Rgb, emission: Rgb, phase: Phase) -> Result<Self, String> {
        check("sigma_t", sigma_t)?;
        check("albedo", albedo)?;
        check("emission", emission)?;
        if albedo.max_element() > 1.0 {
            return Err(format!(
                "albedo must be at most 1 in each channel, found {albedo}: a medium cannot scatter more light than \
                 collides"
            ));
        }
        let sigma_s = sigma_t * albedo;
        Ok(Self::of(Coefficients { sigma_t, sigma_s }, emission, phase))
    }

    fn of(coefficients: Coefficients, emission: Rgb, phase: Phase) -> Self {
        let scatters = !coefficients.sigma_s.is_black();
        let (directional, continuation) = (phase.is_directional(), coefficients.continuation());
        Self { coefficients, emission, phase, scatters, directional, continuation }
    }

    #[inline]
    pub(super) fn coefficients(&self, _: Vec3A) -> Coefficients {
        self.coefficients
    }

    /// σ_t of light along `dir`.
    #[inline(always)]
    fn sigma_t(&self, dir: Vec3A) -> Rgb {
        self.coefficients.sigma_t * self.area(dir)
    }

    /// See [`super::Medium::area`].
    #[inline(always)]
    pub(super) fn area(&self, dir: Vec3A) -> f32 {
        if self.directional { self.phase.area(dir) } else { 1.0 }
    }

    #[inline(always)]
    pub(super) fn continuation(&self) -> f32 {
        self.continuation
    }

    #[inline(always)]
    pub(super) fn optical_depth(&self, _: Vec3A, dir: Vec3A, t0: f32, t1: f32) -> Rgb {
        let sigma_t = self.sigma_t(dir);
        // 0·∞ is 0 here: where there is nothing, there is nothing for ever.
        Rgb::select(sigma_t.cmpgt(Rgb::ZERO), sigma_t * (t1 - t0), Rgb::ZERO)
    }

    #[inline]
    pub(super) fn scatters(&self) -> bool {
        self.scatters
    }

    #[inline(always)]
    pub(super) fn invert(
        &self,
        _: Vec3A,
        dir: Vec3A,
        t0: f32,
        t1: f32,
        channel: usize,
        depth: f32,
    ) -> Result<f32, f32> {
        // Of an array: a vector's number by index is three branches.
        let sigma_t = self.sigma_t(dir).to_array()[channel];
        // Also where there is no extinction, and where the stretch is empty; 0·∞ is no depth either.
        let whole = if sigma_t > 0.0 { sigma_t * (t1 - t0) } else { 0.0 };
        if depth >= whole {
            return Err(depth - whole);
        }
        // Rounding must not leave the stretch.
        let t = (t0 + depth / sigma_t).min(t1.next_down());
        // Where one step of t is many mean free paths (dense, and far from the origin), rounding up would lead to
        // where no channel's light gets.
        let overshoots = sigma_t * (t - t0) > depth + 1.0;
        Ok(if overshoots { t.next_down() } else { t })
    }

    #[inline]
    pub(super) fn phase(&self) -> &Phase {
        &self.phase
    }

    #[inline]
    pub(super) fn is_emissive(&self) -> bool {
        !self.emission.is_black()
    }

    /// e (1 − exp(−σd))/σ; e·d where σ is 0.
    pub(super) fn emitted(&self, _: Vec3A, dir: Vec3A, t0: f32, t1: f32) -> Rgb {
        let d = t1 - t0;
        let sigma_t = self.sigma_t(dir);
        let channel = |i: usize| {
            let (e, sigma) = (self.emission[i], sigma_t[i]);
            if e == 0.0 {
                return 0.0;
            }
            let depth = if sigma > 0.0 { sigma * d } else { 0.0 };
            // Both are the same; the first has no quotient of infinities, the second none of zeros.
            if depth > 1.0 { e * (-(-depth).exp_m1() / sigma) } else { e * d * relative_escape(depth) }
        };
        Rgb::new(channel(0), channel(1), channel(2))
    }

    pub(super) fn shines_without_bound(&self) -> bool {
        (self.emission.cmpgt(Rgb::ZERO) & self.coefficients.sigma_t.cmpeq(Rgb::ZERO)).any()
    }

    pub(super) fn summary(&self) -> MediumSummary {
        let (sigma_t, sigma_s, mean_area) =
            (self.coefficients.sigma_t, self.coefficients.sigma_s, self.phase.mean_area());
        let (sigma_t, sigma_s) = (sigma_t * mean_area, sigma_s * mean_area);
        let there = sigma_t.cmpgt(Rgb::ZERO);
        MediumSummary {
            kind: "homogeneous",
            sigma_t,
            sigma_s,
            emission: self.emission,
            mean_free_path: Rgb::select(there, sigma_t.recip(), Rgb::INFINITY),
            is_directional: self.phase.is_directional(),
            albedo: Rgb::select(there, sigma_s / sigma_t, Rgb::ZERO),
            phase: self.phase.describe(),
            mean_cosine: self.phase.mean_cosine(),
        }
    }
}

/// (1 − exp(−x))/x: the share of what a stretch of the optical depth x emits that leaves it.
fn relative_escape(x: f32) -> f32 {
    if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 }
}

fn check(what: &str, value: Rgb) -> Result<(), String> {
    if value.is_finite() && value.min_element() >= 0.0 {
        Ok(())
    } else {
        Err(format!("{what} must be finite and not negative in each channel, found {value}"))
    }
}
