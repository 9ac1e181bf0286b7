//! `mimic train`: a policy learns to perform a motion under physics.

mod finish;
mod preset;
mod progress;
mod setting;
mod stop;

use crate::args::{ImportArgs, RetargetArgs, at_least_one};
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::prepare::{Preparation, Prepared};
use crate::printer::Printer;
use crate::runs;
use clap::builder::{PossibleValue, PossibleValuesParser};
use mimic::run::{Run, RunError, Session, files};
use mimic::task::{TASKS, TaskError};
use preset::Preset;
use progress::Progress;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use stop::Stop;

const EXAMPLES: &str = "\
Examples:
  mimic train kick.fbx                              imports, retargets, and learns it: runs/kick
  mimic train kick.motion --minutes 10 --seed 7 --out runs/kick-seed7
  mimic train walk.motion run.motion                one policy for both
  mimic train --resume kick                         goes on where it stopped, to the same bits
  mimic train kick.fbx --json > curve.jsonl         a line per iteration
  mimic train kick.fbx --preset booth2020 --samples 20M
  mimic train kick.fbx --set task.terminations.distance=0.4 --set ppo.gamma=0.97

Presets (docs/presets.md has every value):
  default     ours: rotations added to the reference's, learned in minutes
  deepmimic   the reward and rates of the program of Peng et al. 2018, learned as in ours
  deepmimic2018
              their paper, with its learner too: absolute targets, a large network; for 60M samples
  booth2020   Booth & Ivanov 2020, on the character `marathon`: 258 observations, 21 targets, angular momentum, starts
              at the first frame alone, ends at a reward threshold; for 128M samples
`--set` changes any single value of them, by its path in the run's config.json under `plan`.

The run folder holds config.json, metrics.jsonl, checkpoint and policy, at the end also eval.json and replay.rrd.
A finished run is never overwritten: the next run of the same clip is runs/kick-2. Ctrl-C ends the round that is
under way, saves, and stops; a second Ctrl-C stops at once, at the last checkpoint.";

/// Two years: longer than anybody trains, and within what clocks can count.
const MOST_MINUTES: f64 = 1e6;

/// Train a policy that performs a motion under physics
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Motions, clips or animation files [default: the newest motion]
    #[arg(value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// What is learned
    #[arg(long, value_name = "TASK", value_parser = tasks(), default_value = TASKS[0].0)]
    task: String,
    /// Settings to start from: `default`, `deepmimic`, `deepmimic2018`, `booth2020`, those of a run, or a JSON file with a plan as in a
    /// run's config.json
    #[arg(long, value_name = "NAME|FILE|RUN", default_value = "default")]
    preset: String,
    /// Change one value of the preset, e.g. `task.terminations.distance=0.4`; can be given several times
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<String>,
    /// Disturb training by shoves, more or less weight and friction, as the preset does or else usually (docs/presets.md);
    /// `task.perturbations` has their ranges
    #[arg(long)]
    perturb: bool,
    /// Samples to learn from, e.g. 5M or 800k [default: as the preset says]
    #[arg(long, value_name = "N", value_parser = count)]
    samples: Option<u64>,
    /// Stop after this many minutes, if the samples last longer
    #[arg(long, value_name = "MIN", value_parser = minutes)]
    minutes: Option<f64>,
    /// Seed of all random numbers; the same seed gives the same bits [default: as the preset says]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Threads [default: all]; the result is the same at any number
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    threads: Option<usize>,
    /// Go on with a run that was stopped
    #[arg(
        long,
        value_name = "RUN",
        conflicts_with_all = ["inputs", "out", "samples", "seed", "preset", "set", "perturb", "task", "ImportArgs", "RetargetArgs"]
    )]
    resume: Option<PathBuf>,
    /// Folder of the run [default: runs/CLIP, numbered when that exists]
    #[arg(long, short, value_name = "RUN")]
    out: Option<PathBuf>,
    #[command(flatten)]
    import: ImportArgs,
    #[command(flatten)]
    retarget: RetargetArgs,
}

/// Names of the tasks, with what they are.
fn tasks() -> PossibleValuesParser {
    let value = |(name, about): (&'static str, &'static str)| PossibleValue::new(name).help(about);
    PossibleValuesParser::new(TASKS.map(value))
}

