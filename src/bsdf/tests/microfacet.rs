//! Fresnel, the distributions of normals and the rough materials against the textbook, in double precision.

use super::table::*;
use crate::bsdf::NormalDistribution::{Beckmann as BECKMANN, Ggx as GGX};
use crate::bsdf::*;
use crate::math::Rgb;
use glam::{DVec3, Vec3A};
use statrs::function::erf::erfc;
use std::f64::consts::PI;

/// (re, im) arithmetic, as far as Fresnel needs it.
#[derive(Clone, Copy)]
struct Complex(f64, f64);

impl Complex {
    fn times(self, o: Self) -> Self {
        Self(self.0 * o.0 - self.1 * o.1, self.0 * o.1 + self.1 * o.0)
    }

    fn plus(self, o: Self) -> Self {
        Self(self.0 + o.0, self.1 + o.1)
    }

    fn norm2(self) -> f64 {
        self.0 * self.0 + self.1 * self.1
    }

    fn over(self, o: Self) -> Self {
        let n = o.norm2();
        self.times(Self(o.0 / n, -o.1 / n))
    }

    fn sqrt(self) -> Self {
        let r = self.norm2().sqrt();
        let re = (0.5 * (r + self.0)).max(0.0).sqrt();
        let im = (0.5 * (r - self.0)).max(0.0).sqrt();
        Self(re, if self.1 < 0.0 { -im } else { im })
    }
}

/// Fresnel's amplitudes with the complex index η + ik, squared and averaged.
fn fresnel_textbook(cos: f64, eta: f64, k: f64) -> f64 {
    let index = Complex(eta, k);
    let sin_t = Complex((1.0 - cos * cos).sqrt(), 0.0).over(index);
    let sin2_t = sin_t.times(sin_t);
    let cos_t = Complex(1.0 - sin2_t.0, -sin2_t.1).sqrt();
    let minus = |c: Complex| Complex(-c.0, -c.1);
    let (near, far) = (Complex(cos, 0.0), index.times(cos_t));
    let s = near.plus(minus(far)).over(near.plus(far));
    let (near, far) = (index.times(Complex(cos, 0.0)), cos_t);
    let p = near.plus(minus(far)).over(near.plus(far));
    0.5 * (s.norm2() + p.norm2())
}

#[test]
fn fresnel_agrees_with_complex_arithmetic() {
    for i in 1..=200 {
        let cos = i as f32 / 200.0;
        for (eta, k) in [(0.2, 3.9), (1.4, 7.5), (3.0, 3.0), (1.0, 0.0), (1.5, 0.0), (0.05, 0.4)] {
            let ours = fresnel::conductor(cos, Rgb::splat(eta), Rgb::splat(k)).x;
            let theirs = fresnel_textbook(cos.into(), eta.into(), k.into());
            assert!((f64::from(ours) - theirs).abs() < 2e-5, "η {eta}, k {k}, cos {cos}: {ours} {theirs}");
        }
        for eta in [0.5, 0.66, 1.0, 1.001, 1.5, 2.5] {
            let ours = fresnel::dielectric(cos, eta);
            let sin2 = (1.0 - f64::from(cos).powi(2)) / f64::from(eta).powi(2);
            let theirs = if sin2 >= 1.0 { 1.0 } else { fresnel_textbook(cos.into(), eta.into(), 0.0) };
            assert!(
                (f64::from(ours.reflectance) - theirs).abs() < 2e-5,
                "η {eta}, cos {cos}: {ours:?} {theirs}"
            );
            assert!((f64::from(ours.cos) - (1.0 - sin2).max(0.0).sqrt()).abs() < 1e-5);
            assert!((ours.reflectance + ours.transmittance - 1.0).abs() < 1e-6);
            // The same from both ends.
            if ours.cos > 0.05 && cos > 0.05 {
                let back = fresnel::dielectric(ours.cos, 1.0 / eta);
                assert!((back.reflectance - ours.reflectance).abs() < 1e-4 && (back.cos - cos).abs() < 1e-5);
            }
        }
    }
}

