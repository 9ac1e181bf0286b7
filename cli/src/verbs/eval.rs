//! `mimic eval`: measures how well an agent performs what it learned.

pub mod steering;

use crate::args::{Replace, at_least_one};
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::output::{self, Form, Maker, Output};
use crate::printer::Printer;
use crate::runs;
use crate::shell;
use crate::verbs::train::program;
use mimic::evaluate::{FailedEpisode, Options, SteeringOptions};
use mimic::explain::plain;
use mimic::run::{CaseEvaluation, Run, RunError};
use mimic::task::{Good, Measure, Unit};
use serde_json::json;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic eval                                 evaluate the newest run
  mimic eval kick --episodes 64 --out kick-64.json
  mimic eval kick --perturb                  disturb the agent by shoves, too
  mimic eval kick --json                     print the fields of eval.json

Episodes start at 32 phases of the motion, spread evenly over it: these are its start phases. \
The result is a table:
  survival           share of the time that the agent lasts before it falls or is lost
  success            share of the episodes in which it stays near the reference
  body error         mean distance of its bodies from those of the reference; with
                     the root subtracted, as if both stood in the same place
  contact F1         how well its ground contacts agree with the reference's; 1 is best
  foot skate         how fast its feet slide while they stand
  root turned        how far its trunk turns in the whole motion, e.g. 6.28 rad for a
                     somersault
  normalised return  reward, as a share of the most that can be had
  from rest          one more episode, which starts from standing still
  beyond reach       start phases from which the reference asks for more force
                     than the ground can give; a motion may be learned without
                     them
  missed             beside a value that is not good enough; with one such value, the
                     motion is not yet learned
A run that is steered (`--task steer`) is measured in episodes of a minute of random input instead, with pushes and \
without, and in starts and turns; the animated character that it follows stands beside it.

A dash stands for what has no value, such as the error of a momentum that is zero.

The run's own eval.json is written only with the default number of episodes and seconds, so that \
runs can be compared by it.";

/// Most phases that a line of the table lists.
const MOST_PHASES: usize = 7;

/// Shortest episode, seconds: whoever falls takes about as long.
const LEAST_SECONDS: f64 = 1.0;

/// Longest episode, seconds: every frame of every episode is held in memory until all are measured.
const MOST_SECONDS: f64 = 3600.0;

/// Measure how well an agent performs: survival, tracking errors, contacts, momentum
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Run folder, or its name in runs/ [default: the newest run]
    run: Option<PathBuf>,
    /// Number of episodes; they start at phases spread evenly over the motion
    #[arg(long, value_name = "N", default_value_t = Options::default().episodes, value_parser = at_least_one, allow_negative_numbers = true)]
    episodes: usize,
    /// Length of an episode in seconds, for looping motions; others play to their end [default: 20; 60 for a run that is steered]
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Repeat every episode with shoves and with changed weight and friction, as in the run's training or else the usual ones;
    /// the reference then follows the agent [default: for runs that were trained with disturbances]
    #[arg(long)]
    perturb: bool,
    /// Number of threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = crate::args::threads, allow_negative_numbers = true)]
    threads: Option<usize>,
    /// Write the result to FILE, as JSON [default: the run's eval.json, if episodes and seconds have their defaults]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replace: Replace,
}

fn seconds(text: &str) -> Result<f64, String> {
    match runs::at_most(text, MOST_SECONDS, "seconds")? {
        long if long >= LEAST_SECONDS => Ok(long),
        _ => Err(format!("must be at least {LEAST_SECONDS} s")),
    }
}

impl Args {
    /// Runs the command.
    pub fn run(self, printer: &Printer) -> Outcome {
        runs::use_threads(self.threads)?;
        let mut run = runs::open(self.run.as_deref())?;
        let options = Options {
            episodes: self.episodes,
            seconds: self.seconds.unwrap_or(Options::default().seconds),
            perturbations: runs::perturbations(&run, self.perturb),
        };
        let out = self
            .out
            .as_deref()
            .map(|out| place(out, &run, self.replace.force))
            .transpose()?;
        if runs::is_steered(&run) {
            return self.steering(run, out, printer);
        }
        // Held from before the policy is read: the evaluation that is kept has to be that of the policy beside it.
        let held = match out {
            None if is_usual(&options) => Some(run.hold()),
            _ => None,
        };
        let results = runs::evaluate(&run, &options, printer)?;
        let kept = match out {
            Some(out) => out.write_text(&CaseEvaluation::text(&results)),
            None => {
                keep(&run, held, &results, printer);
                Ok(())
            }
        };
        let report = CaseEvaluation::json(&results);
        let shown = || whole(&run, &results);
        match kept {
            Ok(()) => printer.result(&report, shown),
            Err(failure) => printer.partial_result(report, shown, failure),
        }
    }
}

