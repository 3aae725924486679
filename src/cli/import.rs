//! `tyndall import IN OUT.toml`: another program's scene as a scene file of ours.

use super::args::ImportArgs;
use super::progress::while_loading;
use super::session::{Ending, print};
use crate::error::{Error, Result};
use crate::scene::file::{Overrides, from_import};
use crate::scene::import::{Format, export};

/// Translates the scene, sees that it can be rendered, and writes it.
///
/// # Errors
/// Where the scene cannot be read, or the files not be written; or where there is a file that was not to be written over.
pub fn run(args: &ImportArgs) -> Result<Ending> {
    let Some(format) = Format::of(&args.scene) else {
        return Err(Error::file(
            &args.scene,
            format!("not a format of others: expected {}", Format::ENDINGS),
        ));
    };
    if !args.force && args.out.exists() {
        let message =
            "is there already, and may be more than an import: another name, or --force to write over it";
        return Err(Error::file(&args.out, message));
    }
    let (imported, scene) = while_loading(|| {
        let imported = format.read(&args.scene)?;
        let scene = from_import(&imported, &Overrides::default())?;
        Ok::<_, Error>((imported, scene))
    })?;
    for warning in &scene.warnings {
        eprintln!("warning: {}: {warning}", args.scene.display());
    }
    let written = export(&imported, &args.out)?;
    let files: String = written.iter().map(|file| format!("wrote {}\n", file.display())).collect();
    print(files)?;
    Ok(Ending::Done)
}
