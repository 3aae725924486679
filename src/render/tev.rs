//! Streams an image and its layers to the viewer tev while it renders, by tev's own protocol over TCP.
//!
//! A packet is its length in bytes (u32, with these four), a type (u8) and what belongs to it; numbers are little-endian, texts
//! end in a zero byte, flags are a byte:
//!
//! | type | packet | content |
//! |---|---|---|
//! | 4 | create an image | whether it takes the focus, its name, width, height, number of channels, their names |
//! | 5 | update a part | likewise focus and name, number of channels, their names, x, y, width, height, pixels channel by channel (f32) |
//!
//! A thread of its own connects, compares with what it sent before, and sends the tiles that changed. What the render gives while the
//! thread is busy is dropped, so that a viewer that hangs never holds a render up: connecting and sending have a time-out, and after an
//! error the whole image is sent over a new connection.

use crate::film::Image;
use std::io::Write;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Where tev listens unless told otherwise.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:14158";
/// Pixels along the side of a tile.
const TILE: usize = 64;
/// For connecting, and for each packet.
const TIMEOUT: Duration = Duration::from_secs(2);

/// An image with its layers, by name; the first one, whose name is empty, is the image.
struct Frame {
    name: String,
    layers: Vec<(String, Image)>,
}

/// A stream to a viewer.
pub struct Tev {
    frames: Option<SyncSender<Frame>>,
    thread: Option<JoinHandle<()>>,
}

impl Tev {
    /// To the viewer at `HOST:PORT`; it may come later.
    pub fn new(address: &str) -> Self {
        let (frames, received) = sync_channel(1);
        let address = address.to_owned();
        let thread = std::thread::spawn(move || send_all(&address, &received));
        Self { frames: Some(frames), thread: Some(thread) }
    }

    /// Gives the image as it is now. False, and nothing happens, where the last one is still being sent.
    pub fn show(&self, name: &str, layers: Vec<(String, Image)>) -> bool {
        let frame = Frame { name: name.to_owned(), layers };
        self.frames.as_ref().is_some_and(|frames| frames.try_send(frame).is_ok())
    }

    /// The same for an image that is the last: it waits its turn.
    pub fn finish(&self, name: &str, layers: Vec<(String, Image)>) {
        if let Some(frames) = &self.frames {
            // The thread ends with the stream alone, so that the send cannot fail; were it gone, nothing would be lost.
            let _ = frames.send(Frame { name: name.to_owned(), layers });
        }
    }
}

impl Drop for Tev {
    /// Waits until the last image is sent, which the time-outs bound.
    fn drop(&mut self) {
        drop(self.frames.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Sends what comes; what cannot be sent is forgotten, and the next image is sent whole.
fn send_all(address: &str, frames: &Receiver<Frame>) {
    let mut connection: Option<(TcpStream, Option<Frame>)> = None;
    while let Ok(frame) = frames.recv() {
        if connection.is_none() {
            connection = connect(address).map(|stream| (stream, None));
        }
        let Some((stream, sent)) = &mut connection else { continue };
        match send(stream, sent.as_ref(), &frame) {
            Ok(()) => *sent = Some(frame),
            Err(_) => connection = None,
        }
    }
}

fn connect(address: &str) -> Option<TcpStream> {
    let stream =
        address.to_socket_addrs().ok()?.find_map(|a| TcpStream::connect_timeout(&a, TIMEOUT).ok())?;
    stream.set_write_timeout(Some(TIMEOUT)).ok()?;
    Some(stream)
}

/// Names of a layer's channels.
fn channels(layer: &str) -> [String; 3] {
    ["R", "G", "B"].map(|c| if layer.is_empty() { c.to_owned() } else { format!("{layer}.{c}") })
}

fn send(stream: &mut TcpStream, sent: Option<&Frame>, frame: &Frame) -> std::io::Result<()> {
    let Some((_, first)) = frame.layers.first() else { return Ok(()) };
    let shape = |f: &Frame| -> Vec<(String, usize, usize)> {
        f.layers.iter().map(|(name, image)| (name.clone(), image.width, image.height)).collect()
    };
    let before = sent.filter(|s| s.name == frame.name && shape(s) == shape(frame));
    if before.is_none() {
        let names: Vec<String> = frame.layers.iter().flat_map(|(layer, _)| channels(layer)).collect();
        let mut packet = Packet::new(4, &frame.name);
        packet.number(first.width).number(first.height).number(names.len());
        names.iter().for_each(|name| packet.text(name));
        stream.write_all(&packet.finish())?;
    }
    for (i, (layer, image)) in frame.layers.iter().enumerate() {
        let old = before.map(|b| &b.layers[i].1);
        for y in (0..image.height).step_by(TILE) {
            for x in (0..image.width).step_by(TILE) {
                let size = [TILE.min(image.width - x), TILE.min(image.height - y)];
                if old.is_none_or(|old| differs(old, image, [x, y], size)) {
                    stream.write_all(&tile(&frame.name, layer, image, [x, y], size))?;
                }
            }
        }
    }
    stream.flush()
}

/// The rows of a tile.
fn rows(image: &Image, [x, y]: [usize; 2], [width, height]: [usize; 2]) -> impl Iterator<Item = &[[f32; 3]]> {
    (y..y + height).map(move |row| &image.pixels[row * image.width + x..][..width])
}

fn differs(a: &Image, b: &Image, at: [usize; 2], size: [usize; 2]) -> bool {
    // By bits: NaN differs from itself, and would be sent for ever.
    let bits = |row: &[[f32; 3]]| row.iter().flatten().map(|v| v.to_bits()).collect::<Vec<u32>>();
    rows(a, at, size).zip(rows(b, at, size)).any(|(a, b)| bits(a) != bits(b))
}

fn tile(name: &str, layer: &str, image: &Image, at: [usize; 2], size: [usize; 2]) -> Vec<u8> {
    let mut packet = Packet::new(5, name);
    packet.number(3);
    channels(layer).iter().for_each(|channel| packet.text(channel));
    at.iter().chain(&size).for_each(|v| {
        packet.number(*v);
    });
    for c in 0..3 {
        for pixel in rows(image, at, size).flatten() {
            packet.0.extend_from_slice(&pixel[c].to_le_bytes());
        }
    }
    packet.finish()
}

/// A packet being written.
struct Packet(Vec<u8>);

impl Packet {
    /// Of this type, about an image that does not take the focus.
    fn new(kind: u8, name: &str) -> Self {
        let mut packet = Self(vec![0, 0, 0, 0, kind, 0]);
        packet.text(name);
        packet
    }

    fn number(&mut self, value: usize) -> &mut Self {
        self.0.extend_from_slice(&(value as i32).to_le_bytes());
        self
    }

    fn text(&mut self, text: &str) {
        self.0.extend(text.bytes().filter(|b| *b != 0));
        self.0.push(0);
    }

    fn finish(mut self) -> Vec<u8> {
        let length = (self.0.len() as u32).to_le_bytes();
        self.0[..4].copy_from_slice(&length);
        self.0
    }
}

#[cfg(test)]
#[path = "tev_tests.rs"]
mod tests;
