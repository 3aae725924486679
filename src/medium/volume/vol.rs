//! Mitsuba's `.vol` files, version 3, in 32-bit floats: `VOL`, the version, an encoding, the size, the channels and a box,
//! and the values with x fastest. Encodings of Mitsuba 0.6 with half-floats, bytes or directions are refused.

use super::{Bytes, Volume, count, cube};
use glam::{UVec3, Vec3A};

/// Of a file's bytes.
pub(super) fn parse(bytes: &[u8], _name: Option<&str>) -> Result<Volume, String> {
    let mut bytes = Bytes::new(bytes);
    let [v, o, l, version] = bytes.array()?;
    if [v, o, l] != *b"VOL" {
        return Err("not a Mitsuba grid: it should begin with `VOL`".into());
    }
    if version != 3 {
        return Err(format!("the version of the Mitsuba grid is {version}: 3 can be read"));
    }
    let encoding = bytes.i32()?;
    if encoding != 1 {
        return Err(format!("the encoding of the Mitsuba grid is {encoding}: 1, 32-bit floats, can be read"));
    }
    let size = [bytes.i32()?, bytes.i32()?, bytes.i32()?].map(i64::from);
    let channels = bytes.i32()?;
    if channels != 1 && channels != 3 {
        return Err(format!("the Mitsuba grid has {channels} channels: 1 and 3 can be read"));
    }
    let corner = |bytes: &mut Bytes| Ok::<_, String>(Vec3A::new(bytes.f32()?, bytes.f32()?, bytes.f32()?));
    let (min, max) = (corner(&mut bytes)?, corner(&mut bytes)?);
    let count = count(size, channels as usize)?;
    if bytes.left() / 4 < count {
        return Err(format!("the header promises {count} numbers, and the file has {}", bytes.left() / 4));
    }
    let numbers = bytes.f32s(count)?;
    if bytes.left() > 0 {
        return Err(format!("{} bytes follow the {count} numbers that the header promises", bytes.left()));
    }
    // A box that is none stands for none, as programs that do not care write zeros.
    let there = min.cmplt(max).all() && min.is_finite() && max.is_finite();
    Ok(Volume {
        size: UVec3::from_array(size.map(|n| n as u32)),
        channels: channels as usize,
        numbers,
        from_unit: there.then(|| cube(min, max)),
    })
}

/// A volume as the bytes of a file, with the box of its own, or the unit cube.
pub fn encode(volume: &Volume) -> Vec<u8> {
    let mut bytes = b"VOL\x03".to_vec();
    let size = volume.size.as_ivec3();
    for n in [1, size.x, size.y, size.z, volume.channels as i32] {
        bytes.extend(n.to_le_bytes());
    }
    let corner = |p: Vec3A| volume.from_unit.map_or(p, |m| m.transform_point3a(p)).to_array();
    for x in corner(Vec3A::ZERO).into_iter().chain(corner(Vec3A::ONE)) {
        bytes.extend(x.to_le_bytes());
    }
    bytes.extend(volume.numbers.iter().flat_map(|x| x.to_le_bytes()));
    bytes
}
