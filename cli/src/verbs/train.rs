//! `mimic train`: trains a policy to perform a motion under physics.

mod clock;
mod finish;
mod preset;
mod progress;
mod resume;
mod roles;
mod setting;
mod stop;

use crate::args::{ImportArgs, RetargetArgs, samples, whole};
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::prepare::{Preparation, Prepared};
use crate::printer::Printer;
use crate::runs;
use crate::shell;
use clap::builder::{PossibleValue, PossibleValuesParser};
use clock::Clock;
use finish::Stopped;
use mimic::run::{Claim, Plan, Run, RunError, Session, files};
use mimic::task::{CharacterModel, TASKS, TaskError, TaskSettings};
use preset::Preset;
use progress::Progress;
pub use resume::program;
use resume::{farewell, unwritten};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use stop::Stop;

const EXAMPLES: &str = "\
Examples:
  mimic train kick.fbx                       import, retarget, train: runs/kick
  mimic train kick.motion --minutes 10 --seed 7 --out runs/kick-seed7
  mimic train walk.motion run.motion         train one policy for both motions
  mimic train --resume kick                  continue a stopped run, bit for bit
  mimic train kick.fbx --json > curve.jsonl  print a line per iteration
  mimic train kick.fbx --preset booth2020 --samples 20M
  mimic train kick.fbx --set task.terminations.distance=0.4 --set ppo.gamma=0.97

Presets (docs/settings.md lists all their values):
  default        ours: actions are rotations added to those of the reference;
                 a clip takes minutes
  deepmimic      reward and rates of the code of Peng et al. 2018, our learner
  deepmimic2018  their paper, with its learner: absolute target rotations and a
                 large network; made for 60M samples
  booth2020      Booth & Ivanov 2020, on the character `marathon`: 258 numbers
                 observed, 21 targets, angular momentum in observation and reward;
                 episodes start at the first frame and end when the reward falls
                 below a threshold; made for 128M samples

`--set` changes one setting of the preset, by its path under `plan` in a run's config.json.

A run folder holds config.json, metrics.jsonl, the checkpoint and the policy, and in the end also \
eval.json and replay.rrd. No run is ever overwritten: the next one of the same clip is runs/kick-2. \
Training goes on in iterations, and after some of them (a round: 20 in the default preset) it saves a \
checkpoint. Ctrl-C finishes the current round, saves and stops. A second Ctrl-C stops at once and keeps \
the last checkpoint, from which `--resume` goes on.";

/// The preset of who chooses none.
const DEFAULT: &str = "default";

/// Longest training, minutes: two years, which is longer than anybody trains and within what clocks can count.
const MOST_MINUTES: f64 = 1e6;

/// Train a policy that performs a motion under physics
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Motions, clips or animation files; one policy learns all of them [default: the newest motion]
    #[arg(value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// What the policy learns [default: the preset's task]
    #[arg(long, value_name = "TASK", value_parser = tasks())]
    task: Option<String>,
    /// Settings to start from: `default`, `deepmimic`, `deepmimic2018`, `booth2020`, those of a run, or a JSON file with a
    /// plan as in a run's config.json
    #[arg(long, value_name = "NAME|FILE|RUN", default_value = DEFAULT)]
    preset: String,
    /// Change one setting of the preset, e.g. `ppo.gamma=0.97`; can be repeated
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<String>,
    /// Disturb training by shoves and by changed weight and friction. Ranges come from the preset; if it has none, from the
    /// usual ones (`task.perturbations` in docs/settings.md)
    #[arg(long)]
    perturb: bool,
    /// Number of samples to learn from, e.g. 5M or 800k, rounded up to whole iterations (4096 samples in the default preset)
    /// [default: that of the preset]
    #[arg(long, value_name = "N", value_parser = samples, allow_negative_numbers = true)]
    samples: Option<u64>,
    /// Stop after this many minutes, even if samples are left; preparing and measuring count as well
    #[arg(long, value_name = "MIN", value_parser = minutes, allow_negative_numbers = true)]
    minutes: Option<f64>,
    /// Random seed; the same seed gives the same result, bit for bit [default: that of the preset]
    #[arg(long, value_name = "N", value_parser = whole, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Number of threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = crate::args::threads, allow_negative_numbers = true)]
    threads: Option<usize>,
    /// Continue a run that was stopped
    #[arg(
        long,
        value_name = "RUN",
        conflicts_with_all = ["inputs", "out", "samples", "seed", "preset", "set", "perturb", "task", "ImportArgs", "RetargetArgs"]
    )]
    resume: Option<PathBuf>,
    /// Folder of the run [default: runs/CLIP, or runs/CLIP-2 and so on if that exists]
    #[arg(long, short, value_name = "RUN")]
    out: Option<PathBuf>,
    #[command(flatten)]
    import: ImportArgs,
    #[command(flatten)]
    retarget: RetargetArgs,
}

/// The paths of all settings, for `--set`.
pub fn settings() -> Vec<String> {
    setting::known(&Plan::default())
}

