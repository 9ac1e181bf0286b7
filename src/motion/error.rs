//! What can go wrong with motion files.

use std::path::PathBuf;

/// Why a motion could not be read, written or used.
#[derive(Debug, thiserror::Error)]
pub enum MotionError {
    #[error("cannot read `{path}`: {source}", path = path.display())]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("cannot write `{path}`: {message}", path = path.display())]
    Write { path: PathBuf, message: String },
    #[error("`{path}` is not a motion: {message}", path = path.display())]
    Format { path: PathBuf, message: String },
    #[error(
        "motion `{motion}` was made for skeleton `{made_for}`, which differs from `{skeleton}`: retarget it again"
    )]
    OtherSkeleton {
        motion: String,
        made_for: String,
        skeleton: String,
    },
}
