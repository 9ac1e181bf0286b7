//! What can end a command early, and the exit code it ends with.

use mimic::clip;
use mimic::explain::{Explain, Fault};
use mimic::motion::MotionError;
use std::fmt::Display;
use std::io;
use std::path::Path;
use std::process::ExitCode;

/// Wrong usage or input: the person who typed the command can mend it.
#[derive(Debug)]
pub struct UserError(String);

/// Everything was right, and the work still failed.
#[derive(Debug)]
pub struct WorkError(String);

/// What to do about a file that the system doesn't give.
const CHECK: &str = "check the path and its permissions";
/// What to do about a file that the system doesn't take.
const CHECK_ROOM: &str = "check the path, its permissions and the room there";

#[derive(Debug)]
pub enum Failure {
    User(UserError),
    Work(WorkError),
    /// The reader of our output went away, which is its right.
    ClosedPipe,
}

pub type Outcome<T = ()> = Result<T, Failure>;

impl Failure {
    pub fn user(message: impl Display) -> Self {
        Self::User(UserError(one_line(message)))
    }

    pub fn work(message: impl Display) -> Self {
        Self::Work(WorkError(one_line(message)))
    }

    /// Failed work, with what to do about it.
    pub fn with_remedy(self, remedy: impl Display) -> Self {
        match self {
            Self::Work(WorkError(message)) => Self::work(format!("{message}; {remedy}")),
            other => other,
        }
    }

    /// An input error about one file. The file is named once, also where the cause names it already.
    pub fn input(path: &Path, cause: impl Display) -> Self {
        let cause = without_name(path, &cause.to_string());
        Self::user(format!("`{}`: {cause}", path.display()))
    }

    /// A file that is there, perhaps, but can't be read.
    pub fn unreadable(path: &Path, cause: &io::Error) -> Self {
        Self::input(path, format!("cannot be read ({cause}); {CHECK}"))
    }

    /// An error of the library, which says itself whose fault it is.
    pub fn explained(error: &dyn Explain) -> Self {
        let told = error.explain();
        match told.fault {
            Fault::Input => Self::user(told),
            Fault::Work => Self::work(told),
        }
    }

    /// An error about the clip file `path`.
    pub fn clip(path: &Path, cause: clip::Error) -> Self {
        match cause {
            clip::Error::File(error) => Self::explained(&error),
            cause => Self::input(path, cause),
        }
    }

    /// An error about the motion file `path`.
    pub fn motion(path: &Path, cause: MotionError) -> Self {
        match cause {
            MotionError::File(error) => Self::explained(&error),
            cause => Self::input(path, cause),
        }
    }

    /// A file that cannot be written. The file is named once here too.
    pub fn write(path: &Path, cause: impl Display) -> Self {
        let cause = without_name(path, &cause.to_string());
        let cause = cause.trim_end_matches(CHECK).trim_end_matches("; ");
        // The temporary file beside it is nobody's concern.
        let cause = cause.split(" at path ").next().unwrap_or(cause);
        Self::work(format!(
            "cannot write `{}`: {cause}; {CHECK_ROOM}",
            path.display()
        ))
    }

    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::ClosedPipe => ExitCode::SUCCESS,
            Self::Work(_) => ExitCode::from(1),
            Self::User(_) => ExitCode::from(2),
        }
    }

    pub fn message(&self) -> Option<&str> {
        match self {
            Self::User(UserError(message)) | Self::Work(WorkError(message)) => Some(message),
            Self::ClosedPipe => None,
        }
    }
}

/// Failure to print.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::ClosedPipe,
            _ => Self::work(format!("cannot print: {error}")),
        }
    }
}

/// What a cause says after the name of its file: `x: …`, `` `x`: … ``, `` `x` is … ``, `` cannot write `x`: … ``.
fn without_name(path: &Path, cause: &str) -> String {
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let bare = cause.strip_prefix("cannot write ").unwrap_or(cause);
    let rest = [path.to_string_lossy(), file].into_iter().find_map(|name| {
        let quoted = format!("`{name}`");
        let rest = bare
            .strip_prefix(&quoted)
            .or_else(|| bare.strip_prefix(&*name))?;
        rest.strip_prefix(':').or(rest.strip_prefix(' '))
    });
    rest.map_or(cause, str::trim_start).to_owned()
}

fn one_line(message: impl Display) -> String {
    let text = message.to_string();
    let words: Vec<_> = text.split_whitespace().collect();
    words
        .join(" ")
        .chars()
        .filter(|c| !c.is_control())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_stays_on_one_line_and_names_its_file_once() {
        let path = Path::new("a/kick.fbx");
        let plain = Failure::input(path, "truncated\n  at byte 3");
        assert_eq!(plain.message(), Some("`a/kick.fbx`: truncated at byte 3"));
        for name in ["a/kick.fbx:", "kick.fbx:", "`a/kick.fbx`:", "`kick.fbx`"] {
            let named = Failure::input(path, format!("{name} an empty file"));
            assert_eq!(named.message(), Some("`a/kick.fbx`: an empty file"));
        }
        let other = Failure::input(path, "kick.fbx.bin: an empty file");
        assert_eq!(
            other.message(),
            Some("`a/kick.fbx`: kick.fbx.bin: an empty file")
        );
    }

    #[test]
    fn what_cannot_be_written_is_named_once_with_a_remedy() {
        let path = Path::new("a/kick.clip");
        for cause in [
            "no room",
            "a/kick.clip: no room; check the path and its permissions",
            "cannot write `a/kick.clip`: no room",
            "no room at path \"a/.mimic-123\"",
        ] {
            assert_eq!(
                Failure::write(path, cause).message(),
                Some(
                    "cannot write `a/kick.clip`: no room; check the path, its permissions and the room there"
                )
            );
        }
    }

    #[test]
    fn a_closed_pipe_is_success() {
        let failure = Failure::from(io::Error::from(io::ErrorKind::BrokenPipe));
        assert!(failure.message().is_none());
        assert_eq!(failure.exit_code(), ExitCode::SUCCESS);
    }
}
