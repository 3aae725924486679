//! The page's viewer, tried in a real Chromium without a window: scripts/install-chromium.sh installs one, and where there is
//! none the test says so and is skipped.

#![cfg(unix)]

#[allow(dead_code)]
mod common;

use common::{Bench, EXPERIMENT};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tyndall::film::Image;
use tyndall::film::exr::read_rgb;

/// Presses keys and looks at what is drawn. Its findings end up in the page, which Chromium prints.
const DRIVER: &str = r#"<script>
(async () => {
  const out = {};
  const tick = () => new Promise(done => setTimeout(done, 120));
  const viewer = document.getElementById('viewer'), canvas = viewer.querySelector('canvas');
  const press = async (key, shift = false) => {
    document.activeElement.dispatchEvent(new KeyboardEvent('keydown', {key, shiftKey: shift, bubbles: true, cancelable: true}));
    await tick();
  };
  const middle = () => {
    const gl = canvas.getContext('webgl2'), at = new Uint8Array(4);
    gl.readPixels(canvas.width >> 1, canvas.height >> 1, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, at);
    return [...at];
  };
  const sum = () => {
    const gl = canvas.getContext('webgl2'), all = new Uint8Array(4 * canvas.width * canvas.height);
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, all);
    return all.reduce((a, b) => a + b, 0);
  };
  const status = () => viewer.querySelector('[role=status]').textContent;
  const values = () => [...viewer.querySelectorAll('.viewer-side table tr')].map(r => [...r.children].map(c => c.textContent));
  try {
    out.opens = document.querySelectorAll('img.opens').length;
    const first = document.querySelector('.columns img.opens');
    first.focus();
    await press('Enter');
    await tick(); await tick();
    out.visible = !viewer.hidden;
    out.reference = status();
    out.referencePixel = middle();
    out.before = sum();
    await press('2');
    out.second = status();
    out.flipped = sum();
    await press('r');
    out.back = sum();
    await press('e'); await press('e');
    out.exposed = [status(), sum()];
    await press('E', true); await press('E', true);
    await press('t');
    out.filmic = [status(), sum()];
    await press('t');
    await press('+');
    out.zoomed = status();
    await press('ArrowRight', true);
    await press('f');
    out.fitted = [status(), sum()];
    await press('j'); await press('j'); await press('i');
    await new Promise(done => setTimeout(done, 500));
    out.values = values();
    await press('2'); await press('d');
    out.difference = [status(), sum()];
    await press('d');
    out.signed = status();
    await press('d');
    viewer.querySelectorAll('.viewer-side button')[2].dispatchEvent(new PointerEvent('pointerenter'));
    await tick();
    out.hovered = status();
    canvas.dispatchEvent(new WheelEvent('wheel', {deltaY: -240, bubbles: true, cancelable: true}));
    await tick();
    out.wheeled = status();
    await press('Escape');
    out.closed = viewer.hidden;
    out.focus = document.activeElement === first;
    const pyramid = document.querySelector('.pyramid img.opens');
    pyramid.click();
    await tick(); await tick();
    out.pyramid = [pyramid.dataset.layer, status(), sum()];
    await press('Escape');
    document.querySelector('.map img.opens').click();
    await tick();
    out.map = status();
    await press('Escape');
    out.loaded = performance.timing.loadEventStart - performance.timing.navigationStart;
  } catch (e) { out.error = String(e.stack || e); }
  const found = document.createElement('pre');
  found.id = 'found';
  found.textContent = JSON.stringify(out);
  document.body.append(found);
})();
</script></body>"#;

/// What Chromium makes of a page, or none where there is no Chromium.
fn chromium(page: &Path, window: [u32; 2], time: Duration) -> Option<String> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let on_path = |name: &&str| {
        let status = Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        status.is_ok_and(|s| s.success())
    };
    let Some(program) = names.iter().find(|name| on_path(name)) else {
        println!("skipped: there is no Chromium here; scripts/install-chromium.sh installs one");
        return None;
    };
    let profile = tempfile::tempdir().unwrap();
    let mut command = Command::new(program);
    command.args(["--headless=new", "--no-sandbox", "--disable-gpu-sandbox", "--use-angle=swiftshader"]);
    command.args(["--enable-unsafe-swiftshader", "--dump-dom", "--no-first-run"]);
    command.arg(format!("--window-size={},{}", window[0], window[1]));
    command.arg(format!("--virtual-time-budget={}", time.as_millis()));
    command.arg(format!("--user-data-dir={}", profile.path().display()));
    command.arg(format!("file://{}", page.display()));
    let output = command.stderr(Stdio::null()).output().unwrap();
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn found(dom: &str) -> serde_json::Value {
    let text = dom.split("<pre id=\"found\">").nth(1).and_then(|s| s.split("</pre>").next());
    let text =
        text.unwrap_or_else(|| panic!("the driver did not come to its end: {} bytes of page", dom.len()));
    let text = text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    serde_json::from_str(&text).unwrap()
}

