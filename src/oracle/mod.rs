//! The oracle (transport.md, 5): every technique that could have made a whole path, with its density, from the
//! definitions and by loops over the path, in f64.
//!
//! It judges the renderer in the tests, explains single paths to people ([`crate::explain`]), and tells the pilot that chooses radii and
//! counts who else could have made a path ([`crate::transport::merge::evidence`]); no iteration of a render runs it. It shares the evaluations of BSDFs, phase functions, media, lights and the camera with the renderer, and none of the
//! weight code. Which media an edge crosses it finds out from points on the edge, where the renderer counts crossings.

// Formulas keep the indices that they have on paper.
#![allow(clippy::needless_range_loop)]

pub mod collect;

use crate::bsdf::{Mode, Site};
use crate::geometry::{Ray, SurfacePoint, offset_origin};
use crate::light::LightPoint;
use crate::math::Frame;
use crate::medium::Medium;
use crate::scene::{Collision, Scene};
use crate::transport::Technique;
use crate::transport::merge::{Beams, MERGES};
use crate::transport::pass::Pass;
use crate::transport::walk::Place;
use glam::{DVec3, Vec2, Vec3A};
use std::f64::consts::PI;

/// A whole path: x_0 on a light, `interior` between, the last vertex on the lens.
#[derive(Clone, Debug)]
pub struct FullPath {
    /// x_0.
    pub light: LightPoint,
    /// x_1 … x_{k-1}.
    pub interior: Vec<Place>,
    /// x_k.
    pub lens: Vec3A,
    /// Where the subpaths were merged: i, and x_i on the light subpath. `interior` has the one on the camera subpath.
    pub merged: Option<(usize, Place)>,
}

/// Which of a path's techniques.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MadeBy {
    /// The connection with so many light vertices.
    Connection(usize),
    /// A merge at this vertex.
    Merge(Technique, usize),
}

/// What the oracle says of a path.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The path's contribution to its pixel, RGB, without 1/pixels.
    pub contribution: DVec3,
    /// M_i,v of each merge that is on and possible, with its vertex.
    pub merges: Vec<(Technique, usize, f64)>,
    /// p_i, i = 0 … k.
    pub p: Vec<f64>,
    /// r_i.
    pub r: Vec<f64>,
    /// c_i, i = 0 … k; 0 where the technique is off or impossible.
    pub c: Vec<f64>,
}

impl Verdict {
    /// Density of a technique, times its number of samples.
    pub fn density(&self, made_by: MadeBy) -> f64 {
        self.log_density(made_by).exp()
    }

    /// Its logarithm, as the densities of long paths in dense media are more than an f64 holds; -∞ where there is none.
    pub fn log_density(&self, made_by: MadeBy) -> f64 {
        let log = |x: &f64| x.ln();
        let (own, light, camera) = match made_by {
            MadeBy::Connection(s) => (self.c[s], &self.p[..s], &self.r[s..]),
            MadeBy::Merge(technique, i) => {
                let found = self.merges.iter().find(|(t, vertex, _)| (*t, *vertex) == (technique, i));
                (found.map_or(0.0, |(_, _, m)| *m), &self.p[..=i], &self.r[i..])
            }
        };
        if own == 0.0 {
            return f64::NEG_INFINITY;
        }
        own.ln() + light.iter().chain(camera).map(log).sum::<f64>()
    }

    /// All techniques that are on, possible or not.
    pub fn techniques(&self) -> impl Iterator<Item = MadeBy> + '_ {
        let merges = self.merges.iter().map(|(t, i, _)| MadeBy::Merge(*t, *i));
        (0..self.c.len()).map(MadeBy::Connection).chain(merges)
    }

    /// The weight of a technique under the power heuristic with exponent `beta`.
    pub fn weight(&self, made_by: MadeBy, beta: f64) -> f64 {
        let largest = self.techniques().map(|t| self.log_density(t)).fold(f64::NEG_INFINITY, f64::max);
        let power = |t: MadeBy| (beta * (self.log_density(t) - largest)).exp();
        power(made_by) / self.techniques().map(power).sum::<f64>()
    }
}

/// One interior vertex as the two subpaths see it.
#[derive(Clone, Copy, Debug)]
struct Interior {
    specular: bool,
    /// Density with which a light subpath goes on toward the camera's side, and the other way round, with
    /// continuation. At a specular vertex both are relative to the same Dirac.
    light: f64,
    camera: f64,
    /// f · |wl·ns| / |wl·ng|, or σ_s · phase; at a specular vertex, the Dirac's coefficient such that times |wc·ng| and over `light`
    /// it is what the light subpath's throughput is multiplied by.
    value: DVec3,
}

fn d(v: Vec3A) -> DVec3 {
    v.as_dvec3()
}

