//! What can go wrong between a file and a clip.

use super::acclaim::AcclaimError;
use super::bvh::BvhError;
use super::deepmimic::DeepMimicError;
use super::fbx::FbxError;
use super::gltf::GltfError;
use crate::clip;
use crate::humanoid::NotHumanoid;

/// Why a file couldn't become a clip. Every message names the file and says what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    #[error("{file}: cannot be read ({source}); check the path and its permissions")]
    Io {
        file: String,
        source: std::io::Error,
    },
    #[error("{file}: {size} bytes are more than the {limit} that are read; split the file")]
    TooLarge { file: String, size: u64, limit: u64 },
    #[error("{file}: {reason}")]
    Unsupported { file: String, reason: String },
    #[error("{file}: {source}")]
    Fbx { file: String, source: FbxError },
    #[error("{file}: {source}")]
    Gltf { file: String, source: GltfError },
    #[error("{file}: {source}")]
    Bvh { file: String, source: BvhError },
    #[error("{file}: {source}")]
    Acclaim { file: String, source: AcclaimError },
    #[error("{file}: {source}")]
    DeepMimic {
        file: String,
        source: DeepMimicError,
    },
    #[error("{file}: {reason}")]
    NoTakes { file: String, reason: &'static str },
    #[error("{file}: holds no joints; export it with its skeleton")]
    NoJoints { file: String },
    #[error("{file}: no take `{wanted}`; it has {takes}")]
    UnknownTake {
        file: String,
        wanted: String,
        takes: String,
    },
    #[error("{file}: {reason}")]
    Take { file: String, reason: String },
    #[error(
        "{file}: trim {from}..{to} s leaves nothing of take `{take}`, which lasts {duration} s; trim within it"
    )]
    EmptyTrim {
        file: String,
        take: String,
        from: f64,
        to: f64,
        duration: f64,
    },
    #[error(
        "{file}: a rate of {fps} frames per second can't be sampled; give a positive number up to 10000 with --fps"
    )]
    Rate { file: String, fps: f64 },
    #[error(
        "{file}: a unit of {unit_m} m can't be used; give a positive number of metres with --unit"
    )]
    Unit { file: String, unit_m: f64 },
    #[error(
        "{file}: take `{take}` would have {frames} frames of {nodes} nodes; shorten it with --trim or lower --fps"
    )]
    TooLong {
        file: String,
        take: String,
        frames: f64,
        nodes: usize,
    },
    #[error(
        "{file}: joint `{joint}` has no finite place {place}; repair its keys in the tool that wrote them"
    )]
    NotFinite {
        file: String,
        joint: String,
        place: String,
    },
    #[error(
        "{file}: left and right aren't known, so it can't be mirrored: {source}; import it without, then `mimic edit --mirror --map FILE`"
    )]
    NoSides { file: String, source: NotHumanoid },
    #[error("{file}: {source}")]
    Mirror { file: String, source: clip::Error },
}
