//! Training runs as the verbs use them.

use crate::args::positive;
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::printer::Printer;
use crate::recording::Recording;
use mimic::evaluate::{Agent, Options, perform, perform_sequence};
use mimic::run::{CaseEvaluation, Controller, Run};
use mimic::task::{Episode, EpisodeStart, Perturbations};
use std::path::{Path, PathBuf};

/// Opens the run that `wanted` means; left out, the newest.
pub fn open(wanted: Option<&Path>) -> Outcome<Run> {
    let folder = locate::run(wanted)?;
    Ok(Run::open(folder)?)
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
pub fn evaluate(run: &Run, options: &Options, printer: &Printer) -> Outcome<Vec<CaseEvaluation>> {
    let names: Vec<String> = run
        .motions()
        .iter()
        .map(|m| format!("`{}`", m.name))
        .collect();
    printer.note(format!(
        "evaluating {} from {} phases",
        names.join(", "),
        options.episodes
    ));
    Ok(run.evaluate(options)?)
}

/// What disturbs a run's agent when it is measured: what disturbed its training, or else, if it is `asked` for, what usually
/// does. The reference follows, however the agent was trained, so that all are measured alike.
pub fn perturbations(run: &Run, asked: bool) -> Option<Perturbations> {
    let trained = *run.plan().task.perturbations();
    (asked || trained.is_on()).then(|| Perturbations {
        follow: true,
        ..trained.or_usual()
    })
}

/// The agent's episode from this start.
pub fn record(run: &Run, start: EpisodeStart, seconds: f64) -> Outcome<Recording> {
    let controller = run.controller()?;
    let count = run.motions().len();
    let Some(motion) = run.motions().get(start.case) else {
        let motions = if count == 1 { "motion" } else { "motions" };
        return Err(Failure::user(format!(
            "`{}` learned {count} {motions}, there is no number {}",
            run.dir().display(),
            start.case + 1
        )));
    };
    let episodes = perform(&controller, &[start], seconds)?;
    shown(&motion.name, &controller, &episodes[0])
}

fn shown(name: &str, controller: &Controller, episode: &Episode) -> Outcome<Recording> {
    if episode.frames.is_empty() {
        return Err(Failure::work(
            "the agent fails in its first step, so there is nothing to show",
        )
        .with_remedy("train it longer"));
    }
    let task = controller.task().as_ref();
    Ok(Recording::of_episode(name, episode, task))
}

/// The agent's performance of several of its motions, one after the other, each for `seconds` or to its end.
pub fn record_sequence(
    run: &Run,
    names: &[String],
    seconds: f64,
    printer: &Printer,
) -> Outcome<Recording> {
    let numbers: Vec<usize> = names
        .iter()
        .map(|name| number_of(run, name.trim()))
        .collect::<Outcome<_>>()?;
    let controller = run.controller()?;
    let (episode, begun) = perform_sequence(&controller, &numbers, seconds)?;
    if episode.failure.is_some() {
        let advice = match (begun, run.plan().task.has_transitions()) {
            (2.., false) => {
                "; an agent has to learn to go from one motion into another: `mimic train … --set 'task.transitions_s=[2,4]'`"
            }
            _ => "",
        };
        printer.warn(format!(
            "the agent fails in `{}`, number {begun} of the sequence{advice}",
            names[begun - 1]
        ));
    }
    shown(&names.join("-"), &controller, &episode)
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

    #[test]
    fn numbers_have_an_upper_bound() {
        assert_eq!(at_most("1e6", 1e6, "minutes"), Ok(1e6));
        for wrong in ["1e20", "inf", "nan", "0", "-1", "long"] {
            assert!(at_most(wrong, 1e6, "minutes").is_err(), "{wrong}");
        }
    }
}
