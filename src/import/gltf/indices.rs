//! Indices that a file can't have. [`gltf::json`] keeps the lower 32 bits of an index, so that 2³² would mean the first
//! entry of a list.

use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// Keys of a glTF file whose values are indices, or lists of them (glTF 2.0 specification, appendix A).
const INDICES: [&str; 13] = [
    "buffer",
    "bufferView",
    "children",
    "indices",
    "input",
    "inverseBindMatrices",
    "joints",
    "mesh",
    "node",
    "output",
    "sampler",
    "skeleton",
    "skin",
];

/// Checks that all indices of a JSON text fit in 32 bits. What else the text holds is for others to check.
pub(super) fn check(json: &[u8]) -> Result<(), serde_json::Error> {
    let mut text = serde_json::Deserializer::from_slice(json);
    Below { key: None }.deserialize(&mut text)
}

/// The values below a key of [`INDICES`], or below another one.
#[derive(Clone, Copy)]
struct Below {
    key: Option<&'static str>,
}

impl<'de> DeserializeSeed<'de> for Below {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, value: D) -> Result<(), D::Error> {
        value.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Below {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(key) = map.next_key::<std::borrow::Cow<'de, str>>()? {
            // These may hold anything.
            if matches!(&*key, "extras" | "extensions") {
                map.next_value::<IgnoredAny>()?;
                continue;
            }
            let key = INDICES.into_iter().find(|name| *name == key);
            map.next_value_seed(Below { key })?;
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        while list.next_element_seed(self)?.is_some() {}
        Ok(())
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<(), E> {
        match self.key {
            Some(key) if u32::try_from(number).is_err() => Err(E::custom(format!(
                "`{key}` is {number}, and no list has so many entries"
            ))),
            _ => Ok(()),
        }
    }

    fn visit_bool<E: Error>(self, _: bool) -> Result<(), E> {
        Ok(())
    }

    fn visit_i64<E: Error>(self, _: i64) -> Result<(), E> {
        Ok(())
    }

    fn visit_f64<E: Error>(self, _: f64) -> Result<(), E> {
        Ok(())
    }

    fn visit_str<E: Error>(self, _: &str) -> Result<(), E> {
        Ok(())
    }

    fn visit_unit<E: Error>(self) -> Result<(), E> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_beyond_32_bits_are_found_wherever_they_stand() {
        for (json, key) in [
            (
                r#"{"animations":[{"channels":[{"target":{"node":4294967296}}]}]}"#,
                "node",
            ),
            (r#"{"nodes":[{"children":[1,4294967297]}]}"#, "children"),
            (
                r#"{"accessors":[{"sparse":{"values":{"bufferView":18446744073709551615}}}]}"#,
                "bufferView",
            ),
            (r#"{"skins":[{"joints":[99999999999]}]}"#, "joints"),
        ] {
            let error = check(json.as_bytes()).expect_err(json).to_string();
            assert!(error.contains(&format!("`{key}`")), "{error}");
            assert!(error.contains("line 1 column"), "{error}");
        }
        for json in [
            r#"{"nodes":[{"children":[1,4294967295]}],"buffers":[{"byteLength":4294967296}]}"#,
            r#"{"extras":{"node":4294967296},"nodes":[{"name":"a\nb","mesh":-1,"scale":[1.5,null,true]}]}"#,
        ] {
            assert!(check(json.as_bytes()).is_ok(), "{json}");
        }
    }
}
