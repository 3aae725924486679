//! A medium that is not the same everywhere: a grid of density times constant coefficients, grids of coefficients, or a
//! density in closed form.
//!
//! With one density for all channels the optical depths of the channels are multiples of one integral. Where σ_t is a grid of
//! colours, the three integrals run together. Either way the depth is exact but for rounding, and the same from both ends; what is
//! sampled by it has a density that both subpaths know. Tracking by majorants ([`tracking`]) is an option for sets of techniques that
//! do not ask for that.

mod tracking;

use super::decay::decay;
use super::grid::Placed;
use super::height::HeightFog;
use super::{Coefficients, MediumSummary, Phase};
use crate::math::{Rgb, RgbExt};
use glam::{Vec3, Vec3A};

/// How extinction varies.
#[derive(Clone, Debug)]
pub enum Extinction {
    /// σ_t = `sigma_t` times a density.
    Scaled(Density, Rgb),
    /// σ_t is a grid, 1/m.
    Colored(Box<Placed<Vec3>>),
}

/// A density, the same in all channels.
#[derive(Clone, Debug)]
pub enum Density {
    /// On a grid.
    Grid(Box<Placed<f32>>),
    /// Haze over a level.
    Height(HeightFog),
}

/// How much of the extinction is scattering.
#[derive(Clone, Debug)]
pub enum Scattering {
    /// The share that is scattered, everywhere.
    Albedo(Rgb),
    /// The share that is scattered, by place.
    AlbedoGrid(Box<Placed<Vec3>>),
    /// σ_s by place, 1/m.
    Rates(Box<Placed<Vec3>>),
}

/// What shines.
#[derive(Clone, Debug)]
pub enum Emission {
    /// Nothing.
    None,
    /// A colour times the density: W/(sr m³) where the density is 1.
    WithDensity(Rgb),
    /// A colour times a grid.
    Scaled(Box<Placed<f32>>, Rgb),
    /// A colour times a grid of colours.
    Colored(Box<Placed<Vec3>>, Rgb),
}

/// A medium that is a function of the place.
#[derive(Clone, Debug)]
pub struct Varying {
    extinction: Extinction,
    scattering: Scattering,
    emission: Emission,
    phase: Phase,
    scatters: bool,
    emissive: bool,
    /// Whether it can be tracked.
    tracked: bool,
}

/// Cells that a ray crosses between two depths that are kept along a beam, about.
const CELLS: f64 = 4.0;
/// An optical depth by a formula takes as long as so many cells.
const FORMULA: f32 = 4.0;
/// Depths that are kept along a beam at most.
const MOST: f32 = 512.0;

/// Optical depth that no picture shows.
const NOTHING: f32 = 1e-7;

impl Varying {
    /// Of its parts.
    ///
    /// # Errors
    /// Colours that are negative or not finite, albedos above 1, more scattering than extinction, and emission that should go
    /// with a density where there is none.
    pub fn new(
        extinction: Extinction,
        scattering: Scattering,
        emission: Emission,
        phase: Phase,
    ) -> Result<Self, String> {
        let valid = |what: &str, c: Rgb| match c.is_finite() && c.min_element() >= 0.0 {
            true => Ok(()),
            false => Err(format!("{what} must be finite and not negative in each channel, found {c}")),
        };
        if let Extinction::Scaled(_, sigma_t) = &extinction {
            valid("sigma_t", *sigma_t)?;
        }
        let largest = match &scattering {
            Scattering::Albedo(albedo) => {
                valid("albedo", *albedo)?;
                albedo.max_element()
            }
            Scattering::AlbedoGrid(grid) => largest(grid),
            Scattering::Rates(_) => 0.0,
        };
        if largest > 1.0 {
            return Err(format!(
                "albedo must be at most 1 in each channel, found {largest}: a medium cannot scatter more light than \
                 collides"
            ));
        }
        if let Scattering::Rates(rates) = &scattering {
            let Extinction::Colored(sigma_t) = &extinction else {
                return Err("a grid of scattering needs one of extinction".into());
            };
            let same = rates.is_like(sigma_t);
            if !same
                || rates.lattice().values().zip(sigma_t.lattice().values()).any(|(s, t)| s.cmpgt(t).any())
            {
                return Err("the grid of scattering is not like that of extinction, or above it".into());
            }
        }
        let emissive = match &emission {
            Emission::None => false,
            Emission::WithDensity(e) => {
                valid("emission", *e)?;
                if matches!(extinction, Extinction::Colored(_)) {
                    return Err("emission that goes with the density needs a density".into());
                }
                !e.is_black()
            }
            Emission::Scaled(grid, e) => {
                valid("emission", *e)?;
                !e.is_black() && grid.lattice().values().any(|v| v > 0.0)
            }
            Emission::Colored(grid, e) => {
                valid("emission", *e)?;
                grid.lattice().values().any(|v| (Vec3A::from(v) * *e).max_element() > 0.0)
            }
        };
        let mut built =
            Self { extinction, scattering, emission, phase, scatters: true, emissive, tracked: false };
        built.scatters = !built.summary().sigma_s.is_black();
        built.tracked = built.can_be_tracked();
        Ok(built)
    }

