//! Entries of a scene file that may be written in more than one form: a number or a colour, a name or a table.
//!
//! Derived untagged enums would lose the position of what is wrong; these visitors keep it.

use super::schema::*;
use super::values::*;
use crate::error::{did_you_mean, nearest};
use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        struct InOrder<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for InOrder<T> {
            type Value = Named<T>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a table of names")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(Named(entries))
            }
        }
        d.deserialize_map(InOrder(PhantomData))
    }
}

impl<'de> Deserialize<'de> for ProfilePiece {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        struct Piece;
        impl<'de> Visitor<'de> for Piece {
            type Value = ProfilePiece;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a point [radius, height] or a curve { bezier = […] } or { through = […] }")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
                Pair::deserialize(de::value::SeqAccessDeserializer::new(seq)).map(ProfilePiece::Point)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                CurveDef::deserialize(de::value::MapAccessDeserializer::new(map)).map(ProfilePiece::Curve)
            }
        }
        d.deserialize_any(Piece)
    }
}

impl<'de> Deserialize<'de> for EmissionDef {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Table {
            radiance: Color,
            #[serde(default)]
            two_sided: bool,
        }
        struct Emission;
        impl<'de> Visitor<'de> for Emission {
            type Value = EmissionDef;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a colour, or a table { radiance = a colour, two_sided = true or false }")
            }
            fn visit_f64<E: de::Error>(self, x: f64) -> Result<Self::Value, E> {
                let radiance = Color::new(ColorVisitor::<ZeroOrAbove>::new().visit_f64(x)?);
                Ok(EmissionDef { radiance, two_sided: false })
            }
            fn visit_i64<E: de::Error>(self, x: i64) -> Result<Self::Value, E> {
                self.visit_f64(x as f64)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
                let radiance = Color::new(ColorVisitor::<ZeroOrAbove>::new().visit_seq(seq)?);
                Ok(EmissionDef { radiance, two_sided: false })
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                let table = Table::deserialize(de::value::MapAccessDeserializer::new(map))?;
                Ok(EmissionDef { radiance: table.radiance, two_sided: table.two_sided })
            }
        }
        d.deserialize_any(Emission)
    }
}

impl<'de> Deserialize<'de> for Albedo {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        struct AlbedoVisitor;
        impl<'de> Visitor<'de> for AlbedoVisitor {
            type Value = Albedo;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a colour, the name of a texture, or a texture such as { checker = {…} }")
            }
            fn visit_f64<E: de::Error>(self, x: f64) -> Result<Albedo, E> {
                Ok(Albedo::Constant(Color::new(ColorVisitor::<Fraction>::new().visit_f64(x)?)))
            }
            fn visit_i64<E: de::Error>(self, x: i64) -> Result<Albedo, E> {
                self.visit_f64(x as f64)
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<Albedo, E> {
                Ok(Albedo::Named(name.to_owned()))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Albedo, A::Error> {
                Ok(Albedo::Constant(Color::new(ColorVisitor::<Fraction>::new().visit_seq(seq)?)))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Albedo, A::Error> {
                let texture = TextureDef::deserialize(de::value::MapAccessDeserializer::new(map))?;
                Ok(Albedo::Inline(Box::new(texture)))
            }
        }
        d.deserialize_any(AlbedoVisitor)
    }
}

impl<'de> Deserialize<'de> for PhaseDef {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        const NAMES: [&str; 2] = ["isotropic", "rayleigh"];
        struct Phase;
        impl<'de> Visitor<'de> for Phase {
            type Value = PhaseDef;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("\"isotropic\", \"rayleigh\", or a table such as { hg = g } or { droplets = 10 }")
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<PhaseDef, E> {
                match name {
                    "isotropic" => Ok(PhaseDef::Isotropic),
                    "rayleigh" => Ok(PhaseDef::Rayleigh),
                    _ => {
                        let meant = nearest(name, NAMES);
                        let hint = did_you_mean(meant);
                        let expected: &dyn de::Expected = &self;
                        let message =
                            format!("there is no phase function `{name}`: expected {expected}{hint}");
                        Err(E::custom(message))
                    }
                }
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<PhaseDef, A::Error> {
                PhaseTableDef::deserialize(de::value::MapAccessDeserializer::new(map)).map(PhaseDef::Table)
            }
        }
        d.deserialize_any(Phase)
    }
}
