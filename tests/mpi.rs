//! Experiments by several ranks of MPI, and a rank that is killed. With `--features mpi`; scripts/install-mpi.sh installs what it needs.

#![cfg(all(unix, feature = "mpi"))]

#[allow(dead_code)]
mod common;
#[path = "common/left.rs"]
mod left;

use common::Bench;
use left::left;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant, SystemTime};
use tyndall::experiment::results::read;

/// Several blocks a run, a reference of several blocks, and a run of one block.
const CHANGES: &str = "--set budget.spp=70 --set reference.spp=70 --set estimator.pt.budget={spp=9}";

fn mpirun(bench: &Bench, ranks: u32, line: &str) -> Command {
    let mut command = Command::new("mpirun");
    // More ranks than processors, as root in CI: Open MPI wants to be told.
    for name in ["OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"] {
        command.env(name, "1");
    }
    command.args(["--oversubscribe", "--bind-to", "none", "-n", &ranks.to_string()]);
    command.arg(env!("CARGO_BIN_EXE_tyndall")).args(line.split_whitespace());
    command.current_dir(bench.path(""));
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[track_caller]
fn succeed(bench: &Bench, ranks: u32, line: &str) -> (String, String) {
    let output = mpirun(bench, ranks, line).output().expect("mpirun: scripts/install-mpi.sh installs it");
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{:?}\n{out}{err}", output.status);
    (out, err)
}

fn count(bench: &Bench, part: &str, end: &str) -> usize {
    let is = |path: &std::path::PathBuf| {
        let path = path.to_string_lossy();
        path.contains(part) && path.ends_with(end)
    };
    bench.files().iter().filter(|f| is(f)).count()
}

#[test]
fn ranks_make_the_bits_of_one_process() {
    let bench = Bench::new();
    bench.succeed(&format!("run experiment.toml {CHANGES} --out one/r"));
    let whole = left(&bench.path("one/r"));
    for ranks in [1, 2, 4] {
        let out = format!("of{ranks}/r");
        let (said, err) = succeed(&bench, ranks, &format!("run experiment.toml {CHANGES} --out {out}"));
        assert_eq!(left(&bench.path(&out)), whole, "{ranks} ranks");
        assert_eq!(said.matches("index.html").count(), 1, "one of them speaks: {said}");
        if ranks > 1 {
            // 3 blocks of the reference; 3 runs of 4 blocks, put together; 3 runs of one block.
            assert!(err.contains(&format!("{ranks} ranks")) && err.contains("22 of 22 pieces"), "{err}");
            assert!(
                !err.contains(", run 1 of 3"),
                "nothing is left to be rendered when it is measured: {err}"
            );
        }
        assert_eq!(count(&bench, &out, ".film"), 6, "blocks are gone when they are in a state");
        // A second time there is nothing to do.
        let (_, err) = succeed(&bench, ranks, &format!("run experiment.toml {CHANGES} --out {out}"));
        assert!(ranks == 1 || err.contains("0 pieces are left"), "{err}");
    }
}

/// The processes that mpirun started.
fn ranks_of(child: &Child) -> Vec<String> {
    let path = format!("/proc/{0}/task/{0}/children", child.id());
    let children = std::fs::read_to_string(path).unwrap_or_default();
    children.split_whitespace().map(str::to_owned).collect()
}

fn lives(pid: &str) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit(") ").next().is_some_and(|rest| !rest.is_empty() && !rest.starts_with(['Z', 'X']))
}

/// Files of blocks and states that were written since.
fn written(bench: &Bench, since: SystemTime) -> usize {
    let new = |path: &std::path::PathBuf| path.metadata().and_then(|m| m.modified()).is_ok_and(|m| m > since);
    bench.files().iter().filter(|f| f.extension().is_some_and(|e| e == "film") && new(f)).count()
}

/// Starts an experiment, and kills one of its ranks when it has written so many blocks; what mpirun says.
fn kill_one(bench: &Bench, ranks: u32, victim: usize, blocks: usize, line: &str) -> Output {
    let mut child = mpirun(bench, ranks, line).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let (start, since) = (Instant::now(), SystemTime::now());
    while written(bench, since) < blocks {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it was killed");
        assert!(start.elapsed() < Duration::from_secs(100), "no blocks come");
        std::thread::sleep(Duration::from_millis(2));
    }
    let pids = ranks_of(&child);
    assert_eq!(pids.len(), ranks as usize, "{pids:?}");
    assert!(Command::new("kill").args(["-9", &pids[victim]]).status().unwrap().success());
    let killed = Instant::now();
    let output = child.wait_with_output().unwrap();
    assert!(killed.elapsed() < Duration::from_secs(20), "the others end soon: {:?}", killed.elapsed());
    // Whoever adopts them may not have taken note of their end yet.
    let deadline = Instant::now() + Duration::from_secs(10);
    while let Some(pid) = pids.iter().find(|pid| lives(pid)) {
        assert!(Instant::now() < deadline, "process {pid} is still there");
        std::thread::sleep(Duration::from_millis(20));
    }
    output
}