#[test]
fn fresnel_has_no_gap_at_grazing_incidence() {
    for cos in [0.0, 1e-30, 1e-10, 1e-6] {
        assert_eq!(fresnel::dielectric(cos, 1.0).reflectance, 0.0);
        assert!(fresnel::dielectric(cos, 1.5).reflectance > 0.999_9);
        assert_eq!(fresnel::dielectric(cos, 0.7).reflectance, 1.0);
        assert!(fresnel::conductor(cos, Rgb::ONE, Rgb::ZERO).is_finite());
        assert!(fresnel::conductor(cos, Rgb::splat(0.2), Rgb::splat(3.0)).min_element() > 0.999);
    }
}

fn double(w: Vec3A) -> DVec3 {
    w.as_dvec3()
}

/// D by tan θ [Walter et al. 2007 (33), (25)].
fn d_textbook(m: DVec3, (normals, alpha): Surface) -> f64 {
    let cos2 = m.z * m.z;
    let tan2 = (1.0 - cos2) / cos2;
    match normals {
        GGX => alpha.powi(2) / (PI * cos2 * cos2 * (alpha.powi(2) + tan2).powi(2)),
        BECKMANN => (-tan2 / alpha.powi(2)).exp() / (PI * alpha.powi(2) * cos2 * cos2),
    }
}

/// Λ by tan θ [Heitz 2014 (72), (66)].
fn lambda_textbook(w: DVec3, (normals, alpha): Surface) -> f64 {
    let tan2 = (1.0 - w.z * w.z) / (w.z * w.z);
    match normals {
        GGX => 0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0),
        BECKMANN => {
            let a = 1.0 / (alpha * tan2.sqrt());
            0.5 * ((-a * a).exp() / (a * PI.sqrt()) - erfc(a))
        }
    }
}

/// A distribution and its α.
type Surface = (NormalDistribution, f64);

fn g1_textbook(w: DVec3, surface: Surface) -> f64 {
    1.0 / (1.0 + lambda_textbook(w, surface))
}

/// Reflection [Walter et al. 2007 (20)] with height-correlated masking, without Fresnel.
fn reflection_textbook(i: DVec3, o: DVec3, surface: Surface) -> f64 {
    let m = (i + o).normalize();
    let g = 1.0 / (1.0 + lambda_textbook(i, surface) + lambda_textbook(o, surface));
    d_textbook(m, surface) * g / (4.0 * i.z.abs() * o.z.abs())
}

/// Transmission [Walter et al. 2007 (21)], indices of each side given: light arrives along i and leaves along o.
fn transmission_textbook(i: DVec3, o: DVec3, eta_i: f64, eta_o: f64, surface: Surface) -> f64 {
    let m = -(eta_i * i + eta_o * o).normalize();
    let m = if m.z < 0.0 { -m } else { m };
    if i.dot(m) * i.z <= 0.0 || o.dot(m) * o.z <= 0.0 {
        return 0.0;
    }
    let f = fresnel_textbook(i.dot(m).abs(), eta_o / eta_i, 0.0);
    let g = g1_textbook(i, surface) * g1_textbook(o, surface);
    let denominator = eta_i * i.dot(m) + eta_o * o.dot(m);
    (i.dot(m) * o.dot(m)).abs() / (i.z * o.z).abs() * eta_o * eta_o * (1.0 - f) * g * d_textbook(m, surface)
        / (denominator * denominator)
}

/// Whether two values of one lobe agree to `relative`, or are both next to nothing: Beckmann's tail is.
fn agree(ours: f64, theirs: f64, relative: f64) -> bool {
    (ours - theirs).abs() <= relative * theirs + 1e-9
}

#[test]
fn rough_conductors_are_the_textbooks() {
    for (normals, alpha) in
        [(GGX, 0.05), (GGX, 0.3), (GGX, 1.0), (BECKMANN, 0.1), (BECKMANN, 0.3), (BECKMANN, 1.0)]
    {
        let bare = Conductor::without_fresnel(alpha, grey(1.0)).unwrap().with_distribution(normals);
        let bare = Material::Conductor(bare);
        let gold = Conductor::metal("gold", alpha, grey(1.0)).unwrap().with_distribution(normals);
        let gold = Material::Conductor(gold);
        let au = metals::find("gold").unwrap();
        let mut s = stream(11);
        let mut seen = 0;
        for _ in 0..5000 {
            let upper = |w: Vec3A| Vec3A::new(w.x, w.y, w.z.abs());
            let (i, o) = (upper(any_direction(&mut s)), upper(any_direction(&mut s)));
            let theirs = reflection_textbook(double(i), double(o), (normals, f64::from(alpha)));
            let ours = f64::from(bare.evaluate(UV, i, o).f.x);
            assert!(agree(ours, theirs, 2e-3), "{normals:?} α {alpha}, {i} {o}: {ours} {theirs}");
            let cos = double(i).dot((double(i) + double(o)).normalize());
            let green = theirs * fresnel_textbook(cos, au.eta.y.into(), au.k.y.into());
            assert!(agree(f64::from(gold.evaluate(UV, i, o).f.y), green, 2e-3));
            seen += u32::from(theirs > 1e-6);
        }
        assert!(seen > 500, "{normals:?} α {alpha}: {seen}");
    }
}

