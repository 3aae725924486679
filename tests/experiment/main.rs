//! Experiments from file to results, by the program.

#[path = "../common/mod.rs"]
mod common;
mod places;
mod references;

use common::{Bench, EXPERIMENT};
use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;
use tyndall::experiment::overrides::Override;
use tyndall::experiment::results::{Estimate, Results, read};
use tyndall::film::exr::{read_layers, read_rgb};
use tyndall::render::LEFT_OUT;

fn results(bench: &Bench) -> Results {
    read(bench.path("results/experiment")).unwrap()
}

#[test]
fn an_experiment_runs_from_end_to_end() {
    let bench = Bench::new();
    bench.succeed("run experiment.toml --threads 2");
    let results = results(&bench);
    assert!(!results.partial);
    assert_eq!((results.title.as_str(), results.runs, results.machine.threads), ("A small experiment", 3, 2));
    let keys: Vec<&str> = results.metrics.iter().map(|m| m.key.as_str()).collect();
    assert_eq!(keys, ["relmse", "mse", "flip"]);
    assert_eq!(results.cells.len(), 2);
    let reference = results.scenes[0].reference.as_ref().unwrap();
    assert_eq!(reference.spp, Some(24));
    assert!(reference.variance.unwrap() > 0.0 && !reference.partial);
    let mut seeds = HashSet::new();
    for cell in &results.cells {
        assert_eq!((cell.runs.len(), cell.spp.mean, cell.max_length), (3, 4.0, 6));
        assert!(cell.runs.iter().all(|r| seeds.insert(r.seed)), "every run has a seed of its own");
        for key in &keys {
            let value = cell.metric(key).unwrap();
            let interval = value.interval.unwrap();
            assert!(value.mean > 0.0 && interval.low <= value.mean && value.mean <= interval.high);
        }
        assert!(cell.variance.unwrap().mean > 0.0 && cell.efficiency.unwrap().mean > 0.0);
        let spps: Vec<u64> = cell.runs[0].checkpoints.iter().map(|c| c.spp).collect();
        assert_eq!(spps, [1, 2, 4]);
        let curve = &cell.convergence[0];
        assert_eq!((curve.metric.as_str(), curve.points.len()), ("relmse", 3));
        assert!(curve.slope_spp.unwrap().interval.is_some());
        let files = &cell.files;
        let mut named = vec![&files.png, &files.exr, &files.mean_exr, &files.mean_png];
        named.extend(&files.error_exr);
        named.extend(files.error_png.values());
        assert_eq!(named.len(), 8);
        for file in named {
            assert!(bench.path("results/experiment").join(file).is_file(), "{file}");
        }
    }
    let text = std::fs::read_to_string(bench.path("results/experiment/small/pt/convergence.json")).unwrap();
    let curves: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(
        (curves["timesteps"].as_array().unwrap().len(), curves["data"].as_array().unwrap().len()),
        (3, 3)
    );
    let pt = results.cell("small", "pt").unwrap();
    assert_eq!(
        curves["data"][2]["mse"],
        pt.convergence.iter().find(|c| c.metric == "mse").unwrap().points[2].value.mean
    );
    let page = std::fs::read_to_string(bench.path("results/experiment/index.html")).unwrap();
    assert!(page.contains("A small experiment") && page.trim_end().ends_with("</html>"));
    assert!(results.cells[0].files.layers.is_empty());
    assert!(results.cells[1].files.layers.iter().any(|l| l == "weighted.connect"));
    assert_eq!(results.estimators[1].settings.heuristic, "power 2");
    assert!(results.metrics[0].map_scale["small"] > 0.0);
}

