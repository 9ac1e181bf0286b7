//! Where results are written.

use crate::failure::{Failure, Outcome};
use crate::locate;
use std::path::{Path, PathBuf};

/// Writes a file as a whole or not at all.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Outcome {
    mimic::file::replace(path, bytes).map_err(|e| Failure::write(path, e))
}

/// Path of a result: the file `--out` names, or `NAME.EXTENSION` in the folder it names, or in this folder.
pub fn result_path(out: Option<&Path>, name: &str, extension: &str) -> PathBuf {
    let file = format!("{}.{extension}", file_name(name));
    match out {
        Some(out) if names_folder(out) => out.join(file),
        Some(out) => out.to_path_buf(),
        None => PathBuf::from(file),
    }
}

/// Creates the folder of a result, and refuses to replace the input it comes from, or what is no file with its `extension`.
pub fn make_room(path: &Path, input: &Path, extension: &str) -> Outcome {
    if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(|e| Failure::write(folder, e))?;
    }
    // Only now: the way to the input may lead through the folder that wasn't there.
    spare_input(path, input)?;
    spare_others(path, extension)
}

/// Refuses to replace a file of another kind than the result's, a clip by its recording for one, and what is no file at all.
pub fn spare_others(path: &Path, extension: &str) -> Outcome {
    let replaceable = path.is_file() && locate::has_extension(path, extension);
    // A folder isn't replaced: writing over it fails.
    if replaceable || path.is_dir() || !path.exists() {
        return Ok(());
    }
    Err(Failure::user(format!(
        "`{}` is there already and is no `.{extension}` file, name another file to write",
        path.display()
    )))
}

/// Refuses to replace the input of a result.
pub fn spare_input(path: &Path, input: &Path) -> Outcome {
    match (path.canonicalize(), input.canonicalize()) {
        (Ok(a), Ok(b)) if a == b => {
            let path = path.display();
            Err(Failure::user(format!(
                "`{path}` is the input itself, name another file to write"
            )))
        }
        _ => Ok(()),
    }
}

/// Whether `--out` means a folder: it is one, or ends like one.
pub fn names_folder(out: &Path) -> bool {
    out.is_dir() || out.as_os_str().to_string_lossy().ends_with('/')
}

pub fn file_name(name: &str) -> String {
    let clean = |c: char| {
        if c.is_alphanumeric() || "-_.".contains(c) {
            c
        } else {
            '-'
        }
    };
    let name: String = name.chars().map(clean).collect();
    let name = name.trim_matches(['-', '.']);
    if name.is_empty() {
        "clip".into()
    } else {
        name.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_file_names() {
        assert_eq!(file_name("mixamo.com|Take 001"), "mixamo.com-Take-001");
        assert_eq!(file_name("../../x"), "x");
        assert_eq!(file_name("…/"), "clip");
    }

    #[test]
    fn out_is_a_file_or_a_folder() {
        let path = |out: &str| result_path(Some(Path::new(out)), "kick", "clip");
        assert_eq!(path("a/b.clip"), Path::new("a/b.clip"));
        assert_eq!(path("a/"), Path::new("a/kick.clip"));
        assert_eq!(result_path(None, "kick", "clip"), Path::new("kick.clip"));
    }
}
