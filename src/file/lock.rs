//! A lock on a folder that one process at a time may change.

use std::fs::{File, Metadata, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The file in a folder that is locked. It stays when the lock ends, because two processes could lock two files of one name
/// if a file were removed while another process waits for it.
pub const LOCK: &str = ".mimic.lock";

/// How long to try: whoever only asks who holds a folder locks it for a moment, too.
const PATIENCE: Duration = Duration::from_millis(300);
const PAUSE: Duration = Duration::from_millis(10);
/// Most bytes that are read of what a holder wrote about itself: two numbers of 20 digits.
const MOST_BYTES: u64 = 64;

/// Holds a folder. Other processes, and other locks of this one, can't take it until the lock is dropped. The system ends
/// the lock when the process ends, however that happens.
#[derive(Debug)]
pub struct Lock {
    /// Open as long as the lock lasts.
    file: File,
    /// Where it was when it was locked.
    path: PathBuf,
}

/// Why a folder can't be locked.
#[derive(Debug)]
pub enum LockError {
    /// Another process holds it.
    Held(Holder),
    /// The system doesn't let us lock it.
    System(io::Error),
}

/// Who holds a folder, as far as it is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Holder {
    /// The number of the process, where it can be read.
    pub process: Option<u32>,
    /// How long it has held the folder.
    pub held_for: Option<Duration>,
}

impl Lock {
    /// Locks the folder `folder`, which exists.
    ///
    /// # Errors
    /// A folder that another process holds, or that can't be written.
    pub fn take(folder: impl AsRef<Path>) -> Result<Self, LockError> {
        let path = folder.as_ref().join(LOCK);
        let deadline = Instant::now() + PATIENCE;
        loop {
            let mut file = open(&path).map_err(LockError::System)?;
            match file.try_lock() {
                Ok(()) if is_at(&file, &path) => {
                    // Who holds the folder is told as a courtesy: the lock holds without it.
                    sign(&mut file).ok();
                    return Ok(Self { file, path });
                }
                // Its folder was given up and removed while we waited.
                Ok(()) => {}
                Err(TryLockError::WouldBlock) if Instant::now() >= deadline => {
                    return Err(LockError::Held(read_holder(&path)));
                }
                Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
                // Some network file systems know no locks. Working there without one beats not working there.
                Err(TryLockError::Error(e)) if e.kind() == io::ErrorKind::Unsupported => {
                    return Ok(Self { file, path });
                }
                Err(TryLockError::Error(e)) => return Err(LockError::System(e)),
            }
        }
    }

    /// Whether the folder's path still leads to the folder that was locked. A folder can be moved away, and another one can
    /// take its place: the lock goes with the first.
    pub fn is_in_place(&self) -> bool {
        is_at(&self.file, &self.path)
    }

    /// Who holds the folder at this moment; `None` if nobody does.
    pub fn holder(folder: impl AsRef<Path>) -> Option<Holder> {
        let path = folder.as_ref().join(LOCK);
        let is_file = path.symlink_metadata().is_ok_and(|found| found.is_file());
        let file = is_file.then(|| File::open(&path).ok()).flatten()?;
        // Dropping the file ends this lock again.
        match file.try_lock_shared() {
            Err(TryLockError::WouldBlock) => Some(read_holder(&path)),
            _ => None,
        }
    }
}

/// Opens the file that is locked. It is written, so it may not lead to another one.
fn open(path: &Path) -> io::Result<File> {
    let found = path.symlink_metadata().ok();
    if found.is_some_and(|found| !found.is_file() || has_other_names(&found)) {
        let cause = format!("{LOCK} is not a file of this folder alone");
        return Err(io::Error::new(io::ErrorKind::InvalidInput, cause));
    }
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    options.open(path)
}

/// Whether a file is another one's, too, which would be written with it.
#[cfg(unix)]
fn has_other_names(found: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    found.nlink() > 1
}

#[cfg(not(unix))]
fn has_other_names(_: &Metadata) -> bool {
    false
}

/// Whether the open file is still the one at `path`.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (file.metadata(), path.symlink_metadata()) {
        (Ok(ours), Ok(there)) => (ours.dev(), ours.ino()) == (there.dev(), there.ino()),
        _ => false,
    }
}

/// Elsewhere a file that is open can't be removed.
#[cfg(not(unix))]
fn is_at(_file: &File, _path: &Path) -> bool {
    true
}

/// Writes who holds the lock, and since when.
fn sign(file: &mut File) -> io::Result<()> {
    file.set_len(0)?;
    file.rewind()?;
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let since = since.map_or(0, |since| since.as_secs());
    file.write_all(format!("{} {since}\n", std::process::id()).as_bytes())
}

