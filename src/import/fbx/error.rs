//! What can be wrong with an FBX file.

use crate::explain::{Explain, Explanation, explained};

/// Why a file can't be read as FBX.
#[derive(Debug)]
pub(crate) enum FbxError {
    /// Neither binary nor ASCII FBX.
    NotFbx,
    /// ASCII FBX, in a build without `ufbx`.
    Ascii,
    /// Big-endian FBX, in a build without `ufbx`.
    BigEndian,
    /// A version other than 7.0 to 7.9, in a build without `ufbx`.
    Version { found: u32 },
    /// `ufbx` refused the file.
    #[cfg(feature = "ufbx")]
    Ufbx { reason: String },
    /// A broken container, or takes that cost too much to evaluate.
    Broken { place: String, reason: String },
    /// A curve that can't be read.
    Curve {
        take: String,
        /// The joint or the layer's weight that the curve drives.
        driven: String,
        /// The curve's number in the file.
        id: i64,
        reason: &'static str,
    },
}

explained!(FbxError);

impl Explain for FbxError {
    fn explain(&self) -> Explanation {
        let foreign = |kind: String| {
            Explanation::input(format!(
                "{kind}, which this build can't read without the feature `ufbx`"
            ))
            .remedy("save it as binary FBX 7.4 or 7.5")
        };
        let broken = |reason: &str, place: String| {
            Explanation::input(reason)
                .place(place)
                .remedy("export or download it again")
        };
        match self {
            Self::NotFbx => Explanation::input("not an FBX file")
                .remedy("check that it was downloaded whole, and what wrote it"),
            Self::Ascii => foreign("ASCII FBX".to_owned()),
            Self::BigEndian => foreign("big-endian FBX".to_owned()),
            Self::Version { found } => foreign(format!("FBX version {found}")),
            #[cfg(feature = "ufbx")]
            Self::Ufbx { reason } => {
                Explanation::input(format!("broken FBX, as ufbx reads it: {reason}"))
                    .remedy("export it again, best as binary FBX 7.4 or 7.5")
            }
            Self::Broken { place, reason } => {
                broken(&format!("broken FBX: {reason}"), place.clone())
            }
            Self::Curve {
                take,
                driven,
                id,
                reason,
            } => broken(
                reason,
                format!("take `{take}`, {driven}, animation curve {id}"),
            ),
        }
    }
}

/// A broken container, found at byte `at`.
pub(super) fn broken(at: usize, reason: &str) -> FbxError {
    FbxError::Broken {
        place: format!("byte {at}"),
        reason: reason.into(),
    }
}
