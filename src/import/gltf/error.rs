//! What can be wrong with a glTF file.

use crate::explain::{Explain, Explanation, explained};

/// Why a glTF file couldn't be read. Indices are those of the file's lists, from 0.
#[derive(Debug)]
pub(crate) enum GltfError {
    /// Not JSON, or not of the format's fields.
    Json { reason: String },
    /// Another version than 2.
    Version { found: String },
    /// A GLB container whose lengths are wrong.
    Container { reason: String },
    /// An accessor without its numbers.
    Accessor { accessor: usize, fault: Fault },
    /// A curve whose keys can't be.
    Curve {
        take: String,
        node: String,
        /// `translation`, `rotation` or `scale`.
        path: &'static str,
        reason: String,
    },
    /// Nodes that don't form trees.
    Tree { node: usize, reason: &'static str },
}

/// What is wrong with a part of a file, and what to do where that isn't to export the file again.
#[derive(Debug, PartialEq)]
pub(crate) struct Fault {
    pub cause: String,
    pub remedy: Option<String>,
}

impl Fault {
    pub fn new(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            cause: cause.into(),
            remedy: Some(remedy.into()),
        }
    }
}

impl<T: Into<String>> From<T> for Fault {
    fn from(cause: T) -> Self {
        Self {
            cause: cause.into(),
            remedy: None,
        }
    }
}

explained!(GltfError);

impl Explain for GltfError {
    fn explain(&self) -> Explanation {
        let wrong = |cause: &str| Explanation::input(cause).remedy("export the file again");
        match self {
            Self::Json { reason } => wrong(&format!("broken glTF JSON ({reason})")),
            Self::Version { found } => {
                wrong(&format!("glTF version {found}")).remedy("export it as glTF 2.0")
            }
            Self::Container { reason } => wrong(reason),
            Self::Accessor { accessor, fault } => {
                let wrong = wrong(&fault.cause).place(format!("accessor {accessor}"));
                match &fault.remedy {
                    Some(remedy) => wrong.remedy(remedy),
                    None => wrong,
                }
            }
            Self::Curve {
                take,
                node,
                path,
                reason,
            } => wrong(reason).place(format!("take `{take}`, node `{node}`, {path}")),
            Self::Tree { node, reason } => wrong(reason).place(format!("node {node}")),
        }
    }
}
