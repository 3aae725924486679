//! Where results are, and what is said where they, or a scene, are elsewhere; and what else is said before anything is rendered.

use crate::common::{Bench, EXPERIMENT};
use crate::results;
use std::fs;

/// Bug that this keeps out: a run from another folder rendered all again, without a word on where to.
#[test]
fn a_run_says_where_its_results_are_and_where_there_are_others() {
    let bench = Bench::new();
    let (_, err) = bench.succeed("run experiment.toml --set runs=1");
    let whole = bench.path("results/experiment").canonicalize().unwrap();
    let first = format!("results of experiment: {}", whole.display());
    assert_eq!(err.lines().next(), Some(first.as_str()), "{err}");
    assert!(!err.contains("warning: there are results"), "{err}");
    fs::create_dir(bench.path("elsewhere")).unwrap();
    let from_elsewhere = |line: &str| {
        let output = bench.command(line).current_dir(bench.path("elsewhere")).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    for command in ["status", "run"] {
        let err = from_elsewhere(&format!("{command} ../experiment.toml --set runs=1"));
        assert!(err.starts_with("results of experiment: ") && err.contains("elsewhere/results/experiment\n"));
        assert!(err.contains("there are results of an experiment of this name in "), "{err}");
        assert!(err.contains(&format!("--out {} goes on", whole.display())), "{err}");
    }
    // Now there are results here, too; and where --out is given, it is meant.
    let err = from_elsewhere("status ../experiment.toml --set runs=1");
    assert!(!err.contains("there are results"), "{err}");
    let err = from_elsewhere("status ../experiment.toml --out another");
    assert!(!err.contains("there are results"), "{err}");
}

#[test]
fn a_scene_that_was_moved_is_told_by_its_contents() {
    let bench = Bench::new();
    bench.write("experiment.toml", &EXPERIMENT.replace("runs = 3", "runs = 1"));
    bench.succeed("run experiment.toml");
    fs::rename(bench.path("small"), bench.path("moved")).unwrap();
    let text = fs::read_to_string(bench.path("experiment.toml")).unwrap();
    bench.write("experiment.toml", &text.replace("file = \"small\"", "file = \"moved\""));
    let hint = "scene moved is what scene small was";
    let (out, _) = bench.succeed("status experiment.toml");
    assert!(out.contains(hint) && out.contains("`name = \"small\"`"), "{out}");
    // As it says.
    bench.write("named.toml", &text.replace("file = \"small\"", "file = \"moved\"\nname = \"small\""));
    let (out, _) = bench.succeed("status named.toml --out results/experiment");
    assert!(!out.contains(hint) && out.contains("1 of 1") && !out.contains("0 of 1"), "{out}");
    // A scene with other contents is another one.
    let scene = fs::read_to_string(bench.path("moved/scene.toml")).unwrap();
    bench.write("moved/scene.toml", &scene.replace("reflectance = 0.7", "reflectance = 0.6"));
    let (out, _) = bench.succeed("status experiment.toml");
    assert!(!out.contains(hint), "{out}");
    bench.write("moved/scene.toml", &scene);
    let (_, err) = bench.succeed("run experiment.toml");
    assert!(err.contains(hint), "{err}");
    // Now it has runs under its own name.
    let (_, err) = bench.succeed("run experiment.toml");
    assert!(!err.contains(hint), "{err}");
}

/// As `render` says it of `--merge`.
#[test]
fn merges_of_techniques_that_are_not_there_are_warned_of() {
    let bench = Bench::new();
    let text = EXPERIMENT
        .replace(
            "preset = \"bpt\"\nspp = 24",
            "preset = \"bpt\"\nspp = 24\nmerge = { bb1d = { radius = 0.1 } }",
        )
        .replace(
            "preset = \"pt\"",
            "preset = \"vcm\"\nname = \"pt\"\nmerge = { surf = { radius = 0.1 }, pp3d = { radius = 0.1 } }",
        );
    bench.write("experiment.toml", &text);
    let (_, err) = bench.succeed("run experiment.toml --set runs=1");
    let expected = [
        "warning: experiment.toml: `pp3d` in the `merge` of estimator pt changes nothing",
        "warning: experiment.toml: `bb1d` in the `merge` of the reference changes nothing",
    ];
    for part in expected {
        assert!(err.contains(part), "{part:?} is not in {err}");
    }
    assert_eq!(err.matches("changes nothing").count(), 2, "surf is a technique of vcm: {err}");
    assert_eq!(results(&bench).warnings.len(), 2, "the page has them");
}