impl Args {
    /// Evaluates a run that is steered.
    fn steering(&self, mut run: Run, out: Option<Output>, printer: &Printer) -> Outcome {
        if self.perturb {
            printer.note(
                "`--perturb` changes nothing: a run that is steered is always pushed as well",
            );
        }
        let usual = SteeringOptions::default();
        let options = SteeringOptions {
            episodes: self.episodes,
            seconds: self.seconds.unwrap_or(usual.seconds),
            ..usual
        };
        let held = match out {
            None if options == SteeringOptions::default() => Some(run.hold()),
            _ => None,
        };
        let found = runs::evaluate_steering(&run, &options, printer)?;
        let report = json!(found);
        match (out, held) {
            (Some(out), _) => out.write_text(&format!("{report:#}\n"))?,
            (None, Some(held)) => {
                if let Err(error) = held.and_then(|()| run.keep_steering(&found)) {
                    printer.warn(format!(
                        "the evaluation is not kept: {error}, or write it elsewhere with `--out FILE`"
                    ));
                }
            }
            (None, None) => printer.note(
                "the run's eval.json stays as it is, because the options differ from the default; `--out FILE` writes a file",
            ),
        }
        let folder = run.dir().display().to_string();
        let name = plain(&folder);
        printer.result(&report, || format!("{name}\n{}", steering::table(&found)))
    }
}

/// Which run it is, how well it does, and how to watch it, as at the end of a training.
fn whole(run: &Run, results: &[CaseEvaluation]) -> String {
    let (name, folder) = (run.dir().display().to_string(), shell::path(run.dir()));
    let watch = format!("watch it            {} replay {folder} --rerun", program());
    format!(
        "{}\n{}{}\n",
        plain(&name),
        text(results, None),
        plain(&watch)
    )
}

