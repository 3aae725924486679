//! Textures: interpolation, orientation, files read and files refused.

use super::*;
use crate::math::{Stream, StreamKind};
use std::path::{Path, PathBuf};

/// 3×2 texels, all different; the upper row first.
fn small(wrap: Wrap) -> ImageTexture {
    let texels = (0..6).map(|i| [i as f32, 0.1 * i as f32, 1.0]).collect();
    ImageTexture::new(3, 2, texels, wrap).unwrap()
}

fn centre(x: u32, y: u32) -> Vec2 {
    Vec2::new((x as f32 + 0.5) / 3.0, 1.0 - (y as f32 + 0.5) / 2.0)
}

#[test]
fn texel_centres_have_the_texels_colours_and_v_points_up() {
    for wrap in [Wrap::Repeat, Wrap::Clamp] {
        let image = small(wrap);
        for y in 0..2 {
            for x in 0..3 {
                assert!((image.eval(centre(x, y)) - image.texel(x, y)).length() < 1e-5, "{x} {y}");
            }
        }
        // v near 0 is the last row.
        assert!((image.eval(Vec2::new(0.5, 0.25)).x - 4.0).abs() < 1e-5);
        assert!((image.eval(Vec2::new(0.5, 0.75)).x - 1.0).abs() < 1e-5);
        let between = 0.5 * (centre(0, 0) + centre(1, 1));
        assert!((image.eval(between).x - (0.0 + 1.0 + 3.0 + 4.0) / 4.0).abs() < 1e-5);
    }
}

#[test]
fn outside_repeats_or_clamps() {
    let (repeat, clamp) = (small(Wrap::Repeat), small(Wrap::Clamp));
    let mut s = Stream::new(1, 0, StreamKind::Other, 0);
    for _ in 0..1000 {
        let uv = s.next_2d();
        let far = uv + Vec2::new(3.0, -2.0);
        assert!((repeat.eval(uv) - repeat.eval(far)).length() < 1e-4);
        let nearest = (far - Vec2::new(2.0, 0.0)).clamp(Vec2::ZERO, Vec2::ONE);
        assert!((clamp.eval(far - Vec2::new(2.0, 0.0)) - clamp.eval(nearest)).length() < 1e-5);
    }
    // The edge: half of each neighbour round the corner, or the edge's own.
    assert!((repeat.eval(Vec2::new(0.0, 0.75)).x - 1.0).abs() < 1e-5, "texels 0 and 2 of the upper row");
    assert!((clamp.eval(Vec2::new(0.0, 0.75)).x).abs() < 1e-5);
    assert!((clamp.eval(Vec2::new(9.0, -9.0)).x - 5.0).abs() < 1e-5);
}

#[test]
fn no_coordinate_leads_out_of_the_image() {
    for image in [small(Wrap::Repeat), small(Wrap::Clamp)] {
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30, -1e-10, 1.0, 0.0, 0.999_999_94];
        for u in odd {
            for v in odd {
                let c = image.eval(Vec2::new(u, v));
                assert!(c.is_finite() && c.x >= 0.0 && c.x <= 5.0, "{u} {v}: {c}");
            }
        }
    }
}

#[test]
fn averages_and_bounds_are_those_of_the_texels() {
    let image = Texture::image(small(Wrap::Repeat));
    assert!((image.average() - Rgb::new(2.5, 0.25, 1.0)).length() < 1e-6);
    assert_eq!((image.min(), image.max()), (Rgb::new(0.0, 0.0, 1.0), Rgb::new(5.0, 0.5, 1.0)));
    // The mean over (u, v) of what eval says: bilinear interpolation keeps it.
    let mut sum = Rgb::ZERO;
    for i in 0..300 {
        for j in 0..200 {
            sum += image.eval(Vec2::new((i as f32 + 0.5) / 300.0, (j as f32 + 0.5) / 200.0));
        }
    }
    assert!((sum / 60_000.0 - image.average()).length() < 1e-3);
    assert!(image.check_reflectance("reflectance").unwrap_err().contains("found 5"));
    let checker =
        Texture::checker(Rgb::ZERO, Rgb::ONE, Vec2::new(2.0, 4.0), glam::Affine2::IDENTITY).unwrap();
    assert_eq!((checker.average(), checker.min(), checker.max()), (Rgb::splat(0.5), Rgb::ZERO, Rgb::ONE));
    assert!(!checker.is_black() && Texture::grey(0.0).is_black());
}

#[test]
fn checkers_alternate_on_both_sides_of_the_origin() {
    let checker =
        Texture::checker(Rgb::ZERO, Rgb::ONE, Vec2::new(2.0, 4.0), glam::Affine2::IDENTITY).unwrap();
    for (u, v, odd) in [(0.1, 0.1, 0.0), (0.6, 0.1, 1.0), (0.1, 0.3, 1.0), (0.6, 0.3, 0.0), (-0.1, 0.1, 1.0)]
    {
        assert_eq!(checker.eval(Vec2::new(u, v)).x, odd, "{u} {v}");
    }
    assert_eq!(checker.eval(Vec2::new(-0.1, -0.1)).x, 0.0);
    assert!(checker.eval(Vec2::new(f32::NAN, 1e38)).is_finite());
}

#[test]
fn the_srgb_curve_is_inverted() {
    for (encoded, linear) in
        [(0.0, 0.0), (1.0, 1.0), (0.5, 0.214_041), (0.040_45, 0.003_130_8), (0.02, 0.001_548)]
    {
        assert!((load::srgb_to_linear(encoded) - linear).abs() < 1e-6, "{encoded}");
    }
}

