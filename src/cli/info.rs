//! `tyndall info SCENE [--json]`: what is in a scene.

use super::args::InfoArgs;
use super::progress::while_loading;
use super::session::{Ending, print};
use crate::error::{Error, Result};
use crate::scene::file::{Overrides, load};
use crate::scene::info::SceneInfo;

/// Prints what is in the scene.
///
/// # Errors
/// Where the scene cannot be read.
pub fn run(args: &InfoArgs) -> Result<Ending> {
    let scene = while_loading(|| load(&args.scene, &Overrides::default()))?;
    let info = SceneInfo::of(&scene);
    if args.json {
        let json = serde_json::to_string_pretty(&info).map_err(|e| Error::usage(e.to_string()))?;
        print(format!("{json}\n"))?;
    } else {
        print(info)?;
    }
    Ok(Ending::Done)
}
