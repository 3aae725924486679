//! Merges: techniques that take a vertex of a light subpath and one of a camera subpath for the same, if they are near.
//!
//! One file a technique: [`surface`], [`point_point`] (P-P3D), [`point_beam`] (P-B2D), [`beam_point`] (B-P2D) and [`beam_beam`]
//! (B-B1D) [Křivánek et al. 2014]. What they find they give to [`join`], which makes a weighted sample of it. Structures
//! to find it by are built once an iteration: a hashed [`grid`] of points, trees of [`boxes`] about points and beams; see [`photons`].
//!
//! Every camera vertex and every camera ray merges. Both vertices have to lie in the same medium.
//!
//! Which of them are worth their cost in a scene, and how many merges of each: a [`pilot`] makes a few thousand samples, [`evidence`] says what
//! error other numbers would have, [`cost`] what they take, and [`choice`] looks for the best; [`auto`] turns it into radii and counts.
//! By the same evidence [`starts`] shares out light subpaths among the lights, whether or not something merges.
//!
//! In a medium that varies the two places that are taken for one have different coefficients. Where a beam is merged with
//! a point, those at the point are taken for both arms, and of two beams those on the camera's: so what a point's free flight was
//! divided by is what it is multiplied by, and no thin place gives a large sample; in P-P3D each arm has its own, and the
//! camera's scatters. Where extinction goes with the direction, too, the rate of each arm is that of its own direction, and the value
//! is the same from either side. What is estimated is then σ_s times the light, blurred by the kernel, which is a bias of second order in the
//! radius over the size of a grid's voxels.

pub mod auto;
pub mod beam_beam;
pub mod beam_point;
pub mod boxes;
pub mod choice;
pub mod cost;
pub mod evidence;
pub mod file;
pub mod gather;
pub mod grid;
pub mod join;
pub mod kernel;
pub mod moments;
pub mod photons;
pub mod pilot;
pub mod point_beam;
pub mod point_point;
pub mod settings;
pub mod starts;
pub mod store;
pub mod surface;

pub use file::MergeDef;
pub use gather::{GatherNow, Gathers};
pub use join::Arm;
pub use kernel::Kernel;
pub use photons::Photons;
pub use settings::{Beams, Gather, MERGES, MergeSettings, PathCount, Radius, place_of};
pub use store::{Beam, Photon, Stored};
