//! The command line: what can be typed.

use crate::failure::{Failure, Outcome};
use crate::verbs;
use clap::{Args, Parser, Subcommand, ValueEnum};
use mimic::clip::LoopMode;
use mimic::humanoid::Slot;
use mimic::import::{Options, UpAxis};
use mimic::skeleton::Skeleton;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic info kick.fbx               what is in the file, and which joint is which
  mimic retarget kick.fbx           carry the clip onto the physics character
  mimic train kick.fbx              learn to perform it; the result is a run, runs/kick
  mimic replay kick --rerun         watch the agent with its reference
  mimic eval kick                   how well it does
  mimic plot kick                   how it learned, as a drawing

Every stage takes the file of an earlier stage and does what is missing. Inputs are found by path, or
by name in the library folder; left out, the most recent one is taken. Results go to standard output,
talk to standard error. Exit code: 0 success, 1 the work failed, 2 wrong usage or input.";

/// From an animation clip to a physics character that performs it
#[derive(Parser)]
#[command(name = "mimic", version, after_help = EXAMPLES, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    pub verb: Verb,
    #[command(flatten)]
    pub talk: Talk,
    /// Folder where inputs are found by name
    #[arg(
        long,
        global = true,
        value_name = "DIR",
        env = "MIMIC_LIBRARY",
        default_value = "clips",
        help_heading = "Global options"
    )]
    pub library: PathBuf,
}

/// How much is said, and in what form.
#[derive(Args)]
#[command(next_help_heading = "Global options")]
pub struct Talk {
    /// Print one JSON object instead of text (`train`: one per iteration)
    #[arg(long, global = true)]
    pub json: bool,
    /// Say nothing but results and errors
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more, also when the output is piped
    #[arg(long, short, global = true)]
    pub verbose: bool,
}

#[derive(Subcommand)]
pub enum Verb {
    Info(verbs::info::Args),
    Import(verbs::import::Args),
    Edit(verbs::edit::Args),
    Retarget(verbs::retarget::Args),
    Tracks(verbs::tracks::Args),
    Train(verbs::train::Args),
    Eval(verbs::eval::Args),
    Replay(verbs::replay::Args),
    Plot(verbs::plot::Args),
    Bench(verbs::bench::Args),
    Doctor(verbs::doctor::Args),
    Completions(verbs::completions::Args),
    Man(verbs::man::Args),
}

/// How an animation file is read.
#[derive(Args, Clone, Default)]
#[command(next_help_heading = "Import options")]
pub struct ImportArgs {
    /// Take to read, by name or by number from 1; `mimic import` has `all` as well [default: the one with most motion]
    #[arg(long, value_name = "TAKE")]
    take: Option<String>,
    /// Frames per second to sample at; below 27 a motion has a multiple of them [default: the take's own]
    #[arg(long, value_name = "HZ", value_parser = positive)]
    fps: Option<f64>,
    /// Part to keep, in seconds from the start of the take
    #[arg(long, value_name = "A..B", value_parser = span)]
    trim: Option<(f64, f64)>,
    /// Whether the last frame leads to the first, or the motion ends
    #[arg(long = "loop", value_enum, value_name = "MODE", default_value_t)]
    loops: Loop,
    /// Up axis of the data, where the file is wrong about it: x, y, z, -x, -y or -z
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    up: Option<UpAxis>,
    /// Metres per unit of the data, where the file is wrong about it
    #[arg(long, value_name = "METRES", value_parser = positive)]
    unit: Option<f64>,
}

#[derive(Clone, Copy, Default, ValueEnum)]
enum Loop {
    /// Find out from the motion
    #[default]
    Auto,
    /// The last frame leads to the first
    Wrap,
    /// It is performed once, and then ends
    Clamp,
}

impl ImportArgs {
    pub fn options(&self) -> Options {
        Options {
            take: self.take.clone(),
            fps: self.fps,
            trim: self.trim,
            loop_mode: match self.loops {
                Loop::Auto => None,
                Loop::Wrap => Some(LoopMode::Wrap),
                Loop::Clamp => Some(LoopMode::Clamp),
            },
            up: self.up,
            unit_m: self.unit,
            mirror: false,
        }
    }

