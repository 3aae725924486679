//! What an iteration costs, by what a pilot counted: a sum of counts times what each takes. It is no measurement of time, which would give
//! other radii and counts, and so other bits, on each machine and in each run.

use super::evidence::Counts;
use super::pilot::{NO_MEDIUM, OfLight, Pilot};
use super::settings::{MERGES, has_camera_beam, place_of};
use crate::scene::Scene;
use crate::transport::technique::Technique;

/// What a camera subpath does on average, with numbers of samples other than the pilot's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Vertices on surfaces.
    pub on_surfaces: f64,
    /// Collisions in media.
    pub in_media: f64,
    /// Connections that are not blocked.
    pub connections: f64,
    /// Connections that are tried, next-event estimation among them.
    pub tried: f64,
    /// Next-event estimations.
    pub next_events: f64,
    /// Cells of a grid along the edges to collisions.
    pub cells: f64,
    /// Merges, by technique in the order of [`MERGES`], with as many light subpaths and as wide a kernel as the pilot's pass has.
    pub merges: [f64; MERGES.len()],
}

impl Work {
    /// By a pilot's tracks, where camera subpaths go on as `counts` say.
    pub fn of(pilot: &Pilot, counts: &Counts) -> Self {
        let mut work = Self::default();
        for track in &pilot.tracks {
            let mut reached = 1.0;
            for step in track {
                work.on_surfaces += if step.on_surface { reached } else { 0.0 };
                work.in_media += if step.medium == NO_MEDIUM { 0.0 } else { reached };
                work.connections += reached * f64::from(step.connections);
                work.tried += reached * f64::from(step.tried);
                work.next_events += reached * f64::from(step.next_event);
                work.cells += reached * f64::from(step.cells);
                let left = reached * counts.rarer(step.medium, step.goes_on);
                for ((sum, n), technique) in work.merges.iter_mut().zip(step.merges).zip(MERGES) {
                    let along = has_camera_beam(technique);
                    *sum += f64::from(n) * if along { left } else { reached };
                }
                reached = left;
            }
        }
        let tracks = pilot.tracks.len().max(1) as f64;
        let each = |x: f64| x / tracks;
        let Self { on_surfaces, in_media, connections, tried, next_events, cells, mut merges } = work;
        for (merges, technique) in merges.iter_mut().zip(MERGES) {
            *merges = each(*merges) * pilot.stands_for(technique);
        }
        Self {
            on_surfaces: each(on_surfaces),
            in_media: each(in_media),
            connections: each(connections),
            tried: each(tried),
            next_events: each(next_events),
            cells: each(cells),
            merges,
        }
    }

    /// What a pixel's share of an iteration costs, in nanoseconds of the machine that it was fitted on.
    pub fn cost(&self, scene: &Scene, pilot: &Pilot, counts: &Counts) -> f64 {
        self.cost_without_light(scene, counts) + self.cost_of_lights(scene, pilot, counts).iter().sum::<f64>()
    }

    /// Cells along an edge to a collision, and what they add to a connection from a vertex.
    fn cells_an_edge(&self) -> (f64, f64) {
        let an_edge = if self.in_media > 0.0 { self.cells / self.in_media } else { 0.0 };
        (an_edge, an_edge * self.in_media / f64::max(self.on_surfaces + self.in_media, 1e-9))
    }

    /// The part of [`Self::cost`] that light subpaths have nothing to do with.
    pub fn cost_without_light(&self, scene: &Scene, counts: &Counts) -> f64 {
        let vertices = self.on_surfaces + self.in_media;
        let (an_edge, at_vertex) = self.cells_an_edge();
        let rays = EDGE * (1.0 + vertices) + CONNECTION * self.next_events;
        let mut cost = rays * a_ray(scene) + CELL * (self.cells + at_vertex * self.next_events);
        for technique in MERGES.into_iter().filter(|t| is_on(counts, *t)) {
            let looks = match technique {
                Technique::Surface => self.on_surfaces,
                _ if has_camera_beam(technique) => 1.0 + vertices,
                _ => self.in_media,
            };
            cost += MERGE[place_of(technique).expect("a merge")][0] * looks;
        }
        if [Technique::PointBeam, Technique::BeamBeam].into_iter().any(|t| is_on(counts, t)) {
            cost += CELL * an_edge * (1.0 + vertices);
        }
        cost
    }

