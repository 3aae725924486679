//! Where the estimators differ most: the places of the zoomed insets when the experiment names none.

use crate::film::Image;

/// A rectangle of an image, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Crop {
    /// Left column.
    pub x: usize,
    /// Top row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Crop {
    /// The part of it that lies inside an image of this size; `None` where there is none.
    pub fn within(self, width: usize, height: usize) -> Option<Self> {
        let (x, y) = (self.x.min(width), self.y.min(height));
        let (w, h) = (self.width.min(width - x), self.height.min(height - y));
        (w > 0 && h > 0).then_some(Self { x, y, width: w, height: h })
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.x < other.x + other.width
            && other.x < self.x + self.width
            && self.y < other.y + other.height
            && other.y < self.y + self.height
    }
}

/// Sums over rectangles in constant time.
struct SummedArea {
    width: usize,
    sums: Vec<f64>,
}

impl SummedArea {
    fn new(width: usize, values: &[f32]) -> Self {
        let height = values.len() / width;
        let mut sums = vec![0.0; (width + 1) * (height + 1)];
        for y in 0..height {
            let mut row = 0.0;
            for x in 0..width {
                row += f64::from(values[y * width + x]);
                sums[(y + 1) * (width + 1) + x + 1] = row + sums[y * (width + 1) + x + 1];
            }
        }
        Self { width, sums }
    }

    fn mean(&self, c: &Crop) -> f64 {
        let at = |x: usize, y: usize| self.sums[y * (self.width + 1) + x];
        let sum = at(c.x + c.width, c.y + c.height) - at(c.x, c.y + c.height) - at(c.x + c.width, c.y)
            + at(c.x, c.y);
        sum / (c.width * c.height) as f64
    }
}

/// |a − b| / (|a| + |b|) a pixel: between 0 and 1, so that one firefly decides nothing.
fn bounded_error(image: &Image, reference: &Image) -> Vec<f32> {
    let error = |(a, b): (&[f32; 3], &[f32; 3])| {
        let difference: f32 = a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum();
        let sum: f32 = a.iter().zip(b).map(|(a, b)| a.abs() + b.abs()).sum();
        let ratio = difference / sum;
        if ratio.is_finite() { ratio } else { f32::from(u8::from(sum != 0.0)) }
    };
    image.pixels.iter().zip(&reference.pixels).map(error).collect()
}

/// What a part without any contrast counts of one with the most.
const DULL: f64 = 0.2;

/// Luminance about as it is seen at this exposure: between 0 and 1, where equal steps look alike.
fn seen(image: &Image, stops: f32) -> Vec<f32> {
    let scale = stops.exp2();
    let of = |p: &[f32; 3]| (scale * (0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2])).clamp(0.0, 1.0).sqrt();
    image.pixels.iter().map(of).map(|v| if v.is_finite() { v } else { 0.0 }).collect()
}

/// Standard deviations over rectangles.
struct Contrast {
    values: SummedArea,
    squares: SummedArea,
}

impl Contrast {
    fn new(reference: &Image, stops: f32) -> Self {
        let values = seen(reference, stops);
        let squares: Vec<f32> = values.iter().map(|v| v * v).collect();
        Self {
            values: SummedArea::new(reference.width, &values),
            squares: SummedArea::new(reference.width, &squares),
        }
    }

    fn of(&self, c: &Crop) -> f64 {
        (self.squares.mean(c) - self.values.mean(c).powi(2)).max(0.0).sqrt()
    }
}

