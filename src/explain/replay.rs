//! An iteration walked again for one pixel.

use crate::error::{Error, Result};
use crate::film::Sample;
use crate::math::RgbExt;
use crate::oracle::collect::{Recorder, Traced, whole_path};
use crate::scene::Scene;
use crate::transport::Renderer;
use crate::transport::camera_path::{self, Partners};
use crate::transport::light_path;
use crate::transport::merge::store::CHUNK;
use crate::transport::merge::{Photons, Stored};
use crate::transport::pass::Pass;
use crate::transport::settings::Settings;
use crate::transport::sink::{Joint, Sink};
use crate::transport::technique::Technique;
use glam::UVec2;
use rayon::prelude::*;

/// A sample of the pixel.
#[derive(Clone, Debug)]
pub struct Found {
    /// The iteration that it is of.
    pub iteration: u64,
    /// The sample.
    pub sample: Sample,
    /// Luminance of what it adds to the pixel in its iteration.
    pub luminance: f32,
    /// The whole path; none of what glows in a medium, which no one weighs, and of merges on a wall.
    pub traced: Option<Traced>,
}

/// Walks iterations of a render again.
pub struct Replay<'a> {
    scene: &'a Scene,
    renderer: Renderer<'a>,
    pixel: UVec2,
}

/// Keeps what light subpaths add to one pixel by way of the lens.
struct OnPixel {
    pixel: UVec2,
    path: u64,
    found: Vec<(u64, Sample, Joint)>,
}

impl Sink for OnPixel {
    fn record(&mut self, sample: &Sample, joint: &Joint) {
        if matches!(joint, Joint::Lens(_, pixel) if *pixel == self.pixel) {
            self.found.push((self.path, *sample, *joint));
        }
    }
}

impl<'a> Replay<'a> {
    /// Of a render with these settings, for a pixel of the full frame.
    ///
    /// # Errors
    /// Settings that make no sense, and a pixel outside what is rendered.
    pub fn new(scene: &'a Scene, settings: Settings, pixel: UVec2) -> Result<Self> {
        let crop = scene.camera.crop();
        if !(crop.x0..crop.x1).contains(&pixel.x) || !(crop.y0..crop.y1).contains(&pixel.y) {
            return Err(Error::usage(format!(
                "pixel {},{} lies outside the image, which has columns {} to {} and rows {} to {}",
                pixel.x,
                pixel.y,
                crop.x0,
                crop.x1 - 1,
                crop.y0,
                crop.y1 - 1
            )));
        }
        Ok(Self { scene, renderer: Renderer::new(scene, settings)?, pixel })
    }

    /// The settings of the render.
    pub fn settings(&self) -> &Settings {
        self.renderer.settings()
    }

    /// The constants of an iteration, as the render had them.
    pub fn pass(&self, iteration: u64) -> Pass {
        self.renderer.pass(iteration)
    }

    /// Every sample that an iteration adds to the pixel.
    pub fn iteration(&self, iteration: u64) -> Vec<Found> {
        let (scene, settings, pass) = (self.scene, self.renderer.active(), self.pass(iteration));
        let partners = if settings.needs_partners() { pass.partners } else { 0 };
        let paths = if settings.needs_light_paths() { partners.max(pass.merged_paths()) } else { 0 };
        let walked: Vec<(Stored, OnPixel)> = (0..paths.div_ceil(CHUNK))
            .into_par_iter()
            .map(|number| {
                let mut stored = Stored::default();
                let mut sink = OnPixel { pixel: self.pixel, path: 0, found: Vec::new() };
                for path in number * CHUNK..((number + 1) * CHUNK).min(paths) {
                    sink.path = path;
                    light_path::trace(scene, &pass, path, &mut stored, &mut sink);
                    stored.end_path();
                }
                (stored, sink)
            })
            .collect();
        let (chunks, sinks): (Vec<Stored>, Vec<OnPixel>) = walked.into_iter().unzip();
        let mut found = Vec::new();
        let nobody = Recorder::default();
        for (path, sample, joint) in sinks.iter().flat_map(|s| &s.found) {
            let light = self.light(&pass, *path);
            found.push(self.found(iteration, &light, &nobody, sample, joint));
        }
        if settings.needs_camera_paths() {
            let photons = settings.techniques.merges().then(|| Photons::build(scene, &pass, &chunks));
            let index = u64::from(self.pixel.y) * u64::from(scene.camera.size().x) + u64::from(self.pixel.x);
            let vertices = if pass.on(Technique::Connect) {
                chunks[(index / CHUNK) as usize].path((index % CHUNK) as usize)
            } else {
                &[]
            };
            let mut camera = Recorder::default();
            let partners = Partners { vertices, photons: photons.as_ref() };
            camera_path::trace(scene, &pass, self.pixel, partners, &mut camera);
            for (sample, joint) in &camera.samples {
                let light = match joint {
                    Joint::Merge(meeting) => self.light(&pass, meeting.path.into()),
                    Joint::Connect(_) => self.light(&pass, index),
                    _ => Recorder::default(),
                };
                found.push(self.found(iteration, &light, &camera, sample, joint));
            }
        }
        found
    }

    /// A light subpath, walked again.
    fn light(&self, pass: &Pass, path: u64) -> Recorder {
        Recorder::of_light(self.scene, pass, path)
    }

    fn found(
        &self,
        iteration: u64,
        light: &Recorder,
        camera: &Recorder,
        sample: &Sample,
        joint: &Joint,
    ) -> Found {
        let weighed = !matches!(joint, Joint::Glow);
        Found {
            iteration,
            sample: *sample,
            luminance: (sample.contribution * sample.weight).luminance(),
            traced: weighed.then(|| whole_path(self.scene, light, camera, sample, joint)).flatten(),
        }
    }
}
