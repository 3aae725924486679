//! The camera subpath: s = 0, s = 1 and all inner connections.

use super::expression::{Expression, Label};
use super::merge::photons::{Photons, parts};
use super::merge::{beam_beam, beam_point, point_beam, point_point, surface};
use super::mis::{Link, connection_weight};
use super::pass::Pass;
use super::sink::{Joint, Sink, Start};
use super::technique::Technique;
use super::walk::{Flight, Place, Vertex, Visitor, walk};
use crate::bsdf::Mode;
use crate::film::Sample;
use crate::geometry::{Ray, shadow_ray_along};
use crate::light::LightPoint;
use crate::math::{Rgb, Stream};
use crate::medium::Passage;
use crate::scene::{Inside, Scene};
use glam::UVec2;

/// What a camera subpath is joined with.
#[derive(Clone, Copy)]
pub struct Partners<'a> {
    /// The stored vertices of the light subpath that is its partner.
    pub vertices: &'a [Vertex],
    /// All light subpaths of the iteration, where something merges.
    pub photons: Option<&'a Photons>,
}

impl Partners<'_> {
    /// Nothing.
    pub const NONE: Self = Self { vertices: &[], photons: None };
}

/// Traces the camera subpath of `pixel` (in the full frame) and joins it with `partners`.
pub fn trace<S: Sink>(scene: &Scene, pass: &Pass, pixel: UVec2, partners: Partners, sink: &mut S) {
    match (scene.is_void(), pass.settings.needs_light_paths()) {
        (true, true) => trace_in::<S, true, false>(scene, pass, pixel, partners, sink),
        (false, true) => trace_in::<S, false, false>(scene, pass, pixel, partners, sink),
        (true, false) => trace_in::<S, true, true>(scene, pass, pixel, partners, sink),
        (false, false) => trace_in::<S, false, true>(scene, pass, pixel, partners, sink),
    }
}

/// [`trace`], made once for scenes where nothing is but walls (`VOID`, see [`Scene::is_void`]) and once for all others; and
/// once for sets of techniques without light subpaths (`ALONE`, see [`Visitor::ALONE`]), and once for all others.
#[inline(never)]
fn trace_in<S: Sink, const VOID: bool, const ALONE: bool>(
    scene: &Scene,
    pass: &Pass,
    pixel: UVec2,
    partners: Partners,
    sink: &mut S,
) {
    let settings = &pass.settings;
    let index = u64::from(pixel.y) * u64::from(scene.camera.size().x) + u64::from(pixel.x);
    let mut random = pass.camera_streams.stream(index);
    let (u_film, u_lens) = (random.next_2d(), random.next_2d());
    let ray = scene.camera.sample_ray(pixel, u_film, u_lens);
    sink.start(&Start::Lens(ray.origin));
    let flight = Flight::from_lens(scene, pass, &ray);
    let on = |t| pass.on(t);
    let mut path = CameraPath::<S, VOID, ALONE> {
        scene,
        pass,
        partners,
        hit: on(Technique::Hit),
        next_event: on(Technique::NextEvent),
        connect: if on(Technique::Connect) { 1.0 } else { 0.0 },
        lens: if on(Technique::Lens) { 1.0 } else { 0.0 },
        // Takes no memory until something varies along a beam.
        depths: Vec::new(),
        sink,
    };
    walk::<VOID, _>(scene, pass, settings.max_length, flight, &mut random, &mut path);
}

/// The visitor of a camera walk.
struct CameraPath<'a, S, const VOID: bool, const ALONE: bool> {
    scene: &'a Scene,
    pass: &'a Pass,
    partners: Partners<'a>,
    hit: bool,
    next_event: bool,
    /// c of an inner connection, raised.
    connect: f32,
    /// c of light tracing, raised.
    lens: f32,
    /// Depths along the beam that merges, see [`crate::medium::Medium::depths_along`].
    depths: Vec<f32>,
    sink: &'a mut S,
}

