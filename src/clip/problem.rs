//! Diagnostics: what was found in a file, or done to it, that its owner should know.

use crate::explain::{Parameter, one_line};
use serde::{Deserialize, Serialize};

/// How much a problem matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// A choice that was made for the user, or a fact worth knowing. The result is right if the choice is.
    Note,
    /// The result may be wrong, or lack something.
    Warning,
    /// A part of the input can't be used.
    Error,
}

/// Something found in a file that its owner should know. It is kept with the clip, in its file too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Problem {
    /// Stable identifier in kebab-case, e.g. `turned-to-forward`. Scripts may rely on it.
    pub id: String,
    /// How much it matters.
    pub severity: Severity,
    /// What was found and what to do about it, in one line.
    pub message: String,
}

impl Problem {
    /// A note with this stable identifier. Control characters, which names from a file may bring, become blanks.
    pub fn note(id: &str, message: impl AsRef<str>) -> Self {
        Self::new(id, Severity::Note, message.as_ref())
    }

    /// A warning, made like a [`note`](Self::note).
    pub fn warning(id: &str, message: impl AsRef<str>) -> Self {
        Self::new(id, Severity::Warning, message.as_ref())
    }

    /// An error, made like a [`note`](Self::note).
    pub fn error(id: &str, message: impl AsRef<str>) -> Self {
        Self::new(id, Severity::Error, message.as_ref())
    }

    /// The warning about a part that was to be kept to `to` seconds of what lasts `duration` seconds, where that costs a frame.
    pub(crate) fn shortened(to: f64, duration: f64, fps: f64) -> Option<Self> {
        let is_shorter = to.is_finite() && (to - duration) * fps > 0.5;
        let end = (1e3 * duration).round() / 1e3;
        is_shorter.then(|| {
            Self::warning(
                "part-shortened",
                format!("the part to keep ends at {end} s and not at {to} s, because nothing comes after that"),
            )
        })
    }

    fn new(id: &str, severity: Severity, message: &str) -> Self {
        Self {
            id: id.to_owned(),
            severity,
            message: one_line(message),
        }
    }

    /// The parameter that decides otherwise, for problems that are guesses or choices: a command line knows which flag
    /// sets it. It follows from the identifier, so problems that were read from a file have one too.
    pub fn parameter(&self) -> Option<Parameter> {
        Some(match self.id.as_str() {
            "several-takes" | "still-take" => Parameter::Take,
            "first-frame-left-out" | "cycle-gap" | "part-shortened" => Parameter::Trim,
            "unit-guessed" | "invalid-unit" => Parameter::Unit,
            "up-axis-corrected" => Parameter::UpAxis,
            "unknown-loop-word" | "loop-gap" => Parameter::LoopMode,
            "map-uncertain" | "not-humanoid" => Parameter::JointMap,
            _ => return None,
        })
    }
}
