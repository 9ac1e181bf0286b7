//! What an error tells: which file, where in it, what is wrong, and what to do.
//!
//! Every error type of the library implements [`Explain`]. Its message is its [`Explanation`], written in one line; whoever
//! shows errors in another way (as JSON, or with the name of the flag to change) takes the parts.

mod near;

pub use near::{did_you_mean, meant, meant_file, nearest};

use std::fmt;
use std::path::{Path, PathBuf};

/// An error that can tell its parts.
pub trait Explain: std::error::Error {
    /// The parts of the message.
    fn explain(&self) -> Explanation;
}

/// The parts of an error's message. Displayed, they make one line: `` `file`: place: cause; advice ``.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Explanation {
    /// Who can mend it.
    pub fault: Fault,
    /// The file at fault.
    pub file: Option<PathBuf>,
    /// Where in the file: a joint, a frame, a line, a byte, a field.
    pub place: Option<String>,
    /// What is wrong, without file, place and advice.
    pub cause: String,
    /// What to do about it.
    pub remedy: Option<Remedy>,
}

/// Who can mend an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The caller: a wrong file, or a value out of range.
    Input,
    /// Nobody beforehand: the input was right and the work failed, with a full disk for one.
    Work,
}

/// What to do about an error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remedy {
    /// In words, beginning with a verb.
    pub advice: String,
    /// The parameter to change, where there is one. A command line knows which flag sets it.
    pub parameter: Option<Parameter>,
}

/// What a caller can set, by the name that it has in the library's options.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Parameter {
    /// Which take of a file is imported.
    Take,
    /// Frames per second of a clip.
    FrameRate,
    /// The part of a take that is kept, seconds.
    Trim,
    /// Metres per unit of length of a file.
    Unit,
    /// The axis that points up in a file.
    UpAxis,
    /// Whether a clip repeats.
    LoopMode,
    /// Which joint is which slot of the humanoid.
    JointMap,
    /// How much a slot of the humanoid counts in retargeting.
    SlotWeight,
    /// The physics skeleton.
    Skeleton,
    /// How fast a clip is played.
    Speed,
    /// Where the result is written.
    Output,
}

/// Most characters that a part keeps of its start, and as many of its end.
const KEPT: usize = 300;

/// Whether a character is shown as nothing but itself: no control character, which could write to a terminal or end a
/// line, and none that turns the direction of what follows or hides in it, which could make a name look like another.
pub fn is_plain(c: char) -> bool {
    !c.is_control()
        && !matches!(c,
            // Marks, embeddings and isolates of directions; ends of lines and paragraphs; the mark of the byte order; tags.
            '\u{61c}' | '\u{200b}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}'
            | '\u{feff}' | '\u{e0000}'..='\u{e007f}')
}

/// A text on one line, whatever it is made of: what isn't [plain](is_plain) becomes a blank.
pub fn plain(text: &str) -> String {
    let shown = |c: char| if is_plain(c) { c } else { ' ' };
    text.chars().map(shown).collect()
}

/// A text on one line of bearable length. Names that a file holds find their way into messages, and nobody reads a name of
/// a megabyte. A long text loses its middle, because the start says what is wrong and the end often where.
pub fn one_line(text: &str) -> String {
    let letters: Vec<char> = plain(text.trim()).chars().collect();
    if letters.len() <= 2 * KEPT {
        return letters.into_iter().collect();
    }
    let (start, end) = (&letters[..KEPT], &letters[letters.len() - KEPT..]);
    start.iter().chain(&['…']).chain(end).collect()
}

impl Explanation {
    /// What a caller did wrong.
    pub fn input(cause: impl AsRef<str>) -> Self {
        Self {
            fault: Fault::Input,
            file: None,
            place: None,
            cause: one_line(cause.as_ref()),
            remedy: None,
        }
    }

    /// What failed although everything was right.
    pub fn work(cause: impl AsRef<str>) -> Self {
        Self {
            fault: Fault::Work,
            ..Self::input(cause)
        }
    }

    /// Names the file at fault.
    #[must_use]
    pub fn file(mut self, path: impl AsRef<Path>) -> Self {
        self.file = Some(path.as_ref().to_owned());
        self
    }

    /// Says where in the file.
    #[must_use]
    pub fn place(mut self, place: impl AsRef<str>) -> Self {
        self.place = Some(one_line(place.as_ref()));
        self
    }

    /// Says what to do; `advice` begins with a verb.
    #[must_use]
    pub fn remedy(mut self, advice: impl AsRef<str>) -> Self {
        self.remedy = Some(Remedy {
            advice: one_line(advice.as_ref()),
            parameter: None,
        });
        self
    }

    /// Says what to do, and which parameter to change for that.
    #[must_use]
    pub fn remedy_by(mut self, parameter: Parameter, advice: impl AsRef<str>) -> Self {
        self.remedy = Some(Remedy {
            advice: one_line(advice.as_ref()),
            parameter: Some(parameter),
        });
        self
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "`{}`: ", plain(&file.display().to_string()))?;
        }
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        f.write_str(&self.cause)?;
        match &self.remedy {
            Some(remedy) => write!(f, "; {}", remedy.advice),
            None => Ok(()),
        }
    }
}

/// Makes an error of a type that implements [`Explain`]: its message is its explanation.
macro_rules! explained {
    ($error:ty) => {
        impl std::fmt::Display for $error {
            fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                std::fmt::Display::fmt(&$crate::explain::Explain::explain(self), f)
            }
        }
        impl std::error::Error for $error {}
    };
}
pub(crate) use explained;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_has_its_parts_in_order() {
        let bare = Explanation::input("it is empty");
        assert_eq!(bare.to_string(), "it is empty");
        let whole = bare
            .file("kick.fbx")
            .place("take `Kick`")
            .remedy_by(Parameter::Take, "choose another take");
        assert_eq!(
            whole.to_string(),
            "`kick.fbx`: take `Kick`: it is empty; choose another take"
        );
    }

    #[test]
    fn names_can_not_turn_or_hide_what_is_shown() {
        let name = "a\u{202e}b\u{9b}31m\u{2028}c\u{7f}\0d\u{200f}e\u{e0041}";
        assert_eq!(plain(name), "a b 31m c  d e ");
        // Names in other scripts stay as they are, with joiners and combining marks.
        for name in ["قوس", "क्\u{200d}ष", "می\u{200c}شود", "e\u{301}", "⚽"] {
            assert_eq!(plain(name), name);
        }
        let file = Explanation::input("it is empty").file("a\n\u{1b}b.fbx");
        assert_eq!(file.to_string(), "`a  b.fbx`: it is empty");
    }

    #[test]
    fn messages_are_one_line_of_bearable_length() {
        let message = |name: &str| {
            let take = Explanation::input("it is broken").place(format!("take `{name}`"));
            take.remedy("export it again").to_string()
        };
        assert_eq!(
            message("a\r\nb\u{1b}[2J"),
            "take `a  b [2J`: it is broken; export it again"
        );
        let file = Explanation::input("it is broken").file("a\u{1b}[2J\n.fbx");
        assert_eq!(file.to_string(), "`a [2J .fbx`: it is broken");
        let long = message(&"ö".repeat(100_000));
        assert!(long.chars().count() < 1000, "{long}");
        assert!(
            long.ends_with("ö`: it is broken; export it again"),
            "{long}"
        );
    }
}
