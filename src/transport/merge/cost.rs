//! What an iteration costs, by what a pilot counted: a sum of counts times what each takes. It is no measurement of time, which would give
//! other radii and counts, and so other bits, on each machine and in each run.

use super::evidence::Counts;
use super::pilot::{NO_MEDIUM, Pilot};
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
    /// Connections that are tried.
    pub tried: f64,
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
        let Self { on_surfaces, in_media, connections, tried, cells, mut merges } = work;
        for (merges, technique) in merges.iter_mut().zip(MERGES) {
            *merges = each(*merges) * pilot.stands_for(technique);
        }
        Self {
            on_surfaces: each(on_surfaces),
            in_media: each(in_media),
            connections: each(connections),
            tried: each(tried),
            cells: each(cells),
            merges,
        }
    }

    /// What a pixel's share of an iteration costs, in nanoseconds of the machine that it was fitted on.
    pub fn cost(&self, scene: &Scene, pilot: &Pilot, counts: &Counts) -> f64 {
        let pixels = pilot.pass.partners as f64;
        let on = |t: Technique| counts.merges[place_of(t).expect("a merge")] > 0.0;
        let any = |all: &[Technique]| all.iter().any(|t| on(*t));
        let partners = if pilot.pass.settings.needs_partners() { 1.0 } else { 0.0 };
        // Light subpaths a pixel.
        let merged = MERGES
            .into_iter()
            .filter(|t| on(*t))
            .map(|t| pilot.pass.gathers.of(t).paths as f64 / pixels)
            .fold(0.0, f64::max);
        let light = f64::max(partners, merged);
        let vertices = self.on_surfaces + self.in_media;
        // Cells along an edge to a collision, and what they add to a connection from one.
        let an_edge = if self.in_media > 0.0 { self.cells / self.in_media } else { 0.0 };
        let to_lens = partners * pilot.light_vertices;
        let rays = EDGE * (1.0 + vertices)
            + LIGHT_EDGE * light * (1.0 + pilot.light_vertices)
            + CONNECTION * (self.tried + to_lens);
        let share = self.in_media / f64::max(vertices, 1e-9);
        let cells = self.cells + an_edge * share * self.tried + pilot.light_cells * (light + partners);
        let mut cost = rays * a_ray(scene) + CELL * cells;
        for ((technique, merges), n) in MERGES.into_iter().zip(self.merges).zip(counts.merges) {
            if n == 0.0 {
                continue;
            }
            let looks = match technique {
                Technique::Surface => self.on_surfaces,
                _ if has_camera_beam(technique) => 1.0 + vertices,
                _ => self.in_media,
            };
            let [look, merge] = MERGE[place_of(technique).expect("a merge")];
            cost += look * looks + merge * merges * n;
        }
        if any(&[Technique::PointBeam, Technique::BeamBeam]) {
            cost += CELL * an_edge * (1.0 + vertices);
        }
        if any(&[Technique::Surface, Technique::PointPoint, Technique::PointBeam]) {
            cost += STORED * merged * pilot.photons;
        }
        if any(&[Technique::BeamPoint, Technique::BeamBeam]) {
            cost += merged * (STORED * pilot.beams + CELL * pilot.light_cells);
        }
        cost
    }
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
