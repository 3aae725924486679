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

/// A scene is named in the same words as on the command line, and by what is nearly its name.
#[test]
fn scenes_that_are_not_there_are_guessed() {
    let bench = Bench::new();
    fs::create_dir_all(bench.path("scenes")).unwrap();
    fs::create_dir_all(bench.path("experiments")).unwrap();
    fs::rename(bench.path("small"), bench.path("scenes/small")).unwrap();
    for (file, meant) in [
        ("small", "did you mean `../scenes/small`?"),
        ("smal", "did you mean `../scenes/small`?"),
        ("../scenes/samll", "did you mean `../scenes/small`?"),
        ("../scene/small", "did you mean `../scenes/small`?"),
        ("../scenes/smalll/scene.toml", "did you mean `../scenes/small/scene.toml`?"),
    ] {
        let text = EXPERIMENT.replace("file = \"small\"", &format!("file = \"{file}\""));
        bench.write("experiments/e.toml", &text);
        bench.refuse("run experiments/e.toml", &["e.toml:12:8", "there is no such scene file", meant]);
    }
}

/// Bug that this keeps out: a reference as biased as what is measured against it, without a word.
#[test]
fn references_that_merge_with_radii_of_renders_are_warned_of_once() {
    let bench = Bench::new();
    let vcm = EXPERIMENT
        .replace("runs = 3", "runs = 1")
        .replace("preset = \"bpt\"\nspp = 24", "preset = \"vcm\"\nspp = 2");
    let twice = vcm.replacen(
        "\n[[estimator]]",
        "\n[[scene]]\nfile = \"small\"\nname = \"again\"\n\n[[estimator]]",
        1,
    );
    let warned = |text: &str| {
        bench.write("experiment.toml", text);
        let (_, err) = bench.succeed("status experiment.toml");
        err.matches("merges (surf) with radii as they are chosen for renders").count()
    };
    assert_eq!(warned(&twice), 1, "two scenes have the same");
    assert_eq!(warned(&vcm.replace("spp = 2\n", "spp = 2\nmerge = { surf = { alpha = 0.5 } }\n")), 1);
    assert_eq!(warned(&vcm.replace("spp = 2\n", "spp = 2\nmerge = { surf = { radius = 0.01 } }\n")), 0);
    assert_eq!(warned(EXPERIMENT), 0, "connections have no bias");
    let own = EXPERIMENT.replace("exposure = 0.5", "reference = { preset = \"vcm\", spp = 2 }");
    assert_eq!(warned(&own), 1);
    let (_, err) = bench.succeed("status experiment.toml");
    assert!(err.contains("the reference of scene small merges"), "{err}");
}

/// Bug that this keeps out: a page that said, after measuring again, that all was rendered a moment ago.
#[test]
fn a_page_says_when_runs_were_rendered() {
    let bench = Bench::new();
    bench.succeed("run experiment.toml --set runs=2");
    let first = results(&bench);
    std::thread::sleep(std::time::Duration::from_millis(1100));
    bench.succeed("run experiment.toml --set runs=2");
    let again = results(&bench);
    assert!(again.started > first.finished, "it has measured anew");
    let rendered = first.rendered().unwrap().map(str::to_owned);
    assert_eq!(again.rendered().unwrap(), [rendered[0].as_str(), rendered[1].as_str()]);
    assert!(rendered[1] <= first.finished && rendered[0] >= first.started);
    let page = fs::read_to_string(bench.path("results/experiment/index.html")).unwrap();
    for text in [
        format!("the first run was done {}, the last {}", rendered[0], rendered[1]),
        format!("<span>{}</span>", rendered[1]),
        again.finished,
    ] {
        assert!(page.contains(&text), "'{text}'");
    }
    // What is rendered now is of now.
    bench.succeed("run experiment.toml --set runs=3");
    let more = results(&bench);
    assert!(more.rendered().unwrap()[0] == rendered[0] && more.rendered().unwrap()[1] > rendered[1].as_str());
}

/// Bug that this keeps out: what a figure had asked for was taken out, and all was rendered again without a word.
#[test]
fn runs_with_more_layers_are_told_of() {
    let bench = Bench::new();
    let text = fs::read_to_string(bench.path("experiment.toml")).unwrap();
    let (plain, all) = (text.replace("layers = \"families\"\n", ""), "layers = \"all\"\n");
    let hint = "small: there are runs of pt, all with layers = \"all\"";
    bench.write("experiment.toml", &format!("{all}{plain}"));
    let (_, said) = bench.succeed("run experiment.toml");
    assert!(!said.contains("there are runs"), "{said}");
    bench.write("experiment.toml", &plain);
    let (out, _) = bench.succeed("status experiment.toml");
    assert!(out.contains(hint), "{out}");
    let (_, said) = bench.succeed("run experiment.toml");
    assert!(said.contains(hint) && said.contains("`layers` in the experiment goes on"), "{said}");
    // Nothing more to say once they are there; and more layers than before are no question.
    let (_, said) = bench.succeed("run experiment.toml");
    assert!(!said.contains("there are runs"), "{said}");
    fs::remove_dir_all(bench.path("results")).unwrap();
    bench.succeed("run experiment.toml");
    bench.write("experiment.toml", &format!("{all}{plain}"));
    let (_, said) = bench.succeed("run experiment.toml");
    assert!(!said.contains("there are runs"), "{said}");
}
