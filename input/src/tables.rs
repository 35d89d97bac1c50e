//! Tables stay tables, and lists are read whole.
//!
//! A derived reader takes a list for a table, its first entry for the first field, and so on; and where a list of two
//! is needed it may take two entries and leave the rest. Nobody writes that on purpose, and nobody notices when it is
//! read.

use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, IgnoredAny, MapAccess, SeqAccess, Unexpected, VariantAccess,
    Visitor,
};
use std::fmt;

/// A deserializer that refuses a list in the place of a table, and one with more entries than are needed, on every
/// level.
///
/// ```
/// use serde::Deserialize;
/// use spts_input::Tables;
///
/// #[derive(Deserialize)]
/// struct Press {
///     force_n: f64,
/// }
/// let read = |text| Press::deserialize(Tables(&mut serde_json::Deserializer::from_str(text)));
/// assert_eq!(read(r#"{ "force_n": 20 }"#)?.force_n, 20.0);
/// assert!(read("[20]").is_err());
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Debug)]
pub struct Tables<D>(pub D);

/// The visitor of something on the way, and whether it is of a table.
struct Inside<V> {
    visitor: V,
    table: bool,
}

macro_rules! asked {
    ($($method:ident($($name:ident: $of:ty),*) $table:literal,)*) => {$(
        fn $method<V: Visitor<'de>>(self, $($name: $of,)* visitor: V) -> Result<V::Value, D::Error> {
            self.0.$method($($name,)* Inside { visitor, table: $table })
        }
    )*};
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for Tables<D> {
    type Error = D::Error;

    asked! {
        deserialize_any() false,
        deserialize_bool() false,
        deserialize_i8() false,
        deserialize_i16() false,
        deserialize_i32() false,
        deserialize_i64() false,
        deserialize_i128() false,
        deserialize_u8() false,
        deserialize_u16() false,
        deserialize_u32() false,
        deserialize_u64() false,
        deserialize_u128() false,
        deserialize_f32() false,
        deserialize_f64() false,
        deserialize_char() false,
        deserialize_str() false,
        deserialize_string() false,
        deserialize_bytes() false,
        deserialize_byte_buf() false,
        deserialize_option() false,
        deserialize_unit() false,
        deserialize_seq() false,
        deserialize_map() false,
        deserialize_identifier() false,
        deserialize_ignored_any() false,
        deserialize_unit_struct(name: &'static str) false,
        deserialize_newtype_struct(name: &'static str) false,
        deserialize_tuple(length: usize) false,
        deserialize_tuple_struct(name: &'static str, length: usize) false,
        deserialize_struct(name: &'static str, fields: &'static [&'static str]) true,
        deserialize_enum(name: &'static str, variants: &'static [&'static str]) false,
    }

    fn is_human_readable(&self) -> bool {
        self.0.is_human_readable()
    }
}

macro_rules! visited {
    ($($method:ident($of:ty),)*) => {$(
        fn $method<E: Error>(self, value: $of) -> Result<V::Value, E> {
            self.visitor.$method(value)
        }
    )*};
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Inside<V> {
    type Value = V::Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.visitor.expecting(f)
    }

    visited! {
        visit_bool(bool),
        visit_i8(i8),
        visit_i16(i16),
        visit_i32(i32),
        visit_i64(i64),
        visit_i128(i128),
        visit_u8(u8),
        visit_u16(u16),
        visit_u32(u32),
        visit_u64(u64),
        visit_u128(u128),
        visit_f32(f32),
        visit_f64(f64),
        visit_char(char),
        visit_str(&str),
        visit_borrowed_str(&'de str),
        visit_string(String),
        visit_bytes(&[u8]),
        visit_borrowed_bytes(&'de [u8]),
        visit_byte_buf(Vec<u8>),
    }

    fn visit_none<E: Error>(self) -> Result<V::Value, E> {
        self.visitor.visit_none()
    }

    fn visit_unit<E: Error>(self) -> Result<V::Value, E> {
        self.visitor.visit_unit()
    }

    fn visit_some<D: Deserializer<'de>>(self, of: D) -> Result<V::Value, D::Error> {
        self.visitor.visit_some(Tables(of))
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, of: D) -> Result<V::Value, D::Error> {
        self.visitor.visit_newtype_struct(Tables(of))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, entries: A) -> Result<V::Value, A::Error> {
        if self.table {
            return Err(A::Error::invalid_type(Unexpected::Seq, &"a table with named fields"));
        }
        let mut entries = Entries { of: entries, read: 0 };
        let value = self.visitor.visit_seq(&mut entries)?;
        let mut count = entries.read;
        while entries.of.next_element::<IgnoredAny>()?.is_some() {
            count += 1;
        }
        if count > entries.read {
            let needed = format!("an array of length {}", entries.read);
            return Err(A::Error::invalid_length(count, &needed.as_str()));
        }
        Ok(value)
    }

    fn visit_map<A: MapAccess<'de>>(self, entries: A) -> Result<V::Value, A::Error> {
        self.visitor.visit_map(Tables(entries))
    }

    fn visit_enum<A: EnumAccess<'de>>(self, variant: A) -> Result<V::Value, A::Error> {
        self.visitor.visit_enum(Tables(variant))
    }
}

impl<'de, S: DeserializeSeed<'de>> DeserializeSeed<'de> for Tables<S> {
    type Value = S::Value;

    fn deserialize<D: Deserializer<'de>>(self, of: D) -> Result<S::Value, D::Error> {
        self.0.deserialize(Tables(of))
    }
}

/// The entries of a list, and how many of them were read.
struct Entries<A> {
    of: A,
    read: usize,
}

impl<'de, A: SeqAccess<'de>> SeqAccess<'de> for Entries<A> {
    type Error = A::Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, A::Error> {
        let entry = self.of.next_element_seed(Tables(seed))?;
        self.read += usize::from(entry.is_some());
        Ok(entry)
    }

    fn size_hint(&self) -> Option<usize> {
        self.of.size_hint()
    }
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Tables<A> {
    type Error = A::Error;

    fn next_key_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, A::Error> {
        self.0.next_key_seed(seed)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, A::Error> {
        self.0.next_value_seed(Tables(seed))
    }

    fn size_hint(&self) -> Option<usize> {
        self.0.size_hint()
    }
}

impl<'de, A: EnumAccess<'de>> EnumAccess<'de> for Tables<A> {
    type Error = A::Error;
    type Variant = Tables<A::Variant>;

    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self::Variant), A::Error> {
        self.0.variant_seed(seed).map(|(value, variant)| (value, Tables(variant)))
    }
}

impl<'de, A: VariantAccess<'de>> VariantAccess<'de> for Tables<A> {
    type Error = A::Error;

    fn unit_variant(self) -> Result<(), A::Error> {
        self.0.unit_variant()
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, A::Error> {
        self.0.newtype_variant_seed(Tables(seed))
    }

    fn tuple_variant<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, A::Error> {
        self.0.tuple_variant(length, Inside { visitor, table: false })
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, A::Error> {
        self.0.struct_variant(fields, Inside { visitor, table: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, PartialEq, Deserialize)]
    struct Outer {
        pair: (u8, u8),
        list: Vec<Inner>,
        maybe: Option<Inner>,
        kind: Kind,
    }

    #[derive(Debug, PartialEq, Deserialize)]
    struct Inner {
        a: u8,
    }

    #[derive(Debug, PartialEq, Deserialize)]
    enum Kind {
        One { b: Inner },
        Two(u8, u8),
    }

    fn read(text: &str) -> Result<Outer, String> {
        let mut reader = serde_json::Deserializer::from_str(text);
        Outer::deserialize(Tables(&mut reader)).map_err(|error| error.to_string())
    }

    #[test]
    fn lists_stay_lists_and_tables_stay_tables() {
        let whole = r#"{"pair": [1, 2], "list": [{"a": 3}], "maybe": {"a": 4}, "kind": {"One": {"b": {"a": 5}}}}"#;
        let kind = Kind::One { b: Inner { a: 5 } };
        let outer = Outer { pair: (1, 2), list: vec![Inner { a: 3 }], maybe: Some(Inner { a: 4 }), kind };
        assert_eq!(read(whole), Ok(outer));
        assert_eq!(
            read(&whole.replace(r#"{"One": {"b": {"a": 5}}}"#, r#"{"Two": [6, 7]}"#)).map(|o| o.kind),
            Ok(Kind::Two(6, 7))
        );
        for (table, list) in [
            (r#"[{"a": 3}]"#, "[[3]]"),
            (r#""maybe": {"a": 4}"#, r#""maybe": [4]"#),
            (r#"{"b": {"a": 5}}"#, r#"{"b": [5]}"#),
            (r#"{"b": {"a": 5}}"#, r#"[{"a": 5}]"#),
        ] {
            let text = whole.replace(table, list);
            assert!(text != whole);
            let said = read(&text).unwrap_err();
            assert!(said.contains("invalid type: sequence, expected a table"), "{text}: {said}");
        }
        for (list, longer) in
            [("[1, 2]", "[1, 2, 3, [4]]"), (r#"{"One": {"b": {"a": 5}}}"#, r#"{"Two": [6, 7, 8, 9]}"#)]
        {
            let said = read(&whole.replace(list, longer)).unwrap_err();
            assert!(said.contains("invalid length 4, expected an array of length 2"), "{longer}: {said}");
        }
    }
}
