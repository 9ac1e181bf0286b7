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
        "a rate of {fps} frames per second can't be sampled; give a positive number up to 10000"
    )]
    Rate { fps: f64 },
    #[error(
        "nothing is left after a trim from {from} s to {to:.3} s of a clip of {duration:.3} s; trim within it"
    )]
    EmptyTrim { from: f64, to: f64, duration: f64 },
    #[error(
        "{duration:.3} s at {fps} Hz would be more than 20 million transforms; make it shorter or lower its rate"
    )]
    TooLong { duration: f64, fps: f64 },
    #[error("{what} of {value} can't be used; give {wanted}")]
    Number {
        what: &'static str,
        value: f64,
        wanted: &'static str,
    },
    #[error("clip `{name}` can't be edited: {reason}; import it again")]
    Unusable { name: String, reason: String },
    #[error(
        "the time-warp {from}:{to} doesn't fit; let both its times rise from 0:0 on, the first within the {duration:.3} s of the clip"
    )]
    Warp { from: f64, to: f64, duration: f64 },
    #[error("a mirror can't swap joints {left} and {right} of {joints}; pair every joint once")]
    Pair {
        left: usize,
        right: usize,
        joints: usize,
    },
    #[error("no clips to join; give at least one")]
    NoClips,
    #[error("clip `{name}` can't follow clip `{first}`: {reason}; join clips of one figure")]
    OtherJoints {
        name: String,
        first: String,
        reason: String,
    },
    #[error("no cycle of {shortest} s or more in {duration:.3} s: {reason}")]
    NoCycle {
        shortest: f64,
        duration: f64,
        reason: &'static str,
    },
}

impl Error {
    pub(crate) fn broken(path: &Path, reason: impl Into<String>) -> Self {
        Self::Broken {
            path: path.to_owned(),
            reason: reason.into(),
        }
    }
}
