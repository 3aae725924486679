//! Which lights light subpaths start on: by what those of each light bring to the image.
//!
//! The power of a light says how much it sends out, not how much of that the camera sees. A sky of a small radiance sends
//! more through the disc about a scene than a candle does that the picture is of; and what of it is seen is found by hits and from
//! vertices, without light subpaths. With the share q_l of the light subpaths, the second moment of the image is
//!
//! ```text
//! Σ_j m_j (S_j / D_j + P_j / D_j²),   D_j = A_j + B_j q_l / p_l
//! ```
//!
//! over the samples j of a pilot whose light subpaths start with the shares p ([`super::evidence`]): A_j is the part of Σ n p that has no light
//! subpath and B_j that which has one, l the light that the path starts on. Products P_j of what is merged at one vertex grow
//! with (q_l / p_l)², as what they are of grows. An iteration costs C = C_0 + Σ_l c_l q_l, since some lights' subpaths are much longer
//! than others', and leave more behind to be merged ([`super::cost`]). What is sought is the least product of error and cost, by small steps
//!
//! ```text
//! q_l ← q_l exp(η (−∂ log E / ∂q_l − c_l / C)), scaled to a sum of 1.
//! ```
//!
//! The error E is, as for the counts of merges, the geometric mean of the squared and the relative one.
//!
//! It is no default. Where the noise of an image is that of its brightest parts, such as caustics of a small lamp under a sky, it gains up
//! to six times; where one light's subpaths are far longer than others', as those of a candle's flame in its wax, what they cost and the
//! bunches that they come in are foretold too low, and it loses up to three times.
//!
//! What a pilot does not see it must not take for nothing: a part [`SURE`] of all light subpaths is shared out as those of the pilot
//! are, half by power and half evenly.

use super::cost::Work;
use super::evidence::{Counts, Density, Evidence, Judged};
use super::pilot::Pilot;
use crate::light::Lights;
use crate::math::Discrete;
use crate::scene::Scene;
use crate::transport::settings::{LightStarts, MOST_LIGHTS, Settings};
use std::sync::Arc;

/// The part of light subpaths that are not shared out by what they bring.
const SURE: f64 = 0.1;
/// Steps towards the least product.
const STEPS: usize = 200;
/// η.
const STEP: f64 = 0.5;
/// Shares are multiples of 1 / this, so that as numbers of f32 they are exact, and so is their sum.
const PARTS: u32 = 4096;

/// What the settings say, where they say it with numbers.
pub fn asked(scene: &Scene, settings: &Settings) -> Option<Arc<Discrete>> {
    let LightStarts::Each(each) = settings.light_starts else { return None };
    let lights = scene.lights.lights().len().min(MOST_LIGHTS);
    Discrete::new(each[..lights].iter().map(|q| f64::from(*q))).map(Arc::new)
}

/// Whether shares are to be chosen: where light subpaths are walked, and there is a choice.
pub fn is_open(scene: &Scene, settings: &Settings) -> bool {
    let lights = scene.lights.lights().len();
    settings.light_starts == LightStarts::Pilot
        && settings.needs_light_paths()
        && lights <= MOST_LIGHTS
        && shining(&scene.lights).count() > 1
}

/// The lights that have power.
fn shining(lights: &Lights) -> impl Iterator<Item = usize> {
    (0..lights.lights().len()).filter(|i| lights.by_power().pdf(*i) > 0.0)
}

/// The shares that a pilot has: half by power, half evenly.
pub fn even(lights: &Lights) -> Arc<Discrete> {
    let mut shares: Vec<f64> =
        (0..lights.lights().len()).map(|i| 0.5 * f64::from(lights.by_power().pdf(i))).collect();
    let each = 0.5 / shining(lights).count() as f64;
    shining(lights).for_each(|i| shares[i] += each);
    Arc::new(exact(&shares))
}

