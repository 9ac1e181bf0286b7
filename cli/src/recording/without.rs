//! In place of `rrd` in a build without the feature `rerun`.

use super::content::Recording;
use std::error::Error;

/// Makes nothing: callers ask [`require`](super::require) first.
///
/// # Errors
/// Always.
pub fn bytes(_: &Recording, _: Option<&str>) -> Result<Vec<u8>, Box<dyn Error>> {
    Err("built without the feature `rerun`".into())
}

/// Sends nothing, as above.
///
/// # Errors
/// Always.
pub fn send(_: &Recording, _: &str) -> Result<(), Box<dyn Error>> {
    Err("built without the feature `rerun`".into())
}
