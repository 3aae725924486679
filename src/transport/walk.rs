//! The walk: one piece of code for light and camera subpaths.

use super::expression::Label;
use super::mis::Link;
use super::settings::Settings;
use crate::bsdf::{Material, Mode, Site};
use crate::geometry::{Ray, SurfacePoint};
use crate::math::{Frame, Rgb, Stream};
use crate::scene::{Arrival, Collision, End, Inside, Scene};
use glam::Vec3A;

/// A subpath on its way from one vertex to the next.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// The ray from x_{i-1}.
    pub ray: Ray,
    /// Where the edge starts.
    pub from: Vec3A,
    /// The solids that it starts in.
    pub inside: Inside,
    /// What turns the free-flight factor of the edge into that of its start, as the other subpath samples it
    /// (see [`Place::rate`]).
    pub rate: Rgb,
    /// Contribution over density so far, with all factors of x_{i-1} and its cosine.
    pub throughput: Rgb,
    /// Density of the ray given x_{i-1}, with the continuation probability: per solid angle, or per area of the disc
    /// where x_{i-1} is infinitely far away.
    pub pdf: f32,
    /// D at x_{i-1} toward the ray: |cos θ| at a surface, 1 in a medium, at a point, on the lens and at infinity.
    pub cosine: f32,
    /// Whether x_{i-1} is infinitely far away: then no 1/d² belongs to the edge.
    pub infinite: bool,
    /// Whether x_{i-1} was sampled by a specular lobe.
    pub specular: bool,
    /// What [`Link::leave`] gave at x_{i-1}.
    pub sum: f32,
    /// Edges of the subpath before this one.
    pub length: u32,
    /// What the light path expression needs of the vertices up to x_{i-1}.
    pub trail: u32,
}

/// Where a vertex lies.
#[derive(Clone, Copy, Debug)]
pub enum Place {
    /// On a surface.
    Surface(SurfacePoint),
    /// In a medium.
    Medium(Collision),
}

impl Place {
    /// Position.
    #[inline]
    pub fn position(&self) -> Vec3A {
        match self {
            Self::Surface(point) => point.p,
            Self::Medium(collision) => collision.p,
        }
    }

    /// D toward the unit direction `dir`: |cos θ| with the geometric normal on a surface, 1 in a medium.
    #[inline]
    pub fn cosine(&self, dir: Vec3A) -> f32 {
        match self {
            Self::Surface(point) => dir.dot(point.ng).abs(),
            Self::Medium(_) => 1.0,
        }
    }

    /// What [`crate::medium::Passage::density`] takes for an edge that ends here: σ_t in a medium, 1 on a surface.
    #[inline]
    pub fn rate(&self) -> Rgb {
        match self {
            Self::Surface(_) => Rgb::ONE,
            Self::Medium(collision) => collision.coefficients.sigma_t,
        }
    }

    /// The surface point; `None` in a medium.
    #[inline]
    pub fn surface(&self) -> Option<&SurfacePoint> {
        match self {
            Self::Surface(point) => Some(point),
            Self::Medium(_) => None,
        }
    }

    /// The geometric normal of a surface.
    #[inline]
    pub fn normal(&self) -> Option<Vec3A> {
        match self {
            Self::Surface(point) => Some(point.ng),
            Self::Medium(_) => None,
        }
    }

    /// The ray from here in the unit direction `dir`.
    #[inline]
    pub fn spawn(&self, dir: Vec3A) -> Ray {
        match self {
            Self::Surface(point) => point.spawn(dir),
            Self::Medium(collision) => Ray::new(collision.p, dir),
        }
    }
}

/// A subpath's vertex.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Where it lies.
    pub place: Place,
    /// Unit direction to the subpath's vertex before.
    pub to_previous: Vec3A,
    /// Contribution over density up to here, without the scattering at this vertex.
    pub throughput: Rgb,
    /// The solids here; on a surface, on the side of `to_previous`.
    pub inside: Inside,
    /// What the weights need.
    pub link: Link,
    /// Edges between here and the subpath's start.
    pub length: u32,
    /// What the light path expression needs of the vertices before this one.
    pub trail: u32,
    /// Index of refraction outside of a solid's boundary, see [`Site::outside`].
    pub outside: f32,
}

