//! What a replay found, for people to read.

use super::{Candidate, Found, Replay, candidates, exponent};
use crate::oracle::collect::Traced;
use crate::oracle::{MadeBy, judge};
use crate::scene::Scene;
use crate::transport::technique::Technique;
use crate::transport::walk::Place;
use glam::Vec3A;
use std::fmt::Write;

/// The paths that contribute to the pixel, the largest contributions first, and all about number `path` of them (from 1). What one
/// iteration adds is a sample of the pixel, as in samples per pixel.
pub fn text(scene: &Scene, replay: &Replay, found: &[Found], path: usize, most: usize) -> String {
    let settings = replay.settings();
    let mut text = String::new();
    let total: f64 = found.iter().map(|f| f64::from(f.luminance)).sum();
    let mut put = |line: String| {
        text.push_str(line.trim_end());
        text.push('\n');
    };
    if !settings.left_out.is_empty() {
        put(format!("Left out, as they are not worth what they cost here: {}.", settings.left_out));
    }
    let count = match found.len() {
        0 => "No path contributes to these samples.".to_owned(),
        1 => format!("1 path contributes, a luminance of {total:.6e}:"),
        n if n <= most => format!("{n} paths contribute, a luminance of {total:.6e} in all:"),
        n => format!(
            "{n} paths contribute, a luminance of {total:.6e} in all; the {most} that contribute most:"
        ),
    };
    put(count);
    if found.is_empty() {
        return text;
    }
    put(format!(
        "{:>4} {:>10} {:<10} {:>3} {:>3} {:>13} {:>8} {:>13} {:>10}",
        "", "sample", "technique", "s", "t", "adds", "share", "unweighted", "weight"
    ));
    for (i, f) in found.iter().take(most).enumerate() {
        let sample = &f.sample;
        let unweighted = f.luminance / sample.weight;
        put(format!(
            "{:>4} {:>10} {:<10} {:>3} {:>3} {:>13.6e} {:>7.2}% {:>13.6e} {:>10.6}",
            i + 1,
            f.iteration,
            sample.technique.info().key,
            sample.s,
            sample.t,
            f.luminance,
            100.0 * f64::from(f.luminance) / total,
            unweighted,
            sample.weight
        ));
    }
    match found.get(path - 1) {
        None => {}
        Some(Found { traced: None, sample, .. }) if sample.technique != Technique::Hit => {
            text.push_str("\nThis one was merged on a wall, where by rounding no medium is: nothing can be said of it.\n");
        }
        Some(Found { traced: None, .. }) => {
            text.push_str("\nThis one is light that a medium emits along the camera's way: no other technique makes it.\n");
        }
        Some(Found { traced: Some(traced), iteration, .. }) => {
            let _ = writeln!(text, "\nPath {path}, of sample {iteration}:");
            vertices(scene, traced, &mut text);
            let verdict = judge(scene, &replay.pass(*iteration), &traced.path, traced.made_by());
            let beta = exponent(settings.heuristic);
            weights(traced, &candidates(&verdict, beta), &mut text);
        }
    }
    text
}

fn position(p: Vec3A) -> String {
    format!("({:.5}, {:.5}, {:.5})", p.x, p.y, p.z)
}

fn vertices(scene: &Scene, traced: &Traced, text: &mut String) {
    let path = &traced.path;
    let light = scene.notes.light_names.get(path.light.light as usize).map_or("light", String::as_str);
    let (lights, lens) = (&scene.lights, path.interior.len() + 1);
    let start = if lights.is_infinite(&path.light) {
        format!("infinitely far toward {}", position(path.light.n))
    } else {
        position(path.light.p)
    };
    let _ = writeln!(text, "  x_0   light {light}: {start}");
    for (i, place) in path.interior.iter().enumerate() {
        let what = match place {
            Place::Surface(point) => {
                let shape = point.shape as usize;
                let material = scene.shape_materials.get(shape).map_or(0, |m| *m as usize);
                format!(
                    "surface of {}, {}: {}, normal {}",
                    scene.shape_names.get(shape).map_or("a shape", String::as_str),
                    scene.notes.material_names.get(material).map_or("", String::as_str),
                    position(point.p),
                    position(point.ns)
                )
            }
            Place::Medium(collision) => format!(
                "medium {}: {}",
                scene.notes.medium_names.get(collision.medium as usize).map_or("", String::as_str),
                position(collision.p)
            ),
        };
        let _ = writeln!(text, "  x_{:<3} {what}", i + 1);
        if let Some((at, of_light)) = path.merged.as_ref().filter(|(at, _)| *at == i + 1) {
            let apart = of_light.position().distance(place.position());
            let _ = writeln!(
                text,
                "        merged: the light subpath has x_{at} at {}, {apart:.3e} m away",
                position(of_light.position())
            );
        }
    }
    let _ = writeln!(text, "  x_{lens:<3} lens: {}", position(path.lens));
}

/// What a technique is called: with the number of light vertices, or the vertex that it merges at.
fn name(made_by: MadeBy, segments: usize) -> (String, String) {
    match made_by {
        MadeBy::Connection(s) => {
            let technique = match s {
                0 => "hit",
                1 => "nee",
                s if s == segments => "lens",
                _ => "connect",
            };
            (technique.into(), format!("s = {s}, t = {}", segments + 1 - s))
        }
        MadeBy::Merge(technique, i) => (technique.info().key.into(), format!("at x_{i}")),
    }
}

fn weights(traced: &Traced, all: &[Candidate], text: &mut String) {
    let segments = traced.path.interior.len() + 1;
    let _ = writeln!(
        text,
        "\n{:<44} {:>25}\n  {:<10} {:<16} {:>14} {:>12} {:>12} {:>12}",
        "", "weight by the", "technique", "", "density", "recursion", "oracle", "renderer"
    );
    for candidate in all {
        let (technique, place) = name(candidate.made_by, segments);
        let own = candidate.made_by == traced.made_by();
        let renderer = if own { format!("{:.8}", traced.sample.weight) } else { String::new() };
        let line = format!(
            "  {technique:<10} {place:<16} {:>14.6e} {:>12.8} {:>12.8} {renderer:>12}",
            candidate.density, candidate.recursion, candidate.oracle
        );
        let _ = writeln!(text, "{}", line.trim_end());
    }
    let sum = |f: fn(&Candidate) -> f64| all.iter().map(f).sum::<f64>();
    let _ = writeln!(
        text,
        "  {:<10} {:<16} {:>14} {:>12.8} {:>12.8}",
        "sum",
        "",
        "",
        sum(|c| c.recursion),
        sum(|c| c.oracle)
    );
}