#[test]
fn a_report_can_be_made_again() {
    let bench = Bench::new();
    bench.succeed("run experiment.toml --set runs=1");
    let page = bench.path("results/experiment/index.html");
    let first = std::fs::read(&page).unwrap();
    std::fs::remove_file(&page).unwrap();
    let (out, _) = bench.succeed("report results/experiment");
    assert!(out.contains("index.html"));
    assert_eq!(std::fs::read(&page).unwrap(), first);
    // At another exposure, which the page says; and back.
    let picture = || std::fs::read(bench.path("results/experiment/figures/small-crops.png")).unwrap();
    let dim = picture();
    bench.succeed("report results/experiment --exposure -1.5");
    let (other, bright) = (std::fs::read_to_string(&page).unwrap(), picture());
    assert!(other.contains("Shown at an exposure of −1.5 stops instead of +0.5, as the experiment has it."));
    assert!(other.contains("sRGB at −1.5 stops for all") && dim != bright);
    bench.succeed("report results/experiment");
    assert_eq!((std::fs::read(&page).unwrap(), picture()), (first, dim));
    bench.refuse("report results/experiment --exposure bright", &["a number of stops"]);
    // Of the file as it is now the report knows nothing.
    let hint = "experiment.toml has changed since: `tyndall run experiment.toml` takes that up";
    assert!(!bench.succeed("report results/experiment").1.contains("changed"));
    bench.write("experiment.toml", &EXPERIMENT.replace("A small experiment", "Another title"));
    let (_, err) = bench.succeed("report results/experiment");
    assert!(err.contains(hint), "{err}");
    std::fs::remove_file(bench.path("experiment.toml")).unwrap();
    assert!(!bench.succeed("report results/experiment").1.contains("changed"));
}

/// The numbers in the files belong together: metrics follow from the images, means from the runs.
#[test]
fn numbers_follow_from_the_files() {
    let bench = Bench::new();
    bench.succeed("run experiment.toml");
    let results = results(&bench);
    let root = bench.path("results/experiment");
    let reference = read_rgb(root.join("small/reference.exr")).unwrap();
    let cell = results.cell("small", "all").unwrap();
    let mut mean = vec![[0.0f64; 3]; reference.pixels.len()];
    for run in &cell.runs {
        let image = read_rgb(root.join(&run.exr)).unwrap();
        let comparison = tyndall::cli::compare::compare(&image, &reference).unwrap();
        for value in &comparison.values {
            if let Some(stored) = run.metrics.get(value.metric.description().key) {
                let key = value.metric.description().key;
                assert_eq!(run.measured.get(key).unwrap_or(stored), &value.value, "{key}");
            }
        }
        for (sum, pixel) in mean.iter_mut().zip(&image.pixels) {
            (0..3).for_each(|c| sum[c] += f64::from(pixel[c]) / 3.0);
        }
    }
    let file = read_layers(root.join(&cell.files.mean_exr)).unwrap();
    for (pixel, expected) in file.layer("").unwrap().pixels.iter().zip(&mean) {
        (0..3)
            .for_each(|c| assert!((f64::from(pixel[c]) - expected[c]).abs() <= 1e-6 * expected[c].max(1.0)));
    }
    // Weighted layers add up to the image, in the mean too.
    let layer = |key: &str| file.layer(&format!("weighted.{key}")).unwrap();
    let layers = ["hit", "nee", "connect", "lens"].map(layer);
    for (i, expected) in mean.iter().enumerate() {
        for (c, expected) in expected.iter().enumerate() {
            let sum: f64 = layers.iter().map(|l| f64::from(l.pixels[i][c])).sum();
            assert!((sum - expected).abs() <= 1e-5 * expected.max(1.0));
        }
    }
}