impl<S: Sink, const VOID: bool, const ALONE: bool> CameraPath<'_, S, VOID, ALONE> {
    #[inline]
    fn raise(&self, x: f32) -> f32 {
        self.pass.raise(x)
    }

    #[inline]
    fn counts(&self, length: u32) -> bool {
        (self.pass.settings.min_length..=self.pass.settings.max_length).contains(&length)
    }

    /// Whether the restriction to some paths takes one of a camera subpath with this trail and a light subpath with
    /// those ends.
    #[inline]
    fn accepts(&self, trail: u32, ends: u32) -> bool {
        Expression::accepts(trail as u8, ends)
    }

    /// See [`Scene::passage`].
    #[inline(always)]
    fn passage(&self, ray: &Ray, inside: Inside, tracker: Option<&mut Stream>) -> Option<Passage> {
        if VOID { self.scene.passage_in_void(ray) } else { self.scene.passage(ray, inside, tracker) }
    }

    /// The trail of a camera subpath that is joined at `vertex`.
    #[inline]
    fn joined_trail(&self, vertex: &Vertex) -> u32 {
        self.extend(vertex.trail, vertex.joint_label())
    }

    /// s = 0 in a medium that shines: what comes from all along the ray of `flight`. No other technique makes such
    /// paths, so the weight is 1.
    #[inline(never)]
    fn record_glow(&mut self, flight: &Flight) {
        let length = flight.length + 1;
        if !(self.counts(length) && self.accepts(flight.trail, self.pass.settings.paths.ends())) {
            return;
        }
        let contribution = flight.throughput * self.scene.glow(&flight.ray, flight.inside);
        if contribution == Rgb::ZERO {
            return;
        }
        let sample = Sample { technique: Technique::Hit, s: 0, t: length + 1, contribution, weight: 1.0 };
        self.sink.record(&sample, &Joint::Glow);
    }

    /// s = 0: x_0 is `light`, found at the end of `flight`; `link` and `throughput` are those of x_0.
    #[inline(never)]
    fn record_hit(&mut self, light: &LightPoint, link: &Link, throughput: Rgb, flight: &Flight) {
        let length = flight.length + 1;
        if !(self.hit && self.counts(length) && self.accepts(flight.trail, self.pass.settings.paths.ends())) {
            return;
        }
        let lights = &self.scene.lights;
        let out = -flight.ray.dir;
        let contribution = throughput * lights.emitted(light, out);
        if contribution == Rgb::ZERO {
            return;
        }
        let geometry = &self.scene.geometry;
        let pdf_position = lights.pdf_position(&self.pass.starts, light);
        // c_1: next-event estimation at x_1, or light tracing where x_1 is the lens.
        let count = if length == 1 {
            if self.pass.thinning.direct() { self.lens } else { 0.0 }
        } else if flight.specular || !self.next_event {
            0.0
        } else {
            self.raise(lights.pdf_toward(geometry, light, flight.from) / pdf_position)
        };
        let camera_side = Link { count, ..*link }.close(
            0.0,
            self.raise(lights.pdf_direction(light, out)),
            self.raise(pdf_position),
        );
        let weight = connection_weight(1.0, 0.0, camera_side);
        let sample = Sample { technique: Technique::Hit, s: 0, t: length + 1, contribution, weight };
        self.sink.record(&sample, &Joint::Hit(*light));
    }

    /// s = 1: a point on a light is sampled from `vertex`.
    #[inline(always)]
    fn next_event(&mut self, vertex: &Vertex, random: &mut Stream) {
        let (lights, geometry) = (&self.scene.lights, &self.scene.geometry);
        // Milk in a glass is lit through the glass alone.
        if !VOID && matches!(vertex.place, Place::Medium(_)) && self.scene.solids.is_dark(&vertex.inside) {
            return;
        }
        let select = if lights.is_single() { 0.0 } else { random.next_1d() };
        let u = random.next_2d();
        let mut tracker = (!VOID && self.pass.tracks).then(|| random.fork());
        // After the draws: the lengths that count change no other random number.
        if !self.counts(vertex.length + 1) {
            return;
        }
        if !self.accepts(self.joined_trail(vertex), self.pass.settings.paths.ends()) {
            return;
        }
        let (place, position) = (&vertex.place, vertex.place.position());
        let Some(light) = lights.sample_toward(geometry, position, select, u) else { return };
        let Some(scattering) = vertex.scatter(self.scene, self.pass, Mode::Radiance, light.dir) else {
            return;
        };
        let infinite = light.end.infinite;
        let falloff = if infinite { 1.0 } else { light.inverse_distance * light.inverse_distance };
        let cosine = place.cosine(light.dir);
        let light_geometry = light.end.cosine * falloff;
        let contribution =
            vertex.throughput * scattering.value * light.radiance * (cosine * light_geometry / light.pdf_nee);
        if contribution == Rgb::ZERO {
            return;
        }
        let ray = if infinite {
            place.spawn(light.dir)
        } else {
            let ends = [(position, place.footing()), (light.point.p, light.point.footing())];
            shadow_ray_along(ends, light.inverse_distance)
        };
        let inside = vertex.inside_toward(self.scene, light.dir);
        let Some(passage) = self.passage(&ray, inside, tracker.as_mut()) else { return };
        let contribution = contribution * passage.transmittance;
        if contribution == Rgb::ZERO {
            return;
        }
        let per_position = 1.0 / light.pdf_position(&self.pass.starts);
        let count = self.raise(light.pdf_nee * per_position);
        let light_side = if self.hit && light.end.hittable {
            let reached = passage.density(Rgb::ONE);
            self.raise(scattering.pdf_camera * light_geometry * reached * per_position)
        } else {
            0.0
        };
        let camera_side = if ALONE {
            0.0
        } else {
            let density = passage.density(place.rate(self.scene, light.dir));
            let forward = light.end.pdf_direction * (cosine * falloff * density);
            let beam = self.pass.beam(Mode::Importance, &passage, density);
            let merges = vertex.merges(self.pass, Mode::Radiance, light.dir).with(beam);
            vertex.link.close(merges, self.raise(scattering.pdf_light), self.raise(forward))
        };
        let weight = connection_weight(count, light_side, camera_side);
        let sample =
            Sample { technique: Technique::NextEvent, s: 1, t: vertex.length + 1, contribution, weight };
        self.sink.record(&sample, &Joint::NextEvent(light.point));
    }

    /// s ≥ 2, t ≥ 2: `vertex` is connected to the light vertices of the partner, or to a share of them.
    #[inline]
    fn connect_all(&mut self, vertex: &Vertex, random: &mut Stream) {
        let own = self.pass.share(&vertex.place);
        // Whole numbers that the running sum of the shares passes: each connection with the probability that is its
        // share, and as many in all as the sum says.
        // Drawn whatever the partner has, so that the lengths that count change no other random number.
        let mut sum = if self.pass.thinning.shares.is_empty() { 0.0 } else { random.next_1d() };
        for index in 0..self.partners.vertices.len() {
            let other = &self.partners.vertices[index];
            let count = own * self.pass.share(&other.place);
            sum += count;
            if sum < 1.0 {
                continue;
            }
            sum -= 1.0;
            // s + t - 1 segments, with s and t one more than the lengths.
            if self.counts(other.length + vertex.length + 1) {
                self.connect(vertex, index, count);
            }
        }
    }

    /// `vertex` is connected to the light vertex `index` of the partner, with the probability `count`.
    #[inline(never)]
    fn connect(&mut self, vertex: &Vertex, index: usize, count: f32) {
        let other = &self.partners.vertices[index];
        let ends = self.pass.settings.paths.before(other.trail, other.joint_label());
        if !self.accepts(self.joined_trail(vertex), ends) {
            return;
        }
        let (here, there) = (vertex.place.position(), other.place.position());
        let between = there - here;
        let inverse_distance = between.length_recip();
        let falloff = inverse_distance * inverse_distance;
        let dir = between * inverse_distance;
        let inside = vertex.inside_toward(self.scene, dir);
        // No straight way leads out of a glass.
        if !VOID && self.scene.solids.are_apart(&inside, &other.inside_toward(self.scene, -dir)) {
            return;
        }
        let Some(at_camera) = vertex.scatter(self.scene, self.pass, Mode::Radiance, dir) else { return };
        let Some(at_light) = other.scatter(self.scene, self.pass, Mode::Importance, -dir) else { return };
        let camera_geometry = vertex.place.cosine(dir) * falloff;
        let light_cosine = other.place.cosine(dir);
        let contribution = vertex.throughput
            * at_camera.value
            * at_light.value
            * other.throughput
            * (camera_geometry * light_cosine / count);
        if contribution == Rgb::ZERO {
            return;
        }
        let ends = [(here, vertex.place.footing()), (there, other.place.footing())];
        let ray = shadow_ray_along(ends, inverse_distance);
        let Some(passage) = self.passage(&ray, inside, None) else { return };
        let contribution = contribution * passage.transmittance;
        if contribution == Rgb::ZERO {
            return;
        }
        let to_light = passage.density(other.place.rate(self.scene, dir));
        let to_camera = passage.density(vertex.place.rate(self.scene, dir));
        let reverse = at_camera.pdf_camera * (light_cosine * falloff * to_light);
        let forward = at_light.pdf_light * (camera_geometry * to_camera);
        let light_merges = other.merges(self.pass, Mode::Importance, -dir).with(self.pass.beam(
            Mode::Radiance,
            &passage,
            to_light,
        ));
        let camera_merges = vertex.merges(self.pass, Mode::Radiance, dir).with(self.pass.beam(
            Mode::Importance,
            &passage,
            to_camera,
        ));
        let weight = connection_weight(
            self.raise(count),
            other.link.close(light_merges, self.raise(at_light.pdf_camera), self.raise(reverse)),
            vertex.link.close(camera_merges, self.raise(at_camera.pdf_light), self.raise(forward)),
        );
        let (s, t) = (other.length + 1, vertex.length + 1);
        let sample = Sample { technique: Technique::Connect, s, t, contribution, weight };
        self.sink.record(&sample, &Joint::Connect(index));
    }
}