impl FullPath {
    /// The interior vertices of a path through no medium.
    pub fn surfaces(&self) -> Vec<SurfacePoint> {
        self.interior.iter().map(|place| *place.surface().expect("no medium")).collect()
    }

    fn segments(&self) -> usize {
        self.interior.len() + 1
    }

    /// Unit direction from x_i to x_{i+1}.
    fn direction(&self, scene: &Scene, i: usize) -> DVec3 {
        if i == 0 && scene.lights.is_infinite(&self.light) {
            return -d(self.light.n);
        }
        (self.position(i + 1, i) - self.position(i, i)).normalize()
    }

    /// Interior vertex i, as the end of the edge x_edge … x_{edge+1}.
    fn place(&self, i: usize, edge: usize) -> Option<&Place> {
        match &self.merged {
            Some((merged, light)) if *merged == i && edge + 1 == i => Some(light),
            _ => i.checked_sub(1).and_then(|i| self.interior.get(i)),
        }
    }

    fn position(&self, i: usize, edge: usize) -> DVec3 {
        match self.place(i, edge) {
            Some(place) => d(place.position()),
            None if i == 0 => d(self.light.p),
            None => d(self.lens),
        }
    }

    /// 1/d² of the edge x_i … x_{i+1}; 1 where x_0 is infinitely far away.
    fn falloff(&self, scene: &Scene, i: usize) -> f64 {
        if i == 0 && scene.lights.is_infinite(&self.light) {
            1.0
        } else {
            1.0 / self.position(i, i).distance_squared(self.position(i + 1, i))
        }
    }

    /// D of vertex i along the edge that it is an end of.
    fn cosine(&self, scene: &Scene, i: usize, edge: usize) -> f64 {
        let w = self.direction(scene, edge);
        match self.place(i, edge) {
            Some(Place::Surface(point)) => d(point.ng).dot(w).abs(),
            Some(Place::Medium(_)) => 1.0,
            None if i == 0 => f64::from(scene.lights.cos_at_light(&self.light, w.as_vec3a())),
            None => 1.0,
        }
    }

    /// σ_t of vertex i in a medium, as light along the edge finds it; 1 of any other.
    fn rate(&self, scene: &Scene, i: usize, edge: usize) -> DVec3 {
        match self.place(i, edge) {
            Some(Place::Medium(collision)) => {
                let medium = &scene.media[collision.medium as usize];
                d(collision.coefficients.sigma_t) * seen(medium, self.direction(scene, edge))
            }
            _ => DVec3::ONE,
        }
    }

    /// The optical depth of the edge x_i … x_{i+1}, and the part of it in media that scatter and are not tracked.
    fn depths(&self, scene: &Scene, pass: &Pass, i: usize) -> (DVec3, DVec3) {
        let infinite = i == 0 && scene.lights.is_infinite(&self.light);
        // From x_{i+1} to x_i.
        let dir = -self.direction(scene, i);
        let whole = self.position(i + 1, i);
        // What is before the camera's near plane is not there.
        let at_lens = self.place(i + 1, i).is_none();
        let skipped = if at_lens { f64::from(scene.camera.skipped(dir.as_vec3a())) } else { 0.0 };
        let start = whole + dir * skipped;
        let length = if infinite { f64::INFINITY } else { whole.distance(self.position(i, i)) - skipped };
        // Where boundaries cut it: whether they matter or not, the points between say what is there.
        let mut cuts = vec![0.0];
        let mut ray = match self.place(i + 1, i) {
            Some(place) => place.spawn(dir.as_vec3a()),
            None => Ray::new(start.as_vec3a(), dir.as_vec3a()),
        };
        while let Some(hit) = scene.geometry.boundary(&ray) {
            let t = (d(hit.point.p) - start).dot(dir);
            if t >= length {
                break;
            }
            cuts.push(t);
            ray = hit.point.spawn(ray.dir);
        }
        cuts.push(length);
        let (mut all, mut scattering) = (DVec3::ZERO, DVec3::ZERO);
        for cut in cuts.windows(2) {
            let middle = if cut[1].is_finite() { 0.5 * (cut[0] + cut[1]) } else { cut[0] + 1.0 };
            let point = (start + dir * middle).as_vec3a();
            let inside = scene.solids.at(&scene.geometry, point);
            let Some(medium) = scene.medium_within(&inside) else { continue };
            let depth = match medium {
                Medium::Homogeneous(_) => d(medium.coefficients(point).sigma_t) * (cut[1] - cut[0]),
                Medium::Varying(_) => quadrature(medium, start, dir, cut[0], cut[1]),
            };
            let depth = depth * seen(medium, dir);
            all += depth;
            if medium.scatters() && !pass.is_tracked(medium) {
                scattering += depth;
            }
        }
        (all, scattering)
    }