/// Bugs that this keeps out: a table that has another value than the page under the same key, and numbers of the page that no table has.
#[test]
fn tables_have_a_row_a_number() {
    let bench = Bench::new();
    bench.write("experiment.toml", &format!("{EXPERIMENT}\n[figures]\ncosts = true\n"));
    // What takes time beside the renders is said when it begins.
    let (_, err) = bench.succeed("run experiment.toml");
    for part in [
        "small: pt: measuring: 3 runs\n",
        "small: pt: what techniques cost, each left out in turn: 18 renders\n",
        "small: all: what techniques cost, each left out in turn: 30 renders\n",
        "small: all: what techniques cost, each left out in turn: done in ",
        "page and figures of 1 scene and 2 estimators\n",
    ] {
        assert!(err.contains(part), "'{part}' is not in {err}");
    }
    let results = results(&bench);
    let text = std::fs::read_to_string(bench.path("results/experiment/results.csv")).unwrap();
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let columns = "scene,estimator,run,seed,spp,seconds,partial,metric,value,low,high";
    assert_eq!(head, columns.split(',').collect::<Vec<_>>());
    let mut values = BTreeMap::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), head.len(), "{line}");
        let key = (cells[1].to_owned(), cells[2].parse::<u32>().ok(), cells[7].to_owned());
        let number = |i: usize| cells[i].parse::<f64>().ok();
        let row = (number(8).unwrap(), number(9).zip(number(10)));
        assert!(values.insert(key, row).is_none(), "{line}");
    }
    let mut expected = 0;
    for cell in &results.cells {
        let get = |run: Option<u32>, metric: &str| values[&(cell.estimator.clone(), run, metric.to_owned())];
        let ends = |e: Estimate| e.interval.map(|i| (i.low, i.high));
        for run in &cell.runs {
            for (metric, value) in &run.metrics {
                let summary = cell.summary.iter().find(|s| s.metric == *metric).unwrap();
                assert_eq!(get(Some(run.index), metric), (*value, None), "an interval is of all runs");
                let measured =
                    values.get(&(cell.estimator.clone(), Some(run.index), format!("{metric}_measured")));
                // FLIP has no part that is the reference's noise.
                assert_eq!(measured.is_some(), metric != "flip");
                if let Some((measured, _)) = measured {
                    let apart = (measured - value - summary.noise.unwrap()).abs();
                    assert!(apart < 1e-12 && summary.noise > Some(0.0));
                    let all = summary.measured.unwrap();
                    assert_eq!(get(None, &format!("{metric}_measured")), (all.mean, ends(all)));
                }
            }
            assert_eq!(run.metrics["relmse"], run.relmse.unwrap());
            assert_eq!(get(Some(run.index), "spp").0, 4.0);
            assert_eq!(get(Some(run.index), "seconds"), (run.seconds, None));
        }
        assert_eq!(get(None, "seconds"), (cell.seconds.mean, ends(cell.seconds)));
        assert_eq!(get(None, "spp").0, 4.0);
        let mean = (0..3).map(|run| get(Some(run), "mean").0).sum::<f64>() / 3.0;
        assert!((get(None, "mean").0 / mean - 1.0).abs() < 1e-12 && get(None, "mean").1.is_some());
        // What the page shows is the mean of the rows.
        for metric in ["relmse", "mse", "flip"] {
            let mean = (0..3).map(|run| get(Some(run), metric).0).sum::<f64>() / 3.0;
            let shown = cell.metric(metric).unwrap();
            assert_eq!(get(None, metric), (shown.mean, ends(shown)));
            let shown = shown.mean;
            assert!((mean - shown).abs() <= 1e-12 * shown.abs(), "{mean} {shown}");
        }
        for (name, e) in [
            ("variance", cell.variance),
            ("bias2", cell.bias),
            ("efficiency", cell.efficiency),
            ("relmse_efficiency", cell.efficiency_by("relmse")),
            ("variance_efficiency", cell.variance_efficiency),
        ] {
            assert_eq!(get(None, name), (e.unwrap().mean, ends(e.unwrap())));
        }
        for share in &cell.techniques {
            for (name, e) in [
                ("energy", Some(share.energy)),
                ("variance", share.variance),
                ("caused", share.caused),
                ("time", share.time),
            ] {
                let e = e.unwrap();
                assert_eq!(get(None, &format!("{name}.{}", share.technique)), (e.mean, ends(e)));
            }
        }
        expected += (3 + 1) * (3 + 2 + 3) + 5 + 4 * cell.techniques.len();
    }
    assert_eq!(
        values.len(),
        expected,
        "runs and their mean × (metrics, two as measured, mean, spp, seconds), and those over the runs"
    );
}

#[test]
fn results_are_the_same_again_and_with_other_threads() {
    let bench = Bench::new();
    bench.succeed("run experiment.toml --threads 1 --out a/r");
    bench.succeed("run experiment.toml --threads 3 --out b/r");
    let metrics = |name: &str| -> Vec<BTreeMap<String, f64>> {
        let results = read(bench.path(name)).unwrap();
        results.cells.iter().flat_map(|c| c.runs.iter().map(|r| r.metrics.clone())).collect()
    };
    assert_eq!(metrics("a/r"), metrics("b/r"));
    // Another base seed: other runs, the same reference.
    let (_, err) = bench.succeed("run experiment.toml --out b/r --set seed=1");
    assert!(err.contains("reference of 24 spp found"), "{err}");
    assert_ne!(metrics("a/r"), metrics("b/r"));
}

