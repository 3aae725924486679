//! A small server that understands the packets, as the protocol describes them.

use super::*;
use std::collections::HashMap;
use std::io::Read;
use std::net::TcpListener;
use std::time::Instant;

/// What a viewer knows after some packets.
#[derive(Default)]
struct Shown {
    size: [i32; 2],
    channels: HashMap<String, Vec<f32>>,
    creates: usize,
    updates: usize,
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn byte(&mut self) -> u8 {
        let (first, rest) = self.0.split_first().expect("a byte");
        self.0 = rest;
        *first
    }
    fn word(&mut self) -> [u8; 4] {
        [0; 4].map(|_| self.byte())
    }
    fn number(&mut self) -> i32 {
        i32::from_le_bytes(self.word())
    }
    fn text(&mut self) -> String {
        let mut bytes = Vec::new();
        loop {
            match self.byte() {
                0 => return String::from_utf8(bytes).expect("a text"),
                b => bytes.push(b),
            }
        }
    }
}

/// Takes in one packet; false at the end of the connection.
fn take(stream: &mut TcpStream, shown: &mut HashMap<String, Shown>) -> bool {
    let mut length = [0; 4];
    if stream.read_exact(&mut length).is_err() {
        return false;
    }
    let mut bytes = vec![0; u32::from_le_bytes(length) as usize - 4];
    stream.read_exact(&mut bytes).expect("a whole packet");
    let mut reader = Reader(&bytes);
    let (kind, focus, name) = (reader.byte(), reader.byte(), reader.text());
    assert_eq!(focus, 0);
    let image = shown.entry(name).or_default();
    match kind {
        4 => {
            image.size = [reader.number(), reader.number()];
            image.creates += 1;
            for _ in 0..reader.number() {
                let pixels = vec![f32::NAN; (image.size[0] * image.size[1]) as usize];
                image.channels.insert(reader.text(), pixels);
            }
        }
        5 => {
            image.updates += 1;
            let names: Vec<String> = (0..reader.number()).map(|_| reader.text()).collect();
            let [x, y, width, height] = [0; 4].map(|_| reader.number());
            assert!(x >= 0 && y >= 0 && x + width <= image.size[0] && y + height <= image.size[1]);
            for name in names {
                let channel = image.channels.get_mut(&name).expect("a channel that was created");
                for row in y..y + height {
                    for column in x..x + width {
                        channel[(row * image.size[0] + column) as usize] = f32::from_le_bytes(reader.word());
                    }
                }
            }
        }
        other => panic!("packet of type {other}"),
    }
    assert!(reader.0.is_empty(), "nothing is left of it");
    true
}

fn layers(value: f32) -> Vec<(String, Image)> {
    let image = |f: f32| Image::from_fn(150, 100, |x, y| [f, x as f32, y as f32]);
    let mut first = image(1.0);
    // One tile of six changes.
    first.pixels[70 * 150 + 140][0] = value;
    vec![(String::new(), first), ("weighted.nee".into(), image(0.5))]
}

#[test]
fn a_server_gets_the_image_and_then_what_changes() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let tev = Tev::new(&listener.local_addr().unwrap().to_string());
    tev.finish("small", layers(2.0));
    let (mut stream, _) = listener.accept().unwrap();
    let mut shown = HashMap::new();
    (0..1 + 12).for_each(|_| assert!(take(&mut stream, &mut shown)));
    let at = |shown: &HashMap<String, Shown>, channel: &str, i: usize| shown["small"].channels[channel][i];
    assert_eq!((shown["small"].size, shown["small"].channels.len()), ([150, 100], 6));
    assert_eq!((shown["small"].creates, shown["small"].updates), (1, 12), "six tiles a layer");
    let place = 70 * 150 + 140;
    let all = ["R", "G", "weighted.nee.B"].map(|c| at(&shown, c, place));
    assert_eq!(all, [2.0, 140.0, 70.0]);
    tev.finish("small", layers(f32::NAN));
    assert!(take(&mut stream, &mut shown));
    assert!(at(&shown, "R", place).is_nan() && shown["small"].updates == 13, "one tile");
    // Nothing new, then something: NaN is not sent again.
    tev.finish("small", layers(f32::NAN));
    tev.finish("small", layers(3.0));
    assert!(take(&mut stream, &mut shown));
    assert_eq!((at(&shown, "R", place), shown["small"].updates), (3.0, 14));
    // The viewer goes away and comes back: all of it is sent again.
    drop(stream);
    let start = Instant::now();
    listener.set_nonblocking(true).unwrap();
    let mut value = 4.0;
    let mut again = loop {
        assert!(start.elapsed() < Duration::from_secs(20), "no new connection");
        tev.finish("small", layers(value));
        value += 1.0;
        if let Ok((stream, _)) = listener.accept() {
            break stream;
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    again.set_nonblocking(false).unwrap();
    let mut shown = HashMap::new();
    (0..1 + 12).for_each(|_| assert!(take(&mut again, &mut shown)));
    assert_eq!((shown["small"].creates, at(&shown, "G", place)), (1, 140.0));
    drop(tev);
    while take(&mut again, &mut shown) {}
}

/// A viewer that accepts and never reads, and none at all: the render goes on.
#[test]
fn nobody_is_waited_for() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let hung = Tev::new(&listener.local_addr().unwrap().to_string());
    let nobody = Tev::new("127.0.0.1:1");
    let large = || vec![(String::new(), Image::new(2000, 2000))];
    let start = Instant::now();
    let mut dropped = 0;
    for _ in 0..6 {
        dropped += usize::from(!hung.show("large", large()));
        nobody.show("large", large());
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(dropped > 0, "48 MB do not fit into what the system buffers");
    assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
    drop((hung, nobody));
    assert!(start.elapsed() < Duration::from_secs(15), "time-outs bound the end: {:?}", start.elapsed());
}
