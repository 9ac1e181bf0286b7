//! The part of a glTF file's JSON that says how nodes move.
//!
//! Everything else (meshes, materials, textures) is left unread, so that faults there can't keep the motion from being
//! imported. The entries are those of [`gltf::json`], which checks their types but not their indices.

use super::error::GltfError;
use super::indices;
use gltf::json::animation::{Property, Sampler};
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Accessor, Buffer, Index, Node, Skin, buffer};
use serde::de::{Error as _, IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Document {
    #[serde(deserialize_with = "bounded::<_, _, MOST_NODES>")]
    pub nodes: Vec<Node>,
    #[serde(deserialize_with = "bounded::<_, _, MOST_ENTRIES>")]
    pub skins: Vec<Skin>,
    #[serde(deserialize_with = "bounded::<_, _, MOST_ENTRIES>")]
    pub animations: Vec<Animation>,
    #[serde(deserialize_with = "bounded::<_, _, MOST_ENTRIES>")]
    pub accessors: Vec<Accessor>,
    #[serde(deserialize_with = "bounded::<_, _, MOST_ENTRIES>")]
    pub buffer_views: Vec<buffer::View>,
    #[serde(deserialize_with = "bounded::<_, _, MOST_ENTRIES>")]
    pub buffers: Vec<Buffer>,
    #[serde(deserialize_with = "bounded::<_, _, MOST_NAMES>")]
    pub extensions_required: Vec<String>,
    #[serde(skip)]
    extended: Extended,
    /// The extensions that name bones; `None` where they can't be read.
    #[serde(skip)]
    pub extensions: Option<Extensions>,
}

/// Most nodes, and most entries of other lists. Chosen, as a bound on memory: three bytes of JSON can make an entry that takes
/// hundreds of bytes here.
const MOST_NODES: usize = 1 << 15;
const MOST_ENTRIES: usize = 1 << 17;
/// Most extensions that a file may require. Chosen: there are some hundred.
const MOST_NAMES: usize = 1 << 10;

/// A list of at most `MOST` entries.
fn bounded<'de, D, T, const MOST: usize>(list: D) -> Result<Vec<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    list.deserialize_seq(Bounded::<T, MOST>(PhantomData))
}

struct Bounded<T, const MOST: usize>(PhantomData<T>);

impl<'de, T: Deserialize<'de>, const MOST: usize> Visitor<'de> for Bounded<T, MOST> {
    type Value = Vec<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a list of at most {MOST} entries")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Vec<T>, A::Error> {
        let mut list = Vec::new();
        while let Some(entry) = entries.next_element()? {
            if list.len() == MOST {
                return Err(A::Error::invalid_length(list.len() + 1, &self));
            }
            list.push(entry);
        }
        Ok(list)
    }
}

/// An animation. Its channels may lack a node, as those of extensions do, which [`gltf::json::animation::Target`] refuses.
#[derive(Deserialize)]
pub(super) struct Animation {
    pub name: Option<String>,
    #[serde(default)]
    pub channels: Vec<Channel>,
    #[serde(default)]
    pub samplers: Vec<Sampler>,
}

#[derive(Deserialize)]
pub(super) struct Channel {
    pub sampler: Index<Sampler>,
    pub target: Target,
}

#[derive(Deserialize)]
pub(super) struct Target {
    pub node: Option<Index<Node>>,
    pub path: Checked<Property>,
}

/// Names of the extensions of every node and buffer view, which [`gltf::json`] drops.
#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Extended {
    nodes: Vec<Names>,
    buffer_views: Vec<Names>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Names {
    extensions: Option<BTreeMap<String, IgnoredAny>>,
}

impl Names {
    fn iter(&self) -> impl Iterator<Item = &String> {
        self.extensions.iter().flat_map(BTreeMap::keys)
    }
}

impl Document {
    /// Whether an extension makes a light of this node.
    pub fn is_light(&self, node: usize) -> bool {
        let names = self.extended.nodes.get(node);
        names.is_some_and(|names| names.iter().any(|name| name == "KHR_lights_punctual"))
    }

    /// The extension that compresses this buffer view's bytes.
    pub fn packing(&self, view: usize) -> Option<&str> {
        let mut names = self.extended.buffer_views.get(view)?.iter();
        names
            .find(|name| name.contains("meshopt_compression"))
            .map(String::as_str)
    }
}