/// The estimator that is named keeps its layers, mean weights among them, and the figure is made.
#[test]
fn contributions_are_kept_for_the_estimator_that_is_named() {
    let bench = Bench::new();
    let text = EXPERIMENT.replace("layers = \"families\"\n", "").replace("runs = 3", "runs = 2");
    bench.write("experiment.toml", &format!("{text}\n[figures]\ncontributions = \"all\"\n"));
    bench.succeed("run experiment.toml");
    let results = results(&bench);
    assert!(results.cell("small", "pt").unwrap().files.layers.is_empty());
    let cell = results.cell("small", "all").unwrap();
    let root = bench.path("results/experiment");
    assert!(root.join("figures/small-contributions-all.png").is_file());
    let file = read_layers(root.join(&cell.files.mean_exr)).unwrap();
    for key in ["hit", "nee", "connect", "lens"] {
        let [weighted, unweighted, weight] = ["weighted", "unweighted", "weight"]
            .map(|kind| file.layer(&format!("{kind}.{key}")).unwrap_or_else(|| panic!("{kind}.{key}")));
        for i in 0..weight.pixels.len() {
            let w = weight.pixels[i][0];
            assert!((0.0..=1.0).contains(&w));
            let lit = unweighted.pixels[i] != [0.0; 3];
            assert_eq!(weighted.pixels[i] != [0.0; 3], w > 0.0 && lit, "{key}, pixel {i}");
        }
        assert!(weight.pixels.iter().any(|p| p[0] > 0.0), "{key}");
    }
}

/// What a pilot left out is said where the others have numbers. Bugs that this keeps out: an image without light taken for a
/// technique that adds nothing, and the noise of a clock for what it costs.
#[test]
fn techniques_that_are_left_out_are_said_to_be() {
    let bench = Bench::new();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/medium-balls");
    let text = format!(
        "title = \"Left out\"\nbudget = {{ spp = 2 }}\nruns = 3\nsize = [32, 24]\n[figures]\ncosts = true\n\
         contributions = \"upbp\"\n[[scene]]\nfile = {scene:?}\n[[estimator]]\npreset = \"upbp\"\n\
         [[estimator]]\nname = \"even\"\npreset = \"upbp\"\nmerge = {{ efficient = false }}\n",
    );
    bench.write("experiment.toml", &text);
    bench.succeed("run experiment.toml");
    let results = results(&bench);
    let page = std::fs::read_to_string(bench.path("results/experiment/index.html")).unwrap();
    let mut left_out = 0;
    for cell in &results.cells {
        assert_eq!(cell.techniques.len(), 8, "{}", cell.estimator);
        for share in &cell.techniques {
            let said = cell.runs[0].merges.get(&share.technique).is_some_and(|words| words == LEFT_OUT);
            let row = format!("data-estimator=\"{}\" data-technique=\"{}\"", cell.estimator, share.technique);
            let row = page.split(&row).nth(1).unwrap().split("</tr>").next().unwrap();
            assert_eq!(row.contains(LEFT_OUT), said, "{row}");
            assert_eq!(share.time.is_none(), said, "{share:?}");
            assert!(!said || share.energy.mean == 0.0);
            left_out += usize::from(said);
        }
    }
    assert!(left_out > 0, "otherwise this shows nothing");
    assert!(results.cell("medium-balls", "even").unwrap().techniques.iter().all(|t| t.time.is_some()));
}

