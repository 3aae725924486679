//! The program as its users run it: `render`, `compare`, `techniques`, and bad input.

mod common;

use common::Bench;
use std::process::Stdio;
use std::time::{Duration, Instant};
use tyndall::film::exr::{LayeredImage, read_layers};

/// All pixels of all layers, to the bit.
fn pixels(file: &LayeredImage) -> Vec<(String, Vec<u32>)> {
    let bits = |l: &tyndall::film::exr::Layer| {
        let bits = l.image.pixels.iter().flatten().map(|v| v.to_bits()).collect();
        (l.name.clone(), bits)
    };
    file.layers.iter().map(bits).collect()
}

#[test]
fn bad_command_lines_end_in_one_message() {
    let bench = Bench::new();
    for (line, parts) in [
        ("render small --spp 0", &["--spp", "at least 1"][..]),
        ("render small --spp many", &["--spp", "whole number"]),
        ("render small --time 0s", &["--time", "30s"]),
        ("render small --size 12", &["--size", "640x480"]),
        ("render small --threads 0", &["--threads"]),
        ("render small --estimator btp", &["'btp'", "did you mean 'bpt'", "pt, lt, bpt"]),
        ("render small --techniques nee,lense", &["'lense'", "did you mean 'lens'"]),
        ("render small --techniques nee,nee", &["twice"]),
        ("render small --max-length 0", &["maximum path length is 0"]),
        ("render small --min-length 9", &["minimum path length is 9"]),
        ("render small --tracking sometimes", &["--tracking", "auto, exact, delta"]),
        ("render small --tracking delta", &["`delta` is for hit and nee alone", "connect, lens must know"]),
        ("render small --layers some", &["--layers", "families"]),
        (
            "render smal",
            &["smal", "there is no such scene file", "/scenes, as that is no folder", "is started"],
        ),
        ("render small --merge bb1d.radus=1", &["--merge bb1d.radus=1", "did you mean `radius`?"]),
        ("render small/scene.tom", &["there is no such scene file"]),
        ("render small --out small", &["small", ".exr or .png"]),
        ("render small --out a.jpg", &["a.jpg", ".exr or .png"]),
        ("render small --out nowhere/a.exr", &["nowhere", "there is no folder"]),
        ("render small --out small/scene.toml/a.exr", &["there is no folder"]),
        ("render small --out /proc/a.exr", &["/proc", "cannot write"]),
        ("compare a.exr b.exr", &["a.exr"]),
        ("info smal", &["smal", "there is no such scene file"]),
        ("report small", &["results.json", "there are no results here"]),
        ("run nothing.toml", &["nothing.toml", "there is no such file"]),
        ("rendre small", &["rendre"]),
        ("render small --paths ES|DL", &["path expression `ES|DL`, column 3", "parentheses"]),
    ] {
        bench.refuse(line, parts);
    }
}

#[test]
fn a_scene_that_is_wrong_is_pointed_at() {
    let bench = Bench::new();
    let scene = std::fs::read_to_string(bench.path("small/scene.toml")).unwrap();
    bench.write("small/scene.toml", &scene.replace("radius = 0.4", "radius = -0.4"));
    bench.refuse("render small", &["small/scene.toml:30:", "-0.4"]);
    bench.write("small/scene.toml", &scene.replace("emission", "emision"));
    bench.refuse("render small", &["small/scene.toml:", "`emision`", "did you mean `emission`"]);
}

#[test]
fn renders_are_the_same_bytes_with_any_number_of_threads() {
    let bench = Bench::new();
    let render = |threads: u32| {
        let name = format!("t{threads}.exr");
        bench.succeed(&format!("render small --spp 3 --layers all --threads {threads} --out {name}"));
        read_layers(bench.path(&name)).unwrap()
    };
    let one = render(1);
    let image = one.layer("").unwrap();
    assert_eq!((image.width, image.height), (24, 16));
    assert!(image.mean()[0] > 0.01, "something is seen");
    assert!(one.layer("variance").is_some() && one.layer("weighted.s02t02").is_some());
    for threads in [2, 7] {
        assert!(pixels(&render(threads)) == pixels(&one), "{threads} threads");
    }
    assert!(pixels(&read_layers(bench.path("t1.exr")).unwrap()) == pixels(&one));
    bench.succeed("render small --spp 3 --layers all --seed 1 --out other.exr");
    assert!(pixels(&read_layers(bench.path("other.exr")).unwrap()) != pixels(&one), "seeds matter");
}

#[test]
fn a_render_says_how_it_was_made() {
    let bench = Bench::new();
    let options =
        "--techniques nee,hit --spp 2 --seed 18446744073709551615 --size 8x6 --png --paths ES*(D|M)*L";
    bench.succeed(&format!("render small {options}"));
    let file = read_layers(bench.path("Small-pt.exr")).unwrap();
    assert_eq!((file.width, file.height), (8, 6));
    assert_eq!(file.text("tyndall.iterations"), Some("2"));
    assert_eq!(file.text("tyndall.seed"), Some("18446744073709551615"));
    assert_eq!(file.text("tyndall.partial"), Some("false"));
    assert_eq!(file.text("tyndall.dropped"), Some("{}"));
    assert_eq!(file.text("tyndall.cameraPaths"), Some("96"));
    assert_eq!(file.text("tyndall.lightPaths"), Some("0"));
    assert!(file.text("tyndall.seconds").unwrap().parse::<f64>().unwrap() > 0.0);
    let settings: serde_json::Value = serde_json::from_str(file.text("tyndall.settings").unwrap()).unwrap();
    assert_eq!(settings["techniques"], serde_json::json!(["hit", "nee"]));
    assert_eq!(settings["max_length"], 6, "the scene file's");
    assert_eq!(settings["paths"], "ES*(D|M)*L");
    let png = std::fs::read(bench.path("Small-pt.png")).unwrap();
    assert!(png.starts_with(b"\x89PNG"));
}

