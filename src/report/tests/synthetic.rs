//! Results of an experiment that never ran: images of a made-up scene with noise of a known size, so that the page can be
//! made and tested without a renderer.

use crate::experiment::results::*;
use crate::film::Image;
use crate::film::exr::{LayeredImage, write};
use crate::math::{Stream, StreamKind};
use std::collections::BTreeMap;
use std::path::Path;

/// What the made-up experiment is like.
pub struct Options {
    /// Keys and labels of the estimators.
    pub estimators: Vec<(&'static str, &'static str)>,
    /// Labels of the scenes.
    pub scenes: Vec<&'static str>,
    /// Independent runs.
    pub runs: u32,
    /// Size of the images.
    pub size: (usize, usize),
    /// Whether there are layers of techniques and of (s, t).
    pub layers: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            estimators: vec![
                ("pt", "path tracing"),
                ("lt", "light tracing"),
                ("bpt", "bidirectional path tracing"),
            ],
            scenes: vec!["Two balls in a box"],
            runs: 4,
            size: (48, 36),
            layers: true,
        }
    }
}

const METRICS: [(&str, &str, &str); 5] = [
    ("relmse", "relMSE", "mean of (x − r)²/(r² + ε) over pixels and channels, ε = 10⁻²"),
    ("mse", "MSE", "mean of (x − r)² over pixels and channels"),
    ("mae", "MAE", "mean of |x − r| over pixels and channels"),
    ("smape", "SMAPE", "mean of |x − r|/(|x| + |r|) over pixels and channels"),
    ("flip", "FLIP", "perceived difference when flipping between the images"),
];

/// A ball on a floor under a light, by formula.
pub fn picture(width: usize, height: usize) -> Image {
    Image::from_fn(width, height, |x, y| {
        let (u, v) = (x as f32 / width as f32 * 2.0 - 1.0, y as f32 / height as f32 * 2.0 - 1.0);
        let ball = |cx: f32, cy: f32, r: f32| {
            let d2 = ((u - cx).powi(2) + (v - cy).powi(2)) / (r * r);
            (d2 < 1.0).then(|| (1.0 - d2).sqrt())
        };
        if (v + 0.92).abs() < 0.05 && u.abs() < 0.3 {
            return [8.0, 7.5, 6.5];
        }
        if let Some(z) = ball(-0.4, 0.45, 0.32) {
            return [0.1 + 0.5 * z, 0.08 + 0.2 * z, 0.05 + 0.1 * z];
        }
        if let Some(z) = ball(0.45, 0.4, 0.38) {
            return [0.03 + 0.1 * z, 0.1 + 0.3 * z, 0.2 + 0.6 * z * z];
        }
        let light = 0.55 / (0.5 + u * u + (v + 0.9).powi(2));
        match (u, v) {
            (u, _) if u < -0.85 => [0.9 * light, 0.15 * light, 0.12 * light],
            (u, _) if u > 0.85 => [0.12 * light, 0.6 * light, 0.15 * light],
            (_, v) if v > 0.75 => [0.5 * light, 0.45 * light, 0.4 * light],
            _ => [0.7 * light, 0.68 * light, 0.62 * light],
        }
    })
}

/// Times a lognormal factor of mean 1: more of it where the estimator is weak.
fn noisy(image: &Image, estimator: usize, spread: f32, seed: u64) -> Image {
    let mut stream = Stream::new(seed, 0, StreamKind::Other, estimator as u64);
    Image::from_fn(image.width, image.height, |x, y| {
        let weak = match estimator {
            0 => 1.0 + 2.0 * f32::from(u8::from(y > image.height * 2 / 3)),
            1 => 1.0 + 4.0 * f32::from(u8::from(x > image.width / 2)),
            _ => 0.6,
        };
        let normal: f32 = (0..6).map(|_| stream.next_1d()).sum::<f32>() - 3.0;
        let s = spread * weak;
        image.get(x, y).map(|v| v * (s * normal * 1.4 - 0.5 * s * s).exp())
    })
}

fn estimate(values: &[f64]) -> Estimate {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let half = 3.0 * deviation / n.sqrt();
    let interval = (values.len() > 1).then_some(Interval { low: mean - half, high: mean + half });
    Estimate { mean, interval }
}

fn scaled(image: &Image, f: impl Fn(usize, usize) -> f32) -> Image {
    Image::from_fn(image.width, image.height, |x, y| image.get(x, y).map(|v| v * f(x, y)))
}

