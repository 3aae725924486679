//! The light subpath: what is stored of it, and t = 1.

use super::expression::{Expression, Label};
use super::merge::photons::parts;
use super::merge::store::{Beam, LightStart, Photon, Stored};
use super::mis::{Link, Pending, connection_weight};
use super::pass::Pass;
use super::sink::{Joint, Sink, Start};
use super::technique::Technique;
use super::walk::{Flight, Place, Vertex, Visitor, walk};
use crate::bsdf::Mode;
use crate::film::Sample;
use crate::geometry::{Ray, shadow_ray};
use crate::light::{EmissionSample, LightPoint};
use crate::math::{Rgb, Stream};
use crate::medium::Passage;
use crate::scene::Scene;

/// Traces light subpath `index` of an iteration: keeps in `store` what can be connected or merged, and records its
/// connections to the lens.
pub fn trace<S: Sink>(scene: &Scene, pass: &Pass, index: u64, store: &mut Stored, sink: &mut S) {
    let settings = &pass.settings;
    let mut random = pass.light_streams.stream(index);
    let select = random.next_1d();
    let (u_position, u_direction) = (random.next_2d(), random.next_2d());
    let Some(emission) =
        scene.lights.sample_emission(&scene.geometry, &pass.starts, select, u_position, u_direction)
    else {
        return;
    };
    let light = emission.point;
    sink.start(&Start::Light(light));
    let mut path = LightPath::new(scene, pass, index, light, emission.pdf_pos, store, sink);
    path.connect_light_to_lens(&mut random);
    let flight = path.depart(&emission);
    let edges = settings.max_length - 1;
    if scene.is_void() {
        walk::<true, _>(scene, pass, edges, flight, &mut random, &mut path);
    } else {
        walk::<false, _>(scene, pass, edges, flight, &mut random, &mut path);
    }
}

/// The visitor of a light walk.
struct LightPath<'a, S> {
    scene: &'a Scene,
    pass: &'a Pass,
    index: u32,
    light: LightPoint,
    /// p_0 and c_0 of the start, raised.
    start: Link,
    /// p_0, not raised.
    pdf_position: f32,
    /// c of a connection, raised: 1 where the technique is on.
    connect: f32,
    /// Whether vertices are kept for a partner.
    stored: bool,
    next_event: bool,
    lens: bool,
    /// Whether vertices are kept for merges.
    points: bool,
    /// Whether edges are kept for merges.
    beams: bool,
    store: &'a mut Stored,
    sink: &'a mut S,
}

impl<'a, S: Sink> LightPath<'a, S> {
    fn new(
        scene: &'a Scene,
        pass: &'a Pass,
        index: u64,
        light: LightPoint,
        pdf_position: f32,
        store: &'a mut Stored,
        sink: &'a mut S,
    ) -> Self {
        let on = |t| pass.on(t);
        let partner = index < pass.partners;
        let merged =
            |techniques: &[Technique]| techniques.iter().any(|t| on(*t) && index < pass.gathers.of(*t).paths);
        let points = merged(&[Technique::Surface, Technique::PointPoint, Technique::PointBeam]);
        let beams = merged(&[Technique::BeamPoint, Technique::BeamBeam]);
        if beams {
            store.starts.push(LightStart { point: light, pdf: pdf_position });
        }
        let hit = on(Technique::Hit) && scene.lights.is_hittable(&light);
        let start =
            Link { density: pass.raise(pdf_position), behind: 0.0, count: if hit { 1.0 } else { 0.0 } };
        Self {
            scene,
            pass,
            index: index as u32,
            light,
            start,
            pdf_position,
            connect: if on(Technique::Connect) { 1.0 } else { 0.0 },
            stored: on(Technique::Connect) && partner,
            next_event: on(Technique::NextEvent),
            lens: on(Technique::Lens) && partner,
            points,
            beams,
            store,
            sink,
        }
    }

    fn depart(&self, emission: &EmissionSample) -> Flight {
        let infinite = self.scene.lights.is_infinite(&self.light);
        let cosine = self.scene.lights.cos_at_light(&self.light, emission.dir);
        let ray = match self.light.footing() {
            Some(footing) => footing.spawn(emission.origin, emission.dir),
            None => Ray::new(emission.origin, emission.dir),
        };
        Flight {
            ray,
            from: emission.origin,
            skipped: 0.0,
            inside: self.scene.inside_at_light(&self.light, emission.dir),
            rate: Rgb::ONE,
            throughput: emission.radiance * (cosine / (emission.pdf_pos * emission.pdf_dir)),
            pdf: emission.pdf_dir,
            cosine,
            infinite,
            specular: false,
            share: 1.0,
            sum: self.start.leave(false, Pending::NONE, 0.0),
            length: 0,
            trail: self.pass.settings.paths.ends(),
        }
    }

    fn raise(&self, x: f32) -> f32 {
        self.pass.raise(x)
    }

