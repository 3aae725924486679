//! Replays of single pixels: they are what the render had, and the weights agree from all three sides.

mod common;

use common::{Bench, EXPERIMENT};
use glam::UVec2;
use std::path::Path;
use tyndall::explain::{Replay, candidates};
use tyndall::film::exr::read_layers;
use tyndall::math::{Rgb, RgbExt};
use tyndall::oracle::judge;
use tyndall::render::{Budget, Job, Silent, Stop};
use tyndall::scene::Scene;
use tyndall::scene::file::{Overrides, load};
use tyndall::transport::technique::preset;
use tyndall::transport::{Settings, TechniqueSet, Tracking};

const ITERATIONS: u64 = 3;

fn scene(path: &Path, size: UVec2) -> Scene {
    load(path, &Overrides { size: Some(size) }).unwrap()
}

/// Every sample of some pixels is found again, their sum is the film's, and recursion, oracle and renderer agree on the weights.
fn check(scene: &Scene, name: &str, pixels: &[UVec2]) -> usize {
    let settings = Settings::new(TechniqueSet::of(preset(name).unwrap().techniques)).pinned(scene);
    let job = Job { scene, settings, budget: Budget::Spp(ITERATIONS), first: 0, chosen: 0.0 };
    let film = job.run(&Stop::default(), &mut Silent).unwrap().film;
    let (image, outliers) = (film.image(), film.outliers());
    let mut weighed = 0;
    for pixel in pixels {
        let replay = Replay::new(scene, settings, *pixel).unwrap();
        let mut sums = Vec::new();
        for iteration in 0..ITERATIONS {
            let found = replay.iteration(iteration);
            sums.push(found.iter().map(|f| f.luminance).sum::<f32>());
            for traced in found.iter().filter(|f| f.luminance > 0.0).filter_map(|f| f.traced.as_ref()) {
                let verdict = judge(scene, &replay.pass(iteration), &traced.path, traced.made_by());
                let all = candidates(&verdict, 1.0);
                let own = all.iter().find(|c| c.made_by == traced.made_by()).expect("it was made");
                let sum: f64 = all.iter().map(|c| c.recursion).sum();
                let weight = f64::from(traced.sample.weight);
                assert!(
                    (own.oracle - weight).abs() < 2e-3 * own.oracle + 1e-6,
                    "{name}, {pixel}: {own:?} {weight}"
                );
                assert!((own.recursion - own.oracle).abs() < 1e-6 * own.oracle, "{name}, {pixel}: {own:?}");
                assert!((sum - 1.0).abs() < 1e-6, "{name}, {pixel}: {all:?}");
                weighed += 1;
            }
        }
        let expected = Rgb::from_array(image.get(pixel.x as usize, pixel.y as usize)).luminance();
        let mean = sums.iter().sum::<f32>() / ITERATIONS as f32;
        assert!((mean - expected).abs() <= 1e-5 * expected, "{name}, {pixel}: {mean} and {expected}");
        let [largest, iteration, share] = outliers.get(pixel.x as usize, pixel.y as usize);
        let most = sums.iter().copied().fold(0.0, f32::max);
        assert!(
            (largest - most).abs() <= 1e-5 * most && (sums[iteration as usize] - most).abs() <= 1e-5 * most
        );
        assert!(most == 0.0 || (share - most / sums.iter().sum::<f32>()).abs() < 1e-4);
    }
    weighed
}

#[test]
fn replays_are_what_the_render_had() {
    let bench = Bench::new();
    let small = scene(&bench.path("small/scene.toml"), UVec2::new(24, 16));
    let pixels = [UVec2::new(3, 12), UVec2::new(12, 8), UVec2::new(20, 3)];
    for name in ["pt", "bpt", "vcm"] {
        assert!(check(&small, name, &pixels) > 5, "{name}");
    }
    // What is tracked has the weights of the oracle as well.
    let smoke = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes/smoke.toml");
    let smoke = scene(&smoke, UVec2::new(24, 24));
    let settings = Settings::new(TechniqueSet::of(preset("pt").unwrap().techniques));
    assert_eq!(settings.pinned(&smoke).tracking, Tracking::Delta);
    assert!(check(&smoke, "pt", &[UVec2::new(12, 11), UVec2::new(14, 14), UVec2::new(7, 12)]) > 20);
    let fog = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/fog-cornell/scene.toml");
    let fog = scene(&fog, UVec2::new(24, 24));
    let pixels = [[12, 6], [5, 18], [18, 12], [9, 20], [12, 12], [15, 16], [7, 9]].map(UVec2::from_array);
    assert!(check(&fog, "upbp", &pixels) > 100);
}

