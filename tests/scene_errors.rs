//! Every slip in a scene file ends in one message that says where it is and what would be right.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::fs;
use std::path::{Path, PathBuf};
use tyndall::scene::Scene;
use tyndall::scene::file::source::Source;
use tyndall::scene::file::{Overrides, from_source, load};

/// A good scene, which each case breaks in one place.
const GOOD: &str = r#"[film]
width = 64
height = 48

[camera]
origin = [0, 0, 5]
target = [0, 0, 0]

[texture.floor]
checker = { even = 0.8, odd = 0.2 }

[material.white]
diffuse = { reflectance = "floor" }
[material.gold]
conductor = { metal = "Au", roughness = 0.1 }

[[shape]]
name = "ball"
sphere = { radius = 1 }
material = "white"
transform = [{ scale = 0.5 }]

[[shape]]
name = "block"
box = { min = [-1, -1, -1], max = [1, 1, 1] }
material = "gold"

[[light]]
point = { position = [0, 3, 0], intensity = 10 }
"#;

/// Files beside the scene file that cases refer to.
fn make_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let files: [(&str, &[u8]); 8] = [
        ("good.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("range.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
        ("flat.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
        ("empty.obj", b"# nothing\n"),
        ("text.ply", b"this is no mesh\n"),
        ("broken.png", b"\x89PNG\r\n\x1a\nbut no more"),
        ("broken.exr", b"v/1\x01 cut short"),
        ("broken.hdr", b"#?RADIANCE\nnothing"),
    ];
    for (name, content) in files {
        fs::write(folder.path().join(name), content).expect("it can be written");
    }
    folder
}

fn read(folder: &Path, text: &str) -> Result<Scene, String> {
    let path = folder.join("scene.toml");
    from_source(&Source::from_text(path, text), &Overrides::default()).map_err(|e| e.to_string())
}

struct Case {
    /// What is replaced in [`GOOD`]; empty: the text is put at the end.
    old: &'static str,
    new: &'static str,
    /// Line of the error in the scene file; 0 where the whole file is meant.
    line: usize,
    /// Words that have to be in the message.
    words: &'static [&'static str],
}

const fn case(old: &'static str, new: &'static str, line: usize, words: &'static [&'static str]) -> Case {
    Case { old, new, line, words }
}

const SPHERE: &str = "sphere = { radius = 1 }";
const LIGHT: &str = "point = { position = [0, 3, 0], intensity = 10 }";
const SCALE: &str = "{ scale = 0.5 }";
const GOLD: &str = r#"conductor = { metal = "Au", roughness = 0.1 }"#;
const BOX: &str = "box = { min = [-1, -1, -1], max = [1, 1, 1] }";
const WHITE: &str = r#"diffuse = { reflectance = "floor" }"#;
const FILM: &str = "height = 48";

