//! Finds the skeleton of a motion in the folder beside it.

use super::error::AcclaimError;
use crate::file::read_at_most;
use crate::import::names::stem;
use std::io;
use std::path::{Path, PathBuf};

/// Largest skeleton that is read, in bytes. Chosen: those of people have about ten thousand.
const MOST_BYTES: u64 = 16 << 20;

/// Path and bytes of the skeleton for the motion `file` in `folder`: the `.asf` of its name, or of its name without what
/// follows a `_` (`01.asf` of `01_02.amc`), or the only one there.
pub(super) fn skeleton(
    file: &str,
    folder: Option<&Path>,
) -> Result<(PathBuf, Vec<u8>), AcclaimError> {
    let missing = |reason: String| AcclaimError::NoSkeleton {
        reason,
        wanted: usual_name(file),
    };
    let folder = folder.ok_or_else(|| missing("its .asf isn't at hand".to_owned()))?;
    let folder = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    let unread = |e: io::Error| missing(format!("its folder can't be read ({e})"));
    let skeletons = skeletons(folder).map_err(unread)?;
    let path = belonging(file, &skeletons).ok_or_else(|| {
        missing(match skeletons.len() {
            0 => "no .asf is beside it".to_owned(),
            many => format!("none of the {many} .asf files beside it has its name"),
        })
    })?;
    let unread = |source| AcclaimError::Unread {
        path: path.clone(),
        source,
    };
    let bytes = read_at_most(path, MOST_BYTES).map_err(unread)?;
    Ok((path.clone(), bytes))
}

/// The name that the skeleton of `file` should have: the CMU database calls motions by subject and trial, `01_02.amc`, and
/// skeletons by subject.
fn usual_name(file: &str) -> String {
    let stem = stem(file);
    let subject = stem.split_once('_').map_or(stem, |(subject, _)| subject);
    format!("{subject}.asf")
}

/// Paths of the folder's `.asf` files, in order.
fn skeletons(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("asf") && !path.is_dir() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// The skeleton whose name is that of `file`, or the longest start of it up to a `_`; else the only one.
fn belonging<'p>(file: &str, skeletons: &'p [PathBuf]) -> Option<&'p PathBuf> {
    let mut name = stem(file);
    loop {
        let named = |path: &&PathBuf| {
            let stem = path.file_stem().unwrap_or_default();
            stem.eq_ignore_ascii_case(name)
        };
        if let Some(path) = skeletons.iter().find(named) {
            return Some(path);
        }
        match name.rsplit_once('_') {
            Some((shorter, _)) => name = shorter,
            None => break,
        }
    }
    skeletons.first().filter(|_| skeletons.len() == 1)
}
