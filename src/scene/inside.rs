//! Which solids a point lies in: what a subpath has to know to tell what is about it.

/// Solids at a point, the foremost first: the one with the highest priority, see [`super::Solids`].
///
/// Crossings put solids in and take them out by name, so one that is found twice (a ray through the edge of two
/// triangles) or that a point just on a boundary has passed already does no harm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Inside([u16; Inside::DEPTH]);

impl Inside {
    /// Solids that a point can lie in at once. Of more, the hindmost is forgotten.
    pub const DEPTH: usize = 8;
    /// Stands for no solid.
    pub const NONE: u16 = u16::MAX;
    /// In no solid at all.
    pub const NOTHING: Self = Self([Self::NONE; Self::DEPTH]);

    /// The foremost solid; [`Self::NONE`] where there is none.
    #[inline]
    pub fn foremost(&self) -> u16 {
        self.0[0]
    }

    /// The solids, the foremost first.
    #[inline]
    pub fn iter(&self) -> impl Iterator<Item = u16> + '_ {
        self.0.iter().copied().take_while(|s| *s != Self::NONE)
    }

    /// Whether a solid is among them.
    #[inline]
    pub fn has(&self, solid: u16) -> bool {
        solid != Self::NONE && self.0.contains(&solid)
    }

    /// With one more solid. Solids are numbered from the foremost on.
    #[inline]
    pub fn with(mut self, solid: u16) -> Self {
        if self.0.contains(&solid) {
            return self;
        }
        let mut moving = solid;
        for place in &mut self.0 {
            if moving < *place {
                std::mem::swap(place, &mut moving);
            }
        }
        self
    }

    /// Without a solid.
    #[inline]
    pub fn without(mut self, solid: u16) -> Self {
        if let Some(i) = self.0.iter().position(|s| *s == solid) {
            self.0.copy_within(i + 1.., i);
            self.0[Self::DEPTH - 1] = Self::NONE;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_foremost_comes_first_whatever_the_order() {
        for order in [[3, 1, 2], [1, 2, 3], [2, 3, 1]] {
            let inside = order.into_iter().fold(Inside::NOTHING, Inside::with);
            assert_eq!(inside.iter().collect::<Vec<_>>(), [1, 2, 3]);
            assert_eq!(inside.with(2), inside, "twice is once");
            assert_eq!(inside.without(1).foremost(), 2);
            assert_eq!(inside.without(2).iter().collect::<Vec<_>>(), [1, 3]);
            assert_eq!(inside.without(9), inside);
        }
        assert_eq!(Inside::NOTHING.foremost(), Inside::NONE);
        assert!(!Inside::NOTHING.has(Inside::NONE) && Inside::NOTHING.with(0).has(0));
    }

    #[test]
    fn of_too_many_the_hindmost_are_forgotten() {
        let inside = (0..12).rev().fold(Inside::NOTHING, Inside::with);
        assert_eq!(inside.iter().collect::<Vec<_>>(), (0..8).collect::<Vec<u16>>());
        assert_eq!(inside.without(7).without(0).iter().collect::<Vec<_>>(), (1..7).collect::<Vec<u16>>());
    }
}
