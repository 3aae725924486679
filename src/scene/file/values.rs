//! The values of a scene file: numbers, vectors and colours that are checked while they are read, so that
//! an error points at the very number, and what has been read needs no further check.

use crate::math::Rgb;
use glam::{Vec2, Vec3A};
use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;

/// Which numbers a place in the file takes.
pub trait Rule {
    /// What is expected, as in "expected …, found -1".
    const EXPECTED: &'static str;
    /// Whether a finite number is one of these.
    fn holds(x: f32) -> bool;
}

/// Any finite number.
#[derive(Clone, Copy, Debug)]
pub struct AnyNumber;
/// Above 0.
#[derive(Clone, Copy, Debug)]
pub struct AboveZero;
/// 0 or above.
#[derive(Clone, Copy, Debug)]
pub struct ZeroOrAbove;
/// From 0 to 1.
#[derive(Clone, Copy, Debug)]
pub struct Fraction;

impl Rule for AnyNumber {
    const EXPECTED: &'static str = "a finite number";
    fn holds(_: f32) -> bool {
        true
    }
}

impl Rule for AboveZero {
    const EXPECTED: &'static str = "a finite number above 0";
    fn holds(x: f32) -> bool {
        x > 0.0
    }
}

impl Rule for ZeroOrAbove {
    const EXPECTED: &'static str = "a finite number that is not negative";
    fn holds(x: f32) -> bool {
        x >= 0.0
    }
}

impl Rule for Fraction {
    const EXPECTED: &'static str = "a number from 0 to 1";
    fn holds(x: f32) -> bool {
        (0.0..=1.0).contains(&x)
    }
}

/// A number that obeys a [`Rule`].
#[derive(Debug)]
pub struct Checked<R>(f32, PhantomData<R>);

/// A number that is finite.
pub type Number = Checked<AnyNumber>;
/// A number above 0.
pub type Positive = Checked<AboveZero>;
/// A number from 0 up.
pub type NonNegative = Checked<ZeroOrAbove>;

impl<R> Clone for Checked<R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R> Copy for Checked<R> {}

impl<R> Checked<R> {
    /// The number.
    pub fn get(self) -> f32 {
        self.0
    }
}

/// Checks one number as it stands in the file; integers are numbers too.
fn check<R: Rule, E: Error>(x: f64) -> Result<f32, E> {
    let narrow = x as f32;
    if narrow.is_finite() && R::holds(narrow) {
        // TOML knows -0.0; adding 0 turns it into plain zero.
        return Ok(narrow + 0.0);
    }
    Err(E::custom(format!("expected {}, found {x}", R::EXPECTED)))
}

struct NumberVisitor<R>(PhantomData<R>);

impl<R: Rule> Visitor<'_> for NumberVisitor<R> {
    type Value = f32;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(R::EXPECTED)
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<f32, E> {
        check::<R, E>(x)
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<f32, E> {
        check::<R, E>(x as f64)
    }

    fn visit_u64<E: Error>(self, x: u64) -> Result<f32, E> {
        check::<R, E>(x as f64)
    }
}

impl<'de, R: Rule> Deserialize<'de> for Checked<R> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(NumberVisitor::<R>(PhantomData)).map(|x| Self(x, PhantomData))
    }
}

/// A whole number from `MIN` to 2³² − 1.
#[derive(Clone, Copy, Debug)]
pub struct Count<const MIN: u32>(pub u32);

impl<'de, const MIN: u32> Deserialize<'de> for Count<MIN> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        struct CountVisitor<const MIN: u32>;
        impl<const MIN: u32> Visitor<'_> for CountVisitor<MIN> {
            type Value = u32;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                write!(f, "a whole number from {MIN} up")
            }
            fn visit_i64<E: Error>(self, n: i64) -> Result<u32, E> {
                let small = u32::try_from(n).ok().filter(|n| *n >= MIN);
                small.ok_or_else(|| E::custom(format!("expected a whole number from {MIN} up, found {n}")))
            }
        }
        d.deserialize_any(CountVisitor::<MIN>).map(Self)
    }
}

/// Reads exactly `N` numbers of an array.
fn read_numbers<'de, R: Rule, A: SeqAccess<'de>, const N: usize>(
    mut seq: A,
    what: &str,
) -> Result<[f32; N], A::Error> {
    let mut numbers = [0.0; N];
    let mut found = 0;
    while let Some(x) = seq.next_element::<Checked<R>>()? {
        if found < N {
            numbers[found] = x.get();
        }
        found += 1;
    }
    if found == N {
        Ok(numbers)
    } else {
        Err(A::Error::custom(format!("expected {what}, found {found} numbers")))
    }
}

