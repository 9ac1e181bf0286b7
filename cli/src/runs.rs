//! Training runs as the verbs use them.

use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::printer::Printer;
use crate::recording::Recording;
use mimic::evaluate::{self, Evaluation, Options};
use mimic::learn::{LearnError, Performer, Run, RunError, TrainError};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Opens the run that `wanted` means; left out, the newest.
pub fn open(wanted: Option<&Path>) -> Outcome<Run> {
    let folder = locate::run(wanted)?;
    Run::open(&folder).map_err(failure)
}

/// A folder for a new run, named after what it learns: the first of NAME, NAME-2, … that isn't taken.
pub fn free_folder(name: &str) -> PathBuf {
    let runs = Path::new(locate::RUNS);
    let numbered = (2..).map(|number| runs.join(format!("{name}-{number}")));
    let mut folders = std::iter::once(runs.join(name)).chain(numbered);
    folders
        .find(|folder| !folder.exists())
        .unwrap_or_else(|| runs.join(name))
}

/// Evaluates every motion of a run and keeps the result as its `eval.json`. One motion gives its fields, several
/// give a list.
pub fn evaluate(
    run: &Run,
    options: &Options,
    printer: &Printer,
) -> Outcome<Vec<(String, Evaluation)>> {
    let performer = run.performer().map_err(failure)?;
    let mut results = Vec::new();
    for (which, motion) in run.motions().iter().enumerate() {
        printer.note(format!(
            "evaluating `{}` from {} phases",
            motion.name, options.episodes
        ));
        let evaluation = evaluate::evaluate(&performer, which, options).map_err(learn_failure)?;
        results.push((motion.name.clone(), evaluation));
    }
    let text = serde_json::to_string_pretty(&evaluation_json(&results))
        .map_err(|e| Failure::work(format!("cannot write the evaluation as JSON: {e}")))?;
    run.write("eval.json", &(text + "\n")).map_err(failure)?;
    Ok(results)
}

pub fn evaluation_json(results: &[(String, Evaluation)]) -> Value {
    let object = |(name, evaluation): &(String, Evaluation)| {
        let mut object = json!(evaluation);
        object["motion"] = json!(name);
        object
    };
    match results {
        [one] => object(one),
        many => json!({ "motions": many.iter().map(object).collect::<Vec<_>>() }),
    }
}

/// The agent's performance of reference number `which` from its first frame.
pub fn record(run: &Run, which: usize, seconds: f64) -> Outcome<Recording> {
    let performer: Performer = run.performer().map_err(failure)?;
    let motion = run.motions().get(which).ok_or_else(|| {
        let count = run.motions().len();
        Failure::user(format!(
            "`{}` learned {count} motions, there is no number {}",
            run.dir().display(),
            which + 1
        ))
    })?;
    let trace = evaluate::play(&performer, which, 0.0, seconds).map_err(learn_failure)?;
    if trace.frames.is_empty() {
        return Err(Failure::work(
            "the agent fails in its first step, there is nothing to show; train it longer",
        ));
    }
    Ok(Recording::of_trace(
        &motion.name,
        &trace,
        motion,
        performer.stage(),
    ))
}

/// Whose fault a failed run is.
pub fn failure(error: RunError) -> Failure {
    match error {
        RunError::Io { .. } => Failure::work(error),
        RunError::Learn(error) | RunError::Train(TrainError::Learn(error)) => learn_failure(error),
        error => Failure::user(error),
    }
}

/// A wrong setting is the user's; numbers that ran away are the work's.
pub fn learn_failure(error: LearnError) -> Failure {
    match error {
        LearnError::Observation { .. } | LearnError::Diverged { .. } => Failure::work(error),
        error => Failure::user(error),
    }
}

/// Uses this many threads for everything from now on; the results are the same at any number.
pub fn use_threads(threads: Option<usize>) -> Outcome<usize> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0));
    pool.build_global()
        .map_err(|e| Failure::work(format!("cannot start threads: {e}")))?;
    Ok(rayon::current_num_threads())
}
