//! `mimic replay`: shows an agent with its reference, or a motion, in the rerun viewer.

use crate::args::{ImportArgs, Replace, RetargetArgs, at_least_one};
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::output::{Form, Maker, Output, names_folder, result_path};
use crate::prepare::Preparation;
use crate::printer::Printer;
use crate::recording::{self, Recording};
use crate::runs;
use crate::viewer::{self, Bind, Viewer};
use clap::builder::NonEmptyStringValueParser;
use mimic::evaluate::Options;
use mimic::explain::plain;
use mimic::task::{EpisodeStart, StartState};
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic replay --rerun                       open the newest run in the viewer
  mimic replay kick --rerun --beside         show agent and reference side by side
  mimic replay kick --rerun --phase 0.44     start where `mimic eval` reports a fall
  mimic replay walk --rerun --perturb        disturb the agent by shoves
  mimic replay walk.fbx --save walk.rrd      record a clip; `rerun walk.rrd` opens it
  mimic replay kick --serve                  watch it in a web browser on this machine
  mimic replay kick --serve --bind 0.0.0.0   let browsers on other machines in, too
  mimic replay kick --connect 127.0.0.1:9876
  mimic replay walk-and-run --rerun --sequence walk,run,walk
                                             go from one motion to the next";

/// Longest replay, seconds: every frame is held in memory.
const MOST_SECONDS: f64 = 3600.0;

fn seconds(text: &str) -> Result<f64, String> {
    runs::at_most(text, MOST_SECONDS, "seconds")
}

fn share(text: &str) -> Result<f64, String> {
    let share = text.parse().map_err(|_| "give a number from 0 to 1")?;
    if (0.0..=1.0).contains(&share) {
        Ok(share)
    } else {
        Err("must be between 0 and 1".into())
    }
}

/// Metres between agent and reference when they stand side by side.
const BESIDE: f64 = 1.2;
/// Default length of the replay of a looping motion, seconds.
const SECONDS: f64 = 10.0;
/// The same for each motion of a sequence.
const SECONDS_IN_SEQUENCE: f64 = 4.0;

/// Watch an agent with its reference, or a motion, in the rerun viewer
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Run, motion, clip or animation file [default: the newest run, or if there is none the newest motion]
    #[arg(value_name = "RUN|MOTION")]
    what: Option<PathBuf>,
    #[command(flatten)]
    sinks: Sinks,
    #[command(flatten)]
    replace: Replace,
    /// Show the reference beside the agent instead of in the same place
    #[arg(long)]
    beside: bool,
    /// Length of the replay in seconds, for looping motions of a run [default: 10; in a sequence 4 for each]
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Phase at which the agent starts, from 0 to 1; `mimic eval` lists those from which it fails [default: 0]
    #[arg(
        long,
        value_name = "SHARE",
        value_parser = share,
        allow_negative_numbers = true,
        conflicts_with = "sequence"
    )]
    phase: Option<f64>,
    /// Disturb the agent by shoves and by changed weight and friction, as `mimic eval --perturb` does at the nearest of its
    /// 32 phases
    #[arg(long, conflicts_with = "sequence")]
    perturb: bool,
    /// Motion to show of a run that learned several, by number from 1 [default: 1]
    #[arg(long, value_name = "N", value_parser = at_least_one, allow_negative_numbers = true)]
    motion: Option<usize>,
    /// Motions of a run to perform one after another, by name or a part of it; looping ones last `--seconds`, others play to
    /// their end
    #[arg(
        long,
        value_name = "NAME,...",
        value_delimiter = ',',
        conflicts_with = "motion"
    )]
    sequence: Vec<String>,
    #[command(flatten)]
    import: ImportArgs,
    #[command(flatten)]
    retarget: RetargetArgs,
}

/// Where the recording goes: one or several places.
#[derive(clap::Args)]
struct Sinks {
    /// Open it in the viewer
    #[arg(long)]
    rerun: bool,
    /// Write it to a file, or as NAME.rrd into a folder
    #[arg(long, value_name = "FILE.rrd")]
    save: Option<PathBuf>,
    /// Send it to a running viewer, e.g. at 127.0.0.1:9876
    #[arg(long, value_name = "ADDR", value_parser = NonEmptyStringValueParser::new())]
    connect: Option<String>,
    /// Serve it to web browsers until Ctrl-C; the rerun viewer has to be installed for that, too
    #[arg(long)]
    serve: bool,
    /// Address at which the viewer of `--serve` or `--rerun` listens, with a port if it has to be a certain one: 0.0.0.0 lets
    /// other machines in [default: 127.0.0.1, which is this machine alone]
    #[arg(long, value_name = "ADDR[:PORT]")]
    bind: Option<Bind>,
}