#[test]
fn a_pixel_is_explained() {
    let bench = Bench::new();
    let (out, _) = bench.succeed("explain small --pixel 12,13 --spp 16 --most 2");
    for part in [
        "paths contribute, a luminance of",
        "the 2 that contribute most:",
        "Path 1, of sample",
        "x_0   light",
        "weight by the\n",
        "recursion",
        "oracle",
    ] {
        assert!(out.contains(part), "'{part}' is not in {out}");
    }
    // The table's sum of weights is 1, both ways.
    let sum = out.lines().rfind(|l| l.trim_start().starts_with("sum")).unwrap();
    assert_eq!(sum.split_whitespace().collect::<Vec<_>>(), ["sum", "1.00000000", "1.00000000"]);
    let (again, _) = bench.succeed("explain small --pixel 12,13 --spp 16 --most 2 --threads 1");
    assert_eq!(out, again);
    // The iteration that the layer of outliers names holds the largest sample.
    bench.succeed("render small --spp 4 --layers families --out small.exr");
    let file = tyndall::film::exr::read_layers(bench.path("small.exr")).unwrap();
    let outliers = file.layer("outliers").unwrap();
    // Of a pixel to which more than one path contributes in that iteration.
    let several = (0..24).find_map(|x| {
        let sample = outliers.get(x, 8)[1];
        let line = format!("explain small --pixel {x},8 --sample {sample}");
        let (one, _) = bench.succeed(&line);
        let paths: usize = one.split(" paths contribute").next()?.parse().ok()?;
        Some((line, paths, sample))
    });
    let (line, paths, sample) = several.expect("no second path in any pixel's sample");
    let (last, _) = bench.succeed(&format!("{line} --path {paths}"));
    assert!(last.contains(&format!("Path {paths}, of sample {sample}:")), "{last}");
    let (beyond, all) = (format!("{line} --path {}", paths + 1), format!("{paths} paths are there"));
    bench.refuse(&beyond, &[&format!("no --path {}", paths + 1), &all]);
    for (line, parts) in [
        ("explain small --pixel 24,3", &["pixel 24,3", "columns 0 to 23"][..]),
        ("explain small --pixel 2,3 --out a.exr", &["unexpected argument '--out'"]),
        ("explain small --pixel 2,3 --spp 4 --sample 4", &["no sample 4", "4 spp", "0 to 3"]),
        ("explain small.png", &["small.png", "explain the EXR"]),
        ("explain small --pixel 2", &["column and row"]),
        ("explain small", &["--pixel X,Y"]),
    ] {
        bench.refuse(line, parts);
    }
}

/// Bug that this keeps out: `explain mean.exr` said that the runs of an experiment can be explained, and not where they are.
#[test]
fn a_mean_points_to_its_runs() {
    let bench = Bench::new();
    bench.succeed("run experiment.toml");
    let folder = "results/experiment/small/all";
    let both = [&format!("{folder}/run-00.exr"), &format!("{folder}/run-02.exr")];
    for line in ["", " --pixel 3,4"] {
        let parts =
            ["mean.exr: is a mean over 3 runs", "no samples of its own", both[0].as_str(), both[1].as_str()];
        bench.refuse(&format!("explain {folder}/mean.exr{line}"), &parts);
    }
    bench.succeed(&format!("explain {}", both[0]));
    std::fs::copy(bench.path(&format!("{folder}/mean.exr")), bench.path("mean.exr")).unwrap();
    bench.refuse("explain mean.exr", &["over 3 runs", "not beside it any more"]);
}

