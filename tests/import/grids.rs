//! Mitsuba's heterogeneous media: what their volumes become, and which are refused, with their place.

use crate::refusals::{SENSOR, folder};
use glam::{UVec3, Vec3A};
use tyndall::medium::volume::{Volume, cube, vol};
use tyndall::scene::file::{Overrides, from_import};
use tyndall::scene::import::Format;

/// What the sixth line makes of a scene, and grids beside it: `full.vol` of ones between -1 and 1, `nowhere.vol` that does not
/// say where it is, `inner.vol` with nothing at its rim, `three.vol` of colours, `cut.vol` that is cut short.
fn translated(line: &str) -> Result<(String, Vec<String>), String> {
    let folder = folder(&[("a.xml", &format!("<scene version=\"3.0.0\">\n{SENSOR}{line}\n</scene>"))]);
    let numbers = |n: usize| vec![1.0; n];
    let place = Some(cube(Vec3A::NEG_ONE, Vec3A::ONE));
    let mut inner = vec![0.0; 27];
    inner[13] = 1.0;
    let volume = |n: u32, channels: usize, numbers, from_unit| {
        vol::encode(&Volume { size: UVec3::splat(n), channels, numbers, from_unit })
    };
    let full = volume(2, 1, numbers(8), place);
    // A box whose corners are one.
    let nowhere = [&full[..24], &[0; 24], &full[48..]].concat();
    for (name, bytes) in [
        ("cut.vol", full[..60].to_vec()),
        ("full.vol", full),
        ("nowhere.vol", nowhere),
        ("inner.vol", volume(3, 1, inner, place)),
        ("three.vol", volume(2, 3, numbers(24), place)),
    ] {
        std::fs::write(folder.path().join(name), bytes).expect("a file");
    }
    let path = folder.path().join("a.xml");
    let here = format!("{}/", folder.path().display());
    let imported = Format::Mitsuba.read(&path).map_err(|e| e.to_string().replace(&here, ""))?;
    from_import(&imported, &Overrides::default()).map_err(|e| e.to_string().replace(&here, ""))?;
    Ok((imported.source.text().to_owned(), imported.warnings))
}

/// A shape full of a medium of this extinction, and more properties of it.
fn filled(shape: &str, extinction: &str, more: &str) -> String {
    let medium = format!("<medium type=\"heterogeneous\" name=\"interior\">{extinction}{more}</medium>");
    format!("<shape type=\"{shape}\"><bsdf type=\"null\"/>{medium}</shape>")
}

/// A grid of `file` with more properties.
fn grid(name: &str, file: &str, more: &str) -> String {
    let file = format!("<string name=\"filename\" value=\"{file}\"/>");
    format!("<volume type=\"gridvolume\" name=\"{name}\">{file}{more}</volume>")
}

const OWN: &str = "<boolean name=\"use_grid_bbox\" value=\"true\"/>";
const TURN: &str = "<transform name=\"to_world\"><rotate z=\"1\" angle=\"30\"/></transform>";

