//! Recordings as files.

use super::content::{Recording, Sink};
use super::rrd::write;
use crate::failure::{Failure, Outcome};
use crate::output::Output;
use mimic::file::Unfinished;
use std::path::Path;

/// Writes the recording of a run into its folder, in place of an older one.
pub fn save(shown: &Recording, path: &Path) -> Outcome {
    let failed = |e| Failure::write(path, e);
    let part = Unfinished::beside(path).map_err(failed)?;
    write_file(shown, part.path(), path, None)?;
    part.replace().map_err(failed)
}

/// Writes the recording where a command was told to.
pub fn save_to(shown: &Recording, output: &Output) -> Outcome {
    output.write_by(|part, made| write_file(shown, part, output.path(), made))
}

/// Writes into `part`, which becomes `path`.
pub fn write_file(shown: &Recording, part: &Path, path: &Path, made: Option<&str>) -> Outcome {
    let sink = Sink::File {
        path: part.to_path_buf(),
        made: made.map(str::to_owned),
    };
    write(shown, &sink).map_err(|e| Failure::write(path, e))
}