/// Adds layers of techniques and of (s, t) that sum up to the image.
fn add_layers(out: &mut LayeredImage, image: &Image, techniques: &[&str]) {
    let n = techniques.len() as f32;
    for (i, key) in techniques.iter().enumerate() {
        let tilt = |x: usize| {
            1.0 / n + (if i % 2 == 0 { 0.5 } else { -0.5 }) * (x as f32 / image.width as f32 - 0.5) / n
        };
        out.push(format!("weighted.{key}"), scaled(image, |x, _| tilt(x)));
        out.push(
            format!("weight.{key}"),
            scaled(&Image::from_fn(image.width, image.height, |_, _| [1.0; 3]), |x, _| tilt(x)),
        );
        out.push(
            format!("unweighted.{key}"),
            scaled(image, |_, y| if i == 1 && y % 3 == 0 { 0.0 } else { 0.9 }),
        );
    }
    for k in 1..=5u32 {
        for s in 0..=k {
            let share = 0.5f32.powi(k as i32) / (1.0 + (s as f32 - 0.5 * k as f32).powi(2));
            out.push(format!("weighted.s{s:02}t{:02}", k + 1 - s), scaled(image, |_, _| share));
            out.push(
                format!("unweighted.s{s:02}t{:02}", k + 1 - s),
                scaled(image, |x, _| share * (1 + x % 2) as f32),
            );
        }
    }
}

/// Value of a metric after so many samples in a run.
fn metric(key: &str, estimator: usize, spp: u64, run: u32) -> f64 {
    let wobble = 1.0 + 0.15 * ((7 * run + 3 * estimator as u32 + spp as u32 % 5) as f64).sin();
    let size = [0.8, 2.5, 0.25][estimator % 3] * (1.0 + estimator as f64 / 3.0);
    let squared = size * wobble / spp as f64 + if estimator == 1 { 0.02 } else { 0.0 };
    match key {
        "relmse" => squared,
        "mse" => 0.3 * squared,
        "flip" => 0.4 * squared.powf(0.25),
        _ => 0.5 * squared.sqrt(),
    }
}

fn run(index: u32, estimator: usize, spp: u64, exr: String) -> Run {
    let at = |spp: u64| {
        METRICS
            .iter()
            .map(|m| (m.0.to_owned(), metric(m.0, estimator, spp, index)))
            .collect::<BTreeMap<_, _>>()
    };
    let pace = [0.011, 0.009, 0.034][estimator % 3];
    let checkpoints = (0..).map(|i| 1u64 << i).take_while(|s| *s <= spp);
    let checkpoints: Vec<Checkpoint> =
        checkpoints.map(|s| Checkpoint { spp: s, seconds: pace * s as f64, metrics: at(s) }).collect();
    // By way of JSON, as a results file of any program of this schema would come.
    let run = serde_json::json!({
        "index": index,
        "setup": 0.004,
        "merges": if estimator == 2 { serde_json::json!({"surf": "radius 1.0000e-2 m"}) } else { serde_json::json!({}) },
        "seed": 0x5eed_0000 + u64::from(index),
        "spp": spp,
        "seconds": pace * spp as f64 * (1.0 + 0.01 * f64::from(index)),
        "camera_paths": spp * 96 * 72,
        "light_paths": if estimator == 0 { 0 } else { spp * 96 * 72 },
        "dropped": {},
        "partial": false,
        "mean": [0.5, 0.5, 0.5],
        "metrics": at(spp),
        "checkpoints": checkpoints,
        "exr": exr,
    });
    serde_json::from_value(run).unwrap()
}

fn curve(key: &str, runs: &[Run]) -> Curve {
    let points = (0..runs[0].checkpoints.len()).map(|i| CurvePoint {
        spp: runs[0].checkpoints[i].spp,
        seconds: runs[0].checkpoints[i].seconds,
        value: estimate(&runs.iter().map(|r| r.checkpoints[i].metrics[key]).collect::<Vec<_>>()),
    });
    let slope = Some(Estimate {
        mean: -0.987,
        interval: (runs.len() > 1).then_some(Interval { low: -1.021, high: -0.953 }),
    });
    Curve { metric: key.into(), points: points.collect(), slope_spp: slope, slope_seconds: slope }
}