impl Args {
    /// Runs the command.
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        recording::require()?;
        self.sinks.check()?;
        let viewer = (self.sinks.rerun || self.sinks.serve)
            .then(Viewer::require)
            .transpose()?;
        let source = self.source(library)?;
        if let Some(save) = self
            .sinks
            .save
            .as_deref()
            .filter(|save| !names_folder(save))
        {
            self.output(save.to_owned(), &source).check()?;
        }
        let mut shown = self.record(&source, printer)?;
        if self.beside {
            shown.beside = BESIDE;
        }
        let path = |save| result_path(Some(save), &shown.name, Form::Recording);
        let output = self.sinks.save.as_deref().map(path);
        let output = output.map(|path| self.output(path, &source));
        self.sinks
            .show(&shown, output.as_ref(), viewer.as_ref(), printer)?;
        let saved = output.as_ref().map(Output::path);
        match viewer.filter(|_| self.sinks.serve) {
            Some(viewer) => serve(&shown, &viewer, &self.sinks.bind(), |address| {
                self.report(&shown, saved, Some(address), printer)
            }),
            None => self.report(&shown, saved, None, printer),
        }
    }

    /// Prints what was shown, and at which `address` it is served.
    fn report(
        &self,
        shown: &Recording,
        saved: Option<&Path>,
        address: Option<&str>,
        printer: &Printer,
    ) -> Outcome {
        let json = json!({
            "name": shown.name,
            "recording": saved.map(|path| path.display().to_string()),
            "address": address,
            "frames": shown.frames(),
            "fps": shown.fps,
            "agent": shown.agent.is_some(),
            "perturbed": self.perturb,
            "shoves": shown.shoves,
            "failed_s": shown.failed_s,
        });
        printer.result(&json, || {
            let served = address.map(|a| format!("\nopen {a} in a browser; Ctrl-C ends it"));
            summary(shown, saved, self.perturb) + &served.unwrap_or_default()
        })
    }
}

/// What is replayed.
enum Source {
    Run(PathBuf),
    Animation(PathBuf),
}

impl Source {
    fn path(&self) -> &Path {
        match self {
            Self::Run(path) | Self::Animation(path) => path,
        }
    }
}

impl Args {
    /// A run by path or name, else an animation by path or name; left out, the newest run, else the newest motion.
    fn source(&self, library: &Path) -> Outcome<Source> {
        let run = match &self.what {
            Some(what) => locate::existing_run(what),
            None => locate::newest_run(),
        };
        if let Some(run) = run {
            return Ok(Source::Run(run));
        }
        let what = self.what.as_deref();
        let file = locate::file_or_newest(what, library, &locate::ANIMATIONS, "motion")
            .map_err(|failure| locate::or_run(what, failure))?;
        Ok(Source::Animation(file))
    }

    fn record(&self, source: &Source, printer: &Printer) -> Outcome<Recording> {
        match source {
            Source::Run(run) => self.record_run(run, printer),
            Source::Animation(file) => self.record_motion(file, printer),
        }
    }

    /// The file of `--save`.
    fn output(&self, path: PathBuf, source: &Source) -> Output {
        let detail = self.retarget.detail(self.import.take().unwrap_or(""));
        let maker = Maker::new("replay", [source.path()]).with(detail);
        let maker = match source {
            Source::Run(_) => maker,
            Source::Animation(_) => maker.by(" for the same character and take"),
        };
        Output::new(path, Form::Recording, maker, "--save", self.replace.force)
    }

    fn record_run(&self, run: &Path, printer: &Printer) -> Outcome<Recording> {
        self.import.refuse_for(run, "a run")?;
        self.retarget.refuse_for(run, "a run")?;
        let run = runs::open(Some(run))?;
        if !self.sequence.is_empty() {
            let seconds = self.seconds.unwrap_or(SECONDS_IN_SEQUENCE);
            return runs::record_sequence(&run, &self.sequence, seconds, printer);
        }
        let which = self.motion.unwrap_or(1) - 1;
        let phase = self.phase.unwrap_or(0.0);
        let perturbations = runs::perturbations(&run, true).filter(|_| self.perturb);
        let start = EpisodeStart {
            disturbance: perturbations.map(|ranges| (ranges, phase_number(phase))),
            ..EpisodeStart::new(which, StartState::Reference(phase))
        };
        runs::record(&run, start, self.seconds.unwrap_or(SECONDS))
    }

