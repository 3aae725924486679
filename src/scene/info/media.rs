//! What there is to tell of a scene's media.

use super::{Scene, extent};
use crate::medium::Medium;
use serde::Serialize;
use std::fmt;

/// A medium. What is infinite is `null` in JSON.
#[derive(Clone, Debug, Serialize)]
pub struct MediumInfo {
    /// Its name.
    pub name: String,
    /// What kind it is.
    pub kind: &'static str,
    /// Mean distance to a collision, each channel: the reciprocal of the extinction's mean.
    pub mean_free_path: [f32; 3],
    /// Whether extinction goes with the direction, too; the mean is over all directions then.
    pub is_directional: bool,
    /// The same in diagonals of the scene's extent; `None` without a shape.
    pub free_path_of_extent: Option<[f32; 3]>,
    /// The share of collisions that scatter, each channel.
    pub albedo: [f32; 3],
    /// The phase function in words.
    pub phase: String,
    /// Mean cosine of the deflection, g: 1 straight on, -1 straight back.
    pub mean_cosine: f32,
    /// Radiance that a metre emits, W/(sr m³).
    pub emission: [f32; 3],
    /// Names of the shapes that it is in, the foremost first; `world` where it is about them all.
    pub fills: Vec<String>,
}

/// Of all media, in order.
pub(super) fn media(scene: &Scene) -> Vec<MediumInfo> {
    let diagonal = extent(scene).map(|e| e.diagonal);
    let fills = |index: u32| {
        let solids = scene.solids.all().iter().filter(|s| s.medium == index);
        let shapes = solids.map(|s| scene.shape_names[s.shape as usize].clone());
        shapes.chain((scene.solids.world() == index).then(|| "world".to_owned())).collect()
    };
    let info = |(i, (name, medium)): (usize, (&String, &Medium))| {
        let summary = medium.summary();
        MediumInfo {
            name: name.clone(),
            kind: summary.kind,
            mean_free_path: summary.mean_free_path.into(),
            is_directional: summary.is_directional,
            free_path_of_extent: diagonal.map(|d| (summary.mean_free_path / d).into()),
            albedo: summary.albedo.into(),
            phase: summary.phase,
            mean_cosine: summary.mean_cosine,
            emission: summary.emission.into(),
            fills: fills(i as u32),
        }
    };
    scene.notes.medium_names.iter().zip(&scene.media).enumerate().map(info).collect()
}

/// A table of media, as text; nothing where there are none.
pub(super) fn write(media: &[MediumInfo], f: &mut fmt::Formatter) -> fmt::Result {
    match media.len() {
        0 => return Ok(()),
        1 => writeln!(f, "\n1 medium")?,
        n => writeln!(f, "\n{n} media")?,
    }
    let w = media.iter().map(|m| m.name.chars().count()).max().unwrap_or(0).max(6);
    for m in media {
        let (name, kind, phase) = (&m.name, m.kind, &m.phase);
        let [r, g, b] = m.albedo;
        writeln!(f, "  {name:<w$}  {kind:<11}  albedo {r:.3} {g:.3} {b:.3}, {phase}")?;
        let [r, g, b] = m.mean_free_path;
        write!(f, "  {:<w$}  mean free path {r:.4} {g:.4} {b:.4} m", "")?;
        if let Some([r, g, b]) = m.free_path_of_extent {
            write!(f, ", {r:.4} {g:.4} {b:.4} of the extent's diagonal")?;
        }
        writeln!(f, "{}", if m.is_directional { ", by the mean of all directions" } else { "" })?;
        let [r, g, b] = m.emission;
        if [r, g, b] != [0.0; 3] {
            writeln!(f, "  {:<w$}  emits {r:.4} {g:.4} {b:.4} W/(sr m³)", "")?;
        }
        let fills = if m.fills.is_empty() { "nothing".to_owned() } else { m.fills.join(", ") };
        writeln!(f, "  {:<w$}  in {fills}", "")?;
    }
    Ok(())
}
