//! The page made from results that never ran: it is whole, holds all it shows, and stands whatever the numbers are.

mod layout;
mod synthetic;
mod verdict;

use super::markup::imbalance;
use super::{ReportSummary, report, report_of};
use crate::experiment::results::*;
use std::path::Path;
use synthetic::{Options, results, save};

fn page(dir: &Path, results: &Results) -> (String, ReportSummary) {
    let summary = report_of(dir, results).unwrap();
    let html = std::fs::read_to_string(&summary.page).unwrap();
    assert_eq!(html.len(), summary.bytes);
    check(&html, &summary);
    (html, summary)
}

/// What holds of every page: balanced tags, ids that are there once, links that lead somewhere, nothing from outside.
fn check(html: &str, summary: &ReportSummary) {
    assert_eq!(imbalance(html), None);
    // Base64 may spell anything.
    let pieces = html.split("data:image/png;base64,").map(|s| s.trim_start_matches(|c| c != '"'));
    let lower: String = pieces.collect::<String>().to_ascii_lowercase();
    for outside in
        ["http:", "https:", "src=\"//", "@import", "url(", "<script src", "<link", "<iframe", "javascript:"]
    {
        assert!(!lower.contains(outside), "the page holds '{outside}'");
    }
    let values = |attribute: &str| {
        let key = format!(" {attribute}=\"");
        html.split(&key).skip(1).map(|rest| rest.split('"').next().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert!(values("src").iter().all(|s| s.starts_with("data:image/png;base64,")));
    let ids = values("id");
    let mut unique = ids.clone();
    unique.sort();
    unique.dedup();
    assert_eq!(unique.len(), ids.len(), "an id is there twice");
    for link in values("href") {
        let target = link.strip_prefix('#').expect("only links within the page");
        assert!(ids.iter().any(|id| id == target), "nothing is at {link}");
    }
    assert_eq!(html.matches("<img ").count(), html.matches(" alt=\"").count(), "an image without a text");
    for drawing in html.split("<svg").skip(1).map(|s| s.split("</svg>").next().unwrap()) {
        assert!(!drawing.contains("NaN") && !drawing.contains("\"inf"), "{drawing}");
    }
    for figure in &summary.figures {
        let svg = std::fs::read_to_string(figure).unwrap();
        assert_eq!(imbalance(&svg), None, "{}", figure.display());
        // Base64 may spell anything.
        let drawn: String =
            svg.split("data:image/png;base64,").map(|s| s.trim_start_matches(|c| c != '"')).collect();
        assert!(!drawn.contains("NaN") && !drawn.contains("var("), "{}", figure.display());
    }
}

/// Set TYNDALL_REPORT_SAMPLE to a folder to keep the page there and look at it.
#[test]
fn the_page_has_every_section() {
    let temporary = tempfile::tempdir().unwrap();
    let kept = std::env::var_os("TYNDALL_REPORT_SAMPLE").map(std::path::PathBuf::from);
    let dir = kept.as_deref().unwrap_or(temporary.path());
    let size = if kept.is_some() { (512, 384) } else { (48, 36) };
    let mut r = results(
        dir,
        &Options { size, scenes: vec!["Two balls in a box", "The same again"], ..Options::default() },
    );
    r.warnings.push("This is made up.".into());
    r.scenes[1].crops = vec![Crop { name: "the blue ball".into(), x: 20, y: 10, width: 16, height: 12 }];
    r.cells[1].runs[0].dropped.insert("lens".into(), 3);
    save(dir, &r);
    let summary = report(dir).unwrap();
    assert_eq!(report(&dir.join(FILE_NAME)).unwrap(), summary, "the file can be named instead");
    assert_eq!(summary.problems, Vec::<String>::new());
    let html = std::fs::read_to_string(&summary.page).unwrap();
    check(&html, &summary);
    for part in ["contributions", "images", "strip", "metrics", "why", "convergence", "techniques", "pyramid"]
    {
        for scene in ["scene0", "scene1"] {
            assert!(html.contains(&format!("id=\"scene-{scene}-{part}\"")), "no {part} of {scene}");
        }
    }
    for text in [
        "id=\"reproducibility\"",
        "data-exr=\"scene0/pt/run-00.exr\"",
        "data-layer=\"weighted.s02t03\"",
        "data-exr=\"scene1/bpt/error.exr\" data-layer=\"relmse\"",
        "chosen automatically, where the estimators",
        "A: the blue ball at (20, 10), 16×12 pixels",
        "3 of lens",
        "This is made up.",
        "no connection to the lens goes through it",
        "of the energy",
        "mean weight 0.25",
        "not distinguishable from 0",
        "data-layer=\"variance.connect\"",
        "Mean over the runs less the reference",
        "−20.0 % ±",
        "radius 1.0000e-2 m",
        "Weighted contributions: bidirectional path tracing",
        "data-layer=\"weight.connect\"",
        "90.0 % of the energy",
        "rendering code 0123456789abcdef",
        "exposure ×",
        "slope −0.987\u{a0}±\u{a0}0.034",
        "slope −1<",
        "a processor of the tests",
        "16\u{202f}384 spp",
    ] {
        assert!(html.contains(text), "'{text}' is not in the page");
    }
    let names: Vec<String> =
        summary.figures.iter().map(|f| f.file_name().unwrap().to_string_lossy().into_owned()).collect();
    for figure in &summary.figures {
        let pdf = std::fs::read(figure.with_extension("pdf")).unwrap();
        assert!(pdf.starts_with(b"%PDF") && figure.exists(), "{}", figure.display());
        assert!(std::fs::read_to_string(figure).unwrap().contains("width=\"8.500cm\""));
    }
    for name in [
        "scene0-crops.svg",
        "scene0-strip.svg",
        "scene0-convergence-relmse-samples.svg",
        "scene0-convergence-relmse-time.svg",
        "scene0-techniques-bpt.svg",
        "scene1-pyramid-bpt.svg",
    ] {
        assert!(names.iter().any(|n| n == name), "{name} is not among {names:?}");
    }
}

#[test]
fn without_layers_there_are_no_strips() {
    let dir = tempfile::tempdir().unwrap();
    let r = results(dir.path(), &Options { layers: false, ..Options::default() });
    let (html, _) = page(dir.path(), &r);
    assert!(!html.contains("-techniques\"") && !html.contains("-pyramid\""));
    assert!(html.contains("-convergence\""));
}

/// The first figure of a scene is that of the contributions, with three images a technique; it is a PNG too.
#[test]
fn contributions_come_first() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = results(dir.path(), &Options { size: (300, 20), ..Options::default() });
    r.cells[2].paths = "media".into();
    let (html, summary) = page(dir.path(), &r);
    let start = html.find("id=\"scene-scene0-contributions\"").unwrap();
    let section = &html[start..start + html[start..].find("</section>").unwrap()];
    assert!(start < html.find("id=\"scene-scene0-images\"").unwrap());
    assert!(html[..start].find("<img").is_none(), "no image comes before");
    for layer in ["weighted", "unweighted", "weight"] {
        let of = |key: &&str| section.contains(&format!("data-layer=\"{layer}.{key}\""));
        assert!(["hit", "nee", "connect", "lens"].iter().all(of), "{layer}");
    }
    assert!(section.contains("paths media alone"));
    assert_eq!(section.matches("% of the energy").count(), 2 * 4, "weighted and unweighted");
    assert_eq!(section.matches("mean weight 0.25").count(), 4);
    let names: Vec<_> = summary.pictures.iter().map(|p| p.file_name().unwrap().to_owned()).collect();
    let figures: Vec<_> = summary.figures.iter().map(|p| p.file_stem().unwrap().to_owned()).collect();
    assert_eq!(figures[0], "scene0-contributions-bpt");
    let stems: Vec<_> = names.iter().map(|n| Path::new(n).file_stem().unwrap().to_owned()).collect();
    assert_eq!(stems, figures, "each figure is a PNG too");
    let svg = std::fs::read_to_string(&summary.figures[0]).unwrap();
    assert_eq!(svg.matches("<image").count(), 1 + 4, "the image, and a tile a technique");
    assert_eq!(svg.matches(" %\"").count(), 4, "with shares: {}", svg.matches("aria-label").count());
    // In the viewer the number keys lead to the reference and the estimators all the same.
    let list = html.split("id=\"viewer-data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let list: serde_json::Value = serde_json::from_str(list).unwrap();
    let images = list["scenes"][0]["images"].as_array().unwrap();
    let roles: Vec<&str> = images.iter().map(|i| i["role"].as_str().unwrap()).collect();
    assert_eq!(roles[..5], ["reference", "estimate", "estimate", "estimate", "layer"]);
    assert!(roles[4..].iter().all(|r| *r == "layer") && images[1]["label"] == "path tracing");
    // Without layers there is none, and nothing is said to be missing.
    let r = results(dir.path(), &Options { layers: false, ..Options::default() });
    let (html, summary) = page(dir.path(), &r);
    let named = |p: &std::path::PathBuf| p.to_string_lossy().contains("contributions");
    assert!(
        !html.contains("-contributions\"")
            && !summary.pictures.iter().any(named)
            && summary.problems.is_empty()
    );
}

/// Results from before there were mean weights and what came with them.
#[test]
fn layers_without_weights_are_shown_as_far_as_they_go() {
    let dir = tempfile::tempdir().unwrap();
    let r = results(dir.path(), &Options::default());
    let path = dir.path().join("scene0/bpt/mean.exr");
    let mut file = crate::film::exr::read_layers(&path).unwrap();
    file.layers.retain(|l| !l.name.starts_with("weight."));
    crate::film::exr::write(&path, &file).unwrap();
    let (html, _) = page(dir.path(), &r);
    let start = html.find("id=\"scene-scene0-contributions\"").unwrap();
    let section = &html[start..start + html[start..].find("</section>").unwrap()];
    assert!(section.contains("class=\"unweighted-row\"") && !section.contains("class=\"weight-row\""));
}

#[test]
fn figures_that_are_not_wanted_are_not_made() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = results(dir.path(), &Options::default());
    r.figures = Figures {
        contributions: None,
        strip: false,
        comparison: false,
        techniques: false,
        pyramid: None,
        convergence: false,
        costs: false,
        width_cm: None,
        font_pt: None,
    };
    let (html, summary) = page(dir.path(), &r);
    assert!(html.contains("-metrics\"") && summary.figures.is_empty());
    assert!(summary.pictures.is_empty());
    for part in ["contributions", "images", "strip", "convergence", "techniques", "pyramid"] {
        assert!(!html.contains(&format!("id=\"scene-scene0-{part}\"")), "{part}");
    }
}

/// Bug that this keeps out: figures of a metric that was taken out of the experiment, beside those of now.
#[test]
fn figures_of_before_are_taken_away() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = results(dir.path(), &Options { layers: false, ..Options::default() });
    let all = || -> Vec<String> {
        let entries = std::fs::read_dir(dir.path().join("figures")).unwrap();
        entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect()
    };
    page(dir.path(), &r);
    std::fs::write(dir.path().join("figures/scene0-convergence-mae-mine.svg"), "mine").unwrap();
    let before = all();
    let of_smape = |names: &[String]| names.iter().filter(|n| n.contains("-smape-")).count();
    assert_eq!(of_smape(&before), 6, "against samples and time as SVG, PDF and PNG");
    r.metrics.retain(|m| m.key != "smape");
    page(dir.path(), &r);
    let after = all();
    assert_eq!((of_smape(&after), after.len()), (0, before.len() - 6));
    assert!(after.contains(&"scene0-convergence-mae-mine.svg".to_owned()));
}

