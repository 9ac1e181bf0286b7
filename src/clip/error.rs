//! What can go wrong with a clip and its file.

use super::sampling::{LEAST_FPS, MOST_FPS, MOST_SECONDS};
use crate::explain::{Explain, Explanation, Parameter, explained};
use crate::file::FileError;

/// Why a clip couldn't be read, written or edited.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// The clip's file can't be written, read or used.
    File(FileError),
    /// A frame rate that can't be sampled.
    Rate {
        /// Frames per second.
        fps: f64,
    },
    /// A part of the clip without a frame in it.
    EmptyTrim {
        /// Start of the part, seconds from the clip's start.
        from: f64,
        /// End of the part, seconds.
        to: f64,
        /// Length of the clip, seconds.
        duration: f64,
    },
    /// More frames × joints than a clip may have.
    TooLong {
        /// Length of the result, seconds.
        duration: f64,
        /// Frames per second of the result.
        fps: f64,
    },
    /// A result that lasts longer than a clip may.
    TooSlow {
        /// Length of the result, seconds.
        duration: f64,
    },
    /// A playback speed that isn't a positive number.
    Speed {
        /// How many times as fast.
        factor: f64,
    },
    /// Another number that is out of range.
    Number {
        /// What it stands for, with its article: `a blend`.
        what: &'static str,
        /// The number.
        value: f64,
        /// The range, in words.
        wanted: &'static str,
    },
    /// A clip that was made by hand and contradicts itself.
    Unusable {
        /// Name of the clip.
        name: String,
        /// What contradicts what.
        reason: &'static str,
    },
    /// Points of a time-warp that don't rise, or lie beyond the clip.
    Warp {
        /// Time in the clip, seconds.
        from: f64,
        /// Time in the result, seconds.
        to: f64,
        /// Length of the clip, seconds.
        duration: f64,
    },
    /// Pairs of left and right joints that a mirror can't swap.
    Pair {
        /// Index of the left joint.
        left: usize,
        /// Index of the right joint.
        right: usize,
        /// Joints of the clip.
        joints: usize,
    },
    /// A join of no clips.
    NoClips,
    /// A join of clips of different figures.
    OtherJoints {
        /// Name of the clip that doesn't fit.
        name: String,
        /// Name of the first clip.
        first: String,
        /// How their joints differ.
        reason: String,
    },
    /// A clip shorter than the shortest cycle asked for.
    TooShortForCycle {
        /// The shortest cycle, seconds.
        shortest: f64,
        /// Length of the clip, seconds.
        duration: f64,
    },
    /// A clip in which nothing comes back to where it was.
    NoCycle {
        /// The shortest cycle, seconds.
        shortest: f64,
        /// Length of the clip, seconds.
        duration: f64,
    },
}

explained!(Error);

impl From<FileError> for Error {
    fn from(error: FileError) -> Self {
        Self::File(error)
    }
}

impl Explain for Error {
    fn explain(&self) -> Explanation {
        let wrong = |cause: String| Explanation::input(cause);
        match self {
            Self::File(error) => error.explain(),
            Self::Rate { fps } => {
                wrong(format!("{fps} frames per second is not a usable frame rate"))
                    .remedy_by(
                        Parameter::FrameRate,
                        format!("give a number from {LEAST_FPS} to {MOST_FPS}"),
                    )
            }
            Self::TooSlow { duration } => wrong(format!(
                "the result would last {duration:.0} s, and a clip lasts at most {MOST_SECONDS} s"
            ))
            .remedy("make it shorter or faster"),
            Self::EmptyTrim { from, to, duration } => wrong(format!(
                "the part from {from} s to {to:.3} s is empty: the clip lasts {duration:.3} s"
            ))
            .remedy_by(Parameter::Trim, "choose a part within the clip"),
            Self::TooLong { duration, fps } => wrong(format!(
                "{duration:.3} s at {fps} Hz would take more than 20 million joint transforms"
            ))
            .remedy_by(
                Parameter::FrameRate,
                "lower its frame rate or make it shorter",
            ),
            Self::Speed { factor } => wrong(format!("a speed of {factor} can't be used"))
                .remedy_by(Parameter::Speed, "give a factor of 0.000001 or more"),
            Self::Number {
                what,
                value,
                wanted,
            } => wrong(format!("{what} of {value} can't be used")).remedy(format!("give {wanted}")),
            Self::Unusable { name, reason } => wrong((*reason).to_owned())
                .place(format!("clip `{name}`"))
                .remedy("import it again"),
            Self::Warp { from, to, duration } => wrong(format!(
                "the time-warp point {from}:{to} doesn't fit the clip of {duration:.3} s"
            ))
            .remedy(
                "let both times rise from point to point by a microsecond or more, starting above 0, and keep the first within the clip",
            ),
            Self::Pair {
                left,
                right,
                joints,
            } => wrong(format!(
                "a mirror can't swap joints {left} and {right} of {joints}"
            ))
            .remedy("pair every joint once"),
            Self::NoClips => wrong("no clips to join".to_owned()).remedy("give at least one"),
            Self::OtherJoints {
                name,
                first,
                reason,
            } => wrong(format!("clip `{name}` can't follow clip `{first}`: {reason}"))
                .remedy("join clips of one figure"),
            Self::TooShortForCycle { shortest, duration } => wrong(format!(
                "no cycle of {shortest} s or more fits into {duration:.3} s"
            ))
            .remedy("allow shorter cycles"),
            Self::NoCycle { shortest, duration } => wrong(format!(
                "no cycle of {shortest} s or more in {duration:.3} s: nothing moves and comes back"
            ))
            .remedy("choose another part"),
        }
    }
}
