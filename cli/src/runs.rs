//! Training runs as the verbs use them.

use crate::args::positive;
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::printer::Printer;
use crate::recording::Recording;
use mimic::clip::LoopMode;
use mimic::evaluate::{self, Evaluation, Opening, Options, Trace};
use mimic::learn::{LearnError, Performer, Run, RunError, TrainError};
use mimic::motion::MotionError;
use mimic::task::Perturbations;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What a run keeps of its evaluation with the default options.
pub const EVALUATION: &str = "eval.json";

/// What a run writes while it learns, a line per iteration.
pub const METRICS: &str = "metrics.jsonl";

/// How well a run performs one of its motions.
#[derive(Serialize)]
pub struct Measured {
    pub motion: String,
    /// Length of an episode from the first frame.
    seconds: f64,
    #[serde(flatten)]
    pub evaluation: Evaluation,
}

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

/// Evaluates every motion of a run.
pub fn evaluate(run: &Run, options: &Options, printer: &Printer) -> Outcome<Vec<Measured>> {
    let performer = run.performer().map_err(failure)?;
    let mut results = Vec::new();
    for (which, motion) in run.motions().iter().enumerate() {
        printer.note(format!(
            "evaluating `{}` from {} phases",
            motion.name, options.episodes
        ));
        results.push(Measured {
            motion: motion.name.clone(),
            seconds: match motion.loop_mode {
                LoopMode::Wrap => options.seconds,
                LoopMode::Clamp => motion.duration(),
            },
            evaluation: evaluate::evaluate(&performer, which, options).map_err(learn_failure)?,
        });
    }
    Ok(results)
}

/// One motion gives its fields, several give a list.
pub fn evaluation_json(results: &[Measured]) -> Value {
    match results {
        [one] => json!(one),
        many => json!({ "motions": many }),
    }
}

/// An evaluation as a file.
pub fn evaluation_text(results: &[Measured]) -> String {
    format!("{:#}\n", evaluation_json(results))
}

/// Keeps an evaluation with the default options as that of the run.
pub fn keep(run: &Run, results: &[Measured]) -> Outcome {
    run.write(EVALUATION, &evaluation_text(results))
        .map_err(failure)
}

/// What disturbs a run's agent when it is measured: what disturbed its training, or else, if it is `asked` for, what usually
/// does. The reference follows, however the agent was trained, so that all are measured alike.
pub fn perturbations(run: &Run, asked: bool) -> Option<Perturbations> {
    let trained = run.plan().task.perturbations;
    (asked || trained.is_on()).then(|| Perturbations {
        follow: true,
        ..trained.or_usual()
    })
}

/// The agent's performance of reference number `which`.
pub fn record(run: &Run, which: usize, opening: Opening, seconds: f64) -> Outcome<Recording> {
    let performer: Performer = run.performer().map_err(failure)?;
    let motion = run.motions().get(which).ok_or_else(|| {
        let count = run.motions().len();
        let motions = if count == 1 { "motion" } else { "motions" };
        Failure::user(format!(
            "`{}` learned {count} {motions}, there is no number {}",
            run.dir().display(),
            which + 1
        ))
    })?;
    let traces = evaluate::play(&performer, which, &[opening], seconds);
    let traces = traces.map_err(learn_failure)?;
    shown(run, &motion.name, which, &performer, &traces[0])
}

fn shown(
    run: &Run,
    name: &str,
    which: usize,
    performer: &Performer,
    trace: &Trace,
) -> Outcome<Recording> {
    if trace.frames.is_empty() {
        return Err(Failure::work(
            "the agent fails in its first step, there is nothing to show; train it longer",
        ));
    }
    let motion = &run.motions()[which];
    Ok(Recording::of_trace(name, trace, motion, performer.stage()))
}

/// The agent's performance of several of its motions, one after the other, each for `seconds` or to its end.
pub fn record_sequence(
    run: &Run,
    names: &[String],
    seconds: f64,
    printer: &Printer,
) -> Outcome<Recording> {
    let which: Vec<usize> = names
        .iter()
        .map(|name| number_of(run, name.trim()))
        .collect::<Outcome<_>>()?;
    let performer: Performer = run.performer().map_err(failure)?;
    let (trace, begun) =
        evaluate::play_sequence(&performer, &which, seconds).map_err(learn_failure)?;
    if trace.failure.is_some() {
        let advice = match (begun, run.plan().task.transitions_s) {
            (2.., None) => {
                "; going over has to be learned: `mimic train … --set 'task.transitions_s=[2,4]'`"
            }
            _ => "",
        };
        printer.warn(format!(
            "the agent fails in `{}`, number {begun} of the sequence{advice}",
            names[begun - 1]
        ));
    }
    shown(run, &names.join("-"), which[0], &performer, &trace)
}