/// All that can be wrong with the scene file itself.
const CASES: &[Case] = &[
    // TOML and its keys
    case("width = 64", "width = ", 2, &["scene.toml:2:"]),
    case("[camera]", "[camera", 5, &["scene.toml:5:"]),
    case(FILM, "height = 48\nheight = 48", 4, &["duplicate key"]),
    case("width = 64", "widht = 64", 2, &["unknown key `widht`", "`crop`", "did you mean `width`?"]),
    case(SPHERE, "sphere = { radius = 1, centre = [0, 0, 0] }", 19, &["`centre`", "did you mean `center`?"]),
    case(
        "material = \"gold\"",
        "medium = \"gold\"",
        26,
        &["unknown key `medium`", "did you mean `interior`?"],
    ),
    case(SPHERE, "spere = { radius = 1 }", 19, &["unknown key `spere`", "did you mean `sphere`?"]),
    case(WHITE, "difuse = {}", 13, &["unknown key `difuse`", "`dielectric`", "did you mean `diffuse`?"]),
    case(SCALE, "{ scael = 2 }", 21, &["unknown key `scael`", "`look_at`", "did you mean `scale`?"]),
    case(LIGHT, "spto = {}", 29, &["unknown key `spto`", "did you mean `spot`?"]),
    case("", "[lihgt]\n", 30, &["unknown key `lihgt`", "did you mean `light`?"]),
    // What others call it
    case(BOX, "cube = {}", 25, &["unknown key `cube`", "did you mean `box`?"]),
    case(SPHERE, "quad = {}", 19, &["unknown key `quad`", "did you mean `rectangle`?"]),
    case(SPHERE, "plane = {}", 19, &["unknown key `plane`", "did you mean `rectangle`?"]),
    case(SPHERE, "obj = \"a.obj\"", 19, &["unknown key `obj`", "did you mean `mesh`?"]),
    case(SPHERE, "ply = \"a.ply\"", 19, &["unknown key `ply`", "did you mean `mesh`?"]),
    case(WHITE, "lambert = {}", 13, &["unknown key `lambert`", "did you mean `diffuse`?"]),
    case(WHITE, "glass = {}", 13, &["unknown key `glass`", "did you mean `dielectric`?"]),
    case(GOLD, "metal = {}", 15, &["unknown key `metal`", "did you mean `conductor`?"]),
    case(LIGHT, "envmap = {}", 29, &["unknown key `envmap`", "did you mean `environment`?"]),
    case(LIGHT, "hdri = {}", 29, &["unknown key `hdri`", "did you mean `environment`?"]),
    case("[[light]]", "[light]", 28, &["expected an array", "there may be several: write `[[light]]`"]),
    case("target = [0, 0, 0]", "", 5, &["missing key `target`"]),
    case(SPHERE, "sphere = {}", 19, &["missing key `radius`"]),
    // Wrong types
    case("width = 64", "width = \"64\"", 2, &["string \"64\"", "a whole number from 1 up"]),
    case("width = 64", "width = 64.5", 2, &["64.5", "a whole number from 1 up"]),
    case(SPHERE, "sphere = { radius = [1] }", 19, &["a finite number above 0"]),
    case("origin = [0, 0, 5]", "origin = 5", 6, &["three numbers [x, y, z]"]),
    case("origin = [0, 0, 5]", "origin = [0, 5]", 6, &["three numbers [x, y, z]", "found 2"]),
    case(SPHERE, "sphere = 1", 19, &["a table"]),
    case(WHITE, "diffuse = { reflectance = true }", 13, &["a colour, the name of a texture"]),
    case("[[light]]", "[light]", 28, &["expected an array"]),
    case("material = \"white\"", "material = 1", 20, &["expected a string"]),
    // Numbers out of range
    case("width = 64", "width = 0", 2, &["a whole number from 1 up", "found 0"]),
    case("width = 64", "width = 4000000000", 5, &["65536"]),
    case(SPHERE, "sphere = { radius = -1 }", 19, &["a finite number above 0", "found -1"]),
    case(SPHERE, "sphere = { radius = nan }", 19, &["a finite number above 0", "found NaN"]),
    case("origin = [0, 0, 5]", "origin = [0, inf, 5]", 6, &["a finite number", "found inf"]),
    case("intensity = 10", "intensity = [1, -2, 1]", 29, &["not negative", "found -2"]),
    case(WHITE, "diffuse = { reflectance = 1.5 }", 13, &["from 0 to 1", "found 1.5"]),
    case("roughness = 0.1", "roughness = 2", 15, &["from 0 to 1", "found 2"]),
    case("[0, 0, 0]\n", "[0, 0, 0]\nfov = 180\n", 8, &["(0, 180)"]),
    case(GOLD, "dielectric = { ior = -1.5 }", 15, &["above 0", "found -1.5"]),
    case(
        LIGHT,
        "spot = { position = [0, 1, 0], target = [0, 0, 0], intensity = 1, cutoff = 95 }",
        29,
        &["90", "95"],
    ),
    case(LIGHT, "spot = { position = [0, 1, 0], target = [0, 1, 0], intensity = 1 }", 29, &["no direction"]),
    case(FILM, "height = 48\ncrop = [0, 0, 65, 48]", 4, &["crop", "64x48", "x1 <= 64"]),
    case(FILM, "height = 48\ncrop = [8, 8, 8, 9]", 4, &["crop", "empty"]),
    case("", "[render]\nmin_length = 5\nmax_length = 2\n", 31, &["min_length is 5"]),
    // Names that stand for nothing
    case(
        "material = \"white\"",
        "material = \"wite\"",
        20,
        &["no material `wite`", "`gold`", "did you mean `white`?"],
    ),
    case(WHITE, "diffuse = { reflectance = \"flor\" }", 13, &["no texture `flor`", "did you mean `floor`?"]),
    case("\"Au\"", "\"godl\"", 15, &["no metal `godl`", "`Ag`", "did you mean `gold`?"]),
    case(
        GOLD,
        "layered = { layers = [{ material = \"whtie\", weight = 1 }] }",
        15,
        &["no material `whtie`", "did you mean `white`?"],
    ),
    case(BOX, "mesh = { file = \"god.obj\" }", 25, &["no mesh `god.obj`", "did you mean `good.obj`?"]),
    case(
        WHITE,
        "diffuse = { reflectance = { image = { file = \"brokn.png\" } } }",
        13,
        &["did you mean `broken.png`?"],
    ),
    case(LIGHT, "environment = { image = \"sky.exr\" }", 29, &["no image `sky.exr`", "`broken.exr`"]),
    // One of several
    case(SPHERE, "", 17, &["`sphere`, `rectangle`", "`lathe`"]),
    case(SPHERE, "sphere = { radius = 1 }\ndisc = { radius = 1 }", 17, &["`sphere` and `disc`"]),
    case(WHITE, "", 12, &["nothing here", "`diffuse`, `mirror`"]),
    case(WHITE, "diffuse = {}\nmirror = {}", 14, &["`mirror` beside `diffuse`"]),
    case(LIGHT, "name = \"sun\"", 28, &["`point`, `spot`, `directional` or `environment`"]),
    case(GOLD, "conductor = { eta = 1 }", 14, &["both `eta` and `k`"]),
    case(LIGHT, "environment = { radiance = 1, image = \"x.exr\" }", 29, &["either `radiance`, or `image`"]),
    // Geometry
    case(SCALE, "{ scale = [1, 0, 1] }", 21, &["singular"]),
    case(SCALE, "{ matrix = [[1, 2, 0, 0], [2, 4, 0, 0], [0, 0, 1, 0]] }", 21, &["singular"]),
    case(SCALE, "{ rotate = { axis = [0, 0, 0], angle = 1 } }", 21, &["axis"]),
    case(SCALE, "{ scale = [1, 2, 1] }", 21, &["`ball`", "same factor in all directions"]),
    case(BOX, "disc = { radius = 1, normal = [0, 0, 0] }", 25, &["normal has no length"]),
    case(BOX, "rectangle = { corner = [0, 0, 0], u = [1, 1, 0], v = [2, 2, 0] }", 25, &["no area"]),
    case(BOX, "box = { min = [0, 0, 0], max = [1, 0, 1] }", 25, &["flat or inside out"]),
    case(BOX, "lathe = { profile = [[0, 0], [-1, 1]] }", 25, &["radius is negative"]),
    case(BOX, "lathe = { profile = [[1, 1]] }", 25, &["two different points"]),
    case("target = [0, 0, 0]", "target = [0, 0, 5]", 5, &["camera"]),
    case("target = [0, 0, 0]", "target = [0, 0, 0]\nup = [0, 0, 1]", 5, &["up"]),
    // The whole
    case("material = \"gold\"\n", "", 23, &["`block` has no material"]),
    case(
        "[[light]]\npoint = { position = [0, 3, 0], intensity = 10 }\n",
        "",
        0,
        &["no light", "[[light]]", "`emission`"],
    ),
    case("intensity = 10", "intensity = 0", 0, &["no light", "power"]),
    case("[camera]\norigin = [0, 0, 5]\ntarget = [0, 0, 0]\n", "", 0, &["no camera", "[camera]"]),
    case(
        "",
        "[[light]]\nenvironment = { radiance = 1 }\n[[light]]\nenvironment = { radiance = 1 }\n",
        33,
        &["second environment", "line 31"],
    ),
    case(
        "material = \"gold\"",
        "material = \"air\"\nemission = 1\n[material.air]\nnull = {}",
        23,
        &["null material"],
    ),
    case(
        GOLD,
        "layered = { layers = [{ material = \"gold\", weight = 1 }] }",
        15,
        &["`gold` is a layered or a null material"],
    ),
    case(BOX, "lathe = { profile = [[1, 0], [1, 1]], segments = 1000000000 }", 25, &["segments"]),
    // Media: the text is put at the end, after line 29
    case("", "[medium.fog]\nsigma_a = -1\nsigma_s = 1", 31, &["not negative", "found -1"]),
    case("", "[medium.fog]\nsigma_a = 1\nsigma_s = [1, nan, 1]", 32, &["not negative", "found NaN"]),
    case("", "[medium.fog]\nsigma_t = 1\nalbedo = [0.5, 1.01, 0.5]", 32, &["from 0 to 1", "found 1.01"]),
    case("", "[medium.fog]\nsigma_t = 3e38\nalbedo = 1\nscale = 9", 30, &["sigma_t", "finite"]),
    case("", "[medium.fog]\nsigma_t = 1\nalbedo = 1\nscale = -1", 33, &["not negative", "found -1"]),
    case(
        "",
        "[medium.fog]\nsigma_t = 1\nalbedo = 1\nphase = { hg = 1 }",
        33,
        &["between -1 and 1", "found 1"],
    ),
    case("", "[medium.fog]\nsigma_t = 1\nalbedo = 1\nphase = { hg = -1.5 }", 33, &["-1 and 1", "found -1.5"]),
    case("", "[medium.fog]\nsigma_t = 1\nalbedo = 1\nphase = { hg = inf }", 33, &["a finite number"]),
    case(
        "",
        "[medium.fog]\nsigma_t = 1\nalbedo = 1\nphase = \"raleigh\"",
        33,
        &["{ hg = g }", "mean `rayleigh`?"],
    ),
    case("", "[medium.fog]\nsigma_t = 1\nalbedo = 1\nphase = 0.5", 33, &["\"isotropic\"", "{ hg = g }"]),
    case(
        "",
        "[medium.fog]\nsigma_t = 1\nalbedo = 1\nphase = { gh = 1 }",
        33,
        &["unknown key `gh`", "mean `hg`?"],
    ),
    case("", "[medium.fog]\nsigma_t = 1\nalbedo = 1\nphase = { mixture = [] }", 33, &["at least one"]),
    case(
        "",
        "[medium.fog]\nsigma_t = 1\nalbedo = 1\nphase = { mixture = [{ weight = 0, phase = \"rayleigh\" }] }",
        33,
        &["above 0", "found 0"],
    ),
    case(
        "",
        "[medium.fog]\nsigma_t = 1\nalbedo = 1\nphase = { mixture = [{ weight = 1, phase = { hg = 2 } }] }",
        33,
        &["between -1 and 1", "found 2"],
    ),
    case("", "[medium.fog]\nsigma_a = 1\nsigma_s = 1\nalbedo = 1", 33, &["either `sigma_a` and", "found"]),
    case("", "[medium.fog]\nsigma_a = 1\nalbedo = 1", 32, &["either `sigma_a` and", "`sigma_a`, `albedo`"]),
    case("", "[medium.fog]\nsigma_s = 1", 31, &["`sigma_s` alone", "`sigma_t` and `albedo`"]),
    case("", "[medium.fog]\nscale = 1", 30, &["does not say what it is", "`sigma_a` and `sigma_s`"]),
    case("", "[medium.fog]\nsigma_t = \"1\"\nalbedo = 1", 31, &["a colour"]),
    case("", "[medium.fog]\nsigma_x = 1", 31, &["unknown key `sigma_x`", "`sigma_a`"]),
    case(
        GOLD,
        "dielectric = { ior = 1.2, exterior_ior = 1.2, roughness = 0.5 }",
        14,
        &["exterior_ior", "1.2"],
    ),
];

