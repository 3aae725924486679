//! Experiments that are killed, stopped, shared out and damaged.

#![cfg(unix)]

mod common;
#[path = "common/left.rs"]
mod left;

use common::{Bench, EXPERIMENT};
use left::left;
use std::collections::BTreeMap;
use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tyndall::experiment::results::{Results, read};

/// Several blocks a run, and a reference of several blocks.
const CHANGES: &str = "--set budget.spp=70 --set reference.spp=70 --set estimator.pt.budget={spp=40}";

fn files(bench: &Bench, end: &str) -> Vec<std::path::PathBuf> {
    bench.files().into_iter().filter(|f| f.to_string_lossy().ends_with(end)).collect()
}

/// Moments from a generator whose numbers are the same every time.
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1u64 << 53) as f64
}

#[test]
fn a_run_that_is_killed_goes_on_to_the_same_bits() {
    let bench = Bench::new();
    let start = Instant::now();
    bench.succeed(&format!("run experiment.toml {CHANGES} --out whole/r"));
    let whole = start.elapsed();
    let (mut seed, mut killed, mut stages) = (1, 0, Vec::new());
    for attempt in 0..10 {
        let mut child = bench
            .command(&format!("run experiment.toml {CHANGES} --out killed/r"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // Most of them fall into the part that is left.
        std::thread::sleep(whole.mul_f64(0.5 * random(&mut seed)) + Duration::from_millis(5));
        // SIGKILL: nothing in the process gets to tidy up.
        killed += u32::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        stages
            .push(files(&bench, ".film").iter().filter(|f| f.to_string_lossy().contains("killed/")).count());
        assert!(attempt > 0 || killed == 1, "the first one is killed before its end");
    }
    bench.succeed(&format!("run experiment.toml {CHANGES} --out killed/r"));
    assert!(killed >= 3, "{killed} of 10 were killed before their end");
    assert_eq!(
        left(&bench.path("killed/r")),
        left(&bench.path("whole/r")),
        "{killed} killed, at {stages:?} runs"
    );
    assert!(stages.is_sorted(), "what is done stays: {stages:?}");
    let cells = bench.path("killed/r/cells");
    let halves = files(&bench, ".part");
    assert!(halves.iter().all(|f| !f.starts_with(&cells)), "what was half written is tidied up: {halves:?}");
}

fn run_of(results: &Results, estimator: &str) -> (u64, f64) {
    let run = &results.cell("small", estimator).unwrap().runs[0];
    (run.spp, run.seconds)
}

#[test]
fn what_is_there_is_not_rendered_again() {
    let bench = Bench::new();
    bench.succeed(&format!("run experiment.toml {CHANGES}"));
    let dir = bench.path("results/experiment");
    let first = read(&dir).unwrap();
    let (_, err) = bench.succeed(&format!("run experiment.toml {CHANGES}"));
    assert!(!err.contains("run 1 of 3"), "{err}");
    assert_eq!(read(&dir).unwrap().cells, first.cells, "times and all");
    // More of it: from where it was; the same as in one go, up to rounding.
    let (_, err) =
        bench.succeed(&format!("run experiment.toml {CHANGES} --set estimator.pt.budget={{spp=50}}"));
    assert!(err.contains("small: pt, run 1 of 3, from 40 spp"), "{err}");
    assert!(!err.contains("small: all, run"), "{err}");
    let grown = read(&dir).unwrap();
    bench.succeed(&format!(
        "run experiment.toml {CHANGES} --set estimator.pt.budget={{spp=50}} --out other/r"
    ));
    let whole = read(bench.path("other/r")).unwrap();
    let [a, b] = [&grown, &whole].map(|r| r.cell("small", "pt").unwrap().metric("mse").unwrap().mean);
    assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    // Another scene, other settings, another seed: other runs.
    for change in ["--set max_length=3", "--set seed=4"] {
        let (_, err) = bench.succeed(&format!("run experiment.toml {CHANGES} {change}"));
        assert!(err.contains("small: pt, run 1 of 3:") || err.contains("small: pt, run 1 of 3\n"), "{err}");
    }
}

#[test]
fn damaged_runs_are_rendered_again() {
    let bench = Bench::new();
    bench.succeed(&format!("run experiment.toml {CHANGES}"));
    let dir = bench.path("results/experiment");
    let whole = left(&dir);
    let states = files(&bench, ".film");
    assert_eq!(states.len(), 6, "a state a run");
    let bytes = fs::read(&states[0]).unwrap();
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 4;
    for damage in [&bytes[..bytes.len() / 2], &bytes[..3], &[], &flipped] {
        fs::write(&states[0], damage).unwrap();
        bench.succeed(&format!("run experiment.toml {CHANGES}"));
        assert_eq!(left(&dir), whole);
    }
}

#[test]
fn shards_make_the_whole() {
    let bench = Bench::new();
    bench.succeed(&format!("run experiment.toml {CHANGES}"));
    let whole = left(&bench.path("results/experiment"));
    // In one folder, at the same time.
    let shards: Vec<_> = (1..=3)
        .map(|i| {
            let line = format!("run experiment.toml {CHANGES} --out one/r --shard {i}/3");
            bench.command(&line).stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap()
        })
        .collect();
    for mut shard in shards {
        assert!(shard.wait().unwrap().success());
    }
    assert!(!bench.path("one/r/results.json").exists(), "shards measure nothing");
    let (_, err) = bench.succeed(&format!("merge experiment.toml {CHANGES} --out one/r"));
    assert!(!err.contains("run 1 of 3"), "{err}");
    assert_eq!(left(&bench.path("one/r")), whole);
    // In folders of their own.
    for i in 1..=2 {
        bench.succeed(&format!("run experiment.toml {CHANGES} --out part{i}/r --shard {i}/2"));
    }
    bench.refuse(&format!("merge experiment.toml {CHANGES} small --out two/r"), &["small", "no runs here"]);
    bench.succeed(&format!("merge experiment.toml {CHANGES} part1/r --out two/r"));
    assert!(read(bench.path("two/r")).unwrap().partial, "half of it is missing");
    bench.succeed(&format!("merge experiment.toml {CHANGES} part1/r part2/r --out two/r"));
    assert_eq!(left(&bench.path("two/r")), whole);
}

#[test]
fn two_processes_share_the_work() {
    let bench = Bench::new();
    bench.succeed(&format!("run experiment.toml {CHANGES}"));
    let line = format!("run experiment.toml {CHANGES} --out both/r");
    let both: Vec<_> = (0..2)
        .map(|_| bench.command(&line).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap())
        .collect();
    let mut begun = BTreeMap::new();
    for process in both {
        let output = process.wait_with_output().unwrap();
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{err}");
        for line in err.lines().filter(|l| l.starts_with("small: ") && l.contains(", run ")) {
            *begun.entry(line.split(&[':', ','][..]).take(3).collect::<String>()).or_insert(0) += 1;
        }
    }
    assert_eq!(left(&bench.path("both/r")), left(&bench.path("results/experiment")));
    assert_eq!(begun.len(), 6, "{begun:?}");
}

#[test]
fn status_tells_what_is_left() {
    let bench = Bench::new();
    let (out, _) = bench.succeed(&format!("status experiment.toml {CHANGES}"));
    assert!(out.contains("0 of 6 runs and 0 of 1 reference are done; what is left cannot be told"), "{out}");
    let row = |out: &str, what: &str| -> Vec<String> {
        let line = out.lines().find(|l| l.contains(what)).unwrap();
        line.split_whitespace().map(str::to_owned).collect()
    };
    assert_eq!(row(&out, " the reference ")[3..11], ["0", "of", "70", "spp", "0", "0", "1", "0"], "{out}");
    // A reference of some seconds is in what is to go.
    let timed = format!("{CHANGES} --set reference.seconds=60 --set budget.seconds=2");
    let (out, _) = bench.succeed(&format!("status experiment.toml {timed} --set figures.costs=true"));
    let last = "reference are done; at least 1 min 06 s of rendering to go, a part of it cannot be told yet, and then";
    assert!(out.contains(last), "{out}");
    let timed = format!("{timed} --set estimator.pt.budget.seconds=2");
    let (out, _) = bench.succeed(&format!("status experiment.toml {timed} --set figures.costs=true"));
    let last = "0 of 6 runs and 0 of 1 reference are done; 1 min 12 s of rendering to go, and then measuring, with what";
    assert!(out.contains(last), "{out}");
    assert_eq!(row(&out, " the reference ")[3..10], ["0.0", "of", "60", "s", "0", "0", "1"], "{out}");
    bench.succeed(&format!("run experiment.toml {CHANGES} --shard 2/7"));
    let (out, _) = bench.succeed(&format!("status experiment.toml {CHANGES}"));
    assert!(out.contains("1 of 6 runs and"), "{out}");
    let line = out.lines().find(|l| l.contains(" pt ")).unwrap();
    let words: Vec<&str> = line.split_whitespace().collect();
    assert_eq!(words[2..9], ["1", "of", "3", "0", "0", "2", "40"], "{line}");
    bench.succeed(&format!("run experiment.toml {CHANGES}"));
    let (out, _) = bench.succeed(&format!("status experiment.toml {CHANGES}"));
    assert!(out.contains("6 of 6 runs and 1 of 1 reference are done; 0.00 s of rendering to go\n"), "{out}");
    assert_eq!(row(&out, " the reference ")[3..11], ["70", "of", "70", "spp", "0", "0", "0", "70"], "{out}");
    // Other settings: what is there is of before.
    let other = format!("status experiment.toml {CHANGES} --set max_length=3");
    let (out, _) = bench.succeed(&other);
    assert!(out.contains("0 of 6") && out.contains("6 runs of other settings"), "{out}");
    bench.succeed(&format!("{other} --prune"));
    assert!(files(&bench, ".film").is_empty());
}

/// Bug that this keeps out: images of a metric, and folders of an estimator, that were taken out of the experiment, beside those of now.
#[test]
fn what_was_taken_out_is_pruned() {
    let bench = Bench::new();
    bench.succeed("run experiment.toml");
    let (out, _) = bench.succeed("status experiment.toml --prune");
    assert!(!out.contains("taken out"), "{out}");
    let dir = bench.path("results/experiment/small");
    let notes = [dir.join("pt/notes.txt"), dir.join("pt/error-mine.png"), dir.join("theirs/run-00.exr")];
    fs::create_dir(dir.join("theirs")).unwrap();
    notes.iter().for_each(|note| fs::write(note, "of somebody else").unwrap());
    let text = EXPERIMENT.replace("[[estimator]]\npreset = \"pt\"\n", "");
    let less = text.replace("\"mse\", ", "").replace("runs = 3", "runs = 2");
    bench.write("experiment.toml", &less);
    let (out, _) = bench.succeed("status experiment.toml");
    assert!(out.contains("files of scenes, estimators, runs and metrics that were taken out"), "{out}");
    assert!(dir.join("pt/mean.exr").exists(), "nothing is deleted without asking");
    bench.succeed("status experiment.toml --prune");
    let there = |name: &str| dir.join(name).exists();
    assert!(
        !there("pt/mean.exr")
            && !there("pt/settings.toml")
            && !there("all/run-02.exr")
            && !there("all/error-mse.png")
    );
    assert!(
        there("all/run-01.exr")
            && there("all/error-relmse.png")
            && there("all/mean.exr")
            && there("reference.exr")
    );
    assert!(notes.iter().all(|note| note.exists()));
    // Without anything of somebody else, the folder goes, too.
    bench.write("experiment.toml", &less.replace("name = \"all\"", "name = \"both\""));
    bench.succeed("status experiment.toml --prune");
    assert!(!there("all") && there("reference.exr") && there("reference.png"));
    // A scene that is no more takes its reference along.
    bench.write("experiment.toml", &less.replace("file = \"small\"", "file = \"small\"\nname = \"other\""));
    let (out, _) = bench.succeed("status experiment.toml --prune");
    assert!(
        out.contains("deleted 2 files of what was taken out") && out.contains("results/experiment/small"),
        "{out}"
    );
    assert!(!there("reference.exr") && !there("reference.png") && notes.iter().all(|note| note.exists()));
}

#[test]
fn timed_runs_keep_their_number_of_iterations() {
    let bench = Bench::new();
    let line = "run experiment.toml --set budget.seconds=0.3 --set runs=1";
    bench.succeed(line);
    let dir = bench.path("results/experiment");
    let first = read(&dir).unwrap();
    for cell in &first.cells {
        let run = &cell.runs[0];
        assert!(0.0 < run.setup && run.setup < run.seconds, "pilots are within the clock");
    }
    bench.succeed(line);
    let again = read(&dir).unwrap();
    assert_eq!(["pt", "all"].map(|e| run_of(&again, e)), ["pt", "all"].map(|e| run_of(&first, e)));
    // With other threads it is another measurement; for longer, the same goes on.
    let (_, err) = bench.succeed(&format!("{line} --threads 3"));
    assert!(err.contains("small: pt:"), "{err}");
    let (_, err) = bench.succeed(&line.replace("0.3", "0.6"));
    assert!(err.contains(&format!("small: pt, from {} spp", run_of(&first, "pt").0)), "{err}");
    let longer = read(&dir).unwrap();
    assert!(run_of(&longer, "pt").0 > run_of(&first, "pt").0);
    assert!((run_of(&longer, "pt").1 - 0.6).abs() < 0.3);
}

#[test]
fn runs_end_at_an_error() {
    let bench = Bench::new();
    let text =
        EXPERIMENT.replace("{ spp = 4 }", "{ relmse = 0.05, spp = 3000 }").replace("spp = 24", "spp = 600");
    bench.write("experiment.toml", &text);
    bench.succeed("run experiment.toml");
    let dir = bench.path("results/experiment");
    let results = read(&dir).unwrap();
    for run in results.cells.iter().flat_map(|c| &c.runs) {
        let reached = run.relmse.unwrap();
        assert!(reached <= 0.05 && (2..3000).contains(&run.spp), "{} spp: {reached}", run.spp);
        // Not long before.
        let before = run.checkpoints.iter().rev().find(|c| c.spp < run.spp).unwrap();
        assert!(before.metrics["relmse"] > 0.05, "{before:?}");
    }
    let (_, err) = bench.succeed("run experiment.toml");
    assert!(!err.contains("run 1 of 3"), "{err}");
    // What does not come to it stops at its bound, and says so.
    let (_, err) =
        bench.succeed("run experiment.toml --set budget.relmse=1e-9 --set budget.spp=20 --set runs=1");
    assert!(err.contains("did not come to a relMSE of 0.000000001"), "{err}");
    for (change, part) in [
        ("{ relmse = 0.05 }", "needs a bound"),
        ("{ relmse = 0.05, spp = 3, second = 2 }", "did you mean `seconds`"),
        ("{ relmse = -1, spp = 3 }", "-1"),
    ] {
        bench.write("experiment.toml", &text.replace("{ relmse = 0.05, spp = 3000 }", change));
        bench.refuse("run experiment.toml", &["experiment.toml:3:", part]);
    }
    let alone = text.replace("[reference]\npreset = \"bpt\"\nspp = 600\n", "");
    bench.write("experiment.toml", &alone);
    bench.refuse("run experiment.toml", &["no reference to measure it against"]);
}

/// Disk full, as a limit on the size of files: the error names the file, and what was there is still there.
#[test]
fn a_full_disk_is_said_and_loses_nothing() {
    let bench = Bench::new();
    bench.succeed(&format!("run experiment.toml {CHANGES} --shard 2/7"));
    let before = files(&bench, ".film");
    let program = env!("CARGO_BIN_EXE_tyndall");
    let script = format!("trap '' XFSZ; ulimit -f 8; exec {program} run experiment.toml {CHANGES}");
    let output = Command::new("sh").args(["-c", &script]).current_dir(bench.path("")).output().unwrap();
    let err = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{err}");
    assert!(err.contains("cannot write") && err.contains("results/"), "{err}");
    assert!(before.iter().all(|f| f.is_file()));
    bench.succeed(&format!("run experiment.toml {CHANGES}"));
}

/// The folder of results is moved away while the experiment runs.
#[test]
fn results_that_disappear_are_said() {
    let bench = Bench::new();
    let mut child = bench
        .command("run experiment.toml --set estimator.all.budget={spp=1000000000}")
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().unwrap()));
    assert!(lines.by_ref().map(Result::unwrap).any(|line| line.starts_with("small: all, run 1 of 3")));
    fs::rename(bench.path("results/experiment"), bench.path("away")).unwrap();
    let rest: Vec<String> = lines.map(Result::unwrap).collect();
    assert_eq!(child.wait().unwrap().code(), Some(2));
    let error = rest.iter().find(|l| l.starts_with("error:")).unwrap();
    assert!(error.contains("results/experiment/cells"), "{error}");
}