    #[inline]
    fn sigma_t(&self, p: Vec3A) -> Rgb {
        match &self.extinction {
            Extinction::Scaled(Density::Grid(grid), sigma_t) => *sigma_t * grid.value(p),
            Extinction::Scaled(Density::Height(fog), sigma_t) => *sigma_t * fog.value(p),
            Extinction::Colored(grid) => grid.value(p),
        }
    }

    #[inline]
    pub(super) fn coefficients(&self, p: Vec3A) -> Coefficients {
        let sigma_t = self.sigma_t(p);
        let sigma_s = match &self.scattering {
            Scattering::Albedo(albedo) => sigma_t * *albedo,
            Scattering::AlbedoGrid(grid) => sigma_t * grid.value(p),
            // Rounding must not make it more.
            Scattering::Rates(grid) => grid.value(p).min(sigma_t),
        };
        Coefficients { sigma_t, sigma_s }
    }

    #[inline]
    pub(super) fn optical_depth(&self, origin: Vec3A, dir: Vec3A, t0: f32, t1: f32) -> Rgb {
        match &self.extinction {
            Extinction::Scaled(Density::Grid(grid), sigma_t) => {
                *sigma_t * self.phase.area(dir) * grid.integral(origin, dir, t0, t1) as f32
            }
            Extinction::Scaled(Density::Height(fog), sigma_t) => {
                let integral = self.phase.area(dir) * fog.integral(origin, dir, t0, t1) as f32;
                // 0·∞ is 0 here, as in a homogeneous medium.
                Rgb::select(sigma_t.cmpgt(Rgb::ZERO), *sigma_t * integral, Rgb::ZERO)
            }
            Extinction::Colored(grid) => grid.integral(origin, dir, t0, t1).as_vec3a() * self.phase.area(dir),
        }
    }

    #[inline]
    pub(super) fn scatters(&self) -> bool {
        self.scatters
    }

    #[inline]
    pub(super) fn invert(
        &self,
        origin: Vec3A,
        dir: Vec3A,
        t0: f32,
        t1: f32,
        channel: usize,
        depth: f32,
    ) -> Result<f32, f32> {
        self.fly(origin, dir, t0, t1, channel, depth).0
    }

    /// [`Self::invert`], and the depth from `t0` to there, or over all of it: a grid is crossed once for both.
    #[inline]
    pub(super) fn fly(
        &self,
        origin: Vec3A,
        dir: Vec3A,
        t0: f32,
        t1: f32,
        channel: usize,
        depth: f32,
    ) -> (Result<f32, f32>, Rgb) {
        if t0 >= t1 {
            return (Err(depth), Rgb::ZERO);
        }
        let wanted = f64::from(depth);
        let left = |passed: f64| (wanted - passed).max(0.0) as f32;
        let area = self.phase.area(dir);
        match &self.extinction {
            Extinction::Colored(grid) => {
                let wide = f64::from(area);
                match grid.advance(origin, dir, t0, t1, channel, wanted / wide) {
                    Ok((t, sum)) => (Ok(t), sum.as_vec3a() * area),
                    Err(sum) => (Err(left(wide * sum[channel])), sum.as_vec3a() * area),
                }
            }
            Extinction::Scaled(Density::Grid(grid), sigma_t) if sigma_t[channel] > 0.0 => {
                let sigma_t = *sigma_t * area;
                let sigma = f64::from(sigma_t[channel]);
                match grid.advance(origin, dir, t0, t1, channel, wanted / sigma) {
                    Ok((t, sum)) => (Ok(t), sigma_t * sum as f32),
                    Err(sum) => (Err(left(sigma * sum)), sigma_t * sum as f32),
                }
            }
            Extinction::Scaled(density, sigma_t) => {
                let sigma = f64::from(sigma_t[channel] * area);
                let end = match density {
                    Density::Height(fog) if sigma > 0.0 => {
                        fog.invert(origin, dir, t0, t1, wanted / sigma).map_err(|sum| left(sigma * sum))
                    }
                    _ => Err(depth),
                };
                (end, self.optical_depth(origin, dir, t0, end.unwrap_or(t1)))
            }
        }
    }