#[test]
fn rough_glass_is_the_textbooks() {
    let surfaces = [(1.5, 1.0, 0.1), (1.5, 1.0, 0.7), (1.0, 1.33, 0.4), (1.6, 1.2, 1.0)];
    for ((int, ext, alpha), normals) in surfaces.into_iter().flat_map(|s| [(s, GGX), (s, BECKMANN)]) {
        let glass = Dielectric::new(int, ext, alpha, grey(1.0), grey(1.0)).unwrap();
        let glass = Material::Dielectric(glass.with_distribution(normals));
        let surface = (normals, f64::from(alpha));
        let mut s = stream(12);
        let mut through = 0;
        for _ in 0..40_000 {
            let (i, o) = (any_direction(&mut s), any_direction(&mut s));
            let side = |w: Vec3A| f64::from(if w.z > 0.0 { ext } else { int });
            let (id, od) = (double(i).normalize(), double(o).normalize());
            let theirs = if i.z * o.z > 0.0 {
                let cos = id.dot((id + od).normalize()).abs();
                let across = if i.z > 0.0 { int / ext } else { ext / int };
                let sin2 = (1.0 - cos * cos) / f64::from(across).powi(2);
                let f = if sin2 >= 1.0 { 1.0 } else { fresnel_textbook(cos, across.into(), 0.0) };
                f * reflection_textbook(id, od, surface)
            } else {
                transmission_textbook(id, od, side(i), side(o), surface)
            };
            let ours = f64::from(glass.evaluate(UV, i, o).f.x);
            assert!(
                (ours - theirs).abs() <= 3e-3 * theirs + 1e-6,
                "{normals:?} {int}/{ext} α {alpha}, {i} {o}: {ours} {theirs}"
            );
            through += u32::from(theirs > 1e-3 && i.z * o.z < 0.0);
        }
        // Beckmann's lobe has next to nothing beside it.
        assert!(through > 200, "{normals:?} α {alpha}: {through}");
    }
}

/// Midpoint rule over the upper hemisphere in √(1 − cos θ) and φ, which resolves narrow lobes about the normal.
fn hemisphere(f: impl Fn(Vec3A) -> f32) -> f64 {
    let (n, m) = (2000, 64);
    let mut sum = 0.0;
    for i in 0..n {
        let x = (i as f32 + 0.5) / n as f32;
        let one_minus = x.powi(6);
        let sin = (one_minus * (2.0 - one_minus)).sqrt();
        for j in 0..m {
            let phi = (j as f32 + 0.5) / m as f32 * std::f32::consts::TAU;
            let w = Vec3A::new(sin * phi.cos(), sin * phi.sin(), 1.0 - one_minus);
            sum += f64::from(f(w)) * f64::from(6.0 * x.powi(5)) / f64::from(n) * 2.0 * PI / f64::from(m);
        }
    }
    sum
}

fn normals_are_normalised(facets: &impl Microfacets, what: &str) {
    let projected = hemisphere(|m| facets.d(m) * m.z);
    assert!((projected - 1.0).abs() < 2e-3, "{what}: {projected}");
    for cos in [1.0, 0.7, 0.2] {
        let w = direction(cos, 0.5);
        let visible = hemisphere(|m| if w.dot(m) > 0.0 { facets.visible_pdf(w, m) } else { 0.0 });
        assert!((visible - 1.0).abs() < 3e-3, "{what}, cos {cos}: {visible}");
    }
}

#[test]
fn normals_are_normalised_and_so_are_the_visible_ones() {
    for alpha in [0.001, 0.01, 0.1, 0.5, 1.0] {
        normals_are_normalised(&Ggx::new(alpha, Masking::Correlated), &format!("GGX α {alpha}"));
        normals_are_normalised(&Beckmann::new(alpha, Masking::Correlated), &format!("Beckmann α {alpha}"));
    }
}

