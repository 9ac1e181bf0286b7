//! Why a task can't be set up or do what it is asked for.

use crate::explain::{Explain, Explanation, Parameter, explained};
use crate::motion::MotionError;
use crate::schema::OutOfRange;
use crate::sim::SimError;

/// Why a task can't be set up or do what it is asked for.
#[derive(Debug)]
#[non_exhaustive]
pub enum TaskError {
    /// A character that can't be simulated.
    Sim(SimError),
    /// A motion that can't be used.
    Motion(MotionError),
    /// A setting out of its range.
    Setting(OutOfRange),
    /// A weight for a reward term that the kernels don't have.
    NoSuchTerm {
        /// Name of the term.
        term: &'static str,
        /// Name of the kernels.
        kernels: String,
    },
    /// A character whose size can't be told.
    NoLegs {
        /// Its name.
        skeleton: String,
        /// Height of the hips above the sole, metres.
        leg: f64,
    },
    /// A motion of too few frames.
    TooShort {
        /// How many it has.
        frames: usize,
    },
    /// A motion that lasts too long.
    TooLong {
        /// Its name.
        motion: String,
        /// How long it lasts, seconds.
        seconds: f64,
        /// How long it may last, seconds.
        most: f64,
    },
    /// Motions that one policy can't learn together.
    OtherContacts {
        /// Name of the first motion.
        first: String,
        /// Name of the motion that differs.
        other: String,
    },
    /// No motion at all.
    NoMotion,
    /// A wish for a character that performs motions.
    NotSteered,
    /// No motion in which a steered character could stand.
    NoStanding,
    /// No motion with which a steered character could walk.
    NoGait,
    /// A case that the task doesn't have.
    NoSuchCase {
        /// Its number, from 0.
        number: usize,
        /// How many there are.
        cases: usize,
    },
}

impl TaskError {
    /// Whether a setting is at fault.
    pub fn is_setting(&self) -> bool {
        matches!(self, Self::Setting(_) | Self::NoSuchTerm { .. })
    }
}

impl From<SimError> for TaskError {
    fn from(error: SimError) -> Self {
        Self::Sim(error)
    }
}

impl From<OutOfRange> for TaskError {
    fn from(error: OutOfRange) -> Self {
        Self::Setting(error)
    }
}

impl From<MotionError> for TaskError {
    fn from(error: MotionError) -> Self {
        Self::Motion(error)
    }
}

impl Explain for TaskError {
    fn explain(&self) -> Explanation {
        match self {
            Self::Sim(error) => error.explain(),
            Self::Motion(error) => error.explain(),
            Self::Setting(error) => error.explain(),
            Self::NoSuchTerm { term, kernels } => Explanation::input(format!(
                "the reward term `{term}` has a weight, but the {kernels} kernels have no such term"
            ))
            .remedy("set its weight to 0"),
            Self::NoLegs { skeleton, leg } => Explanation::input(format!(
                "skeleton `{skeleton}` is {leg} m tall from hips to sole, so its size can't be judged"
            ))
            .remedy("give it slots for hips and legs"),
            Self::TooShort { frames } => {
                let frame = if *frames == 1 { "frame" } else { "frames" };
                Explanation::input(format!("the motion has {frames} {frame}"))
                    .remedy("give a motion of at least two frames")
            }
            Self::TooLong {
                motion,
                seconds,
                most,
            } => Explanation::input(format!(
                "motion `{motion}` lasts {seconds:.0} s, and one of at most {most:.0} s can be learned and evaluated"
            ))
            .remedy_by(Parameter::Trim, "give a part of its clip"),
            Self::OtherContacts { first, other } => Explanation::input(format!(
                "motions `{first}` and `{other}` put different bodies on the ground, and one policy sees one set of contacts"
            ))
            .remedy("train them apart"),
            Self::NoMotion => Explanation::input("there is no motion to learn")
                .remedy("give at least one motion"),
            Self::NotSteered => Explanation::input("a character that performs motions can't be steered")
                .remedy("train one with `--task steer`"),
            Self::NoStanding => Explanation::input("no motion stands still, so the character couldn't stop")
                .remedy("add a motion that stands, such as an idle"),
            Self::NoGait => Explanation::input(
                "no motion walks on and on, so the character couldn't go anywhere",
            )
            .remedy("add a walk or a run that repeats"),
            Self::NoSuchCase { number, cases } => {
                Explanation::input(format!("there is no motion number {number}"))
                    .remedy(format!("give a number from 0 to {}", cases.saturating_sub(1)))
            }
        }
    }
}

explained!(TaskError);
