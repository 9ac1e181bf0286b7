//! The folder of a new run: claimed before anything is prepared, so that no other process makes its run there.

use super::error::RunError;
use super::files;
use super::folder::{Run, RunConfig, check};
use super::plan::Plan;
use crate::file::{LOCK, Lock, is_temporary};
use crate::motion::Motion;
use crate::skeleton::Skeleton;
use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A folder that is empty, and held by this process until a run is made in it. A claim that is dropped leaves nothing.
#[derive(Debug)]
pub struct Claim {
    dir: PathBuf,
    /// `None` once a run has taken it over.
    held: Option<Arc<Held>>,
}

/// A folder that this process holds.
#[derive(Debug)]
pub(super) struct Held {
    dir: PathBuf,
    /// The folders that were made for it, the innermost first.
    made: Vec<PathBuf>,
    lock: Lock,
    /// Whether this process wrote the files of a run. Before that, what is there is somebody's.
    written: AtomicBool,
}

/// What a new run leaves behind if nothing of it is ever saved. Whoever ends the program can remove it from anywhere. As long
/// as this exists, the folder stays locked.
#[derive(Clone, Debug)]
pub struct Unsaved(Option<Arc<Held>>);

impl Unsaved {
    /// Removes the run, and the folders that were made for it. A run that was saved stays, and so does one that was there
    /// before, or whose folder isn't where it was.
    pub fn remove(self) {
        if let Some(held) = self.0 {
            held.clear();
        }
    }
}

impl Held {
    /// Locks the folder `dir`, in which there may be a run.
    pub(super) fn take(dir: &Path, made: Vec<PathBuf>) -> Result<Self, RunError> {
        Ok(Self {
            dir: dir.to_owned(),
            made,
            lock: Lock::take(dir).map_err(|e| RunError::locked(dir, e))?,
            written: AtomicBool::new(false),
        })
    }

    /// Checks that the path still leads to the folder that is held. What another process puts in its place isn't ours.
    pub(super) fn check(&self) -> Result<(), RunError> {
        match self.lock.is_in_place() {
            true => Ok(()),
            false => Err(RunError::Moved(self.dir.clone())),
        }
    }

    /// Removes what was made here, unless there is something to go on from.
    fn clear(&self) {
        if self.check().is_err() || self.dir.join(files::CHECKPOINT).exists() {
            return;
        }
        let written = self.written.load(Ordering::SeqCst);
        if !written && self.dir.join(files::CONFIG).exists() {
            return;
        }
        remove(&self.dir, |name| {
            name == LOCK || written && files::is_own(name)
        });
        for folder in &self.made {
            // Folders with something in them stay.
            fs::remove_dir(folder).ok();
        }
    }
}

impl Claim {
    /// Claims the folder `dir`. It is made if there is none.
    ///
    /// # Errors
    /// A folder that isn't empty, that another process holds, or that can't be written.
    pub fn on(dir: impl AsRef<Path>) -> Result<Self, RunError> {
        let dir = dir.as_ref();
        let made = make(dir)?;
        // Nothing is put into a folder with files, and only the lock makes sure that no other process puts something there.
        check_empty(dir)?;
        let claim = Self {
            dir: dir.to_owned(),
            held: Some(Arc::new(Held::take(dir, made)?)),
        };
        match check_empty(dir) {
            Ok(()) => Ok(claim),
            Err(error) => {
                claim.give_up();
                Err(error)
            }
        }
    }

    /// The folder.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// What is to be removed if the program has to end while the run is made.
    pub fn unsaved(&self) -> Unsaved {
        Unsaved(self.held.clone())
    }

    /// Makes a run in the folder.
    ///
    /// # Errors
    /// A plan, a character or motions that can't be trained, or a folder that can't be written. Nothing is left of it then.
    pub fn create(
        mut self,
        plan: Plan,
        skeleton: Skeleton,
        motions: Vec<Motion>,
    ) -> Result<Run, RunError> {
        // Clips of older versions may have other contacts; those of the character are alike for all.
        let fits = |motion: &Motion| motion.check_skeleton(&skeleton).is_ok();
        let whole = |motion: Motion| match fits(&motion) {
            true => motion.with_all_contacts(&skeleton),
            false => motion,
        };
        let motions: Vec<Motion> = motions.into_iter().map(whole).collect();
        check(&plan, &skeleton, &motions)?;
        if let Some(held) = &self.held {
            held.check()?;
            // What a killed process left gives way now that a run will take its place.
            remove(&self.dir, |name| name != LOCK && files::is_own(name));
            held.written.store(true, Ordering::SeqCst);
        }
        let write = |name: &str, text: &str| super::folder::write(&self.dir.join(name), text);
        write(files::SKELETON, &skeleton.mjcf)?;
        write(files::SLOTS, &skeleton.slots_json())?;
        for (i, motion) in motions.iter().enumerate() {
            motion.save(self.dir.join(files::reference(i)))?;
        }
        // Last, because this is what makes the folder a run.
        let config = RunConfig::new(&skeleton.name, motions.len(), plan);
        write(files::CONFIG, &config.text(&self.dir)?)?;
        // Files hold single precision: only what is read back from them is learned, so that a resumed run sees the same.
        let mut run = Run::open(&self.dir)?;
        run.held = self.held.take();
        Ok(run)
    }