struct NumbersVisitor<const N: usize>(&'static str);

impl<'de, const N: usize> Visitor<'de> for NumbersVisitor<N> {
    type Value = [f32; N];

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.0)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<[f32; N], A::Error> {
        read_numbers::<AnyNumber, A, N>(seq, self.0)
    }
}

/// `[x, y]`.
#[derive(Clone, Copy, Debug)]
pub struct Pair(pub Vec2);

impl<'de> Deserialize<'de> for Pair {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(NumbersVisitor::<2>("two numbers [x, y]")).map(|v| Self(v.into()))
    }
}

/// `[x, y, z]`: a point or a vector.
#[derive(Clone, Copy, Debug)]
pub struct Triple(pub Vec3A);

impl<'de> Deserialize<'de> for Triple {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(NumbersVisitor::<3>("three numbers [x, y, z]")).map(|v| Self(v.into()))
    }
}

/// One row `[a, b, c, d]` of a matrix.
#[derive(Clone, Copy, Debug)]
pub struct Row(pub [f32; 4]);

impl<'de> Deserialize<'de> for Row {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(NumbersVisitor::<4>("a row of four numbers")).map(Self)
    }
}

/// A colour: `[red, green, blue]`, linear Rec. 709, or one number for grey; each channel obeys the rule.
#[derive(Debug)]
pub struct Color<R = ZeroOrAbove>(pub Rgb, PhantomData<R>);

impl<R> Clone for Color<R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R> Copy for Color<R> {}

/// The visitor of [`Color`], open to visitors that take more than colours.
pub(super) struct ColorVisitor<R>(PhantomData<R>);

impl<R> ColorVisitor<R> {
    pub(super) fn new() -> Self {
        Self(PhantomData)
    }
}

impl<'de, R: Rule> Visitor<'de> for ColorVisitor<R> {
    type Value = Rgb;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a colour: [red, green, blue] or one number")
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<Rgb, E> {
        check::<R, E>(x).map(Rgb::splat)
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<Rgb, E> {
        self.visit_f64(x as f64)
    }

    fn visit_u64<E: Error>(self, x: u64) -> Result<Rgb, E> {
        self.visit_f64(x as f64)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Rgb, A::Error> {
        read_numbers::<R, A, 3>(seq, "a colour [red, green, blue]").map(Rgb::from)
    }
}

impl<R> Color<R> {
    /// A colour that is known to obey the rule.
    pub(super) fn new(rgb: Rgb) -> Self {
        Self(rgb, PhantomData)
    }
}

impl<'de, R: Rule> Deserialize<'de> for Color<R> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(ColorVisitor::<R>::new()).map(Self::new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Deserialize, Debug)]
    struct One<T> {
        x: T,
    }

    fn read<T: for<'a> Deserialize<'a>>(value: &str) -> Result<T, String> {
        toml::from_str::<One<T>>(&format!("x = {value}")).map(|o| o.x).map_err(|e| e.message().to_owned())
    }

    #[test]
    fn numbers_obey_their_rule() {
        assert_eq!(read::<Positive>("2").unwrap().get(), 2.0);
        assert_eq!(read::<NonNegative>("-0.0").unwrap().get().to_bits(), 0);
        for (value, found) in [("0", "0"), ("-1.5", "-1.5"), ("nan", "NaN"), ("inf", "inf"), ("1e39", "1000")]
        {
            let message = read::<Positive>(value).unwrap_err();
            assert!(message.contains("above 0") && message.contains(found), "{message}");
        }
        assert!(read::<Number>("\"a\"").unwrap_err().contains("expected a finite number"));
    }

    #[test]
    fn colours_are_numbers_or_triples() {
        assert_eq!(read::<Color>("0.5").unwrap().0, Rgb::splat(0.5));
        assert_eq!(read::<Color>("[1, 0.5, 0]").unwrap().0, Rgb::new(1.0, 0.5, 0.0));
        assert!(read::<Color>("[1, 2]").unwrap_err().contains("found 2 numbers"));
        assert!(read::<Color>("[1, -2, 0]").unwrap_err().contains("found -2"));
        assert!(read::<Color<Fraction>>("1.5").unwrap_err().contains("from 0 to 1"));
        assert!(read::<Triple>("[1, 2, 3, 4]").unwrap_err().contains("found 4 numbers"));
    }
}