    fn record_motion(&self, file: &Path, printer: &Printer) -> Outcome<Recording> {
        self.refuse_agent_flags(file)?;
        let preparation = Preparation::new(file.to_owned(), &self.import, &self.retarget);
        let prepared = preparation.run(printer)?;
        Ok(Recording::of_motion(&prepared.motion, &prepared.skeleton))
    }

    /// Refuses flags about an agent where there is none: nothing is ignored silently.
    fn refuse_agent_flags(&self, file: &Path) -> Outcome {
        let given = [
            ("--beside", self.beside),
            ("--seconds", self.seconds.is_some()),
            ("--phase", self.phase.is_some()),
            ("--perturb", self.perturb),
            ("--motion", self.motion.is_some()),
            ("--sequence", !self.sequence.is_empty()),
        ];
        let Some((flag, _)) = given.into_iter().find(|(_, given)| *given) else {
            return Ok(());
        };
        let cause = format!("this has no agent, and `{flag}` applies to runs");
        Err(Failure::input(file, cause).with_remedy("give a run, or leave the option out"))
    }
}

/// The phase of `mimic eval` that is nearest: it disturbs each by its number.
fn phase_number(phase: f64) -> u64 {
    let episodes = Options::default().episodes;
    ((phase * episodes as f64).round() as u64).min(episodes as u64 - 1)
}

fn summary(shown: &Recording, saved: Option<&Path>, perturbed: bool) -> String {
    let frames = shown.frames();
    let who = if shown.agent.is_some() {
        "agent and reference"
    } else {
        "reference"
    };
    let place = saved.map_or_else(|| shown.name.clone(), |path| path.display().to_string());
    let failed = shown.failed_s.map_or_else(String::new, |seconds| {
        format!("; the agent fails after {seconds:.1} s")
    });
    let how = match (perturbed, shown.shoves.len()) {
        (false, _) => String::new(),
        (true, 1) => ", disturbed, with 1 shove".to_owned(),
        (true, count) => format!(", disturbed, with {count} shoves"),
    };
    plain(&format!(
        "{place}: {who}{how}, {frames} frames at {:.1} Hz{failed}",
        shown.fps
    ))
}

impl Sinks {
    fn show(
        &self,
        shown: &Recording,
        output: Option<&Output>,
        viewer: Option<&Viewer>,
        printer: &Printer,
    ) -> Outcome {
        if let Some(output) = output {
            recording::save_to(shown, output)?;
        }
        if let Some(place) = &self.connect {
            send(shown, viewer::address(place))?;
        }
        let Some(viewer) = viewer else {
            return Ok(());
        };
        if !viewer.fits() {
            let version = viewer.version.as_deref().unwrap_or("of unknown version");
            printer.warn(format!(
                "the viewer has version {version}, recordings are written for {}: {}",
                viewer::VERSION,
                viewer::install()
            ));
        }
        if self.rerun {
            send(shown, viewer.open(&self.bind())?)?;
        }
        Ok(())
    }

    /// Refuses a replay that nobody would see, and an address at which nothing listens.
    fn check(&self) -> Outcome {
        if !(self.rerun || self.serve || self.connect.is_some() || self.save.is_some()) {
            return Err(Failure::user("the command does not say where to show the replay").with_remedy(
                "say it: `--rerun` opens the viewer, `--serve` a browser's page in the viewer, and `--save FILE.rrd` writes a file",
            ));
        }
        if self.bind.is_some() && !(self.rerun || self.serve) {
            let cause = "`--bind` is for the viewer that `--serve` or `--rerun` starts";
            return Err(Failure::user(cause).with_remedy("give one of the two, or leave it out"));
        }
        Ok(())
    }

    fn bind(&self) -> Bind {
        self.bind.unwrap_or_default()
    }
}

fn send(shown: &Recording, address: String) -> Outcome {
    viewer::reach(&address)?;
    let failed = |e| {
        Failure::work(format!("cannot send the recording to `{address}`: {e}")).with_remedy(
            "check that the viewer still runs, or write it to a file with `--save FILE.rrd`",
        )
    };
    recording::send(shown, &address).map_err(failed)
}

/// Serves it from a temporary file until Ctrl-C. `ready` gets the address.
fn serve(
    shown: &Recording,
    viewer: &Viewer,
    bind: &Bind,
    ready: impl FnOnce(&str) -> Outcome,
) -> Outcome {
    let failed = |e| Failure::write(&std::env::temp_dir(), e);
    let mut builder = tempfile::Builder::new();
    let file = builder.prefix("mimic-").suffix(".rrd").tempfile();
    let mut file = file.map_err(failed)?;
    file.write_all(&recording::bytes(shown, None)?)
        .map_err(failed)?;
    viewer.serve(file.path(), bind, ready)
}
