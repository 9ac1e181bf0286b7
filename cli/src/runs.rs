//! Training runs: opening, evaluating and recording them, for the verbs that do.

use crate::args::{MOST_THREADS, positive};
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::printer::Printer;
use crate::progress;
use crate::recording::Recording;
use mimic::evaluate::{
    Agent, EvaluateError, Options, SteeringEvaluation, SteeringOptions, perform, perform_sequence,
};
use mimic::run::{CaseEvaluation, Claim, Controller, Run, files};
use mimic::task::{Episode, EpisodeStart, Perturbations, TaskSettings};
use std::path::Path;

/// Opens the run that `wanted` means. Left out, the newest run.
pub fn open(wanted: Option<&Path>) -> Outcome<Run> {
    let folder = locate::run(wanted)?;
    Ok(Run::open(folder)?)
}

/// Claims a folder for a new run, named after what it learns: the first of NAME, NAME-2, … that is free.
pub fn claim(name: &str) -> Outcome<Claim> {
    let runs = Path::new(locate::RUNS);
    let mut number = 1_u64;
    loop {
        let folder = match number {
            1 => runs.join(name),
            _ => runs.join(format!("{name}-{number}")),
        };
        match Claim::on(&folder) {
            Err(error) if error.is_taken(&folder) => number += 1,
            claim => return Ok(claim?),
        }
    }
}

/// Whether a run is steered by a player.
pub fn is_steered(run: &Run) -> bool {
    matches!(run.plan().task, TaskSettings::Steer(_))
}

/// Evaluates how a run is steered.
pub fn evaluate_steering(
    run: &Run,
    options: &SteeringOptions,
    printer: &Printer,
) -> Outcome<SteeringEvaluation> {
    let what = format!("evaluating {}", run.dir().display());
    let found = progress::during(printer, &what, |_| run.evaluate_steering(options));
    Ok(found?)
}

/// Evaluates every motion of a run.
pub fn evaluate(run: &Run, options: &Options, printer: &Printer) -> Outcome<Vec<CaseEvaluation>> {
    let names: Vec<String> = run
        .motions()
        .iter()
        .map(|m| format!("`{}`", m.name))
        .collect();
    printer.note(format!(
        "evaluating {} in `{}` from {} phases",
        names.join(", "),
        run.dir().display(),
        options.episodes
    ));
    let what = format!("evaluating {}", names.join(", "));
    let results = progress::during(printer, &what, |_| run.evaluate(options));
    Ok(results?)
}

/// The disturbances under which a run is evaluated: those of its training, or if it had none but they are `asked` for, the
/// usual ones. The reference follows the agent whether or not it did so in training, so that all runs are measured alike.
pub fn perturbations(run: &Run, asked: bool) -> Option<Perturbations> {
    let trained = *run.plan().task.perturbations();
    (asked || trained.is_on()).then(|| Perturbations {
        follow: true,
        ..trained.or_usual()
    })
}

/// Records the agent's episode from this start, `seconds` long.
pub fn record(run: &Run, start: EpisodeStart, seconds: f64) -> Outcome<Recording> {
    let controller = run.controller()?;
    let count = run.motions().len();
    let Some(motion) = run.motions().get(start.case) else {
        let motions = if count == 1 { "motion" } else { "motions" };
        let number = start.case + 1;
        let cause = format!("this run learned {count} {motions}, so there is no number {number}");
        let remedy = match count {
            1 => "leave `--motion` out".to_owned(),
            count => format!("choose a number from 1 to {count} with `--motion`"),
        };
        return Err(Failure::input(run.dir(), cause).with_remedy(remedy));
    };
    let episodes = perform(&controller, &[start], seconds).map_err(|e| blame(run, e))?;
    shown(&motion.name, &controller, &episodes[0])
}

/// What the agent can't do is its policy's fault; what was asked for isn't.
fn blame(run: &Run, error: EvaluateError) -> Failure {
    match error {
        EvaluateError::Learn(_) => Failure::in_file(&run.dir().join(files::POLICY), error),
        _ => error.into(),
    }
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

/// Records the agent while it performs several of its motions one after another. A looping motion lasts `seconds`, others
/// play to their end.
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
    let performed = perform_sequence(&controller, &numbers, seconds);
    let (episode, begun) = performed.map_err(|e| blame(run, e))?;
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

/// The number of the motion that a name means: its whole name, or a part that no other motion's name has.
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
                Some(_) => "several motions",
                None => "no motion",
            };
            let cause = format!("this run learned {what} whose name contains `{name}`");
            Err(Failure::input(run.dir(), cause)
                .with_remedy(format!("choose one of {}", known.join(", "))))
        }
    }
}

/// A positive number of `unit`, up to `most`, because clocks and memory are finite.
pub fn at_most(text: &str, most: f64, unit: &str) -> Result<f64, String> {
    match positive(text)? {
        number if number <= most => Ok(number),
        _ => Err(format!("must be at most {most} {unit}")),
    }
}

/// Uses this many threads for everything from now on. Results do not depend on it.
pub fn use_threads(threads: Option<usize>) -> Outcome<usize> {
    let threads = threads.unwrap_or_else(|| asked_threads().min(MOST_THREADS));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build_global()
        .map_err(|e| Failure::work(format!("cannot start threads: {e}")))?;
    Ok(rayon::current_num_threads())
}

/// Bounds the threads of commands that have no flag for them.
pub fn bound_threads() -> Outcome {
    match asked_threads() > MOST_THREADS {
        true => use_threads(None).map(|_| ()),
        false => Ok(()),
    }
}

/// Threads that the environment asks for; 0 for as many as there are cores. The variables are those of `rayon`.
fn asked_threads() -> usize {
    let variables = ["RAYON_NUM_THREADS", "RAYON_RS_NUM_CPUS"];
    let mut asked = variables.iter().filter_map(|name| std::env::var(name).ok());
    asked.find_map(|text| text.parse().ok()).unwrap_or(0)
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
