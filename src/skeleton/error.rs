//! What can be wrong with the description of a character.

use super::Skeleton;
use crate::explain::{Explain, Explanation, Parameter, did_you_mean, explained};
use crate::file::unread;
use std::path::{Path, PathBuf};

/// Why a skeleton could not be loaded.
#[derive(Debug)]
pub enum SkeletonError {
    /// A file that cannot be read.
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A name that is neither a built-in character's nor a file's.
    UnknownName {
        /// The name.
        name: String,
    },
    /// MJCF that is not valid, or that describes something else than one character.
    Mjcf {
        /// Name of the skeleton.
        skeleton: String,
        /// The MJCF file, if the text came from one.
        file: Option<PathBuf>,
        /// The element at fault, such as "joint `knee`"; `None` for the text as a whole.
        place: Option<String>,
        /// What is wrong.
        cause: String,
        /// What to do, beginning with a verb.
        remedy: String,
    },
    /// Humanoid slots that cannot be read, or that name no body.
    Slots {
        /// Name of the skeleton.
        skeleton: String,
        /// The JSON file, if the text came from one.
        file: Option<PathBuf>,
        /// What is wrong.
        cause: String,
        /// What to do, beginning with a verb.
        remedy: String,
    },
}

impl SkeletonError {
    /// A defect at `place` of the MJCF of `skeleton`.
    pub(super) fn mjcf(skeleton: &str, place: Option<String>, defect: Defect) -> Self {
        let Defect { cause, remedy } = defect;
        Self::Mjcf {
            skeleton: skeleton.into(),
            file: None,
            place,
            cause,
            remedy,
        }
    }

    /// A defect of the slots of `skeleton`.
    pub(super) fn slots(skeleton: &str, defect: Defect) -> Self {
        let Defect { cause, remedy } = defect;
        Self::Slots {
            skeleton: skeleton.into(),
            file: None,
            cause,
            remedy,
        }
    }

    /// The same error with the names of the files that the texts came from.
    pub(crate) fn in_files(mut self, mjcf: &Path, slots: &Path) -> Self {
        match &mut self {
            Self::Mjcf { file, .. } => *file = Some(mjcf.to_owned()),
            Self::Slots { file, .. } => *file = Some(slots.to_owned()),
            Self::Read { .. } | Self::UnknownName { .. } => {}
        }
        self
    }
}

impl Explain for SkeletonError {
    fn explain(&self) -> Explanation {
        let built_in = || Skeleton::built_in().collect::<Vec<_>>().join(", ");
        match self {
            Self::Read { path, source } => {
                let told = unread(source).file(path);
                let advice = told.remedy.as_ref().map_or("", |remedy| &remedy.advice);
                let advice = format!("{advice}, or use a built-in character: {}", built_in());
                told.remedy_by(Parameter::Skeleton, advice)
            }
            Self::UnknownName { name } => {
                let advice = did_you_mean(name, Skeleton::built_in()).unwrap_or_else(|| {
                    format!("use one of {}, or an MJCF file (.xml)", built_in())
                });
                Explanation::input(format!("no skeleton is called `{name}`"))
                    .remedy_by(Parameter::Skeleton, advice)
            }
            Self::Mjcf {
                skeleton,
                file,
                place,
                cause,
                remedy,
            } => located(skeleton, file.as_deref(), place.as_deref(), cause).remedy(remedy),
            Self::Slots {
                skeleton,
                file,
                cause,
                remedy,
            } => located(skeleton, file.as_deref(), Some("slots"), cause).remedy(remedy),
        }
    }
}

/// An error in a file, or, where there is none, in the skeleton by its name.
fn located(skeleton: &str, file: Option<&Path>, place: Option<&str>, cause: &str) -> Explanation {
    let error = Explanation::input(cause);
    match (file, place) {
        (Some(file), Some(place)) => error.file(file).place(place),
        (Some(file), None) => error.file(file),
        (None, Some(place)) => error.place(format!("skeleton `{skeleton}`, {place}")),
        (None, None) => error.place(format!("skeleton `{skeleton}`")),
    }
}

explained!(SkeletonError);

/// What is wrong with one element, before its name and file are known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Defect {
    pub cause: String,
    pub remedy: String,
}

impl Defect {
    /// `remedy` begins with a verb.
    pub fn new(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            cause: cause.into(),
            remedy: remedy.into(),
        }
    }
}
