//! Named tensors in a safetensors file whose metadata has one key, `mimic`, that holds a JSON object.

use super::LearnError;
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, SafeTensorError, TensorView, serialize};
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Why a checkpoint or a policy file can't be written or read.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    #[error("can't {verb} {path}: {source}")]
    Io {
        verb: &'static str,
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "{path} is not a whole safetensors file ({source}); it may be cut short, use another copy"
    )]
    Container {
        path: PathBuf,
        source: SafeTensorError,
    },
    #[error("{path} holds {found}, not {expected}")]
    Format {
        path: PathBuf,
        found: String,
        expected: String,
    },
    #[error("{path}: metadata {field} is missing or malformed; write the file again")]
    Metadata { path: PathBuf, field: String },
    #[error("{path} has no tensor {name}; write the file again")]
    Missing { path: PathBuf, name: String },
    #[error(
        "{path}: tensor {name} is {found}, not {expected}; it belongs to another network or version"
    )]
    Tensor {
        path: PathBuf,
        name: String,
        found: String,
        expected: String,
    },
    #[error("{path}: {source}")]
    Network { path: PathBuf, source: LearnError },
}

/// A number type that tensors hold.
pub(super) trait Element: Copy {
    const DTYPE: Dtype;
    fn push_bytes(self, bytes: &mut Vec<u8>);
    /// `bytes` is one element.
    fn from_bytes(bytes: &[u8]) -> Option<Self>;
}

macro_rules! element {
    ($type:ty, $dtype:ident) => {
        impl Element for $type {
            const DTYPE: Dtype = Dtype::$dtype;
            fn push_bytes(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
            fn from_bytes(bytes: &[u8]) -> Option<Self> {
                bytes.try_into().ok().map(Self::from_le_bytes)
            }
        }
    };
}
element!(f32, F32);
element!(f64, F64);
element!(u64, U64);

/// Collects the tensors of a file.
#[derive(Default)]
pub(super) struct Writer {
    tensors: Vec<(String, Dtype, Vec<usize>, Vec<u8>)>,
}

impl Writer {
    pub(super) fn push<E: Element>(
        &mut self,
        name: impl Into<String>,
        shape: &[usize],
        values: &[E],
    ) {
        let mut bytes = Vec::with_capacity(size_of_val(values));
        values.iter().for_each(|value| value.push_bytes(&mut bytes));
        self.tensors
            .push((name.into(), E::DTYPE, shape.to_vec(), bytes));
    }

    /// Writes to a temporary file beside `path`, waits for the disk and renames: `path` always holds a whole file.
    pub(super) fn save(&self, path: &Path, metadata: &Value) -> Result<(), FileError> {
        let container = |source| FileError::Container {
            path: path.to_owned(),
            source,
        };
        let views = self.tensors.iter().map(|(name, dtype, shape, bytes)| {
            TensorView::new(*dtype, shape.clone(), bytes).map(|view| (name.as_str(), view))
        });
        let views = views.collect::<Result<Vec<_>, _>>().map_err(container)?;
        let metadata = HashMap::from([("mimic".to_owned(), metadata.to_string())]);
        let bytes = serialize(views, Some(metadata)).map_err(container)?;
        crate::file::replace(path, &bytes).map_err(|source| FileError::Io {
            verb: "write",
            path: path.to_owned(),
            source,
        })
    }
}

/// The bytes of a file, to be opened as a [`Reader`].
pub(super) fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    std::fs::read(path).map_err(|source| FileError::Io {
        verb: "read",
        path: path.to_owned(),
        source,
    })
}

/// A file's tensors and its metadata.
pub(super) struct Reader<'a> {
    path: &'a Path,
    tensors: SafeTensors<'a>,
    pub(super) metadata: Value,
}

impl<'a> Reader<'a> {
    /// Checks the container, and that it says to be a `format` of a version up to `version`.
    pub(super) fn open(
        path: &'a Path,
        bytes: &'a [u8],
        format: &str,
        version: u64,
    ) -> Result<Self, FileError> {
        let container = |source| FileError::Container {
            path: path.to_owned(),
            source,
        };
        let tensors = SafeTensors::deserialize(bytes).map_err(container)?;
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(container)?;
        let text = header.metadata().as_ref().and_then(|m| m.get("mimic"));
        let metadata = text.and_then(|text| serde_json::from_str(text).ok());
        let metadata = metadata.ok_or_else(|| metadata_error(path, "mimic"))?;
        let reader = Self {
            path,
            tensors,
            metadata,
        };
        reader.check_format(format, version)?;
        Ok(reader)
    }

    fn check_format(&self, format: &str, version: u64) -> Result<(), FileError> {
        let found_format = self.field("format")?.as_str().unwrap_or("something else");
        let found_version = self.integer("version")?;
        if found_format == format && found_version <= version {
            return Ok(());
        }
        Err(FileError::Format {
            path: self.path.to_owned(),
            found: format!("a {found_format} of version {found_version}"),
            expected: format!("a {format} of version {version} or older"),
        })
    }

    pub(super) fn field(&self, name: &str) -> Result<&Value, FileError> {
        self.metadata.get(name).ok_or_else(|| self.malformed(name))
    }

    pub(super) fn integer(&self, name: &str) -> Result<u64, FileError> {
        self.field(name)?
            .as_u64()
            .ok_or_else(|| self.malformed(name))
    }

    pub(super) fn malformed(&self, field: &str) -> FileError {
        metadata_error(self.path, field)
    }

    pub(super) fn network(&self, source: LearnError) -> FileError {
        FileError::Network {
            path: self.path.to_owned(),
            source,
        }
    }

    /// The tensors whose names begin with `prefix`: what follows it, and the shape; sorted by name.
    pub(super) fn under(&self, prefix: &str) -> Vec<(String, Vec<usize>)> {
        let named = self.tensors.iter().filter_map(|(name, view)| {
            name.strip_prefix(prefix)
                .map(|rest| (rest.to_owned(), view.shape().to_vec()))
        });
        let mut named: Vec<_> = named.collect();
        named.sort();
        named
    }

    /// A tensor of exactly this type and shape.
    pub(super) fn tensor<E: Element>(
        &self,
        name: &str,
        shape: &[usize],
    ) -> Result<Vec<E>, FileError> {
        let missing = |_| FileError::Missing {
            path: self.path.to_owned(),
            name: name.to_owned(),
        };
        let view = self.tensors.tensor(name).map_err(missing)?;
        if view.dtype() != E::DTYPE || view.shape() != shape {
            return Err(FileError::Tensor {
                path: self.path.to_owned(),
                name: name.to_owned(),
                found: format!("{:?} {:?}", view.dtype(), view.shape()),
                expected: format!("{:?} {shape:?}", E::DTYPE),
            });
        }
        Ok(view
            .data()
            .chunks_exact(size_of::<E>())
            .filter_map(E::from_bytes)
            .collect())
    }
}

fn metadata_error(path: &Path, field: &str) -> FileError {
    FileError::Metadata {
        path: path.to_owned(),
        field: field.to_owned(),
    }
}