/// How a training session came to its end.
enum End {
    Done,
    OutOfTime,
    Interrupted,
}

impl Args {
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        let threads = runs::use_threads(self.threads)?;
        let run = match &self.resume {
            Some(run) => runs::open(Some(run))?,
            None => self.create(library, printer)?,
        };
        let config = run.dir().join(files::CONFIG);
        let session = Session::open(run);
        let mut session = session.map_err(|e| preset::failure(Some(&config), e))?;
        if session.is_done() {
            return finish::make_up(&session, printer);
        }
        printer.note(format!(
            "training `{}` on {threads} threads; Ctrl-C saves and stops",
            session.run().dir().display()
        ));
        let minutes = self
            .minutes
            .map(|minutes| Duration::from_secs_f64(60.0 * minutes));
        match train(&mut session, minutes, printer)? {
            End::Interrupted => {
                printer.say(farewell(session.run()));
                Ok(())
            }
            End::OutOfTime | End::Done => finish::finish(&session, printer),
        }
    }

    /// Everything a run is made of is read and checked before its folder appears.
    fn create(&self, library: &Path, printer: &Printer) -> Outcome<Run> {
        let preset = self.preset()?;
        let task = preset.plan.task.name();
        if self.task != task {
            return Err(Failure::user(format!(
                "`--task {}` doesn't fit the preset, which is for the task `{task}`",
                self.task
            ))
            .with_remedy("choose another preset"));
        }
        let preparations = self.preparations(library, preset.skeleton)?;
        let folder = self.folder(&preparations, printer)?;
        let mut motions = Vec::new();
        let mut skeleton = None;
        for preparation in &preparations {
            let Prepared {
                motion,
                skeleton: own,
                ..
            } = preparation.run(printer)?;
            let skeleton = skeleton.get_or_insert(own);
            motion
                .check_skeleton(skeleton)
                .map_err(|e| Failure::in_file(&preparation.file, e))?;
            let frames = motion.qpos.len();
            if frames < 2 {
                let short = TaskError::TooShort { frames };
                return Err(Failure::in_file(&preparation.file, short));
            }
            motions.push(motion);
        }
        let skeleton = skeleton.ok_or_else(|| Failure::user("no motion to learn"))?;
        Run::create(folder, preset.plan.clone(), skeleton, motions).map_err(|e| preset.failure(e))
    }

    /// A finished motion has its character; a clip takes the preset's, unless another is asked for.
    fn preparations(&self, library: &Path, skeleton: Option<&str>) -> Outcome<Vec<Preparation>> {
        let find = |wanted: Option<&Path>| {
            locate::file_or_newest(wanted, library, &locate::ANIMATIONS, "motion")
        };
        let files: Vec<PathBuf> = if self.inputs.is_empty() {
            vec![find(None)?]
        } else {
            self.inputs
                .iter()
                .map(|input| find(Some(input)))
                .collect::<Outcome<_>>()?
        };
        let prepare = |file: PathBuf| {
            let mut retarget = self.retarget.clone();
            if !locate::has_extension(&file, "motion") {
                retarget.skeleton = retarget.skeleton.or(skeleton.map(str::to_owned));
            }
            Preparation::new(file, &self.import, &retarget).for_performance(true)
        };
        Ok(files.into_iter().map(prepare).collect())
    }

    fn folder(&self, preparations: &[Preparation], printer: &Printer) -> Outcome<PathBuf> {
        if let Some(out) = &self.out {
            if locate::is_run(out) {
                return Err(
                    Failure::input(out, "already holds a run").with_remedy(format!(
                        "choose another folder with `--out`, or resume that run with `--resume {}`",
                        out.display()
                    )),
                );
            }
            return Ok(out.clone());
        }
        let names: Vec<String> = preparations.iter().map(Preparation::name).collect();
        let name = match names.as_slice() {
            [first, _, _, ..] => format!("{first}-and-{}-more", names.len() - 1),
            few => few.join("-and-"),
        };
        let name = crate::output::safe_name(&name);
        let folder = runs::free_folder(&name);
        if folder
            .file_name()
            .is_some_and(|taken| taken != name.as_str())
        {
            printer.note(format!(
                "a run `{name}` is there already, this one becomes `{}`",
                folder.display()
            ));
        }
        Ok(folder)
    }

    fn preset(&self) -> Outcome<Preset> {
        let mut preset = Preset::load(&self.preset)?;
        if self.perturb {
            let perturbations = preset.plan.task.perturbations_mut();
            *perturbations = perturbations.or_usual();
        }
        preset.change(&self.set)?;
        let plan = &mut preset.plan;
        if plan.samples == 0 {
            return Err(Failure::user("samples is 0").with_remedy("set it to 1 or more"));
        }
        plan.samples = self.samples.unwrap_or(plan.samples);
        plan.seed = self.seed.unwrap_or(plan.seed);
        Ok(preset)
    }
}