impl<S: Sink, const VOID: bool, const ALONE: bool> CameraPath<'_, S, VOID, ALONE> {
    /// Merges at a vertex.
    #[inline(never)]
    fn merge(&mut self, photons: &Photons, vertex: &Vertex) {
        let (scene, pass) = (self.scene, self.pass);
        let sink = &mut *self.sink;
        let mut record = |sample: &Sample, meeting| sink.record(sample, &Joint::Merge(meeting));
        match &vertex.place {
            Place::Surface(_) => {
                if pass.on(Technique::Surface) {
                    surface::gather(scene, pass, photons, vertex, record);
                }
            }
            Place::Medium(collision) => {
                if pass.on(Technique::PointPoint) {
                    point_point::gather(scene, pass, photons, (vertex, collision), &mut record);
                }
                if pass.on(Technique::BeamPoint) {
                    beam_point::gather(scene, pass, photons, (vertex, collision), &mut record);
                }
            }
        }
    }

    /// Merges along an edge that was flown for the distance `flown`.
    #[inline(never)]
    fn merge_beam(&mut self, photons: &Photons, flight: &Flight, flown: f32) {
        let (scene, pass) = (self.scene, self.pass);
        let sink = &mut *self.sink;
        let mut record = |sample: &Sample, meeting| sink.record(sample, &Joint::Merge(meeting));
        let (lens, connect) = (self.lens, self.connect);
        let depths = &mut self.depths;
        parts(scene, pass, Mode::Radiance, flight, flown, |stretch| {
            depths.clear();
            if let Some(medium) = stretch.medium {
                medium.depths_along(stretch.origin, stretch.dir, stretch.length, depths);
            }
            let part = (stretch, &depths[..]);
            let count = match flight.length {
                _ if flight.specular => 0.0,
                0 => lens,
                _ => connect * pass.raise(flight.share * pass.thinning.share(stretch.index)),
            };
            if pass.on(Technique::PointBeam) {
                point_beam::gather(scene, pass, photons, flight, part, count, &mut record);
            }
            if pass.on(Technique::BeamBeam) {
                beam_beam::gather(scene, pass, photons, flight, part, count, &mut record);
            }
        });
    }
}