    /// The parts of [`Self::cost`] that the light subpaths of each light bring with them: their edges, connections with them, and
    /// what is stored of them and merged.
    pub fn cost_of_lights(&self, scene: &Scene, pilot: &Pilot, counts: &Counts) -> Vec<f64> {
        let pixels = pilot.pass.partners as f64;
        let any = |all: &[Technique]| all.iter().any(|t| is_on(counts, *t));
        let partners = if pilot.pass.settings.needs_partners() { 1.0 } else { 0.0 };
        // Light subpaths a pixel.
        let merged = MERGES
            .into_iter()
            .filter(|t| is_on(counts, *t))
            .map(|t| pilot.pass.gathers.of(t).paths as f64 / pixels)
            .fold(0.0, f64::max);
        let light = f64::max(partners, merged);
        let points = any(&[Technique::Surface, Technique::PointPoint, Technique::PointBeam]);
        let beams = any(&[Technique::BeamPoint, Technique::BeamBeam]);
        let (_, at_vertex) = self.cells_an_edge();
        let paths = pilot.paths.max(1) as f64;
        let all = |of: &dyn Fn(&OfLight) -> f64| pilot.of_lights.iter().map(of).sum::<f64>();
        // Of what was counted for all lights together, this light's share.
        let part = |total: f64, own: f64, all: f64| if all > 0.0 { total * own / all } else { 0.0 };
        let tried = all(&|of| of.tried);
        let merges: [f64; MERGES.len()] = std::array::from_fn(|i| all(&|of| of.merges[i]));
        let cost = |of: &OfLight| {
            let [started, vertices, cells] = [of.paths, of.vertices, of.cells].map(|n| n / paths);
            let tried = part(self.tried - self.next_events, of.tried, tried);
            let rays = LIGHT_EDGE * light * (started + vertices) + CONNECTION * (tried + partners * vertices);
            let mut cost = rays * a_ray(scene) + CELL * (at_vertex * tried + cells * (light + partners));
            for (i, n) in counts.merges.into_iter().enumerate() {
                cost += MERGE[i][1] * n * part(self.merges[i], of.merges[i], merges[i]);
            }
            if points {
                cost += STORED * merged * of.photons / paths;
            }
            if beams {
                cost += merged * (STORED * of.beams / paths + CELL * cells);
            }
            cost
        };
        pilot.of_lights.iter().map(cost).collect()
    }
}

/// The mean over pilots of what a pixel's share of an iteration costs.
pub fn mean(scene: &Scene, pilots: &[Pilot], counts: &Counts) -> f64 {
    let cost = |pilot: &Pilot| Work::of(pilot, counts).cost(scene, pilot, counts);
    pilots.iter().map(cost).sum::<f64>() / pilots.len().max(1) as f64
}

/// Whether a technique merges at all.
fn is_on(counts: &Counts, technique: Technique) -> bool {
    place_of(technique).is_some_and(|i| counts.merges[i] > 0.0)
}

/// How long a ray takes, relative to one in a scene of some hundred triangles: by the logarithm of their number.
fn a_ray(scene: &Scene) -> f64 {
    let primitives = scene.geometry.primitive_count().max(1) as f64;
    (0.15 * primitives.log2() - 0.4).clamp(0.7, 3.0)
}

// Fitted to the user time of 56 renders: 8 scenes, without merges and with sets of them. With a factor of its own for the rays of each scene
// the sum is within 12% of most of them.

/// Of a camera subpath's vertex and the edge to it.
const EDGE: f64 = 170.0;
/// The same of a light subpath.
const LIGHT_EDGE: f64 = 200.0;
/// Of a connection that is tried.
const CONNECTION: f64 = 215.0;
/// Of a cell of a grid.
const CELL: f64 = 12.0;
/// Of a photon or a beam that is kept.
const STORED: f64 = 85.0;
/// Of looking for merges at a vertex or along an edge, and of one merge, in the order of [`MERGES`].
const MERGE: [[f64; 2]; MERGES.len()] =
    [[35.0, 80.0], [70.0, 150.0], [35.0, 400.0], [70.0, 400.0], [150.0, 800.0]];
