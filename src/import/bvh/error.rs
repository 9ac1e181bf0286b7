//! What can be wrong with a BVH file.

use crate::explain::{Explain, Explanation, explained};

/// Why a BVH file couldn't be read. Lines are counted from 1.
#[derive(Debug)]
pub(crate) enum BvhError {
    /// The file ends before this.
    Missing { line: usize, what: &'static str },
    /// A word where another one should be.
    Unexpected {
        line: usize,
        found: String,
        expected: &'static str,
    },
    /// A channel with an unknown name.
    Channel { line: usize, found: String },
    /// More joints than are read.
    TooMany { line: usize, most: usize },
    /// A joint whose block has no end.
    Unclosed { line: usize, joint: String },
    /// A row of numbers that isn't a frame.
    Row {
        line: usize,
        found: usize,
        width: usize,
    },
    /// A hierarchy in which nothing can move.
    NoChannels,
    /// A hierarchy without motion.
    NoFrames,
}

explained!(BvhError);

impl Explain for BvhError {
    fn explain(&self) -> Explanation {
        let wrong = |cause: &str| Explanation::input(cause).remedy("write the file again");
        let at = |line, cause: String| Explanation::input(cause).place(format!("line {line}"));
        match self {
            Self::Missing { line, what } => {
                at(line, format!("{what} is missing")).remedy("write the file again")
            }
            Self::Unexpected {
                line,
                found,
                expected,
            } => {
                at(line, format!("`{found}` where {expected} should be")).remedy("repair that line")
            }
            Self::Channel { line, found } => at(line, format!("`{found}` is not a channel"))
                .remedy("use Xposition to Zposition and Xrotation to Zrotation"),
            Self::TooMany { line, most } => {
                at(line, format!("more than {most} joints")).remedy("split the file")
            }
            Self::Unclosed { line, joint } => at(
                line,
                format!("the block of joint `{joint}` is still open here"),
            )
            .remedy("add the missing `}`"),
            Self::Row { line, found, width } => at(
                line,
                format!(
                    "this row has {found} numbers, and the channels of the joints need {width}"
                ),
            )
            .remedy("repair that line, or the channels, or write the file again"),
            Self::NoChannels => wrong("the hierarchy has no channels, so nothing can move"),
            Self::NoFrames => wrong("no frames follow the hierarchy"),
        }
    }
}
