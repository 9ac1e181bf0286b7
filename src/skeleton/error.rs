//! What can be wrong with a character's description.

use std::path::PathBuf;

/// Why a skeleton could not be loaded. Every message names the file or element and what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum SkeletonError {
    #[error("cannot read `{path}`: {source}", path = path.display())]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("no skeleton is called `{name}`: use one of {known}, or a path to an MJCF file (.xml)")]
    UnknownName { name: String, known: String },
    #[error("skeleton `{skeleton}` is not valid MJCF: {message}")]
    Mjcf { skeleton: String, message: String },
    #[error("skeleton `{skeleton}`, {place}: {message}")]
    Unsupported {
        skeleton: String,
        /// Element at fault, e.g. "joint `knee`".
        place: String,
        message: String,
    },
    #[error("slots of skeleton `{skeleton}`: {message}")]
    Slots { skeleton: String, message: String },
}
