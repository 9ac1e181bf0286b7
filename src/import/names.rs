//! Names of files, and lists of names, as clips and messages have them.

use std::path::Path;

/// The last part of a path, as text.
pub(crate) fn base_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// A file's name without its extension; a name such as `.bvh` is all stem.
pub(crate) fn stem(file: &str) -> &str {
    file.rsplit_once('.')
        .map_or(file, |(stem, _)| if stem.is_empty() { file } else { stem })
}

/// The first eight items in a row, and how many more there are: a message has to stay readable.
pub(crate) fn first_few(items: impl ExactSizeIterator<Item = String>) -> String {
    const MOST: usize = 8;
    let more = items.len().saturating_sub(MOST);
    let list = items.take(MOST).collect::<Vec<_>>().join(", ");
    match more {
        0 => list,
        more => format!("{list}, … and {more} more"),
    }
}
