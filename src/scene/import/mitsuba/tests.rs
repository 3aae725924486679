use super::*;
use crate::scene::file::{Overrides, load};
use glam::{DMat3, DVec3};

const SENSOR: &str = "<sensor type='perspective'><float name='fov' value='40'/>\
     <film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='4'/><rfilter type='box'/></film></sensor>";

/// The text that a scene of these elements becomes, and the warnings.
fn translated(elements: &str) -> Result<(String, Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xml");
    std::fs::write(&path, format!("<scene version='3.0.0'>{elements}</scene>")).unwrap();
    let imported = read(&path).map_err(|e| e.to_string())?;
    Ok((imported.source.text().to_owned(), imported.warnings.clone()))
}

#[test]
fn fields_of_view_are_of_any_axis() {
    let sensor = |fov: &str| {
        let text = translated(&SENSOR.replace("<float name='fov' value='40'/>", fov)).unwrap().0;
        let line = |key: &str| text.lines().find(|l| l.starts_with(key)).unwrap().to_owned();
        (line("fov = "), line("fov_axis"))
    };
    let with = |axis: &str| {
        sensor(&format!("<float name='fov' value='40'/><string name='fov_axis' value='{axis}'/>"))
    };
    assert_eq!(with("x"), ("fov = 40.0".into(), "fov_axis = \"horizontal\"".into()));
    assert_eq!(with("larger").1, "fov_axis = \"horizontal\"");
    assert_eq!(with("smaller"), ("fov = 40.0".into(), "fov_axis = \"vertical\"".into()));
    // tan(20°) along the diagonal of 2:1 is 0.3639·2/√5 along the width: 36.06°.
    assert!(with("diagonal").0.starts_with("fov = 36.06"), "{:?}", with("diagonal"));
    // The default lens: 50 mm before a film whose diagonal is 43.27 mm.
    assert!(sensor("").0.starts_with("fov = 42.31"), "{:?}", sensor(""));
}

#[test]
fn masks_and_blends_come_down_to_one_sum() {
    let (text, _) = translated(&format!(
        "{SENSOR}<shape type='rectangle'><bsdf type='mask' id='m'><float name='opacity' value='0.5'/><bsdf type='twosided'>\
         <bsdf type='blendbsdf'><float name='weight' value='0.25'/><bsdf type='diffuse' id='a'/><bsdf type='plastic' id='b'/>\
         </bsdf></bsdf></bsdf></shape>"
    ))
    .unwrap();
    let sum = "layered = { layers = [{ material = \"a\", weight = 0.375 }, { material = \"b\", weight = 0.125 }, \
               { material = \"m-through\", weight = 0.5 }] }";
    assert!(text.contains(sum), "{text}");
}

#[test]
fn surfaces_have_one_side_unless_they_are_said_to_have_two() {
    let shape =
        |bsdf: &str| translated(&format!("{SENSOR}<shape type='rectangle'>{bsdf}</shape>")).unwrap().0;
    assert!(shape("<bsdf type='diffuse' id='a'/>").contains("sided = { front = \"a-front\" }"));
    assert!(!shape("<bsdf type='twosided'><bsdf type='diffuse' id='a'/></bsdf>").contains("sided"));
    assert!(!shape("<bsdf type='dielectric'/>").contains("sided"));
    let both =
        shape("<bsdf type='twosided'><bsdf type='diffuse' id='a'/><bsdf type='conductor' id='b'/></bsdf>");
    assert!(both.contains("sided = { front = \"a\", back = \"b\" }"), "{both}");
}

#[test]
fn the_world_is_what_is_outside_of_all_shapes() {
    let media = "<medium type='homogeneous' id='fog'/><medium type='homogeneous' id='milk'/>";
    let ball =
        |sides: &str| format!("{SENSOR}{media}<shape type='sphere'><bsdf type='null'/>{sides}</shape>");
    let milk = "<ref name='interior' id='milk'/>";
    let (text, _) = translated(&ball(&format!("{milk}<ref name='exterior' id='fog'/>"))).unwrap();
    assert!(text.contains("[world]\nmedium = \"fog\"") && text.contains("interior = \"milk\""), "{text}");
    assert!(!translated(&ball(milk)).unwrap().0.contains("[world]"));
    // Glass without a word about media has the fog in it, too.
    let glass = "<shape type='sphere' id='glass'><bsdf type='dielectric'/></shape>";
    let (text, _) = translated(&ball(&format!(
        "{milk}<ref name='exterior' id='fog'/></shape>{glass}<shape type='disk'>"
    )))
    .unwrap();
    let (_, glass) = text.split_once("name = \"glass\"").unwrap();
    assert!(glass.contains("interior = \"fog\""), "{text}");
    // A ball in nothing, and another in fog: our world is one of them.
    let two = ball(&format!("{milk}</shape><shape type='sphere'><ref name='exterior' id='fog'/>"));
    assert!(translated(&two).unwrap_err().contains("nothing outside where other shapes have a medium"));
}

