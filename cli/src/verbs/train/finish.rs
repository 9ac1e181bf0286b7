//! What follows the learning: how well it went, and how to look at it.

use super::{program, unwritten};
use crate::failure::{Failure, Outcome};
use crate::printer::Printer;
use crate::recording;
use crate::runs;
use crate::verbs::{eval, replay};
use crate::viewer::{self, Viewer};
use mimic::evaluate::Options;
use mimic::run::{Run, Session, files};
use mimic::task::{EpisodeStart, StartState};
use std::path::{Path, PathBuf};

/// Seconds of a looping motion in the recording of a finished run.
const REPLAY_S: f64 = 10.0;

/// Measures and records what was learned.
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

/// A run that has learned all it will: makes up for what a killed session left out.
pub fn make_up(session: &Session, printer: &Printer) -> Outcome {
    let run = session.run();
    let folder = run.dir().display();
    let is_there = |name: &str| run.dir().join(name).exists();
    let recorded = !recording::AVAILABLE || is_there(files::RECORDING);
    if is_there(files::EVALUATION) && recorded {
        let (samples, mimic) = (session.trainer().samples(), program());
        return Err(Failure::user(format!(
            "`{folder}` is finished: it has learned from all its {samples} samples"
        ))
        .with_remedy(format!(
            "measure it with `{mimic} eval {folder}`, or watch it with `{mimic} replay {folder} --rerun`"
        )));
    }
    printer.note(format!(
        "`{folder}` has learned from all its samples; only its evaluation or its recording is missing"
    ));
    // The checkpoint is written first, so the policy may be that of the round before.
    session.save().map_err(|e| unwritten(run, e))?;
    finish(session, printer)
}

/// The recording's file; `None` where the agent has nothing to show, or this build can't write recordings.
fn record(run: &Run, printer: &Printer) -> Outcome<Option<PathBuf>> {
    if !recording::AVAILABLE {
        return Ok(None);
    }
    let start = EpisodeStart::new(0, StartState::Reference(0.0));
    match runs::record(run, start, REPLAY_S) {
        Ok(shown) => {
            let file = run.dir().join(files::RECORDING);
            replay::save(&shown, &file, run.dir())?;
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
        text += &format!(
            "  there is no rerun on this machine yet: {}\n",
            viewer::install()
        );
    }
    text
}