/// The motion of a run that a name means: its whole name, or a part of it, that no other has.
fn number_of(run: &Run, name: &str) -> Outcome<usize> {
    let motions = run.motions();
    let exact = motions.iter().any(|m| m.name == name);
    let means = |i: &usize| match exact {
        true => motions[*i].name == name,
        false => !name.is_empty() && motions[*i].name.contains(name),
    };
    let mut with = (0..motions.len()).filter(means);
    match (with.next(), with.next()) {
        (Some(only), None) => Ok(only),
        (found, _) => {
            let known: Vec<&str> = motions.iter().map(|m| m.name.as_str()).collect();
            let what = match found {
                Some(_) => "several motions for",
                None => "no motion",
            };
            Err(Failure::user(format!(
                "`{}` learned {what} `{name}`; its motions are {}",
                run.dir().display(),
                known.join(", ")
            )))
        }
    }
}

/// Whose fault a failed run is: a file that can't be written is the work's, one that can't be read the user's.
pub fn failure(error: RunError) -> Failure {
    match error {
        RunError::Learn(error) | RunError::Train(TrainError::Learn(error)) => learn_failure(error),
        RunError::Io { action: "read", .. } => Failure::user(error),
        RunError::Io { .. } => Failure::work(error),
        RunError::File(error) | RunError::Motion(MotionError::File(error)) => error.into(),
        error => Failure::user(error),
    }
}

/// A wrong setting is the user's; numbers that ran away are the work's.
pub fn learn_failure(error: LearnError) -> Failure {
    match error {
        LearnError::Observation { .. }
        | LearnError::NotFinite { .. }
        | LearnError::Diverged { .. } => Failure::work(error),
        error => Failure::user(error),
    }
}

/// A positive number of `unit`, up to `most`: clocks and memory end somewhere.
pub fn at_most(text: &str, most: f64, unit: &str) -> Result<f64, String> {
    match positive(text)? {
        number if number <= most => Ok(number),
        _ => Err(format!("at most {most} {unit} are possible")),
    }
}

/// Uses this many threads for everything from now on; the results are the same at any number.
pub fn use_threads(threads: Option<usize>) -> Outcome<usize> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0));
    pool.build_global()
        .map_err(|e| Failure::work(format!("cannot start threads: {e}")))?;
    Ok(rayon::current_num_threads())
}

#[cfg(test)]
mod tests {
    use super::*;
    use mimic::file::{FileError, Flaw, Format};

    #[test]
    fn what_cannot_be_written_or_ran_away_is_failed_work() {
        let denied = || std::io::ErrorKind::PermissionDenied.into();
        let file = |flaw| FileError {
            path: "run/policy.safetensors".into(),
            format: Format {
                name: "policy",
                version: 1,
                remedy: "train it again",
            },
            flaw,
        };
        let (write, read) = (|| file(Flaw::Write(denied())), file(Flaw::Read(denied())));
        assert_eq!(failure(write().into()).code(), 1);
        assert_eq!(failure(read.into()).code(), 2);
        assert_eq!(failure(MotionError::from(write()).into()).code(), 1);
        let wild = LearnError::NotFinite {
            what: "rewards",
            sample: 3,
        };
        assert_eq!(failure(TrainError::Learn(wild).into()).code(), 1);
        let setting = LearnError::Setting {
            name: "gamma",
            value: "3".into(),
            range: "0..=1",
        };
        assert_eq!(learn_failure(setting).code(), 2);
    }

    #[test]
    fn numbers_have_an_upper_bound() {
        assert_eq!(at_most("1e6", 1e6, "minutes"), Ok(1e6));
        for wrong in ["1e20", "inf", "nan", "0", "-1", "long"] {
            assert!(at_most(wrong, 1e6, "minutes").is_err(), "{wrong}");
        }
    }
}