#[test]
fn the_good_scene_is_good() {
    let folder = make_folder();
    let scene = read(folder.path(), GOOD).expect("nothing is wrong with it");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert_eq!(scene.shape_names, ["ball", "block"]);
    assert_eq!(scene.notes.material_names, ["white", "gold"]);
    assert_eq!(scene.shape_materials, [0, 1]);
}

#[test]
fn every_slip_is_named_with_its_place() {
    let folder = make_folder();
    let file = folder.path().join("scene.toml");
    for Case { old, new, line, words } in CASES {
        let text = if old.is_empty() { format!("{GOOD}{new}") } else { GOOD.replacen(old, new, 1) };
        assert_ne!(text, GOOD, "{old:?} is not in the good scene");
        let Err(message) = read(folder.path(), &text) else {
            panic!("{new:?} instead of {old:?} was accepted");
        };
        let place = match line {
            0 => format!("{}: ", file.display()),
            line => format!("{}:{line}:", file.display()),
        };
        assert!(message.starts_with(&place), "expected the place {place} in: {message}");
        assert!(!message.contains('\n'), "one line: {message}");
        for word in *words {
            assert!(message.contains(word), "expected {word:?} in: {message}");
        }
    }
}

#[test]
fn broken_files_are_named_with_the_place_that_refers_to_them() {
    let folder = make_folder();
    for (line, old, new, file, words) in [
        (25, BOX, "mesh = { file = \"range.obj\" }", "range.obj", &["9"][..]),
        (25, BOX, "mesh = { file = \"flat.obj\" }", "flat.obj", &["area"]),
        (25, BOX, "mesh = { file = \"empty.obj\" }", "empty.obj", &["triangle"]),
        (25, BOX, "mesh = { file = \"text.ply\" }", "text.ply", &[]),
        (
            13,
            WHITE,
            "diffuse = { reflectance = { image = { file = \"broken.png\" } } }",
            "broken.png",
            &["PNG"],
        ),
        (
            13,
            WHITE,
            "diffuse = { reflectance = { image = { file = \"broken.exr\" } } }",
            "broken.exr",
            &["EXR"],
        ),
        (29, LIGHT, "environment = { image = \"broken.hdr\" }", "broken.hdr", &["HDR"]),
    ] {
        let message = read(folder.path(), &GOOD.replacen(old, new, 1)).expect_err(new);
        assert!(message.starts_with(&folder.path().join(file).display().to_string()), "{message}");
        assert!(
            message.contains(&format!("(used at {}:{line}:", folder.path().join("scene.toml").display())),
            "{message}"
        );
        assert!(words.iter().all(|w| message.contains(w)), "{message}");
    }
}

