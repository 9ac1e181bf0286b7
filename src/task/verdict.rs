//! Whether an agent has learned its task, in the words of the task.

use super::episode::Measure;

/// What a [`Task`](super::Task) judges by: the undisturbed episodes of one of its cases.
#[derive(Clone, Copy, Debug)]
pub struct Performance<'a> {
    /// How many episodes were performed, from starts spread evenly over all.
    pub episodes: usize,
    /// What was measured over all of them, or over those within reach where that is good enough.
    pub measures: &'a [Measure],
    /// The starts of those that failed, as shares of all possible starts.
    pub failed: &'a [f64],
    /// The starts that are beyond reach, likewise.
    pub beyond_reach: &'a [f64],
}

impl Performance<'_> {
    /// The measure of this name.
    pub fn measure(&self, name: &str) -> Option<&Measure> {
        self.measures.iter().find(|measure| measure.name == name)
    }
}

/// Whether an agent has learned a case of its task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Verdict {
    /// Whether it has.
    pub learned: bool,
    /// The same in words, which say what it does wrong. A part of a sentence, in small letters and without a full stop.
    pub text: String,
}

impl Verdict {
    /// That it has been learned.
    pub fn learned(text: impl Into<String>) -> Self {
        Self {
            learned: true,
            text: text.into(),
        }
    }

    /// That it hasn't.
    pub fn not_yet(text: impl Into<String>) -> Self {
        Self {
            learned: false,
            text: text.into(),
        }
    }
}