/// What a vertex does to light between two directions, with both subpaths' densities.
#[derive(Clone, Copy, Debug)]
pub struct Scattering {
    /// On a surface f(wl→wc) · |wl·ns| / |wl·ng|: the BSDF as it stands in the path's contribution, whose geometry terms
    /// take the geometric normals. Shading normals are no longer symmetric there [Veach 1997, 5.3.2]. In a medium
    /// σ_s · phase.
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
        match &self.place {
            Place::Surface(point) => self.scatter_surface(scene, point, wl, wc),
            Place::Medium(collision) => {
                let medium = &scene.media[collision.medium as usize];
                let phase = medium.phase().evaluate(wl, wc);
                let pdf = phase * medium.continuation(&collision.coefficients);
                let value = collision.coefficients.sigma_s * phase;
                (phase > 0.0).then_some(Scattering { value, pdf_light: pdf, pdf_camera: pdf })
            }
        }
    }

    #[inline]
    fn scatter_surface(
        &self,
        scene: &Scene,
        point: &SurfacePoint,
        wl: Vec3A,
        wc: Vec3A,
    ) -> Option<Scattering> {
        if !(consistent(point, wl) && consistent(point, wc)) {
            return None;
        }
        let material = scene.material(point.shape);
        let frame = Frame::from_normal(point.ns);
        let local_l = frame.to_local(wl);
        let site = Site { uv: point.uv, outside: self.outside };
        let bsdf = material.evaluate(site, local_l, frame.to_local(wc));
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

    /// Whether anything can be joined to it: it has a lobe that is not specular.
    #[inline]
    pub fn is_connectible(&self, scene: &Scene) -> bool {
        match &self.place {
            Place::Surface(point) => scene.material(point.shape).has_smooth(),
            Place::Medium(_) => true,
        }
    }

    /// The solids just off this vertex in the direction `dir`.
    #[inline]
    pub fn inside_toward(&self, scene: &Scene, dir: Vec3A) -> Inside {
        match &self.place {
            Place::Surface(point) if dir.dot(point.ng) * self.to_previous.dot(point.ng) < 0.0 => {
                scene.solids.cross(self.inside, point, dir)
            }
            Place::Surface(_) | Place::Medium(_) => self.inside,
        }
    }

    /// What a light path expression calls this vertex where two subpaths are joined at it.
    #[inline]
    pub fn joint_label(&self) -> Label {
        match self.place {
            Place::Surface(_) => Label::Surface,
            Place::Medium(_) => Label::Medium,
        }
    }
}

/// What is done along a walk.
pub trait Visitor {
    /// Which subpath this is.
    const MODE: Mode;
    /// c of the connection that ends this subpath just before the vertex at `length` edges, which lies at `position`,
    /// raised (see [`Link::count`]); asked only where the vertex before is not specular.
    fn count(&self, length: u32, position: Vec3A) -> f32;
    /// A ray is about to be followed: what shines along the whole of it can be gathered.
    fn departed(&mut self, _flight: &Flight) {}
    /// A vertex was reached. `flight` led to it.
    fn vertex(&mut self, vertex: &Vertex, flight: &Flight, random: &mut Stream);
    /// The ray left the scene.
    fn escaped(&mut self, flight: &Flight, arrival: &Arrival);
    /// The trail with one more vertex, see [`super::expression::Expression`].
    fn extend(&self, trail: u32, label: Label) -> u32;
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
        visitor.departed(&flight);
        let arrival = scene.fly(&flight.ray, flight.inside, random);
        let place = match arrival.end {
            End::Surface(point) => Place::Surface(point),
            End::Collision(collision) => Place::Medium(collision),
            End::Open => {
                visitor.escaped(&flight, &arrival);
                return;
            }
        };
        let Some(vertex) = arrive(scene, settings, &flight, place, &arrival, visitor) else { return };
        visitor.vertex(&vertex, &flight, random);
        if vertex.length == max_length {
            return;
        }
        match leave(scene, settings, &vertex, random, visitor) {
            Some(next) => flight = next,
            None => return,
        }
    }
}