/// Shares of a technique, made up.
fn share(i: usize, key: &str, several: bool) -> TechniqueShare {
    let value = |mean: f64| Estimate {
        mean,
        interval: several.then_some(Interval { low: mean - 0.02, high: mean + 0.02 }),
    };
    TechniqueShare {
        technique: key.into(),
        energy: value(0.4 / (1.0 + i as f64)),
        variance: several.then(|| value(0.3)),
        caused: several.then(|| value(0.01 - 0.02 * i as f64)),
        time: (i > 0).then(|| value(0.2)),
    }
}

/// Writes the images of one estimator in one scene; what it measured.
fn cell(dir: &Path, scene: &str, e: usize, options: &Options, reference: &Image) -> Cell {
    let spp = 64 >> e.min(2);
    let key = options.estimators[e].0;
    let base = format!("{scene}/{key}");
    std::fs::create_dir_all(dir.join(&base)).unwrap();
    let one = noisy(reference, e, 0.25, 1);
    let techniques: &[&str] = match e {
        0 => &["hit", "nee"],
        1 => &["lens"],
        _ => &["hit", "nee", "connect", "lens"],
    };
    let mut file = LayeredImage::new(one.clone());
    if options.layers {
        add_layers(&mut file, &one, techniques);
    }
    let layers = file.layers.iter().map(|l| l.name.clone()).filter(|n| !n.is_empty()).collect();
    write(dir.join(format!("{base}/mean.exr")), &file).unwrap();
    let outlier = |x: usize, y: usize| [one.get(x, y)[1], (x + y) as f32, if x == 7 { 0.875 } else { 0.5 }];
    file.push("outliers", Image::from_fn(one.width, one.height, outlier));
    write(dir.join(format!("{base}/run-00.exr")), &file).unwrap();
    let error = |x: usize, y: usize| {
        let (a, b) = (one.get(x, y), reference.get(x, y));
        [(0..3).map(|i| (a[i] - b[i]).powi(2) / (b[i] * b[i] + 0.01)).sum::<f32>() / 3.0; 3]
    };
    let mut maps = LayeredImage::new(Image::from_fn(one.width, one.height, error));
    let map = maps.layers[0].image.clone();
    METRICS.iter().for_each(|m| maps.push(m.0, map.clone()));
    write(dir.join(format!("{base}/error.exr")), &maps).unwrap();
    let mut statistics = LayeredImage { layers: Vec::new(), ..LayeredImage::new(one.clone()) };
    statistics.push("variance", Image::from_fn(one.width, one.height, |x, y| [error(x, y)[0] * 0.5; 3]));
    statistics.push(
        "bias",
        Image::from_fn(one.width, one.height, |x, y| {
            [0, 1, 2].map(|c| one.get(x, y)[c] - reference.get(x, y)[c])
        }),
    );
    for key in techniques {
        statistics.push(format!("variance.{key}"), map.clone());
    }
    write(dir.join(format!("{base}/statistics.exr")), &statistics).unwrap();

    let runs: Vec<Run> =
        (0..options.runs).map(|r| run(r, e, spp, format!("{base}/run-{r:02}.exr"))).collect();
    let over = |f: &dyn Fn(&Run) -> f64| estimate(&runs.iter().map(f).collect::<Vec<_>>());
    let several = options.runs > 1;
    Cell {
        scene: scene.into(),
        estimator: key.into(),
        min_length: 1,
        max_length: 64,
        paths: "all".into(),
        summary: METRICS
            .iter()
            .map(|m| Summary {
                metric: m.0.into(),
                value: over(&|r| r.metrics[m.0]),
                noise: None,
                measured: None,
            })
            .collect(),
        variance: several.then(|| over(&|r| 0.9 * r.metrics["mse"])),
        bias: several.then(|| over(&|r| 0.1 * r.metrics["mse"])),
        efficiency: Some(over(&|r| 1.0 / (r.metrics["mse"] * r.seconds))),
        variance_efficiency: several.then(|| over(&|r| 1.1 / (r.metrics["mse"] * r.seconds))),
        seconds: over(&|r| r.seconds),
        spp: over(&|r| r.spp as f64),
        convergence: METRICS.iter().map(|m| curve(m.0, &runs)).collect(),
        files: Files {
            png: format!("{base}/run-00.png"),
            exr: format!("{base}/run-00.exr"),
            mean_exr: format!("{base}/mean.exr"),
            mean_png: format!("{base}/mean.png"),
            error_exr: Some(format!("{base}/error.exr")),
            error_png: BTreeMap::new(),
            statistics_exr: Some(format!("{base}/statistics.exr")),
            layers,
        },
        techniques: techniques.iter().enumerate().map(|(i, key)| share(i, key, several)).collect(),
        warnings: Vec::new(),
        runs,
    }
}

