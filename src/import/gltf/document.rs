//! The part of a glTF file's JSON that says how nodes move.
//!
//! Everything else (meshes, materials, textures) is left unread, so that faults there can't keep the motion from
//! being imported. Its entries are those of [`gltf::json`], which checks their kinds but no index.

use super::GltfError;
use gltf::json::animation::{Property, Sampler};
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Accessor, Buffer, Index, Node, Skin, buffer};
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;
use std::collections::BTreeMap;

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Document {
    pub nodes: Vec<Node>,
    pub skins: Vec<Skin>,
    pub animations: Vec<Animation>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<buffer::View>,
    pub buffers: Vec<Buffer>,
    pub extensions_required: Vec<String>,
    pub extensions: Extensions,
    #[serde(skip)]
    extended: Extended,
}

/// An animation whose channels may lack a node, as those of extensions do; [`gltf::json::animation::Target`] wants one.
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

/// Names of the extensions of every node and buffer view, which [`gltf::json`] leaves out.
#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Extended {
    nodes: Vec<Names>,
    buffer_views: Vec<Names>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Names {
    extensions: BTreeMap<String, IgnoredAny>,
}

impl Document {
    /// Whether an extension makes a light of this node.
    pub fn is_light(&self, node: usize) -> bool {
        let names = self.extended.nodes.get(node);
        names.is_some_and(|names| names.extensions.contains_key("KHR_lights_punctual"))
    }

    /// The extension that this buffer view's bytes are packed with.
    pub fn packing(&self, view: usize) -> Option<&str> {
        let mut names = self.extended.buffer_views.get(view)?.extensions.keys();
        names
            .find(|name| name.contains("meshopt_compression"))
            .map(String::as_str)
    }
}

/// A size or offset; those that can't be addressed fit nowhere.
pub(super) fn size(bytes: USize64) -> usize {
    usize::try_from(bytes.0).unwrap_or(usize::MAX)
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

#[derive(Deserialize)]
struct HumanBone {
    node: usize,
}

impl Extensions {
    /// Nodes that are bones of a VRM humanoid.
    pub fn bones(&self) -> Vec<usize> {
        let all = [&self.vrm_0, &self.vrm_1, &self.vrm_animation];
        let nodes = |vrm: &&Vrm| match &vrm.humanoid.human_bones {
            HumanBones::List(bones) => bones.iter().map(|bone| bone.node).collect::<Vec<_>>(),
            HumanBones::Named(bones) => bones.values().map(|bone| bone.node).collect(),
        };
        all.iter().flat_map(nodes).collect()
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

/// Reads the JSON, whose version is looked at first: glTF 1 has another layout.
pub(super) fn parse(json: &[u8]) -> Result<Document, GltfError> {
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let stamp: Stamp = serde_json::from_slice(json).map_err(GltfError::Json)?;
    if !stamp.asset.version.starts_with("2.") {
        return Err(GltfError::Version(stamp.asset.version));
    }
    let document: Document = serde_json::from_slice(json)
        .or_else(|e| without_extras(json).ok_or(e))
        .map_err(GltfError::Json)?;
    let extended = serde_json::from_slice(json).map_err(GltfError::Json)?;
    Ok(Document {
        extended,
        ..document
    })
}

/// The same without `extras`, which may be anything, but which [`gltf::json`] wants to be objects.
fn without_extras(json: &[u8]) -> Option<Document> {
    let mut value = serde_json::from_slice(json).ok()?;
    drop_extras(&mut value);
    serde_json::from_value(value).ok()
}

/// The parser bounds how deep values nest.
fn drop_extras(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(drop_extras),
        Value::Object(entries) => {
            entries.remove("extras");
            entries.values_mut().for_each(drop_extras);
        }
        _ => {}
    }
}
