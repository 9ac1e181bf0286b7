//! Arguments that several verbs share, and how their values are read.

use crate::failure::{Failure, Outcome};
use clap::builder::NonEmptyStringValueParser;
use clap::{Args, ValueEnum};
use mimic::clip::LoopMode;
use mimic::explain::{did_you_mean, plain};
use mimic::humanoid::Slot;
use mimic::import::{Options, UpAxis};
use mimic::skeleton::Skeleton;
use std::path::{Path, PathBuf};

/// How much is printed, and in what form.
#[derive(Args)]
#[command(next_help_heading = "Global options")]
pub struct Talk {
    /// Print JSON instead of text: one object, or in `train` one line per iteration
    #[arg(long, global = true)]
    pub json: bool,
    /// Print only results and errors
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print notes on what is being done, even when piped
    #[arg(long, short, global = true)]
    pub verbose: bool,
}

/// Fewest and most frames per second that a clip can have.
const LEAST_FPS: f64 = 0.1;
const MOST_FPS: f64 = 10_000.0;

/// Whether a result may take the place of something else.
#[derive(Args, Clone, Copy, Default)]
pub struct Replace {
    /// Replace a file that the same command did not make from the same input
    #[arg(long)]
    pub force: bool,
}

/// How an animation file is read.
#[derive(Args, Clone, Default)]
#[command(next_help_heading = "Import options")]
pub struct ImportArgs {
    /// Take to read, by name or by number from 1; `mimic import` also accepts `all` [default: the take with most motion]
    #[arg(long, value_name = "TAKE", value_parser = NonEmptyStringValueParser::new())]
    take: Option<String>,
    /// Frames per second of the clip. A motion made of a clip with fewer than 27 gets more, by a whole factor: a clip with 20
    /// becomes a motion with 60 [default: the take's own rate]
    #[arg(long, value_name = "HZ", value_parser = frame_rate, allow_negative_numbers = true)]
    fps: Option<f64>,
    /// Part of the take to keep, in seconds from its start, e.g. 0.5..2, 1.. or ..2
    #[arg(long, value_name = "A..B", value_parser = span, allow_hyphen_values = true)]
    trim: Option<(f64, f64)>,
    /// Whether the motion repeats: `auto` (decide by the motion), `wrap` (it does) or `clamp` (it plays once)
    #[arg(
        long = "loop",
        value_enum,
        value_name = "MODE",
        default_value_t,
        hide_possible_values = true
    )]
    loops: Loop,
    /// Up axis of the data, if the file states a wrong one: x, y, z, -x, -y or -z
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    up: Option<UpAxis>,
    /// Metres per unit of length, if the file states a wrong unit; 0.01 for centimetres
    #[arg(long, value_name = "METRES", value_parser = positive, allow_negative_numbers = true)]
    unit: Option<f64>,
}

#[derive(Clone, Copy, Default, ValueEnum)]
enum Loop {
    /// Decide by the motion itself
    #[default]
    Auto,
    /// It repeats: the last frame leads back to the first
    Wrap,
    /// It plays once and ends
    Clamp,
}

impl ImportArgs {
    /// The same for the library.
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

    /// The take that was asked for.
    pub fn take(&self) -> Option<&str> {
        self.take.as_deref()
    }

    /// Refuses import options for a `file` that is past import: they would have no effect, and nothing is ignored silently.
    pub fn refuse_for(&self, file: &Path, kind: &str) -> Outcome {
        if self.options() == Options::default() {
            return Ok(());
        }
        let cause = format!("this is {kind} already, and import options apply to animation files");
        Err(Failure::input(file, cause)
            .with_remedy("give the animation file, or leave the options out"))
    }
}

/// How a clip is retargeted.
#[derive(Args, Clone, Default)]
#[command(next_help_heading = "Retarget options")]
pub struct RetargetArgs {
    /// Physics character: `humanoid`, `marathon`, `robot` or an MJCF file [default: humanoid; in `train` that of the preset]
    #[arg(long, value_name = "NAME|FILE", value_parser = NonEmptyStringValueParser::new())]
    pub skeleton: Option<String>,
    /// Joint map, as written by `mimic info --write-map` [default: found by joint names and rest pose]
    #[arg(long, value_name = "FILE")]
    pub map: Option<PathBuf>,
    /// Weight of one slot of the joint map, as a multiple of its default weight, e.g. `head=3`; can be repeated
    #[arg(long, value_name = "SLOT=X", value_parser = slot_weight)]
    pub weight: Vec<(Slot, f64)>,
}

