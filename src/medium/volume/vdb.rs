//! OpenVDB's `.vdb` files: float grids as trees of three levels (5-4-3), of the file versions 222 to 225 (OpenVDB 3 to 12),
//! also with half floats; uncompressed, with zlib, or with Blosc's LZ4, and with the values of inactive voxels left out.
//!
//! Not read: grids of other types (vectors, whole numbers, points, levels of another depth), Blosc with another codec than
//! LZ4 (OpenVDB writes no other), instances of other grids, and files before version 222. The transform may be any affine map;
//! frusta are refused. Voxels keep their values, inactive or not; the grid is the box of all that differ from 0, with a layer of
//! the background around it; a background other than 0 is refused, as the grid would have no end.

use super::{Bytes, Volume};
use glam::{Affine3A, DAffine3, DMat3, DVec3, I64Vec3, IVec3, UVec3};
use std::io::Read;

const MAGIC: [u8; 8] = [0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0];
const ZIP: u32 = 1;
const ACTIVE_MASK: u32 = 2;
const BLOSC: u32 = 4;
/// No grid that is read has more voxels, with what is empty between them.
const MOST: i64 = 1 << 30;

/// A grid's entry in a file.
struct Entry {
    name: String,
    kind: String,
    instance: String,
    begin: usize,
}

/// Of a file's bytes: the grid of this name, or the only one that there is of a kind that can be read.
pub(super) fn parse(bytes: &[u8], name: Option<&str>) -> Result<Volume, String> {
    let mut at = Bytes::new(bytes);
    if at.array::<8>().ok() != Some(MAGIC) {
        return Err("not an OpenVDB file".into());
    }
    let version = at.u32()?;
    if !(222..=225).contains(&version) {
        return Err(format!("the OpenVDB file has version {version}: 222 to 225 can be read"));
    }
    let (_major, _minor) = (at.u32()?, at.u32()?);
    if at.u8()? == 0 {
        return Err("the OpenVDB file does not say where its grids are".into());
    }
    at.take(36)?;
    metadata(&mut at)?;
    let mut entries = Vec::new();
    for _ in 0..at.u32()? {
        let entry = Entry {
            name: at.string()?,
            kind: at.string()?,
            instance: at.string()?,
            begin: usize::try_from(at.u64()?).map_err(|_| "a grid is beyond the file's end")?,
        };
        let (_blocks, end) = (at.u64()?, at.u64()?);
        entries.push(entry);
        at = Bytes::after(bytes, end)?;
    }
    let entry = choose(&entries, name)?;
    let mut at = Bytes::after(bytes, entry.begin as u64)?;
    let compression = at.u32()?;
    if compression & !(ZIP | ACTIVE_MASK | BLOSC) != 0 {
        return Err(format!("the compression {compression} of the OpenVDB grid is not known"));
    }
    metadata(&mut at)?;
    let to_world = transform(&mut at)?;
    let half = entry.kind.ends_with("_HalfFloat");
    let tree = Tree::read(&mut at, compression, half)?;
    tree.volume(to_world)
}

/// The name without what makes it unique.
fn plain(name: &str) -> &str {
    name.split('\u{1e}').next().unwrap_or(name)
}

fn choose<'a>(entries: &'a [Entry], name: Option<&str>) -> Result<&'a Entry, String> {
    let readable = |e: &&Entry| matches!(e.kind.as_str(), "Tree_float_5_4_3" | "Tree_float_5_4_3_HalfFloat");
    let all = || {
        let list: Vec<String> =
            entries.iter().map(|e| format!("`{}` ({})", plain(&e.name), e.kind)).collect();
        if list.is_empty() { "it has no grid".to_owned() } else { format!("it has {}", list.join(", ")) }
    };
    let found: Vec<&Entry> = match name {
        Some(name) => entries.iter().filter(|e| plain(&e.name) == name).collect(),
        None => entries.iter().filter(readable).collect(),
    };
    match (&found[..], name) {
        ([entry], _) if !readable(entry) => Err(format!(
            "the grid `{}` is a {}: Tree_float_5_4_3 can be read",
            plain(&entry.name),
            entry.kind
        )),
        ([entry], _) if !entry.instance.is_empty() => {
            Err(format!("the grid `{}` shares the tree of another, which cannot be read", plain(&entry.name)))
        }
        ([entry], _) => Ok(entry),
        ([], Some(name)) => Err(format!("there is no grid `{name}` in the OpenVDB file: {}", all())),
        ([], None) => Err(format!("the OpenVDB file has no float grid: {}", all())),
        _ => Err(format!("the OpenVDB file has more than one float grid: say which by its name; {}", all())),
    }
}

