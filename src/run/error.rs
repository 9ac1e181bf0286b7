//! Why a run can't be made, opened or go on.

use crate::evaluate::EvaluateError;
use crate::explain::{Explain, Explanation, Fault, Parameter, explained};
use crate::file::FileError;
use crate::learn::LearnError;
use crate::motion::MotionError;
use crate::skeleton::SkeletonError;
use crate::task::TaskError;
use std::path::PathBuf;

/// Why a run can't be made, opened or go on.
#[derive(Debug)]
pub enum RunError {
    /// A file of the run can't be read.
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file of the run can't be written.
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The folder of a new run holds a run already.
    Exists(PathBuf),
    /// A folder that isn't a run.
    NoRun(PathBuf),
    /// A run without a policy: it was never saved.
    NoPolicy(PathBuf),
    /// A file of the run whose content can't be used.
    Config {
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
        }
    }
}

impl RunError {
    /// Whether a setting of the plan is at fault, so that the caller should say where it came from.
    pub fn is_setting(&self) -> bool {
        match self {
            Self::Task(error) => error.is_setting(),
            Self::Learn(error) => matches!(error, LearnError::Setting(_)),
            _ => false,
        }
    }

    /// Whether the run's folder or disk refuses to be written, so that the run can go on from its last checkpoint.
    pub fn is_write(&self) -> bool {
        let file = matches!(self, Self::Write { .. } | Self::File(_) | Self::Motion(_));
        file && self.explain().fault == Fault::Work
    }
}

impl Explain for RunError {
    fn explain(&self) -> Explanation {
        match self {
            Self::Read { path, source } => Explanation::input(format!("cannot be read ({source})"))
                .file(path)
                .remedy("check the path and its permissions"),
            Self::Write { path, source } => {
                Explanation::work(format!("cannot be written ({source})"))
                    .file(path)
                    .remedy("check the path, its permissions and the free space there")
            }
            Self::Exists(path) => Explanation::input("already holds a run")
                .file(path)
                .remedy_by(
                    Parameter::Output,
                    "choose another folder, or resume that run",
                ),
            Self::NoRun(path) => Explanation::input("is not a run: it has no config.json")
                .file(path)
                .remedy("give the folder of a run"),
            Self::NoPolicy(path) => Explanation::input("has no policy yet")
                .file(path)
                .remedy("train it first"),
            Self::Config { path, reason } => Explanation::input(reason)
                .file(path)
                .remedy("correct the file, or train a new run"),
            Self::File(error) => error.explain(),
            Self::Motion(error) => error.explain(),
            Self::Skeleton(error) => error.explain(),
            Self::Task(error) => error.explain(),
            Self::Learn(error) => error.explain(),
        }
    }
}

explained!(RunError);
