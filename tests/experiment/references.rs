//! What is measured against: rendered once, kept, extended and told apart.

use crate::common::{Bench, EXPERIMENT};
use crate::results;
use std::collections::{BTreeMap, HashSet};
use tyndall::experiment::results::{Cell, Results};
use tyndall::film::exr::{read_layers, read_rgb};

#[test]
fn references_are_kept_and_extended() {
    let bench = Bench::new();
    bench.write("experiment.toml", &EXPERIMENT.replace("runs = 3", "runs = 1"));
    bench.succeed("run experiment.toml --cache cache");
    let blocks = || -> BTreeMap<_, _> {
        let files = bench.files().into_iter().filter(|f| f.to_string_lossy().contains("/block-"));
        files
            .map(|f| (f.clone(), (std::fs::read(&f).unwrap(), f.metadata().unwrap().modified().unwrap())))
            .collect()
    };
    let first = blocks();
    assert!(!first.is_empty());
    let (_, err) = bench.succeed("run experiment.toml --cache cache");
    assert!(err.contains("reference of 24 spp found"), "{err}");
    assert_eq!(blocks(), first, "nothing is rendered again");
    let (_, err) = bench.succeed("run experiment.toml --cache cache --set reference.spp=40");
    assert!(err.contains("24 spp are there"), "{err}");
    let extended = blocks();
    assert!(extended.len() > first.len());
    assert!(first.iter().all(|(path, content)| extended.get(path) == Some(content)));
    let reference = bench.path("results/experiment/small/reference.exr");
    let grown = read_layers(&reference).unwrap();
    assert_eq!(grown.text("tyndall.iterations"), Some("40"));
    // In one go: the same up to rounding.
    bench.succeed("run experiment.toml --cache other --set reference.spp=40");
    let whole = read_layers(&reference).unwrap();
    for layer in ["", "variance"] {
        let (a, b) = (grown.layer(layer).unwrap(), whole.layer(layer).unwrap());
        for (a, b) in a.pixels.iter().flatten().zip(b.pixels.iter().flatten()) {
            assert!((a - b).abs() <= 1e-4 * b.abs() + 1e-9, "'{layer}': {a} {b}");
        }
    }
    // And that is what a plain render with the reference's seed has.
    let seed = whole.text("tyndall.seed").unwrap().to_owned();
    bench.succeed(&format!("render small --spp 40 --seed {seed} --out plain.exr"));
    let plain = read_layers(bench.path("plain.exr")).unwrap();
    for layer in ["", "variance"] {
        let (a, b) = (plain.layer(layer).unwrap(), whole.layer(layer).unwrap());
        for (a, b) in a.pixels.iter().flatten().zip(b.pixels.iter().flatten()) {
            assert!((a - b).abs() <= 1e-3 * b.abs() + 1e-9, "'{layer}': {a} {b}");
        }
    }
    // A scene that changed is another scene.
    let scene = std::fs::read_to_string(bench.path("small/scene.toml")).unwrap();
    bench.write("small/scene.toml", &scene.replace("reflectance = 0.7", "reflectance = 0.6"));
    let before = blocks().len();
    bench.succeed("run experiment.toml --cache cache");
    assert!(blocks().len() > before);
}

#[test]
fn a_damaged_block_is_rendered_again() {
    let bench = Bench::new();
    bench.succeed("run experiment.toml --set runs=1");
    let reference = bench.path("results/experiment/small/reference.exr");
    let whole = read_rgb(&reference).unwrap();
    let block = bench.files().into_iter().rfind(|f| f.to_string_lossy().contains("/block-")).unwrap();
    let bytes = std::fs::read(&block).unwrap();
    std::fs::write(&block, &bytes[..bytes.len() / 2]).unwrap();
    let (_, err) = bench.succeed("run experiment.toml --set runs=1");
    assert!(err.contains("rendered again"), "{err}");
    assert_eq!(read_rgb(&reference).unwrap(), whole);
}

#[test]
fn a_file_can_be_the_reference() {
    let bench = Bench::new();
    bench.succeed("render small --spp 6 --seed 5 --out truth.exr");
    let text = EXPERIMENT.replace("preset = \"bpt\"\nspp = 24", "file = \"truth.exr\"");
    bench.write("experiment.toml", &text);
    bench.succeed("run experiment.toml");
    let results = results(&bench);
    let reference = results.scenes[0].reference.as_ref().unwrap();
    assert_eq!(reference.spp, Some(6));
    let warned = |part: &str| results.cells.iter().any(|c| c.warnings.iter().any(|w| w.contains(part)));
    assert!(warned("the reference's own noise"), "6 spp are no reference for 4");
    bench.refuse("run experiment.toml --out again --set size=[48,32]", &["truth.exr", "24x16", "48x32"]);
    // Efficiencies go by the MSE also where it was not asked for.
    bench.succeed("run experiment.toml --set metrics=['smape']");
    let results = self::results(&bench);
    let told = |c: &Cell| c.warnings.iter().any(|w| w.contains("MSE, by which efficiencies are compared"));
    assert!(results.cells.iter().any(told), "{:?}", results.cells[0].warnings);
}