#[test]
fn time_is_shared_out_evenly() {
    let bench = Bench::new();
    bench.succeed("run experiment.toml --set budget.seconds=0.2 --set runs=1");
    for cell in &results(&bench).cells {
        assert!((0.1..0.4).contains(&cell.seconds.mean), "{}: {}", cell.estimator, cell.seconds.mean);
        assert!(cell.spp.mean > 2.0);
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_what_is_done() {
    let bench = Bench::new();
    let mut child = bench
        .command("run experiment.toml --set estimator.all.budget={spp=1000000000}")
        .stderr(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().unwrap()));
    let begun = lines.by_ref().map(Result::unwrap).any(|line| line.starts_with("small: all, run 1 of 3"));
    assert!(begun);
    std::thread::sleep(Duration::from_millis(200));
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    for _ in lines {}
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let results = results(&bench);
    assert!(results.partial);
    assert_eq!(results.cell("small", "pt").unwrap().runs.len(), 3);
    let stopped = results.cell("small", "all").unwrap();
    assert_eq!(stopped.runs.len(), 1);
    assert!(stopped.runs[0].partial && stopped.runs[0].spp > 0);
    assert!(stopped.warnings.iter().any(|w| w.contains("stopped")));
}

#[test]
fn the_experiments_of_the_project_can_be_read() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments");
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        // The scene of one is not in the repository: another stands in, as its comments say.
        let stand_in = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/import/scenes/goblet.obj");
        let overrides: Vec<Override> = match path.ends_with("smallupbp-still-life.toml") {
            true => ["full", "media"]
                .map(|scene| Override::parse(&format!("scene.{scene}.file={stand_in}")).unwrap())
                .to_vec(),
            false => Vec::new(),
        };
        let plan = tyndall::experiment::plan::read(&path, &overrides).unwrap_or_else(|e| panic!("{e}"));
        for scene in &plan.scenes {
            tyndall::scene::file::load(&scene.path, &Default::default()).unwrap_or_else(|e| panic!("{e}"));
        }
        assert_eq!(plan.warnings, Vec::<String>::new(), "{}", path.display());
        names.push(plan.name);
    }
    names.sort();
    assert_eq!(
        names,
        [
            "bpt-vs-pt",
            "contributions",
            "heterogeneous",
            "light-tracing",
            "media-bpt",
            "media-bpt-only-media",
            "pt-lt-bpt",
            "pyramid",
            "quickstart",
            "smallupbp-still-life",
            "upbp-still-life",
            "upbp-vs-singles",
            "vcm"
        ]
    );
}

#[test]
fn wrong_experiments_are_pointed_at() {
    let bench = Bench::new();
    for (from, to, parts) in [
        ("runs = 3", "runs = 0", &["experiment.toml:4:8", "from 1 up"][..]),
        ("runs = 3", "run = 3", &["experiment.toml:4:1", "`run`", "did you mean `runs`"]),
        ("runs = 3", "runs = [", &["experiment.toml:"]),
        ("{ spp = 4 }", "{ spp = 4, seconds = 1 }", &["experiment.toml:3:", "exactly one"]),
        ("{ spp = 4 }", "{ seconds = -1 }", &["experiment.toml:3:", "-1"]),
        ("budget = { spp = 4 }", "", &["experiment.toml:", "no budget"]),
        ("\"mse\"", "\"mze\"", &["experiment.toml:5:", "`mse`"]),
        ("\"mse\"", "\"relmse\"", &["experiment.toml:5:", "twice"]),
        ("file = \"small\"", "file = \"smal\"", &["experiment.toml:12:8", "smal", "did you mean `small`?"]),
        ("preset = \"pt\"", "preset = \"ppt\"", &["experiment.toml:", "`ppt`", "did you mean"]),
        ("preset = \"pt\"", "", &["experiment.toml:", "lacks `preset`"]),
        ("\"lens\"", "\"lense\"", &["'lense'", "did you mean 'lens'"]),
        ("preset = \"pt\"", "preset = \"pt\"\nname = \"all\"", &["experiment.toml:", "two estimators"]),
        ("name = \"all\"", "name = \"../all\"", &["experiment.toml:", "../all"]),
        ("heuristic = \"power\"", "exponent = 2", &["experiment.toml:", "power"]),
        ("width = 8, height = 8", "width = 80, height = 8", &["80x8", "24x16"]),
        ("spp = 24", "", &["experiment.toml:", "exactly one of `spp` and `seconds`"]),
        ("preset = \"bpt\"\nspp = 24", "file = \"none.exr\"", &["experiment.toml:8:", "none.exr"]),
        (
            "preset = \"bpt\"\nspp = 24",
            "file = \"small/scen.toml\"",
            &["experiment.toml:8:8", "no reference image", "did you mean `small/scene.toml`?"],
        ),
        ("exposure = 0.5", "exposure = nan", &["experiment.toml:13:", "NaN"]),
        ("layers = \"families\"", "color = \"red\"", &["experiment.toml:", "#rrggbb"]),
        ("exposure = 0.5", "min_length = 9", &["minimum path length is 9"]),
        ("runs = 3", "runs = 3\npaths = \"medai\"", &["experiment.toml:5:9", "did you mean `media`?"]),
        (
            "preset = \"pt\"",
            "preset = \"pt\"\npaths = \"ES|DL\"",
            &["experiment.toml:18:9", "column 3", "parentheses"],
        ),
        ("spp = 24", "spp = 24\npaths = \"SDL\"", &["experiment.toml:10:9", "column 1", "the lens"]),
        (
            "preset = \"bpt\"\nspp = 24",
            "file = \"small/scene.toml\"\npaths = \"media\"",
            &["experiment.toml:8:8", "not both"],
        ),
        (
            "spp = 24",
            "spp = 24\nmerge = { first = true }",
            &["experiment.toml:10:9", "cannot be weighted then"],
        ),
        ("spp = 24", "spp = 24\nmerge = { surf = { radius = -1 } }", &["experiment.toml:10:9", "above 0"]),
        ("spp = 24", "spp = 24\n[figures]\ncontributions = \"al\"", &["`al`", "did you mean `all`"]),
        ("exposure = 0.5", "paths = \"medai\"", &["experiment.toml:13:9", "did you mean `media`?"]),
    ] {
        assert!(EXPERIMENT.contains(from), "{from}");
        bench.write("experiment.toml", &EXPERIMENT.replacen(from, to, 1));
        bench.refuse("run experiment.toml", parts);
    }
    bench.write("experiment.toml", EXPERIMENT);
    for (line, parts) in [
        ("--set runs", &["key=value"][..]),
        ("--set runs=0", &["--set runs=0", "from 1 up"]),
        ("--set rums=2", &["--set rums=2", "did you mean `runs`"]),
        ("--set estimator.bpt.label=x", &["there is no entry `bpt`", "pt, all"]),
        ("--out small/scene.toml", &["small/scene.toml", "folder"]),
        ("--out /proc/tyndall/x", &["/proc/tyndall"]),
    ] {
        bench.refuse(&format!("run experiment.toml {line}"), parts);
    }
}

