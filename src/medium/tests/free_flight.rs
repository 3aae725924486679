use super::medium;
use crate::math::Rgb;
use crate::math::testing::{assert_chi_square, assert_mean, stream};
use crate::medium::{Draw, Medium, Passage};
use glam::{DVec3, Vec2, Vec3A};

/// Media in sequence along the x axis, each as long as its number says; the last may be infinite.
struct Edge(Vec<(Medium, f32)>);

/// How a walk along an edge ends.
#[derive(Clone, Copy, Debug)]
enum End {
    /// A collision: its distance, the coefficients there, and what was crossed.
    Collision(f32, Rgb, Passage),
    /// The end of the edge.
    Through(Passage),
}

impl Edge {
    fn stretches(&self) -> impl Iterator<Item = (&Medium, f32, f32)> {
        let mut t = 0.0;
        self.0.iter().map(move |(medium, length)| {
            let t0 = t;
            t += length;
            (medium, t0, t)
        })
    }

    /// As a walk does it: stretch by stretch, with one draw for all of them.
    fn sample(&self, u: Vec2) -> End {
        let Draw { channel, mut depth } = Draw::new(u);
        let mut passage = Passage::CLEAR;
        for (medium, t0, t1) in self.stretches() {
            let optical_depth = |t1| medium.optical_depth(Vec3A::ZERO, Vec3A::X, t0, t1);
            if medium.scatters() {
                match medium.invert(Vec3A::ZERO, Vec3A::X, t0, t1, channel, depth) {
                    Ok(t) => {
                        let at = medium.coefficients(Vec3A::X * t);
                        return End::Collision(t, at.sigma_t, passage.then(optical_depth(t), true));
                    }
                    Err(left) => depth = left,
                }
            }
            passage = passage.then(optical_depth(t1), medium.scatters());
        }
        End::Through(passage)
    }

    /// Up to the distance `t`, from the definitions, in f64: transmittance and K.
    fn exact(&self, t: f64) -> (DVec3, DVec3) {
        let (mut depth, mut kappa) = (DVec3::ZERO, DVec3::ZERO);
        for (medium, t0, t1) in self.stretches() {
            let length = (f64::from(t1).min(t) - f64::from(t0)).max(0.0);
            let added = medium.coefficients(Vec3A::ZERO).sigma_t.as_dvec3() * length;
            depth += added;
            if medium.scatters() {
                kappa += added;
            }
        }
        ((-depth).exp(), (-kappa).exp())
    }

    /// The probability of a collision before `t`: one minus that of none.
    fn distribution(&self, t: f64) -> f64 {
        1.0 - self.exact(t).1.element_sum() / 3.0
    }

    fn reversed(&self) -> Self {
        Self(self.0.iter().rev().cloned().collect())
    }
}

/// Chromatic media, with channels without extinction, media that only absorb, and nothing at all, in sequence.
fn edges() -> Vec<Edge> {
    let absorbing = |sigma: [f32; 3]| medium(sigma, 0.0);
    vec![
        Edge(vec![(medium([0.1, 1.0, 10.0], 0.9), 3.0)]),
        Edge(vec![(medium([0.1, 1.0, 10.0], 0.9), f32::INFINITY)]),
        Edge(vec![(medium([0.0, 1.0, 10.0], 0.9), 2.0)]),
        Edge(vec![(medium([0.3; 3], 0.5), 1.0), (medium([0.1, 1.0, 10.0], 0.2), 0.7)]),
        Edge(vec![
            (medium([0.5, 0.25, 0.0], 1.0), 0.5),
            (absorbing([3.0, 0.1, 0.7]), 1.0),
            (medium([0.0; 3], 0.0), 0.25),
            (medium([0.2, 2.0, 0.9], 0.6), 1.5),
            (absorbing([0.0, 0.4, 9.0]), 0.5),
        ]),
        Edge(vec![(absorbing([0.1, 1.0, 10.0]), 1.0), (medium([4.0, 0.2, 1.0], 0.9), f32::INFINITY)]),
    ]
}

