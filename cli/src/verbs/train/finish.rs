//! The end of training: evaluation, recording, and how to watch the result.

use super::resume::{again, program, unwritten};
use crate::amount;
use crate::failure::{Failure, Outcome};
use crate::printer::Printer;
use crate::recording;
use crate::runs;
use crate::shell;
use crate::verbs::eval;
use crate::viewer::{self, Viewer};
use mimic::evaluate::{Options, SteeringOptions};
use mimic::explain::plain;
use mimic::run::{CaseEvaluation, Iteration, PRESETS, Plan, Run, Session, files};
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
    if runs::is_steered(run) {
        return finish_steering(session, stopped, printer);
    }
    let options = options(run);
    let results = runs::evaluate(run, &options, printer)?;
    run.keep_evaluation(&results)?;
    let recorded = record(run, printer)?;
    if printer.is_json() {
        return last_line(run.dir(), stopped, CaseEvaluation::json(&results), printer);
    }
    let folder = plain(&run.dir().display().to_string());
    let look = match recorded {
        Some(file) => how_to_look(run.dir(), &file),
        None => String::new(),
    };
    let more = [surplus(session), advice(session, stopped, &results)];
    let more: Vec<String> = more.into_iter().flatten().collect();
    let advice = Some(more.join("; ")).filter(|advice| !advice.is_empty());
    let table = eval::text(&results, advice.as_deref());
    printer.text(&format!("{folder}\n{table}{look}"))
}

/// The same of a run that is steered.
fn finish_steering(session: &Session, stopped: Stopped, printer: &Printer) -> Outcome {
    let run = session.run();
    let found = runs::evaluate_steering(run, &SteeringOptions::default(), printer)?;
    run.keep_steering(&found)?;
    let recorded = record(run, printer)?;
    if printer.is_json() {
        return last_line(run.dir(), stopped, json!(found), printer);
    }
    let folder = plain(&run.dir().display().to_string());
    let look = recorded.map_or_else(String::new, |file| how_to_look(run.dir(), &file));
    printer.text(&format!(
        "{folder}\n{}{look}",
        eval::steering::table(&found)
    ))
}

/// Ends a session that was interrupted, and that nothing more is to be said of.
pub fn interrupted(run: &Path, printer: &Printer) -> Outcome {
    match printer.is_json() {
        true => last_line(run, Stopped::Interrupt, Value::Null, printer),
        false => Ok(()),
    }
}

/// The last line of `--json`: which run it was, why it ended, and how good it is, if that was measured.
fn last_line(run: &Path, stopped: Stopped, eval: Value, printer: &Printer) -> Outcome {
    printer.json_line(&json!({ "run": run, "stopped": stopped, "eval": eval }))
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
    let planned = session.trainer().settings().samples;
    let learned = results.iter().all(|one| one.evaluation.verdict.learned);
    match stopped {
        Stopped::Samples if learned => None,
        Stopped::Samples => Some(format!(
            "train a new run with more samples, by the same command with `--samples {}`",
            amount::count(
                planned
                    .saturating_mul(2)
                    .max(usual_samples(session.run().plan()))
            )
        )),
        Stopped::Minutes | Stopped::Interrupt => {
            let (saved, planned) = (amount::count(saved(session)), amount::count(planned));
            let again = again(session.run());
            Some(match session.can_be_saved() {
                true => format!(
                    "stopped by `--minutes` after {saved} of {planned} samples; go on with `{again}`"
                ),
                false => format!(
                    "stopped by `--minutes` between two checkpoints; `{again}` goes on from the last one, at {saved} of {planned} samples, and repeats what came after it"
                ),
            })
        }
    }
}

/// How many samples the preset has that a plan was most likely made of: the one with the same network and task, for single
/// settings may have been changed.
fn usual_samples(plan: &Plan) -> u64 {
    let alike = |of: &Plan| {
        let same = [
            of.ppo == plan.ppo,
            of.hidden == plan.hidden,
            of.final_std == plan.final_std,
            of.environments == plan.environments,
            of.horizon == plan.horizon,
        ];
        let task = 2 * usize::from(of.task == plan.task);
        task + same.into_iter().filter(|same| *same).count()
    };
    // Ours comes first, and is taken before others that are as much alike.
    let plans = PRESETS.iter().rev().map(|preset| (preset.plan)());
    let nearest = plans.max_by_key(alike);
    nearest.map_or(0, |plan| plan.samples)
}

/// That a run learned from clearly more samples than it was told to, and why.
fn surplus(session: &Session) -> Option<String> {
    let (samples, settings) = (session.trainer().samples(), session.trainer().settings());
    let each = (settings.environments * settings.horizon) as u64;
    // A tenth more is nothing that anybody asks about.
    (samples > settings.samples + settings.samples / 10).then(|| {
        format!(
            "it learned from {} samples, not {}, because samples come in iterations of {}",
            amount::count(samples),
            amount::count(settings.samples),
            amount::count(each)
        )
    })
}

/// The samples of the last checkpoint: a run goes on from where it was saved, which is between rounds.
fn saved(session: &Session) -> u64 {
    if session.can_be_saved() {
        return session.trainer().samples();
    }
    let settings = session.trainer().settings();
    let each = (settings.environments * settings.horizon) as u64;
    let iteration = session.trainer().iteration();
    (iteration - iteration % settings.round.max(1)) * each
}

/// For a run that has used up its samples: does what a session that was killed left out, and makes a policy that was lost or
/// damaged again from the checkpoint.
pub fn make_up(session: &Session, printer: &Printer) -> Outcome {
    let run = session.run();
    let folder = shell::path(run.dir());
    let is_there = |name: &str| run.dir().join(name).exists();
    let recorded = !recording::AVAILABLE || is_there(files::RECORDING);
    let evaluated = matches!(Run::scores(run.dir()), Ok(Some(_)));
    if evaluated && recorded && session.has_policy() {
        let (samples, mimic) = (session.trainer().samples(), program());
        return Err(Failure::user(format!(
            "the run `{}` is finished: it has learned from all its {samples} samples", run.dir().display()
        ))
        .with_remedy(format!(
            "evaluate it with `{mimic} eval {folder}`, or watch it with `{mimic} replay {folder} --rerun`"
        )));
    }
    printer.note(format!(
        "the run `{}` has used up its samples; only some of its results are missing",
        run.dir().display()
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
            run.check_place()?;
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
    let shown = plain(&recording.display().to_string());
    let (folder, recording, mimic) = (shell::path(folder), shell::path(recording), program());
    let (folder, recording) = (plain(&folder), plain(&recording));
    let mut text = format!(
        "recording: {shown}\n  watch it          rerun {recording}\n  or from the run   {mimic} replay {folder} --rerun\n"
    );
    if !Viewer::is_installed() {
        text += &format!("  rerun is not installed yet: {}\n", viewer::install());
    }
    text
}
