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
    /// Lower-case hexadecimal SHA-256 of all of the file but this field.
    sha256: String,
}

impl Made {
    /// Of a file that is the same as these bytes but for this field. `None` for bytes that are cut short.
    pub(super) fn new(by: &str, plain: &[u8]) -> Option<Self> {
        let (header, tensors) = parts(plain)?;
        Some(Self {
            by: by.to_owned(),
            sha256: digest(std::str::from_utf8(header).ok()?, tensors),
        })
    }

    /// The digest of a file with this field in it, as it is now.
    fn of_now(&self, bytes: &[u8]) -> Option<String> {
        let (header, tensors) = parts(bytes)?;
        // The field as it stands in the header: as JSON, in a string of JSON.
        let field = format!("\"made\":{},", serde_json::to_string(self).ok()?);
        let quoted = serde_json::to_string(&field).ok()?;
        let header = std::str::from_utf8(header).ok()?;
        let (before, after) = header.split_once(quoted.trim_matches('"'))?;
        Some(digest(&format!("{before}{after}"), tensors))
    }
}

/// Of a file with this header, which is filled up with blanks, and these bytes of tensors.
fn digest(header: &str, tensors: &[u8]) -> String {
    let mut digest = Sha256::new();
    for part in [header.trim_end().as_bytes(), b"\n", tensors] {
        digest.update(part);
    }
    format!("{:x}", digest.finalize())
}

/// The text that says what made a file of tensors, as it was given to [`Clip::to_bytes`](crate::clip::Clip::to_bytes) or
/// [`Motion::to_bytes`](crate::motion::Motion::to_bytes). `None` if the file doesn't say, can't be read, or isn't as it was made,
/// in its tensors or in its metadata.
pub fn made_by(path: impl AsRef<Path>) -> Option<String> {
    #[derive(Deserialize)]
    struct Fields {
        made: Made,
    }
    let bytes = read_at_most(path, MOST_BYTES).ok()?;
    let Fields { made } = serde_json::from_str(&header(&bytes).ok()?).ok()?;
    (made.of_now(&bytes)? == made.sha256).then_some(made.by)
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
