//! The file's containers: JSON alone or in a GLB, buffers in files, in data URIs or in the GLB, numbers in buffers.

use super::json::{Accessor, Root};
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// A file that has been read, with its buffers.
#[derive(Debug)]
pub(super) struct Data {
    pub path: PathBuf,
    pub root: Root,
    buffers: Vec<Vec<u8>>,
    /// Other files that were read.
    pub files: Vec<PathBuf>,
}

impl Data {
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|e| Error::unreadable(path, &e))?;
        let (json, binary) = if bytes.starts_with(b"glTF") { glb(path, &bytes)? } else { (&bytes[..], None) };
        let root: Root = serde_json::from_slice(json).map_err(|e| {
            let message = e.to_string();
            let message = message.split(" at line ").next().unwrap_or_default().to_owned();
            // In a GLB the JSON has no lines of its own.
            match binary {
                None => Error::at(path, e.line(), e.column(), message),
                Some(_) => Error::file(path, format!("in its JSON: {message}")),
            }
        })?;
        let mut data = Self { path: path.to_owned(), root, buffers: Vec::new(), files: Vec::new() };
        for i in 0..data.root.buffers.len() {
            let buffer = data.buffer(i, binary)?;
            data.buffers.push(buffer);
        }
        Ok(data)
    }

    /// An error about a part of the file.
    pub fn error(&self, part: &str, message: impl std::fmt::Display) -> Error {
        Error::file(&self.path, format!("{part}: {message}"))
    }

    fn buffer(&mut self, i: usize, binary: Option<&[u8]>) -> Result<Vec<u8>> {
        let part = format!("buffers[{i}]");
        let length = self.root.buffers[i].byte_length;
        let bytes = match self.root.buffers[i].uri.clone() {
            Some(uri) => self.uri(&part, &uri)?.0,
            None => match binary {
                Some(binary) if i == 0 => binary.to_vec(),
                _ => {
                    return Err(self.error(&part, "it has no `uri`, and the file has no binary chunk for it"));
                }
            },
        };
        match bytes.len() < length {
            true => Err(self.error(&part, format!("{} bytes where byteLength says {length}", bytes.len()))),
            false => Ok(bytes),
        }
    }

    /// What a URI stands for, and where it is if it is a file.
    pub fn uri(&mut self, part: &str, uri: &str) -> Result<(Vec<u8>, Option<PathBuf>)> {
        if let Some(data) = uri.strip_prefix("data:") {
            let Some((kind, text)) = data.split_once(',') else {
                return Err(self.error(part, "a data URI without a comma"));
            };
            if !kind.ends_with(";base64") {
                return Err(self.error(part, "a data URI that is not of base64"));
            }
            let bytes = base64(text).ok_or_else(|| self.error(part, "what is said to be base64 is not"))?;
            return Ok((bytes, None));
        }
        let path = self.path.parent().unwrap_or(Path::new("")).join(percent_decoded(uri));
        if !path.is_file() {
            return Err(self.error(part, format!("there is no file `{}`", path.display())));
        }
        let bytes = std::fs::read(&path).map_err(|e| Error::io(&path, "read it", &e))?;
        if !self.files.contains(&path) {
            self.files.push(path.clone());
        }
        Ok((bytes, Some(path)))
    }

    /// The bytes of a buffer view.
    pub fn view(&self, part: &str, i: usize) -> Result<&[u8]> {
        let view = self.root.buffer_views.get(i);
        let view = view.ok_or_else(|| self.error(part, format!("there is no bufferViews[{i}]")))?;
        let range = view.byte_offset.checked_add(view.byte_length).map(|end| view.byte_offset..end);
        let bytes = self.buffers.get(view.buffer).zip(range).and_then(|(buffer, range)| buffer.get(range));
        bytes.ok_or_else(|| self.error(part, format!("bufferViews[{i}] is outside of its buffer")))
    }

    /// The elements of an accessor as their bytes, and the accessor.
    fn elements(&self, part: &str, i: usize, kind: &str) -> Result<(impl Iterator<Item = &[u8]>, &Accessor)> {
        let accessor = self.root.accessors.get(i);
        let accessor = accessor.ok_or_else(|| self.error(part, format!("there is no accessors[{i}]")))?;
        let part = format!("accessors[{i}]");
        if accessor.sparse.is_some() {
            return Err(self.error(&part, "sparse accessors are not supported"));
        }
        if accessor.kind != kind {
            return Err(self.error(&part, format!("expected {kind}, found {}", accessor.kind)));
        }
        let components = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            _ => 3,
        };
        let size = components
            * component_size(accessor.component_type).ok_or_else(|| {
                self.error(&part, format!("the componentType {} is not known", accessor.component_type))
            })?;
        let Some(view) = accessor.buffer_view else { return Err(self.error(&part, "it has no bufferView")) };
        let bytes = self.view(&part, view)?;
        let stride = self.root.buffer_views[view].byte_stride.unwrap_or(size).max(1);
        let (start, count) = (accessor.byte_offset, accessor.count);
        let end = count
            .checked_sub(1)
            .and_then(|last| last.checked_mul(stride)?.checked_add(start)?.checked_add(size));
        if count > 0 && end.is_none_or(|end| end > bytes.len()) {
            return Err(self.error(&part, "it is outside of its bufferView"));
        }
        Ok(((0..count).map(move |i| &bytes[start + i * stride..start + i * stride + size]), accessor))
    }

    /// Vectors of `N` numbers.
    pub fn vectors<const N: usize>(&self, part: &str, i: usize) -> Result<Vec<[f32; N]>> {
        let (elements, accessor) = self.elements(part, i, if N == 2 { "VEC2" } else { "VEC3" })?;
        let size = component_size(accessor.component_type).unwrap_or(1);
        Ok(elements
            .map(|bytes| std::array::from_fn(|k| component(accessor, &bytes[k * size..(k + 1) * size])))
            .collect())
    }

    /// Indices of vertices.
    pub fn indices(&self, part: &str, i: usize) -> Result<Vec<u32>> {
        let (elements, accessor) = self.elements(part, i, "SCALAR")?;
        let read: fn(&[u8]) -> u32 = match accessor.component_type {
            5121 => |b| u32::from(b[0]),
            5123 => |b| u32::from(u16::from_le_bytes([b[0], b[1]])),
            5125 => |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            other => return Err(self.error(part, format!("indices of the componentType {other}"))),
        };
        Ok(elements.map(read).collect())
    }
}