#[test]
fn a_rank_that_is_killed_ends_the_run_and_it_goes_on_to_the_same_bits() {
    let bench = Bench::new();
    let changes =
        "--set budget.spp=9000 --set reference.spp=64 --set runs=2 --set estimator.pt.budget={spp=9}";
    bench.succeed(&format!("run experiment.toml {changes} --out one/r"));
    let line = format!("run experiment.toml {changes} --out killed/r");
    for (ranks, victim, blocks) in [(4, 2, 2), (2, 1, 2), (2, 0, 1)] {
        let output = kill_one(&bench, ranks, victim, blocks, &line);
        let err = text(&output.stderr);
        assert!(!output.status.success(), "{err}");
        assert_eq!(output.status.code(), Some(137), "128 + SIGKILL, as shells have it: {err}");
        assert!(err.contains(&format!("process rank {victim}")) && err.contains("signal 9"), "{err}");
        if victim != 0 {
            assert!(err.contains("the same command goes on"), "{err}");
        }
        assert!(!bench.path("killed/r/index.html").exists(), "{err}");
        let (out, _) = bench.succeed(&format!("status {}", line.trim_start_matches("run ")));
        assert!(!out.contains("4 of 4 runs are done"), "{out}");
        let all = out.lines().find(|l| l.contains(" all ")).unwrap().split_whitespace().nth(8).unwrap();
        assert!(all.parse::<u64>().unwrap() > 0, "blocks that wait for those before them count: {out}");
    }
    let (_, err) = succeed(&bench, 2, &line);
    assert!(!err.contains("rendered again"), "{err}");
    assert_eq!(left(&bench.path("killed/r")), left(&bench.path("one/r")));
}

#[test]
fn one_process_goes_on_from_blocks_of_ranks() {
    let bench = Bench::new();
    let changes =
        "--set budget.spp=2000 --set reference.spp=64 --set runs=1 --set estimator.pt.budget={spp=9}";
    bench.succeed(&format!("run experiment.toml {changes} --out one/r"));
    let line = format!("run experiment.toml {changes} --out killed/r");
    kill_one(&bench, 4, 3, 4, &line);
    bench.succeed(&line);
    assert_eq!(left(&bench.path("killed/r")), left(&bench.path("one/r")));
    assert_eq!(count(&bench, "killed/", ".film"), 2);
}

/// Runs in time are rendered when nothing else is, and count as those of one process.
#[test]
fn timed_runs_come_last_and_one_at_a_time() {
    let bench = Bench::new();
    let line = "run experiment.toml --set budget.seconds=0.3 --set estimator.pt.budget={spp=70} --set runs=2";
    let (_, err) = succeed(&bench, 4, line);
    assert!(!err.contains("another kind of machine"), "{err}");
    let dir = bench.path("results/experiment");
    let first = read(&dir).unwrap();
    for run in &first.cell("small", "all").unwrap().runs {
        assert!((run.seconds - 0.3).abs() < 0.15, "{} s", run.seconds);
    }
    // A process without MPI takes them for its own.
    let (_, err) = bench.succeed(line);
    assert!(!err.contains("run 1 of 2"), "{err}");
    assert_eq!(read(&dir).unwrap().cells, first.cells, "times and all");
    // Until an error is reached: from a reference that is not there yet.
    let line = "run experiment.toml --set budget.relmse=0.05 --set budget.spp=3000 --set reference.spp=600";
    succeed(&bench, 2, &format!("{line} --out two/r"));
    bench.succeed(&format!("{line} --out alone/r --cache alone/c"));
    assert_eq!(left(&bench.path("two/r")), left(&bench.path("alone/r")));
}

#[test]
fn what_is_wrong_is_said_once() {
    let bench = Bench::new();
    let refused = |line: &str, code: i32, parts: &[&str]| {
        let output = mpirun(&bench, 3, line).output().unwrap();
        let err = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{err}");
        assert_eq!(err.matches("error:").count(), 1, "{err}");
        parts.iter().for_each(|part| assert!(err.contains(part), "'{part}' is not in: {err}"));
    };
    refused("run nowhere.toml", 2, &["nowhere.toml"]);
    refused("run experiment.toml --set runs=0", 2, &["runs"]);
    refused("run experiment.toml --shard 1/2", 2, &["--shard"]);
    // A file where a run's folder should be: one rank or the other comes upon it, and the rest ends.
    bench.write("results", "");
    refused("run experiment.toml", 2, &["results"]);
}
