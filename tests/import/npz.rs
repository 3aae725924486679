//! Arrays of single precision in NumPy's `.npz`: an archive of deflated `.npy` files.

use std::io::Read;

fn u16_at(bytes: &[u8], at: usize) -> usize {
    usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]))
}

fn u32_at(bytes: &[u8], at: usize) -> usize {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]) as usize
}

/// The array of that name, its numbers in order.
pub fn array(archive: &[u8], name: &str) -> Vec<f64> {
    let npy = file(archive, &format!("{name}.npy"));
    assert_eq!(&npy[..6], b"\x93NUMPY");
    let header = String::from_utf8_lossy(&npy[10..10 + u16_at(&npy, 8)]);
    assert!(header.contains("'fortran_order': False"), "{header}");
    let data = &npy[10 + u16_at(&npy, 8)..];
    if header.contains("'<f4'") {
        return data
            .chunks_exact(4)
            .map(|b| f64::from(f32::from_le_bytes(b.try_into().expect("four"))))
            .collect();
    }
    assert!(header.contains("'<f8'"), "{header}");
    data.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight"))).collect()
}

/// A file of an archive, by its directory at the end.
fn file(archive: &[u8], name: &str) -> Vec<u8> {
    let end = (0..archive.len() - 21)
        .rev()
        .find(|i| archive[*i..].starts_with(b"PK\x05\x06"))
        .expect("a directory");
    let mut at = u32_at(archive, end + 16);
    while archive[at..].starts_with(b"PK\x01\x02") {
        let (named, extra, comment) =
            (u16_at(archive, at + 28), u16_at(archive, at + 30), u16_at(archive, at + 32));
        if &archive[at + 46..at + 46 + named] == name.as_bytes() {
            let (method, packed, local) =
                (u16_at(archive, at + 10), u32_at(archive, at + 20), u32_at(archive, at + 42));
            let start = local + 30 + u16_at(archive, local + 26) + u16_at(archive, local + 28);
            let data = &archive[start..start + packed];
            if method == 0 {
                return data.to_vec();
            }
            let mut unpacked = Vec::new();
            flate2::read::DeflateDecoder::new(data).read_to_end(&mut unpacked).expect("deflated data");
            return unpacked;
        }
        at += 46 + named + extra + comment;
    }
    panic!("no {name} in the archive");
}
