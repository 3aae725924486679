//! Droplets of water: an approximation of Mie's phase function by their diameter [Jendersie & d'Eon 2023], a mixture of
//! a lobe of Henyey's and Greenstein's and one of Draine's [Draine 2003],
//!
//! ```text
//! (1 − g²) / (4π (1 + g² − 2 g cos θ)^(3/2)) · (1 + α cos² θ) / (1 + α (1 + 2g²)/3)
//! ```
//!
//! It has the forward peak and the rise to the back of droplets of 5 to 50 μm, not the rings of their fogbow and glory: for these
//! take a table.

use super::about;
use super::{HenyeyGreenstein, Mixture, Phase};
use glam::{Vec2, Vec3A};
use std::f64::consts::PI;

/// Draine's phase function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draine {
    g: f64,
    alpha: f64,
    /// Of the value.
    scale: f64,
}

/// Newton's steps at most.
const STEPS: usize = 60;

impl Draine {
    /// With 0 < g < 1 and α >= 0.
    ///
    /// # Errors
    /// Where they are not.
    pub fn new(g: f64, alpha: f64) -> Result<Self, String> {
        if !(g > 0.0 && g < 1.0 && alpha >= 0.0 && alpha.is_finite()) {
            return Err(format!(
                "Draine's phase function needs 0 < g < 1 and alpha from 0 up, found {g} and {alpha}"
            ));
        }
        let scale = (1.0 - g * g) / (4.0 * PI * (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0));
        Ok(Self { g, alpha, scale })
    }

    /// Where the versine 1 − cos θ of the deflection is `v`: without a difference of nearly equal numbers.
    fn at(&self, v: f64) -> f64 {
        let cos = 1.0 - v;
        let bracket = (1.0 - self.g).powi(2) + 2.0 * self.g * v;
        self.scale * (1.0 + self.alpha * cos * cos) / (bracket * bracket.sqrt())
    }

    pub(super) fn evaluate(&self, wl: Vec3A, wc: Vec3A) -> f32 {
        self.at(0.5 * f64::from((wl + wc).length_squared())) as f32
    }

    /// 2π times the integral of the value over versines below that where the bracket is q². With cos = (a − q²)/(2g), a = 1 + g²,
    /// and d cos = −q dq/g, what is integrated is a polynomial of q and 1/q.
    fn probability(&self, q: f64) -> f64 {
        let (g, a) = (self.g, 1.0 + self.g * self.g);
        let k = self.alpha / (4.0 * g * g);
        let antiderivative = |q: f64| -(1.0 + k * a * a) / q - 2.0 * k * a * q + k * q * q * q / 3.0;
        2.0 * PI * self.scale / g * (antiderivative(q) - antiderivative(1.0 - g))
    }

    /// By inversion of the distribution of q.
    pub(super) fn sample(&self, from: Vec3A, u: Vec2) -> (Vec3A, f32) {
        let g = self.g;
        let wanted = f64::from(u.x) + 0.5 / f64::from(1u32 << 24);
        let (mut low, mut high) = (1.0 - g, 1.0 + g);
        // Where a lobe of Henyey's and Greenstein's has it.
        let mut q = (1.0 - g * g) / (1.0 + g * (1.0 - 2.0 * wanted));
        let versine = |q: f64| ((q - (1.0 - g)) * (q + (1.0 - g)) / (2.0 * g)).clamp(0.0, 2.0);
        for _ in 0..STEPS {
            let off = self.probability(q) - wanted;
            if off > 0.0 {
                high = q
            } else {
                low = q
            }
            let slope = 2.0 * PI * self.at(versine(q)) * q / g;
            let newton = q - off / slope;
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - q).abs() <= 1e-12 * q {
                break;
            }
            q = next;
        }
        let v = versine(q);
        (about(-from, v as f32, u.y), self.at(v) as f32)
    }

    pub(super) fn mean_cosine(&self) -> f32 {
        // ∫ cos dP by parts over many steps of the probability: for people only.
        const N: usize = 2000;
        let (g, a) = (self.g, 1.0 + self.g * self.g);
        let q = |i: usize| 1.0 - g + 2.0 * g * (i as f64 + 0.5) / N as f64;
        let mean: f64 = (0..N)
            .map(|i| {
                let q = q(i);
                let cos = (a - q * q) / (2.0 * g);
                2.0 * PI * cos * self.at(1.0 - cos) * q / g * (2.0 * g / N as f64)
            })
            .sum();
        mean as f32
    }

    pub(super) fn describe(&self) -> String {
        format!("Draine with g = {:.4} and α = {:.3}", self.g, self.alpha)
    }
}

/// Droplets of the diameter `d` in micrometres, 5 to 50 [Jendersie & d'Eon 2023, (4) to (7)].
///
/// # Errors
/// Another diameter.
pub fn droplets(d: f32) -> Result<Phase, String> {
    if !(5.0..=50.0).contains(&d) {
        return Err(format!("the diameter of droplets must be from 5 to 50 micrometres, found {d}"));
    }
    let d = f64::from(d);
    let g_hg = (-0.099_056_7 / (d - 1.671_54)).exp();
    let g_draine = (-2.206_79 / (d + 3.910_29) - 0.428_934).exp();
    let alpha = (3.624_89 - 8.292_88 / (d + 5.528_25)).exp();
    let weight = (-0.599_085 / (d - 0.641_583) - 0.665_888).exp();
    let lobes = vec![
        (1.0 - weight as f32, Phase::HenyeyGreenstein(HenyeyGreenstein::new(g_hg as f32)?)),
        (weight as f32, Phase::Draine(Draine::new(g_draine, alpha)?)),
    ];
    Mixture::new(lobes).map(Phase::Mixture)
}
