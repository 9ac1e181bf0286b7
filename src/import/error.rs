//! What can go wrong between a file and a clip.

use crate::clip::{self, LEAST_FPS, MOST_FPS, MOST_SECONDS};
use crate::explain::{Explain, Explanation, Parameter, explained};
use crate::file::unread;
use crate::humanoid;
use std::path::PathBuf;

/// Why a file couldn't become a clip.
#[derive(Debug)]
pub struct Error {
    /// The file that was to be imported.
    pub file: PathBuf,
    /// What is wrong with it.
    pub kind: ErrorKind,
}

/// What can be wrong with an animation file, or with what was asked of it.
#[derive(Debug)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The file can't be read.
    Read {
        /// What the system says.
        source: std::io::Error,
    },
    /// The file has no format that can be read, or breaks its format, or the take that was asked for does. The
    /// explanation says where and what to do; it names a file of its own where a file beside the imported one is at fault.
    Malformed(Box<Explanation>),
    /// The file has no animation.
    NoTakes(NoTakes),
    /// The file has no joints.
    NoJoints,
    /// No take has the name or number that was asked for.
    UnknownTake {
        /// What was asked for.
        wanted: String,
        /// How many takes the file has.
        count: usize,
        /// The takes of the file to choose from, with their numbers, at most eight of them.
        takes: String,
        /// The take that was probably meant.
        meant: Option<String>,
    },
    /// A part of the take without a frame in it.
    EmptyTrim {
        /// Name of the take.
        take: String,
        /// Start of the part, seconds from the take's start.
        from: f64,
        /// End of the part, seconds.
        to: f64,
        /// Length of the take, seconds.
        duration: f64,
    },
    /// A frame rate that can't be sampled.
    Rate {
        /// Frames per second.
        fps: f64,
    },
    /// A part that lasts longer than a clip may.
    Lasting {
        /// Name of the take.
        take: String,
        /// Its length.
        seconds: f64,
    },
    /// A unit of length that isn't a positive number.
    Unit {
        /// Metres per unit.
        unit_m: f64,
    },
    /// More frames than a file of this size may be sampled to.
    TooLong {
        /// Name of the take.
        take: String,
        /// How many frames it would have.
        frames: f64,
        /// How many nodes would be placed at each of them.
        nodes: usize,
    },
    /// A joint whose place isn't finite, or is farther away than any motion goes.
    NotFinite {
        /// Name of the joint.
        joint: String,
        /// Seconds in the take; `None` at rest.
        time: Option<f64>,
    },
    /// A figure to be mirrored of which left and right aren't known.
    NoSides {
        /// Why they aren't.
        source: humanoid::Error,
    },
    /// A figure that can't be mirrored.
    Mirror {
        /// Why it can't.
        source: clip::Error,
    },
}

/// What a file without takes holds instead, and what to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoTakes {
    /// Goes on from "the file".
    pub(crate) cause: &'static str,
    pub(crate) remedy: &'static str,
}

explained!(Error);

impl Explain for Error {
    fn explain(&self) -> Explanation {
        let explanation = self.kind.explain();
        match explanation.file {
            Some(_) => explanation,
            None => explanation.file(&self.file),
        }
    }
}

/// The error of a format's reader, as one of the importer's.
pub(super) fn malformed(error: impl Explain) -> ErrorKind {
    ErrorKind::Malformed(Box::new(error.explain()))
}

impl ErrorKind {
    fn explain(&self) -> Explanation {
        let wrong = |cause: String| Explanation::input(cause);
        let in_take = |take: &str, cause| wrong(cause).place(format!("take `{take}`"));
        match self {
            Self::Read { source } => unread(source),
            Self::Malformed(explanation) => (**explanation).clone(),
            Self::NoTakes(NoTakes { cause, remedy }) => {
                wrong(format!("the file {cause}")).remedy(remedy)
            }
            Self::NoJoints => {
                wrong("the file holds no joints".to_owned()).remedy("export it with its skeleton")
            }
            Self::UnknownTake {
                wanted,
                count,
                takes,
                meant,
            } => wrong(no_take(wanted, *count)).remedy_by(
                Parameter::Take,
                match meant {
                    Some(meant) => format!("did you mean `{meant}`? choose {takes}"),
                    None => format!("choose {takes}"),
                },
            ),
            Self::EmptyTrim {
                take,
                from,
                to,
                duration,
            } => in_take(
                take,
                format!("the part from {from} s to {to} s is empty: the take lasts {duration} s"),
            )
            .remedy_by(Parameter::Trim, "choose a part within the take"),
            Self::Rate { fps } => {
                wrong(format!("{fps} frames per second is not a usable frame rate"))
                    .remedy_by(
                        Parameter::FrameRate,
                        format!("give a number from {LEAST_FPS} to {MOST_FPS}"),
                    )
            }
            Self::Lasting { take, seconds } => in_take(
                take,
                format!("it lasts {seconds:.0} s, and a clip lasts at most {MOST_SECONDS} s"),
            )
            .remedy_by(Parameter::Trim, "keep a part of it"),
            Self::Unit { unit_m } => wrong(format!("{unit_m} m is not a usable unit of length"))
                .remedy_by(Parameter::Unit, "give a number of metres from 1e-9 to 1e6"),
            Self::TooLong {
                take,
                frames,
                nodes,
            } => in_take(
                take,
                format!("it would have {frames} frames of {nodes} nodes, too many for a file of this size"),
            )
            .remedy_by(
                Parameter::Trim,
                "keep a part of it, or lower the frame rate",
            ),
            Self::NotFinite { joint, time } => {
                let place = match time {
                    Some(time) => format!("joint `{joint}` at {time:.3} s"),
                    None => format!("joint `{joint}` at rest"),
                };
                wrong("its position is not finite, or too large to use".to_owned())
                    .place(place)
                    .remedy_by(
                        Parameter::Unit,
                        "check the unit of length, or repair its keys in the tool that wrote the file",
                    )
            }
            Self::NoSides { source } => wrong(format!(
                "it can't be mirrored, because left and right aren't known: {}",
                source.explain().cause
            ))
            .remedy_by(
                Parameter::JointMap,
                "import it as it is, then mirror the clip with a joint map",
            ),
            Self::Mirror { source } => source.explain(),
        }
    }
}

/// That a take isn't there: by its number, if it is one, or by its name.
fn no_take(wanted: &str, count: usize) -> String {
    let is_number = !wanted.is_empty() && wanted.bytes().all(|b| b.is_ascii_digit());
    let takes = if count == 1 { "take" } else { "takes" };
    match is_number {
        true => format!("there is no take number {wanted}: the file has {count} {takes}"),
        false => format!("no take is called `{wanted}`"),
    }
}
