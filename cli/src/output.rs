//! Where results are written, and what they never replace.

use crate::failure::{Failure, Outcome};
use crate::locate;
use std::path::{Path, PathBuf};

/// Writes a file as a whole or not at all.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Outcome {
    mimic::file::replace(path, bytes).map_err(|e| Failure::write(path, e))
}

/// Path of a result: the file that `--out` names, or `NAME.EXTENSION` in the folder that it names, or in this folder.
pub fn result_path(out: Option<&Path>, name: &str, extension: &str) -> PathBuf {
    let file = format!("{}.{extension}", safe_name(name));
    match out {
        Some(out) if names_folder(out) => out.join(file),
        Some(out) => out.to_path_buf(),
        None => PathBuf::from(file),
    }
}

/// Creates the folder of a result. Refuses to replace the input that the result comes from, and any file without the
/// result's `extension`.
pub fn make_room(path: &Path, input: &Path, extension: &str) -> Outcome {
    if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(|e| Failure::write(folder, e))?;
    }
    // Not earlier: the input's path may lead through the folder that was just made (`made/../kick.fbx`).
    spare_input(path, input)?;
    spare_others(path, extension)
}

/// Refuses to replace a file of another kind, such as a clip by its recording, and devices and the like.
pub fn spare_others(path: &Path, extension: &str) -> Outcome {
    let replaceable = path.is_file() && locate::has_extension(path, extension);
    // A folder is left to the writing, which fails with the system's own reason.
    if replaceable || path.is_dir() || !path.exists() {
        return Ok(());
    }
    let cause = format!("this exists already and is not a `.{extension}` file");
    Err(Failure::input(path, cause).with_remedy("choose another file to write"))
}

/// Refuses to replace the input of a result.
pub fn spare_input(path: &Path, input: &Path) -> Outcome {
    match (path.canonicalize(), input.canonicalize()) {
        (Ok(a), Ok(b)) if a == b => {
            let failure = Failure::input(path, "this is the input itself");
            Err(failure.with_remedy("choose another file to write"))
        }
        _ => Ok(()),
    }
}

/// Whether `--out` means a folder: one that exists, or a path that ends in a slash.
pub fn names_folder(out: &Path) -> bool {
    out.is_dir() || out.as_os_str().to_string_lossy().ends_with('/')
}

/// A name from a file, such as that of a take, as a file name that every system takes.
pub fn safe_name(name: &str) -> String {
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
        assert_eq!(safe_name("mixamo.com|Take 001"), "mixamo.com-Take-001");
        assert_eq!(safe_name("../../x"), "x");
        assert_eq!(safe_name("…/"), "clip");
    }

    #[test]
    fn out_is_a_file_or_a_folder() {
        let path = |out: &str| result_path(Some(Path::new(out)), "kick", "clip");
        assert_eq!(path("a/b.clip"), Path::new("a/b.clip"));
        assert_eq!(path("a/"), Path::new("a/kick.clip"));
        assert_eq!(result_path(None, "kick", "clip"), Path::new("kick.clip"));
    }
}