    /// Where the depth of every channel has reached `depth`, or where nothing comes any more; at most `t1`.
    pub(super) fn reach(&self, origin: Vec3A, dir: Vec3A, t1: f32, depth: f32) -> f32 {
        let end = match &self.extinction {
            Extinction::Scaled(Density::Grid(grid), _) => grid.crossing(origin, dir, 0.0, t1).map(|c| c.1),
            Extinction::Colored(grid) => grid.crossing(origin, dir, 0.0, t1).map(|c| c.1),
            // Haze has no end, but on the way up soon all of its depth is behind.
            Extinction::Scaled(Density::Height(_), sigma_t) => {
                let thickest = sigma_t.max_position();
                let whole = self.optical_depth(origin, dir, 0.0, t1)[thickest];
                let most = (whole - NOTHING).min(whole * (1.0 - 2f32.powi(-22)));
                Some(self.invert(origin, dir, 0.0, t1, thickest, most).unwrap_or(t1))
            }
        };
        let Some(end) = end else { return 0.0 };
        let of = |channel| self.invert(origin, dir, 0.0, end, channel, depth).unwrap_or(end);
        match &self.extinction {
            // The depth of the least extinction is reached last.
            Extinction::Scaled(_, sigma_t) => of(sigma_t.min_position()),
            Extinction::Colored(_) => of(0).max(of(1)).max(of(2)),
        }
    }

    #[inline]
    pub(super) fn phase(&self) -> &Phase {
        &self.phase
    }

    #[inline]
    pub(super) fn is_emissive(&self) -> bool {
        self.emissive
    }

    pub(super) fn shines_without_bound(&self) -> bool {
        match (&self.emission, &self.extinction) {
            (Emission::WithDensity(e), Extinction::Scaled(Density::Height(_), sigma_t)) => {
                (e.cmpgt(Rgb::ZERO) & sigma_t.cmpeq(Rgb::ZERO)).any()
            }
            _ => false,
        }
    }

    /// Emission that goes with the density is in closed form, e/σ (1 − exp(−τ)). That of a grid is integrated
    /// numerically, to the precision of f32.
    pub(super) fn emitted(&self, origin: Vec3A, dir: Vec3A, t0: f32, t1: f32) -> Rgb {
        match (&self.emission, &self.extinction) {
            (Emission::None, _) => Rgb::ZERO,
            (Emission::WithDensity(e), Extinction::Scaled(density, sigma_t)) => {
                let integral = match density {
                    Density::Grid(grid) => grid.integral(origin, dir, t0, t1),
                    Density::Height(fog) => fog.integral(origin, dir, t0, t1),
                };
                let area = self.phase.area(dir);
                let channel = |i: usize| {
                    let (e, sigma) = (f64::from(e[i]), f64::from(sigma_t[i] * area));
                    let emitted = if e == 0.0 {
                        0.0
                    } else if sigma > 0.0 {
                        e / sigma * -(-sigma * integral).exp_m1()
                    } else {
                        e * integral
                    };
                    emitted as f32
                };
                Rgb::new(channel(0), channel(1), channel(2))
            }
            (Emission::WithDensity(_), Extinction::Colored(_)) => Rgb::ZERO,
            (Emission::Scaled(grid, e), _) => {
                let along = |t: f32| *e * grid.value(origin + dir * t);
                self.emitted_by(grid.crossing(origin, dir, t0, t1), origin, dir, t0, along)
            }
            (Emission::Colored(grid, e), _) => {
                let along = |t: f32| *e * grid.value(origin + dir * t);
                self.emitted_by(grid.crossing(origin, dir, t0, t1), origin, dir, t0, along)
            }
        }
    }

