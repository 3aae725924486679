//! One iteration: light walks, then what merges need, then camera walks with their partners, then the film.

use super::camera_path::{self, Partners};
use super::light_path;
use super::merge::auto::{self, Chosen};
use super::merge::photons::Photons;
use super::merge::store::{CHUNK, Stored};
use super::merge::{Gathers, place_of};
use super::pass::Pass;
use super::settings::Settings;
use super::sink::{Joint, Sink};
use super::technique::{Technique, TechniqueSet};
use super::thinning::Thinning;
use crate::error::Result;
use crate::film::{BAND_ROWS, Band, Film, Sample, Splat};
use crate::math::Discrete;
use crate::scene::Scene;
use glam::UVec2;
use rayon::prelude::*;
use std::iter::Sum;
use std::ops::{Add, Range};

/// Pixels along the side of the squares in which a band is worked through: neighbours see the same surfaces.
const TILE: usize = BAND_ROWS;

/// What an iteration did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IterationStats {
    /// Camera subpaths.
    pub camera_paths: u64,
    /// Light subpaths.
    pub light_paths: u64,
    /// Light vertices that were stored for connections and merges.
    pub light_vertices: u64,
    /// Photon beams that were stored.
    pub beams: u64,
}

impl Add for IterationStats {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            camera_paths: self.camera_paths + other.camera_paths,
            light_paths: self.light_paths + other.light_paths,
            light_vertices: self.light_vertices + other.light_vertices,
            beams: self.beams + other.beams,
        }
    }
}

impl Sum for IterationStats {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), Add::add)
    }
}

/// Runs iterations. Keeps its memory from one to the next.
pub struct Renderer<'a> {
    scene: &'a Scene,
    settings: Settings,
    /// The same without the techniques that were left out.
    active: Settings,
    chosen: Chosen,
    chunks: Vec<Stored>,
}

impl<'a> Renderer<'a> {
    /// # Errors
    /// Settings that make no sense.
    pub fn new(scene: &'a Scene, settings: Settings) -> Result<Self> {
        settings.validate()?;
        let chosen = auto::resolve(scene, &settings);
        let active =
            Settings { techniques: settings.techniques.without(chosen.left_out), ..settings.with_tracking() };
        Ok(Self { scene, settings, active, chosen, chunks: Vec::new() })
    }

    /// How merges gather in the first iteration, with what was chosen where the settings left it open.
    pub fn gathers(&self) -> &Gathers {
        &self.chosen.gathers
    }

    /// Light subpaths that a technique would merge with if there were no bound on what is stored.
    ///
    /// # Panics
    /// For a technique that does not merge.
    pub fn no_room(&self, technique: Technique) -> u64 {
        self.chosen.no_room[place_of(technique).expect("a merge")]
    }

    /// Techniques that were asked for and are off, as they are not worth what they cost.
    pub fn left_out(&self) -> TechniqueSet {
        self.chosen.left_out
    }

    /// The probabilities with which light subpaths start on each light, where they were chosen; else it goes by power.
    pub fn starts(&self) -> Option<&Discrete> {
        self.chosen.starts.as_deref()
    }

    /// What is thinned out in each medium.
    pub fn thinning(&self) -> &Thinning {
        &self.chosen.thinning
    }

    /// The settings, as they were asked for.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The settings without the techniques that were left out.
    pub fn active(&self) -> &Settings {
        &self.active
    }

    /// The constants of iteration `index`.
    pub fn pass(&self, index: u64) -> Pass {
        let partners = u64::from(self.scene.camera.size().x) * u64::from(self.scene.camera.size().y);
        let gathers = self.chosen.gathers.at(index, &self.settings.merging);
        let (thinning, starts) = (&self.chosen.thinning, self.chosen.starts(self.scene));
        Pass::new(self.active, index, gathers, partners, thinning.clone(), starts.clone())
    }

    /// Whether [`Self::iterations`] takes less time for many than for as many times one.
    pub fn gains_from_many(&self) -> bool {
        self.active.needs_camera_paths() && !self.active.needs_light_paths()
    }

