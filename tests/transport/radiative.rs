//! Plane layers by other means than random walks: H functions by iteration, and layers of any thickness by doubling. In f64,
//! from the definitions, and tested against each other and against Chandrasekhar's tables.

use std::f64::consts::PI;

/// Directions of a hemisphere in which light is followed.
const NODES: usize = 24;
/// Terms of the phase function's Legendre series; 0.7^48 is 4e-8.
const TERMS: usize = 48;
/// The first layer is 2^-SPLITS of the whole.
const SPLITS: u32 = 24;

/// Gauss's nodes and weights on 0..1.
pub fn gauss(n: usize) -> Vec<(f64, f64)> {
    let rule = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        loop {
            let (p, derivative) = legendre(n, x);
            let step = p / derivative;
            x -= step;
            if step.abs() < 1e-15 {
                let derivative = legendre(n, x).1;
                return (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * derivative * derivative));
            }
        }
    };
    (0..n).map(rule).collect()
}

/// P_n and its derivative.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut now) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (before, now) = (now, ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k);
    }
    (now, n as f64 * (x * now - before) / (x * x - 1.0))
}

/// Chandrasekhar's H function of isotropic scattering with the albedo `albedo` below 1, at the cosine `mu`:
/// 1/H = √(1 − ϖ) + ϖ/2 ∫ μ' H(μ')/(μ + μ') dμ' [Chandrasekhar 1960, V].
pub fn chandrasekhar_h(albedo: f64, mu: f64) -> f64 {
    let nodes = gauss(64);
    let reciprocal = |mu: f64, h: &[f64]| {
        let sum: f64 = nodes.iter().zip(h).map(|((x, w), h)| w * x * h / (mu + x)).sum();
        (1.0 - albedo).sqrt() + 0.5 * albedo * sum
    };
    let mut h = vec![1.0; nodes.len()];
    for _ in 0..200 {
        // Means of successive steps, which lie on either side of the solution.
        h = nodes.iter().zip(&h).map(|((x, _), before)| 0.5 * (before + 1.0 / reciprocal(*x, &h))).collect();
    }
    1.0 / reciprocal(mu, &h)
}

/// A square matrix of reflections or transmissions: row the outgoing, column the incoming direction.
type Matrix = Vec<Vec<f64>>;

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let n = a.len();
    (0..n).map(|i| (0..n).map(|j| (0..n).map(|k| a[i][k] * b[k][j]).sum()).collect()).collect()
}

/// (1 − a)⁻¹ b by Gauss's elimination; the row sums of `a` are below 1.
fn solve(a: &Matrix, b: &Matrix) -> Matrix {
    let n = a.len();
    let mut rows: Matrix = (0..n)
        .map(|i| (0..n).map(|j| f64::from(u8::from(i == j)) - a[i][j]).chain(b[i].iter().copied()).collect())
        .collect();
    for k in 0..n {
        let pivot = (k..n).max_by(|i, j| rows[*i][k].abs().total_cmp(&rows[*j][k].abs())).expect("rows");
        rows.swap(k, pivot);
        let row: Vec<f64> = rows[k].iter().map(|v| v / rows[k][k]).collect();
        for (i, other) in rows.iter_mut().enumerate() {
            let factor = other[k];
            if i != k {
                other.iter_mut().zip(&row).for_each(|(v, r)| *v -= factor * r);
            }
        }
        rows[k] = row;
    }
    rows.into_iter().map(|row| row[n..].to_vec()).collect()
}

/// What a plane layer does to light of radiance 1 from all directions of one side.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    /// Radiance that is reflected into the direction asked for.
    pub reflected: f64,
    /// Radiance that is transmitted, what is not scattered with it.
    pub transmitted: f64,
}

/// A layer of the optical thickness `thickness`, the albedo `albedo` and Henyey's and Greenstein's phase function of the mean
/// cosine `g`, seen at the cosine `mu`: the adding method, doubled from a layer so thin that it scatters once [van de Hulst
/// 1980, 4]. The direction asked for is a node without a weight.
pub fn layer(thickness: f64, albedo: f64, g: f64, mu: f64) -> Layer {
    let mut nodes = gauss(NODES);
    nodes.push((mu, 0.0));
    let n = nodes.len();
    // The phase function's mean over the azimuth, times 4π, normalised for each incoming direction so that no light is lost
    // to the quadrature.
    let series: Vec<Vec<f64>> = nodes
        .iter()
        .map(|(x, _)| (0..TERMS).map(|l| if l == 0 { 1.0 } else { legendre(l, *x).0 }).collect())
        .collect();
    let mean = |i: usize, j: usize, sign: f64| -> f64 {
        (0..TERMS)
            .map(|l| (2 * l + 1) as f64 * (g * sign).powi(l as i32) * series[i][l] * series[j][l])
            .map(|v| if v.is_finite() { v } else { 0.0 })
            .sum()
    };
    let thin = thickness * 0.5f64.powi(SPLITS as i32);
    let scattered =
        |i: usize, j: usize, sign: f64| 0.5 * albedo * thin / nodes[i].0 * mean(i, j, sign) * nodes[j].1;
    let mut r: Matrix = (0..n).map(|i| (0..n).map(|j| scattered(i, j, -1.0)).collect()).collect();
    let mut t: Matrix = (0..n).map(|i| (0..n).map(|j| scattered(i, j, 1.0)).collect()).collect();
    for (i, row) in t.iter_mut().enumerate() {
        row[i] += 1.0 - thin / nodes[i].0;
    }
    for _ in 0..SPLITS {
        let back = product(&r, &r);
        let (up, down) = (solve(&back, &product(&r, &t)), solve(&back, &t));
        r = r
            .iter()
            .zip(product(&t, &up))
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + b).collect())
            .collect();
        t = product(&t, &down);
    }
    Layer { reflected: r[n - 1].iter().sum(), transmitted: t[n - 1].iter().sum() }
}

/// What is known from elsewhere: H(1) of the conservative half-space is 2.9078 [Chandrasekhar 1960, table XI]; a half-space
/// reflects 1 − √(1 − ϖ) H(μ) of even light; a
/// conservative layer loses nothing; a black one is Beer's and Lambert's.
#[test]
fn the_methods_agree() {
    // ϖ = 1 is approached as √(1 − ϖ).
    assert!((chandrasekhar_h(1.0 - 1e-9, 1.0) - 2.9078).abs() < 5e-4);
    for albedo in [0.5, 0.9] {
        for mu in [0.2, 0.6, 1.0] {
            let even = 1.0 - (1.0f64 - albedo).sqrt() * chandrasekhar_h(albedo, mu);
            let thick = layer(60.0, albedo, 0.0, mu);
            assert!((thick.reflected - even).abs() < 2e-5, "{albedo} {mu}: {thick:?}, {even}");
        }
    }
    for g in [0.0, 0.7, -0.5] {
        let Layer { reflected, transmitted } = layer(2.0, 1.0, g, 0.7);
        assert!((reflected + transmitted - 1.0).abs() < 1e-4, "{g}: {reflected} {transmitted}");
    }
    assert!((layer(1.5, 0.0, 0.0, 0.5).transmitted - (-3f64).exp()).abs() < 1e-6);
}