/// Bug that this keeps out: `explain reference.exr` said that another version had made it, as it did not say what had.
#[test]
fn a_reference_points_to_a_run() {
    let bench = Bench::new();
    bench.succeed("run experiment.toml --set runs=1");
    let parts =
        ["reference.exr: is a reference", "no samples of its own", "results/experiment/small/all/run-00.exr"];
    bench.refuse("explain results/experiment/small/reference.exr", &parts);
    // How it was made is in it, as in a render's.
    let [reference, run] = ["reference", "pt/run-00"]
        .map(|name| read_layers(bench.path(&format!("results/experiment/small/{name}.exr"))).unwrap());
    for key in ["tyndall.version", "tyndall.rendering"] {
        assert!(reference.text(key).is_some() && reference.text(key) == run.text(key), "{key}");
    }
    let settings: serde_json::Value =
        serde_json::from_str(reference.text("tyndall.settings").unwrap()).unwrap();
    assert_eq!(settings["techniques"], serde_json::json!(["hit", "nee", "connect", "lens"]));
    // Of a file that says nothing nothing is made up; and one that is taken for a reference again is the same to it.
    std::fs::copy(bench.path("results/experiment/small/reference.exr"), bench.path("truth.exr")).unwrap();
    let text = EXPERIMENT.replace("preset = \"bpt\"\nspp = 24", "file = \"truth.exr\"");
    bench.write("experiment.toml", &text);
    bench.succeed("run experiment.toml --set runs=1");
    let again = read_layers(bench.path("results/experiment/small/reference.exr")).unwrap();
    assert_eq!(again.text("tyndall.settings"), reference.text("tyndall.settings"));
    let mut bare = again.clone();
    bare.metadata.clear();
    tyndall::film::exr::write(bench.path("truth.exr"), &bare).unwrap();
    bench.succeed("run experiment.toml --set runs=1");
    let bare = read_layers(bench.path("results/experiment/small/reference.exr")).unwrap();
    assert_eq!(bare.text("tyndall.rendering"), None);
}

