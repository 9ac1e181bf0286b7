//! What can end a command early, and the exit code it ends with.
//!
//! The library's errors come with their parts ([`Explain`]): which file, where in it, what is wrong and what to do. All that
//! is added here is the name of the flag to change. Exit code 2 is for what the user can mend, 1 for work that failed.

use mimic::explain::{Explain, Explanation, Fault, Parameter, Remedy, plain};
use mimic::file::{unread, unwritten};
use serde_json::{Value, json};
use std::error::Error;
use std::fmt::Display;
use std::io;
use std::path::Path;

/// The flag that sets a parameter of the library, with what is to be given for its value.
pub fn flag(parameter: Parameter) -> Option<&'static str> {
    Some(match parameter {
        Parameter::Take => "--take TAKE",
        Parameter::FrameRate => "--fps HZ",
        Parameter::Trim => "--trim A..B",
        Parameter::Unit => "--unit METRES",
        Parameter::UpAxis => "--up AXIS",
        // Whether it repeats was decided by the motion; who disagrees mostly has a motion that doesn't.
        Parameter::LoopMode => "--loop clamp",
        Parameter::JointMap => "--map FILE",
        Parameter::SlotWeight => "--weight SLOT=X",
        Parameter::Skeleton => "--skeleton NAME",
        Parameter::Speed => "--speed FACTOR",
        Parameter::Output => "--out PATH",
        _ => return None,
    })
}

/// Why a command ended early.
#[derive(Debug, PartialEq)]
pub enum Failure {
    /// It failed, and nobody has been told yet.
    Failed(Box<Explanation>),
    /// It failed in part: its result has been printed, and holds the error where it is JSON.
    Partly(Box<Explanation>),
    /// The reader of our output went away, as `head` does: no failure.
    ClosedPipe,
}

/// What a command, or a step of it, comes to.
pub type Outcome<T = ()> = Result<T, Failure>;

impl Failure {
    fn new(parts: Explanation) -> Self {
        Self::Failed(Box::new(parts))
    }

    /// Wrong usage or input: whoever typed the command can mend it.
    pub fn user(cause: impl Display) -> Self {
        Self::new(Explanation::input(cause.to_string()))
    }

    /// Work that failed although the input was right.
    pub fn work(cause: impl Display) -> Self {
        Self::new(Explanation::work(cause.to_string()))
    }

    /// Wrong input, in one file.
    pub fn input(file: &Path, cause: impl Display) -> Self {
        Self::new(Explanation::input(cause.to_string()).file(file))
    }

    /// An error of the library about what came from `file`, unless it names another itself.
    pub fn in_file(file: &Path, error: impl Explain) -> Self {
        let mut parts = error.explain();
        parts.file.get_or_insert_with(|| file.to_owned());
        Self::new(parts)
    }

    /// A file that may be there, but cannot be read.
    pub fn unreadable(file: &Path, cause: &io::Error) -> Self {
        Self::new(unread(cause).file(file))
    }

    /// A file or folder that cannot be written.
    pub fn write(file: &Path, cause: impl Into<Box<dyn Error>>) -> Self {
        let cause = cause.into();
        let mut reason: &dyn Error = &*cause;
        // The innermost reason is that of the system. Those around it may name the temporary file beside this one.
        while let Some(source) = reason.source() {
            reason = source;
        }
        Self::new(unwritten(file, &io::Error::other(reason.to_string())))
    }

    /// Output that cannot be printed.
    pub fn print(cause: &io::Error) -> Self {
        match cause.kind() {
            io::ErrorKind::BrokenPipe => Self::ClosedPipe,
            _ => Self::work(format!("cannot print the result: {cause}")),
        }
    }

    /// Says where in the file.
    #[must_use]
    pub fn with_place(self, place: impl Display) -> Self {
        self.map(|parts| parts.place(place.to_string()))
    }

    /// Says what to do about it; `advice` begins with a verb.
    #[must_use]
    pub fn with_remedy(self, advice: impl Display) -> Self {
        self.map(|parts| parts.remedy(advice.to_string()))
    }

    fn map(self, change: impl FnOnce(Explanation) -> Explanation) -> Self {
        match self {
            Self::Failed(parts) => Self::Failed(Box::new(change(*parts))),
            Self::Partly(parts) => Self::Partly(Box::new(change(*parts))),
            Self::ClosedPipe => Self::ClosedPipe,
        }
    }

    /// The failure of a command whose result has been printed.
    #[must_use]
    pub fn partly(self) -> Self {
        match self {
            Self::Failed(parts) => Self::Partly(parts),
            other => other,
        }
    }

    /// The exit code of the command.
    pub fn code(&self) -> u8 {
        match self.parts().map(|parts| parts.fault) {
            None => 0,
            Some(Fault::Work) => 1,
            Some(Fault::Input) => 2,
        }
    }

    /// The message in one line, with the flag to change; `None` where there is nothing to say.
    pub fn message(&self) -> Option<String> {
        let mut parts = self.parts()?.clone();
        parts.remedy = remedy(&parts).map(|advice| Remedy {
            advice,
            parameter: None,
        });
        Some(plain(&parts.to_string()))
    }

    /// The parts of the message for scripts.
    pub fn json(&self) -> Value {
        let Some(parts) = self.parts() else {
            return Value::Null;
        };
        json!({
            "message": self.message(),
            // A path need not be Unicode, which JSON has to be.
            "file": parts.file.as_ref().map(|file| file.display().to_string()),
            "place": parts.place,
            "remedy": remedy(parts),
            "exit": self.code(),
        })
    }

    fn parts(&self) -> Option<&Explanation> {
        match self {
            Self::Failed(parts) | Self::Partly(parts) => Some(parts),
            Self::ClosedPipe => None,
        }
    }
}

impl<E: Explain> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::new(error.explain())
    }
}

/// The advice with its flag: "choose another take (`--take TAKE`)".
fn remedy(parts: &Explanation) -> Option<String> {
    let Remedy { advice, parameter } = parts.remedy.as_ref()?;
    Some(match parameter.and_then(flag) {
        Some(flag) => format!("{advice} (`{flag}`)"),
        None => advice.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_stays_on_one_line() {
        let failure = Failure::input(Path::new("a/kick.fbx"), "truncated\n  at byte 3\x1b[2J");
        assert_eq!(
            failure.message().as_deref(),
            Some("`a/kick.fbx`: truncated   at byte 3 [2J")
        );
    }

    #[test]
    fn the_flag_to_change_stands_in_the_remedy() {
        let parts = Explanation::input("it has no frames")
            .file("kick.fbx")
            .place("take `Kick`")
            .remedy_by(Parameter::Take, "choose another take");
        let failure = Failure::new(parts);
        let line = "`kick.fbx`: take `Kick`: it has no frames; choose another take (`--take TAKE`)";
        assert_eq!(failure.message().as_deref(), Some(line));
        let expected = json!({
            "message": line,
            "file": "kick.fbx",
            "place": "take `Kick`",
            "remedy": "choose another take (`--take TAKE`)",
            "exit": 2,
        });
        assert_eq!(failure.json(), expected);
    }

    #[test]
    fn the_fault_decides_the_exit_code() {
        assert_eq!(Failure::user("wrong").code(), 2);
        assert_eq!(Failure::work("broken").partly().code(), 1);
        let closed = Failure::print(&io::ErrorKind::BrokenPipe.into());
        assert_eq!((closed.code(), closed.message()), (0, None));
    }
}