/// The names of the tasks and what they are.
fn tasks() -> PossibleValuesParser {
    let value = |(name, about): (&'static str, &'static str)| PossibleValue::new(name).help(about);
    PossibleValuesParser::new(TASKS.map(value))
}

impl Args {
    /// Runs the command.
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        let begun = Instant::now();
        let threads = runs::use_threads(self.threads)?;
        let stop = Stop::on_signals()?;
        let run = match &self.resume {
            Some(run) => runs::open(Some(run))?,
            None => {
                let created = self.create(library, &stop, printer);
                stop.give_way();
                created?
            }
        };
        let unsaved = run.unsaved();
        let minutes = self
            .minutes
            .map(|minutes| Duration::from_secs_f64(60.0 * minutes));
        let outcome = learn(run, Clock::new(begun, minutes), &stop, threads, printer);
        stop.give_way();
        if outcome.is_err() {
            // Unless something was saved, there is nothing that a later command could use.
            unsaved.remove();
        }
        outcome
    }

    /// Makes the run. Its folder is claimed first, so that another process doesn't take it meanwhile, and is removed again if
    /// something that the run needs can't be had.
    fn create(&self, library: &Path, stop: &Stop, printer: &Printer) -> Outcome<Run> {
        let preset = self.preset()?;
        let preparations = self.preparations(library, preset.skeleton)?;
        let claim = self.claim(&preparations, printer)?;
        let unsaved = claim.unsaved();
        stop.before_end(move || unsaved.remove());
        let mut motions = Vec::new();
        let mut skeleton = None;
        say_repeated(&preparations, printer);
        let prepared = Preparation::run_all(&preparations, printer)?;
        self.say_character(&preset, &preparations, &prepared, printer);
        for (preparation, prepared) in preparations.iter().zip(prepared) {
            let Prepared {
                motion,
                skeleton: own,
                ..
            } = prepared;
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
        let skeleton = skeleton.ok_or_else(|| Failure::user("there is no motion to learn"))?;
        // What a character can't do is the fault of its file, which the run doesn't know.
        if let Some(file) = &self.retarget.skeleton {
            let model = CharacterModel::new(skeleton.clone());
            model.map_err(|e| Failure::in_file(Path::new(file), e))?;
        }
        if matches!(preset.plan.task, TaskSettings::Steer(_)) {
            roles::say(&preparations, &motions, &skeleton, printer);
        }
        let run = claim.create(preset.plan.clone(), skeleton, motions);
        run.map_err(|e| preset.failure(e))
    }

    /// What the inputs are and how they become motions. A motion has its character already; a clip gets that of the preset
    /// unless `--skeleton` names another.
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

    /// A motion keeps the character that it was made for. Says so where the preset was chosen, and is for another one.
    fn say_character(
        &self,
        preset: &Preset,
        preparations: &[Preparation],
        prepared: &[Prepared],
        printer: &Printer,
    ) {
        let wanted = preset
            .skeleton
            .filter(|_| self.preset != DEFAULT && self.retarget.skeleton.is_none());
        let own = preparations.iter().zip(prepared);
        let other = own.into_iter().find_map(|(preparation, prepared)| {
            let name = &prepared.skeleton.name;
            let differs = wanted.filter(|wanted| preparation.is_motion() && wanted != name)?;
            Some((preparation.file.display(), name, differs))
        });
        if let Some((file, own, wanted)) = other {
            printer.warn(format!(
                "`{file}` was made for the character `{own}`, which is trained, and the preset `{}` is for `{wanted}`; give the clip of this motion to train `{wanted}`",
                self.preset
            ));
        }
    }

    /// Claims the folder of the new run: that of `--out`, or a free one named after the inputs.
    fn claim(&self, preparations: &[Preparation], printer: &Printer) -> Outcome<Claim> {
        if let Some(out) = &self.out {
            return Claim::on(out).map_err(|error| match error {
                RunError::Exists(_) => Failure::from(error).with_remedy(format!(
                    "choose another folder with `--out FOLDER`, or continue that run with `--resume {}`",
                    shell::path(out)
                )),
                _ => error.into(),
            });
        }
        let names: Vec<String> = preparations.iter().map(Preparation::name).collect();
        let name = match names.as_slice() {
            [first, _, _, ..] => format!("{first}-and-{}-more", names.len() - 1),
            few => few.join("-and-"),
        };
        let name = crate::output::safe_name(&name);
        let claim = runs::claim(&name)?;
        let folder = claim.dir();
        if folder
            .file_name()
            .is_some_and(|taken| taken != name.as_str())
        {
            printer.note(format!(
                "a run `{name}` exists already, so this one is `{}`",
                folder.display()
            ));
        }
        Ok(claim)
    }

    /// The settings of the preset, with the changes of the command line.
    fn preset(&self) -> Outcome<Preset> {
        let mut preset = Preset::load(&self.preset)?;
        if let Some(task) = &self.task {
            preset.choose_task(task)?;
        }
        if self.perturb {
            let perturbations = preset.plan.task.perturbations_mut();
            *perturbations = perturbations.or_usual();
        }
        preset.change(&self.set)?;
        let plan = &mut preset.plan;
        if plan.samples == 0 {
            return Err(
                Failure::user("the number of samples is 0").with_remedy("set it to 1 or more")
            );
        }
        plan.samples = self.samples.unwrap_or(plan.samples);
        plan.seed = self.seed.unwrap_or(plan.seed);
        Ok(preset)
    }
}

