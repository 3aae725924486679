//! Results survive being written and read.

use super::*;

fn results() -> Results {
    let estimate = Estimate { mean: 1.5, interval: Some(Interval { low: 1.0, high: 2.0 }) };
    let run = Run {
        index: 0,
        seed: u64::MAX,
        spp: 4,
        seconds: 0.1,
        setup: 0.01,
        waited: 0.5,
        rendered: Some("2025-12-31T23:59:59Z".into()),
        merges: BTreeMap::new(),
        relmse: Some(0.25),
        mse: Some(0.5),
        camera_paths: 64,
        light_paths: 0,
        dropped: BTreeMap::from([("nee".into(), 2)]),
        partial: true,
        mean: [0.5; 3],
        metrics: BTreeMap::from([("mse".into(), 1.0 / 3.0)]),
        measured: BTreeMap::from([("mse".into(), 0.4)]),
        checkpoints: vec![Checkpoint { spp: 1, seconds: 0.02, metrics: BTreeMap::new() }],
        exr: "box/pt/run-00.exr".into(),
    };
    let cell = Cell {
        scene: "box".into(),
        estimator: "pt".into(),
        min_length: 1,
        max_length: 64,
        paths: all_paths(),
        runs: vec![run],
        summary: vec![Summary { metric: "mse".into(), value: estimate, noise: None, measured: None }],
        variance: None,
        bias: Some(estimate),
        efficiency: Some(estimate),
        variance_efficiency: None,
        seconds: Estimate { mean: 0.1, interval: None },
        spp: Estimate { mean: 4.0, interval: None },
        convergence: Vec::new(),
        techniques: Vec::new(),
        files: Files::default(),
        warnings: Vec::new(),
    };
    Results {
        schema: SCHEMA,
        experiment: "e".into(),
        source: Some(Origin { file: "/a/e.toml".into(), contents: "0".into() }),
        title: "E".into(),
        description: String::new(),
        program: "tyndall".into(),
        rendering: "0123456789abcdef".into(),
        machine: Machine { cpu: "unknown".into(), cores: 2, threads: 1 },
        started: "2026-01-01T00:00:00Z".into(),
        finished: "2026-01-01T00:00:01Z".into(),
        partial: true,
        runs: 2,
        metrics: Vec::new(),
        scenes: Vec::new(),
        estimators: Vec::new(),
        cells: vec![cell],
        figures: Figures {
            contributions: Some("pt".into()),
            strip: false,
            comparison: true,
            techniques: false,
            pyramid: Some([2, 5]),
            convergence: true,
            costs: false,
            width_cm: None,
            font_pt: None,
        },
        warnings: vec!["é".into()],
    }
}

#[test]
fn results_come_back_as_they_were_written() {
    let dir = tempfile::tempdir().unwrap();
    let json = serde_json::to_string_pretty(&results()).unwrap();
    std::fs::write(dir.path().join(FILE_NAME), json).unwrap();
    let back = read(dir.path()).unwrap();
    assert_eq!(back, results());
    assert_eq!(back.cell("box", "pt").unwrap().metric("mse").unwrap().mean, 1.5);
    assert!(back.cell("box", "bpt").is_none());
    assert_eq!(read(dir.path().join(FILE_NAME)).unwrap(), back, "the file itself can be named");
}

/// The bug that this keeps out: a metric that is NaN or infinite made `results.json` a file that could not be read.
#[test]
fn numbers_that_are_not_finite_leave_results_that_can_be_read() {
    let dir = tempfile::tempdir().unwrap();
    for value in [f64::NAN, f64::INFINITY] {
        let mut broken = results();
        let run = &mut broken.cells[0].runs[0];
        run.metrics.insert("mse".into(), value);
        run.checkpoints[0].metrics.insert("mse".into(), value);
        run.mean[1] = value;
        let interval = Some(Interval { low: value, high: value });
        broken.cells[0].summary[0].value = Estimate { mean: value, interval };
        broken.write(dir.path()).unwrap();
        let back = read(dir.path()).unwrap();
        let (cell, run) = (&back.cells[0], &back.cells[0].runs[0]);
        assert!(run.metrics["mse"].is_nan() && run.checkpoints[0].metrics["mse"].is_nan());
        assert!(run.mean[1].is_nan() && run.mean[0] == 0.5);
        assert!(cell.metric("mse").unwrap().mean.is_nan());
        assert_eq!(cell.seconds, results().cells[0].seconds);
    }
}

#[test]
fn damage_and_other_versions_are_said() {
    let dir = tempfile::tempdir().unwrap();
    assert!(read(dir.path()).unwrap_err().to_string().contains("there are no results here"));
    let path = dir.path().join(FILE_NAME);
    let json = serde_json::to_string_pretty(&results()).unwrap();
    std::fs::write(&path, &json[..json.len() / 2]).unwrap();
    assert!(read(dir.path()).unwrap_err().to_string().contains("damaged results"));
    std::fs::write(&path, json.replacen("\"schema\": 2", "\"schema\": 99", 1)).unwrap();
    assert!(read(dir.path()).unwrap_err().to_string().contains("schema 99"));
}

#[test]
fn only_whole_results_are_finished() {
    let dir = tempfile::tempdir().unwrap();
    let since = |time| finished_since(dir.path(), time);
    assert!(!since("2026-01-01T00:00:00Z"), "there are none");
    let mut results = results();
    results.write(dir.path()).unwrap();
    assert!(!since("2026-01-01T00:00:00Z"), "a part");
    results.partial = false;
    results.write(dir.path()).unwrap();
    assert!(since("2026-01-01T00:00:00Z") && !since("2026-01-01T00:00:01Z"));
}
