use super::*;
use proptest::prelude::*;

fn noisy(width: usize, height: usize) -> Image {
    let value = |i: usize| ((i as u32).wrapping_mul(2_654_435_769) >> 8) as f32 / 1e5 - 20.0;
    Image::from_fn(width, height, |x, y| [0, 1, 2].map(|c| value(3 * (y * width + x) + c)))
}

fn sample() -> LayeredImage {
    let mut image = LayeredImage::new(noisy(19, 35));
    image.origin = [5, 7];
    image.full_size = [64, 48];
    image.push("weighted.s1", Image::from_fn(19, 35, |x, _| [x as f32, f32::MIN_POSITIVE, f32::MAX]));
    image.push("aaa", Image::from_fn(19, 35, |_, y| [-0.0, y as f32, f32::INFINITY]));
    image.metadata = vec![("a.settings".to_owned(), "x = 1\ny = \"é\"\n".to_owned())];
    image.metadata.push(("comments".to_owned(), "none".to_owned()));
    image
}

fn bits(image: &Image) -> Vec<[u32; 3]> {
    image.pixels.iter().map(|p| p.map(f32::to_bits)).collect()
}

#[test]
fn what_is_written_is_read_bit_for_bit() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    let image = sample();
    write(&path, &image).unwrap();
    let back = read_layers(&path).unwrap();
    assert_eq!((back.width, back.height, back.origin, back.full_size), (19, 35, [5, 7], [64, 48]));
    assert_eq!(back.metadata, image.metadata);
    assert_eq!(back.text("comments"), Some("none"));
    assert_eq!(back.layers.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["", "aaa", "weighted.s1"]);
    for layer in &image.layers {
        assert_eq!(bits(back.layer(&layer.name).unwrap()), bits(&layer.image), "{}", layer.name);
    }
    assert_eq!(bits(&read_rgb(&path).unwrap()), bits(&image.layers[0].image));
}

/// The channels of the largest samples say what they are; files of before, where they are R, G and B, are read as well.
#[test]
fn a_text_is_read_without_the_pixels() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let image = sample();
    write(&path, &image).unwrap();
    let (name, text) = image.metadata[0].clone();
    assert_eq!(read_text(&path, &name), Some(text.clone()));
    assert_eq!(read_text(&path, "nothing.of.the.kind"), None);
    // What is cut short behind the header has it still.
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() - 16]).unwrap();
    assert_eq!(read_text(&path, &name), Some(text));
    for kept in [0, 3, 100] {
        std::fs::write(&path, &bytes[..kept]).unwrap();
        assert_eq!(read_text(&path, &name), None, "{kept} bytes");
    }
    assert_eq!(read_text(dir.path().join("b.exr"), &name), None);
}

#[test]
fn outliers_are_read_by_both_their_names() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    let mut image = sample();
    image.push(OUTLIERS, noisy(19, 35));
    write(&path, &image).unwrap();
    assert_eq!(read_layers(&path).unwrap().layer(OUTLIERS), Some(&noisy(19, 35)));
    let channels = decode(&std::fs::read(&path).unwrap()).unwrap().channels;
    let own: Vec<&str> = channels.iter().filter_map(|c| c.strip_prefix("outliers.")).collect();
    assert_eq!(own, ["iteration", "luminance", "share"]);
    // As `colours`, whose name is as long, with the name put in its place.
    image.layers.retain(|l| l.name != OUTLIERS);
    image.push("colours_", noisy(19, 35));
    write(&path, &image).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let mut old = bytes.clone();
    for i in 0..bytes.len() - 8 {
        if &bytes[i..i + 8] == b"colours_" {
            old[i..i + 8].copy_from_slice(b"outliers");
        }
    }
    std::fs::write(&path, old).unwrap();
    let back = decode(&std::fs::read(&path).unwrap()).unwrap();
    assert!(back.channels.iter().any(|c| c == "outliers.R"));
    assert_eq!(read_layers(&path).unwrap().layer(OUTLIERS), Some(&noisy(19, 35)));
}

#[test]
fn every_compression_we_might_use_is_lossless() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    for compression in [Compression::Uncompressed, Compression::ZIP1, Compression::ZIP16, Compression::PIZ] {
        write_compressed(&path, &sample(), compression).unwrap();
        assert_eq!(bits(&read_rgb(&path).unwrap()), bits(&sample().layers[0].image), "{compression:?}");
    }
}

#[test]
fn a_black_image_is_not_taken_for_a_false_claim() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    let mut image = LayeredImage::new(Image::new(1024, 512));
    image.push("a", Image::new(1024, 512));
    for compression in [Compression::ZIP16, Compression::PIZ, Compression::RLE] {
        write_compressed(&path, &image, compression).unwrap();
        assert_eq!(read_layers(&path).unwrap().layers.len(), 2, "{compression:?}");
    }
}

fn write_channels(path: &Path, channels: Vec<(&str, FlatSamples)>) {
    let list = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
    let encoding = Encoding::FAST_LOSSLESS;
    let part = Part::new((2, 1), LayerAttributes::default(), encoding, AnyChannels::sort(list));
    exr::image::Image::from_layer(part).write().to_file(path).unwrap();
}