#[test]
fn a_scene_that_is_not_there_is_named_with_those_that_are() {
    let message = |path: &str| load(Path::new(path), &Overrides::default()).expect_err(path).to_string();
    assert!(
        message("scenes/nowhere/scene.toml")
            .starts_with("scenes/nowhere/scene.toml: there is no such scene file")
    );
    let near = message("cornel");
    assert!(near.contains("furnace") && near.ends_with("did you mean `cornell`?"), "{near}");
    assert!(message("src").contains("folder without a scene.toml"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("binary.toml");
    fs::write(&file, b"name = \"x\"\n\xff\xfe").expect("it can be written");
    assert!(
        load(&file, &Overrides::default())
            .expect_err("no text")
            .to_string()
            .contains("binary.toml:2: is not a text file")
    );
}

#[test]
fn odd_scenes_are_warned_about() {
    let folder = make_folder();
    for (old, new, words) in [
        ("material = \"gold\"", "material = \"white\"", &["line 14", "material `gold` is not used"][..]),
        (WHITE, "diffuse = {}", &["line 9", "texture `floor` is not used"]),
        (
            "[[light]]",
            "[medium.fog]\nsigma_t = 1\nalbedo = 0.5\n[[light]]",
            &["line 28", "medium `fog` is not used"],
        ),
        (
            GOLD,
            "layered = { layers = [{ material = \"white\", weight = 0.9 }, { material = \"white\", weight = 0.8 }] }",
            &["line 14", "`gold`", "1.36"],
        ),
        (GOLD, "phong = { diffuse = 0.8, specular = 0.5, exponent = 10 }", &["line 14", "`gold`", "1.3"]),
        (
            "box = { min = [-1, -1, -1], max = [1, 1, 1] }\nmaterial = \"gold\"",
            "lathe = { profile = [[1, 0], [1, 1]] }\nmaterial = \"gold\"\n[material.glass]\ndielectric = {}\n\
             [[shape]]\nlathe = { profile = [[1, 0], [1, 1]] }\nmaterial = \"glass\"",
            &["line 29", "`lathe 3`", "not closed"],
        ),
        (
            "box = { min = [-1, -1, -1], max = [1, 1, 1] }\nmaterial = \"gold\"",
            "lathe = { profile = [[0, 1], [1, 1], [1, 0], [0, 0]] }\nmaterial = \"glass\"\n[material.glass]\ndielectric = {}\n\
             [[shape]]\nsphere = { radius = 1 }\nmaterial = \"gold\"",
            &["line 23", "`block`", "inside out"],
        ),
    ] {
        let text = GOOD.replacen(old, new, 1);
        assert_ne!(text, GOOD);
        let scene = read(folder.path(), &text).unwrap_or_else(|e| panic!("{e}"));
        let found = scene.warnings.iter().any(|warning| words.iter().all(|w| warning.contains(w)));
        assert!(found && scene.warnings.len() == 1, "expected {words:?} in {:?}", scene.warnings);
    }
}

#[test]
fn a_size_from_outside_scales_the_crop_window() {
    let text = GOOD.replace(FILM, "height = 48\ncrop = [16, 12, 33, 25]");
    let source = Source::from_text("scene.toml", text);
    let size = glam::UVec2::new(32, 24);
    let scene = from_source(&source, &Overrides { size: Some(size) }).expect("a good scene");
    let crop = scene.camera.crop();
    assert_eq!(scene.camera.size(), size);
    assert_eq!([crop.x0, crop.y0, crop.x1, crop.y1], [8, 6, 17, 13], "the least window over the same part");
}

#[test]
fn the_scenes_of_this_repository_load_without_a_warning() {
    let mut count = 0;
    for entry in fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes")).expect("there are scenes") {
        let path = entry.expect("a folder").path();
        if !path.is_dir() {
            continue;
        }
        let scene = load(&path, &Overrides::default()).unwrap_or_else(|e| panic!("{e}"));
        assert!(scene.warnings.is_empty(), "{}: {:?}", scene.name, scene.warnings);
        assert!(scene.dependencies.iter().all(|file| file.is_file()));
        count += 1;
    }
    assert!(count >= 6, "{count} scenes");
}

/// A piece of text that may stand in a scene file.
fn piece() -> impl Strategy<Value = String> {
    prop_oneof![
        "[\\PC\n]{0,6}",
        Just("nan".to_owned()),
        Just("-inf".to_owned()),
        Just("1e40".to_owned()),
        Just("-0.0".to_owned()),
        Just("9223372036854775807".to_owned()),
        Just("[[[[".to_owned()),
        Just("{ }".to_owned()),
        Just("\"white\"".to_owned()),
        Just("transform = [{ scale = 1e-30 }]\n".to_owned()),
        Just("emission = 1e38\n".to_owned()),
        Just("[medium.fog]\nsigma_t = 1\nalbedo = 1\nphase = { hg = 0.5 }\n".to_owned()),
        Just("lathe = { profile = [[0, 0], [1, 0], { through = [[1, 2]] }] }\n".to_owned()),
        any::<f32>().prop_map(|x| x.to_string()),
    ]
}

/// Scene files to start from: one that has a little of much, and those of this repository.
fn starts() -> Vec<(PathBuf, String)> {
    let scenes = ["cornell", "lights", "mirror-caustic", "veach-room", "vessels"];
    let files =
        scenes.map(|name| Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.toml"));
    let mut starts: Vec<_> =
        files.map(|f| (f.clone(), fs::read_to_string(&f).expect("a scene of ours"))).into();
    starts.push(("scene.toml".into(), GOOD.into()));
    starts
}

proptest! {
    #![proptest_config(ProptestConfig {
        // TYNDALL_STUDY=1 runs a hundred times as many.
        cases: if std::env::var_os("TYNDALL_STUDY").is_some() { 60_000 } else { 600 },
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(20),
        ..ProptestConfig::default()
    })]

    /// Any text in any place: a scene or an error, never a panic.
    #[test]
    fn a_mutated_scene_never_panics(
        start in prop::sample::select(starts()),
        edits in prop::collection::vec((any::<prop::sample::Index>(), 0usize..8, piece()), 1..4),
    ) {
        let (path, text) = start;
        let mut text: Vec<char> = text.chars().collect();
        for (at, removed, piece) in edits {
            let start = at.index(text.len() + 1);
            let end = (start + removed).min(text.len());
            text.splice(start..end, piece.chars());
        }
        let source = Source::from_text(path, text.into_iter().collect::<String>());
        if let Err(error) = from_source(&source, &Overrides::default()) {
            prop_assert!(!error.to_string().is_empty());
        }
    }
}
