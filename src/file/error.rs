//! What can be wrong with a file of tensors.

use super::Format;
use super::read::unread;
use super::unwritten::unwritten;
use crate::explain::{Explain, Explanation, explained};
use std::io;
use std::path::{Path, PathBuf};

/// Why a clip, motion, checkpoint or policy file can't be written or read.
#[derive(Debug)]
pub struct FileError {
    /// The file at fault.
    pub path: PathBuf,
    /// What the file was to be.
    pub format: Format,
    /// What is wrong with it.
    pub flaw: Flaw,
}

/// What is wrong with a file.
#[derive(Debug)]
#[non_exhaustive]
pub enum Flaw {
    /// The system doesn't let us read the file.
    Read(io::Error),
    /// The system doesn't let us write the file.
    Write(io::Error),
    /// The file would be too large to be read again, so it isn't written.
    TooLarge {
        /// Most bytes that are read, of the file or of its header.
        most: u64,
    },
    /// The bytes aren't those of a whole safetensors file.
    Container {
        /// What the container lacks.
        reason: String,
    },
    /// The file is safetensors, but of another program.
    Foreign,
    /// The file is of another format of ours.
    OtherFormat {
        /// The format that the file says it has.
        found: String,
    },
    /// A newer version of this program wrote the file.
    Newer {
        /// The version that the file says it has.
        version: u64,
    },
    /// A tensor is missing.
    Missing {
        /// Its name.
        tensor: String,
    },
    /// A tensor has another type or shape.
    Tensor {
        /// Its name.
        name: String,
        /// Type and shape in the file.
        found: String,
        /// Type and shape that are needed.
        expected: String,
    },
    /// A value can't be used.
    Content {
        /// The tensor or the field of the metadata that holds it.
        place: String,
        /// What is wrong with it.
        cause: String,
    },
}

impl Flaw {
    /// A value of the file that can't be used.
    pub(crate) fn content(place: impl Into<String>, cause: impl Into<String>) -> Self {
        Self::Content {
            place: place.into(),
            cause: cause.into(),
        }
    }

    /// A tensor whose numbers can't be used.
    pub(crate) fn in_tensor(name: &str, cause: impl Into<String>) -> Self {
        Self::content(format!("tensor `{name}`"), cause)
    }

    /// The error of a file that has this flaw.
    pub(crate) fn of(self, path: &Path, format: Format) -> FileError {
        FileError {
            path: path.to_owned(),
            format,
            flaw: self,
        }
    }
}

impl Explain for FileError {
    fn explain(&self) -> Explanation {
        let Format {
            name,
            version: known,
            remedy,
        } = self.format;
        let told = match &self.flaw {
            Flaw::Read(source) => unread(source),
            Flaw::Write(source) => unwritten(&self.path, source),
            Flaw::TooLarge { most } => Explanation::input(format!(
                "this {name} is too large for a file: it would need more than {most} bytes, the most that can be read again"
            ))
            .remedy("make it shorter, or lower its frame rate"),
            Flaw::Container { reason } => Explanation::input(format!(
                "not a whole safetensors file ({reason}), it may be cut short"
            ))
            .remedy(format!("use another copy, or {remedy}")),
            Flaw::Foreign => Explanation::input("the metadata has no key `mimic` with a format and a version, another program wrote the file")
                .remedy(format!("use a {name} file of mimic")),
            Flaw::OtherFormat { found } => {
                Explanation::input(format!("a {found} file where a {name} file is needed"))
                    .remedy(format!("use a {name} file"))
            }
            Flaw::Newer { version } => Explanation::input(format!(
                "written by a newer version of mimic ({name} version {version}, the latest known here is {known})"
            ))
            .remedy("update mimic"),
            Flaw::Missing { tensor } => {
                Explanation::input(format!("no tensor `{tensor}`")).remedy(remedy)
            }
            Flaw::Tensor {
                name,
                found,
                expected,
            } => Explanation::input(format!("tensor `{name}` is {found}, not {expected}"))
                .remedy(remedy),
            Flaw::Content { place, cause } => {
                Explanation::input(cause.clone()).place(place).remedy(remedy)
            }
        };
        told.file(&self.path)
    }
}

explained!(FileError);
