//! What can go wrong with a clip and its file.

use std::path::{Path, PathBuf};

/// Why a clip couldn't be read, written or changed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    #[error("{}: {source}; check the path and its permissions", path.display())]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{}: not a clip that can be used: {reason}; import it again", path.display())]
    Broken { path: PathBuf, reason: String },
    #[error(
        "a rate of {fps} frames per second can't be sampled; give a positive one that keeps the clip under 20 million transforms"
    )]
    Rate { fps: f64 },
    #[error("trim {from}..{to} s leaves nothing of a clip of {duration} s; trim within it")]
    EmptyTrim { from: f64, to: f64, duration: f64 },
}

impl Error {
    pub(crate) fn broken(path: &Path, reason: impl Into<String>) -> Self {
        Self::Broken {
            path: path.to_owned(),
            reason: reason.into(),
        }
    }
}
