use super::*;
use std::path::Path;

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 -1\nusemtl wall\nf 1//1 2//1 3//1\n";
const AUX: &str =
    "TM_ROW1 0 1 0\nTM_ROW2 0 0 1\nTM_ROW3 0 0 5\nCAMERA_FOV 1\nlight_background_constant 1 1 1\n";

/// A scene of these files: its text and warnings.
fn scene(obj: &str, mtl: &str, aux: &str) -> Result<(String, Vec<String>, TriangleMesh), String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("a.obj", obj), ("a.mtl", mtl), ("a.obj.aux", aux)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let short = |e: Error| e.to_string().replace(&format!("{}/", folder.path().display()), "");
    let imported = read(&folder.path().join("a.obj")).map_err(short)?;
    let mesh = imported.assets.values().find_map(|a| match a {
        crate::scene::file::assets::Asset::Mesh(mesh) => Some(mesh.clone()),
        _ => None,
    });
    Ok((imported.source.text().to_owned(), imported.warnings.clone(), mesh.unwrap()))
}

#[test]
fn triangles_turn_to_the_side_of_their_normals() {
    let (_, _, mesh) = scene(OBJ, "newmtl wall\nKd 1 1 1\n", AUX).unwrap();
    let [a, b, c] = mesh.indices()[0].map(|i| mesh.positions()[i as usize]);
    assert!((b - a).cross(c - a).z < 0.0);
}

#[test]
fn misspelt_keys_are_taken_by_their_first_letters() {
    let aux = format!(
        "{AUX}medium m\nabsorbtion 1 2 3\nscatering 4 5 6\nmaterial wall\nmediumID m\nior 1.3\nKx 1 1 1\nKe 2 2 2\n"
    );
    let (text, warnings, _) = scene(OBJ, "newmtl wall\n", &aux).unwrap();
    assert!(
        text.contains("sigma_a = [1.0, 2.0, 3.0]") && text.contains("sigma_s = [4.0, 5.0, 6.0]"),
        "{text}"
    );
    assert!(text.contains("interior = \"m\"") && text.contains("emission = 2.0"), "{text}");
    let expected = "`scatering` is taken for `scattering`, by its first letters";
    assert!(
        warnings.iter().any(|w| w.ends_with(expected) && w.contains("a.obj.aux, line 8")),
        "{warnings:?}"
    );
    assert_eq!(warnings.len(), 4, "{warnings:?}");
}

#[test]
fn a_surface_is_the_sum_of_what_it_has() {
    let aux = format!("{AUX}material wall\nmirror 0.2 0.2 0.2\n");
    let (text, ..) = scene(OBJ, "newmtl wall\nKd 0.5 0.4 0.3\nKs 0.1 0.1 0.1\nNs 20\n", &aux).unwrap();
    assert!(
        text.contains("phong = { diffuse = [0.5, 0.4, 0.3], specular = 0.1, exponent = 20.0 }"),
        "{text}"
    );
    assert!(text.contains("mirror = { reflectance = 0.2 }"), "{text}");
    assert!(text.contains("layered = { layers = ["), "{text}");
    // An exponent of 0 switches the lobe off.
    let (text, ..) = scene(OBJ, "newmtl wall\nKd 0.5 0.4 0.3\nKs 0.1 0.1 0.1\n", AUX).unwrap();
    assert!(
        text.contains("diffuse = { reflectance = [0.5, 0.4, 0.3] }") && !text.contains("layered"),
        "{text}"
    );
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let mtl = "newmtl wall\nKd 1 1 1\n";
    for (obj, mtl, aux, expected) in [
        (OBJ, mtl, "FOO 1\n", "a.obj.aux:1: unknown key `FOO`"),
        (OBJ, mtl, "medium m\nfoo 1\n", "a.obj.aux:2: unknown key `foo`"),
        (OBJ, mtl, "TM_ROW1 0 1 0\n", "a.obj.aux: the camera has no TM_ROW2"),
        (OBJ, mtl, &AUX.replace("CAMERA_FOV 1", "CAMERA_FOV one"), "a.obj.aux:4: `one` is not a number"),
        (OBJ, mtl, &AUX.replace("0 0 5", "0 0"), "a.obj.aux:3: 2 values after `TM_ROW3`, where 3 are needed"),
        (
            OBJ,
            mtl,
            &format!("{AUX}material wal\n"),
            "a.obj.aux:6: there is no material `wal` in the file of materials; did you mean `wall`?",
        ),
        (
            OBJ,
            mtl,
            &format!("{AUX}light_background_em 1 0 no.exr\n"),
            "a.obj.aux:6: there is no picture `no.exr`",
        ),
        (OBJ, "Kd 1 1 1\n", AUX, "a.mtl:1: `Kd` before the first `newmtl`"),
        (OBJ, "newmtl wall\nKd 1 1\n", AUX, "a.mtl:2: 2 values after `Kd`"),
        (&OBJ.replace("usemtl wall", "usemtl wood"), mtl, AUX, "a.obj: there is no material `wood`"),
        (&OBJ.replace("a.mtl", "b.mtl"), mtl, AUX, "a.obj:1: there is no file of materials `b.mtl`"),
        (&OBJ.replace("3//1", "4//1"), mtl, AUX, "a.obj:7: index 4 is out of range"),
    ] {
        let message = scene(obj, mtl, aux).unwrap_err();
        assert!(message.starts_with(expected), "{message:?} is not {expected:?}");
    }
}

#[test]
fn an_obj_alone_is_no_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, OBJ).unwrap();
    let message = read(&path).unwrap_err().to_string();
    assert!(message.contains("an OBJ file alone has neither camera nor lights"), "{message}");
    let message = read(Path::new("no such.obj")).unwrap_err().to_string();
    assert_eq!(message, "no such.obj: there is no such file");
}