    pub fn take(&self) -> Option<&str> {
        self.take.as_deref()
    }

    /// Flags that have nothing to act on once a file is a clip or a motion are refused, not ignored.
    pub fn refuse_for(&self, file: &Path, kind: &str) -> Outcome {
        if self.options() == Options::default() {
            return Ok(());
        }
        Err(Failure::input(
            file,
            format!("is {kind} already, import options don't apply; give the animation file"),
        ))
    }
}

/// How a clip is carried onto a physics character.
#[derive(Args, Clone, Default)]
#[command(next_help_heading = "Retarget options")]
pub struct RetargetArgs {
    /// Physics character: a built-in name, or an MJCF file [default: humanoid]
    #[arg(long, value_name = "NAME|FILE")]
    pub skeleton: Option<String>,
    /// Joint map, as `mimic info --write-map` writes it [default: found out]
    #[arg(long, value_name = "FILE")]
    pub map: Option<PathBuf>,
    /// How much a slot of the joint map counts, as a multiple of what it counts by default, e.g. `head=3`; can be given
    /// several times
    #[arg(long, value_name = "SLOT=X", value_parser = slot_weight)]
    pub weight: Vec<(Slot, f64)>,
}

impl RetargetArgs {
    /// As for import options: nothing is ignored.
    pub fn refuse_for(&self, file: &Path, kind: &str) -> Outcome {
        if self.skeleton.is_none() && self.map.is_none() && self.weight.is_empty() {
            return Ok(());
        }
        Err(Failure::input(
            file,
            format!(
                "is {kind} already, `--skeleton`, `--map` and `--weight` don't apply; give the clip"
            ),
        ))
    }

    pub fn skeleton(&self) -> Outcome<Skeleton> {
        let name = self.skeleton.as_deref().unwrap_or("humanoid");
        Skeleton::load(name).map_err(Failure::user)
    }
}

pub fn positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "not a number".to_string())?;
    if number.is_finite() && number > 0.0 {
        Ok(number)
    } else {
        Err("not a positive number".into())
    }
}

/// A slot of the joint map with a number, as `head=3`.
fn slot_weight(text: &str) -> Result<(Slot, f64), String> {
    let known = || Slot::ALL.map(Slot::name).join(", ");
    let (name, weight) = text
        .split_once('=')
        .ok_or("give a slot and how much it counts, e.g. head=3")?;
    let slot = Slot::ALL.into_iter().find(|slot| slot.name() == name);
    let slot = slot.ok_or_else(|| format!("there is no slot `{name}`, only {}", known()))?;
    let weight = weight.parse().map_err(|_| "the weight is no number")?;
    Ok((slot, weight))
}

pub fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("at least 1 is needed".into()),
        Ok(number) => Ok(number),
        Err(_) => Err("not a whole number".into()),
    }
}

/// `A..B`, `A..` or `..B`, in seconds.
pub fn span(text: &str) -> Result<(f64, f64), String> {
    let seconds = |text: &str, open: f64| match text.trim().trim_end_matches('s') {
        "" => Ok(open),
        text => text
            .parse()
            .map_err(|_| format!("`{text}` is no number of seconds")),
    };
    let (from, to) = text
        .split_once("..")
        .ok_or("give seconds as A..B, e.g. 0.5..2")?;
    let (from, to) = (seconds(from, 0.0)?, seconds(to, f64::INFINITY)?);
    if from >= 0.0 && from < to {
        Ok((from, to))
    } else {
        Err("the end isn't after the start".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }

    #[test]
    fn spans_may_be_open() {
        assert_eq!(span("0.5..2"), Ok((0.5, 2.0)));
        assert_eq!(span("1.."), Ok((1.0, f64::INFINITY)));
        assert_eq!(span("..2s"), Ok((0.0, 2.0)));
        assert!(span("2..1").is_err() && span("nan..1").is_err() && span("1").is_err());
    }
}