/// Bug that this keeps out: an estimator that is not among the maps of variance, without a word.
#[test]
fn one_sample_has_no_variance_and_the_page_says_it() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = results(dir.path(), &Options { layers: false, ..Options::default() });
    let text = "No map of light tracing: the variance of a pixel needs at least two samples in a run.";
    assert!(!page(dir.path(), &r).0.contains("No map of"));
    let path = dir.path().join("scene0/lt/statistics.exr");
    let mut file = crate::film::exr::read_layers(&path).unwrap();
    file.layers.retain(|l| l.name == "bias");
    crate::film::exr::write(&path, &file).unwrap();
    r.cells[1].runs.iter_mut().for_each(|run| run.spp = 1);
    let (html, summary) = page(dir.path(), &r);
    assert!(html.contains(text));
    let spread = summary.figures.iter().find(|f| f.ends_with("scene0-spread.svg")).unwrap();
    let svg = std::fs::read_to_string(spread).unwrap();
    assert!(svg.contains("no map"), "{svg:.2000}");
    // Where none has any, that is said all the same.
    for (cell, key) in r.cells.iter_mut().zip(["pt", "lt", "bpt"]) {
        cell.runs.iter_mut().for_each(|run| run.spp = 1);
        crate::film::exr::write(dir.path().join(format!("scene0/{key}/statistics.exr")), &file).unwrap();
    }
    let (html, _) = page(dir.path(), &r);
    assert!(html.contains("No map of path tracing, light tracing, bidirectional path tracing:"));
}