/// Says which file was given more than once: its motion then counts as often.
fn say_repeated(preparations: &[Preparation], printer: &Printer) {
    let place = |one: &Preparation| one.file.canonicalize().unwrap_or(one.file.clone());
    let places: Vec<PathBuf> = preparations.iter().map(place).collect();
    let again = (1..places.len()).find(|&at| places[..at].contains(&places[at]));
    if let Some(at) = again {
        printer.warn(format!(
            "`{}` is given more than once, so the policy learns the same motion as often; leave it out where that is not meant",
            preparations[at].file.display()
        ));
    }
}

/// Trains the run, or makes up for what is missing of its results.
fn learn(run: Run, clock: Clock, stop: &Stop, threads: usize, printer: &Printer) -> Outcome {
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
    match train(&mut session, clock, stop, printer)? {
        Stopped::Interrupt => {
            printer.say(farewell(session.run()));
            finish::interrupted(session.run().dir(), printer)
        }
        stopped => {
            let (text, run, printer) = (farewell(session.run()), session.run().dir(), *printer);
            let run = run.to_owned();
            stop.before_end(move || {
                printer.say(&text);
                // Nobody is left to tell that it can't be printed.
                finish::interrupted(&run, &printer).ok();
            });
            finish::finish(&session, stopped, &printer)
        }
    }
}

/// Trains until the samples or the time are used up, until it is asked to stop, or until nobody reads its lines any more. It
/// saves between rounds only: there a run can be continued bit for bit. Time that is up within a round leaves the policy, and
/// the run goes on before that round.
fn train(
    session: &mut Session,
    mut clock: Clock,
    stop: &Stop,
    printer: &Printer,
) -> Outcome<Stopped> {
    let progress = Progress::new(session, printer);
    stop.before_end({
        let (bar, printer, run) = (progress.bar(), *printer, session.run());
        let (folder, text, unsaved) = (run.dir().to_owned(), farewell(run), run.unsaved());
        move || {
            bar.finish_and_clear();
            unsaved.remove();
            match folder.join(files::CONFIG).exists() {
                true => printer.say(&text),
                false => printer.say("stopped before anything was saved; train again"),
            }
        }
    });
    stop.save_first();
    let mut unheard = None;
    let end = loop {
        let iteration = session.iterate();
        let iteration = iteration.map_err(|e| unwritten(session.run(), e))?;
        if unheard.is_none() {
            // What is learned in this round is saved first, whatever became of standard output.
            unheard = progress.show(&iteration, &clock, printer).err();
        }
        if stop.is_wanted() || unheard.is_some() {
            progress.stopping();
        }
        let ending = finish::duration(session, &iteration);
        let is_over = clock.end_iteration(ending);
        if !session.can_be_saved() {
            if is_over {
                session
                    .save_policy()
                    .map_err(|e| unwritten(session.run(), e))?;
                break Stopped::Minutes;
            }
            continue;
        }
        session.save().map_err(|e| unwritten(session.run(), e))?;
        // A signal may have come while that was saved, so it is asked for once more.
        let ended = ended(session.is_done(), stop.is_wanted(), unheard.is_some());
        let time_is_up = || clock.end_round(ending).then_some(Stopped::Minutes);
        if let Some(end) = ended.or_else(time_is_up) {
            break end;
        }
    };
    let end = if stop.release() {
        Stopped::Interrupt
    } else {
        end
    };
    match unheard.filter(|_| end != Stopped::Samples) {
        Some(failure) => {
            drop(progress);
            printer.say(farewell(session.run()));
            Err(failure)
        }
        None => Ok(end),
    }
}

/// Whether training ends where it was just saved, and by what. Who went away, but at the end, misses the lines alone: the run is
/// finished as any other.
fn ended(is_done: bool, is_asked: bool, is_unheard: bool) -> Option<Stopped> {
    match (is_asked, is_done, is_unheard) {
        (true, _, _) => Some(Stopped::Interrupt),
        (false, true, _) => Some(Stopped::Samples),
        (false, false, true) => Some(Stopped::Interrupt),
        (false, false, false) => None,
    }
}

fn minutes(text: &str) -> Result<f64, String> {
    runs::at_most(text, MOST_MINUTES, "minutes")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run that is done never goes on, at whatever moment a signal comes.
    #[test]
    fn a_run_that_is_done_ends() {
        for (asked, unheard) in [(false, false), (true, false), (false, true), (true, true)] {
            let end = ended(true, asked, unheard).map(|end| end == Stopped::Interrupt);
            assert_eq!(end, Some(asked), "{asked} {unheard}");
        }
        assert!(ended(false, false, false).is_none());
        assert!(ended(false, false, true) == Some(Stopped::Interrupt));
    }
}
