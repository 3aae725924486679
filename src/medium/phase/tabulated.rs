//! A phase function by a table: values at cosines of the deflection, linear between them.

use super::about;
use glam::{Vec2, Vec3A};

/// Values at cosines.
#[derive(Clone, Debug, PartialEq)]
pub struct Tabulated {
    /// From −1 to 1, in order.
    cosines: Box<[f32]>,
    /// 1/sr, such that the integral over the sphere is 1.
    values: Box<[f32]>,
    /// By entry, the probability of a lower cosine.
    below: Box<[f64]>,
    mean_cosine: f32,
}

impl Tabulated {
    /// Of (cosine of the deflection, value) in order of the cosines, from −1, straight back, to 1, straight on. The values are
    /// divided by their integral.
    ///
    /// # Errors
    /// Fewer than two entries, cosines that do not rise from −1 to 1, and values that are negative, not finite or all 0.
    pub fn new(entries: &[(f32, f32)]) -> Result<Self, String> {
        let cosines: Vec<f64> = entries.iter().map(|e| f64::from(e.0)).collect();
        let values: Vec<f64> = entries.iter().map(|e| f64::from(e.1)).collect();
        let (Some(first), Some(last)) = (cosines.first(), cosines.last()) else {
            return Err("the table of a phase function is empty".into());
        };
        if !(*first == -1.0 && *last == 1.0 && cosines.windows(2).all(|c| c[0] < c[1])) {
            return Err("the cosines of a phase function's table must rise from -1 to 1".into());
        }
        if let Some(value) = values.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
            return Err(format!(
                "a value of a phase function must be finite and not negative, found {value}"
            ));
        }
        let mut below = vec![0.0];
        let mut mean = 0.0;
        for i in 1..values.len() {
            let (a, b, width) = (cosines[i - 1], cosines[i], cosines[i] - cosines[i - 1]);
            below.push(below[i - 1] + 0.5 * width * (values[i - 1] + values[i]));
            mean += width / 6.0 * (values[i - 1] * (2.0 * a + b) + values[i] * (a + 2.0 * b));
        }
        let whole = below[below.len() - 1];
        if whole <= 0.0 {
            return Err("the values of a phase function are all 0".into());
        }
        let scale = 1.0 / (std::f64::consts::TAU * whole);
        Ok(Self {
            cosines: entries.iter().map(|e| e.0).collect(),
            values: values.iter().map(|v| (v * scale) as f32).collect(),
            below: below.iter().map(|b| b / whole).collect(),
            mean_cosine: (mean / whole) as f32,
        })
    }

    fn at(&self, cos: f32) -> f32 {
        let i = self.cosines.partition_point(|c| *c <= cos).clamp(1, self.cosines.len() - 1);
        let (a, b) = (self.cosines[i - 1], self.cosines[i]);
        let share = ((cos - a) / (b - a)).clamp(0.0, 1.0);
        self.values[i - 1] * (1.0 - share) + self.values[i] * share
    }

    pub(super) fn evaluate(&self, wl: Vec3A, wc: Vec3A) -> f32 {
        // The cosine from the nearer end: next to ±1 a dot product has few digits.
        let dot = wl.dot(wc);
        let cos = if dot < 0.0 {
            1.0 - 0.5 * (wl + wc).length_squared()
        } else {
            0.5 * (wl - wc).length_squared() - 1.0
        };
        self.at(cos)
    }

    /// Between two entries the probability is a parabola of the cosine.
    pub(super) fn sample(&self, from: Vec3A, u: Vec2) -> (Vec3A, f32) {
        // The middle of the uniform's step, so that no sample falls on an end where the value may be 0.
        let u0 = f64::from(u.x) + 0.5 / f64::from(1u32 << 24);
        let i = self.below.partition_point(|b| *b <= u0).clamp(1, self.below.len() - 1);
        let (a, b) = (f64::from(self.cosines[i - 1]), f64::from(self.cosines[i]));
        let (low, high) = (f64::from(self.values[i - 1]), f64::from(self.values[i]));
        let part = ((u0 - self.below[i - 1]) / (self.below[i] - self.below[i - 1])).clamp(0.0, 1.0);
        // low·s + (high − low) s²/2 = part (low + high)/2
        let root = (low * low + part * (high * high - low * low)).max(0.0).sqrt();
        let share = (part * (low + high) / (low + root)).clamp(0.0, 1.0);
        let cos = a + share * (b - a);
        (about(-from, (1.0 - cos) as f32, u.y), (low + share * (high - low)) as f32)
    }

    pub(super) fn mean_cosine(&self) -> f32 {
        self.mean_cosine
    }

    pub(super) fn describe(&self) -> String {
        format!("table of {} cosines with a mean of {:.3}", self.cosines.len(), self.mean_cosine)
    }
}