/// Up to `count` rectangles that do not overlap, where the estimators' errors against the reference differ most from
/// each other; with one estimator, where its error is largest. Where there is nothing to be seen in the reference at this exposure,
/// the difference counts for less: a part of a wall shows noise and nothing else. All images have one size.
pub(super) fn choose(reference: &Image, estimates: &[&Image], stops: f32, count: usize) -> Vec<Crop> {
    let (width, height) = (reference.width, reference.height);
    if width < 2 || height < 2 || estimates.is_empty() {
        return Vec::new();
    }
    let side = (width.min(height) / 6).clamp(8, 96).min(width).min(height);
    let errors: Vec<SummedArea> =
        estimates.iter().map(|e| SummedArea::new(width, &bounded_error(e, reference))).collect();
    let score = |c: &Crop| {
        let means = errors.iter().map(|e| e.mean(c));
        let high = means.clone().fold(f64::NEG_INFINITY, f64::max);
        let low = if errors.len() > 1 { means.fold(f64::INFINITY, f64::min) } else { 0.0 };
        high - low
    };
    let step = (side / 4).max(1);
    let contrast = Contrast::new(reference, stops);
    let mut candidates: Vec<(f64, Crop)> = Vec::new();
    for y in (0..=height - side).step_by(step) {
        for x in (0..=width - side).step_by(step) {
            let crop = Crop { x, y, width: side, height: side };
            candidates.push((contrast.of(&crop), crop));
        }
    }
    // What is less than a step of a display is not seen, and may be rounding.
    let most = candidates.iter().map(|(contrast, _)| *contrast).fold(1.0 / 255.0, f64::max);
    for (value, crop) in &mut candidates {
        *value = score(crop) * (DULL + (1.0 - DULL) * *value / most);
    }
    // Stable: of equal ones, the first in reading order.
    candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut chosen: Vec<Crop> = Vec::new();
    for (_, crop) in candidates {
        if chosen.len() == count {
            break;
        }
        if chosen.iter().all(|c| !c.overlaps(&crop)) {
            chosen.push(crop);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_where_they_differ() {
        let reference = Image::from_fn(96, 64, |_, _| [0.5; 3]);
        let mut bad = reference.clone();
        for y in 40..50 {
            for x in 70..80 {
                bad.pixels[y * 96 + x] = [1.5; 3];
            }
        }
        // Wrong in the same way in both: of no interest.
        let mut good = reference.clone();
        for image in [&mut bad, &mut good] {
            image.pixels[..96 * 20].fill([3.0; 3]);
        }
        let crops = choose(&reference, &[&bad, &good], 0.0, 2);
        assert_eq!(crops.len(), 2);
        assert!(crops[0].x <= 70 && crops[0].x + crops[0].width >= 80, "{crops:?}");
        assert!(crops[0].y <= 40 && crops[0].y + crops[0].height >= 50, "{crops:?}");
        assert!(!crops[0].overlaps(&crops[1]));
        assert_eq!(choose(&reference, &[&good], 0.0, 1)[0].y, 0, "one estimator: where it errs");
    }

    /// Bug that this keeps out: parts of bare walls, where noise is about as strong as at what there is to see.
    #[test]
    fn something_is_to_be_seen_in_them() {
        // Stripes at the right, and a little more noise on the wall at the left.
        let stripes = |x: usize| if x < 64 || x % 4 < 2 { 0.2 } else { 0.6 };
        let reference = Image::from_fn(96, 64, |x, _| [stripes(x); 3]);
        let noisy = Image::from_fn(96, 64, |x, y| {
            let size = if x < 64 { 0.5 } else { 0.4 };
            [stripes(x) * if (x + y) % 2 == 0 { 1.0 + size } else { 1.0 - size }; 3]
        });
        let crops = choose(&reference, &[&noisy, &reference], 0.0, 2);
        assert!(crops.iter().all(|c| c.x >= 58), "{crops:?}");
        // What is the same black or white at an exposure has nothing to be seen.
        let crops = choose(&reference, &[&noisy, &reference], 10.0, 1);
        assert!(crops[0].x + crops[0].width <= 64, "{crops:?}");
    }

    #[test]
    fn small_black_and_broken_images_do_no_harm() {
        let black = Image::new(5, 3);
        let mut broken = black.clone();
        broken.pixels[0] = [f32::NAN; 3];
        for crop in choose(&black, &[&black, &broken], 0.0, 3) {
            assert_eq!(crop.within(5, 3), Some(crop));
        }
        assert!(choose(&Image::new(1, 1), &[&black], 0.0, 2).is_empty());
        assert_eq!(Crop { x: 90, y: 0, width: 8, height: 8 }.within(10, 10), None);
    }
}
