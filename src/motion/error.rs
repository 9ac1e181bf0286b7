//! What can go wrong with motions.

use crate::explain::{Explain, Explanation, Parameter, explained};
use crate::file::FileError;

/// Why a motion can't be read, written or used.
#[derive(Debug)]
#[non_exhaustive]
pub enum MotionError {
    /// The motion's file can't be written, read or used.
    File(FileError),
    /// The motion was made for another skeleton.
    OtherSkeleton {
        /// Name of the motion.
        motion: String,
        /// Name of the skeleton that the motion was made for.
        made_for: String,
        /// Name of the skeleton that was to move by it.
        skeleton: String,
    },
}

impl Explain for MotionError {
    fn explain(&self) -> Explanation {
        match self {
            Self::File(error) => error.explain(),
            Self::OtherSkeleton {
                motion,
                made_for,
                skeleton,
            } => Explanation::input(match made_for == skeleton {
                true => format!(
                    "motion `{motion}` was made for another skeleton that is called `{skeleton}` too, or for this one before it changed"
                ),
                false => {
                    format!("motion `{motion}` was made for skeleton `{made_for}`, not for `{skeleton}`")
                }
            })
            .remedy_by(
                Parameter::Skeleton,
                "use that skeleton, or retarget the clip again",
            ),
        }
    }
}

explained!(MotionError);

impl From<FileError> for MotionError {
    fn from(error: FileError) -> Self {
        Self::File(error)
    }
}