#[test]
fn volumes_become_densities_and_grids_of_coefficients() {
    let filter =
        "<string name=\"filter_type\" value=\"nearest\"/><string name=\"wrap_mode\" value=\"repeat\"/>";
    for (extinction, more, expected) in [
        (
            grid("sigma_t", "full.vol", ""),
            String::new(),
            "sigma_t = 1\ndensity = { grid = { file = \"a-files/full.vol\", min = [0, 0, 0], max = [1, 1, 1] } }\nalbedo = 0.75",
        ),
        (
            grid("sigma_t", "full.vol", OWN),
            grid("albedo", "three.vol", &format!("{OWN}<string name=\"wrap_mode\" value=\"mirror\"/>")),
            "density = { grid = { file = \"a-files/full.vol\" } }\nalbedo_grid = { file = \"a-files/three.vol\" }\n",
        ),
        (
            grid("sigma_t", "three.vol", &format!("{OWN}{filter}")),
            "<rgb name=\"albedo\" value=\"0.25, 0.5, 1\"/><float name=\"scale\" value=\"3\"/>".into(),
            "sigma_t_grid = { file = \"a-files/three.vol\", interpolation = \"constant\" }\nalbedo = [0.25, 0.5, 1.0]\nscale = 3.0",
        ),
        // What Mitsuba takes where there is nothing: 1, in the unit cube.
        (
            String::new(),
            String::new(),
            "sigma_t = 1.0\ndensity = { grid = { file = \"a-files/one.grid\", interpolation = \"constant\", min = [0.0, \
             0.0, 0.0], max = [1.0, 1.0, 1.0] } }",
        ),
        (
            "<volume type=\"constvolume\" name=\"sigma_t\"><rgb name=\"value\" value=\"0.5, 1, 2\"/><transform name=\"to_world\">\
             <scale value=\"2\"/><translate y=\"-1\"/></transform></volume>"
                .into(),
            String::new(),
            "sigma_t = [0.5, 1.0, 2.0]\ndensity = { grid = { file = \"a-files/one.grid\", interpolation = \"constant\", \
             min = [0.0, -1.0, 0.0], max = [2.0, 1.0, 2.0] } }",
        ),
        (
            grid("sigma_t", "full.vol", OWN),
            format!(
                "<phase type=\"blendphase\">{}<phase type=\"hg\"/><phase type=\"isotropic\"/></phase>",
                grid("weight", "full.vol", OWN)
            ),
            "phase = { by_place = { first = { hg = 0.8 }, second = \"isotropic\", share = { file = \"a-files/full.vol\" } } }",
        ),
    ] {
        let (text, _) = translated(&filled("sphere", &extinction, &more)).unwrap_or_else(|e| panic!("{e}"));
        assert!(text.contains(expected), "{expected}\nis not in\n{text}");
    }
}

