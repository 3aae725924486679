//! What an experiment leaves behind, to be compared.

use std::collections::BTreeMap;
use std::path::Path;
use tyndall::experiment::results::read;
use tyndall::film::exr::read_layers;

/// What an experiment left behind, but for times: metrics, checkpoints, and every pixel of every EXR, to the bit.
#[derive(Debug, PartialEq)]
pub struct Left {
    metrics: Vec<BTreeMap<String, f64>>,
    checkpoints: Vec<(u64, BTreeMap<String, f64>)>,
    pixels: BTreeMap<String, Vec<u32>>,
}

/// Reads it.
pub fn left(dir: &Path) -> Left {
    let results = read(dir).unwrap();
    assert!(!results.partial);
    let runs = || results.cells.iter().flat_map(|c| &c.runs);
    let mut pixels = BTreeMap::new();
    let mut keep = |name: &str| {
        for layer in read_layers(dir.join(name)).unwrap().layers {
            let bits = layer.image.pixels.iter().flatten().map(|v| v.to_bits()).collect();
            pixels.insert(format!("{name}:{}", layer.name), bits);
        }
    };
    results.scenes.iter().flat_map(|s| &s.reference).for_each(|r| keep(&r.exr));
    for cell in &results.cells {
        cell.runs.iter().for_each(|r| keep(&r.exr));
        keep(&cell.files.mean_exr);
        cell.files.error_exr.iter().for_each(|f| keep(f));
    }
    Left {
        metrics: runs().map(|r| r.metrics.clone()).collect(),
        checkpoints: runs().flat_map(|r| &r.checkpoints).map(|c| (c.spp, c.metrics.clone())).collect(),
        pixels,
    }
}