    /// Runs these iterations, each a sample a pixel, into `film`. The same index gives the same samples to the bit,
    /// whatever ran before, in however many goes and on however many threads.
    pub fn iterations(&mut self, indices: Range<u64>, film: &mut Film) -> IterationStats {
        if !self.gains_from_many() {
            return indices.map(|index| self.iteration(index, film)).sum();
        }
        // Without light subpaths a pixel's samples hang on no other's: so each pixel gets those of all the iterations while it
        // is at hand.
        let passes: Vec<Pass> = indices.map(|index| self.pass(index)).collect();
        let (scene, origin) = (self.scene, UVec2::from(film.origin()));
        film.iterate(passes.len(), |band| trace_band(scene, &passes, &[], None, origin, band));
        let (width, height) = film.size();
        IterationStats { camera_paths: (passes.len() * width * height) as u64, ..IterationStats::default() }
    }

    /// Runs iteration `index`, see [`Self::iterations`].
    pub fn iteration(&mut self, index: u64, film: &mut Film) -> IterationStats {
        let mut stats = IterationStats::default();
        let pass = self.pass(index);
        if self.active.needs_light_paths() {
            stats.light_paths = self.trace_light_paths(&pass, film);
            stats.light_vertices =
                self.chunks.iter().map(|c| c.vertices.len().max(c.photons.len()) as u64).sum();
            stats.beams = self.chunks.iter().map(|c| c.beams.len() as u64).sum();
        }
        let camera = self.active.needs_camera_paths();
        if camera {
            let (width, height) = film.size();
            stats.camera_paths = (width * height) as u64;
        }
        let (scene, chunks) = (self.scene, &self.chunks);
        let photons = self.active.techniques.merges().then(|| Photons::build(scene, &pass, chunks));
        let origin = UVec2::from(film.origin());
        let passes = std::slice::from_ref(&pass);
        film.iterate(1, |band| {
            let index = band.index;
            chunks.iter().for_each(|chunk| band.record_splats(&chunk.splats[index]));
            if camera {
                trace_band(scene, passes, chunks, photons.as_ref(), origin, band);
            }
        });
        stats
    }

    /// Traces all light subpaths of the full frame, whatever the crop window, so that a crop is the crop of
    /// the full frame. Returns their number.
    fn trace_light_paths(&mut self, pass: &Pass, film: &Film) -> u64 {
        let partners = if self.active.needs_partners() { pass.partners } else { 0 };
        let paths = partners.max(pass.merged_paths());
        let scene = self.scene;
        let window = Window { origin: film.origin(), width: film.size().0, height: film.size().1 };
        let bands = film.bands();
        self.chunks.resize_with(paths.div_ceil(CHUNK) as usize, Stored::default);
        // One by one, as a film's bands.
        self.chunks.par_iter_mut().enumerate().with_max_len(1).for_each(|(number, chunk)| {
            chunk.clear(bands);
            let first = number as u64 * CHUNK;
            let mut splats = std::mem::take(&mut chunk.splats);
            let mut sink = SplatSink { window, splats: &mut splats };
            for path in first..(first + CHUNK).min(paths) {
                light_path::trace(scene, pass, path, chunk, &mut sink);
                chunk.end_path();
            }
            chunk.splats = splats;
        });
        paths
    }
}

/// The camera subpaths of a band's pixels: of each pixel one in every iteration, one after the other, as they see much the same
/// and what is kept of the pixel is at hand then.
fn trace_band(
    scene: &Scene,
    passes: &[Pass],
    chunks: &[Stored],
    photons: Option<&Photons>,
    origin: UVec2,
    band: &mut Band,
) {
    let connect = passes.first().is_some_and(|pass| pass.on(Technique::Connect));
    let frame_width = scene.camera.size().x as usize;
    for left in (0..band.width).step_by(TILE) {
        let columns = left..(left + TILE).min(band.width);
        for row in 0..band.rows() {
            for column in columns.clone() {
                let pixel = origin + UVec2::new(column as u32, (band.first_row + row) as u32);
                let partner = pixel.y as usize * frame_width + pixel.x as usize;
                let vertices = if connect {
                    chunks[partner / CHUNK as usize].path(partner % CHUNK as usize)
                } else {
                    &[]
                };
                let place = row * band.width + column;
                band.expect_pixel(place);
                for (number, pass) in passes.iter().enumerate() {
                    band.begin(number);
                    let mut sink = PixelSink { pixel: place, band };
                    camera_path::trace(scene, pass, pixel, Partners { vertices, photons }, &mut sink);
                    band.settle(place);
                }
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
            let pixel = y % BAND_ROWS * self.window.width + x;
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
    #[inline(always)]
    fn record(&mut self, sample: &Sample, _joint: &Joint) {
        self.band.record(self.pixel, sample);
    }
}
