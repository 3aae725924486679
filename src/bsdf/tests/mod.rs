//! What the BSDFs promise, checked over one table of materials.

mod identities;
mod microfacet;
mod parameters;
mod sampling;
mod specular;
mod table;
