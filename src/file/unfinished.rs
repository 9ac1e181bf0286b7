//! Files that are being written, under a name of their own beside the one that they will have.

use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::fs::{DirEntry, File};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io;
use std::path::{Path, PathBuf};
use std::process;
use std::sync::Mutex;
use std::time::Duration;
use tempfile::{Builder, NamedTempFile};

/// What the names of unfinished files begin with. The number of the process that writes follows, then a dash and a random
/// number, a dash and the [`seal`] of the two: nobody gives a file of their own such a name, by accident or by guessing.
pub(super) const PREFIX: &str = ".mimic-";
/// How often a name is tried that is taken: among 2⁶⁴ none is.
const TRIES: usize = 8;
/// Age from which an unfinished file counts as left behind although a process of its number runs, or may run where the
/// system doesn't say. Chosen: writing takes seconds, and numbers of processes are used again.
const STALE: Duration = Duration::from_secs(3600);

/// A file that is being written. Dropped without [`replace`](Self::replace) or [`create`](Self::create), it is removed.
///
/// The first one in a folder removes those that killed processes of this program left there.
pub struct Unfinished {
    file: NamedTempFile,
    path: PathBuf,
}

impl Unfinished {
    /// An empty file in the folder of `path`, which is where it will be.
    ///
    /// # Errors
    /// A folder that doesn't exist or can't be written.
    pub fn beside(path: impl AsRef<Path>) -> io::Result<Self> {
        let path = path.as_ref();
        let folder = path
            .parent()
            .filter(|parent| !parent.as_os_str().is_empty())
            .unwrap_or(Path::new("."));
        sweep_once(folder);
        let file = named(folder).map_err(unnamed)?;
        // Says to other machines that share the folder that somebody writes. Windows would keep a second handle of our
        // own from writing, and some file systems know no locks.
        #[cfg(unix)]
        file.as_file().lock().ok();
        Ok(Self {
            file,
            path: path.to_owned(),
        })
    }

    /// The file, to write into.
    pub fn file(&mut self) -> &mut File {
        self.file.as_file_mut()
    }

    /// Flushes it to the disk and gives it its name, in place of the file that had it.
    ///
    /// # Errors
    /// A full disk, or a folder or the like of that name.
    pub fn replace(self) -> io::Result<()> {
        self.file.as_file().sync_all().map_err(unnamed)?;
        self.file.persist(&self.path)?;
        Ok(())
    }

    /// The same, but never takes the place of another file.
    ///
    /// # Errors
    /// [`io::ErrorKind::AlreadyExists`] if something of that name is there, or a full disk.
    pub fn create(self) -> io::Result<()> {
        self.file.as_file().sync_all().map_err(unnamed)?;
        match self.file.persist_noclobber(&self.path) {
            Ok(_) => Ok(()),
            // Some file systems can't do both in one step.
            Err(failed) if !exists(&self.path) => {
                failed.file.persist(&self.path)?;
                Ok(())
            }
            Err(_) => Err(io::ErrorKind::AlreadyExists.into()),
        }
    }
}

/// A new file in `folder`.
fn named(folder: &Path) -> io::Result<NamedTempFile> {
    let new = || {
        let name = name(process::id(), RandomState::new().build_hasher().finish());
        let mut builder = Builder::new();
        builder.prefix(&name).rand_bytes(0);
        // Temporary files are private by default; this one becomes a file like any other.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        builder.tempfile_in(folder)
    };
    let is_taken = |made: &io::Result<NamedTempFile>| matches!(made, Err(e) if e.kind() == io::ErrorKind::AlreadyExists);
    (1..TRIES).fold(new(), |made, _| match is_taken(&made) {
        true => new(),
        false => made,
    })
}

/// The name of an unfinished file of this process.
fn name(process: u32, random: u64) -> String {
    let own = format!("{process}-{random:016x}");
    format!("{PREFIX}{own}-{}", seal(&own))
}

/// Shows that a name is of our making: the beginning of a digest, long enough that chance doesn't meet it.
fn seal(own: &str) -> String {
    let digest = Sha256::digest(format!("an unfinished file of mimic, {own}"));
    format!("{digest:x}").split_off(48)
}

