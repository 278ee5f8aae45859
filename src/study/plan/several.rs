//! Values of a plan that may be one or several.

use serde::de::value::SeqAccessDeserializer;
use serde::de::{self, IntoDeserializer, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::marker::PhantomData;

/// A list, or its only item without brackets. Not an untagged enum, which would lose the message about an invalid item.
pub(super) struct Several<T>(pub Vec<T>);

impl<T> Default for Several<T> {
    fn default() -> Self {
        Several(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Several<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(SeveralVisitor(PhantomData))
    }
}

struct SeveralVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for SeveralVisitor<T> {
    type Value = Several<T>;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("one item or a list of them")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, items: A) -> Result<Several<T>, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(items)).map(Several)
    }

    fn visit_i64<E: de::Error>(self, item: i64) -> Result<Several<T>, E> {
        T::deserialize(item.into_deserializer()).map(|item| Several(vec![item]))
    }

    fn visit_f64<E: de::Error>(self, item: f64) -> Result<Several<T>, E> {
        T::deserialize(item.into_deserializer()).map(|item| Several(vec![item]))
    }

    fn visit_str<E: de::Error>(self, item: &str) -> Result<Several<T>, E> {
        T::deserialize(item.into_deserializer()).map(|item| Several(vec![item]))
    }
}