    /// Ends the claim on a folder that turned out to belong to somebody else.
    fn give_up(mut self) {
        self.held = None;
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        Unsaved(self.held.take()).remove();
    }
}

impl Run {
    /// Makes a run in the folder `dir`, which is empty or doesn't exist yet. A plan that can't be trained leaves no folder.
    ///
    /// # Errors
    /// As [`Claim::on`] and [`Claim::create`].
    pub fn create(
        dir: impl AsRef<Path>,
        plan: Plan,
        skeleton: Skeleton,
        motions: Vec<Motion>,
    ) -> Result<Self, RunError> {
        Claim::on(dir)?.create(plan, skeleton, motions)
    }

    /// What is to be removed if nothing of this run is ever saved; nothing of a run that was opened.
    pub fn unsaved(&self) -> Unsaved {
        Unsaved(self.held.clone())
    }
}

/// Makes the folder and those around it. Returns those that weren't there, the innermost first.
fn make(dir: &Path) -> Result<Vec<PathBuf>, RunError> {
    let missing = dir
        .ancestors()
        .take_while(|path| !path.as_os_str().is_empty() && !path.is_dir());
    let made = missing.map(Path::to_owned).collect();
    match fs::create_dir_all(dir) {
        Ok(()) => Ok(made),
        Err(e) => Err(unmade(dir, e)),
    }
}

fn unmade(dir: &Path, source: io::Error) -> RunError {
    match source.kind() {
        // Some part of the path is a file, or a link that leads nowhere.
        io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists => {
            let mut parts = dir.ancestors();
            let file = parts.find(|part| part.symlink_metadata().is_ok());
            RunError::NoFolder(file.unwrap_or(dir).to_owned())
        }
        _ => RunError::Write {
            path: dir.to_owned(),
            source,
        },
    }
}

/// Checks that nothing is in a folder but what a process left that was killed while it made a run there: the lock says that
/// it had the folder for itself, and without a configuration it isn't a run yet.
fn check_empty(dir: &Path) -> Result<(), RunError> {
    let entries = fs::read_dir(dir).map_err(|source| RunError::Read {
        path: dir.to_owned(),
        source,
    })?;
    let was_claimed = dir.join(LOCK).exists();
    let is_left = |name: &OsStr| {
        name == LOCK
            || is_temporary(&name.to_string_lossy())
            || was_claimed && files::is_made_first(name)
    };
    let mut names = entries.flatten().map(|entry| entry.file_name());
    match names.all(|name| is_left(&name)) {
        true => Ok(()),
        false if dir.join(files::CONFIG).exists() => Err(RunError::Exists(dir.to_owned())),
        false => Err(RunError::NotEmpty(dir.to_owned())),
    }
}

/// Removes files of a run, by their names. What can't be removed stays: what goes on here meets it, and says more.
fn remove(dir: &Path, meant: impl Fn(&OsStr) -> bool) {
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        if meant(&entry.file_name()) {
            fs::remove_file(entry.path()).ok();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_that_is_dropped_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("runs/kick");
        let claim = Claim::on(&path).expect("it is free");
        assert!(matches!(Claim::on(&path), Err(RunError::Held { .. })));
        drop(claim);
        assert_eq!(fs::read_dir(folder.path()).expect("listed").count(), 0);
        // A folder that was there stays.
        fs::create_dir_all(&path).expect("a folder");
        drop(Claim::on(&path).expect("it is empty"));
        assert_eq!(fs::read_dir(&path).expect("listed").count(), 0);
    }

    #[test]
    fn what_is_in_a_folder_stays_as_it_is() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("eval.json"), "mine").expect("written");
        assert!(matches!(
            Claim::on(folder.path()),
            Err(RunError::NotEmpty(_))
        ));
        let file = folder.path().join("eval.json");
        for dir in [file.clone(), file.join("run"), file.join("runs/run")] {
            let error = Claim::on(&dir).expect_err("a file is in the way");
            assert!(matches!(&error, RunError::NoFolder(found) if *found == file));
            assert_eq!(error.is_taken(&dir), dir == file);
        }
        assert_eq!(fs::read_to_string(&file).expect("read"), "mine");
        assert_eq!(fs::read_dir(folder.path()).expect("listed").count(), 1);
    }

    #[test]
    fn what_a_killed_process_left_of_a_run_gives_way() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str| fs::write(folder.path().join(name), "left").expect("written");
        for name in [files::SKELETON, files::SLOTS, "reference-3.motion"] {
            write(name);
        }
        // Without the lock they may be anybody's.
        let claim = || Claim::on(folder.path());
        assert!(matches!(claim(), Err(RunError::NotEmpty(_))));
        write(LOCK);
        drop(claim().expect("nobody holds it"));
        let left = fs::read_dir(folder.path()).expect("listed").count();
        assert_eq!(left, 3, "no run took its place");
        write(LOCK);
        write("notes.txt");
        assert!(matches!(claim(), Err(RunError::NotEmpty(_))));
    }

    #[test]
    fn one_of_many_gets_a_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run");
        let start = std::sync::Barrier::new(8);
        let claim = || {
            start.wait();
            Claim::on(&path).ok()
        };
        let claims: Vec<Option<Claim>> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..8).map(|_| scope.spawn(claim)).collect();
            let joined = threads.into_iter().map(|thread| thread.join());
            joined.map(|claim| claim.expect("no panic")).collect()
        });
        assert_eq!(claims.iter().flatten().count(), 1);
    }
}