fn metadata(at: &mut Bytes) -> Result<(), String> {
    for _ in 0..at.u32()? {
        at.string()?;
        at.string()?;
        let length = at.u32()?;
        at.take(length as usize)?;
    }
    Ok(())
}

/// From voxels' indices to the world.
fn transform(at: &mut Bytes) -> Result<DAffine3, String> {
    let kind = at.string()?;
    let vector = |at: &mut Bytes| Ok::<_, String>(DVec3::new(at.f64()?, at.f64()?, at.f64()?));
    match kind.as_str() {
        "ScaleMap" | "UniformScaleMap" => {
            let scale = vector(at)?;
            // What follows from it is stored, too.
            at.take(4 * 24)?;
            Ok(DAffine3::from_scale(scale))
        }
        "ScaleTranslateMap" | "UniformScaleTranslateMap" => {
            let (translation, scale) = (vector(at)?, vector(at)?);
            at.take(4 * 24)?;
            Ok(DAffine3 { matrix3: DMat3::from_diagonal(scale), translation })
        }
        "TranslationMap" => Ok(DAffine3::from_translation(vector(at)?)),
        "AffineMap" | "UnitaryMap" => {
            // Rows, by which row vectors are multiplied: the columns of what multiplies column vectors.
            let mut m = [[0.0; 4]; 4];
            for number in m.as_flattened_mut() {
                *number = at.f64()?;
            }
            let row = |i: usize| DVec3::new(m[i][0], m[i][1], m[i][2]);
            Ok(DAffine3 { matrix3: DMat3::from_cols(row(0), row(1), row(2)), translation: row(3) })
        }
        _ => {
            Err(format!("the OpenVDB grid has a {kind}, which cannot be read: its transform must be affine"))
        }
    }
}

/// Bits, one a value, as a node stores them.
struct Mask<'a>(&'a [u8]);

impl Mask<'_> {
    fn is_on(&self, i: usize) -> bool {
        self.0[i / 8] >> (i % 8) & 1 == 1
    }

    fn count(&self) -> usize {
        self.0.iter().map(|b| b.count_ones() as usize).sum()
    }

    fn ones(&self) -> impl Iterator<Item = usize> + '_ {
        (0..8 * self.0.len()).filter(|i| self.is_on(*i))
    }
}

/// How values of a grid are stored.
#[derive(Clone, Copy)]
struct Format {
    compression: u32,
    half: bool,
    background: f32,
}

/// A cube of voxels: all alike, or 8³ with values of their own.
enum Part {
    Tile { origin: IVec3, side: i32, value: f32 },
    Leaf { origin: IVec3, values: Vec<f32> },
}

struct Tree {
    parts: Vec<Part>,
}

/// Log₂ of the children along a side, from the root's children down, and of the voxels along the side of one of their
/// children.
const LEVELS: [(u32, u32); 2] = [(5, 7), (4, 3)];

impl Tree {
    fn read(at: &mut Bytes, compression: u32, half: bool) -> Result<Self, String> {
        if at.u32()? != 1 {
            return Err("the OpenVDB grid has more than one buffer, which cannot be read".into());
        }
        let background = at.f32()?;
        if background != 0.0 {
            return Err(format!(
                "the background of the OpenVDB grid is {background}: outside of a medium it must be 0"
            ));
        }
        let format = Format { compression, half, background };
        let (tiles, children) = (at.u32()?, at.u32()?);
        let mut parts = Vec::new();
        for _ in 0..tiles {
            let (origin, value, _active) = (coordinates(at)?, at.f32()?, at.u8()?);
            push_tile(&mut parts, origin, 1 << 12, value);
        }
        let mut leaves = Vec::new();
        for _ in 0..children {
            let origin = coordinates(at)?;
            Self::topology(at, format, origin, 0, &mut parts, &mut leaves)?;
        }
        for origin in leaves {
            let mask = Mask(at.take(64)?);
            parts.push(Part::Leaf { origin, values: values(at, format, 512, &mask)? });
        }
        Ok(Self { parts })
    }

    fn topology(
        at: &mut Bytes,
        format: Format,
        origin: IVec3,
        level: usize,
        parts: &mut Vec<Part>,
        leaves: &mut Vec<IVec3>,
    ) -> Result<(), String> {
        let Some((log, log_child)) = LEVELS.get(level).copied() else {
            at.take(64)?;
            leaves.push(origin);
            return Ok(());
        };
        let count = 1usize << (3 * log);
        let (children, active) = (Mask(at.take(count / 8)?), Mask(at.take(count / 8)?));
        let tiles = values(at, format, count, &active)?;
        let place = |i: usize| {
            let side = 1i32 << log;
            let i = i as i32;
            let steps = IVec3::new(i >> (2 * log), i >> log & (side - 1), i & (side - 1));
            origin.wrapping_add(steps << log_child as i32)
        };
        for (i, value) in tiles.iter().enumerate().filter(|(i, _)| !children.is_on(*i)) {
            push_tile(parts, place(i), 1 << log_child, *value);
        }
        for i in children.ones() {
            Self::topology(at, format, place(i), level + 1, parts, leaves)?;
        }
        Ok(())
    }