/// The shares with the least product of error and cost, by the evidence of pilots that had the shares `had`, where merges are as
/// `counts` say. `None` where there is no evidence.
pub fn choose(scene: &Scene, pilots: &[Pilot], counts: &Counts, had: &Discrete) -> Option<Arc<Discrete>> {
    let evidence = Evidence::of_all(scene, pilots, counts);
    if evidence.is_empty() {
        return None;
    }
    let before: Vec<f64> = (0..had.len()).map(|i| f64::from(had.pdf(i))).collect();
    let (rest, costs) = costs(scene, pilots, counts, &before);
    let shares = descend(&terms(&evidence, counts), (rest, &costs), &before);
    let sure: Vec<f64> = shares.iter().zip(&before).map(|(q, p)| (1.0 - SURE) * q + SURE * p).collect();
    Some(Arc::new(exact(&sure)))
}

/// The shares with the least product of error and cost, which is C_0 and c_l of each light.
fn descend(terms: &[Term], (rest, costs): (f64, &[f64]), before: &[f64]) -> Vec<f64> {
    let mut shares = before.to_vec();
    for _ in 0..STEPS {
        let cost = rest + shares.iter().zip(costs).map(|(q, c)| q * c).sum::<f64>();
        let gains = gains(terms, before, &shares);
        let moved: Vec<f64> = shares
            .iter()
            .zip(gains.iter().zip(costs))
            .map(|(q, (gain, c))| q * (STEP * (gain - c / cost)).clamp(-1.0, 1.0).exp())
            .collect();
        let sum: f64 = moved.iter().sum();
        shares = moved.iter().map(|q| q / sum).collect();
    }
    shares
}

/// C_0, and c_l of each light: the mean over pilots that had the shares `before`.
fn costs(scene: &Scene, pilots: &[Pilot], counts: &Counts, before: &[f64]) -> (f64, Vec<f64>) {
    let each = 1.0 / pilots.len() as f64;
    let (mut rest, mut costs) = (0.0, vec![0.0; before.len()]);
    for pilot in pilots {
        let work = Work::of(pilot, counts);
        rest += each * work.cost_without_light(scene, counts);
        for ((sum, cost), p) in costs.iter_mut().zip(work.cost_of_lights(scene, pilot, counts)).zip(before) {
            *sum += if *p > 0.0 { each * cost / p } else { 0.0 };
        }
    }
    (rest, costs)
}

/// What a judged path adds to the errors, as far as no share is in it.
struct Term {
    light: usize,
    /// Whether its products grow with the light's share.
    grows: bool,
    /// A and B.
    density: [f64; 2],
    square: f64,
    products: f64,
    of: [f64; 2],
}

fn terms(evidence: &Evidence, counts: &Counts) -> Vec<Term> {
    let term = |judged: &Judged| {
        let Density { without, started, reached } = judged.density(counts);
        let [square, products] = judged.moment.terms(counts, reached);
        let (light, grows, of) = (judged.light, judged.started, judged.moment.of);
        Term { light, grows, density: [without, started], square, products, of }
    };
    evidence.judged.iter().map(term).collect()
}

/// −∂ log E / ∂q_l.
fn gains(terms: &[Term], before: &[f64], shares: &[f64]) -> Vec<f64> {
    let mut errors = [0.0; 2];
    let mut falls = vec![[0.0; 2]; shares.len()];
    for Term { light, grows, density: [without, started], square, products, of } in terms {
        let p = before[*light];
        if p <= 0.0 {
            continue;
        }
        let times = shares[*light] / p;
        let density = without + started * times;
        if density.is_nan() || density <= 0.0 {
            continue;
        }
        let (d2, d3) = (density * density, density * density * density);
        let (grown, growth) = if *grows { (times * times, 2.0 * times) } else { (1.0, 0.0) };
        let moment = square / density + products * grown / d2;
        let fall = (square * started / d2 + products * (2.0 * grown * started / d3 - growth / d2)) / p;
        for (kind, of) in of.iter().enumerate() {
            errors[kind] += of * moment;
            falls[*light][kind] += of * fall;
        }
    }
    let part = |fall: f64, error: f64| if error > 0.0 { fall / error } else { 0.0 };
    falls.iter().map(|fall| 0.5 * (part(fall[0], errors[0]) + part(fall[1], errors[1]))).collect()
}

