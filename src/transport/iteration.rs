//! One iteration: light walks, then camera walks with their partners, then the film.

use super::camera_path;
use super::light_path::{self, LIGHT_PATHS_A_PIXEL};
use super::settings::Settings;
use super::sink::{Joint, Sink};
use super::technique::Technique;
use super::walk::Vertex;
use crate::error::Result;
use crate::film::{BAND_ROWS, Band, Film, Sample, Splat};
use crate::scene::Scene;
use glam::UVec2;
use rayon::prelude::*;

/// Light subpaths in a chunk: the unit of parallel work on them. A constant, so that the order of sums never
/// depends on the threads.
const CHUNK: u64 = 1024;

/// Pixels along the side of the squares in which a band is worked through: neighbours see the same surfaces.
const TILE: usize = BAND_ROWS;

/// What an iteration did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IterationStats {
    /// Camera subpaths.
    pub camera_paths: u64,
    /// Light subpaths.
    pub light_paths: u64,
    /// Light vertices that were stored for connections.
    pub light_vertices: u64,
}

/// The light subpaths `CHUNK * number` and on.
#[derive(Default)]
struct Chunk {
    vertices: Vec<Vertex>,
    /// Where each subpath's vertices end.
    ends: Vec<u32>,
    /// By band of the film.
    splats: Vec<Vec<Splat>>,
}

impl Chunk {
    fn path(&self, index: usize) -> &[Vertex] {
        let begin = if index == 0 { 0 } else { self.ends[index - 1] as usize };
        &self.vertices[begin..self.ends[index] as usize]
    }
}

/// Runs iterations. Keeps its memory from one to the next.
pub struct Renderer<'a> {
    scene: &'a Scene,
    settings: Settings,
    chunks: Vec<Chunk>,
}

impl<'a> Renderer<'a> {
    /// # Errors
    /// Settings that make no sense.
    pub fn new(scene: &'a Scene, settings: Settings) -> Result<Self> {
        settings.validate()?;
        Ok(Self { scene, settings, chunks: Vec::new() })
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Runs iteration `index`, a sample a pixel, into `film`. The same index gives the same samples to the bit,
    /// whatever ran before and on however many threads.
    pub fn iteration(&mut self, index: u64, film: &mut Film) -> IterationStats {
        let mut stats = IterationStats::default();
        if self.settings.needs_light_paths() {
            stats.light_paths = self.trace_light_paths(index, film);
            stats.light_vertices = self.chunks.iter().map(|c| c.vertices.len() as u64).sum();
        }
        let camera = self.settings.needs_camera_paths();
        if camera {
            let (width, height) = film.size();
            stats.camera_paths = (width * height) as u64;
        }
        let (scene, settings, chunks) = (self.scene, &self.settings, &self.chunks);
        let origin = UVec2::from(film.origin());
        film.for_each_band(|band| {
            for chunk in chunks {
                for splat in &chunk.splats[band.index] {
                    band.record(splat.pixel as usize - band.first_pixel(), &splat.sample());
                }
            }
            if camera {
                trace_band(scene, settings, chunks, index, origin, band);
            }
        });
        film.end_iteration();
        stats
    }

    /// Traces all light subpaths of the full frame, whatever the crop window, so that a crop is the crop of
    /// the full frame. Returns their number.
    fn trace_light_paths(&mut self, iteration: u64, film: &Film) -> u64 {
        let size = self.scene.camera.size();
        let paths = (size.x as f32 * size.y as f32 * LIGHT_PATHS_A_PIXEL) as u64;
        let (scene, settings) = (self.scene, &self.settings);
        let window = Window { origin: film.origin(), width: film.size().0, height: film.size().1 };
        let bands = film.bands();
        self.chunks.resize_with(paths.div_ceil(CHUNK) as usize, Chunk::default);
        self.chunks.par_iter_mut().enumerate().for_each(|(number, chunk)| {
            chunk.vertices.clear();
            chunk.ends.clear();
            chunk.splats.resize_with(bands, Vec::new);
            chunk.splats.iter_mut().for_each(Vec::clear);
            let first = number as u64 * CHUNK;
            let mut sink = SplatSink { window, splats: &mut chunk.splats };
            for path in first..(first + CHUNK).min(paths) {
                light_path::trace(scene, settings, iteration, path, &mut chunk.vertices, &mut sink);
                chunk.ends.push(chunk.vertices.len() as u32);
            }
        });
        paths
    }
}

/// The camera subpaths of a band's pixels.
fn trace_band(
    scene: &Scene,
    settings: &Settings,
    chunks: &[Chunk],
    iteration: u64,
    origin: UVec2,
    band: &mut Band,
) {
    let connect = settings.techniques.has(Technique::Connect);
    let frame_width = scene.camera.size().x as usize;
    for left in (0..band.width).step_by(TILE) {
        for row in 0..band.rows() {
            for column in left..(left + TILE).min(band.width) {
                let pixel = origin + UVec2::new(column as u32, (band.first_row + row) as u32);
                let partner = pixel.y as usize * frame_width + pixel.x as usize;
                let vertices = if connect {
                    chunks[partner / CHUNK as usize].path(partner % CHUNK as usize)
                } else {
                    &[]
                };
                let mut sink = PixelSink { pixel: row * band.width + column, band };
                camera_path::trace(scene, settings, iteration, pixel, vertices, &mut sink);
            }
        }
    }
}

/// A film's crop window.
#[derive(Clone, Copy)]
struct Window {
    origin: [u32; 2],
    width: usize,
    height: usize,
}

/// Sorts samples by the band that they fall on.
struct SplatSink<'a> {
    window: Window,
    splats: &'a mut [Vec<Splat>],
}

impl Sink for SplatSink<'_> {
    #[inline]
    fn record(&mut self, sample: &Sample, joint: &Joint) {
        let Joint::Lens(_, pixel) = joint else { return };
        let x = (pixel.x as usize).wrapping_sub(self.window.origin[0] as usize);
        let y = (pixel.y as usize).wrapping_sub(self.window.origin[1] as usize);
        if x < self.window.width && y < self.window.height {
            let pixel = (y * self.window.width + x) as u32;
            self.splats[y / BAND_ROWS].push(Splat::new(pixel, sample));
        }
    }
}

/// Puts every sample into one pixel of a band.
struct PixelSink<'a, 'b> {
    pixel: usize,
    band: &'a mut Band<'b>,
}

impl Sink for PixelSink<'_, '_> {
    #[inline]
    fn record(&mut self, sample: &Sample, _joint: &Joint) {
        self.band.record(self.pixel, sample);
    }
}
