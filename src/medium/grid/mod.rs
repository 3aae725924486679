//! Values on a regular grid, as functions of the point and along rays.
//!
//! A grid has n_x n_y n_z values in a box, each in the middle of its share of the box (its voxel). Between them the function is
//! trilinear, and out to the faces of the box it goes on as it is half a voxel before; or it is constant in each voxel. Outside
//! of the box it is 0.
//!
//! Along a ray the function is a polynomial in each cell that the ray crosses: a cubic where it is trilinear. The
//! Gauss-Legendre rule of two points integrates cubics exactly, and adds up what is not negative: so the integral over a part of
//! a cell has the precision of f32 whatever the part, and without the cancellation that a polynomial's coefficients bring.
//! It is inverted by Newton's method within a bracket.
//!
//! Cells are crossed one by one [Amanatides & Woo 1987], and blocks of 8³ of them at once where they hold nothing but
//! zeros. Of each block the largest value is known as well: [`Placed::track`] and [`Placed::ratio`] sample by it what the integral is
//! otherwise computed for. Values are stored in bricks of 4³ within bricks
//! of 16³, so that a ray in any direction finds neighbours in the same lines of the cache and pages of memory.

mod lattice;
mod placed;
mod texel;
mod track;
mod traverse;

pub use lattice::{Interpolation, Lattice};
pub use placed::Placed;
pub use texel::Texel;
