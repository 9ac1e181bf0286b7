//! The end of training: evaluation, recording, and how to watch the result.

use super::resume::{program, unwritten};
use crate::failure::{Failure, Outcome};
use crate::printer::Printer;
use crate::recording;
use crate::runs;
use crate::verbs::eval;
use crate::viewer::{self, Viewer};
use mimic::evaluate::Options;
use mimic::run::{Run, Session, files};
use mimic::task::{EpisodeStart, StartState};
use std::path::{Path, PathBuf};

/// Length of the recording of a looping motion, seconds.
const REPLAY_S: f64 = 10.0;

/// Evaluates and records what was learned.
pub fn finish(session: &Session, printer: &Printer) -> Outcome {
    let run = session.run();
    let options = Options {
        perturbations: runs::perturbations(run, false),
        ..Options::default()
    };
    let results = runs::evaluate(run, &options, printer)?;
    run.keep_evaluation(&results)?;
    let recorded = record(run, printer)?;
    if printer.is_json() {
        return Ok(());
    }
    let folder = run.dir().display();
    let look = match recorded {
        Some(file) => how_to_look(run.dir(), &file),
        None => String::new(),
    };
    printer.text(&format!("{folder}\n{}{look}", eval::text(&results)))
}

/// For a run that has used up its samples: does what a session that was killed left out, and makes a policy that was lost or
/// damaged again from the checkpoint.
pub fn make_up(session: &Session, printer: &Printer) -> Outcome {
    let run = session.run();
    let folder = run.dir().display();
    let is_there = |name: &str| run.dir().join(name).exists();
    let recorded = !recording::AVAILABLE || is_there(files::RECORDING);
    if is_there(files::EVALUATION) && recorded && session.has_policy() {
        let (samples, mimic) = (session.trainer().samples(), program());
        return Err(Failure::user(format!(
            "the run `{folder}` is finished: it has learned from all its {samples} samples"
        ))
        .with_remedy(format!(
            "evaluate it with `{mimic} eval {folder}`, or watch it with `{mimic} replay {folder} --rerun`"
        )));
    }
    printer.note(format!(
        "the run `{folder}` has used up its samples; only some of its results are missing"
    ));
    // The policy follows from the checkpoint.
    session.save().map_err(|e| unwritten(run, e))?;
    finish(session, printer)
}

/// Writes the recording and returns its file; `None` if the agent fails at once, or this build cannot write recordings.
fn record(run: &Run, printer: &Printer) -> Outcome<Option<PathBuf>> {
    if !recording::AVAILABLE {
        return Ok(None);
    }
    let start = EpisodeStart::new(0, StartState::Reference(0.0));
    match runs::record(run, start, REPLAY_S) {
        Ok(shown) => {
            let file = run.dir().join(files::RECORDING);
            recording::save(&shown, &file)?;
            Ok(Some(file))
        }
        Err(failure) => {
            printer.warn(failure.message().unwrap_or_default());
            Ok(None)
        }
    }
}

fn how_to_look(folder: &Path, recording: &Path) -> String {
    let (folder, recording, mimic) = (folder.display(), recording.display(), program());
    let mut text = format!(
        "recording: {recording}\n  watch it          rerun {recording}\n  or from the run   {mimic} replay {folder} --rerun\n"
    );
    if Viewer::find().is_none() {
        text += &format!("  rerun is not installed yet: {}\n", viewer::install());
    }
    text
}