impl RetargetArgs {
    /// Refuses retarget options for a `file` that is past retargeting.
    pub fn refuse_for(&self, file: &Path, kind: &str) -> Outcome {
        if self.skeleton.is_none() && self.map.is_none() && self.weight.is_empty() {
            return Ok(());
        }
        let cause = format!(
            "this is {kind} already, and `--skeleton`, `--map` and `--weight` apply to clips"
        );
        Err(Failure::input(file, cause).with_remedy("give the clip, or leave the options out"))
    }

    /// What tells a result for this character from one for another; that of the usual one is `name` alone.
    pub fn detail(&self, name: &str) -> String {
        match self.skeleton.as_deref() {
            None | Some("humanoid") => name.to_owned(),
            Some(other) => format!("{name} on {other}"),
        }
    }

    /// The physics character that was asked for.
    pub fn skeleton(&self) -> Outcome<Skeleton> {
        let name = self.skeleton.as_deref().unwrap_or("humanoid");
        Ok(Skeleton::load(name)?)
    }
}

/// A number above zero.
pub fn positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "not a number".to_string())?;
    if number.is_finite() && number > 0.0 {
        Ok(number)
    } else {
        Err("must be greater than 0".into())
    }
}

/// Frames per second, up to what a clip may have.
fn frame_rate(text: &str) -> Result<f64, String> {
    match positive(text)? {
        rate if (LEAST_FPS..=MOST_FPS).contains(&rate) => Ok(rate),
        _ => Err(format!("must be from {LEAST_FPS} to {MOST_FPS}")),
    }
}

/// A slot of the joint map with a number, as `head=3`.
fn slot_weight(text: &str) -> Result<(Slot, f64), String> {
    let known = Slot::ALL.map(Slot::name);
    let unknown = |name: &str| match did_you_mean(name, known) {
        Some(question) => format!("there is no slot `{name}`; {question}"),
        None => format!(
            "there is no slot `{name}`; the slots are {}",
            known.join(", ")
        ),
    };
    let (name, weight) = text
        .split_once('=')
        .ok_or("give a slot and its weight, e.g. head=3")?;
    let slot = Slot::ALL.into_iter().find(|slot| slot.name() == name);
    let slot = slot.ok_or_else(|| unknown(&plain(name)))?;
    let weight = weight.parse().map_err(|_| "the weight is not a number")?;
    Ok((slot, weight))
}

/// Most of anything that is counted on the command line, and most threads. Chosen: far above any use; a system that is asked
/// for 100,000 threads stands still.
const MOST: usize = 1_000_000;
pub const MOST_THREADS: usize = 1024;

/// A whole number from 1.
pub fn at_least_one(text: &str) -> Result<usize, String> {
    from_one_to(MOST, text)
}

/// A number of threads.
pub fn threads(text: &str) -> Result<usize, String> {
    from_one_to(MOST_THREADS, text)
}

fn from_one_to(most: usize, text: &str) -> Result<usize, String> {
    let number = usize::try_from(whole(text)?).unwrap_or(usize::MAX);
    match (1..=most).contains(&number) {
        true => Ok(number),
        false => Err(format!("must be from 1 to {most}")),
    }
}

/// A whole number from 0.
pub fn whole(text: &str) -> Result<u64, String> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let is_whole = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
    match text.parse() {
        Ok(number) => Ok(number),
        Err(_) if !is_whole => Err("not a whole number".into()),
        Err(_) if text.starts_with('-') => Err("must not be negative".into()),
        Err(_) => Err(format!("must be at most {}", u64::MAX)),
    }
}

/// Most samples that a training can be told to learn from. Chosen: at ten thousand a second they take three thousand years.
const MOST_SAMPLES: f64 = 1e15;