/// The chunks of a GLB: JSON and, where there is one, binary.
fn glb<'a>(path: &Path, bytes: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>)> {
    let short = || Error::file(path, "the file is cut short");
    let word = |at: usize| {
        let word = bytes.get(at..at + 4).ok_or_else(short)?;
        Ok::<_, Error>(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
    };
    if word(4)? != 2 {
        return Err(Error::file(path, format!("version {} of GLB: only 2 is read", word(4)?)));
    }
    let mut chunks = Vec::new();
    let mut at = 12;
    while at + 8 <= bytes.len() && chunks.len() < 2 {
        let (length, kind) = (word(at)? as usize, word(at + 4)?);
        chunks.push((kind, bytes.get(at + 8..(at + 8).saturating_add(length)).ok_or_else(short)?));
        at += 8 + length;
    }
    match chunks[..] {
        [(0x4E4F_534A, json)] => Ok((json, Some(&[]))),
        [(0x4E4F_534A, json), (_, binary)] => Ok((json, Some(binary))),
        _ => Err(Error::file(path, "a GLB whose first chunk is not JSON")),
    }
}

fn component_size(kind: u32) -> Option<usize> {
    match kind {
        5120 | 5121 => Some(1),
        5122 | 5123 => Some(2),
        5125 | 5126 => Some(4),
        _ => None,
    }
}

/// A component as a number; integers that are normalised from −1 or 0 to 1.
fn component(accessor: &Accessor, b: &[u8]) -> f32 {
    let (value, largest) = match accessor.component_type {
        5120 => (f32::from(b[0] as i8), 127.0),
        5121 => (f32::from(b[0]), 255.0),
        5122 => (f32::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
        5123 => (f32::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
        5125 => (u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32, u32::MAX as f32),
        _ => return f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
    };
    if accessor.normalized { (value / largest).max(-1.0) } else { value }
}

/// Decodes base64 with or without padding; `None` where it is none.
fn base64(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut n) = (0u32, 0);
    for c in text.trim_end_matches('=').bytes() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        bits = (bits << 6 | u32::from(value)) & 0xff_ffff;
        n += 6;
        if n >= 8 {
            n -= 8;
            out.push((bits >> n) as u8);
        }
    }
    Some(out)
}

fn percent_decoded(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        let hex = bytes.get(i + 1..i + 3).and_then(|h| std::str::from_utf8(h).ok());
        match (bytes[i], hex.and_then(|h| u8::from_str_radix(h, 16).ok())) {
            (b'%', Some(byte)) => {
                out.push(byte);
                i += 3;
            }
            (byte, _) => {
                out.push(byte);
                i += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_and_percent_signs_are_decoded() {
        assert_eq!(base64("Zm9vYmFy").as_deref(), Some(&b"foobar"[..]));
        assert_eq!(base64("Zm9vYg==").as_deref(), Some(&b"foob"[..]));
        assert_eq!(base64("Zm9 "), None);
        assert_eq!(percent_decoded("a%20b%2fc%"), "a b/c%");
    }
}
