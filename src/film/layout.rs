//! Which images a film keeps, and where each lies.

use crate::transport::settings::{Layers, Settings};
use crate::transport::technique::{Technique, TechniqueSet};

/// The images of a film: a number an image, the same for every pixel.
///
/// The first images are the weighted contributions of the techniques that are on; they are always kept, as the
/// combined image is their sum.
#[derive(Clone, Debug)]
pub struct Layout {
    techniques: TechniqueSet,
    /// Index of each technique's weighted image.
    family: [Option<u16>; Technique::COUNT],
    families: usize,
    /// Whether the techniques' unweighted images and mean weights are kept too.
    layers: bool,
    /// Longest path with images of its own an (s, t); 0 for none.
    pyramid: u32,
    images: Vec<ImageKind>,
}

/// Where the numbers of an image lie among those of a pixel: with the technique of this number, or from `first` on with the
/// (s, t).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    Weighted(usize),
    Unweighted(usize),
    Weights(usize),
    Pair { pair: usize, first: usize },
}

/// What one image of a film holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// Contribution of a technique, times its weight or not.
    Family {
        /// The technique.
        technique: Technique,
        /// Whether it is weighted.
        weighted: bool,
    },
    /// Mean weight of a technique: over all samples of it on the pixel, of all iterations, whose contribution is finite
    /// and not black, the sum of their weights divided by their number, in [0, 1]; 0 where there is none. Each sample
    /// counts once, whatever it carries: unlike the quotient of weighted and unweighted image, in which a sample of weight 0
    /// beside a bright one counts for nothing, and a single bright sample for all.
    Weight {
        /// The technique.
        technique: Technique,
    },
    /// Contribution of the paths that s light and t camera vertices make, times their weight or not.
    Pair {
        /// Vertices of the light subpath.
        s: u32,
        /// Vertices of the camera subpath.
        t: u32,
        /// Whether it is weighted.
        weighted: bool,
    },
}

impl ImageKind {
    /// Name of the image in an EXR: `weighted.nee`, `unweighted.nee`, `weight.nee`, `weighted.s02t03`.
    pub fn name(self) -> String {
        let prefix = |w| if w { "weighted" } else { "unweighted" };
        match self {
            Self::Family { technique, weighted } => format!("{}.{}", prefix(weighted), technique.info().key),
            Self::Weight { technique } => format!("weight.{}", technique.info().key),
            Self::Pair { s, t, weighted } => format!("{}.s{s:02}t{t:02}", prefix(weighted)),
        }
    }
}

impl Layout {
    /// The images that the settings ask for.
    pub fn new(settings: &Settings) -> Self {
        let set = settings.techniques;
        let mut family = [None; Technique::COUNT];
        let mut images = Vec::new();
        for technique in set.iter() {
            family[technique.index()] = Some(images.len() as u16);
            images.push(ImageKind::Family { technique, weighted: true });
        }
        let families = images.len();
        let layers = settings.layers != Layers::None;
        if layers {
            images.extend(set.iter().map(|technique| ImageKind::Family { technique, weighted: false }));
            images.extend(set.iter().map(|technique| ImageKind::Weight { technique }));
        }
        let pyramid =
            if settings.layers == Layers::All { settings.pyramid.min(settings.max_length) } else { 0 };
        for k in 1..=pyramid {
            for s in 0..=k {
                for weighted in [true, false] {
                    images.push(ImageKind::Pair { s, t: k + 1 - s, weighted });
                }
            }
        }
        Self { techniques: set, family, families, layers, pyramid, images }
    }

    /// What each image holds, in order.
    pub fn images(&self) -> &[ImageKind] {
        &self.images
    }

    /// How many of the first images sum up to the combined one.
    pub fn families(&self) -> usize {
        self.families
    }

    /// The techniques whose contributions are kept.
    pub fn techniques(&self) -> TechniqueSet {
        self.techniques
    }

    /// Index of the weighted image of a technique, where it is on.
    #[inline]
    pub(super) fn family(&self, technique: Technique) -> Option<usize> {
        self.family[technique.index()].map(usize::from)
    }

    /// Whether the techniques' unweighted images and mean weights are kept.
    #[inline]
    pub(super) fn has_layers(&self) -> bool {
        self.layers
    }

    /// How many (s, t) have images of their own.
    pub(super) fn pairs(&self) -> usize {
        let longest = self.pyramid as usize;
        longest * (longest + 3) / 2
    }

    /// Number of (s, t), where images of it are kept.
    #[inline]
    pub(super) fn pair(&self, s: u32, t: u32) -> Option<usize> {
        let k = s + t - 1;
        // Lengths 1..k-1 have k' + 1 each: their sum is (k - 1)(k + 2) / 2.
        (k <= self.pyramid).then(|| ((k - 1) * (k + 2) / 2 + s) as usize)
    }

    /// Where the image with this index lies.
    pub(super) fn place(&self, image: usize) -> Place {
        let family = image % self.families;
        match image / self.families {
            0 => Place::Weighted(family),
            1 if self.layers => Place::Unweighted(family),
            2 if self.layers => Place::Weights(family),
            _ => {
                let image = image - 3 * self.families;
                Place::Pair { pair: image / 2, first: image % 2 * 3 }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_agree_with_the_list() {
        let mut settings = Settings::new(TechniqueSet::of(&[Technique::Hit, Technique::Lens]));
        settings.layers = Layers::All;
        settings.pyramid = 5;
        let layout = Layout::new(&settings);
        for (i, kind) in layout.images().iter().enumerate() {
            let family = |technique| layout.family(technique).unwrap();
            let expected = match *kind {
                ImageKind::Family { technique, weighted: true } => Place::Weighted(family(technique)),
                ImageKind::Family { technique, .. } => Place::Unweighted(family(technique)),
                ImageKind::Weight { technique } => Place::Weights(family(technique)),
                ImageKind::Pair { s, t, weighted } => {
                    let pair = layout.pair(s, t).unwrap();
                    assert!(pair < layout.pairs());
                    Place::Pair { pair, first: if weighted { 0 } else { 3 } }
                }
            };
            assert_eq!(layout.place(i), expected, "{kind:?}");
        }
        assert_eq!(layout.images().len(), 3 * layout.families() + 2 * layout.pairs());
        assert_eq!(layout.pair(2, 5), None);
        let mut names: Vec<String> = layout.images().iter().map(|i| i.name()).collect();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), layout.images().len(), "names are unique");
    }

    #[test]
    fn without_layers_only_what_sums_to_the_image_is_kept() {
        let layout = Layout::new(&Settings::new(TechniqueSet::all()));
        assert_eq!(layout.images().len(), Technique::COUNT);
        assert!(!layout.has_layers() && layout.pairs() == 0);
    }
}