/// Turned, a grid ends at its box here, and at the box along the axes about it there.
#[test]
fn turned_grids_are_taken_where_that_does_not_show() {
    let turned = |file: &str| grid("sigma_t", file, &format!("{OWN}{TURN}"));
    let message = "a.xml:6:84: this grid is turned against the axes, and not 0 at its rim";
    let cube = |to_world: &str| {
        let shape = filled("cube", &turned("full.vol"), "");
        shape.replacen("<bsdf", &format!("{to_world}<bsdf"), 1)
    };
    // A ball of radius 1 is in the box, however it is turned; a cube that is not turned reaches out of it.
    for line in
        [filled("sphere", &turned("full.vol"), ""), cube(TURN), filled("cube", &turned("inner.vol"), "")]
    {
        translated(&line).unwrap_or_else(|e| panic!("{line}: {e}"));
    }
    let larger = "<transform name=\"to_world\"><scale value=\"1.01\"/></transform>";
    let ball = filled("sphere", &turned("full.vol"), "").replacen("<bsdf", &format!("{larger}<bsdf"), 1);
    for line in [cube(""), ball] {
        let found = translated(&line).expect_err("it shows");
        assert!(found.contains(&message[12..]), "{found}");
        assert!(found.starts_with("a.xml:6:"), "{found}");
    }
    let found = translated(&filled("cube", &turned("full.vol"), "")).expect_err("it shows");
    assert!(found.starts_with(message), "{found}");
    // All of space outside of a ball.
    let world = format!(
        "<shape type=\"sphere\"><medium type=\"heterogeneous\" name=\"exterior\">{}</medium></shape>",
        turned("full.vol")
    );
    assert!(translated(&world).expect_err("it shows").contains(&message[12..]));
    let quarter = "<transform name=\"to_world\"><rotate x=\"1\" angle=\"90\"/><scale x=\"2\"/></transform>";
    let line = filled("cube", &grid("sigma_t", "full.vol", &format!("{OWN}{quarter}")), "");
    translated(&line).unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn what_cannot_be_rendered_as_meant_is_refused_at_its_place() {
    let full = grid("sigma_t", "full.vol", OWN);
    let of = |more: &str| grid("sigma_t", "full.vol", more);
    let string = |name: &str, value: &str| format!("<string name=\"{name}\" value=\"{value}\"/>");
    let blend = |more: &str| {
        let parts = "<phase type=\"hg\"/><phase type=\"isotropic\"/>";
        format!("<phase type=\"blendphase\">{more}{parts}</phase>")
    };
    let uncovered = grid("albedo", "three.vol", "");
    for (extinction, more, expected) in [
        (
            of(&string("wrap_mode", "repeat")),
            "",
            ": <volume type=\"gridvolume\" name=\"sigma_t\">: `wrap_mode` repeat",
        ),
        (of(&string("wrap_mode", "border")), "", "`wrap_mode` is `border`: expected clamp, mirror or repeat"),
        (of(&string("filter_type", "cubic")), "", "`filter_type` is `cubic`: expected trilinear or nearest"),
        (
            of(&string("filtr_type", "nearest")),
            "",
            "`filtr_type` of the volume `gridvolume` is not supported; did you mean",
        ),
        (of("<transform name=\"to_world\"><scale x=\"0\"/></transform>"), "", "`to_world` is singular"),
        (
            grid("sigma_t", "nowhere.vol", OWN),
            "",
            "`use_grid_bbox`: the box that `nowhere.vol` names is none",
        ),
        (grid("sigma_t", "no.vol", ""), "", "there is no file `no.vol`: looked for no.vol"),
        (grid("sigma_t", "a.xml", ""), "", "`a.xml`: the name of a grid of Mitsuba's must end in .vol"),
        ("<volume type=\"gridvolume\" name=\"sigma_t\"/>".into(), "", "this volume has no `filename`"),
        (
            "<volume type=\"noisevolume\" name=\"sigma_t\"/>".into(),
            "",
            "only constvolume and gridvolume are supported",
        ),
        ("<volume type=\"constvolume\" name=\"sigma_t\"/>".into(), "", "a constvolume without a `value`"),
        (full.clone(), &uncovered, "this grid does not cover the extinction's"),
        (full.clone(), &blend(&grid("weight", "three.vol", OWN)), "a weight of colours is not supported"),
        (full.clone(), &blend(&grid("weight", "full.vol", "")), "this grid does not cover the extinction's"),
        (full.clone(), &blend("<float name=\"weight\" value=\"2\"/>"), "the weight 2 is not from 0 to 1"),
        (full.clone(), "<float name=\"scale\" value=\"-1\"/>", "found -1"),
        (full, "<rgb name=\"albedo\" value=\"1, 1.5, 1\"/>", "1.5"),
    ] {
        let found = translated(&filled("sphere", &extinction, more)).expect_err(expected);
        assert!(found.starts_with("a.xml:6:") && found.contains(expected), "{found:?} is not {expected:?}");
    }
    // In the file itself, with where it is used.
    let found = translated(&filled("sphere", &grid("sigma_t", "cut.vol", ""), "")).expect_err("cut short");
    assert!(found.starts_with("cut.vol: the header promises 8 numbers, and the file has 3"), "{found}");
    assert!(found.contains("(used at ") && found.ends_with("a.xml:6:86)"), "{found}");
    let uniform = filled("sphere", &of(""), "").replace("heterogeneous", "homogeneous");
    let found = translated(&uniform).expect_err("a grid in a homogeneous medium");
    assert!(found.starts_with("a.xml:6:") && found.contains("make the medium heterogeneous"), "{found}");
    let uniform =
        filled("sphere", "", &blend(&grid("weight", "full.vol", ""))).replace("heterogeneous", "homogeneous");
    let found = translated(&uniform).expect_err("a grid in a homogeneous medium");
    assert!(found.contains("a grid needs a heterogeneous medium"), "{found}");
}
