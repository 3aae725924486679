//! Tables that hold exactly one of several keys, as `{ diffuse = {…} }` or `{ translate = […] }`.
//!
//! serde's own enums do nearly this, but say neither what is allowed where the table is empty nor which second
//! key is one too many.

use serde::de::{Deserialize, Deserializer, Error, MapAccess, Visitor};
use std::fmt;

/// The keys of a [`choice!`](crate::scene::file::choice::choice) as a sentence knows them: "`a`, `b` or `c`".
pub(super) fn listed(keys: &[&str]) -> String {
    let quoted: Vec<String> = keys.iter().map(|k| format!("`{k}`")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => quoted.concat(),
    }
}

/// Reads a key and finds its place among the known ones; errors point at the key.
pub(super) struct KeyOf(pub &'static [&'static str]);

impl<'de> serde::de::DeserializeSeed<'de> for KeyOf {
    type Value = usize;

    fn deserialize<D: Deserializer<'de>>(self, d: D) -> Result<usize, D::Error> {
        let key = String::deserialize(d)?;
        self.0.iter().position(|k| *k == key).ok_or_else(|| D::Error::unknown_field(&key, self.0))
    }
}

/// Refuses a key where there is already one.
struct NoSecondKey(&'static str, &'static [&'static str]);

impl<'de> serde::de::DeserializeSeed<'de> for NoSecondKey {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, d: D) -> Result<(), D::Error> {
        let key = String::deserialize(d)?;
        if !self.1.contains(&key.as_str()) {
            return Err(D::Error::unknown_field(&key, &[]));
        }
        Err(D::Error::custom(format!(
            "`{key}` beside `{}`: exactly one of {} can stand here",
            self.0,
            listed(self.1)
        )))
    }
}

/// What a choice's visitor does with the one value, by the place of its key.
pub(super) trait Choice<'de>: Sized {
    /// The keys, in the order of the variants.
    const KEYS: &'static [&'static str];
    /// Reads the value of the key at `index`.
    fn read<A: MapAccess<'de>>(index: usize, map: &mut A) -> Result<Self, A::Error>;
}

/// The visitor of all choices.
pub(super) struct ChoiceVisitor<T>(pub std::marker::PhantomData<T>);

impl<'de, T: Choice<'de>> Visitor<'de> for ChoiceVisitor<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a table with exactly one of {}", listed(T::KEYS))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<T, A::Error> {
        let Some(index) = map.next_key_seed(KeyOf(T::KEYS))? else {
            return Err(A::Error::custom(format!("nothing here: expected one of {}", listed(T::KEYS))));
        };
        let value = T::read(index, &mut map)?;
        match map.next_key_seed(NoSecondKey(T::KEYS[index], T::KEYS))? {
            None => Ok(value),
            Some(()) => Err(A::Error::custom("one key too many")),
        }
    }
}

/// Defines an enum that is written as a table with exactly one key: `choice! { /// … pub enum E { "key" => V(T) } }`.
macro_rules! choice {
    ($(#[$about:meta])* pub enum $name:ident { $($(#[$doc:meta])* $key:literal => $variant:ident($value:ty),)+ }) => {
        $(#[$about])*
        #[derive(Debug)]
        pub enum $name { $($(#[$doc])* $variant($value),)+ }

        impl<'de> $crate::scene::file::choice::Choice<'de> for $name {
            const KEYS: &'static [&'static str] = &[$($key),+];

            fn read<A: serde::de::MapAccess<'de>>(index: usize, map: &mut A) -> Result<Self, A::Error> {
                let mut place = 0..;
                $(if place.next() == Some(index) {
                    return map.next_value().map($name::$variant);
                })+
                Err(serde::de::Error::custom("a key without a variant"))
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
                d.deserialize_map($crate::scene::file::choice::ChoiceVisitor(std::marker::PhantomData))
            }
        }
    };
}

pub(super) use choice;
