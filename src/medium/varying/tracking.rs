//! Flights and transmittance by random points: see [`super::super::grid`].
//!
//! A flight is sampled by what it meets, and nobody knows its density from the far end. But where the extinction is grey, a
//! flight's contribution over its density does not ask for the transmittance: it is in both. So what such a
//! flight reports is a stretch that is clear, and what a shadow ray estimates goes into its contribution alone; weights are
//! functions of the path still.

use super::super::grid::Placed;
use super::{Density, Extinction, Varying};
use crate::math::{Rgb, Stream};
use glam::Vec3A;

/// A voxel's largest optical depth with which points are still fewer than cells: beyond, rays meet more points than they cross
/// cells, which are known exactly.
const DENSEST: f64 = 1.0;

/// What of a medium's extinction is tracked.
type Tracked<'a> = (&'a Placed<f32>, f32);

impl Varying {
    /// Whether flights and shadow rays can be tracked here: the medium scatters, its extinction is grey and a density on a
    /// grid, and that is not so dense that its cells are the larger steps.
    pub(super) fn can_be_tracked(&self) -> bool {
        let Some((grid, sigma)) = self.grey() else { return false };
        let most = f64::from(sigma) * f64::from(grid.lattice().largest());
        self.scatters && most * grid.longest() <= DENSEST
    }

    #[inline]
    fn grey(&self) -> Option<Tracked<'_>> {
        match &self.extinction {
            Extinction::Scaled(Density::Grid(grid), sigma_t) if *sigma_t == Rgb::splat(sigma_t.x) => {
                Some((grid, sigma_t.x))
            }
            // Haze is in closed form.
            Extinction::Scaled(..) | Extinction::Colored(_) => None,
        }
    }

    #[inline]
    pub(in super::super) fn is_tracked(&self) -> bool {
        self.tracked
    }

    /// Where the next collision is on `origin` + t·`dir`, 0 < t < `t1`.
    #[inline]
    pub(in super::super) fn track(
        &self,
        origin: Vec3A,
        dir: Vec3A,
        t1: f32,
        random: &mut Stream,
    ) -> Option<f32> {
        let (grid, sigma) = self.grey()?;
        grid.track(origin, dir, (0.0, t1), sigma * self.phase.area(dir), random)
    }

    /// An estimate of the transmittance from 0 to `t1`.
    #[inline]
    pub(in super::super) fn ratio(&self, origin: Vec3A, dir: Vec3A, t1: f32, random: &mut Stream) -> f32 {
        let Some((grid, sigma)) = self.grey() else { return 1.0 };
        grid.ratio(origin, dir, (0.0, t1), sigma * self.phase.area(dir), random)
    }
}