#[test]
fn distances_follow_the_density_at_the_end_of_the_passage() {
    for (i, edge) in edges().iter().enumerate() {
        let end = edge.0.iter().map(|(_, length)| f64::from(*length)).sum::<f64>().min(8.0);
        let (n, cells) = (400_000, 60);
        let mut counts = vec![0.0; cells + 1];
        let mut s = stream(200 + i as u64);
        for _ in 0..n {
            let cell = match edge.sample(s.next_2d()) {
                End::Collision(t, _, _) => ((f64::from(t) / end * cells as f64) as usize).min(cells),
                End::Through(_) => cells,
            };
            counts[cell] += 1.0;
        }
        let bounds: Vec<f64> =
            (0..=cells).map(|i| edge.distribution(end * i as f64 / cells as f64)).collect();
        let mut expected: Vec<f64> = bounds.windows(2).map(|b| (b[1] - b[0]) * f64::from(n)).collect();
        expected.push((1.0 - bounds[cells]) * f64::from(n));
        assert_chi_square(&format!("edge {i}"), &counts, &expected);
    }
}

/// A relative error that f32 can hold up to: an exponent of 20 has an error of 1e-6 by itself.
fn assert_close(found: f32, expected: f64, what: &str) {
    let error = (f64::from(found) - expected).abs();
    assert!(error <= 1e-5 * expected + 1e-30, "{what}: {found} for {expected}");
}

#[test]
fn densities_are_the_derivative_of_the_distribution_and_the_same_from_both_ends() {
    for (i, edge) in edges().iter().enumerate() {
        let mut s = stream(300 + i as u64);
        for _ in 0..2000 {
            match edge.sample(s.next_2d()) {
                End::Collision(t, rate, passage) => {
                    let (transmittance, survival) = edge.exact(f64::from(t));
                    let expected = survival.dot(rate.as_dvec3()) / 3.0;
                    assert_close(passage.density(rate), expected, "density of a collision");
                    for c in 0..3 {
                        assert_close(passage.transmittance[c], transmittance[c], "transmittance");
                    }
                    // The density is the derivative of the distribution that the histogram is checked against.
                    let h = 1e-5 * f64::from(t).max(1e-3);
                    let (before, after) = (f64::from(t) - h, f64::from(t) + h);
                    let bounds: Vec<f64> = edge.stretches().map(|(_, _, t1)| f64::from(t1)).collect();
                    if before > 0.0 && !bounds.iter().any(|b| (before..=after).contains(b)) {
                        let slope = (edge.distribution(after) - edge.distribution(before)) / (2.0 * h);
                        assert!((slope / expected - 1.0).abs() < 1e-4, "edge {i} at {t}: {slope} {expected}");
                    }
                }
                End::Through(passage) => {
                    let (_, survival) = edge.exact(f64::INFINITY);
                    assert_close(passage.density(Rgb::ONE), survival.element_sum() / 3.0, "getting through");
                }
            }
        }
        // Walked from the other end, and cut into more stretches, the edge is the same one.
        let through = |edge: &Edge| {
            edge.stretches().fold(Passage::CLEAR, |passage, (medium, t0, t1)| {
                let depth = medium.optical_depth(Vec3A::ZERO, Vec3A::X, t0, t1);
                passage.then(depth, medium.scatters())
            })
        };
        if edge.0.iter().all(|(_, length)| length.is_finite()) {
            let finer =
                Edge(edge.0.iter().flat_map(|(m, d)| [(m.clone(), 0.3 * d), (m.clone(), 0.7 * d)]).collect());
            let (there, back, finer) = (through(edge), through(&edge.reversed()), through(&finer));
            for rate in [Rgb::ONE, edge.0[0].0.coefficients(Vec3A::ZERO).sigma_t] {
                assert_close(back.density(rate), f64::from(there.density(rate)), "from the other end");
                assert_close(finer.density(rate), f64::from(there.density(rate)), "in more stretches");
            }
        }
    }
}

/// Of each channel: the light that collides, and the light that gets through, as a walk weights its one sample.
fn weights(edge: &Edge, u: Vec2) -> (Rgb, Rgb) {
    match edge.sample(u) {
        End::Collision(_, sigma_t, passage) => {
            (passage.transmittance * sigma_t / passage.density(sigma_t), Rgb::ZERO)
        }
        End::Through(passage) => (Rgb::ZERO, passage.transmittance / passage.density(Rgb::ONE)),
    }
}

