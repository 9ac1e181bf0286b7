//! The part of a glTF file's JSON that says how nodes move.
//!
//! Everything else (meshes, materials, textures) is left unread, so that faults there can't keep the motion from
//! being imported. Names and meanings are those of the glTF 2.0 specification.

use super::GltfError;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
#[derive(Default)]
pub(super) struct Document {
    pub nodes: Vec<Node>,
    pub skins: Vec<Skin>,
    pub animations: Vec<Animation>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<BufferView>,
    pub buffers: Vec<Buffer>,
    pub extensions_required: Vec<String>,
    pub extensions: Extensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Node {
    pub name: Option<String>,
    pub children: Vec<usize>,
    /// Column by column.
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    /// x, y, z, w.
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    pub mesh: Option<IgnoredAny>,
    pub camera: Option<IgnoredAny>,
    pub extensions: BTreeMap<String, IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    pub joints: Vec<usize>,
    pub inverse_bind_matrices: Option<usize>,
}

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
    pub sampler: usize,
    pub target: Target,
}

#[derive(Deserialize)]
pub(super) struct Target {
    pub node: Option<usize>,
    pub path: String,
}

#[derive(Deserialize)]
pub(super) struct Sampler {
    pub input: usize,
    pub output: usize,
    #[serde(default)]
    pub interpolation: Interpolation,
}

#[derive(Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Interpolation {
    #[default]
    Linear,
    Step,
    CubicSpline,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: usize,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<Sparse>,
}

#[derive(Deserialize)]
pub(super) struct Sparse {
    pub count: usize,
    pub indices: SparsePart,
    pub values: SparsePart,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparsePart {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: usize,
    /// Only the indices have one.
    pub component_type: Option<u32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
    #[serde(default)]
    pub extensions: BTreeMap<String, IgnoredAny>,
}

#[derive(Deserialize)]
pub(super) struct Buffer {
    pub uri: Option<String>,
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
    serde_json::from_slice(json).map_err(GltfError::Json)
}