/// Bugs that this keeps out: a run by tracking taken for an exact one, one that does not say it, and a setting that the technique set forbids
/// found out while rendering.
#[test]
fn tracking_is_part_of_what_a_run_is() {
    let bench = Bench::new();
    let scene = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes/smoke.toml");
    bench.write("smoke.toml", &std::fs::read_to_string(scene).unwrap());
    let text = "budget = { spp = 1 }\nsize = [8, 8]\n[reference]\npreset = \"pt\"\ntracking = \"exact\"\nspp = 2\n\
                [[scene]]\nfile = \"smoke.toml\"\n[[estimator]]\npreset = \"pt\"\n";
    bench.write("experiment.toml", text);
    let of = |part: &str| -> HashSet<_> {
        let files = bench.files().into_iter().filter(|f| f.to_string_lossy().contains(part));
        files.map(|f| f.parent().unwrap().to_owned()).collect()
    };
    let said = || {
        let file = std::fs::read_to_string(bench.path("results/experiment/smoke/pt/settings.toml")).unwrap();
        file.lines().find(|l| l.starts_with("tracking")).map(str::to_owned)
    };
    bench.succeed("run experiment.toml --cache cache");
    assert_eq!(said().as_deref(), Some("tracking = \"delta\""));
    let (cells, references) = (of("/cells/").len(), of("/block-").len());
    // What it comes to is what counts, not what was said.
    bench.succeed("run experiment.toml --cache cache --set estimator.pt.tracking=delta");
    assert_eq!(of("/cells/").len(), cells);
    bench.succeed("run experiment.toml --cache cache --set estimator.pt.tracking=exact");
    assert_eq!(said().as_deref(), Some("tracking = \"exact\""));
    assert!(of("/cells/").len() > cells, "an exact run was taken for a tracked one");
    assert_eq!(of("/block-").len(), references);
    bench.succeed("run experiment.toml --cache cache --set reference.tracking=auto");
    assert_eq!(of("/block-").len(), references + 1);
    let estimator = "[[estimator]]\npreset = \"bpt\"\ntracking = \"delta\"\n";
    bench.write("wrong.toml", &text.replace("[[estimator]]\npreset = \"pt\"\n", estimator));
    bench.refuse(
        "run wrong.toml",
        &["wrong.toml", "tracking by `delta` is for hit and nee alone: connect, lens"],
    );
}