    fn interior(&self, scene: &Scene, pass: &Pass, i: usize, end: bool) -> Interior {
        let (wl, wc) = (-self.direction(scene, i - 1).as_vec3a(), self.direction(scene, i).as_vec3a());
        match &self.interior[i - 1] {
            Place::Surface(point) => on_surface(scene, point, wl, wc, end),
            Place::Medium(collision) => in_medium(scene, pass, collision, wl, wc),
        }
    }
}

/// What the coefficients of a medium are multiplied by for light along `w`.
fn seen(medium: &Medium, w: DVec3) -> f64 {
    f64::from(medium.area(w.as_vec3a()))
}

/// ∫ σ_t from points alone, as if all that is there were seen. Out of a grid's box there is nothing, so an infinite end does no harm.
fn quadrature(medium: &Medium, start: DVec3, dir: DVec3, t0: f64, t1: f64) -> DVec3 {
    const POINTS: usize = 800;
    let length = t1.min(t0 + 10.0) - t0;
    let at = |i: usize| start + dir * (t0 + length * (i as f64 + 0.5) / POINTS as f64);
    let sum: DVec3 = (0..POINTS).map(|i| d(medium.coefficients(at(i).as_vec3a()).sigma_t)).sum();
    sum * length / POINTS as f64
}

fn in_medium(scene: &Scene, pass: &Pass, collision: &Collision, wl: Vec3A, wc: Vec3A) -> Interior {
    let medium = &scene.media[collision.medium as usize];
    let coefficients = collision.coefficients;
    let phase = medium.phase_densities(collision.p, wl, wc);
    // Camera subpaths go on more rarely where something merges in media.
    let most = pass.thinning.continuation(collision.medium);
    let light = f64::from(phase.light) * f64::from(medium.continuation(&coefficients));
    let camera = f64::from(phase.camera) * f64::from(medium.continuation(&coefficients).min(most));
    // σ_s of light toward the camera, and how it is scattered there.
    let value = d(coefficients.sigma_s) * seen(medium, d(wc)) * f64::from(phase.camera);
    Interior { specular: false, light, camera, value }
}

fn on_surface(scene: &Scene, point: &SurfacePoint, wl: Vec3A, wc: Vec3A, end: bool) -> Interior {
    let frame = Frame::from_normal(point.ns);
    let (ll, lc) = (frame.to_local(wl), frame.to_local(wc));
    let beside = scene.solids.at(&scene.geometry, offset_origin(point.p, point.ng, wl));
    let site = Site { uv: point.uv, outside: scene.solids.outside_index(point.shape, &beside) };
    let material = scene.material(point.shape);
    let continuation = f64::from(material.continuation(point.uv));
    let adjoint = |z: f32, w: Vec3A| f64::from((z / w.dot(point.ng)).abs());
    if !end {
        // The specular lobe, if that is what joins the two directions: found by asking for samples.
        for k in 0..64 {
            let u = (k as f32 + 0.5) / 64.0;
            let Some(sample) = material.sample(site, ll, Mode::Importance, (u, Vec2::splat(0.5))) else {
                continue;
            };
            if sample.specular && (sample.to - lc).length() < 1e-4 {
                let pdf = f64::from(sample.pdf);
                return Interior {
                    specular: true,
                    light: pdf * continuation,
                    camera: f64::from(sample.pdf_rev) * continuation,
                    value: d(sample.weight) * pdf * adjoint(ll.z, wl) / f64::from(lc.z.abs()),
                };
            }
        }
    }
    let value = material.evaluate(site, ll, lc);
    Interior {
        specular: false,
        light: f64::from(value.pdf_lc) * continuation,
        camera: f64::from(value.pdf_cl) * continuation,
        value: d(value.f) * adjoint(ll.z, wl),
    }
}

