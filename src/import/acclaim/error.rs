//! What can be wrong with a pair of Acclaim files.

use crate::explain::{Explain, Explanation, explained};
use crate::file::unread;
use std::io;
use std::path::PathBuf;

/// Why an ASF or AMC file couldn't be read. Lines are counted from 1.
#[derive(Debug)]
pub(crate) enum AcclaimError {
    /// An AMC file whose skeleton isn't to be had. `wanted` is the name that it should have.
    NoSkeleton { reason: String, wanted: String },
    /// The skeleton of an AMC file is there, and can't be read.
    Unread { path: PathBuf, source: io::Error },
    /// The skeleton of an AMC file is broken.
    Skeleton {
        path: PathBuf,
        source: Box<AcclaimError>,
    },
    /// A word where another one should be.
    Unexpected {
        line: usize,
        found: String,
        expected: &'static str,
    },
    /// A line that contradicts others.
    Broken {
        line: usize,
        reason: String,
        remedy: &'static str,
    },
    /// A skeleton without bones.
    NoBones,
    /// An AMC file without motion.
    NoFrames,
}

explained!(AcclaimError);

impl Explain for AcclaimError {
    fn explain(&self) -> Explanation {
        let at = |line, cause: &str| Explanation::input(cause).place(format!("line {line}"));
        match self {
            Self::NoSkeleton { reason, wanted } => Explanation::input(format!(
                "an AMC file is motion without a skeleton, and {reason}"
            ))
            .remedy(format!("put its skeleton beside it as {wanted}")),
            Self::Unread { path, source } => unread(source).file(path),
            Self::Skeleton { path, source } => source.explain().file(path),
            Self::Unexpected {
                line,
                found,
                expected,
            } => at(line, &format!("`{found}` where {expected} should be"))
                .remedy("repair that line"),
            Self::Broken {
                line,
                reason,
                remedy,
            } => at(line, reason).remedy(remedy),
            Self::NoBones => Explanation::input("no bones, where an Acclaim skeleton has some")
                .remedy("write or download the skeleton again"),
            Self::NoFrames => Explanation::input("no frames").remedy("write the file again"),
        }
    }
}