fn scene(dir: &Path, key: &str, label: &str, options: &Options, reference: &Image) -> SceneResult {
    std::fs::create_dir_all(dir.join(key)).unwrap();
    write(dir.join(format!("{key}/reference.exr")), &LayeredImage::new(reference.clone())).unwrap();
    SceneResult {
        key: key.into(),
        label: label.into(),
        caption:
            "A matte ball and a glossy one under a small light, so that no technique is best everywhere."
                .into(),
        file: format!("scenes/{key}/scene.toml"),
        width: options.size.0,
        height: options.size.1,
        exposure: 0.5,
        crops: Vec::new(),
        reference: Some(Reference {
            kind: ReferenceKind::Estimator("bpt".into()),
            exr: format!("{key}/reference.exr"),
            png: format!("{key}/reference.png"),
            spp: Some(16384),
            seconds: Some(557.0),
            variance: Some(3e-6),
            partial: false,
            paths: Some("all".into()),
        }),
        warnings: Vec::new(),
    }
}

fn info(e: usize, key: &str, label: &str) -> EstimatorInfo {
    let techniques: &[&str] = [&["hit", "nee"][..], &["lens"], &["hit", "nee", "connect", "lens"]][e.min(2)];
    EstimatorInfo {
        key: key.into(),
        label: label.into(),
        caption: if e == 1 {
            "Black where light must pass glass last: no connection to the lens goes through it.".into()
        } else {
            String::new()
        },
        color: ["#4477aa", "#ee6677", "#228833", "#aa3377", "#ccbb44", "#66ccee"][e % 6].into(),
        settings: EstimatorSettings {
            techniques: techniques.iter().map(|t| (*t).to_owned()).collect(),
            heuristic: "balance".into(),
            min_length: None,
            max_length: Some(64),
            paths: if e == 1 { "ES*M(S|D|M)*L".into() } else { "all".into() },
            layers: "all".into(),
            pyramid: 5,
            budget: Budget::Seconds(0.7),
        },
    }
}

/// Writes the images into a folder, and gives the results; [`save`] writes these too.
pub fn results(dir: &Path, options: &Options) -> Results {
    let reference = picture(options.size.0, options.size.1);
    let keys: Vec<String> = (0..options.scenes.len()).map(|i| format!("scene{i}")).collect();
    let scenes: Vec<SceneResult> =
        keys.iter().zip(&options.scenes).map(|(k, l)| scene(dir, k, l, options, &reference)).collect();
    let cells = keys.iter().flat_map(|k| (0..options.estimators.len()).map(move |e| (k, e)));
    let cells = cells.map(|(k, e)| cell(dir, k, e, options, &reference)).collect();
    let scale: BTreeMap<String, f64> = keys.iter().map(|k| (k.clone(), 0.5)).collect();
    let metrics = METRICS.iter().map(|m| MetricInfo {
        key: m.0.into(),
        label: m.1.into(),
        description: m.2.into(),
        map_scale: scale.clone(),
    });
    Results {
        schema: SCHEMA,
        experiment: "synthetic".into(),
        source: None,
        title: "Three ways to light a box".into(),
        description: "Path tracing, light tracing and both together at equal time.\n\nThe second paragraph."
            .into(),
        program: "tyndall 0.1.0".into(),
        rendering: "0123456789abcdef".into(),
        machine: Machine { cpu: "a processor of the tests".into(), cores: 2, threads: 2 },
        started: "2026-01-01T00:00:00Z".into(),
        finished: "2026-01-01T00:03:00Z".into(),
        partial: false,
        runs: options.runs,
        metrics: metrics.collect(),
        scenes,
        estimators: options.estimators.iter().enumerate().map(|(i, (k, l))| info(i, k, l)).collect(),
        cells,
        figures: Figures {
            contributions: Some("bpt".into()),
            strip: true,
            comparison: true,
            techniques: true,
            pyramid: Some([2, 5]),
            convergence: true,
            costs: true,
            width_cm: Some(8.5),
            font_pt: None,
        },
        warnings: Vec::new(),
    }
}

/// Writes `results.json`.
pub fn save(dir: &Path, results: &Results) {
    std::fs::write(dir.join(FILE_NAME), serde_json::to_string_pretty(results).unwrap()).unwrap();
}
