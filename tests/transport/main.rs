//! What proves the transport right (verification.md), rung by rung.
//!
//! The statistical tests use fixed seeds and share one significance of 1e-3 over all their comparisons; each states the
//! smallest relative bias of the image mean that it sees with probability 0.9.

// Formulas over a path are written by index, as in the papers.
#![allow(clippy::needless_range_loop)]

mod agreement;
mod chosen;
mod closed_forms;
mod collect;
mod film;
mod flakes;
mod grids;
mod invariants;
mod lengths;
mod measure;
mod media_agreement;
mod media_chromatic;
mod media_closed_forms;
mod media_furnace;
mod media_invariants;
mod media_scattering;
mod media_slabs;
mod merge_blur;
mod merge_classes;
mod merge_furnace;
mod merges;
mod merging;
mod our_scenes;
mod radiative;
mod rare;
mod scenes;
mod specular;
mod tracking;
mod visibility;
mod weights;

use tyndall::oracle;