/// An EXR stands for its scene and settings: what is listed is explained without another word, to the bit. Bugs that this keeps out: a
/// size, a seed or a crop window that was forgotten and explained another image.
#[test]
fn a_file_stands_for_scene_and_settings() {
    let bench = Bench::new();
    let scene = std::fs::read_to_string(bench.path("small/scene.toml")).unwrap();
    let cropped = scene.replace("height = 16", "height = 16\ncrop = [5, 3, 21, 14]");
    bench.write("small/scene.toml", &cropped);
    let options = "--estimator vcm --heuristic power --spp 5 --size 30x20 --seed 3460601461304700019 --max-length 5 \
                   --merge surf.alpha=1 --merge direct=false --light-starts pilot --paths E.+L --layers families";
    bench.succeed(&format!("render small {options} --out a.exr"));
    let file = tyndall::film::exr::read_layers(bench.path("a.exr")).unwrap();
    assert_ne!(file.origin, [0, 0]);
    let (list, err) = bench.succeed("explain a.exr --top 3");
    assert!(!err.contains("warning"), "{err}");
    let rows: Vec<Vec<&str>> = list
        .lines()
        .filter(|l| l.contains("tyndall explain"))
        .map(|l| l.split_whitespace().collect())
        .collect();
    assert_eq!(rows.len(), 3, "{list}");
    for row in rows {
        let [_, luminance, share, pixel, sample, "tyndall", command @ ..] = &row[..] else {
            panic!("{list}")
        };
        let (out, err) = bench.succeed(&command.join(" "));
        assert!(!err.contains("warning"), "{err}");
        assert!(out.contains(&format!("pixel {pixel} is number {sample}: {share}")), "{out}");
        let known: f64 = luminance.parse().unwrap();
        let found = out.lines().find_map(|l| l.split("a luminance of ").nth(1)).unwrap();
        let found = found.split_whitespace().next().unwrap().trim_end_matches(':');
        let found: f64 = found.parse().unwrap();
        assert!((found - known).abs() <= 1e-5 * known, "{found} {known}");
        // The options by hand come to the same.
        let whole = options.replace("--spp 5", "").replace("--layers families", "");
        let (by_hand, _) = bench.succeed(&format!("explain small {whole} --pixel {pixel} --sample {sample}"));
        assert!(out.ends_with(&by_hand), "{out}\n{by_hand}");
        bench.succeed(&format!("explain a.exr --pixel {pixel} --sample 0"));
    }
    for (line, parts) in [
        ("explain a.exr --pixel 0,0", &["pixel 0,0 lies outside"][..]),
        ("explain a.exr --sample 3", &["--pixel X,Y"]),
        ("explain a.exr --pixel 12,8 --sample 5", &["no sample 5", "5 spp"]),
        (
            "explain a.exr --seed 3 --light-starts power",
            &["a.exr", "--seed", "--light-starts cannot be said"],
        ),
        ("explain none.exr", &["none.exr"]),
    ] {
        bench.refuse(line, parts);
    }
    // Without the layer of outliers, all samples of a pixel are looked at.
    bench.succeed(&format!("render small {} --out plain.exr", options.replace("--layers families", "")));
    bench.refuse(
        "explain plain.exr",
        &["plain.exr", "no layer `outliers`", "--layers families", "--pixel X,Y"],
    );
    let listed = |line: &str| bench.succeed(&format!("explain {line} --pixel 12,8")).0;
    assert_eq!(listed("plain.exr"), listed(&format!("small {}", options.replace("--layers families", ""))));
    assert!(listed("a.exr --sample 2").ends_with(&listed("plain.exr --sample 2")));
    let mut foreign = file.clone();
    foreign.metadata.clear();
    tyndall::film::exr::write(bench.path("foreign.exr"), &foreign).unwrap();
    bench.refuse("explain foreign.exr", &["foreign.exr", "no metadata `tyndall.settings`"]);
    bench.write("small/scene.toml", &cropped.replace("reflectance = 0.7", "reflectance = 0.6"));
    bench.refuse("explain a.exr --pixel 12,8", &["a.exr", "its scene has changed since", "small/scene.toml"]);
    std::fs::remove_file(bench.path("small/scene.toml")).unwrap();
    bench.refuse("explain a.exr --pixel 12,8", &["a.exr", "not there any more", "small/scene.toml"]);
}

/// The settings of runs, with all that a pilot chose, come back from what their EXRs say; and files with the channels of before
/// are read.
#[test]
fn runs_of_experiments_are_explained_from_anywhere() {
    let bench = Bench::new();
    let fog = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/fog-cornell");
    let text = format!(
        "budget = {{ spp = 3 }}\nruns = 2\nsize = [24, 24]\n[[scene]]\nfile = {fog:?}\n[[estimator]]\npreset = \"upbp\"\n"
    );
    bench.write("fog.toml", &text);
    bench.succeed("run fog.toml --out there/r");
    let run = "there/r/fog-cornell/upbp/run-01.exr";
    let (list, _) = bench.succeed(&format!("explain {run} --top 1"));
    let command = list.split("tyndall explain ").nth(1).unwrap().trim().to_owned();
    let (out, err) = bench.succeed(&format!("explain {command}"));
    assert!(!err.contains("warning") && out.contains("Path 1, of sample"), "{err}{out}");
    bench.refuse("explain there/r/fog-cornell/upbp/mean.exr", &["mean.exr: is a mean over 2 runs", run]);
    let first = "there/r/fog-cornell/upbp/run-00.exr for one";
    bench.refuse("explain there/r/fog-cornell/upbp/statistics.exr", &["no metadata", first]);
    // The page has the commands of the first run.
    let page = std::fs::read_to_string(bench.path("there/r/index.html")).unwrap();
    let first = "tyndall explain there/r/fog-cornell/upbp/run-00.exr --pixel ";
    assert_eq!(page.matches(first).count(), 5);
    let bytes = std::fs::read(bench.path(run)).unwrap();
    for name in ["luminance", "iteration", "share"] {
        let name = format!("outliers.{name}");
        assert!(bytes.windows(name.len()).any(|w| w == name.as_bytes()), "{name}");
    }
}