/// Judges `path`, which the technique `made_by` has made.
pub fn judge(scene: &Scene, pass: &Pass, path: &FullPath, made_by: MadeBy) -> Verdict {
    let k = path.segments();
    let lights = &scene.lights;
    let on = |t| pass.settings.techniques.has(t);
    // Vertices where the subpaths were joined were not sampled by a specular lobe.
    let joined = |i: usize| match made_by {
        MadeBy::Connection(s) => i + 1 == s || i == s,
        MadeBy::Merge(_, at) => i == at,
    };
    let interior: Vec<Option<Interior>> =
        (0..=k).map(|i| (1..k).contains(&i).then(|| path.interior(scene, pass, i, joined(i)))).collect();
    let at = |i: usize| interior[i].expect("an interior vertex");
    let out = path.direction(scene, 0).as_vec3a();
    let lens_dir = -path.direction(scene, k - 1).as_vec3a();

    let depths: Vec<(DVec3, DVec3)> = (0..k).map(|i| path.depths(scene, pass, i)).collect();
    // The free-flight factor of an edge as sampled so that it ends in vertex `end`: one of three channels is drawn from.
    let flight = |edge: usize, end: usize| path.rate(scene, end, edge).dot((-depths[edge].1).exp()) / 3.0;

    let mut p = vec![0.0; k + 1];
    let mut r = vec![0.0; k + 1];
    p[0] = f64::from(lights.pdf_position(&pass.starts, &path.light));
    r[k] = 1.0;
    for i in 1..=k {
        let leaving =
            if i == 1 { f64::from(lights.pdf_direction(&path.light, out)) } else { at(i - 1).light };
        p[i] = leaving * path.cosine(scene, i, i - 1) * path.falloff(scene, i - 1) * flight(i - 1, i);
    }
    for i in 0..k {
        let leaving = if i + 1 == k {
            f64::from(scene.camera.pdf_direction(path.lens, lens_dir))
        } else {
            at(i + 1).camera
        };
        r[i] = leaving * path.cosine(scene, i, i) * path.falloff(scene, i) * flight(i, i);
    }

    let specular = |i: usize| (1..k).contains(&i) && at(i).specular;
    // In media only a share of the connections is made.
    let share = |i: usize| path.place(i, i).map_or(1.0, |place| f64::from(pass.share(place)));
    let mut c = vec![0.0; k + 1];
    for (s, count) in c.iter_mut().enumerate() {
        if specular(s) || (s > 0 && specular(s - 1)) {
            continue;
        }
        *count = if s == 0 {
            if on(Technique::Hit) && lights.is_hittable(&path.light) { 1.0 } else { 0.0 }
        } else if s == k {
            let seen = k > 1 || (lights.is_hittable(&path.light) && pass.thinning.direct());
            if on(Technique::Lens) && seen { 1.0 } else { 0.0 }
        } else if s == 1 {
            let x1 = path.position(1, 0).as_vec3a();
            let toward = f64::from(lights.pdf_toward(&scene.geometry, &path.light, x1));
            if on(Technique::NextEvent) { toward / p[0] } else { 0.0 }
        } else if on(Technique::Connect) {
            share(s - 1) * share(s)
        } else {
            0.0
        };
    }
    let merging = &pass.settings.merging;
    // Where camera subpaths end at their first vertex that is not specular, only that one can be merged at, and lights
    // are hit by way of Diracs alone.
    let first = (1..k).rev().find(|i| !specular(*i)).unwrap_or(0);
    if merging.first && first > 0 {
        c.fill(0.0);
    }
    let mut merges = Vec::new();
    for i in (1..k).filter(|i| !specular(*i) && (!merging.first || *i == first)) {
        // b of the edge from the light's side, and from the camera's.
        let b = |kind: Beams, edge: usize| {
            let got_so_far = (-depths[edge].1).exp().element_sum() / 3.0;
            (if kind == Beams::Long { 1.0 } else { got_so_far }) / flight(edge, i)
        };
        let (light, camera) = (b(merging.photon_beams, i - 1), b(merging.camera_beams, i));
        let sine = path.direction(scene, i - 1).cross(path.direction(scene, i)).length();
        let in_medium = matches!(path.place(i, i), Some(Place::Medium(_)));
        for technique in MERGES.into_iter().filter(|t| on(*t)) {
            let gather = pass.gathers.of(technique);
            let (n, r0) = (gather.paths as f64, f64::from(gather.radius));
            let m = match technique {
                Technique::Surface if !in_medium => n * PI * r0 * r0,
                Technique::PointPoint if in_medium => n * 4.0 / 3.0 * PI * r0.powi(3),
                Technique::PointBeam if in_medium => n * PI * r0 * r0 * camera,
                Technique::BeamPoint if in_medium => n * PI * r0 * r0 * light,
                Technique::BeamBeam if in_medium => n * 2.0 * r0 * sine * light * camera,
                _ => continue,
            };
            merges.push((technique, i, m));
        }
    }
    // f: emission, the geometry terms, the interior values, and the importance of a pixel, which times the cosine
    // at the lens is the camera's density (its r_k, 1 here, takes the place of 1 / lens area).
    let mut contribution = d(lights.emitted(&path.light, out));
    for i in 0..k {
        contribution *= path.cosine(scene, i, i) * path.cosine(scene, i + 1, i) * path.falloff(scene, i);
        contribution *= (-depths[i].0).exp();
    }
    for i in 1..k {
        contribution *= at(i).value;
    }
    contribution *= f64::from(scene.camera.pdf_direction(path.lens, lens_dir));
    Verdict { contribution, merges, p, r, c }
}