/// What the numbers stand on is said beside them: which error efficiencies go by, when runs were rendered, what has no curve.
#[test]
fn what_is_shown_is_said_to_be() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = results(dir.path(), &Options { layers: false, ..Options::default() });
    let (html, _) = page(dir.path(), &r);
    assert!(html.contains(">efficiency (relMSE)</th>") && html.contains("1/(relMSE · seconds)"));
    assert!(
        html.contains("2026-01-01T00:03:00Z") && html.contains(">started</dt>"),
        "as it is not known better"
    );
    assert!(!html.contains("None of FLIP") && !html.contains("an interval from 3 runs on"));
    for (i, run) in r.cells.iter_mut().flat_map(|c| &mut c.runs).enumerate() {
        run.rendered = Some(format!("2025-06-01T00:{:02}:00Z", 30 - i));
    }
    for cell in &mut r.cells {
        cell.convergence.retain(|c| c.metric != "flip");
        cell.runs.truncate(2);
    }
    r.metrics.retain(|m| m.key != "relmse");
    let (html, _) = page(dir.path(), &r);
    assert!(
        html.contains("the first run was done 2025-06-01T00:21:00Z, the last 2025-06-01T00:30:00Z"),
        "{html:.100}"
    );
    assert!(html.contains("<span>2025-06-01T00:30:00Z</span>") && !html.contains(">started</dt>"));
    assert!(html.contains(">efficiency (MSE)</th>") && html.contains("an interval from 3 runs on"));
    assert!(html.contains("None of FLIP: on the way only sums over pixels are measured"));
}

