//! The walk: one piece of code for light and camera subpaths.

use super::mis::Link;
use super::settings::Settings;
use crate::bsdf::Mode;
use crate::geometry::{Ray, SurfacePoint};
use crate::math::{Frame, Rgb, Stream};
use crate::scene::Scene;
use glam::Vec3A;

/// A subpath on its way from one vertex to the next.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// The ray from x_{i-1}.
    pub ray: Ray,
    /// Where the edge starts.
    pub from: Vec3A,
    /// Contribution over density so far, with all factors of x_{i-1} and its cosine.
    pub throughput: Rgb,
    /// Density of the ray given x_{i-1}, with the continuation probability: per solid angle, or per area of the disc
    /// where x_{i-1} is infinitely far away.
    pub pdf: f32,
    /// D at x_{i-1} toward the ray: |cos θ| at a surface, 1 at a point, on the lens and at infinity.
    pub cosine: f32,
    /// Whether x_{i-1} is infinitely far away: then no 1/d² belongs to the edge.
    pub infinite: bool,
    /// Whether x_{i-1} was sampled by a specular lobe.
    pub specular: bool,
    /// What [`Link::leave`] gave at x_{i-1}.
    pub sum: f32,
    /// Edges of the subpath before this one.
    pub length: u32,
}

/// A subpath's vertex on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// The surface.
    pub point: SurfacePoint,
    /// Unit direction to the subpath's vertex before.
    pub to_previous: Vec3A,
    /// Contribution over density up to here, without the scattering at this vertex.
    pub throughput: Rgb,
    /// What the weights need.
    pub link: Link,
    /// Edges between here and the subpath's start.
    pub length: u32,
}

/// What a vertex does to light between two directions, with both subpaths' densities.
#[derive(Clone, Copy, Debug)]
pub struct Scattering {
    /// f(wl→wc) · |wl·ns| / |wl·ng|: the BSDF as it stands in the path's contribution, whose geometry terms take the
    /// geometric normals. Shading normals are no longer symmetric there [Veach 1997, 5.3.2].
    pub value: Rgb,
    /// Density per solid angle, with continuation, with which a light subpath goes on toward wc.
    pub pdf_light: f32,
    /// Density per solid angle, with continuation, with which a camera subpath goes on toward wl.
    pub pdf_camera: f32,
}

/// Whether `direction` is on the same side of the geometric and the shading surface. Where it is not, light would
/// pass through an opaque surface, so nothing is scattered.
#[inline]
fn consistent(point: &SurfacePoint, direction: Vec3A) -> bool {
    direction.dot(point.ng) * direction.dot(point.ns) > 0.0
}

impl Vertex {
    /// The scattering from `wl`, toward the light, to `wc`, toward the camera (both unit, away from the vertex), by
    /// all lobes that are not specular. `None` where there is none.
    #[inline]
    pub fn scatter(&self, scene: &Scene, wl: Vec3A, wc: Vec3A) -> Option<Scattering> {
        let point = &self.point;
        if !(consistent(point, wl) && consistent(point, wc)) {
            return None;
        }
        let material = scene.material(point.shape);
        let frame = Frame::from_normal(point.ns);
        let local_l = frame.to_local(wl);
        let bsdf = material.evaluate(point.uv, local_l, frame.to_local(wc));
        if bsdf.f == Rgb::ZERO {
            return None;
        }
        let continuation = material.continuation(point.uv);
        Some(Scattering {
            value: bsdf.f * (local_l.z / wl.dot(point.ng)).abs(),
            pdf_light: bsdf.pdf_lc * continuation,
            pdf_camera: bsdf.pdf_cl * continuation,
        })
    }
}

/// What is done along a walk.
pub trait Visitor {
    /// Which subpath this is.
    const MODE: Mode;
    /// c of the connection that ends this subpath just before the vertex at `length` edges, raised
    /// (see [`Link::count`]); asked only where the vertex before is not specular.
    fn count(&self, length: u32, point: &SurfacePoint) -> f32;
    /// A vertex was reached. `flight` led to it.
    fn vertex(&mut self, vertex: &Vertex, flight: &Flight, random: &mut Stream);
    /// The ray left the scene.
    fn escaped(&mut self, flight: &Flight);
}

/// Walks on from `flight` until the subpath is absorbed, escapes or has `max_length` edges.
#[inline]
pub fn walk<V: Visitor>(
    scene: &Scene,
    settings: &Settings,
    max_length: u32,
    mut flight: Flight,
    random: &mut Stream,
    visitor: &mut V,
) {
    while flight.length < max_length {
        let Some(hit) = scene.geometry.intersect(&flight.ray) else {
            visitor.escaped(&flight);
            return;
        };
        let vertex = arrive(settings, &flight, hit.point, hit.t, visitor);
        visitor.vertex(&vertex, &flight, random);
        if vertex.length == max_length {
            return;
        }
        match leave::<V>(scene, settings, &vertex, random) {
            Some(next) => flight = next,
            None => return,
        }
    }
}

/// The vertex that a flight ends in, `distance` from where it began.
#[inline]
fn arrive<V: Visitor>(
    settings: &Settings,
    flight: &Flight,
    point: SurfacePoint,
    distance: f32,
    visitor: &V,
) -> Vertex {
    let falloff = if flight.infinite { 1.0 } else { 1.0 / (distance * distance) };
    let cosine = flight.ray.dir.dot(point.ng).abs();
    let length = flight.length + 1;
    let count = if flight.specular { 0.0 } else { visitor.count(length, &point) };
    let raise = |x: f32| settings.heuristic.raise(x);
    let link =
        Link::next(raise(flight.pdf * cosine * falloff), flight.sum, raise(flight.cosine * falloff), count);
    Vertex { point, to_previous: -flight.ray.dir, throughput: flight.throughput, link, length }
}

/// Samples how the subpath goes on; `None` where it is absorbed.
#[inline]
fn leave<V: Visitor>(
    scene: &Scene,
    settings: &Settings,
    vertex: &Vertex,
    random: &mut Stream,
) -> Option<Flight> {
    let point = &vertex.point;
    let from = vertex.to_previous;
    if !consistent(point, from) {
        return None;
    }
    let material = scene.material(point.shape);
    let continuation = material.continuation(point.uv);
    if continuation < 1.0 && random.next_1d() >= continuation {
        return None;
    }
    let frame = Frame::from_normal(point.ns);
    let local_from = frame.to_local(from);
    let u = (random.next_1d(), random.next_2d());
    let sample = material.sample(point.uv, local_from, V::MODE, u)?;
    let dir = frame.to_world(sample.to).normalize();
    if !consistent(point, dir) {
        return None;
    }
    let cosine = dir.dot(point.ng).abs();
    let adjoint = match V::MODE {
        Mode::Radiance => 1.0,
        // [Veach 1997, 5.3.2]: |wl·ns| |wc·ng| / (|wl·ng| |wc·ns|)
        Mode::Importance => (local_from.z * cosine / (from.dot(point.ng) * sample.to.z)).abs(),
    };
    let back = settings.heuristic.raise(continuation * sample.pdf_rev);
    Some(Flight {
        ray: point.spawn(dir),
        from: point.p,
        throughput: vertex.throughput * sample.weight * (adjoint / continuation),
        pdf: continuation * sample.pdf,
        cosine,
        infinite: false,
        specular: sample.specular,
        sum: vertex.link.leave(sample.specular, 0.0, back),
        length: vertex.length,
    })
}
