//! Files: read within bounds, written so that nobody ever finds half of one, and one envelope for all that hold tensors.
//!
//! Clips, motions, checkpoints and policies are safetensors files whose metadata has one key, `mimic`, with a JSON object
//! that says `format` and `version`. Older versions stay readable. A newer one is refused before anything else in the file
//! is looked at.

mod error;
mod format;
mod lock;
mod made;
mod read;
mod tensors;
mod unfinished;
mod unwritten;

pub use error::{FileError, Flaw};
pub use format::Format;
pub use lock::{Holder, LOCK, Lock, LockError};
pub use made::{holds, made_by};
pub use read::{lines_at_most, read_at_most, start_of, text_at_most, unread};
pub(crate) use tensors::{Reader, Writer, format_of, load, save};
pub use unfinished::Unfinished;
pub use unwritten::unwritten;

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

/// Whether a file of this name is one that is being written, or was left by a process that was killed meanwhile.
pub fn is_temporary(name: &str) -> bool {
    unfinished::writer_of(name).is_some()
}

/// Replaces the content of the file `path` by `bytes`, at once: they are written to a temporary file beside it, flushed to
/// the disk, and renamed. A process that is killed in between leaves the old file, or none.
///
/// # Errors
/// A folder that doesn't exist or can't be written, or a full disk.
pub fn replace(path: impl AsRef<Path>, bytes: &[u8]) -> io::Result<()> {
    replace_by(path.as_ref(), |file| file.write_all(bytes))
}

/// Replaces the content of the file `path` by what `write` writes.
fn replace_by(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let mut file = Unfinished::beside(path)?;
    write(file.file())?;
    file.replace()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names and contents of the files in a folder.
    fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
        let entries = std::fs::read_dir(folder).expect("listed");
        let file = |entry: io::Result<std::fs::DirEntry>| {
            let entry = entry.expect("an entry");
            let name = entry.file_name().to_string_lossy().into_owned();
            (name, std::fs::read(entry.path()).expect("read"))
        };
        entries.map(file).collect()
    }

    #[test]
    fn a_write_that_stops_half_way_keeps_the_old_file_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("whole.txt");
        replace(&path, b"first").expect("written");
        replace(&path, b"second").expect("replaced");
        let whole = vec![("whole.txt".to_owned(), b"second".to_vec())];
        assert_eq!(files(folder.path()), whole);
        let half = replace_by(&path, |file| {
            file.write_all(b"th")?;
            assert_eq!(std::fs::read(&path)?, b"second");
            Err(io::Error::other("the disk is full"))
        });
        assert!(half.is_err());
        assert_eq!(files(folder.path()), whole);
    }

    #[test]
    fn what_can_not_be_replaced_is_kept() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let taken = folder.path().join("taken");
        std::fs::create_dir(&taken).expect("a folder");
        std::fs::write(taken.join("inside.txt"), b"kept").expect("written");
        assert!(replace(&taken, b"third").is_err());
        assert!(replace(folder.path().join("missing/whole.txt"), b"third").is_err());
        assert_eq!(files(&taken), [("inside.txt".to_owned(), b"kept".to_vec())]);
        assert_eq!(std::fs::read_dir(folder.path()).expect("listed").count(), 1);
    }
}
