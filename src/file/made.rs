//! What made a file: a text that its writer chose, and a digest that shows whether somebody changed the file since.

use super::read_at_most;
use super::tensors::{KEY, MOST_BYTES, header, parts};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::path::Path;

/// The field `made` of a file's metadata.
#[derive(Serialize, Deserialize)]
pub(super) struct Made {
    by: String,
    /// Lower-case hexadecimal SHA-256 of the tensors' bytes.
    sha256: String,
}

impl Made {
    /// Of a file with these bytes of tensors.
    pub(super) fn new(by: &str, tensors: &[u8]) -> Self {
        Self {
            by: by.to_owned(),
            sha256: format!("{:x}", Sha256::digest(tensors)),
        }
    }
}

/// The text that says what made a file of tensors, as it was given to [`Clip::to_bytes`](crate::clip::Clip::to_bytes) or
/// [`Motion::to_bytes`](crate::motion::Motion::to_bytes). `None` if the file doesn't say, can't be read, or has other
/// tensors than it was made with.
pub fn made_by(path: impl AsRef<Path>) -> Option<String> {
    #[derive(Deserialize)]
    struct Fields {
        made: Made,
    }
    let bytes = read_at_most(path, MOST_BYTES).ok()?;
    let Fields { made } = serde_json::from_str(&header(&bytes).ok()?).ok()?;
    let (_, tensors) = parts(&bytes)?;
    (Made::new(&made.by, tensors).sha256 == made.sha256).then_some(made.by)
}

/// Whether the file of tensors at `path` holds what these bytes of another hold, whatever the two say of what made them.
pub fn holds(path: impl AsRef<Path>, bytes: &[u8]) -> bool {
    let old = read_at_most(path, MOST_BYTES);
    old.is_ok_and(|old| content(&old).is_some_and(|old| Some(old) == content(bytes)))
}

/// All of a file but what made it: its tensors' bytes, their names and shapes, and the fields of the metadata.
fn content(bytes: &[u8]) -> Option<(&[u8], Value, Value)> {
    let (text, tensors) = parts(bytes)?;
    let mut shapes: Value = serde_json::from_slice(text).ok()?;
    let ours = shapes.get_mut("__metadata__")?.as_object_mut()?;
    let mut fields: Value = serde_json::from_str(ours.remove(KEY)?.as_str()?).ok()?;
    fields.as_object_mut()?.remove("made");
    Some((tensors, shapes, fields))
}