/// Shares rounded to whole [`PARTS`]; what shines keeps one at least.
fn exact(shares: &[f64]) -> Discrete {
    let sum: f64 = shares.iter().sum();
    let round = |q: &f64| if *q > 0.0 { ((q / sum * f64::from(PARTS)).round() as u32).max(1) } else { 0 };
    let mut parts: Vec<u32> = shares.iter().map(round).collect();
    // What rounding left over or took too much is the largest's.
    let largest = (0..parts.len()).max_by_key(|i| parts[*i]).expect("a scene has a light");
    let others: u32 = parts.iter().enumerate().filter(|(i, _)| *i != largest).map(|(_, n)| n).sum();
    parts[largest] = PARTS - others;
    Discrete::new(parts.iter().map(|n| f64::from(*n))).expect("the largest has a share")
}

#[cfg(test)]
mod tests {
    use super::super::evidence::Point;
    use super::super::moments::{KINDS, Moment};
    use super::super::settings::MERGES;
    use super::*;

    /// A path that only light subpaths make, on light `light`, with this part of the second moment.
    fn judged(light: usize, square: f64) -> Judged {
        let moment = Moment { square, products: [0.0; KINDS], kind: 0, misses: None, of: [1.0; 2] };
        let mut points = vec![Point::NOTHING; 4];
        points[2].connection = 1.0;
        Judged { moment, light, started: true, joined: 2, points }
    }

    fn counts() -> Counts {
        Counts { merges: [1.0; MERGES.len()], continuations: Vec::new(), direct: true }
    }

    fn moved(evidence: &Evidence, costs: (f64, &[f64]), before: &[f64]) -> Vec<f64> {
        descend(&terms(evidence, &counts()), costs, before)
    }

    /// Without any other technique and with equal costs, shares go by the roots of the lights' own second moments, V_l = p_l m_l.
    #[test]
    fn shares_are_the_roots_of_second_moments() {
        let before = [0.5, 0.25, 0.25];
        let evidence = Evidence { judged: vec![judged(0, 0.2), judged(1, 3.2), judged(2, 0.4)] };
        let roots = [(0.5f64 * 0.2).sqrt(), (0.25f64 * 3.2).sqrt(), (0.25f64 * 0.4).sqrt()];
        let sum: f64 = roots.iter().sum();
        for (q, root) in moved(&evidence, (1.0, &[0.0; 3]), &before).iter().zip(roots) {
            assert!((q - root / sum).abs() < 1e-4, "{q} {}", root / sum);
        }
    }

    /// The product of error and cost is least where it is said to be, by trying shares about it.
    #[test]
    fn costs_count() {
        let before = [0.5, 0.5];
        let mut other = judged(1, 1.0);
        other.points[1].connection = 0.7;
        other.points[2].connection = 0.3;
        let evidence = Evidence { judged: vec![judged(0, 1.0), other] };
        let costs = [5.0, 0.5];
        let product = |q: f64| {
            let cost = 1.0 + costs[0] * q + costs[1] * (1.0 - q);
            (1.0 / (q / 0.5) + 1.0 / (0.7 + 0.3 * (1.0 - q) / 0.5)) * cost
        };
        let found = moved(&evidence, (1.0, &costs), &before)[0];
        let best =
            (1..1000).map(|i| f64::from(i) / 1000.0).min_by(|a, b| product(*a).total_cmp(&product(*b)));
        assert!((found - best.expect("some")).abs() < 2e-3, "{found} {best:?}");
        assert!((0.1..0.9).contains(&found));
    }

    #[test]
    fn shares_are_exact() {
        for shares in [vec![1.0], vec![0.3, 0.7], vec![1e-9, 1.0, 0.0], vec![1.0 / 3.0; 3]] {
            let exact = exact(&shares);
            let numbers: Vec<f32> = (0..shares.len()).map(|i| exact.pdf(i)).collect();
            assert_eq!(numbers.iter().map(|q| f64::from(*q)).sum::<f64>(), 1.0);
            let again = Discrete::new(numbers.iter().map(|q| f64::from(*q))).unwrap();
            assert_eq!(format!("{exact:?}").replace("4096.0", "1.0"), format!("{again:?}"));
            for (share, number) in shares.iter().zip(&numbers) {
                assert_eq!(*share > 0.0, *number > 0.0);
            }
        }
    }
}