#[test]
fn one_estimator_with_one_run_claims_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let options = Options { estimators: vec![("bpt", "all")], runs: 1, ..Options::default() };
    let r = results(dir.path(), &options);
    let (html, _) = page(dir.path(), &r);
    assert!(html.contains("One run: there are no intervals"));
    assert!(html.contains("chosen automatically, where the error is largest"));
    assert!(!html.contains("number best") && !html.contains("ratio to"));
    assert!(!html.contains("\u{a0}±\u{a0}"), "no interval comes from one run");
}

#[test]
fn the_best_is_marked_only_where_it_can_be_told() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = results(dir.path(), &Options::default());
    let (html, _) = page(dir.path(), &r);
    assert!(html.contains("number best"), "pt is much better than the others");
    // The same errors in each estimator: nothing can be told apart.
    for cell in &mut r.cells {
        for (i, run) in cell.runs.iter_mut().enumerate() {
            run.seconds = 1.0;
            run.metrics.values_mut().for_each(|v| *v = 0.1 + 0.01 * i as f64);
        }
    }
    let (html, _) = page(dir.path(), &r);
    assert!(!html.contains("number best") && html.contains("not distinguishable"));
}

/// Five samples an estimator, the largest first, each with the command that explains it.
#[test]
fn the_largest_samples_are_listed_with_commands() {
    let dir = tempfile::tempdir().unwrap();
    let (html, _) = page(dir.path(), &results(dir.path(), &Options::default()));
    let part = html.split("class=\"fireflies\"").nth(1).unwrap().split("</details>").next().unwrap();
    for key in ["pt", "lt", "bpt"] {
        let run = dir.path().join(format!("scene0/{key}/run-00.exr"));
        let command = format!("tyndall explain {} --pixel ", run.display());
        let pixels: Vec<&str> =
            part.split(&command).skip(1).map(|rest| rest.split('<').next().unwrap()).collect();
        assert_eq!(pixels.len(), 5, "{part}");
        let file = crate::film::exr::read_layers(&run).unwrap();
        let of = |pixel: &str| {
            let (x, y) = pixel.split_once(',').unwrap();
            let [luminance, _, share] =
                file.layer("outliers").unwrap().get(x.parse().unwrap(), y.parse().unwrap());
            luminance * share
        };
        let values: Vec<f32> = pixels.iter().map(|p| of(p)).collect();
        let most = file.layer("outliers").unwrap().pixels.iter().map(|p| p[0] * p[2]).fold(0.0, f32::max);
        assert!(values[0] == most && values.is_sorted_by(|a, b| a >= b), "{values:?}");
    }
}

