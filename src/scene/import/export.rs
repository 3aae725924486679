//! Writes what an importer read as a scene file of ours, with its meshes and pictures beside it.

use super::Imported;
use super::numbers::quoted;
use crate::error::{Error, Result};
use crate::film::output::{write_atomically, write_bytes};
use crate::geometry::TriangleMesh;
use crate::scene::file::assets::Asset;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Writes the scene file at `out` and the files that it refers to in a folder beside it; the scene file comes last, so
/// that where it is, all is. Meshes are binary PLY with the very numbers, files are copied as they are.
///
/// # Errors
/// Where a file cannot be written, or `out` does not end in `.toml`.
pub fn export(imported: &Imported, out: &Path) -> Result<Vec<PathBuf>> {
    if out.extension().is_none_or(|e| !e.eq_ignore_ascii_case("toml")) {
        return Err(Error::usage(format!("{}: a scene file's name ends in .toml", out.display())));
    }
    let folder = out.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "make the folder", &e))?;
    // The folder is called like the file, so that scenes beside each other do not share one.
    let own = out.file_stem().map_or("scene".into(), |s| s.to_string_lossy()).into_owned();
    let mut text = imported.source.text().to_owned();
    let mut written = Vec::new();
    for (name, asset) in &imported.assets {
        let file = name.split_once('/').map_or(name.as_str(), |(_, file)| file);
        let renamed = format!("{own}-files/{file}");
        text = text.replace(&quoted(name), &quoted(&renamed));
        let path = folder.join(&renamed);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(|e| Error::io(parent, "make the folder", &e))?;
        }
        match asset {
            Asset::File(from) => {
                let bytes = std::fs::read(from).map_err(|e| Error::io(from, "read it", &e))?;
                write_bytes(&path, &bytes)?;
            }
            Asset::Bytes(bytes) => write_bytes(&path, bytes)?,
            Asset::Mesh(mesh) => write_atomically(&path, |out| write_ply(mesh, out))?,
        }
        written.push(path);
    }
    write_bytes(out, text.as_bytes())?;
    written.push(out.to_owned());
    Ok(written)
}

/// A mesh as a binary PLY file, bit for bit.
fn write_ply(mesh: &TriangleMesh, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", mesh.positions().len())?;
    let mut properties = vec!["x", "y", "z"];
    properties.extend(mesh.normals().iter().flat_map(|_| ["nx", "ny", "nz"]));
    properties.extend(mesh.uvs().iter().flat_map(|_| ["u", "v"]));
    for property in properties {
        writeln!(out, "property float {property}")?;
    }
    writeln!(
        out,
        "element face {}\nproperty list uchar uint vertex_indices\nend_header",
        mesh.indices().len()
    )?;
    let mut row = Vec::with_capacity(32);
    for (i, p) in mesh.positions().iter().enumerate() {
        row.clear();
        row.extend(p.to_array());
        if let Some(normals) = mesh.normals() {
            row.extend(normals[i].to_array());
        }
        if let Some(uvs) = mesh.uvs() {
            row.extend(uvs[i].to_array());
        }
        for x in &row {
            out.write_all(&x.to_le_bytes())?;
        }
    }
    for triangle in mesh.indices() {
        out.write_all(&[3])?;
        for i in triangle {
            out.write_all(&i.to_le_bytes())?;
        }
    }
    Ok(())
}
