//! What follows the learning: how well it went, and how to look at it.

use super::{program, unwritten};
use crate::failure::{Failure, Outcome};
use crate::printer::Printer;
use crate::recording;
use crate::runs;
use crate::verbs::{eval, replay};
use crate::viewer::{self, Viewer};
use mimic::evaluate::{Options, Start};
use mimic::learn::{Run, RunError, Trainer};
use std::path::{Path, PathBuf};

/// Seconds of a looping motion in the recording of a finished run.
const REPLAY_S: f64 = 10.0;

fn recording_file(run: &Run) -> PathBuf {
    run.dir().join("replay.rrd")
}

fn evaluation(run: &Run) -> PathBuf {
    run.dir().join(runs::EVALUATION)
}

/// Saves what was learned. Results of an older policy don't stay beside a newer one, so whoever finds some knows
/// that the run was finished.
pub fn save(run: &Run, trainer: &Trainer) -> Result<(), RunError> {
    for outdated in [evaluation(run), recording_file(run)] {
        std::fs::remove_file(outdated).ok();
    }
    run.save(trainer)
}

/// Measures and records what was learned.
pub fn finish(run: &Run, printer: &Printer) -> Outcome {
    let options = Options {
        perturbations: runs::perturbations(run, false),
        ..Options::default()
    };
    let results = runs::evaluate(run, &options, printer)?;
    runs::keep(run, &results)?;
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

/// A run that has learned all it will: what a killed session left out is made up for.
pub fn make_up(run: &Run, trainer: &Trainer, printer: &Printer) -> Outcome {
    let folder = run.dir().display();
    let recorded = !recording::AVAILABLE || recording_file(run).exists();
    if evaluation(run).exists() && recorded {
        let (samples, mimic) = (trainer.samples(), program());
        return Err(Failure::user(format!(
            "`{folder}` is finished, it has learned from all its {samples} samples: \
             measure it with `{mimic} eval {folder}`, watch it with `{mimic} replay {folder} --rerun`"
        )));
    }
    printer.note(format!(
        "`{folder}` has learned from all its samples, what is missing is its evaluation or recording"
    ));
    // The checkpoint is written first, so the policy may be that of the round before.
    save(run, trainer).map_err(|e| unwritten(run, e))?;
    finish(run, printer)
}

/// The recording's file; `None` where the agent has nothing to show, or this build can't write recordings.
fn record(run: &Run, printer: &Printer) -> Outcome<Option<PathBuf>> {
    if !recording::AVAILABLE {
        return Ok(None);
    }
    match runs::record(run, 0, (Start::At(0.0), None), REPLAY_S) {
        Ok(shown) => {
            let file = recording_file(run);
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