    /// ∫ e exp(−∫ σ_t) over the part `crossing` of a ray, where e is smooth within voxels of all grids.
    fn emitted_by(
        &self,
        crossing: Option<(f32, f32)>,
        origin: Vec3A,
        dir: Vec3A,
        t0: f32,
        emission: impl Fn(f32) -> Rgb,
    ) -> Rgb {
        let Some((from, to)) = crossing else { return Rgb::ZERO };
        // Where any of the functions has a kink.
        let mut cuts = vec![from, to];
        let mut cut = |a: f64, b: f64| cuts.extend([a as f32, b as f32]);
        match &self.emission {
            Emission::Scaled(grid, _) => grid.pieces(origin, dir, from, to, &mut cut),
            Emission::Colored(grid, _) => grid.pieces(origin, dir, from, to, &mut cut),
            Emission::None | Emission::WithDensity(_) => {}
        }
        match &self.extinction {
            Extinction::Scaled(Density::Grid(grid), _) => grid.pieces(origin, dir, from, to, &mut cut),
            Extinction::Colored(grid) => grid.pieces(origin, dir, from, to, &mut cut),
            Extinction::Scaled(Density::Height(_), _) => {}
        }
        cuts.sort_by(f32::total_cmp);
        let mut before = self.optical_depth(origin, dir, t0, from);
        let mut radiance = Rgb::ZERO;
        for pair in cuts.windows(2).filter(|pair| pair[0] < pair[1] && pair[1] <= to) {
            let whole = self.optical_depth(origin, dir, pair[0], pair[1]);
            // Deep pieces are cut up further: within a part the light falls by no more than a half or so.
            let parts = (2.0 * whole.max_element()).ceil().clamp(1.0, 64.0);
            let width = (pair[1] - pair[0]) / parts;
            for i in 0..parts as usize {
                let a = pair[0] + i as f32 * width;
                for (node, weight) in GAUSS_4 {
                    let t = a + width * node;
                    let depth = before + self.optical_depth(origin, dir, a, t);
                    radiance += emission(t) * decay(depth) * (weight * width);
                }
                before += self.optical_depth(origin, dir, a, a + width);
            }
        }
        radiance
    }

    /// How many cells lie along a way of this length; of what is given by a formula, as many as that takes the time of.
    pub(super) fn cells(&self, length: f32) -> f32 {
        let voxel = match &self.extinction {
            Extinction::Scaled(Density::Height(_), _) => return FORMULA,
            Extinction::Scaled(Density::Grid(grid), _) => grid.voxel(),
            Extinction::Colored(grid) => grid.voxel(),
        };
        (f64::from(length) / voxel) as f32
    }

    /// Adds depths along a beam to `depths`, from which [`Self::depth_along`] finds those between.
    pub(super) fn depths_along(&self, origin: Vec3A, dir: Vec3A, length: f32, depths: &mut Vec<f32>) {
        let voxel = match &self.extinction {
            Extinction::Scaled(Density::Height(_), _) => return,
            Extinction::Scaled(Density::Grid(grid), _) => grid.voxel(),
            Extinction::Colored(grid) => grid.voxel(),
        };
        let n = (f64::from(length) / (CELLS * voxel)).ceil().clamp(1.0, f64::from(MOST)) as usize;
        match &self.extinction {
            Extinction::Scaled(Density::Grid(grid), _) => {
                grid.integrals(origin, dir, length, n, |sum| depths.push(sum as f32));
            }
            Extinction::Colored(grid) => {
                grid.integrals(origin, dir, length, n, |sum| depths.extend(sum.as_vec3().to_array()));
            }
            Extinction::Scaled(Density::Height(_), _) => {}
        }
    }

    /// The optical depth from the start of a beam of this `length` to `t`, where `depths` are those kept along it.
    pub(super) fn depth_along(
        &self,
        depths: &[f32],
        (origin, dir, length): (Vec3A, Vec3A, f32),
        t: f32,
    ) -> Rgb {
        let a_place = if matches!(self.extinction, Extinction::Colored(_)) { 3 } else { 1 };
        let n = depths.len() / a_place + 1;
        let i = ((t / length * n as f32) as usize).min(n - 1);
        let from = length * (i as f32 / n as f32);
        let rest = self.optical_depth(origin, dir, from.min(t), t);
        if i == 0 {
            return rest;
        }
        // Those that are kept are as if all were seen.
        let area = self.phase.area(dir);
        match &self.extinction {
            Extinction::Scaled(_, sigma_t) => *sigma_t * area * depths[i - 1] + rest,
            Extinction::Colored(_) => Rgb::from_slice(&depths[3 * (i - 1)..3 * i]) * area + rest,
        }
    }

    /// The boxes outside of which there is nothing, by their corners; none where it has no end.
    pub fn boxes(&self) -> Vec<[Vec3A; 8]> {
        match &self.extinction {
            Extinction::Scaled(Density::Grid(grid), _) => vec![grid.corners()],
            Extinction::Colored(grid) => vec![grid.corners()],
            Extinction::Scaled(Density::Height(_), _) => Vec::new(),
        }
    }

