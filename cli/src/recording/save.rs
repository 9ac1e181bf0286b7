//! Recordings as files.

use super::content::{Recording, Sink};
use super::rrd::write;
use crate::failure::{Failure, Outcome};
use crate::output::make_room;
use std::path::Path;

/// Writes to a temporary file beside `path` and renames it, so that nobody finds half a recording.
pub fn save(shown: &Recording, path: &Path, source: &Path) -> Outcome {
    make_room(path, source, "rrd")?;
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
    let mut builder = tempfile::Builder::new();
    builder.prefix(".mimic-").suffix(".rrd");
    // Temporary files are private by default; this one becomes a file like any other.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let part = builder
        .tempfile_in(folder.unwrap_or(Path::new(".")))
        .map_err(|e| Failure::write(path, e))?;
    write_file(shown, part.path(), path)?;
    part.persist(path)
        .map_err(|e| Failure::write(path, e.error))?;
    Ok(())
}

/// Writes into `part`, which becomes `path`.
pub fn write_file(shown: &Recording, part: &Path, path: &Path) -> Outcome {
    write(shown, &Sink::File(part.to_path_buf())).map_err(|e| Failure::write(path, e))
}