#[test]
fn no_channel_is_lost_and_no_weight_exceeds_three() {
    // In media that scatter all that collides with is 1 − Tr; of the light that media only absorb nothing is sampled.
    for (i, edge) in edges().iter().enumerate() {
        let all_scatter = edge.0.iter().all(|(medium, _)| medium.scatters());
        let (transmittance, _) = edge.exact(f64::INFINITY);
        for channel in 0..3 {
            let mut s = stream(400 + i as u64);
            for _ in 0..10_000 {
                let (collided, passed) = weights(edge, s.next_2d());
                assert!(collided.max_element() <= 3.0 + 1e-5 && passed.max_element() <= 3.0 + 1e-5);
                assert!(collided.is_finite() && passed.is_finite());
            }
            let name = format!("edge {i}, channel {channel}");
            // Below a hundredth, a relative error of 1% takes more samples than a test should.
            if transmittance[channel] > 0.01 {
                assert_mean(&format!("{name}: through"), transmittance[channel], 800_000, |s| {
                    f64::from(weights(edge, s.next_2d()).1[channel])
                });
            }
            if all_scatter && transmittance[channel] < 0.99 {
                assert_mean(&format!("{name}: collisions"), 1.0 - transmittance[channel], 800_000, |s| {
                    f64::from(weights(edge, s.next_2d()).0[channel])
                });
            }
        }
    }
}

#[test]
fn extreme_media_give_numbers() {
    let extremes = [0.0, 1e-8, 1.0, 1e6];
    let mut s = stream(500);
    let mut collisions = 0;
    for red in extremes {
        for green in extremes {
            for blue in extremes {
                for length in [0.0, 1e-6, 1.0, 1e4, f32::INFINITY] {
                    let first = medium([red, green, blue], 0.5);
                    let mut edge = Edge(vec![(first, length)]);
                    if length.is_finite() {
                        edge.0.push((medium([green, blue, red], 0.9), 1.0));
                    }
                    for _ in 0..200 {
                        let (collided, passed) = weights(&edge, s.next_2d());
                        let sum = collided + passed;
                        assert!(
                            sum.is_finite() && sum.max_element() <= 3.0 + 1e-5 && sum.min_element() >= 0.0
                        );
                        assert!(sum.max_element() > 0.0, "a sample that carries nothing in any channel");
                        collisions += usize::from(collided != Rgb::ZERO);
                    }
                }
            }
        }
    }
    assert!(collisions > 10_000, "{collisions}");
}

#[test]
fn draws_are_exponential_and_the_channels_as_frequent() {
    let mut s = stream(501);
    let (n, cells) = (300_000, 32);
    let mut counts = vec![0.0; 3 * cells];
    for _ in 0..n {
        let Draw { channel, depth } = Draw::new(s.next_2d());
        let cell = ((1.0 - (-f64::from(depth)).exp()) * cells as f64) as usize;
        counts[channel * cells + cell] += 1.0;
    }
    assert_chi_square("draws", &counts, &vec![f64::from(n) / (3 * cells) as f64; 3 * cells]);
    let last = 1.0 - 0.5f32.powi(24);
    for (x, channel) in [(0.0, 0), (last, 2)] {
        let [near, far] = [0.0, last].map(|y| Draw::new(Vec2::new(x, y)));
        assert_eq!((near.channel, far.channel), (channel, channel));
        assert!(
            near.depth > 0.0 && near.depth < 1e-7 && far.depth > 17.0 && far.depth < 18.0,
            "{near:?} {far:?}"
        );
    }
    // The mean of all depths that there are is 1, to the width of a step.
    let steps = 1 << 20;
    let mean =
        (0..steps).map(|i| f64::from(Draw::new(Vec2::new(0.5, i as f32 / steps as f32)).depth)).sum::<f64>();
    let mean = mean / f64::from(steps);
    assert!((mean - 1.0).abs() < 1e-4, "{mean}");
}