#[test]
fn the_viewer_works_in_a_browser() {
    let bench = Bench::new();
    let text = EXPERIMENT.replace("layers = \"families\"\n", "").replace("runs = 3", "runs = 2");
    bench.write("experiment.toml", &format!("{text}\n[figures]\npyramid = [2, 4]\ntechniques = true\n"));
    bench.succeed("run experiment.toml");
    let root = bench.path("results/experiment");
    let html = std::fs::read_to_string(root.join("index.html")).unwrap();
    let page = root.join("driven.html");
    std::fs::write(&page, html.replace("</body>", DRIVER)).unwrap();
    let Some(dom) = chromium(&page, [1000, 700], Duration::from_secs(15)) else { return };
    let found = found(&dom);
    assert!(found.get("error").is_none(), "{found:#}");
    let text = |key: &str| found[key].as_str().unwrap_or_else(|| panic!("{key} of {found:#}")).to_owned();
    let number = |v: &serde_json::Value| v.as_f64().unwrap_or_else(|| panic!("{v} in {found:#}"));
    assert!(number(&found["opens"]) > 20.0, "{found:#}");
    assert_eq!(found["visible"], true);
    assert!(text("reference").contains("reference") && text("reference").contains("+0.5 stops"), "{found:#}");
    // What is drawn is the image through exposure and sRGB curve.
    let reference: Image = read_rgb(root.join("small/reference.exr")).unwrap();
    let shown = tyndall::film::png::display(&reference, 0.5, tyndall::film::png::ToneCurve::Srgb);
    let expected = shown.pixels[8 * 24 + 12];
    for c in 0..3 {
        let drawn = number(&found["referencePixel"][c]);
        let near = [7, 8].iter().flat_map(|y| [11, 12].map(|x| shown.pixels[y * 24 + x][c]));
        assert!(
            near.clone().any(|v| (f64::from(v) - drawn).abs() <= 1.0),
            "{drawn}, {expected:?}: {found:#}"
        );
    }
    assert!(text("second").contains("Path tracing") || text("second").contains("path tracing"), "{found:#}");
    assert_ne!(found["flipped"], found["before"]);
    assert_eq!(found["back"], found["before"], "flipping back shows the same to the bit");
    assert!(found["exposed"][0].as_str().unwrap().contains("+1.5 stops"));
    assert!(number(&found["exposed"][1]) > number(&found["before"]));
    assert!(found["filmic"][0].as_str().unwrap().contains("filmic") && found["filmic"][1] != found["before"]);
    let zoom = |key: &str| {
        let text = found[key].as_str().or(found[key][0].as_str()).unwrap().to_owned();
        text.split("zoom ").nth(1).unwrap().split(',').next().unwrap().parse::<f64>().unwrap()
    };
    assert!((zoom("zoomed") / zoom("reference") - 1.5).abs() < 0.01);
    assert_eq!(found["fitted"][1], found["before"], "fitted again it is as at first");
    // Values under the cursor, of all images, as floats.
    let (x, y) = (10, 7);
    assert_eq!(found["values"][0][0], format!("pixel {x}, {y}"));
    assert!(found["values"].as_array().unwrap().len() >= 4, "{found:#}");
    for (row, file) in [(1, "small/reference.exr"), (2, "small/pt/run-00.exr"), (3, "small/all/run-00.exr")] {
        let image = read_rgb(root.join(file)).unwrap();
        for c in 0..3 {
            let value: f32 = found["values"][row][c + 1].as_str().unwrap().parse().unwrap();
            let expected = image.get(x, y)[c];
            assert!((value - expected).abs() <= 1e-3 * expected.abs() + 1e-6, "{file}: {value} {expected}");
        }
    }
    assert!(found["difference"][0].as_str().unwrap().contains("relative squared difference"));
    assert!(text("signed").contains("signed difference"));
    assert!(text("hovered").contains("all"), "{found:#}");
    assert!((zoom("wheeled") / zoom("hovered") - 2.0).abs() < 0.01);
    assert_eq!((&found["closed"], &found["focus"]), (&true.into(), &true.into()));
    let layer = found["pyramid"][0].as_str().unwrap();
    assert!(
        layer.starts_with("weighted.s") && found["pyramid"][1].as_str().unwrap().contains(layer),
        "{found:#}"
    );
    assert!(text("map").contains("relative squared difference"), "{found:#}");
}