#[test]
fn filters_are_warned_about_and_rays_begin_at_near_clip() {
    let (text, warnings) = translated(&SENSOR.replace("box", "gaussian")).unwrap();
    assert!(warnings.iter().any(|w| w.contains("not `gaussian`")), "{warnings:?}");
    // Where Mitsuba's rays begin, said or not.
    assert!(text.contains("near = 0.01"), "{text}");
    let sensor = SENSOR.replace("<film", "<float name='near_clip' value='0.1'/><film");
    let (text, warnings) = translated(&sensor).unwrap();
    assert!(text.contains("near = 0.1") && warnings.is_empty(), "{text} {warnings:?}");
}

#[test]
fn what_far_clip_would_hide_is_refused() {
    // A lamp of radius 1 about (0, 0, 5), before a camera that looks along +z or away from it.
    let lamp = "<shape type='sphere'><point name='center' x='0' y='0' z='5'/><emitter type='area'/></shape>";
    let loaded = |clip: &str, turn: &str| {
        let transform = format!("<transform name='to_world'>{turn}</transform>{clip}<film");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.xml");
        let sensor = SENSOR.replace("<film", &transform);
        std::fs::write(&path, format!("<scene version='3.0.0'>\n{sensor}{lamp}</scene>")).unwrap();
        load(&path, &Overrides::default()).map(|_| ()).map_err(|e| e.to_string())
    };
    let clip = |at: f32| format!("<float name='far_clip' value='{at}'/>");
    assert_eq!(loaded("", ""), Ok(()));
    assert_eq!(loaded(&clip(6.01), ""), Ok(()));
    let refused = loaded(&clip(5.9), "").unwrap_err();
    assert!(refused.contains("a.xml:2:") && refused.contains("`far_clip` of 5.9"), "{refused}");
    assert_eq!(loaded(&clip(5.9), "<rotate y='1' angle='180'/>"), Ok(()), "it is behind the camera");
    assert!(loaded("", "<translate z='-9995'/>").unwrap_err().contains("of 10000"), "Mitsuba's default");
    assert!(loaded(&clip(0.001), "").unwrap_err().contains("behind `near_clip`"));
}

#[test]
fn parameters_are_filled_in_and_files_are_included() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: String| std::fs::write(folder.path().join(name), text).unwrap();
    write("parts.xml", "<scene><default name='r' value='9'/><shape type='sphere'><float name='radius' value='$r.5'/></shape></scene>".into());
    write(
        "a.xml",
        format!("<scene><default name='r' value='2'/>{SENSOR}<include filename='parts.xml'/></scene>"),
    );
    let imported = read(&folder.path().join("a.xml")).unwrap();
    let text = imported.source.text();
    assert!(text.contains("radius = 2.5"), "the first default stands: {text}");
    assert_eq!(imported.files.len(), 2);
}

/// Numbers that Mitsuba 3.9.1 gives for the axis (0.3, 1, 0), which is not of unit length, and 35°.
#[test]
fn axes_are_taken_as_they_are() {
    let turned = super::values::turn(DVec3::new(0.3, 1.0, 0.0), 35f64.to_radians());
    let expected = [
        [0.835_428_36, 0.054_254_39, 0.573_576_45],
        [0.054_254_39, 1.0, -0.172_072_95],
        [-0.573_576_45, 0.172_072_95, 0.819_152_06],
    ];
    for (row, numbers) in expected.iter().enumerate() {
        for (column, number) in numbers.iter().enumerate() {
            assert!((turned.col(column)[row] - number).abs() < 1e-6, "{turned:?}");
        }
    }
    let unit = super::values::turn(DVec3::new(0.6, 0.0, 0.8), 1.2);
    assert!(unit.abs_diff_eq(DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.2), 1e-12));
}