fn read_holder(path: &Path) -> Holder {
    let mut text = String::new();
    if let Ok(file) = File::open(path) {
        // What can't be read stays unknown.
        file.take(MOST_BYTES).read_to_string(&mut text).ok();
    }
    let mut numbers = text.split_whitespace();
    let process = numbers.next().and_then(|number| number.parse().ok());
    let since = numbers.next().and_then(|number| number.parse().ok());
    let since = since.and_then(|seconds| UNIX_EPOCH.checked_add(Duration::from_secs(seconds)));
    Holder {
        process,
        held_for: since.and_then(|since| SystemTime::now().duration_since(since).ok()),
    }
}

impl std::fmt::Display for Holder {
    /// "process 4242, for 3 minutes".
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.process {
            Some(process) => write!(f, "process {process}")?,
            None => f.write_str("another process")?,
        }
        let Some(held) = self.held_for.map(|held| held.as_secs()) else {
            return Ok(());
        };
        match held {
            0..120 => write!(f, ", for {held} s"),
            120..7200 => write!(f, ", for {} minutes", held / 60),
            _ => write!(f, ", for {} hours", held / 3600),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_holds_a_folder_until_it_lets_go() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(Lock::holder(folder.path()), None);
        let first = Lock::take(folder.path()).expect("nobody holds it");
        let holder = Lock::holder(folder.path()).expect("it is held");
        assert_eq!(holder.process, Some(std::process::id()));
        assert!(
            matches!(Lock::take(folder.path()), Err(LockError::Held(found)) if found.process == holder.process)
        );
        drop(first);
        assert_eq!(Lock::holder(folder.path()), None);
        Lock::take(folder.path()).expect("it is free again");
    }

    #[test]
    fn of_many_at_once_one_holds_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let start = std::sync::Barrier::new(8);
        let take = || {
            start.wait();
            Lock::take(folder.path()).ok()
        };
        let locks: Vec<Option<Lock>> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..8).map(|_| scope.spawn(take)).collect();
            let joined = threads.into_iter().map(|thread| thread.join());
            joined.map(|lock| lock.expect("no panic")).collect()
        });
        assert_eq!(locks.iter().flatten().count(), 1);
    }

    #[test]
    fn who_holds_it_is_said_as_far_as_it_is_known() {
        let said = |process, seconds: Option<u64>| {
            let held_for = seconds.map(Duration::from_secs);
            Holder { process, held_for }.to_string()
        };
        assert_eq!(said(Some(7), Some(3)), "process 7, for 3 s");
        assert_eq!(said(Some(7), Some(200)), "process 7, for 3 minutes");
        assert_eq!(said(None, None), "another process");
        let folder = tempfile::tempdir().expect("a folder");
        for text in ["", "x y", "99999999999999 1", "7 99999999999999999999"] {
            let path = folder.path().join(LOCK);
            std::fs::write(&path, text).expect("written");
            read_holder(&path).to_string();
        }
    }

    /// The file may have come with a run from somebody else.
    #[cfg(unix)]
    #[test]
    fn no_file_elsewhere_is_written_through_a_link() {
        let folder = tempfile::tempdir().expect("a folder");
        let elsewhere = folder.path().join("elsewhere");
        std::fs::write(&elsewhere, "kept").expect("written");
        let run = folder.path().join("run");
        std::fs::create_dir(&run).expect("a folder");
        std::os::unix::fs::symlink(&elsewhere, run.join(LOCK)).expect("a link");
        assert!(matches!(Lock::take(&run), Err(LockError::System(_))));
        std::fs::remove_file(run.join(LOCK)).expect("removed");
        std::fs::hard_link(&elsewhere, run.join(LOCK)).expect("another name");
        assert!(matches!(Lock::take(&run), Err(LockError::System(_))));
        assert_eq!(Lock::holder(&run), None);
        assert_eq!(std::fs::read_to_string(&elsewhere).expect("read"), "kept");
    }

    #[cfg(unix)]
    #[test]
    fn a_lock_goes_with_its_folder() {
        let all = tempfile::tempdir().expect("a folder");
        let [here, there] = ["here", "there"].map(|name| all.path().join(name));
        let remade = |path: &Path| {
            std::fs::create_dir(path).expect("a folder");
            Lock::take(path).expect("nobody holds it")
        };
        let first = remade(&here);
        assert!(first.is_in_place());
        std::fs::rename(&here, &there).expect("moved");
        assert!(!first.is_in_place(), "nothing is there");
        let second = remade(&here);
        assert!(!first.is_in_place() && second.is_in_place());
        std::fs::remove_dir_all(&here).expect("removed");
        std::fs::rename(&there, &here).expect("moved back");
        assert!(first.is_in_place() && !second.is_in_place());
        // By another way to the same folder, too.
        std::fs::rename(&here, &there).expect("moved");
        std::os::unix::fs::symlink(&there, &here).expect("a link");
        assert!(first.is_in_place());
    }
}
