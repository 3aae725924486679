//! What is wrong in a foreign file is said once, with its place.

use std::path::{Path, PathBuf};
use tyndall::scene::file::{Overrides, load};

/// A folder of files with these texts.
pub fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    folder
}

fn message(path: &Path) -> String {
    match load(path, &Overrides::default()) {
        Ok(_) => panic!("{} should not be read", path.display()),
        Err(error) => error.to_string(),
    }
}

/// The message about a scene, with the names of files alone.
fn refused(files: &[(&str, &str)]) -> String {
    let folder = folder(files);
    let path: PathBuf = folder.path().join(files[0].0);
    message(&path).replace(&format!("{}/", folder.path().display()), "")
}

pub const SENSOR: &str = r#"<sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film></sensor>
<emitter type="constant"/>
"#;

/// A Mitsuba scene whose sixth line is this.
fn mitsuba(line: &str) -> String {
    refused(&[("a.xml", &format!("<scene version=\"3.0.0\">\n{SENSOR}{line}\n</scene>"))])
}

#[test]
fn mitsuba_elements_are_refused_at_their_place() {
    for (line, expected) in [
        ("<shape type=\"hair\"/>", "a.xml:6:1: <shape type=\"hair\">: this kind of shape is not supported"),
        (
            "<shape type=\"sphere\"><float name=\"radiu\" value=\"1\"/></shape>",
            "a.xml:6:22: `radiu` of the shape `sphere` is not supported; did you mean `radius`?",
        ),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"one\"/></shape>",
            "a.xml:6:22: `one` is not a number",
        ),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"1e60\"/></shape>",
            "a.xml:6:22: `1e60` is not a finite number",
        ),
        (
            "<shape type=\"sphere\"><ref id=\"red\"/></shape>",
            "a.xml:6:22: there is nothing with the id `red`",
        ),
        (
            "<shape type=\"sphere\"><bsdf type=\"principled\"/></shape>",
            "a.xml:6:22: <bsdf type=\"principled\">: this kind of BSDF",
        ),
        (
            "<shape type=\"sphere\"><bsdf type=\"roughplastic\"><string name=\"distribution\" value=\"phong\"/></bsdf></shape>",
            "a.xml:6:48: <string name=\"distribution\">: there is no distribution `phong`: it is `beckmann` or `ggx`",
        ),
        (
            "<shape type=\"sphere\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"2\"/></bsdf></shape>",
            "a.xml:6:22: expected a number from 0 to 1, found 2",
        ),
        (
            "<shape type=\"sphere\"><bsdf type=\"dielectric\"><string name=\"int_ior\" value=\"watr\"/></bsdf></shape>",
            "a.xml:6:46: there is no dielectric `watr`; did you mean `water`?",
        ),
        (
            "<shape type=\"sphere\"><transform name=\"to_world\"><scale x=\"2\"/></transform></shape>",
            "a.xml:6:1: `sphere 1`: a sphere can only be scaled",
        ),
        (
            "<shape type=\"obj\"><string name=\"filename\" value=\"no.obj\"/></shape>",
            "a.xml:6:19: there is no file `no.obj`: looked for no.obj",
        ),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"$r\"/></shape>",
            "a.xml:6:22: there is no parameter `$r`",
        ),
        ("<shpe type=\"sphere\"/>", "a.xml:6:1: <shpe> is not an element of a scene; did you mean <shape>?"),
        (
            "<emitter type=\"area\"/>",
            "a.xml:6:1: <emitter type=\"area\">: this kind of emitter is not supported",
        ),
        ("<include filename=\"a.xml\"/>", "a.xml:6:1: `a.xml` includes itself"),
        ("<shape type=\"sphere\">", "a.xml:7:1: not readable as XML"),
        ("words", "a.xml:"),
    ] {
        let found = mitsuba(line);
        assert!(found.starts_with(expected), "{found:?} is not {expected:?}");
    }
}

#[test]
fn mitsuba_files_that_include_each_other_end() {
    let (a, b) =
        ("<scene>\n<include filename='b.xml'/></scene>", "<scene>\n <include filename='a.xml'/></scene>");
    let found = refused(&[("a.xml", a), ("b.xml", b)]);
    assert_eq!(found, "b.xml:2:2: `a.xml` includes itself");
}

#[test]
fn entities_are_not_expanded() {
    let text = "<!DOCTYPE scene [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;&a;&a;&a;&a;'>]>\n<scene>&b;</scene>";
    let found = refused(&[("a.xml", text)]);
    assert_eq!(found, "a.xml:1:1: a document type declaration: entities are not expanded");
}

#[test]
fn files_cut_short_are_refused() {
    let text = std::fs::read_to_string(crate::scene_path("lights.xml")).expect("a scene");
    for end in (0..text.len() - 9).step_by(97) {
        let found = refused(&[("a.xml", &text[..end])]);
        assert!(found.starts_with("a.xml"), "{found}");
    }
}