/// Whether anything has this name, be it a link that leads nowhere.
fn exists(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// The error without the name of the temporary file, which the caller never chose. `tempfile` puts it behind the system's
/// words, and gives the error itself to nobody.
fn unnamed(error: io::Error) -> io::Error {
    let text = error.to_string();
    match text.split_once(" at path ") {
        Some((words, _)) => io::Error::new(error.kind(), words),
        None => error,
    }
}

/// Removes what killed processes left in `folder`, the first time that this process writes there.
fn sweep_once(folder: &Path) {
    static SWEPT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let Ok(folder) = folder.canonicalize() else {
        return;
    };
    let is_first = SWEPT
        .lock()
        .is_ok_and(|mut swept| swept.insert(folder.clone()));
    if is_first {
        sweep(&folder);
    }
}

/// Removes the unfinished files in `folder` that nobody will finish.
fn sweep(folder: &Path) {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries.filter(is_left_behind) {
        // Another process may have been faster, and a folder that can't be swept can still be written.
        std::fs::remove_file(entry.path()).ok();
    }
}

fn is_left_behind(entry: &DirEntry) -> bool {
    let name = entry.file_name();
    let Some(writer) = name.to_str().and_then(writer_of) else {
        return false;
    };
    let Ok(metadata) = entry.metadata() else {
        return false;
    };
    let age = metadata.modified().ok().and_then(|m| m.elapsed().ok());
    let is_old = age.is_some_and(|age| age > STALE);
    let is_alone = || File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok());
    metadata.is_file() && (is_old || has_ended(writer)) && is_alone()
}

/// The process whose unfinished file has this name.
pub(super) fn writer_of(name: &str) -> Option<u32> {
    let (own, sealed) = name.strip_prefix(PREFIX)?.rsplit_once('-')?;
    let (process, _) = own.split_once('-')?;
    process.parse().ok().filter(|_| seal(own) == sealed)
}

/// Whether no process of this number runs. Where the system doesn't list processes as files, none counts as ended.
fn has_ended(process: u32) -> bool {
    let list = Path::new("/proc");
    list.join("self").exists() && !list.join(process.to_string()).exists()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::time::SystemTime;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).expect("listed").flatten();
        let mut names: Vec<_> = entries
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_killed_processes_left_is_removed_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name);
        // Numbers of processes end at 2^22.
        let dead = 4_000_000_000_u32;
        let own = process::id();
        let left = |process| name(process, 7);
        let others = [
            ".mimic-notes".to_owned(),
            ".mimic-backup".to_owned(),
            format!(".mimic-{dead}-notes"),
            format!(".mimic-{dead}-abcde_"),
            format!("mimic-{dead}-abcdef"),
            // What people write whose tool has our name.
            ".mimic-2024-backup".to_owned(),
            ".mimic-99999-config".to_owned(),
            format!(".mimic-{dead}-abcdef"),
            format!(".mimic-{dead}-0123456789abcdef-0123456789abcdef"),
            format!("{}0", left(dead)),
            format!("{}.bak", left(dead)),
            left(dead).replacen("0007", "0008", 1),
            left(own),
        ];
        for name in &others {
            std::fs::write(at(name), b"kept").expect("written");
        }
        let folder_name = name(dead, 1);
        std::fs::create_dir(at(&folder_name)).expect("a folder");
        let locked = name(dead, 2);
        let held = File::create(at(&locked)).expect("written");
        held.lock().expect("locked");
        let old = name(own, 3);
        let aged = File::create(at(&old)).expect("written");
        aged.set_modified(SystemTime::now() - 2 * STALE)
            .expect("aged");
        std::fs::write(at(&left(dead)), b"left").expect("written");
        let mut kept = others.to_vec();
        kept.extend([locked, folder_name]);
        kept.sort();
        let mut file = Unfinished::beside(at("new.txt")).expect("made");
        file.file().write_all(b"new").expect("written");
        assert!(file.file.path().exists());
        drop(file);
        assert_eq!(names(folder.path()), kept);
    }

    #[test]
    fn a_new_file_takes_no_place() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("whole.txt");
        let write = |text: &[u8]| {
            let mut file = Unfinished::beside(&path).expect("made");
            file.file().write_all(text).expect("written");
            file.create()
        };
        write(b"first").expect("nothing is there");
        let second = write(b"second").map_err(|e| e.kind());
        assert_eq!(second, Err(io::ErrorKind::AlreadyExists));
        assert_eq!(std::fs::read(&path).expect("read"), b"first");
        assert_eq!(names(folder.path()), ["whole.txt"]);
    }

    #[cfg(unix)]
    #[test]
    fn errors_have_the_systems_words_and_no_name() {
        let missing = Unfinished::beside("no/such/folder/whole.txt");
        let error = missing.map(|_| ()).expect_err("there is no folder");
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
        let text = error.to_string();
        assert!(
            text.contains("(os error 2)") && !text.contains(PREFIX),
            "{text}"
        );
    }
}
