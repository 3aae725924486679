//! A grid in its own coordinates, and where its values are kept.
//!
//! Lattice coordinates: a cell is a unit cube between whole numbers. Constant values are those of cells, and the box is
//! 0 … n. Trilinear ones are at the corners of cells, value i at i + 1, and the box is ½ … n + ½: of the first and the last cell
//! of each axis only half is in it, and both its ends have the same value.

use super::texel::Texel;
use crate::math::prefetch;
use glam::{DVec3, UVec3, Vec3A};

/// What is between the values of a grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Means of the eight values about.
    #[default]
    Trilinear,
    /// Each value fills its voxel.
    Constant,
}

/// Cells along the side of a block, of which the largest value is known.
pub(super) const BLOCK: f32 = 8.0;
/// Values along the side of a brick, and of a brick of bricks: a line of a cache has a layer of the former, and the latter is four
/// pages of memory.
const BRICKS: [usize; 2] = [4, 16];
/// Grids of no more values than this are kept row by row: they are in the cache as they are.
const SMALL: usize = 1 << 15;
/// Nor are others in bricks that take more than this times their room: flat ones, say.
const MOST_FILLED_UP: f64 = 1.25;

/// Values on a regular grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice<T> {
    size: UVec3,
    interpolation: Interpolation,
    values: Box<[T]>,
    /// By axis and cell, where its values begin: the place of a value is the sum over the axes. One more than cells.
    places: [Box<[u32]>; 3],
    /// By block, what none of the values in it is above; 0 where nothing is in it.
    majorants: Box<[f32]>,
    /// The last cell.
    pub(super) last: Vec3A,
    /// The last block, and how blocks are counted.
    pub(super) last_block: Vec3A,
}

/// By so much a mean may be above the largest of what it is of: weights and sums are rounded.
const ROUNDED_UP: f32 = 1.0 + 8.0 * f32::EPSILON;

/// Bytes that are near in any case.
const CACHED: usize = 1 << 20;

/// In which order values are kept: in bricks, bricks of bricks, or row by row.
struct Order {
    /// Sides of the bricks that there are, each a multiple of the one before.
    sides: &'static [usize],
    /// How many of the largest there are along each axis.
    count: [usize; 3],
}

impl Order {
    fn of(n: [usize; 3]) -> Self {
        let whole: usize = n.iter().product();
        let filled_up = |side: usize| n.iter().map(|n| n.next_multiple_of(side)).product::<usize>();
        let pays = |side: &usize| whole > SMALL && filled_up(*side) as f64 <= MOST_FILLED_UP * whole as f64;
        let sides = &BRICKS[..BRICKS.iter().take_while(|side| pays(side)).count()];
        let largest = sides.last().copied().unwrap_or(1);
        Self { sides, count: n.map(|n| n.div_ceil(largest)) }
    }

    /// Values that there is room for.
    fn room(&self) -> usize {
        self.count.iter().product::<usize>() * self.sides.last().map_or(1, |side| side.pow(3))
    }

    /// What the index `i` on an axis adds to a value's place.
    fn place(&self, axis: usize, i: usize) -> usize {
        let (mut place, mut below) = (0, 1usize);
        for side in self.sides {
            let across = side / below;
            place += i % side / below * below.pow(3) * across.pow(axis as u32);
            below = *side;
        }
        let outer = [1, self.count[0], self.count[0] * self.count[1]];
        place + i / below * below.pow(3) * outer[axis]
    }
}

impl<T: Texel> Lattice<T> {
    /// Of the numbers of `size` values, x fastest, then y, then z; those of one value are together.
    ///
    /// # Errors
    /// A size of 0 or too large, another number of numbers, or one that is negative or not finite.
    pub fn new(size: UVec3, numbers: &[f32], interpolation: Interpolation) -> Result<Self, String> {
        Self::check(size, numbers)?;
        Ok(Self::store(size, numbers, interpolation))
    }