#[test]
fn half_floats_and_integers_are_read() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    let half = |v: f32| exr::prelude::f16::from_f32(v);
    write_channels(
        &path,
        vec![
            ("R", FlatSamples::F16(vec![half(0.5), half(1024.0)])),
            ("G", FlatSamples::U32(vec![7, 9])),
            ("B", FlatSamples::F32(vec![0.1, -2.0])),
            ("A", FlatSamples::F32(vec![1.0, 1.0])),
        ],
    );
    assert_eq!(read_rgb(&path).unwrap().pixels, vec![[0.5, 7.0, 0.1], [1024.0, 9.0, -2.0]]);
}

#[test]
fn a_file_without_rgb_says_what_it_has() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("depth.exr");
    let samples = || FlatSamples::F32(vec![0.0, 1.0]);
    write_channels(&path, vec![("Z", samples()), ("R", samples()), ("x.G", samples())]);
    for message in [read_rgb(&path).unwrap_err().to_string(), read_layers(&path).unwrap_err().to_string()] {
        assert!(message.contains("depth.exr") && message.contains("R, Z, x.G"), "{message}");
    }
}

#[test]
fn parts_are_layers_by_their_names() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("parts.exr");
    let part = |name: &str, prefix: &str, value: f32| {
        let channel = |c| AnyChannel::new(format!("{prefix}{c}").as_str(), FlatSamples::F32(vec![value; 2]));
        let channels = AnyChannels::sort(["R", "G", "B"].into_iter().map(channel).collect());
        Part::new((2, 1), LayerAttributes::named(name), Encoding::FAST_LOSSLESS, channels)
    };
    let attributes = ImageAttributes::with_size((2, 1));
    let parts = [part("beauty", "", 1.0), part("direct", "", 2.0), part("other", "deep.", 3.0)];
    let file: FlatImage = exr::image::Image { attributes, layer_data: parts.into_iter().collect() };
    file.write().to_file(&path).unwrap();
    // The first part with plain channels is what other tools show.
    assert_eq!(read_rgb(&path).unwrap().pixels, vec![[1.0; 3]; 2]);
    let layers = read_layers(&path).unwrap();
    assert_eq!(layers.layer("direct").unwrap().pixels[0], [2.0; 3]);
    assert_eq!(layers.layer("deep").unwrap().pixels[0], [3.0; 3]);
}

#[test]
fn bad_files_end_in_one_message() {
    let directory = tempfile::tempdir().unwrap();
    let missing = read_rgb(directory.path().join("no.exr")).unwrap_err().to_string();
    assert!(missing.contains("no.exr") && missing.contains("there is no such file"), "{missing}");
    let path = directory.path().join("a.exr");
    std::fs::write(&path, b"\x89PNG\r\n").unwrap();
    assert!(read_rgb(&path).unwrap_err().to_string().contains("not an EXR"));
    write(&path, &sample()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() - 10]).unwrap();
    let message = read_rgb(&path).unwrap_err().to_string();
    assert!(message.contains("a.exr") && message.contains("cut short"), "{message}");
}

#[test]
fn what_cannot_be_written_leaves_no_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    let refused = |change: &dyn Fn(&mut LayeredImage), word: &str| {
        let mut image = sample();
        change(&mut image);
        let message = write(&path, &image).unwrap_err().to_string();
        assert!(message.contains("a.exr") && message.contains(word), "{message}");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0, "{word}");
    };
    refused(&|i| i.push("é", noisy(19, 35)), "ASCII");
    refused(&|i| i.push("aaa", noisy(19, 35)), "two layers");
    refused(&|i| i.push("", noisy(19, 35)), "two layers");
    refused(&|i| i.push("b", noisy(18, 35)), "18x35");
    refused(&|i| i.layers.clear(), "at least one");
    refused(&|i| i.metadata.push(("dataWindow".to_owned(), String::new())), "dataWindow");
    refused(&|i| i.metadata.push(("comments".to_owned(), String::new())), "two metadata");
    refused(&|i| i.metadata.push(("a b".to_owned(), String::new())), "a b");
    let message = write(directory.path().join("no/a.exr"), &sample()).unwrap_err().to_string();
    assert!(message.contains("no/a.exr"), "{message}");
}

#[test]
fn a_false_claim_of_size_takes_no_memory() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    write(&path, &LayeredImage::new(noisy(4, 4))).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
    for corner in [8, 12] {
        bytes[at + corner..at + corner + 4].copy_from_slice(&100_000i32.to_le_bytes());
    }
    let message = decode(&bytes).err().unwrap();
    assert!(message.contains("claims"), "{message}");
}

fn encoded(compression: Compression) -> Vec<u8> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    write_compressed(&path, &sample(), compression).unwrap();
    std::fs::read(&path).unwrap()
}

proptest! {
    #![proptest_config(crate::math::testing::fuzz(300))]

    #[test]
    fn mutated_files_never_panic(
        piz: bool,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), any::<bool>()), 1..6),
        keep in any::<prop::sample::Index>(),
        cut: bool,
    ) {
        let mut bytes = encoded(if piz { Compression::PIZ } else { Compression::ZIP16 });
        for (index, value, in_header) in changes {
            // Half of the changes hit the header, where lengths and types are.
            let range = if in_header { 600 } else { bytes.len() };
            bytes[index.index(range)] = value;
        }
        if cut {
            bytes.truncate(keep.index(bytes.len()));
        }
        let whole = decode(&bytes);
        prop_assert!(!cut || whole.is_err(), "a file cut short was read");
    }
}