/// A size or offset. One too large for this machine fits nowhere.
pub(super) fn size(bytes: USize64) -> usize {
    usize::try_from(bytes.0).unwrap_or(usize::MAX)
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Extending {
    extensions: Extensions,
}

/// The extensions that name bones: VRM models, old and new, and VRM animations.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Extensions {
    #[serde(rename = "VRM")]
    vrm_0: Vrm,
    #[serde(rename = "VRMC_vrm")]
    vrm_1: Vrm,
    #[serde(rename = "VRMC_vrm_animation")]
    vrm_animation: Vrm,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Vrm {
    humanoid: Humanoid,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Humanoid {
    human_bones: HumanBones,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum HumanBones {
    List(Vec<HumanBone>),
    Named(BTreeMap<String, HumanBone>),
}

impl Default for HumanBones {
    fn default() -> Self {
        Self::List(Vec::new())
    }
}

impl HumanBones {
    fn named(&self) -> Vec<(i64, &str)> {
        match self {
            Self::List(bones) => bones.iter().map(|b| (b.node, b.bone.as_str())).collect(),
            Self::Named(bones) => bones
                .iter()
                .map(|(name, b)| (b.node, name.as_str()))
                .collect(),
        }
    }
}

#[derive(Deserialize)]
struct HumanBone {
    /// Its name, in lists.
    #[serde(default)]
    bone: String,
    /// −1 where the humanoid lacks the bone.
    node: i64,
}

impl Extensions {
    /// Nodes that are bones of a VRM humanoid, and which; the file may lack them.
    pub fn bones(&self) -> impl Iterator<Item = (usize, &str)> {
        let all = [&self.vrm_0, &self.vrm_1, &self.vrm_animation];
        let bones = all
            .into_iter()
            .flat_map(|vrm| vrm.humanoid.human_bones.named());
        bones.filter_map(|(node, bone)| Some((usize::try_from(node).ok()?, bone)))
    }
}

#[derive(Deserialize)]
struct Stamp {
    asset: Asset,
}

#[derive(Deserialize)]
struct Asset {
    version: String,
}

/// Reads the JSON. The version is checked first, because glTF 1 has another layout.
pub(super) fn parse(json: &[u8]) -> Result<Document, GltfError> {
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let broken = |e: serde_json::Error| GltfError::Json {
        reason: e.to_string(),
    };
    let stamp: Stamp = serde_json::from_slice(json).map_err(broken)?;
    if !stamp.asset.version.starts_with("2.") {
        return Err(GltfError::Version {
            found: stamp.asset.version,
        });
    }
    indices::check(json).map_err(broken)?;
    let document: Document = serde_json::from_slice(json)
        .or_else(|e| serde_json::from_slice(&without_extras(json)).map_err(|_| e))
        .map_err(broken)?;
    let extended = serde_json::from_slice(json).map_err(broken)?;
    let extending = serde_json::from_slice(json).ok();
    Ok(Document {
        extended,
        extensions: extending.map(|Extending { extensions }| extensions),
        ..document
    })
}

/// The same JSON with every `extras` emptied: by the specification it may be anything, but [`gltf::json`] wants an object.
fn without_extras(json: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(json.len() + json.len() / 8);
    let mut at = 0;
    while at < json.len() {
        let token = json.get(at..token_end(json, at)).unwrap_or_default();
        at += token.len();
        out.extend(token);
        let rest = json.get(at..).unwrap_or_default();
        let value = rest.trim_ascii_start().strip_prefix(b":");
        if let (b"\"extras\"", Some(value)) = (token, value) {
            out.extend(b":{}");
            at = value_end(json, json.len() - value.len());
        }
    }
    out
}

/// End of the string or the single byte at `at`.
fn token_end(json: &[u8], at: usize) -> usize {
    let mut end = at + 1;
    if json.get(at) == Some(&b'"') {
        while let Some(byte) = json.get(end).filter(|byte| **byte != b'"') {
            end += if *byte == b'\\' { 2 } else { 1 };
        }
        end += 1;
    }
    end.min(json.len())
}

/// Where the value that begins at `at` ends: at the comma or bracket after it.
fn value_end(json: &[u8], mut at: usize) -> usize {
    let mut depth = 0_usize;
    while let Some(byte) = json.get(at) {
        match byte {
            b'{' | b'[' => depth += 1,
            b'}' | b']' | b',' if depth == 0 => break,
            b'}' | b']' => depth -= 1,
            _ => {}
        }
        at = token_end(json, at);
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extras_of_any_kind_are_emptied() {
        for (json, emptied) in [
            (r#"{"extras":1}"#, r#"{"extras":{}}"#),
            (
                r#"{"extras" : "a\"},{", "b": 2}"#,
                r#"{"extras":{}, "b": 2}"#,
            ),
            (
                r#"[{"extras":[1,{"extras":null}]},"extras"]"#,
                r#"[{"extras":{}},"extras"]"#,
            ),
            (r#"{"a":"\\","extras":{}}"#, r#"{"a":"\\","extras":{}}"#),
        ] {
            let found = without_extras(json.as_bytes());
            assert_eq!(String::from_utf8_lossy(&found), emptied);
        }
        for cut in [
            r#"{"extras":"#,
            r#"{"extras":["#,
            r#"{"extras":"\"#,
            "\"",
            "",
        ] {
            without_extras(cut.as_bytes());
        }
    }

    #[test]
    fn lists_have_a_bound() {
        let nodes = |count: usize| {
            format!(
                "{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}]}}",
                vec!["{}"; count].join(",")
            )
        };
        assert!(parse(nodes(MOST_NODES).as_bytes()).is_ok());
        let error = parse(nodes(MOST_NODES + 1).as_bytes())
            .map(|_| ())
            .expect_err("too many");
        assert!(
            error.to_string().contains("at most 32768 entries"),
            "{error}"
        );
    }
}