    /// Whether there is such a grid.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn check(size: UVec3, numbers: &[f32]) -> Result<(), String> {
        let count = u64::from(size.x) * u64::from(size.y) * u64::from(size.z);
        let shown = format!("{} x {} x {}", size.x, size.y, size.z);
        if count == 0 {
            return Err(format!("the grid has no values: its size is {shown}"));
        }
        // Places are u32, and bricks have room for more than there is.
        if count > 1 << 31 || size.max_element() > 1 << 20 {
            return Err(format!(
                "the grid is too large: {shown}, more than 2^31 values or 2^20 along an axis"
            ));
        }
        if numbers.len() as u64 != count * T::CHANNELS as u64 {
            return Err(format!(
                "the grid is {shown} with {} a value, which takes {} numbers: found {}",
                T::CHANNELS,
                count * T::CHANNELS as u64,
                numbers.len()
            ));
        }
        if let Some(i) = numbers.iter().position(|x| !(x.is_finite() && *x >= 0.0)) {
            let at = i / T::CHANNELS;
            let (x, rest) = (at % size.x as usize, at / size.x as usize);
            let (y, z) = (rest % size.y as usize, rest / size.y as usize);
            return Err(format!(
                "the value at ({x}, {y}, {z}) is {}: values must be finite and not negative",
                numbers[i]
            ));
        }
        Ok(())
    }

    fn store(size: UVec3, numbers: &[f32], interpolation: Interpolation) -> Self {
        let n = size.to_array().map(|n| n as usize);
        let order = Order::of(n);
        let at: [Vec<u32>; 3] =
            std::array::from_fn(|axis| (0..n[axis]).map(|i| order.place(axis, i) as u32).collect());
        let mut values = vec![T::ZERO; order.room()];
        for (i, value) in numbers.chunks_exact(T::CHANNELS).enumerate() {
            let (x, y, z) = (i % n[0], i / n[0] % n[1], i / n[0] / n[1]);
            values[(at[0][x] + at[1][y] + at[2][z]) as usize] = T::of(value);
        }
        let places = at.map(|at| {
            let (first, last) = (at[0], at[at.len() - 1]);
            match interpolation {
                Interpolation::Constant => at.into_iter().chain([last]).collect(),
                Interpolation::Trilinear => std::iter::once(first).chain(at).chain([last]).collect(),
            }
        });
        let last = match interpolation {
            Interpolation::Constant => size.as_vec3a() - 1.0,
            Interpolation::Trilinear => size.as_vec3a(),
        };
        let last_block = (last / BLOCK).floor();
        let mut lattice = Self {
            size,
            interpolation,
            values: values.into(),
            places,
            majorants: Box::new([]),
            last,
            last_block,
        };
        lattice.majorants = lattice.find_majorants();
        lattice
    }

    fn find_majorants(&self) -> Box<[f32]> {
        let blocks = (self.last_block + 1.0).to_array().map(|n| n as usize);
        let side = BLOCK as usize;
        // A cell's corners are two on an axis; a voxel's value is one.
        let more = usize::from(self.interpolation == Interpolation::Trilinear);
        let range = |axis: usize, block: usize| {
            let places = &self.places[axis];
            &places[(block * side).min(places.len() - 1)..((block + 1) * side + more).min(places.len())]
        };
        let largest = |i: usize| {
            let mut largest = 0f32;
            for z in range(2, i / blocks[0] / blocks[1]) {
                for y in range(1, i / blocks[0] % blocks[1]) {
                    for x in range(0, i % blocks[0]) {
                        largest = largest.max(self.at(*x + *y + *z).largest());
                    }
                }
            }
            largest * ROUNDED_UP
        };
        (0..blocks[0] * blocks[1] * blocks[2]).map(largest).collect()
    }

    #[inline(always)]
    fn at(&self, place: u32) -> T {
        self.values[place as usize]
    }

    /// How many values there are along each axis.
    pub fn size(&self) -> UVec3 {
        self.size
    }

    /// What is between the values.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// Bytes that the grid takes.
    pub fn bytes(&self) -> usize {
        let places: usize = self.places.iter().map(|p| p.len() * size_of::<u32>()).sum();
        self.values.len() * size_of::<T>() + places + size_of_val(&*self.majorants)
    }

    /// All values, in no order.
    pub fn values(&self) -> impl Iterator<Item = T> + '_ {
        let n = self.size.to_array().map(|n| n as usize);
        let first = usize::from(self.interpolation == Interpolation::Trilinear);
        let [x, y, z] = std::array::from_fn(|axis| &self.places[axis][first..first + n[axis]]);
        z.iter().flat_map(move |z| y.iter().flat_map(move |y| x.iter().map(move |x| self.at(*x + *y + *z))))
    }

    /// The largest of all values, with what rounding may add to it.
    pub fn largest(&self) -> f32 {
        self.majorants.iter().copied().fold(0.0, f32::max)
    }

    /// The corners of the box in lattice coordinates.
    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        let size = self.size.as_dvec3();
        match self.interpolation {
            Interpolation::Constant => (DVec3::ZERO, size),
            Interpolation::Trilinear => (DVec3::splat(0.5), size + 0.5),
        }
    }

    #[inline(always)]
    pub(super) fn majorant(&self, block: Vec3A) -> f32 {
        let n = self.last_block + 1.0;
        // Whole numbers well below 2²⁴ along an axis; the sum may be above.
        let [x, y, z] = block.to_array().map(|b| b as usize);
        self.majorants[x + n.x as usize * (y + n.y as usize * z)]
    }

    /// Asks for the values of the cell that holds the point `p`, which a ray will come to. Grids that a cache holds do
    /// without.
    #[inline(always)]
    pub(super) fn ask_for(&self, p: Vec3A) {
        if self.values.len() * size_of::<T>() > CACHED {
            let [x, y, z] = p.clamp(Vec3A::ZERO, self.last).to_array().map(|c| c as usize);
            let place = self.places[0][x] + self.places[1][y] + self.places[2][z];
            prefetch(&self.values, place as usize);
        }
    }

    /// The value of a cell where values are constant.
    #[inline(always)]
    pub(super) fn voxel(&self, cell: Vec3A) -> T {
        let [x, y, z] = cell.to_array().map(|c| c as usize);
        self.at(self.places[0][x] + self.places[1][y] + self.places[2][z])
    }

    /// The values at the corners of a cell where they are trilinear.
    #[inline(always)]
    pub(super) fn corners(&self, cell: Vec3A) -> [T; 8] {
        let [i, j, k] = cell.to_array().map(|c| c as usize);
        let [x, y, z] = &self.places;
        let (x0, x1) = (x[i], x[i + 1]);
        let (y0, y1) = (y[j], y[j + 1]);
        let (z0, z1) = (z[k], z[k + 1]);
        let (a, b, c, d) = (y0 + z0, y1 + z0, y0 + z1, y1 + z1);
        [
            self.at(x0 + a),
            self.at(x1 + a),
            self.at(x0 + b),
            self.at(x1 + b),
            self.at(x0 + c),
            self.at(x1 + c),
            self.at(x0 + d),
            self.at(x1 + d),
        ]
    }
}
