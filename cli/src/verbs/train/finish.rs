//! The end of training: evaluation, recording, and how to watch the result.

use super::resume::{program, unwritten};
use crate::amount;
use crate::failure::{Failure, Outcome};
use crate::printer::Printer;
use crate::recording;
use crate::runs;
use crate::verbs::eval;
use crate::viewer::{self, Viewer};
use mimic::evaluate::Options;
use mimic::explain::plain;
use mimic::run::{CaseEvaluation, Iteration, Plan, Run, Session, files};
use mimic::task::{EpisodeStart, StartState};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Length of the recording of a looping motion, seconds.
const REPLAY_S: f64 = 10.0;

/// Why a training session ended.
#[derive(Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Stopped {
    /// The samples are used up.
    Samples,
    /// There is no time for another round.
    Minutes,
    /// By a signal.
    Interrupt,
}

/// Evaluates and records what was learned.
pub fn finish(session: &Session, stopped: Stopped, printer: &Printer) -> Outcome {
    let run = session.run();
    let options = options(run);
    let results = runs::evaluate(run, &options, printer)?;
    run.keep_evaluation(&results)?;
    let recorded = record(run, printer)?;
    if printer.is_json() {
        return last_line(run, stopped, CaseEvaluation::json(&results), printer);
    }
    let folder = plain(&run.dir().display().to_string());
    let look = match recorded {
        Some(file) => how_to_look(run.dir(), &file),
        None => String::new(),
    };
    let advice = advice(session, stopped, &results);
    let table = eval::text(&results, advice.as_deref());
    printer.text(&format!("{folder}\n{table}{look}"))
}

/// Ends a session that was interrupted, and that nothing more is to be said of.
pub fn interrupted(run: &Run, printer: &Printer) -> Outcome {
    match printer.is_json() {
        true => last_line(run, Stopped::Interrupt, Value::Null, printer),
        false => Ok(()),
    }
}

/// The last line of `--json`: which run it was, why it ended, and how good it is, if that was measured.
fn last_line(run: &Run, stopped: Stopped, eval: Value, printer: &Printer) -> Outcome {
    printer.json_line(&json!({ "run": run.dir(), "stopped": stopped, "eval": eval }))
}

/// How a run is evaluated at its end.
fn options(run: &Run) -> Options {
    Options {
        perturbations: runs::perturbations(run, false),
        ..Options::default()
    }
}

/// How long [`finish`] takes, by what an `iteration` took: learning takes as many steps and an update, so an evaluation is
/// faster. Its agent acts without noise and may last longer than in training; twice as long is reckoned with.
pub fn duration(session: &Session, iteration: &Iteration) -> Duration {
    let options = options(session.run());
    let again = if options.perturbations.is_some() {
        2
    } else {
        1
    };
    // One episode more starts from rest.
    let episodes = (again * options.episodes + 1) as f64;
    let task = session.trainer().task();
    let lasts = iteration
        .metrics
        .episode_length
        .map_or(f64::INFINITY, |s| 2.0 * s);
    let whole = task
        .cases()
        .iter()
        .map(|case| case.duration_s.unwrap_or(options.seconds));
    let seconds: f64 = whole.map(|seconds| seconds.min(lasts)).sum();
    let steps = episodes * seconds * task.control_hz();
    Duration::try_from_secs_f64(steps / iteration.samples_per_second).unwrap_or(Duration::MAX)
}

/// What to do about a run that isn't learned, or not to its end.
fn advice(session: &Session, stopped: Stopped, results: &[CaseEvaluation]) -> Option<String> {
    let folder = plain(&session.run().dir().display().to_string());
    let mimic = program();
    let (samples, planned) = (
        session.trainer().samples(),
        session.trainer().settings().samples,
    );
    let learned = results.iter().all(|one| one.evaluation.verdict.learned);
    match stopped {
        Stopped::Samples if learned => None,
        Stopped::Samples => Some(format!(
            "train a new run with more samples, by the same command with `--samples {}`",
            amount::count(planned.saturating_mul(2).max(Plan::default().samples))
        )),
        Stopped::Minutes | Stopped::Interrupt => {
            let from = match session.can_be_saved() {
                true => String::new(),
                false => format!(
                    ", which repeats the round that was cut short, from {} samples on",
                    amount::count(saved(session))
                ),
            };
            Some(format!(
                "stopped by `--minutes` after {} of {} samples, go on with `{mimic} train --resume {folder}`{from}",
                amount::count(samples),
                amount::count(planned),
            ))
        }
    }
}

/// The samples of the last checkpoint: a run goes on from where it was saved, which is between rounds.
fn saved(session: &Session) -> u64 {
    let settings = session.trainer().settings();
    let each = (settings.environments * settings.horizon) as u64;
    let iteration = session.trainer().iteration();
    (iteration - iteration % settings.round.max(1)) * each
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
    finish(session, Stopped::Samples, printer)
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
    let shown = |path: &Path| plain(&path.display().to_string());
    let (folder, recording, mimic) = (shown(folder), shown(recording), program());
    let mut text = format!(
        "recording: {recording}\n  watch it          rerun {recording}\n  or from the run   {mimic} replay {folder} --rerun\n"
    );
    if Viewer::find().is_none() {
        text += &format!("  rerun is not installed yet: {}\n", viewer::install());
    }
    text
}