/// A number of samples, with k for thousands and M for millions.
pub fn samples(text: &str) -> Result<u64, String> {
    let wrong = || "give a whole number, with k for thousands or M for millions, e.g. 800k or 2.5M";
    let (number, factor) = match text.strip_suffix(['k', 'K']) {
        Some(number) => (number, 1e3),
        None => match text.strip_suffix(['m', 'M']) {
            Some(number) => (number, 1e6),
            None => (text, 1.0),
        },
    };
    // Rust would take "inf" and "nan" for numbers as well.
    let digits = number.trim_start_matches(['+', '-']);
    let is_number = digits.starts_with(|c: char| c == '.' || c.is_ascii_digit());
    let value: f64 = number
        .parse()
        .ok()
        .filter(|_| is_number)
        .ok_or_else(wrong)?;
    // Of 0.0011M, which is 1100, the product may be off by a rounding.
    let (value, exact) = ((value * factor).round(), value * factor);
    if exact < 1.0 {
        Err("must be at least 1".into())
    } else if value > MOST_SAMPLES {
        Err("must be at most 1e15".into())
    } else if (value - exact).abs() > 1e-9 * exact {
        Err(format!("{text} is not a whole number of samples"))
    } else {
        Ok(value as u64)
    }
}

/// `A..B`, `A..` or `..B`, in seconds.
pub fn span(text: &str) -> Result<(f64, f64), String> {
    let seconds = |text: &str, open: f64| match text.trim().trim_end_matches('s') {
        "" => Ok(open),
        text => text
            .parse()
            .map_err(|_| format!("`{text}` is not a number of seconds")),
    };
    let (from, to) = text
        .split_once("..")
        .ok_or("give seconds as A..B, e.g. 0.5..2")?;
    let (from, to) = (seconds(from, 0.0)?, seconds(to, f64::INFINITY)?);
    if from < 0.0 {
        Err(format!("`{from}` is before the start"))
    } else if from < to {
        Ok((from, to))
    } else {
        Err("the end must come after the start".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_have_units_and_are_whole() {
        for (text, number) in [
            ("4096", 4096),
            ("800k", 800_000),
            ("2.5M", 2_500_000),
            ("1e6", 1_000_000),
            ("0.0011M", 1100),
            ("1e15", 1_000_000_000_000_000),
        ] {
            assert_eq!(samples(text), Ok(number), "{text}");
        }
        for (text, reason) in [
            ("0", "at least 1"),
            ("-5", "at least 1"),
            ("0.5", "at least 1"),
            ("1e30", "at most"),
            ("1e999", "at most"),
            ("1.5", "not a whole number"),
            ("0.0015k", "not a whole number"),
            ("5kM", "e.g. 800k"),
            ("M", "e.g. 800k"),
            ("", "e.g. 800k"),
            ("nan", "e.g. 800k"),
            ("inf", "e.g. 800k"),
            ("-inf", "e.g. 800k"),
            ("-nan", "e.g. 800k"),
            ("many", "e.g. 800k"),
        ] {
            let said = samples(text).expect_err(text);
            assert!(said.contains(reason), "{text}: {said}");
        }
    }

    #[test]
    fn counts_are_bounded() {
        assert_eq!(threads("2"), Ok(2));
        assert_eq!(at_least_one("1000000"), Ok(1_000_000));
        for wrong in ["0", "1025", "100000", "18446744073709551615"] {
            let said = threads(wrong);
            assert_eq!(said, Err("must be from 1 to 1024".to_owned()), "{wrong}");
        }
    }

    #[test]
    fn whole_numbers_say_what_is_wrong_with_others() {
        assert_eq!(whole("18446744073709551615"), Ok(u64::MAX));
        for (text, reason) in [
            ("-1", "must not be negative"),
            ("18446744073709551616", "must be at most"),
            ("1.5", "not a whole number"),
            ("", "not a whole number"),
            ("-", "not a whole number"),
            ("x", "not a whole number"),
        ] {
            let said = whole(text).expect_err(text);
            assert!(said.contains(reason), "{text}: {said}");
        }
        assert_eq!(
            at_least_one("0"),
            Err("must be from 1 to 1000000".to_owned())
        );
    }

    #[test]
    fn spans_may_be_open() {
        assert_eq!(span("0.5..2"), Ok((0.5, 2.0)));
        assert_eq!(span("1.."), Ok((1.0, f64::INFINITY)));
        assert_eq!(span("..2s"), Ok((0.0, 2.0)));
        assert!(span("2..1").is_err() && span("nan..1").is_err() && span("1").is_err());
    }
}
