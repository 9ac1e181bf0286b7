//! Why a run can't be made, opened or go on.

use crate::evaluate::EvaluateError;
use crate::explain::{Explain, Explanation, Fault, Parameter, explained};
use crate::file::{FileError, Flaw, Holder, LOCK, LockError, unread, unwritten};
use crate::learn::LearnError;
use crate::motion::MotionError;
use crate::skeleton::SkeletonError;
use crate::task::TaskError;
use std::io;
use std::path::{Path, PathBuf};

/// Why a run can't be made, opened or go on.
#[derive(Debug)]
pub enum RunError {
    /// A file of the run can't be read.
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file of the run can't be written.
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The folder of a new run holds a run already.
    Exists(PathBuf),
    /// The folder of a new run holds other files.
    NotEmpty(PathBuf),
    /// A file where a folder is needed for a new run.
    NoFolder(PathBuf),
    /// Another process trains the run, or is making one in the folder.
    Held {
        /// The folder.
        path: PathBuf,
        /// Who holds it.
        holder: Holder,
    },
    /// The run's path no longer leads to the folder that this process holds.
    Moved(PathBuf),
    /// A folder that isn't a run.
    NoRun(PathBuf),
    /// A run without a policy: it was never saved.
    NoPolicy(PathBuf),
    /// The same, while another process trains it.
    NoPolicyYet(PathBuf),
    /// A file of the run whose content can't be used.
    Config {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// An evaluation of a run that can't be used.
    NoEvaluation {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A checkpoint or a policy that can't be read or written.
    File(FileError),
    /// A reference motion that can't be read or written.
    Motion(MotionError),
    /// A character that can't be used.
    Skeleton(SkeletonError),
    /// Settings or motions from which no task can be built.
    Task(TaskError),
    /// Learning that can't begin or go on.
    Learn(LearnError),
    /// An evaluation that can't be done.
    Evaluate(EvaluateError),
    /// What is wrong with the content of a file of the run.
    InFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        error: Box<RunError>,
    },
}

macro_rules! from {
    ($($error:ident => $variant:ident),*) => {
        $(impl From<$error> for RunError {
            fn from(error: $error) -> Self {
                Self::$variant(error)
            }
        })*
    };
}

from!(FileError => File, MotionError => Motion, SkeletonError => Skeleton, TaskError => Task, LearnError => Learn);

impl From<EvaluateError> for RunError {
    fn from(error: EvaluateError) -> Self {
        match error {
            EvaluateError::Learn(error) => Self::Learn(error),
            EvaluateError::Task(error) => Self::Task(error),
            EvaluateError::TooLong { .. } => Self::Evaluate(error),
        }
    }
}

impl RunError {
    /// Why the folder `path` can't be locked.
    pub(super) fn locked(path: &Path, error: LockError) -> Self {
        let path = path.to_owned();
        match error {
            LockError::Held(holder) => Self::Held { path, holder },
            LockError::System(source) if source.kind() == io::ErrorKind::InvalidInput => {
                let path = path.join(LOCK);
                let reason = "this is not a file of this folder alone, which the lock has to be";
                Self::Config {
                    path,
                    reason: reason.to_owned(),
                }
            }
            LockError::System(source) => Self::Write { path, source },
        }
    }

    /// Blames an error that names no file on the file `path`.
    pub(super) fn in_file<E: Into<Self>>(path: &Path) -> impl Fn(E) -> Self {
        move |error| Self::InFile {
            path: path.to_owned(),
            error: Box::new(error.into()),
        }
    }

    /// Whether `dir`, the folder for a new run, is in use, so that another one beside it has to be found.
    pub fn is_taken(&self, dir: &Path) -> bool {
        match self {
            Self::Exists(_) | Self::NotEmpty(_) | Self::Held { .. } => true,
            Self::NoFolder(file) => file == dir,
            _ => false,
        }
    }

    /// Whether a setting of the plan is at fault, so that the caller should say where it came from.
    pub fn is_setting(&self) -> bool {
        match self {
            Self::Task(error) => error.is_setting(),
            Self::Learn(error) => matches!(error, LearnError::Setting(_)),
            Self::InFile { error, .. } => error.is_setting(),
            _ => false,
        }
    }

    /// Whether the run's folder or disk refuses to be written, or something is in the way there, so that the run can go on from its last checkpoint.
    pub fn is_write(&self) -> bool {
        match self {
            Self::Write { .. } => true,
            Self::File(error) => matches!(error.flaw, Flaw::Write(_)),
            Self::Motion(_) => self.explain().fault == Fault::Work,
            _ => false,
        }
    }
}

impl Explain for RunError {
    fn explain(&self) -> Explanation {
        match self {
            Self::Read { path, source } => unread(source).file(path),
            Self::Write { path, source } => unwritten(path, source),
            Self::Exists(path) => Explanation::input("this folder already holds a run")
                .file(path)
                .remedy_by(
                    Parameter::Output,
                    "choose another folder, or resume that run",
                ),
            Self::NotEmpty(path) => Explanation::input(
                "this folder holds other files, and a run wants a folder of its own",
            )
            .file(path)
            .remedy_by(Parameter::Output, "choose a new or an empty folder"),
            Self::NoFolder(path) => Explanation::input("this is not a folder, and a run is one")
                .file(path)
                .remedy_by(Parameter::Output, "choose another folder"),
            Self::Held { path, holder } => {
                Explanation::input(format!("another process is at work in this run ({holder})"))
                    .file(path)
                    .remedy("wait until it ends, or stop it")
            }
            Self::Moved(path) => Explanation::work(
                "the folder of this run was moved or replaced, or its .mimic.lock was removed, so nothing more is written here",
            )
            .file(path)
            .remedy("resume the run where its folder is now; it goes on from its last checkpoint"),
            Self::NoRun(path) => {
                Explanation::input("this is not a run: there is no config.json in it")
                    .file(path)
                    .remedy("give the folder of a run")
            }
            Self::NoPolicy(path) => Explanation::input("this run has no policy")
                .file(path)
                .remedy("resume its training, which makes the policy"),
            Self::NoPolicyYet(path) => Explanation::input(
                "this run has no policy yet, and another process trains it",
            )
            .file(path)
            .remedy("wait for the end of its first round"),
            Self::Config { path, reason } => Explanation::input(reason)
                .file(path)
                .remedy("correct the file, or train a new run"),
            Self::NoEvaluation { path, reason } => {
                Explanation::input(format!("this is not an evaluation ({reason})"))
                    .file(path)
                    .remedy("evaluate the run again, which replaces the file")
            }
            Self::File(error) => error.explain(),
            Self::Motion(error) => error.explain(),
            Self::Skeleton(error) => error.explain(),
            Self::Task(error) => error.explain(),
            Self::Learn(error) => error.explain(),
            Self::Evaluate(error) => error.explain(),
            Self::InFile { path, error } => {
                let told = error.explain();
                match told.file {
                    Some(_) => told,
                    None => told.file(path),
                }
            }
        }
    }
}

explained!(RunError);