    /// The box of all that is not 0, from the least corner to beyond the greatest.
    fn bounds(&self) -> Option<(I64Vec3, I64Vec3)> {
        let mut bounds: Option<(I64Vec3, I64Vec3)> = None;
        let mut add = |low: I64Vec3, high: I64Vec3| {
            let (a, b) = bounds.unwrap_or((low, high));
            bounds = Some((a.min(low), b.max(high)));
        };
        for part in &self.parts {
            match part {
                Part::Tile { origin, side, .. } => {
                    add(origin.as_i64vec3(), origin.as_i64vec3() + i64::from(*side));
                }
                Part::Leaf { origin, values } => {
                    for (i, _) in values.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                        let at = origin.as_i64vec3() + in_leaf(i).as_i64vec3();
                        add(at, at + 1);
                    }
                }
            }
        }
        bounds
    }

    fn volume(&self, to_world: DAffine3) -> Result<Volume, String> {
        let Some((low, high)) = self.bounds() else {
            return Err("the OpenVDB grid is 0 everywhere".into());
        };
        // A layer of the background, so that the function falls to it as it does in OpenVDB.
        let (low, high) = (low - 1, high + 1);
        let size = high - low;
        let count = size.to_array().into_iter().try_fold(1i64, i64::checked_mul).filter(|n| *n <= MOST);
        let Some(count) = count else {
            return Err(format!("the OpenVDB grid is too large: its values are in {size} voxels"));
        };
        let mut numbers = vec![0.0f32; count as usize];
        let mut set = |p: I64Vec3, value: f32| {
            let p = p - low;
            numbers[((p.z * size.y + p.y) * size.x + p.x) as usize] = value;
        };
        for part in &self.parts {
            match part {
                Part::Tile { origin, side, value } => {
                    let side = i64::from(*side);
                    for i in 0..side * side * side {
                        let step = I64Vec3::new(i % side, i / side % side, i / side / side);
                        set(origin.as_i64vec3() + step, *value);
                    }
                }
                Part::Leaf { origin, values } => {
                    for (i, value) in values.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                        set(origin.as_i64vec3() + in_leaf(i).as_i64vec3(), *value);
                    }
                }
            }
        }
        // Values are at whole numbers, which are the middles of our voxels.
        let from_unit = to_world
            * DAffine3::from_translation(low.as_dvec3() - 0.5)
            * DAffine3::from_scale(size.as_dvec3());
        let column = |c: DVec3| c.as_vec3();
        let m = from_unit.matrix3;
        let matrix = glam::Mat3::from_cols(column(m.x_axis), column(m.y_axis), column(m.z_axis));
        Ok(Volume {
            size: UVec3::from_array(size.to_array().map(|n| n as u32)),
            channels: 1,
            numbers,
            from_unit: Some(Affine3A::from_mat3_translation(matrix, from_unit.translation.as_vec3())),
        })
    }
}

fn push_tile(parts: &mut Vec<Part>, origin: IVec3, side: i32, value: f32) {
    if value != 0.0 {
        parts.push(Part::Tile { origin, side, value });
    }
}

/// The place of value i of a leaf: z runs fastest.
fn in_leaf(i: usize) -> IVec3 {
    let i = i as i32;
    IVec3::new(i >> 6, i >> 3 & 7, i & 7)
}

fn coordinates(at: &mut Bytes) -> Result<IVec3, String> {
    Ok(IVec3::new(at.i32()?, at.i32()?, at.i32()?))
}

/// The values of a node, of which those that are not `active` may be left out.
fn values(at: &mut Bytes, format: Format, count: usize, active: &Mask) -> Result<Vec<f32>, String> {
    let kind = at.u8()?;
    if kind > 6 {
        return Err(format!("the OpenVDB grid is damaged: a node's values are of the kind {kind}"));
    }
    // Two values that inactive voxels may have, and which has which.
    let mut inactive = [if kind == 0 { format.background } else { -format.background }, format.background];
    if matches!(kind, 2 | 4 | 5) {
        inactive[0] = at.f32()?;
    }
    if kind == 5 {
        inactive[1] = at.f32()?;
    }
    let second = if matches!(kind, 3..=5) { Some(Mask(at.take(count / 8)?)) } else { None };
    let masked = format.compression & ACTIVE_MASK != 0 && kind != 6;
    let stored = if masked { active.count() } else { count };
    let mut read = numbers(at, format, stored)?.into_iter();
    if !masked {
        return Ok(read.collect());
    }
    let mut next = || read.next().ok_or("the OpenVDB grid is damaged: values are missing".to_owned());
    (0..count)
        .map(|i| {
            if active.is_on(i) {
                next()
            } else {
                Ok(inactive[usize::from(second.as_ref().is_some_and(|m| m.is_on(i)))])
            }
        })
        .collect()
}

