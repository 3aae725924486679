//! Where the largest samples of a render are, by the layer of outliers that it kept.

use crate::film::exr::LayeredImage;
use crate::render::files::OUTLIERS;
use std::path::Path;

/// What one iteration added most to a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Largest {
    /// Column and row in the full frame.
    pub pixel: [u32; 2],
    /// Luminance of all that the iteration added.
    pub luminance: f32,
    /// Number of the iteration, from 0.
    pub iteration: u64,
    /// Its share of all that the pixel got.
    pub share: f32,
}

impl Largest {
    /// By what they are ordered: the luminance times the share. A lamp that is seen in every iteration adds much to its pixel each time,
    /// and no iteration has a large share of it; a firefly has.
    fn weight(&self) -> f32 {
        self.luminance * self.share
    }
}

/// Of every pixel, by luminance times share, the largest first; pixels without light are missing. None where the file has no such
/// layer.
pub fn largest(file: &LayeredImage) -> Option<Vec<Largest>> {
    let layer = file.layer(OUTLIERS)?;
    let of = |(i, &[luminance, iteration, share]): (usize, &[f32; 3])| {
        let place = |axis: usize, at: usize| (i64::from(file.origin[axis]) + at as i64).max(0) as u32;
        let pixel = [place(0, i % layer.width), place(1, i / layer.width)];
        Largest { pixel, luminance, iteration: iteration as u64, share }
    };
    let mut all: Vec<Largest> =
        layer.pixels.iter().enumerate().map(of).filter(|l| l.luminance > 0.0).collect();
    all.sort_by(|a, b| b.weight().total_cmp(&a.weight()));
    Some(all)
}

/// What to type to have a pixel of a file explained.
pub fn command(file: &Path, pixel: [u32; 2]) -> String {
    let path = file.to_string_lossy();
    let plain = |c: char| c.is_alphanumeric() || "-_./+,:@%".contains(c);
    let path = if path.chars().all(plain) {
        path.into_owned()
    } else {
        format!("'{}'", path.replace('\'', r"'\''"))
    };
    format!("tyndall explain {path} --pixel {},{}", pixel[0], pixel[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Image;

    #[test]
    fn the_largest_come_first_at_their_places_in_the_full_frame() {
        let mut file = LayeredImage::new(Image::new(3, 2));
        assert_eq!(largest(&file), None);
        file.origin = [10, 20];
        file.push(OUTLIERS, Image::from_fn(3, 2, |x, y| [(x * y) as f32, 7.0, 0.5]));
        let found = largest(&file).unwrap();
        let places: Vec<_> = found.iter().map(|l| (l.pixel, l.luminance)).collect();
        assert_eq!(places, [([12, 21], 2.0), ([11, 21], 1.0)], "black pixels are left out");
        assert_eq!((found[0].iteration, found[0].share), (7, 0.5));
        // What one iteration added alone comes before what all of them add.
        file.layers[1].image =
            Image::from_fn(3, 2, |x, _| if x == 0 { [9.0, 0.0, 0.1] } else { [5.0, 1.0, 0.9] });
        assert_eq!(largest(&file).unwrap()[0].luminance, 5.0);
    }

    #[test]
    fn commands_can_be_copied() {
        assert_eq!(command(Path::new("a/b.exr"), [3, 4]), "tyndall explain a/b.exr --pixel 3,4");
        assert_eq!(command(Path::new("it's a.exr"), [3, 4]), r"tyndall explain 'it'\''s a.exr' --pixel 3,4");
    }
}