fn write_png(path: &Path, depth: png::BitDepth, color: png::ColorType, data: &[u8]) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), 2, 1);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(data).unwrap();
}

#[test]
fn png_files_of_8_and_16_bits_are_decoded() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    use png::{BitDepth::*, ColorType::*};
    write_png(&at("rgb8.png"), Eight, Rgb, &[0, 128, 255, 10, 20, 30]);
    let raw = load::read(&at("rgb8.png"), Encoding::Linear).unwrap();
    assert_eq!((raw.width, raw.height), (2, 1));
    assert!((raw.texels[0][1] - 128.0 / 255.0).abs() < 1e-6);
    let colour = load::read(&at("rgb8.png"), Encoding::Srgb).unwrap();
    assert_eq!((colour.texels[0][0], colour.texels[0][2]), (0.0, 1.0));
    assert!((colour.texels[0][1] - 0.215_861).abs() < 1e-5);
    // 0x8000 and 0x8001: more than 8 bits are kept.
    write_png(&at("grey16.PNG"), Sixteen, Grayscale, &[0x80, 0x00, 0x80, 0x01]);
    let grey = load::read(&at("grey16.PNG"), Encoding::Linear).unwrap();
    assert_eq!(grey.texels[0], [32768.0 / 65535.0; 3]);
    assert_eq!(grey.texels[1], [32769.0 / 65535.0; 3]);
    write_png(&at("rgba8.png"), Eight, Rgba, &[255, 0, 0, 0, 0, 255, 0, 255]);
    let rgba = load::read(&at("rgba8.png"), Encoding::Srgb).unwrap();
    assert_eq!(rgba.texels, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], "alpha is ignored");
}

fn write_exr(path: &Path, pixel: impl Fn(usize) -> f32 + Sync) {
    use exr::prelude::*;
    let channels = SpecificChannels::rgb(|p: Vec2<usize>| (pixel(p.x()), 10.0 * p.y() as f32, 3.5f32));
    Image::from_channels((4, 2), channels).write().to_file(path).unwrap();
}

#[test]
fn exr_and_hdr_files_are_read_as_they_are() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    write_exr(&path, |x| x as f32 + 0.25);
    let image = ImageTexture::load(&path, Encoding::Srgb, Wrap::Clamp).unwrap();
    assert_eq!((image.width(), image.height()), (4, 2));
    assert_eq!(
        image.texel(3, 1),
        Rgb::new(3.25, 10.0, 3.5),
        "linear whatever the encoding, the upper row first"
    );
    let path = dir.path().join("a.hdr");
    let file = std::fs::File::create(&path).unwrap();
    let pixels = [::image::Rgb([1.0f32, 0.5, 4.0]), ::image::Rgb([0.25, 8.0, 1.0])];
    ::image::codecs::hdr::HdrEncoder::new(file).encode(&pixels, 2, 1).unwrap();
    let raster = load::read(&path, Encoding::Srgb).unwrap();
    for (texel, pixel) in raster.texels.iter().zip(pixels) {
        for (a, b) in texel.iter().zip(pixel.0) {
            assert!((a - b).abs() < 0.02 * 8.0, "RGBE has 8 bits: {a} {b}");
        }
    }
}

/// The message of a file that must be refused; it has to name the file.
fn refused(path: &Path) -> String {
    let message = ImageTexture::load(path, Encoding::Srgb, Wrap::Repeat).unwrap_err().to_string();
    assert!(message.contains(&*path.file_name().unwrap().to_string_lossy()), "{message}");
    message
}

#[test]
fn files_that_cannot_be_read_are_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| -> PathBuf { dir.path().join(name) };
    assert!(refused(&at("missing.png")).contains("cannot read"));
    assert!(refused(&at("picture.gif")).contains(".png, .jpg, .exr or .hdr"));
    assert!(refused(&at("noending")).contains(".png, .jpg, .exr or .hdr"));
    std::fs::create_dir(at("folder.exr")).unwrap();
    refused(&at("folder.exr"));
    for ending in ["png", "exr", "hdr"] {
        let path = at(&format!("garbage.{ending}"));
        std::fs::write(&path, b"this is no image at all, whatever its name says").unwrap();
        assert!(refused(&path).contains("cannot read the"));
        std::fs::write(&path, b"").unwrap();
        refused(&path);
    }
    write_exr(&at("whole.exr"), |x| x as f32);
    write_png(&at("whole.png"), png::BitDepth::Eight, png::ColorType::Rgb, &[1, 2, 3, 4, 5, 6]);
    for name in ["whole.exr", "whole.png"] {
        let bytes = std::fs::read(at(name)).unwrap();
        for keep in [bytes.len() / 3, bytes.len() / 2, bytes.len() * 2 / 3] {
            let path = at(&format!("cut-{name}"));
            std::fs::write(&path, &bytes[..keep]).unwrap();
            refused(&path);
        }
    }
    write_exr(&at("nan.exr"), |x| if x == 2 { f32::NAN } else { 1.0 });
    assert!(refused(&at("nan.exr")).contains("2 of 8 texels are not finite"));
}

#[test]
fn images_must_have_the_texels_that_they_say() {
    assert!(ImageTexture::new(0, 0, vec![], Wrap::Repeat).is_err());
    assert!(ImageTexture::new(2, 2, vec![[0.0; 3]; 3], Wrap::Repeat).is_err());
    assert!(ImageTexture::new(u32::MAX, u32::MAX, vec![[0.0; 3]], Wrap::Repeat).is_err());
}