#[test]
fn references_have_the_paths_that_they_are_compared_with() {
    let bench = Bench::new();
    bench.write("experiment.toml", &EXPERIMENT.replace("runs = 3", "runs = 1"));
    let references = || bench.files().into_iter().filter(|f| f.to_string_lossy().contains("/block-")).count();
    let warned = |results: &Results| -> Vec<bool> {
        let of = |w: &String| w.contains("those of the reference");
        results.cells.iter().map(|c| c.warnings.iter().any(of)).collect()
    };
    bench.succeed("run experiment.toml --cache cache");
    let all = references();
    assert_eq!(results(&bench).scenes[0].reference.as_ref().unwrap().paths.as_deref(), Some("all"));
    // The experiment's paths are the reference's.
    bench.succeed("run experiment.toml --cache cache --set paths=E(S|D)+L");
    let some = results(&bench);
    assert!(references() > all, "another reference");
    assert_eq!(some.scenes[0].reference.as_ref().unwrap().paths.as_deref(), Some("E(S|D)+L"));
    assert!(some.estimators.iter().all(|e| e.settings.paths == "E(S|D)+L"));
    assert_eq!(warned(&some), [false, false]);
    let page = std::fs::read_to_string(bench.path("results/experiment/index.html")).unwrap();
    assert!(page.contains("paths E(S|D)+L"));
    // The same paths in other words: the same reference. One estimator with others is warned about.
    let change = "--set paths=E(S|D)(S|D)*L --set estimator.pt.paths=surfaces";
    let (_, err) = bench.succeed(&format!("run experiment.toml --cache cache {change}"));
    assert!(err.contains("reference of 24 spp found"), "{err}");
    assert_eq!(warned(&results(&bench)), [true, false]);
    // The reference's own come before the experiment's.
    let (_, err) =
        bench.succeed("run experiment.toml --cache cache --set paths=surfaces --set reference.paths=E.*L");
    assert!(err.contains("reference of 24 spp found"), "{err}");
    assert_eq!(warned(&results(&bench)), [true, true]);
}

/// A scene may be there twice, for other paths: each has a reference of its own paths, and is measured against that.
#[test]
fn scenes_may_have_paths_of_their_own() {
    let bench = Bench::new();
    let twice =
        "\n[[scene]]\nfile = \"small\"\nname = \"caustics\"\npaths = \"ES*DS+L\"\n\n[[estimator]]\npreset";
    let text = EXPERIMENT.replace("runs = 3", "runs = 1").replacen("\n[[estimator]]\npreset", twice, 1);
    bench.write("experiment.toml", &text);
    bench.succeed("run experiment.toml --set estimator.all.paths=surfaces");
    let results = results(&bench);
    let paths = |scene, estimator| results.cell(scene, estimator).unwrap().paths.as_str();
    assert_eq!([paths("small", "pt"), paths("caustics", "pt")], ["all", "ES*DS+L"]);
    assert_eq!(
        [paths("small", "all"), paths("caustics", "all")],
        ["surfaces"; 2],
        "the estimator's come first"
    );
    let reference = |i: usize| results.scenes[i].reference.as_ref().unwrap().paths.clone().unwrap();
    assert_eq!([reference(0), reference(1)], ["all", "ES*DS+L"]);
    let warned = |scene, estimator| {
        let warnings = &results.cell(scene, estimator).unwrap().warnings;
        warnings.iter().any(|w| w.contains("those of the reference"))
    };
    assert!(!warned("small", "pt") && !warned("caustics", "pt") && warned("caustics", "all"));
    let mean = |scene| results.cell(scene, "pt").unwrap().runs[0].mean[0];
    assert!(mean("caustics") < 0.5 * mean("small"), "paths were left out");
    let page = std::fs::read_to_string(bench.path("results/experiment/index.html")).unwrap();
    assert!(page.contains("those of the reference"));
}

/// Bugs that this keeps out: a reference with other radii, counts or kernels taken for the one that is asked for, and
/// merges that the metadata do not tell.
#[test]
fn references_may_merge() {
    let bench = Bench::new();
    let vcm = "preset = \"vcm\"\nmerge = { surf = { radius = 0.02, paths = 100 } }\nspp = 24";
    let text = EXPERIMENT.replace("runs = 3", "runs = 1").replace("preset = \"bpt\"\nspp = 24", vcm);
    bench.write("experiment.toml", &text);
    let folders = || -> HashSet<_> {
        let blocks = bench.files().into_iter().filter(|f| f.to_string_lossy().contains("/block-"));
        blocks.map(|f| f.parent().unwrap().to_owned()).collect()
    };
    bench.succeed("run experiment.toml --cache cache");
    let block = bench.files().into_iter().find(|f| f.to_string_lossy().contains("/block-")).unwrap();
    let file = read_layers(block).unwrap();
    let settings: serde_json::Value = serde_json::from_str(file.text("tyndall.settings").unwrap()).unwrap();
    let surf = &settings["merging"]["techniques"]["surf"];
    assert!((surf["radius"].as_f64().unwrap() - 0.02).abs() < 1e-8 && surf["paths"] == 100, "{settings}");
    assert_eq!(settings["merging"]["kernel"], "constant");
    assert_eq!(file.text("tyndall.rendering").map(str::len), Some(16));
    let mut known = folders().len();
    assert_eq!(known, 1);
    for change in
        ["surf={radius=0.03,paths=100}", "surf={radius=0.02,paths=99}", "kernel=epanechnikov", "surf.alpha=1"]
    {
        bench.succeed(&format!("run experiment.toml --cache cache --set reference.merge.{change}"));
        known += 1;
        assert_eq!(folders().len(), known, "{change} is another reference");
    }
    let (_, err) = bench.succeed("run experiment.toml --cache cache");
    assert!(err.contains("reference of 24 spp found"), "{err}");
}
