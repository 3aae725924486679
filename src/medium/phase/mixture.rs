//! A weighted mean of phase functions.
//!
//! Each part is a share of what collides. Where flakes are among them, what is seen of all is the weighted sum of what is seen of
//! each, σ(ω) = Σ w σ_i(ω), and so is the value; light that comes from ω meets a part with the probability w σ_i(ω) / σ(ω).

use super::Phase;
use glam::{Vec2, Vec3A};

/// Phase functions with weights that add up to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Mixture {
    lobes: Box<[Lobe]>,
    directional: bool,
}

#[derive(Clone, Debug, PartialEq)]
struct Lobe {
    weight: f32,
    /// Weight of this and all before it.
    until: f32,
    phase: Phase,
}

impl Mixture {
    /// Of phase functions with positive weights, which are divided by their sum. A mixture among them is taken apart.
    ///
    /// # Errors
    /// No phase function at all, or a weight that is not positive and finite.
    pub fn new(lobes: Vec<(f32, Phase)>) -> Result<Self, String> {
        if lobes.is_empty() {
            return Err("a mixture of phase functions needs at least one".into());
        }
        let mut simple: Vec<(f64, Phase)> = Vec::new();
        for (weight, phase) in lobes {
            if !(weight.is_finite() && weight > 0.0) {
                return Err(format!("a weight of a mixture must be positive and finite, found {weight}"));
            }
            let weight = f64::from(weight);
            match phase {
                Phase::Mixture(inner) => simple.extend(
                    inner.lobes.into_iter().map(|lobe| (weight * f64::from(lobe.weight), lobe.phase)),
                ),
                Phase::ByPlace(_) => {
                    return Err(
                        "what varies by place cannot be a part of a mixture: mix its parts by place".into()
                    );
                }
                phase => simple.push((weight, phase)),
            }
        }
        let total: f64 = simple.iter().map(|(weight, _)| weight).sum();
        let mut until = 0.0;
        let lobe = |(weight, phase): (f64, Phase)| {
            until += weight / total;
            Lobe { weight: (weight / total) as f32, until: until as f32, phase }
        };
        let lobes: Box<[Lobe]> = simple.into_iter().map(lobe).collect();
        let directional = lobes.iter().any(|lobe| lobe.phase.is_directional());
        Ok(Self { lobes, directional })
    }

    #[inline]
    pub(super) fn is_directional(&self) -> bool {
        self.directional
    }

    #[inline]
    pub(super) fn area(&self, w: Vec3A) -> f32 {
        if !self.directional {
            return 1.0;
        }
        self.lobes.iter().map(|lobe| lobe.weight * lobe.phase.area(w)).sum()
    }

    pub(super) fn mean_area(&self) -> f32 {
        if !self.directional {
            return 1.0;
        }
        self.lobes.iter().map(|lobe| lobe.weight * lobe.phase.mean_area()).sum()
    }

    pub(super) fn evaluate(&self, wl: Vec3A, wc: Vec3A) -> f32 {
        self.lobes.iter().map(|lobe| lobe.weight * lobe.phase.evaluate(wl, wc)).sum()
    }

    pub(super) fn sample(&self, from: Vec3A, u: (f32, Vec2)) -> (Vec3A, f32) {
        if self.directional {
            return self.sample_seen(from, u);
        }
        let last = self.lobes.len() - 1;
        let picked = self.lobes[..last].iter().find(|lobe| u.0 < lobe.until).unwrap_or(&self.lobes[last]);
        let (to, _) = picked.phase.sample(from, u);
        (to, self.evaluate(from, to))
    }

    /// A part is picked by what is seen of it.
    fn sample_seen(&self, from: Vec3A, u: (f32, Vec2)) -> (Vec3A, f32) {
        let area = self.area(from);
        let mut left = u.0 * area;
        let last = self.lobes.len() - 1;
        let picked = self.lobes[..last].iter().find(|lobe| {
            left -= lobe.weight * lobe.phase.area(from);
            left < 0.0
        });
        let (to, _) = picked.unwrap_or(&self.lobes[last]).phase.sample(from, u);
        (to, self.evaluate(from, to) / area)
    }

    /// The mean over all directions of light, too; what each part is seen from them with counts.
    pub(super) fn mean_cosine(&self) -> f32 {
        if self.directional {
            let seen = |lobe: &Lobe| lobe.weight * lobe.phase.mean_area();
            return self.lobes.iter().map(|l| seen(l) * l.phase.mean_cosine()).sum::<f32>()
                / self.mean_area();
        }
        self.lobes.iter().map(|lobe| lobe.weight * lobe.phase.mean_cosine()).sum()
    }

    pub(super) fn describe(&self) -> String {
        let parts: Vec<String> =
            self.lobes.iter().map(|l| format!("{:.3} {}", l.weight, l.phase.describe())).collect();
        parts.join(" + ")
    }
}