#[test]
fn a_png_alone_and_a_brighter_one() {
    let bench = Bench::new();
    bench.succeed("render small --spp 1 --out a.png");
    bench.succeed("render small --spp 1 --exposure 2 --out b.png");
    assert!(!bench.path("Small-bpt.exr").exists());
    let mean = |name: &str| {
        let image = image::open(bench.path(name)).unwrap().to_rgb8();
        image.as_raw().iter().map(|v| f64::from(*v)).sum::<f64>() / image.as_raw().len() as f64
    };
    assert!(mean("b.png") > mean("a.png") + 5.0, "{} {}", mean("a.png"), mean("b.png"));
}

#[test]
fn a_time_budget_is_kept() {
    let bench = Bench::new();
    bench.succeed("render small --time 300ms --out a.exr");
    let file = read_layers(bench.path("a.exr")).unwrap();
    let seconds: f64 = file.text("tyndall.seconds").unwrap().parse().unwrap();
    // To the nearest iteration; iterations of this scene take a few milliseconds, more on a busy machine.
    assert!((0.15..0.6).contains(&seconds), "{seconds}");
    assert!(file.text("tyndall.iterations").unwrap().parse::<u64>().unwrap() > 3);
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_a_partial_result() {
    let bench = Bench::new();
    let mut child = bench
        .command("render small --spp 1000000000 --out a.exr")
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    // It has begun once it says so; the handler is there before that.
    let mut first_line = [0u8; 1];
    std::io::Read::read_exact(child.stderr.as_mut().unwrap(), &mut first_line).unwrap();
    std::thread::sleep(Duration::from_millis(200));
    let killed =
        std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    assert!(killed.success());
    let end = Instant::now() + Duration::from_secs(20);
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None if Instant::now() > end => {
                child.kill().unwrap();
                panic!("it does not stop");
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    assert_eq!(status.code(), Some(130));
    let file = read_layers(bench.path("a.exr")).unwrap();
    assert_eq!(file.text("tyndall.partial"), Some("true"));
    let iterations: u64 = file.text("tyndall.iterations").unwrap().parse().unwrap();
    assert!(iterations > 0);
    // What is there is what a render of so many samples gives.
    if iterations < 2000 {
        bench.succeed(&format!("render small --spp {iterations} --out b.exr"));
        assert!(pixels(&read_layers(bench.path("b.exr")).unwrap()) == pixels(&file));
    }
}

#[test]
fn comparing_an_image_with_itself_gives_zero() {
    let bench = Bench::new();
    bench.succeed("render small --spp 2 --out a.exr");
    let (out, _) = bench.succeed("compare a.exr a.exr --json");
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["metrics"]["mse"], 0.0);
    let (text, _) = bench.succeed("compare a.exr a.exr");
    assert!(text.contains("relMSE") && text.contains("the images are equal"), "{text}");
    assert!(!text.contains("too noisy"), "{text}");
    bench.succeed("render small --spp 2 --size 8x8 --out b.exr");
    bench.refuse("compare a.exr b.exr", &["24x16", "8x8"]);
}

#[test]
fn info_says_what_is_in_a_scene() {
    let bench = Bench::new();
    let (out, _) = bench.succeed("info small");
    for part in ["Small", "24", "16", "6 triangles"] {
        assert!(out.contains(part), "'{part}' is not in: {out}");
    }
}

#[test]
fn help_and_tables_are_printed() {
    let bench = Bench::new();
    let (out, _) = bench.succeed("techniques");
    assert!(out.contains("next-event estimation") && out.contains("bidirectional path tracing"));
    for command in ["run", "render", "compare", "info", "report", "techniques"] {
        assert!(bench.succeed("--help").0.contains(command));
        bench.succeed(&format!("{command} --help"));
    }
    assert!(bench.succeed("--version").0.starts_with("tyndall "));
}

/// Merges in media are no error beside techniques that can do without a medium, but a word is due.
#[test]
fn merges_in_media_are_warned_of_where_there_is_none() {
    let bench = Bench::new();
    let (_, err) = bench.succeed("render small --estimator upbp --spp 1 --out with.exr");
    assert!(err.contains("warning: nothing scatters") && err.contains("pp3d, pb2d, bb1d"), "{err}");
    let (_, err) = bench.succeed("render small --estimator bpt --spp 1 --merge surf.radius=0.01 --out a.exr");
    assert!(err.contains("warning: --merge surf… changes nothing: it is not among the techniques"), "{err}");
    let (_, err) =
        bench.succeed("render small --estimator vcm --spp 1 --merge surf.radius=0.01 --out without.exr");
    assert!(!err.contains("warning"), "{err}");
}

/// Bug that this keeps out: an import wrote over a scene that had been worked at.
#[test]
fn an_import_writes_over_nothing_unless_told_to() {
    let bench = Bench::new();
    let xml = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/import/scenes/surfaces.xml");
    bench.succeed(&format!("import {xml} imported/scene.toml"));
    let written = std::fs::read(bench.path("imported/scene.toml")).unwrap();
    bench.write("imported/scene.toml", "# mine");
    bench.refuse(
        &format!("import {xml} imported/scene.toml"),
        &["imported/scene.toml", "is there already", "--force"],
    );
    assert_eq!(std::fs::read(bench.path("imported/scene.toml")).unwrap(), b"# mine");
    bench.succeed(&format!("import {xml} imported/scene.toml --force"));
    assert_eq!(std::fs::read(bench.path("imported/scene.toml")).unwrap(), written);
}