    /// t = 1, s = 1: the light as seen directly. Lights at a point or from a single direction are not seen.
    fn connect_light_to_lens(&mut self, random: &mut Stream) {
        let lights = &self.scene.lights;
        if !self.lens {
            return;
        }
        // Drawn whatever the lengths that count, so that these change no other random number.
        let u = random.next_2d();
        let seen = lights.is_hittable(&self.light) && self.pass.thinning.direct();
        if self.pass.settings.min_length > 1 || !seen {
            return;
        }
        let camera = &self.scene.camera;
        let lens = camera.sample_lens(u);
        let infinite = lights.is_infinite(&self.light);
        let (dir, distance, falloff) = if infinite {
            (self.light.n, f32::INFINITY, 1.0)
        } else {
            let d = self.light.p - lens;
            let d2 = d.length_squared();
            (d / d2.sqrt(), d2.sqrt(), 1.0 / d2)
        };
        let Some(pixel) = camera.pixel_of(lens, dir) else { return };
        let skipped = camera.skipped(dir);
        if distance <= skipped {
            return;
        }
        let geometry = lights.cos_at_light(&self.light, -dir) * falloff;
        let radiance = lights.emitted(&self.light, -dir);
        let reverse = camera.pdf_direction(lens, dir) * geometry;
        let contribution = radiance * (reverse / self.pdf_position);
        let paths = &self.pass.settings.paths;
        if contribution == Rgb::ZERO || !Expression::accepts(paths.start(), paths.ends()) {
            return;
        }
        let ray = if infinite {
            Ray::new(lens + dir * skipped, dir)
        } else {
            shadow_ray(lens + dir * skipped, None, self.light.p, self.light.footing())
        };
        let Some(passage) = self.scene.passage(&ray, self.scene.camera_inside, None) else { return };
        let contribution = contribution * passage.transmittance;
        if contribution == Rgb::ZERO {
            return;
        }
        let reverse = reverse * passage.density(Rgb::ONE);
        let weight = connection_weight(1.0, self.start.close(0.0, 0.0, self.raise(reverse)), 0.0);
        let sample = Sample { technique: Technique::Lens, s: 1, t: 1, contribution, weight };
        self.sink.record(&sample, &Joint::Lens(lens, pixel));
    }

    /// t = 1, s ≥ 2: a vertex as seen from the lens.
    fn connect_to_lens(&mut self, vertex: &Vertex, random: &mut Stream) {
        let u = random.next_2d();
        if vertex.length + 1 < self.pass.settings.min_length {
            return;
        }
        let camera = &self.scene.camera;
        let lens = camera.sample_lens(u);
        let paths = &self.pass.settings.paths;
        if !Expression::accepts(paths.start(), paths.before(vertex.trail, vertex.joint_label())) {
            return;
        }
        let position = vertex.place.position();
        let to_vertex = position - lens;
        let d2 = to_vertex.length_squared();
        let dir = to_vertex / d2.sqrt();
        let Some(pixel) = camera.pixel_of(lens, dir) else { return };
        let skipped = camera.skipped(dir);
        if d2.sqrt() <= skipped {
            return;
        }
        let inside = vertex.inside_toward(self.scene, -dir);
        // No straight way leads out of a glass.
        if self.scene.solids.are_apart(&inside, &self.scene.camera_inside) {
            return;
        }
        let Some(scattering) = vertex.scatter(self.scene, self.pass, Mode::Importance, -dir) else {
            return;
        };
        let geometry = camera.pdf_direction(lens, dir) * vertex.place.cosine(dir) / d2;
        let contribution = vertex.throughput * scattering.value * geometry;
        if contribution == Rgb::ZERO {
            return;
        }
        let ray = shadow_ray(lens + dir * skipped, None, position, vertex.place.footing());
        let Some(passage) = self.scene.passage(&ray, self.scene.camera_inside, None) else { return };
        let contribution = contribution * passage.transmittance;
        if contribution == Rgb::ZERO {
            return;
        }
        let density = passage.density(vertex.place.rate(self.scene, dir));
        let reverse = geometry * density;
        let beam = self.pass.beam(Mode::Radiance, &passage, density);
        let merges = vertex.merges(self.pass, Mode::Importance, -dir).with(beam);
        let weight = connection_weight(
            1.0,
            vertex.link.close(merges, self.raise(scattering.pdf_camera), self.raise(reverse)),
            0.0,
        );
        let sample = Sample { technique: Technique::Lens, s: vertex.length + 1, t: 1, contribution, weight };
        self.sink.record(&sample, &Joint::Lens(lens, pixel));
    }
}

impl<S: Sink> Visitor for LightPath<'_, S> {
    const ALONE: bool = false;
    const MODE: Mode = Mode::Importance;

    #[inline]
    fn count(&self, flight: &Flight, place: &Place) -> f32 {
        if flight.length > 0 {
            return self.connect * self.raise(flight.share * self.pass.share(place));
        }
        if !self.next_event {
            return 0.0;
        }
        let toward = self.scene.lights.pdf_toward(&self.scene.geometry, &self.light, place.position());
        self.raise(toward / self.pdf_position)
    }

    #[inline]
    fn vertex(&mut self, vertex: &Vertex, _flight: &Flight, random: &mut Stream) {
        self.sink.vertex(vertex);
        if !vertex.is_connectible(self.scene) {
            return;
        }
        if self.lens {
            self.connect_to_lens(vertex, random);
        }
        // A merge adds an edge at least, a connection two.
        if self.stored && vertex.length + 2 <= self.pass.settings.max_length {
            self.store.vertices.push(*vertex);
        }
        if self.points {
            self.store.photons.push(Photon::new(vertex, self.index));
        }
    }

    #[inline]
    fn flown(&mut self, flight: &Flight, distance: f32) {
        if !self.beams {
            return;
        }
        let light = self.store.starts.len() as u32 - 1;
        let (beams, depths, path) = (&mut self.store.beams, &mut self.store.depths, self.index);
        parts(self.scene, self.pass, Mode::Importance, flight, distance, |stretch| {
            let first = depths.len();
            if let Some(medium) = stretch.medium {
                medium.depths_along(stretch.origin, stretch.dir, stretch.length, depths);
            }
            beams.push(Beam::new(flight, stretch, path, light, first..depths.len()));
        });
    }

    fn escaped(&mut self, _flight: &Flight, _passage: Passage) {}

    #[inline]
    fn extend(&self, trail: u32, label: Label) -> u32 {
        self.pass.settings.paths.before(trail, label)
    }
}