/// What was typed to run us; from a fresh clone that isn't `mimic`.
fn program() -> String {
    let program = std::env::args_os().next();
    program.map_or_else(
        || "mimic".into(),
        |program| program.to_string_lossy().into_owned(),
    )
}

/// The last word of a run that somebody stopped.
fn farewell(run: &Run) -> String {
    format!(
        "stopped; go on with `{} train --resume {}`",
        program(),
        run.dir().display()
    )
}

/// A run that can't be written any more, because the disk is full for one: what was saved last is whole.
fn unwritten(run: &Run, error: RunError) -> Failure {
    let resume = format!(
        "check its permissions and the free space there, then go on with `{} train --resume {}`",
        program(),
        run.dir().display()
    );
    match error.is_write() {
        true => Failure::from(error).with_remedy(resume),
        false => Failure::from(error),
    }
}

/// Learns until the samples or the time are used up, or somebody wants to stop. Checkpoints stand between rounds,
/// where a run resumes to the same bits.
fn train(session: &mut Session, time: Option<Duration>, printer: &Printer) -> Outcome<End> {
    let begun = Instant::now();
    let progress = Progress::new(session, printer);
    let stop = Stop::on_ctrl_c({
        let (bar, printer, text) = (progress.bar(), *printer, farewell(session.run()));
        move || {
            bar.finish_and_clear();
            printer.say(&text);
        }
    })?;
    let end = loop {
        let iteration = session.iterate();
        let iteration = iteration.map_err(|e| unwritten(session.run(), e))?;
        progress.show(&iteration, printer)?;
        if stop.is_wanted() {
            progress.say("ending this round");
        }
        if !session.can_be_saved() {
            continue;
        }
        session.save().map_err(|e| unwritten(session.run(), e))?;
        if stop.is_wanted() {
            break End::Interrupted;
        }
        if session.is_done() {
            break End::Done;
        }
        if time.is_some_and(|time| begun.elapsed() >= time) {
            break End::OutOfTime;
        }
    };
    Ok(if stop.release() {
        End::Interrupted
    } else {
        end
    })
}

fn minutes(text: &str) -> Result<f64, String> {
    runs::at_most(text, MOST_MINUTES, "minutes")
}

/// A whole number, with k for thousands and M for millions.
fn count(text: &str) -> Result<u64, String> {
    let (number, unit) = match text.trim_end_matches(['k', 'K', 'm', 'M']) {
        number if number.len() + 1 < text.len() => {
            return Err(format!("`{text}` is no number of samples"));
        }
        number => (number, &text[number.len()..]),
    };
    let factor = match unit {
        "" => 1.0,
        "k" | "K" => 1e3,
        _ => 1e6,
    };
    let value: f64 = number
        .parse()
        .map_err(|_| "give a number, e.g. 5M or 800k".to_string())?;
    let value = value * factor;
    if (1.0..=1e15).contains(&value) {
        Ok(value as u64)
    } else {
        Err("at least 1 is needed".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_have_units() {
        assert_eq!(count("4096"), Ok(4096));
        assert_eq!(count("800k"), Ok(800_000));
        assert_eq!(count("2.5M"), Ok(2_500_000));
        assert_eq!(count("1e6"), Ok(1_000_000));
        assert!(
            count("0").is_err()
                && count("-5").is_err()
                && count("5kM").is_err()
                && count("M").is_err()
        );
    }
}