/// The vertex that a flight ends in. `None` where no light comes through.
#[inline]
fn arrive<V: Visitor>(
    scene: &Scene,
    settings: &Settings,
    flight: &Flight,
    place: Place,
    arrival: &Arrival,
    visitor: &V,
) -> Option<Vertex> {
    let passage = &arrival.passage;
    // T→ on a light subpath, T← on a camera subpath; and the one of the edge's other end.
    let own = passage.density(place.rate());
    if own <= 0.0 {
        return None;
    }
    let other = passage.density(flight.rate);
    let falloff = if flight.infinite { 1.0 } else { 1.0 / (arrival.distance * arrival.distance) };
    let length = flight.length + 1;
    let count = if flight.specular { 0.0 } else { visitor.count(length, place.position()) };
    let raise = |x: f32| settings.heuristic.raise(x);
    let density = flight.pdf * place.cosine(flight.ray.dir) * falloff * own;
    let link = Link::next(raise(density), flight.sum, raise(flight.cosine * falloff * other), count);
    let outside = match &place {
        Place::Surface(point) => scene.solids.outside_index(point.shape, &arrival.inside),
        Place::Medium(_) => 0.0,
    };
    Some(Vertex {
        place,
        to_previous: -flight.ray.dir,
        throughput: flight.throughput * (passage.transmittance / own),
        inside: arrival.inside,
        link,
        length,
        trail: flight.trail,
        outside,
    })
}

/// Samples how the subpath goes on; `None` where it is absorbed.
#[inline]
fn leave<V: Visitor>(
    scene: &Scene,
    settings: &Settings,
    vertex: &Vertex,
    random: &mut Stream,
    visitor: &V,
) -> Option<Flight> {
    match &vertex.place {
        Place::Surface(point) => leave_surface(scene, settings, vertex, point, random, visitor),
        Place::Medium(collision) => leave_collision(scene, settings, vertex, collision, random, visitor),
    }
}

/// Whether the subpath survives Russian roulette.
#[inline]
fn survives(continuation: f32, random: &mut Stream) -> bool {
    continuation >= 1.0 || random.next_1d() < continuation
}

#[inline]
fn leave_surface<V: Visitor>(
    scene: &Scene,
    settings: &Settings,
    vertex: &Vertex,
    point: &SurfacePoint,
    random: &mut Stream,
    visitor: &V,
) -> Option<Flight> {
    let from = vertex.to_previous;
    if !consistent(point, from) {
        return None;
    }
    let material: &Material = scene.material(point.shape);
    let continuation = material.continuation(point.uv);
    if !survives(continuation, random) {
        return None;
    }
    let frame = Frame::from_normal(point.ns);
    let local_from = frame.to_local(from);
    let u = (random.next_1d(), random.next_2d());
    let site = Site { uv: point.uv, outside: vertex.outside };
    let sample = material.sample(site, local_from, V::MODE, u)?;
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
    let label = if sample.specular { Label::Specular } else { Label::Surface };
    Some(Flight {
        ray: point.spawn(dir),
        from: point.p,
        inside: vertex.inside_toward(scene, dir),
        rate: Rgb::ONE,
        throughput: vertex.throughput * sample.weight * (adjoint / continuation),
        pdf: continuation * sample.pdf,
        cosine,
        infinite: false,
        specular: sample.specular,
        sum: vertex.link.leave(sample.specular, 0.0, back),
        length: vertex.length,
        trail: visitor.extend(vertex.trail, label),
    })
}

#[inline]
fn leave_collision<V: Visitor>(
    scene: &Scene,
    settings: &Settings,
    vertex: &Vertex,
    collision: &Collision,
    random: &mut Stream,
    visitor: &V,
) -> Option<Flight> {
    let medium = &scene.media[collision.medium as usize];
    let continuation = medium.continuation(&collision.coefficients);
    if !survives(continuation, random) {
        return None;
    }
    let u = (random.next_1d(), random.next_2d());
    let (dir, phase) = medium.phase().sample(vertex.to_previous, u);
    let pdf = continuation * phase;
    Some(Flight {
        ray: Ray::new(collision.p, dir),
        from: collision.p,
        inside: vertex.inside,
        rate: collision.coefficients.sigma_t,
        // phase / its density = 1
        throughput: vertex.throughput * collision.coefficients.sigma_s * (1.0 / continuation),
        pdf,
        cosine: 1.0,
        infinite: false,
        specular: false,
        // Phase functions are the same either way, and so are the densities.
        sum: vertex.link.leave(false, 0.0, settings.heuristic.raise(pdf)),
        length: vertex.length,
        trail: visitor.extend(vertex.trail, Label::Medium),
    })
}
