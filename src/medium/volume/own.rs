//! Our own files: lines of text, each a key and its numbers, up to the line `data`, and then the numbers as 32-bit
//! little-endian floats, x fastest, then y, then z, those of one value together:
//!
//! ```text
//! tyndall grid 1
//! size 64 64 32
//! channels 1
//! box -1 -1 0  1 1 1
//! data
//! ```
//!
//! `channels`, 1 or 3, is 1 where it is left out; `box`, the corners of the grid's box, may be left out.

use super::{Bytes, Volume, count, cube};
use glam::{Mat3A, UVec3, Vec3, Vec3A};

const FIRST: &str = "tyndall grid 1";
/// No header is longer.
const HEADER: usize = 4096;

/// Of a file's bytes.
pub(super) fn parse(bytes: &[u8], _name: Option<&str>) -> Result<Volume, String> {
    const MARK: &[u8] = b"\ndata\n";
    if !bytes.starts_with(FIRST.as_bytes()) {
        return Err(format!("not a grid of ours: its first line should be `{FIRST}`"));
    }
    let header = &bytes[..bytes.len().min(HEADER)];
    let end = header.windows(MARK.len()).position(|w| w == MARK).ok_or("the header has no line `data`")?;
    let text = std::str::from_utf8(&bytes[..end]).map_err(|_| "the header is not text")?;
    let (mut size, mut channels, mut corners) = (None, 1, None);
    for (i, line) in text.lines().enumerate().skip(1) {
        let fail = |message: String| format!("line {} of the header: {message}", i + 1);
        let mut words = line.split_whitespace();
        let Some(key) = words.next() else { continue };
        let numbers: Vec<f64> = words
            .map(|w| w.parse().map_err(|_| fail(format!("`{w}` is not a number"))))
            .collect::<Result<_, _>>()?;
        let whole = |x: f64| if x.fract() == 0.0 && x.abs() < 1e15 { x as i64 } else { -1 };
        match (key, &numbers[..]) {
            ("size", [x, y, z]) => size = Some([*x, *y, *z].map(whole)),
            ("channels", [n]) if *n == 1.0 || *n == 3.0 => channels = *n as usize,
            ("box", [a, b, c, d, e, f]) => {
                let point = |v: [f64; 3]| Vec3A::from_array(v.map(|x| x as f32));
                corners = Some((point([*a, *b, *c]), point([*d, *e, *f])));
            }
            _ => {
                return Err(fail(format!(
                    "expected `size` and three numbers, `channels` and 1 or 3, or `box` and six numbers, found `{line}`"
                )));
            }
        }
    }
    let size = size.ok_or("the header does not say the size")?;
    let count = count(size, channels)?;
    let mut data = Bytes::new(&bytes[end + MARK.len()..]);
    if data.left() / 4 < count {
        return Err(format!("the header promises {count} numbers, and the file has {}", data.left() / 4));
    }
    let numbers = data.f32s(count)?;
    if data.left() > 0 {
        return Err(format!("{} bytes follow the {count} numbers that the header promises", data.left()));
    }
    if let Some((min, max)) = corners
        && !(min.cmplt(max).all() && min.is_finite() && max.is_finite())
    {
        return Err(format!("the box {min} … {max} is none: its first corner must be below the second"));
    }
    let size = UVec3::from_array(size.map(|n| n as u32));
    Ok(Volume { size, channels, numbers, from_unit: corners.map(|(min, max)| cube(min, max)) })
}

/// A volume as the bytes of a file; its box must be along the axes, and is left out otherwise.
pub fn encode(volume: &Volume) -> Vec<u8> {
    let mut text = format!("{FIRST}\nsize {} {} {}\n", volume.size.x, volume.size.y, volume.size.z);
    text.push_str(&format!("channels {}\n", volume.channels));
    if let Some(m) = volume.from_unit
        && m.matrix3
            == Mat3A::from_diagonal(Vec3::new(m.matrix3.x_axis.x, m.matrix3.y_axis.y, m.matrix3.z_axis.z))
    {
        let (a, b) = (m.translation, m.transform_point3a(Vec3A::ONE));
        text.push_str(&format!("box {} {} {}  {} {} {}\n", a.x, a.y, a.z, b.x, b.y, b.z));
    }
    let mut bytes = text.into_bytes();
    bytes.extend_from_slice(b"data\n");
    bytes.extend(volume.numbers.iter().flat_map(|x| x.to_le_bytes()));
    bytes
}