/// Where `--out` puts the result: never in place of a file that a run is made of, such as its own evaluation.
fn place(out: &Path, run: &Run, force: bool) -> Outcome<Output> {
    let path = output::result_path(Some(out), "eval", Form::Evaluation);
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok();
    let own = folder.is_some() && folder == run.dir().canonicalize().ok();
    let (inside, whose) = match own {
        true => (true, "the"),
        false => (folder.is_some_and(|folder| locate::is_run(&folder)), "a"),
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if inside && !name.starts_with("eval-") {
        let cause = format!("this belongs to {whose} run");
        return Err(Failure::input(&path, cause)
            .with_remedy("name a file elsewhere, or one such as `eval-long.json`"));
    }
    let maker = Maker::new("eval", [run.dir()]);
    let output = Output::new(path, Form::Evaluation, maker, "--out", force);
    output.check()?;
    Ok(output)
}

/// Whether these are the options by which runs are compared.
fn is_usual(options: &Options) -> bool {
    let usual = Options {
        perturbations: options.perturbations,
        ..Options::default()
    };
    *options == usual
}

/// Keeps an evaluation in the run, if that was meant to be `held` for it. A run that cannot be written, such as that of another
/// user, can still be evaluated.
fn keep(
    run: &Run,
    held: Option<Result<(), RunError>>,
    results: &[CaseEvaluation],
    printer: &Printer,
) {
    let Some(held) = held else {
        return printer.note(format!(
            "the eval.json of `{}` stays as it is, because the options differ from the default; `--out FILE` writes a file",
            run.dir().display()
        ));
    };
    if let Err(error) = held.and_then(|()| run.keep_evaluation(results)) {
        printer.warn(format!(
            "the evaluation is not kept: {error}, or write it elsewhere with `--out FILE`"
        ));
    }
}

/// The first few of the phases from which the agent fails.
fn failed(failures: &[FailedEpisode], how: &str) -> Option<Row> {
    let starts: Vec<f64> = failures.iter().map(|f| f.start).collect();
    phases(&format!("fails from phase{how}"), &starts)
}

/// The first few of these phases.
fn phases(name: &str, starts: &[f64]) -> Option<Row> {
    let first = starts.iter().take(MOST_PHASES);
    let mut phases: Vec<String> = first.map(|start| format!("{start:.2}")).collect();
    if starts.len() > MOST_PHASES {
        phases.push("…".to_owned());
    }
    (!phases.is_empty()).then(|| Row(name.to_owned(), phases.join(" "), String::new()))
}

/// What the evaluation comes to in a sentence, with `advice` if there is any, and a table per motion.
pub fn text(results: &[CaseEvaluation], advice: Option<&str>) -> String {
    let advice = advice.map_or_else(String::new, |advice| format!("; {advice}"));
    let tables: String = results.iter().map(table).collect();
    match results {
        [one] => format!("{}{advice}\n{tables}", one.evaluation.verdict.text),
        many => {
            let learned = many.iter().filter(|one| one.evaluation.verdict.learned);
            let (learned, all) = (learned.count(), many.len());
            format!("learned {learned} of {all} motions{advice}\n{tables}")
        }
    }
}

/// A line of the table: what was measured, its value, and which values are good.
struct Row(String, String, String);

fn table(result: &CaseEvaluation) -> String {
    let (name, found) = (&result.motion, &result.evaluation);
    let (name, episodes) = (plain(name), found.episodes);
    let noun = if episodes == 1 { "episode" } else { "episodes" };
    let heading = format!("{name}, {episodes} {noun}");
    let row = |m: &Measure| Row(m.label.to_owned(), value(m, m.value), good(m));
    let mut rows = vec![Row(heading, String::new(), "good".to_owned())];
    rows.extend(found.measures.iter().map(row));
    if !found.beyond_reach.is_empty() {
        let survival = found.survival_within_reach;
        let measure = Measure::new("", "survival, from starts within reach", survival);
        // Behind the heading and the survival from all starts.
        rows.insert(2, row(&measure.good(Good::High, Unit::Share)));
    }
    let rest = ("from rest", &found.from_rest);
    let disturbed = found.perturbed.iter().map(|p| ("disturbed", p));
    for (how, more) in std::iter::once(rest).chain(disturbed) {
        let shown = |m: &&Measure| ["survival", "mpjpe_local_mm"].contains(&m.name);
        let row = |m: &Measure| {
            let label = format!("{}, {how}", m.label);
            Row(label, value(m, m.value), String::new())
        };
        rows.extend(more.measures.iter().filter(shown).map(row));
    }
    let perturbed = found.perturbed.iter();
    let perturbed = perturbed.filter_map(|p| failed(&p.failures, ", disturbed"));
    rows.extend(failed(&found.failures, "").into_iter().chain(perturbed));
    rows.extend(phases("start phases beyond reach", &found.beyond_reach));
    let line = |(number, Row(name, value, good)): (usize, &Row)| {
        let indent = if number == 0 { "" } else { "  " };
        let width = 40 - indent.len();
        let line = format!("{indent}{name:width$} {value:>12}  {good}");
        line.trim_end().to_owned() + "\n"
    };
    rows.iter().enumerate().map(line).collect()
}

/// Which values of a measure are good, and whether it misses them.
fn good(measure: &Measure) -> String {
    let enough = measure.enough.map(|enough| value(measure, enough));
    let missed = if measure.is_enough() { "" } else { "  missed" };
    match (measure.good, enough) {
        (Good::High, Some(enough)) => format!("{enough} or more{missed}"),
        (Good::Low, Some(enough)) => format!("{enough} or less{missed}"),
        (Good::High, None) => "more is better".to_owned(),
        (Good::Low, None) => "less is better".to_owned(),
        (Good::Near(goal), _) => format!("near {}", value(measure, goal)),
        (Good::Neither, _) => String::new(),
    }
}

/// A value of a measure with its unit; a dash for one that isn't defined.
fn value(measure: &Measure, value: f64) -> String {
    match measure.unit {
        _ if value.is_nan() => "-".to_owned(),
        Unit::Share => format!("{:.1} %", 100.0 * value),
        Unit::Score => format!("{value:.3}"),
        Unit::Millimeters => format!("{value:.1} mm"),
        Unit::Meters => format!("{:.1} mm", 1e3 * value),
        Unit::MetersPerSecond => format!("{value:.3} m/s"),
        Unit::Radians => format!("{value:.2} rad"),
        Unit::Degrees => format!("{value:.1}°"),
        Unit::Seconds => format!("{value:.2} s"),
    }
}
