//! Scenes that go by another name than they did: their runs are there, but are not found.

use super::plan::{Plan, ScenePlan};
use super::store::{SceneKey, image_file};
use crate::film::exr::read_text;
use crate::render::files::{SCENE_CONTENTS, entries};
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
    runs.filter(|run| run.is_file()).find_map(|run| read_text(&run, SCENE_CONTENTS))
}

/// The folders in a folder, in order.
fn folders(dir: &Path) -> Vec<PathBuf> {
    let mut found = entries(dir);
    found.retain(|path| path.is_dir());
    found
}