/// Bug that this keeps out: with six estimators the last image was cut off by a window of 1300 pixels. With more, the row scrolls, and
/// the page does not.
#[test]
fn six_estimators_are_seen_at_once() {
    let bench = Bench::new();
    let names = ["a", "b", "c", "d", "e", "f", "g", "h", "i"];
    let estimators: Vec<String> =
        names.iter().map(|n| format!("\n[[estimator]]\nname = \"{n}\"\npreset = \"pt\"\n")).collect();
    let driver = "<script>window.addEventListener('load', () => { const p = document.createElement('pre'); p.id = 'found'; \
                  const e = document.documentElement, s = document.querySelector('.columns').parentElement; \
                  p.textContent = JSON.stringify([e.scrollWidth - e.clientWidth, s.scrollWidth - s.clientWidth]); \
                  document.body.append(p); });</script></body>";
    for (count, scrolls) in [(6, false), (9, true)] {
        let text = format!(
            "budget = {{ spp = 1 }}\nmetrics = [\"relmse\"]\n[reference]\npreset = \"bpt\"\nspp = 4\n[[scene]]\nfile = \"small\"\n{}",
            estimators[..count].concat()
        );
        bench.write("experiment.toml", &text);
        bench.succeed("run experiment.toml");
        let root = bench.path("results/experiment");
        let html = std::fs::read_to_string(root.join("index.html")).unwrap();
        let driven = root.join("driven.html");
        std::fs::write(&driven, html.replace("</body>", driver)).unwrap();
        let Some(dom) = chromium(&driven, [1300, 900], Duration::from_secs(5)) else { return };
        let found = found(&dom);
        assert_eq!((found[0].as_i64(), found[1].as_i64() > Some(0)), (Some(0), scrolls), "{count}: {found}");
    }
}

/// Twelve images of a megapixel: under 60 MB, and open in under 3 s. With TYNDALL_STUDY=1.
#[test]
fn a_large_page_opens_soon() {
    if std::env::var_os("TYNDALL_STUDY").is_none() {
        println!("skipped: set TYNDALL_STUDY=1");
        return;
    }
    let bench = Bench::new();
    let estimators: String =
        (0..11).map(|i| format!("\n[[estimator]]\nname = \"e{i}\"\npreset = \"pt\"\n")).collect();
    let text = format!(
        "budget = {{ spp = 1 }}\nsize = [1024, 1024]\nmetrics = [\"relmse\"]\n[reference]\npreset = \"bpt\"\nspp = 4\n\
         [[scene]]\nfile = \"small\"\n{estimators}"
    );
    bench.write("experiment.toml", &text);
    bench.succeed("run experiment.toml");
    let page = bench.path("results/experiment/index.html");
    let size = page.metadata().unwrap().len();
    println!("{} MB", size / 1_000_000);
    assert!(size < 60_000_000, "{size}");
    let html = std::fs::read_to_string(&page).unwrap();
    let driver = "<script>window.addEventListener('load', () => setTimeout(() => { const p = document.createElement('pre'); \
                  p.id = 'found'; p.textContent = performance.timing.loadEventEnd - performance.timing.navigationStart; \
                  document.body.append(p); }, 50));</script></body>";
    let driven = bench.path("results/experiment/driven.html");
    std::fs::write(&driven, html.replace("</body>", driver)).unwrap();
    let start = Instant::now();
    let Some(dom) = chromium(&driven, [1000, 700], Duration::from_secs(30)) else { return };
    let milliseconds = found(&dom).as_f64().unwrap();
    println!("opened in {milliseconds} ms, with the browser's start {:?}", start.elapsed());
    assert!(milliseconds < 3000.0, "{milliseconds} ms");
}
