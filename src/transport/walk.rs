//! The walk: one piece of code for light and camera subpaths.

use super::expression::Label;
use super::merge::join::{scatter_in, sine};
use super::merge::{Arm, Beams};
use super::mis::{Link, Pending};
use super::pass::{Pass, other};
use crate::bsdf::{Material, Mode, Site};
use crate::camera::CameraRay;
use crate::geometry::{Footing, Ray, SurfacePoint};
use crate::math::{Rgb, Stream};
use crate::medium::{Passage, PhaseSample};
pub use crate::scene::Place;
use crate::scene::{Arrival, Collision, Inside, Scene};
use glam::{Vec2, Vec3A};

/// A subpath on its way from one vertex to the next.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// The ray from x_{i-1}.
    pub ray: Ray,
    /// Where the edge starts.
    pub from: Vec3A,
    /// How far the ray begins from there (metres): not at all but for the camera's near plane.
    pub skipped: f32,
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
    /// g at x_{i-1}: the share with which it is connected (see [`super::thinning`]).
    pub share: f32,
    /// What [`Link::leave`] gave at x_{i-1}.
    pub sum: Pending,
    /// Edges of the subpath before this one.
    pub length: u32,
    /// What the light path expression needs of the vertices up to x_{i-1}.
    pub trail: u32,
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
    #[inline(always)]
    pub fn cosine(&self, dir: Vec3A) -> f32 {
        match self {
            Self::Surface(point) => dir.dot(point.ng).abs(),
            Self::Medium(_) => 1.0,
        }
    }

    /// What [`crate::medium::Passage::density`] takes for an edge along the unit direction `dir`, or the opposite one, that ends
    /// here: σ_t of light along it in a medium, 1 on a surface.
    #[inline(always)]
    pub fn rate(&self, scene: &Scene, dir: Vec3A) -> Rgb {
        match self {
            Self::Surface(_) => Rgb::ONE,
            Self::Medium(collision) => {
                collision.coefficients.sigma_t * scene.media[collision.medium as usize].area(dir)
            }
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

    /// What a ray from or to here lies on with its end.
    #[inline(always)]
    pub fn footing(&self) -> Option<Footing> {
        match self {
            Self::Surface(point) => Some(point.footing()),
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
    /// b of the edge that led here, raised; 0 on a surface. See [`Pass::beam`].
    pub beam: f32,
    /// Edges between here and the subpath's start.
    pub length: u32,
    /// What the light path expression needs of the vertices before this one.
    pub trail: u32,
    /// Index of refraction outside of a solid's boundary, see [`Site::outside`].
    pub outside: f32,
    /// On a surface: the probability that a subpath goes on from here; 0 where nothing that comes from `to_previous` is
    /// scattered, see [`consistent`]. 1 in a medium, where it depends on the walk (see [`Pass::continuation`]).
    pub continuation: f32,
}

/// What a vertex does to light between two directions, with both subpaths' densities.
#[derive(Clone, Copy, Debug)]
pub struct Scattering {
    /// On a surface f(wl→wc) · |wl·ns| / |wl·ng|: the BSDF as it stands in the path's contribution, whose geometry terms
    /// take the geometric normals. Shading normals are no longer symmetric there [Veach 1997, 5.3.2]. In a medium
    /// σ_s · phase, the same from either side.
    pub value: Rgb,
    /// Density per solid angle, with continuation, with which a light subpath goes on toward wc.
    pub pdf_light: f32,
    /// Density per solid angle, with continuation, with which a camera subpath goes on toward wl.
    pub pdf_camera: f32,
}

/// Whether `direction` is on the same side of the geometric and the shading surface. Where it is not, light would
/// pass through an opaque surface, so nothing is scattered.
#[inline(always)]
fn consistent(point: &SurfacePoint, direction: Vec3A) -> bool {
    direction.dot(point.ng) * direction.dot(point.ns) > 0.0
}

impl Vertex {
    /// What the vertex of a subpath that is walked in `mode` does between its vertex before and the unit direction `dir`, away
    /// from it, by all lobes that are not specular. `None` where there is none.
    #[inline(always)]
    pub fn scatter(&self, scene: &Scene, pass: &Pass, mode: Mode, dir: Vec3A) -> Option<Scattering> {
        match &self.place {
            Place::Surface(point) => self.scatter_surface(scene, point, mode, dir),
            Place::Medium(collision) => {
                let (wl, wc) = mode.order(self.to_previous, dir);
                let medium = &scene.media[collision.medium as usize];
                let scattering = scatter_in(
                    pass,
                    (collision.medium, medium),
                    collision.p,
                    &collision.coefficients,
                    wl,
                    wc,
                );
                (scattering.pdf_light > 0.0).then_some(scattering)
            }
        }
    }

    #[inline(always)]
    fn scatter_surface(
        &self,
        scene: &Scene,
        point: &SurfacePoint,
        mode: Mode,
        dir: Vec3A,
    ) -> Option<Scattering> {
        let continuation = self.continuation;
        if continuation <= 0.0 || !consistent(point, dir) {
            return None;
        }
        let (wl, wc) = mode.order(self.to_previous, dir);
        let material = scene.material(point.shape);
        let site = Site { uv: point.uv, outside: self.outside };
        let bsdf = material.evaluate_world(site, point.ns, wl, wc);
        if bsdf.f == Rgb::ZERO {
            return None;
        }
        Some(Scattering {
            value: bsdf.f * (wl.dot(point.ns) / wl.dot(point.ng)).abs(),
            pdf_light: bsdf.pdf_lc * continuation,
            pdf_camera: bsdf.pdf_cl * continuation,
        })
    }

    /// Whether anything can be joined to it: it has a lobe that is not specular and what comes from the vertex before.
    #[inline(always)]
    pub fn is_connectible(&self, scene: &Scene) -> bool {
        match &self.place {
            Place::Surface(point) => self.continuation > 0.0 && scene.material(point.shape).has_smooth(),
            Place::Medium(_) => true,
        }
    }

    /// The solids just off this vertex in the direction `dir`.
    #[inline(always)]
    pub fn inside_toward(&self, scene: &Scene, dir: Vec3A) -> Inside {
        match &self.place {
            Place::Surface(point) if dir.dot(point.ng) * self.to_previous.dot(point.ng) < 0.0 => {
                scene.solids.cross(self.inside, point, dir)
            }
            Place::Surface(_) | Place::Medium(_) => self.inside,
        }
    }

    /// M_i where the subpath, walked in `mode`, goes on or is joined in the unit direction `dir`.
    #[inline(always)]
    pub fn merges(&self, pass: &Pass, mode: Mode, dir: Vec3A) -> Pending {
        match self.place {
            Place::Surface(_) => pass.merges.at_surface(),
            Place::Medium(_) if pass.beams => {
                pass.merges_at_collision(mode, self.beam, sine(self.to_previous, dir))
            }
            Place::Medium(_) => Pending { known: pass.merges.point_point, open: 0.0 },
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
    /// Whether nothing is joined to this subpath but lights, so that A_i, c_i and M_i are 0 all along it: what they are
    /// made of is then not computed.
    const ALONE: bool;
    /// c of the connection that ends this subpath just before the vertex at `place`, to which `flight` leads,
    /// raised (see [`Link::count`]); asked only where the vertex before is not specular.
    fn count(&self, flight: &Flight, place: &Place) -> f32;
    /// A ray was followed for this distance (metres). What a vertex there is told comes after this.
    fn flown(&mut self, _flight: &Flight, _distance: f32) {}
    /// A vertex was reached. `flight` led to it.
    fn vertex(&mut self, vertex: &Vertex, flight: &Flight, random: &mut Stream);
    /// The ray left the scene, by this passage.
    fn escaped(&mut self, flight: &Flight, passage: Passage);
    /// Whether the subpath shall go on.
    #[inline]
    fn goes_on(&self, _flight: &Flight) -> bool {
        true
    }
    /// The trail with one more vertex, see [`super::expression::Expression`].
    fn extend(&self, trail: u32, label: Label) -> u32;
}

/// Walks on from `flight` until the subpath is absorbed, escapes or has `max_length` edges. `VOID`: whether
/// [`Scene::is_void`]; a walk there needs nothing of what media need.
#[inline(always)]
pub fn walk<const VOID: bool, V: Visitor>(
    scene: &Scene,
    pass: &Pass,
    max_length: u32,
    mut flight: Flight,
    random: &mut Stream,
    visitor: &mut V,
) {
    while flight.length < max_length {
        let Arrival { place, distance, passage, inside } = if VOID {
            scene.fly_in_void(&flight.ray, flight.inside)
        } else {
            scene.fly(&flight.ray, flight.inside, pass.tracks, random)
        };
        visitor.flown(&flight, distance);
        let Some(place) = place else {
            visitor.escaped(&flight, passage);
            return;
        };
        let rate = place.rate(scene, flight.ray.dir);
        let own = passage.density(rate);
        // No light comes through.
        if own <= 0.0 {
            return;
        }
        let vertex = arrive(scene, pass, &flight, (place, distance, inside), (passage, rate, own), visitor);
        visitor.vertex(&vertex, &flight, random);
        if vertex.length == max_length
            || !leave(scene, pass, &vertex, random, visitor, &mut flight)
            || !visitor.goes_on(&flight)
        {
            return;
        }
    }
}

impl Flight {
    /// A camera subpath's first.
    #[inline]
    pub fn from_lens(scene: &Scene, pass: &Pass, ray: &CameraRay) -> Self {
        let skipped = scene.camera.skipped(ray.dir);
        Self {
            ray: Ray::new(ray.origin + ray.dir * skipped, ray.dir),
            from: ray.origin,
            skipped,
            inside: scene.camera_inside,
            rate: Rgb::ONE,
            throughput: Rgb::ONE,
            pdf: ray.pdf,
            cosine: 1.0,
            infinite: false,
            specular: false,
            share: 1.0,
            // No light subpath hits the lens by itself: c_{k+1} = 0.
            sum: Pending::NONE,
            length: 0,
            trail: u32::from(pass.settings.paths.start()),
        }
    }

    /// What an edge of this length has of 1/d².
    #[inline(always)]
    fn falloff(&self, distance: f32) -> f32 {
        if self.infinite { 1.0 } else { 1.0 / (distance * distance) }
    }

    /// The density of the vertex that it leads to, in that vertex's measure, raised; `own`: the free-flight factor.
    #[inline(always)]
    fn density(&self, pass: &Pass, cosine: f32, falloff: f32, own: f32) -> f32 {
        pass.raise(self.pdf * cosine * falloff * own)
    }

    /// [`Self::link`] of a subpath that nothing is joined to, see [`Visitor::ALONE`]. `place`: the free-flight factor and
    /// |cos θ|.
    #[inline(always)]
    pub fn link_alone(&self, pass: &Pass, distance: f32, (own, cosine): (f32, f32)) -> Link {
        Link::alone(self.density(pass, cosine, self.falloff(distance), own))
    }

    /// The link of a vertex at `distance`, reached by a walk in `mode` through `passage`, and b of the edge, raised.
    /// `place`: the vertex's rate (see [`Place::rate`]) and |cos θ|; `count`: c of the connection before it.
    #[inline(always)]
    pub fn link(
        &self,
        pass: &Pass,
        mode: Mode,
        distance: f32,
        passage: &Passage,
        place: (Rgb, f32),
        count: f32,
    ) -> (Link, f32) {
        let (rate, cosine) = place;
        // T→ on a light subpath, T← on a camera subpath; and the one of the edge's other end.
        let own = passage.density(rate);
        let reverse = passage.density(self.rate);
        let falloff = self.falloff(distance);
        // Without a collision at the start there is nothing that b multiplies.
        let sum = if self.sum.open > 0.0 {
            self.sum.with(pass.beam(other(mode), passage, reverse))
        } else {
            self.sum.known
        };
        let link = Link::next(
            self.density(pass, cosine, falloff, own),
            sum,
            pass.raise(self.cosine * falloff * reverse),
            count,
        );
        (link, pass.beam(mode, passage, own))
    }

    /// The beam of this flight as it arrives at a point in a medium, `distance` along it: with the whole contribution
    /// where beams are long, with that of beams that get so far where they are short.
    #[inline]
    pub fn arm(
        &self,
        pass: &Pass,
        mode: Mode,
        distance: f32,
        passage: &Passage,
        rate: Rgb,
        count: f32,
    ) -> Option<Arm> {
        let (link, beam) = self.link(pass, mode, distance, passage, (rate, 1.0), count);
        if beam <= 0.0 {
            return None;
        }
        let share = match pass.beams_of(mode) {
            Beams::Long => 1.0,
            Beams::Short => passage.density(Rgb::ONE),
        };
        Some(Arm {
            back: -self.ray.dir,
            throughput: self.throughput * (passage.transmittance / share),
            link,
            beam,
            length: self.length + 1,
            trail: self.trail,
        })
    }
}

/// The vertex that a flight ends in: where, after which distance and inside of which solids; the passage to it, its rate
/// (see [`Place::rate`]) and the free-flight factor.
#[inline(always)]
fn arrive<V: Visitor>(
    scene: &Scene,
    pass: &Pass,
    flight: &Flight,
    (place, distance, inside): (Place, f32, Inside),
    (passage, rate, own): (Passage, Rgb, f32),
    visitor: &V,
) -> Vertex {
    let length = flight.length + 1;
    let (whole, cosine) = (distance + flight.skipped, place.cosine(flight.ray.dir));
    let (link, beam) = if V::ALONE {
        (flight.link_alone(pass, whole, (own, cosine)), 0.0)
    } else {
        let count = if flight.specular { 0.0 } else { visitor.count(flight, &place) };
        flight.link(pass, V::MODE, whole, &passage, (rate, cosine), count)
    };
    let to_previous = -flight.ray.dir;
    let (outside, beam, continuation) = match &place {
        Place::Surface(point) => {
            let continuation = if consistent(point, to_previous) {
                scene.material(point.shape).continuation(point.uv)
            } else {
                0.0
            };
            (scene.solids.outside_index(point.shape, &inside), 0.0, continuation)
        }
        Place::Medium(_) => (0.0, beam, 1.0),
    };
    Vertex {
        place,
        to_previous,
        throughput: flight.throughput * (passage.transmittance / own),
        inside,
        link,
        beam,
        length,
        trail: flight.trail,
        outside,
        continuation,
    }
}

/// Samples how the subpath goes on, `next`; false where it is absorbed, and then that is left as it is.
#[inline(always)]
fn leave<V: Visitor>(
    scene: &Scene,
    pass: &Pass,
    vertex: &Vertex,
    random: &mut Stream,
    visitor: &V,
    next: &mut Flight,
) -> bool {
    match &vertex.place {
        Place::Surface(point) => leave_surface(scene, pass, vertex, point, random, visitor, next),
        Place::Medium(collision) => leave_collision(scene, pass, vertex, collision, random, visitor, next),
    }
}

#[inline(always)]
fn leave_surface<V: Visitor>(
    scene: &Scene,
    pass: &Pass,
    vertex: &Vertex,
    point: &SurfacePoint,
    random: &mut Stream,
    visitor: &V,
    next: &mut Flight,
) -> bool {
    let from = vertex.to_previous;
    let continuation = vertex.continuation;
    // Russian roulette.
    let Vec2 { x: survival, y: lobe } = random.next_2d();
    if survival >= continuation {
        return false;
    }
    let material: &Material = scene.material(point.shape);
    let site = Site { uv: point.uv, outside: vertex.outside };
    let u = (lobe, random.next_2d());
    let Some(sample) = material.sample_world(site, point.ns, from, V::MODE, u) else { return false };
    let dir = sample.to;
    if !consistent(point, dir) {
        return false;
    }
    let cosine = dir.dot(point.ng).abs();
    let adjoint = match V::MODE {
        Mode::Radiance => 1.0,
        // [Veach 1997, 5.3.2]: |wl·ns| |wc·ng| / (|wl·ng| |wc·ns|)
        Mode::Importance => (from.dot(point.ns) * cosine / (from.dot(point.ng) * dir.dot(point.ns))).abs(),
    };
    let sum = if V::ALONE {
        Pending::NONE
    } else {
        let back = pass.raise(continuation * sample.pdf_rev);
        vertex.link.leave(sample.specular, vertex.merges(pass, V::MODE, dir), back)
    };
    let label = if sample.specular { Label::Specular } else { Label::Surface };
    *next = Flight {
        ray: point.spawn(dir),
        from: point.p,
        skipped: 0.0,
        inside: vertex.inside_toward(scene, dir),
        rate: Rgb::ONE,
        throughput: vertex.throughput * sample.weight * (adjoint / continuation),
        pdf: continuation * sample.pdf,
        cosine,
        infinite: false,
        specular: sample.specular,
        share: 1.0,
        sum,
        length: vertex.length,
        trail: visitor.extend(vertex.trail, label),
    };
    true
}

#[inline(always)]
fn leave_collision<V: Visitor>(
    scene: &Scene,
    pass: &Pass,
    vertex: &Vertex,
    collision: &Collision,
    random: &mut Stream,
    visitor: &V,
    next: &mut Flight,
) -> bool {
    let medium = &scene.media[collision.medium as usize];
    let indexed = (collision.medium, medium);
    let continuation = pass.continuation(V::MODE, indexed, &collision.coefficients);
    let Vec2 { x: survival, y: choice } = random.next_2d();
    if survival >= continuation {
        return false;
    }
    let u = (choice, random.next_2d());
    let PhaseSample { to: dir, pdf: phase, reverse: phase_back, weight } =
        medium.sample_phase(collision.p, vertex.to_previous, u);
    let sum = if V::ALONE {
        Pending::NONE
    } else {
        let reverse = pass.continuation(other(V::MODE), indexed, &collision.coefficients) * phase_back;
        vertex.link.leave(false, vertex.merges(pass, V::MODE, dir), pass.raise(reverse))
    };
    *next = Flight {
        ray: Ray::new(collision.p, dir),
        from: collision.p,
        skipped: 0.0,
        inside: vertex.inside,
        rate: vertex.place.rate(scene, dir),
        throughput: vertex.throughput * collision.coefficients.sigma_s * (weight / continuation),
        pdf: continuation * phase,
        cosine: 1.0,
        infinite: false,
        specular: false,
        share: pass.thinning.share(collision.medium),
        sum,
        length: vertex.length,
        trail: visitor.extend(vertex.trail, Label::Medium),
    };
    true
}
