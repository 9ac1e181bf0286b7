//! How a run that was stopped is continued.

use crate::failure::Failure;
use mimic::run::{Run, RunError};

/// The program as it was typed, for commands that can be copied: in a fresh clone it is not `mimic`.
pub fn program() -> String {
    let program = std::env::args_os().next();
    program.map_or_else(
        || "mimic".into(),
        |program| program.to_string_lossy().into_owned(),
    )
}

/// How to continue a run that was stopped.
pub fn farewell(run: &Run) -> String {
    format!(
        "stopped; continue with `{} train --resume {}`",
        program(),
        run.dir().display()
    )
}

/// The failure of a run that cannot be written any more, because the disk is full for example. What was saved last is
/// whole, so the run can be continued from there.
pub fn unwritten(run: &Run, error: RunError) -> Failure {
    if !error.is_write() {
        return error.into();
    }
    let again = match run.is_saved() {
        true => format!(
            "continue with `{} train --resume {}`",
            program(),
            run.dir().display()
        ),
        false => "train again".to_owned(),
    };
    Failure::from(error).with_remedy(format!(
        "check its permissions and the free space there, then {again}"
    ))
}