    /// Bytes of all grids.
    pub fn bytes(&self) -> usize {
        let extinction = match &self.extinction {
            Extinction::Scaled(Density::Grid(grid), _) => grid.lattice().bytes(),
            Extinction::Colored(grid) => grid.lattice().bytes(),
            Extinction::Scaled(Density::Height(_), _) => 0,
        };
        let scattering = match &self.scattering {
            Scattering::Albedo(_) => 0,
            Scattering::AlbedoGrid(grid) | Scattering::Rates(grid) => grid.lattice().bytes(),
        };
        let emission = match &self.emission {
            Emission::None | Emission::WithDensity(_) => 0,
            Emission::Scaled(grid, _) => grid.lattice().bytes(),
            Emission::Colored(grid, _) => grid.lattice().bytes(),
        };
        extinction + scattering + emission
    }

    /// σ_t as a collision finds it on average: the mean over the medium's extinction, not over its volume, and over all directions.
    pub(super) fn typical(&self) -> Rgb {
        let where_most_is_seen = match &self.extinction {
            Extinction::Scaled(Density::Height(_), sigma_t) => *sigma_t,
            Extinction::Scaled(Density::Grid(grid), sigma_t) => {
                let (sum, squares) = grid.lattice().values().fold((0.0, 0.0), |(sum, squares), v| {
                    let v = f64::from(v);
                    (sum + v, squares + v * v)
                });
                *sigma_t * if sum > 0.0 { (squares / sum) as f32 } else { 0.0 }
            }
            Extinction::Colored(grid) => {
                let zero = glam::DVec3::ZERO;
                let (sum, squares) = grid.lattice().values().fold((zero, zero), |(sum, squares), v| {
                    let v = v.as_dvec3();
                    (sum + v, squares + v * v)
                });
                glam::DVec3::select(sum.cmpgt(zero), squares / sum, zero).as_vec3a()
            }
        };
        where_most_is_seen * self.phase.mean_area()
    }

    pub(super) fn summary(&self) -> MediumSummary {
        let (kind, sigma_t) = match &self.extinction {
            Extinction::Scaled(Density::Height(_), sigma_t) => ("height fog", *sigma_t),
            Extinction::Scaled(Density::Grid(grid), sigma_t) => ("grid", *sigma_t * mean(grid).x),
            Extinction::Colored(grid) => ("grid of colours", mean(grid)),
        };
        let mean_area = self.phase.mean_area();
        let sigma_t = sigma_t * mean_area;
        let there = sigma_t.cmpgt(Rgb::ZERO);
        let sigma_s = match &self.scattering {
            Scattering::Albedo(albedo) => sigma_t * *albedo,
            Scattering::Rates(grid) => mean(grid) * mean_area,
            // Not weighted with the density: for people only.
            Scattering::AlbedoGrid(grid) => sigma_t * mean(grid),
        };
        MediumSummary {
            kind,
            sigma_t,
            sigma_s,
            emission: match &self.emission {
                Emission::None => Rgb::ZERO,
                Emission::WithDensity(e) => match &self.extinction {
                    Extinction::Scaled(Density::Grid(grid), _) => *e * mean(grid).x,
                    _ => *e,
                },
                Emission::Scaled(grid, e) => *e * mean(grid).x,
                Emission::Colored(grid, e) => *e * mean(grid),
            },
            mean_free_path: Rgb::select(there, sigma_t.recip(), Rgb::INFINITY),
            is_directional: self.phase.is_directional(),
            albedo: Rgb::select(there, sigma_s / sigma_t, Rgb::ZERO),
            phase: self.phase.describe(),
            mean_cosine: self.phase.mean_cosine(),
        }
    }
}

/// The Gauss-Legendre rule of four points on 0..1: nodes and weights.
const GAUSS_4: [(f32, f32); 4] = [
    (0.069_431_84, 0.173_927_42),
    (0.330_009_5, 0.326_072_58),
    (0.669_990_5, 0.326_072_58),
    (0.930_568_16, 0.173_927_42),
];

fn largest(grid: &Placed<Vec3>) -> f32 {
    grid.lattice().values().map(Vec3::max_element).fold(0.0, f32::max)
}

/// The mean over the box: of trilinear values too it is that of the values, as each of them has as much of the box.
fn mean<T: super::grid::Texel>(grid: &Placed<T>) -> Rgb {
    let count = grid.lattice().size().as_dvec3().element_product();
    let sum = grid.lattice().values().fold(glam::DVec3::ZERO, |sum, v| {
        let channel = |c| f64::from(T::channel(v.wide(), c));
        sum + glam::DVec3::new(channel(0), channel(1), channel(2))
    });
    (sum / count).as_vec3a()
}
