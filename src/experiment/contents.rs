//! What of a scene's files decides its pixels.

use super::hash::Hasher;
use crate::error::{Error, Result};
use crate::scene::Scene;
use std::path::Path;

/// Adds the contents of all files that a scene was made of. Of a scene file its values count, in their order, but not what is
/// for people alone: comments, layout, the scene's name and description.
///
/// # Errors
/// A file that cannot be read.
pub fn add(hasher: &mut Hasher, scene: &Scene) -> Result<()> {
    for path in &scene.dependencies {
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read it", &e))?;
        match values(path, &bytes) {
            Some(values) => hasher.field(values.as_bytes()),
            None => hasher.field(&bytes),
        };
    }
    Ok(())
}

/// The values of a TOML file; none of another one.
fn values(path: &Path, bytes: &[u8]) -> Option<String> {
    if path.extension()? != "toml" {
        return None;
    }
    let mut table: toml::Table = std::str::from_utf8(bytes).ok()?.parse().ok()?;
    for key in ["name", "description"] {
        table.remove(key);
    }
    Some(table.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_do_not_count_and_values_do() {
        let of = |text: &str| values(Path::new("a/scene.toml"), text.as_bytes()).expect("it is TOML");
        let plain = of("[film]\nwidth = 4\n[[shape]]\nsphere = { radius = 1 }\n[[shape]]\nname = 'a'\n");
        let words = "name = 'ball' # big\ndescription = 'A ball.'\n[film]\n\nwidth=4\n[[shape]]\n\
                     sphere = { radius = 1 }\n[[shape]]\nname = \"a\"\n";
        assert_eq!(of(words), plain);
        for other in [
            "[film]\nwidth = 5\n[[shape]]\nsphere = { radius = 1 }\n[[shape]]\nname = 'a'\n",
            "[film]\nwidth = 4\n[[shape]]\nname = 'a'\n[[shape]]\nsphere = { radius = 1 }\n",
            "[film]\nwidth = 4\n[[shape]]\nsphere = { radius = 1.0000001 }\n[[shape]]\nname = 'a'\n",
        ] {
            assert_ne!(of(other), plain, "{other}");
        }
        assert_eq!(values(Path::new("a/mesh.obj"), b"v 0 0 0"), None);
    }
}
