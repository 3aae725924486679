//! Runs that are there but are not found: of scenes that went by another name, and of estimators that kept more layers.

use super::cell::SceneContext;
use super::plan::{EstimatorPlan, Plan, ScenePlan};
use super::store::{SceneKey, image_file};
use crate::error::Result;
use crate::film::exr::read_text;
use crate::render::files::{SCENE_CONTENTS, folders};
use crate::transport::settings::Layers;
use std::collections::BTreeMap;
use std::path::Path;

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

/// Says of which estimators there are runs with more layers than are asked for now, where there is none with these. What is kept is in
/// the name of a run, so that they are rendered again.
///
/// # Errors
/// Settings that make no sense.
pub fn fuller(context: &SceneContext) -> Result<Option<String>> {
    let mut found: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for estimator in &context.plan.estimators {
        let there = |layers: Layers| -> Result<bool> {
            let (unit, work) = context.unit(&EstimatorPlan { layers, ..estimator.clone() }, 0)?;
            Ok(unit.peek(work.budget).is_some())
        };
        if there(estimator.layers)? {
            continue;
        }
        for layers in [Layers::Families, Layers::All] {
            if layers as u8 > estimator.layers as u8 && there(layers)? {
                found.entry(layers.name()).or_default().push(&estimator.key);
                break;
            }
        }
    }
    let clause =
        |(layers, names): (&&str, &Vec<&str>)| format!("of {} with layers = \"{layers}\"", names.join(", "));
    let clauses: Vec<String> = found.iter().map(clause).collect();
    let scene = &context.entry.key;
    Ok((!clauses.is_empty()).then(|| {
        format!(
            "{scene}: there are runs {}, of which no figure asks for now: those with less are rendered anew, and `layers` in the \
             experiment goes on with what is there",
            clauses.join(", and ")
        )
    }))
}

/// The contents of the scene that the runs in a folder are of, by the first that says it.
fn contents(folder: &Path) -> Option<String> {
    let runs = folders(folder).into_iter().map(|estimator| estimator.join(image_file(0)));
    runs.filter(|run| run.is_file()).find_map(|run| read_text(&run, SCENE_CONTENTS))
}
