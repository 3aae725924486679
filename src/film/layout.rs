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

    /// Index of the weighted image of a technique that is on.
    #[inline]
    pub(super) fn weighted_family(&self, technique: Technique) -> usize {
        usize::from(self.family[technique.index()].expect("only techniques that are on make samples"))
    }

    /// Indices of the unweighted image and of the mean weight of a technique that is on, where such images are kept.
    #[inline]
    pub(super) fn family_layers(&self, technique: Technique) -> Option<[usize; 2]> {
        let weighted = self.weighted_family(technique);
        self.layers.then(|| [weighted + self.families, weighted + 2 * self.families])
    }

    /// Index of the weighted image of (s, t), where it is kept; the unweighted one comes next.
    #[inline]
    pub(super) fn pair(&self, s: u32, t: u32) -> Option<usize> {
        let k = s + t - 1;
        // Lengths 1..k-1 take 2 (k' + 1) images each: their sum is (k - 1)(k + 2).
        (k <= self.pyramid).then(|| 3 * self.families + ((k - 1) * (k + 2) + 2 * s) as usize)
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
        for technique in settings.techniques.iter() {
            let i = layout.weighted_family(technique);
            assert_eq!(layout.images()[i], ImageKind::Family { technique, weighted: true });
            let [unweighted, weight] = layout.family_layers(technique).unwrap();
            assert_eq!(layout.images()[unweighted], ImageKind::Family { technique, weighted: false });
            assert_eq!(layout.images()[weight], ImageKind::Weight { technique });
        }
        for k in 1..=5u32 {
            for s in 0..=k {
                let i = layout.pair(s, k + 1 - s).unwrap();
                assert_eq!(layout.images()[i], ImageKind::Pair { s, t: k + 1 - s, weighted: true });
                assert_eq!(layout.images()[i + 1], ImageKind::Pair { s, t: k + 1 - s, weighted: false });
            }
        }
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
        assert!(Technique::all().all(|t| layout.family_layers(t).is_none()));
    }
}