#[test]
fn numbers_out_of_order_leave_a_page() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = results(dir.path(), &Options::default());
    let not = Estimate { mean: f64::NAN, interval: Some(Interval { low: f64::NAN, high: f64::NAN }) };
    r.cells[0].summary[0].value = not;
    r.cells[0].runs[0].metrics.insert("relmse".into(), f64::NAN);
    r.cells[0].convergence[0].points[1].value = not;
    // No error at all.
    let zero = Estimate { mean: 0.0, interval: Some(Interval { low: 0.0, high: 0.0 }) };
    r.cells[1].summary.iter_mut().for_each(|s| s.value = zero);
    r.cells[1].convergence.iter_mut().flat_map(|c| &mut c.points).for_each(|p| p.value = zero);
    for run in &mut r.cells[1].runs {
        run.metrics.values_mut().for_each(|v| *v = 0.0);
        run.checkpoints.iter_mut().for_each(|c| c.metrics.values_mut().for_each(|v| *v = 0.0));
    }
    r.cells[1].efficiency = Some(Estimate { mean: f64::INFINITY, interval: None });
    // Magnitudes far apart.
    for point in r.cells[2].convergence.iter_mut().flat_map(|c| &mut c.points) {
        point.value =
            Estimate { mean: 1e12 / point.spp as f64, interval: Some(Interval { low: -1e13, high: 1e14 }) };
    }
    let (html, _) = page(dir.path(), &r);
    assert!(html.contains("not a number") && html.contains("a logarithmic axis cannot show"));
}

#[test]
fn long_and_hostile_names_are_only_text() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = results(dir.path(), &Options { layers: false, ..Options::default() });
    let hostile = "<script>alert(\"1 & 2\")</script> 'quoted' & a name that goes on and on, far beyond any column's width";
    r.title = hostile.into();
    r.description = hostile.into();
    r.scenes[0].label = hostile.into();
    r.scenes[0].caption = hostile.into();
    r.scenes[0].crops = vec![Crop { name: hostile.into(), x: 0, y: 0, width: 8, height: 8 }];
    r.warnings.push(hostile.into());
    for e in &mut r.estimators {
        e.label = hostile.into();
        e.caption = hostile.into();
        e.color = "red;}</style><script>".into();
    }
    r.metrics[0].label = hostile.into();
    r.metrics[0].description = hostile.into();
    let (html, _) = page(dir.path(), &r);
    assert!(html.contains("&lt;script&gt;alert(&quot;1 &amp; 2&quot;)&lt;/script&gt;"));
    assert_eq!(html.matches("</style>").count(), 1);
}

#[test]
fn missing_images_and_cells_are_said() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = results(dir.path(), &Options::default());
    r.partial = true;
    r.cells.remove(1);
    r.cells[0].runs[0].partial = true;
    std::fs::remove_file(dir.path().join("scene0/reference.exr")).unwrap();
    std::fs::write(dir.path().join("scene0/pt/run-00.exr"), b"not an image").unwrap();
    let other_size = crate::film::exr::LayeredImage::new(crate::film::Image::new(3, 3));
    crate::film::exr::write(dir.path().join("scene0/bpt/error.exr"), &other_size).unwrap();
    let (html, summary) = page(dir.path(), &r);
    assert_eq!(summary.problems.len(), 3, "{:?}", summary.problems);
    for text in [
        "Partial results",
        "No results yet of light tracing",
        "1 run stopped before the budget",
        "Could not be shown",
        "image missing",
        "has 3×3 pixels",
    ] {
        assert!(html.contains(text), "'{text}'");
    }
}

#[test]
fn without_a_reference_there_is_still_a_page() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = results(dir.path(), &Options::default());
    r.scenes[0].reference = None;
    for cell in &mut r.cells {
        cell.summary.clear();
        cell.convergence.clear();
        cell.efficiency = None;
        cell.files.error_exr = None;
        cell.runs.iter_mut().for_each(|run| run.metrics.clear());
    }
    let (html, _) = page(dir.path(), &r);
    assert!(html.contains("-metrics\"") && !html.contains("-convergence\"") && !html.contains("error maps"));
    r.cells.clear();
    let (html, _) = page(dir.path(), &r);
    assert!(html.contains("No results yet of"));
}

#[test]
fn a_noisy_reference_is_warned_about() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = results(dir.path(), &Options { layers: false, ..Options::default() });
    assert!(!page(dir.path(), &r).0.contains("of its MSE is the reference&#39;s own noise"));
    r.scenes[0].reference.as_mut().unwrap().variance = Some(0.002);
    assert!(page(dir.path(), &r).0.contains("of its MSE is the reference&#39;s own noise"));
}

#[test]
fn the_same_results_make_the_same_page() {
    let dir = tempfile::tempdir().unwrap();
    let r = results(dir.path(), &Options::default());
    assert_eq!(page(dir.path(), &r).0, page(dir.path(), &r).0);
}

#[test]
fn no_results_are_an_error() {
    let dir = tempfile::tempdir().unwrap();
    assert!(report(dir.path()).is_err());
    assert!(!dir.path().join("index.html").exists() && !dir.path().join("figures").exists());
}