fn numbers(at: &mut Bytes, format: Format, count: usize) -> Result<Vec<f32>, String> {
    let length = count * if format.half { 2 } else { 4 };
    // Of no half floats nothing at all is stored, not even that they are none.
    let bytes = if format.compression & (BLOSC | ZIP) == 0 || (format.half && count == 0) {
        at.take(length)?.to_vec()
    } else {
        let packed = at.u64()? as i64;
        if packed <= 0 {
            // Stored as it is where packing does not pay.
            at.take(usize::try_from(-packed).map_err(|_| "the OpenVDB grid is damaged")?)?.to_vec()
        } else {
            let packed = at.take(packed as usize)?;
            if format.compression & BLOSC != 0 { unblosc(packed, length)? } else { unzip(packed, length)? }
        }
    };
    if bytes.len() != length {
        return Err(format!(
            "the OpenVDB grid is damaged: {} bytes of values instead of {length}",
            bytes.len()
        ));
    }
    Ok(if format.half {
        bytes.as_chunks().0.iter().map(|b| half::f16::from_le_bytes(*b).to_f32()).collect()
    } else {
        bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
    })
}

fn unzip(packed: &[u8], length: usize) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(length);
    flate2::read::ZlibDecoder::new(packed)
        .take(length as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| format!("the OpenVDB grid is damaged: {e}"))?;
    Ok(bytes)
}

/// A Blosc chunk, version 1: a header of 16 bytes, where the blocks begin, and blocks of one or more streams.
fn unblosc(packed: &[u8], length: usize) -> Result<Vec<u8>, String> {
    const SHUFFLE: u8 = 1;
    const STORED: u8 = 2;
    const BITS: u8 = 4;
    const WHOLE: u8 = 16;
    let damaged = || "the OpenVDB grid is damaged: a Blosc chunk is".to_owned();
    let mut at = Bytes::new(packed);
    let [_version, _codec_version, flags, type_size] = at.array()?;
    let (bytes, block, _packed) = (at.u32()? as usize, at.u32()? as usize, at.u32()?);
    if bytes != length || block == 0 {
        return Err(damaged());
    }
    if flags & STORED != 0 {
        return Ok(at.take(length)?.to_vec());
    }
    if flags >> 5 != 1 || flags & BITS != 0 {
        return Err(
            "the OpenVDB grid is packed by Blosc with another codec than LZ4, which cannot be read".into()
        );
    }
    let type_size = usize::from(type_size.max(1));
    let blocks = length.div_ceil(block);
    let starts: Vec<usize> = (0..blocks).map(|_| at.u32().map(|s| s as usize)).collect::<Result<_, _>>()?;
    let mut all = Vec::with_capacity(length);
    for (i, start) in starts.into_iter().enumerate() {
        let size = block.min(length - i * block);
        let leftover = size < block;
        // Blocks are split into streams of the bytes of the same significance, unless they are too short for that.
        let split = flags & WHOLE == 0 && !leftover && type_size <= 16 && size / type_size >= 128;
        let streams = if split { type_size } else { 1 };
        let mut at = Bytes::after(packed, start as u64)?;
        let mut unpacked = Vec::with_capacity(size);
        for _ in 0..streams {
            let length = at.u32()? as usize;
            let stream = at.take(length)?;
            let whole = size / streams;
            if stream.len() == whole {
                unpacked.extend_from_slice(stream);
            } else {
                let unpacked_stream = lz4_flex::block::decompress(stream, whole).map_err(|_| damaged())?;
                unpacked.extend_from_slice(&unpacked_stream);
            }
        }
        if unpacked.len() != size {
            return Err(damaged());
        }
        if flags & SHUFFLE != 0 && type_size > 1 {
            all.extend(unshuffled(&unpacked, type_size));
        } else {
            all.append(&mut unpacked);
        }
    }
    Ok(all)
}

/// Bytes that were sorted by their significance, put back together; those of a part of a value at the end stay.
fn unshuffled(bytes: &[u8], type_size: usize) -> impl Iterator<Item = u8> + '_ {
    let n = bytes.len() / type_size;
    let whole = (0..n * type_size).map(move |i| bytes[i % type_size * n + i / type_size]);
    whole.chain(bytes[n * type_size..].iter().copied())
}
