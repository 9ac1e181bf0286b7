//! Recordings as files.

use super::content::Recording;
use super::rrd;
use crate::failure::{Failure, Outcome};
use crate::output::Output;
use std::path::Path;

/// Writes the recording of a run into its folder, in place of an older one.
pub fn save(shown: &Recording, path: &Path) -> Outcome {
    mimic::file::replace(path, &bytes(shown, None)?).map_err(|e| Failure::write(path, e))
}

/// Writes the recording where a command was told to.
pub fn save_to(shown: &Recording, output: &Output) -> Outcome {
    output.write(|made| bytes(shown, made))
}

/// The bytes of a file with the recording, which says what made it.
pub fn bytes(shown: &Recording, made: Option<&str>) -> Outcome<Vec<u8>> {
    rrd::bytes(shown, made)
        .map_err(|e| Failure::work(format!("the recording cannot be made ({e})")))
}
