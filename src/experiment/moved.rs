//! Scenes that go by another name than they did: their runs are there, but are not found.

use super::plan::{Plan, ScenePlan};
use super::store::{SceneKey, image_file};
use crate::render::files::SCENE_CONTENTS;
use exr::meta::MetaData;
use exr::meta::attribute::AttributeValue;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

/// Says under which name there are runs of a scene with these contents in the folder of results, where there are none under its own
/// and no other scene of the plan has that name. A scene is called after its folder: it may have been moved.
pub fn hint(plan: &Plan, entry: &ScenePlan, key: &SceneKey, out: &Path) -> Option<String> {
    if out.join(&entry.key).exists() {
        return None;
    }
    let known = |name: &str| plan.scenes.iter().any(|s| s.key == name);
    let names = folders(out).into_iter().filter_map(|p| Some(p.file_name()?.to_str()?.to_owned()));
    let mut others = names.filter(|name| !known(name));
    let other = others.find(|name| contents(&out.join(name)).as_deref() == Some(key.contents()))?;
    let own = &entry.key;
    Some(format!(
        "scene {own} is what scene {other} was, of which there are runs: a scene is called after its folder, and its name is in \
         the seeds of its runs; `name = \"{other}\"` in its [[scene]] goes on with those"
    ))
}

/// The contents of the scene that the runs in a folder are of, by the first that says it.
fn contents(folder: &Path) -> Option<String> {
    let runs = folders(folder).into_iter().map(|estimator| estimator.join(image_file(0)));
    runs.filter(|run| run.is_file()).find_map(|run| text_of(&run, SCENE_CONTENTS))
}

/// A text in the header of an EXR; its pixels are not read. None where there is none, or the file is damaged.
fn text_of(path: &Path, key: &str) -> Option<String> {
    // The crate answers some damaged files with a panic.
    let header = catch_unwind(|| MetaData::read_from_file(path, false)).ok()?.ok()?;
    let own = header
        .headers
        .into_iter()
        .flat_map(|h| h.own_attributes.other.into_iter().chain(h.shared_attributes.other));
    own.filter(|(name, _)| *name == *key).find_map(|(_, value)| match value {
        AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    })
}

/// The folders in a folder, in order.
fn folders(dir: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(dir).into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = entries.map(|e| e.path()).filter(|p| p.is_dir()).collect();
    folders.sort();
    folders
}
