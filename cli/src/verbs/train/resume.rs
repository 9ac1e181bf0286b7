//! How a run that was stopped is continued.

use crate::failure::Failure;
use crate::shell;
use mimic::explain::{Explain, Fault};
use mimic::run::{Run, RunError};

/// The program as it was typed, for commands that can be copied: in a fresh clone it is not `mimic`.
pub fn program() -> String {
    let program = std::env::args_os().next();
    program.map_or_else(
        || "mimic".into(),
        |program| shell::word(&program.to_string_lossy()),
    )
}

/// The command that continues a run.
pub fn again(run: &Run) -> String {
    format!("{} train --resume {}", program(), shell::path(run.dir()))
}

/// How to continue a run that was stopped.
pub fn farewell(run: &Run) -> String {
    format!("stopped; continue with `{}`", again(run))
}

/// The failure of a run that cannot be written any more, because the disk is full for example. What was saved last is
/// whole, so the run can be continued from there.
pub fn unwritten(run: &Run, error: RunError) -> Failure {
    if !error.is_write() {
        return error.into();
    }
    let again = match run.is_saved() {
        true => format!("continue with `{}`", again(run)),
        false => "train again".to_owned(),
    };
    let parts = error.explain();
    let first = match parts.remedy.filter(|_| parts.fault == Fault::Input) {
        // Something is in the way.
        Some(remedy) => remedy.advice,
        None => "check its permissions and the free space there".to_owned(),
    };
    Failure::from(error).with_remedy(format!("{first}, then {again}"))
}