impl<S: Sink, const VOID: bool, const ALONE: bool> Visitor for CameraPath<'_, S, VOID, ALONE> {
    const MODE: Mode = Mode::Radiance;
    const ALONE: bool = ALONE;

    #[inline]
    fn count(&self, flight: &Flight, place: &Place) -> f32 {
        if flight.length == 0 {
            self.lens
        } else {
            self.connect * self.raise(flight.share * self.pass.share(place))
        }
    }

    #[inline]
    fn flown(&mut self, flight: &Flight, distance: f32) {
        if self.hit && self.scene.traits.emissive {
            self.record_glow(flight);
        }
        if !ALONE
            && let Some(photons) = self.partners.photons
            && self.pass.camera_beams
            && flight.length + 1 < self.pass.settings.max_length
        {
            self.merge_beam(photons, flight, distance);
        }
    }

    #[inline]
    fn goes_on(&self, flight: &Flight) -> bool {
        !self.pass.settings.merging.first || flight.specular
    }

    #[inline(always)]
    fn vertex(&mut self, vertex: &Vertex, flight: &Flight, random: &mut Stream) {
        self.sink.vertex(vertex);
        if let Place::Surface(point) = &vertex.place
            && let Some(light) = self.scene.lights.at_surface(point)
        {
            self.record_hit(&light, &vertex.link, vertex.throughput, flight);
        }
        if vertex.length >= self.pass.settings.max_length || !vertex.is_connectible(self.scene) {
            return;
        }
        if self.next_event {
            self.next_event(vertex, random);
        }
        if ALONE {
            return;
        }
        if let Some(photons) = self.partners.photons {
            self.merge(photons, vertex);
        }
        if self.connect > 0.0 {
            self.connect_all(vertex, random);
        }
    }

    fn escaped(&mut self, flight: &Flight, passage: Passage) {
        if let Some(light) = self.scene.lights.infinite_toward(flight.ray.dir) {
            // x_0 is a direction: its density is per solid angle, and the edge has no 1/d².
            let passed = passage.density(Rgb::ONE);
            if passed <= 0.0 {
                return;
            }
            let link = if ALONE {
                flight.link_alone(self.pass, 1.0, (passed, 1.0))
            } else {
                flight.link(self.pass, Self::MODE, 1.0, &passage, (Rgb::ONE, 1.0), 0.0).0
            };
            let throughput = flight.throughput * (passage.transmittance / passed);
            self.record_hit(&light, &link, throughput, flight);
        }
    }

    #[inline]
    fn extend(&self, trail: u32, label: Label) -> u32 {
        u32::from(self.pass.settings.paths.step(trail as u8, label))
    }
}
