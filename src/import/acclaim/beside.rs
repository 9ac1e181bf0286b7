//! Where the skeleton of a motion is.

use super::AcclaimError;
use std::io;
use std::path::{Path, PathBuf};

/// Largest skeleton that is read, in bytes; those of people have about ten thousand.
const MOST_BYTES: u64 = 16 << 20;

/// Name and bytes of the skeleton for the motion `file` in `folder`: the `.asf` of its name, or of its name without
/// what follows a `_` (`01.asf` of `01_02.amc`), or the only one there.
pub(super) fn skeleton(
    file: &str,
    folder: Option<&Path>,
) -> Result<(String, Vec<u8>), AcclaimError> {
    let missing = |reason| AcclaimError::NoSkeleton { reason };
    let folder = folder.ok_or_else(|| missing(remedy(file, "its .asf isn't at hand")))?;
    let folder = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    let unread = |e: io::Error| missing(remedy(file, &format!("its folder can't be read ({e})")));
    let skeletons = skeletons(folder).map_err(unread)?;
    let path = belonging(file, &skeletons).ok_or_else(|| {
        missing(match skeletons.len() {
            0 => remedy(file, "no .asf lies beside it"),
            many => remedy(
                file,
                &format!("none of the {many} .asf beside it has its name"),
            ),
        })
    })?;
    let name = super::super::file_name(path);
    let bytes = bytes(path).map_err(|e| missing(format!("{name} can't be read ({e})")))?;
    Ok((name, bytes))
}

fn remedy(file: &str, reason: &str) -> String {
    let stem = super::super::stem(file);
    let subject = stem.split_once('_').map_or(stem, |(subject, _)| subject);
    format!("{reason}; put its skeleton there as {subject}.asf")
}

/// Paths of the folder's `.asf` files, in order.
fn skeletons(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("asf") && path.is_file() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

fn belonging<'p>(file: &str, skeletons: &'p [PathBuf]) -> Option<&'p PathBuf> {
    let mut stem = super::super::stem(file);
    loop {
        let named = |path: &&PathBuf| {
            let name = path.file_stem().unwrap_or_default();
            name.eq_ignore_ascii_case(stem)
        };
        if let Some(path) = skeletons.iter().find(named) {
            return Some(path);
        }
        match stem.rsplit_once('_') {
            Some((shorter, _)) => stem = shorter,
            None => break,
        }
    }
    skeletons.first().filter(|_| skeletons.len() == 1)
}

fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let size = std::fs::metadata(path)?.len();
    if size > MOST_BYTES {
        return Err(io::Error::other(format!(
            "{size} bytes are more than the {MOST_BYTES} that are read"
        )));
    }
    std::fs::read(path)
}
