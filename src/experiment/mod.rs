//! Experiments: scenes × estimators × independent runs, measured against a reference.
//!
//! | file | what it does |
//! |---|---|
//! | [`file`], [`overrides`] | the experiment file, and `--set` |
//! | [`plan`], [`resolve`] | the file, checked and resolved |
//! | [`run`], [`cell`], `means`, `waited` | from the plan to the results on disk |
//! | [`work`], [`store`] | a run block by block, and how far it has come on disk |
//! | [`status`], [`moved`] | what is done and what is left; scenes that were called otherwise |
//! | [`reference`], `blocks` | what is measured against: rendered, kept, extended |
//! | [`metrics`], [`statistics`], [`measure`], [`split`] | errors of images, and numbers over runs |
//! | [`shares`], [`costs`] | what each technique adds, causes and costs |
//! | [`results`], [`numbers`], [`older`], [`csv`] | what is left behind |

mod blocks;
pub mod cell;
mod contents;
pub mod costs;
pub mod csv;
pub mod file;
pub mod handout;
pub mod hash;
pub mod leftovers;
pub mod machine;
mod means;
pub mod measure;
pub mod metrics;
pub mod moved;
pub mod numbers;
pub mod older;
pub mod overrides;
pub mod plan;
pub mod reference;
pub mod resolve;
pub mod results;
pub mod run;
pub mod shares;
pub mod split;
pub mod statistics;
pub mod status;
pub mod store;
mod waited;
pub mod work;
