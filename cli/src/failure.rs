//! What can end a command early, and the exit code it ends with.

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

    /// An input error about one file. The file is named once, also where the cause names it already.
    pub fn input(path: &Path, cause: impl Display) -> Self {
        let cause = cause.to_string();
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let named = [format!("{}: ", path.display()), format!("{file}: ")];
        let bare = named.iter().find_map(|name| cause.strip_prefix(name));
        Self::user(format!("`{}`: {}", path.display(), bare.unwrap_or(&cause)))
    }

    /// A file that cannot be written.
    pub fn write(path: &Path, cause: impl Display) -> Self {
        Self::work(format!("cannot write `{}`: {cause}", path.display()))
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
        for name in ["a/kick.fbx", "kick.fbx"] {
            let named = Failure::input(path, format!("{name}: an empty file"));
            assert_eq!(named.message(), Some("`a/kick.fbx`: an empty file"));
        }
    }

    #[test]
    fn a_closed_pipe_is_success() {
        let failure = Failure::from(io::Error::from(io::ErrorKind::BrokenPipe));
        assert!(failure.message().is_none());
        assert_eq!(failure.exit_code(), ExitCode::SUCCESS);
    }
}