fn visible_normals_face(facets: &impl Microfacets) {
    let mut s = stream(13);
    for cos in [1.0, 0.9, 0.1, 1e-3, 1e-7] {
        let w = direction(cos, 0.4);
        for _ in 0..500 {
            let m = facets.sample_visible(w, s.next_2d());
            assert!(m.z > 0.0 && w.dot(m) > -1e-6 && (m.length() - 1.0).abs() < 1e-5, "{w} {m}");
        }
    }
}

#[test]
fn visible_normals_face_the_direction() {
    for alpha in [0.001, 0.03, 0.5, 1.0] {
        visible_normals_face(&Ggx::new(alpha, Masking::Correlated));
        visible_normals_face(&Beckmann::new(alpha, Masking::Correlated));
    }
}

#[test]
fn what_is_sampled_of_a_rough_metal_is_its_integral() {
    // The share of light that is reflected, by quadrature of f cos θ and by the weights of samples.
    for (i, normals) in [GGX, BECKMANN].into_iter().enumerate() {
        for (j, masking) in [Masking::Correlated, Masking::Separable].into_iter().enumerate() {
            for (k, (alpha, cos)) in [(0.2, 0.9), (0.5, 0.3), (1.0, 0.6), (1.0, 0.1)].into_iter().enumerate()
            {
                let metal = Conductor::metal("copper", alpha, grey(1.0)).unwrap();
                let metal = Material::Conductor(metal.with_distribution(normals).with_masking(masking));
                let from = direction(cos, 1.0);
                let integral = hemisphere(|to| metal.evaluate(UV, from, to).f.y * to.z);
                let mut s = stream((3000 + 100 * i + 10 * j + k) as u64);
                let n = 400_000;
                let weight = |u| metal.sample(UV, from, Mode::Importance, u).map_or(0.0, |b| b.weight.y);
                let mean = (0..n).map(|_| f64::from(weight((0.0, s.next_2d())))).sum::<f64>() / f64::from(n);
                // Weights are from 0 to 1: a standard error is at most 8e-4, and mostly a quarter of it.
                assert!(
                    (mean - integral).abs() < 2e-3,
                    "{normals:?} {masking:?} {alpha} {cos}: {mean} {integral}"
                );
            }
        }
    }
}

#[test]
fn a_tiny_roughness_is_smooth_and_a_small_one_nearly() {
    assert!(!metal("Ag", 0.000_9).has_smooth() && metal("Ag", 0.001).has_smooth());
    assert!(!beckmann(metal("Ag", 0.000_9)).has_smooth() && beckmann(metal("Ag", 0.001)).has_smooth());
    // What little roughness does to the direction is of the order of α.
    let from = direction(0.6, 0.1);
    let mut s = stream(14);
    let mut far = 0;
    for _ in 0..1000 {
        let b = metal("Ag", 0.001).sample(UV, from, Mode::Radiance, (0.5, s.next_2d())).unwrap();
        far += u32::from((b.to - reflect_z(from)).length() > 0.01);
        let single = fresnel::conductor(0.6, Rgb::splat(0.058), Rgb::splat(4.106)).x;
        assert!((b.weight.x - single).abs() < 0.01, "{}", b.weight);
    }
    assert!(far < 100, "{far}");
}

#[test]
fn separable_masking_is_darker() {
    for normals in [GGX, BECKMANN] {
        let correlated = Conductor::without_fresnel(0.5, grey(1.0)).unwrap().with_distribution(normals);
        let separable = Material::Conductor(correlated.clone().with_masking(Masking::Separable));
        let correlated = Material::Conductor(correlated);
        let (i, o) = (direction(0.3, 0.0), direction(0.2, 2.0));
        let (a, b) = (correlated.evaluate(UV, i, o), separable.evaluate(UV, i, o));
        let [la, lb] = [i, o].map(|w| lambda_textbook(double(w), (normals, 0.5)));
        let ratio = (1.0 + la + lb) / ((1.0 + la) * (1.0 + lb));
        assert!((f64::from(b.f.x / a.f.x) - ratio).abs() < 1e-4 && ratio < 0.99, "{normals:?} {ratio}");
        assert_eq!((a.pdf_lc, a.pdf_cl), (b.pdf_lc, b.pdf_cl));
    }
}
