//! In place of `rrd` in a build without the feature `rerun`.

use super::content::{Recording, Sink};
use std::error::Error;

/// Writes nothing: callers ask [`require`](super::require) first.
///
/// # Errors
/// Always.
pub fn write(_: &Recording, _: &Sink) -> Result<(), Box<dyn Error>> {
    Err("built without the feature `rerun`".into())
}
