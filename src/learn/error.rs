//! Why learning can't begin or go on.

use crate::explain::{Explain, Explanation, explained};
use crate::schema::OutOfRange;

/// Why learning can't begin or go on.
#[derive(Clone, Debug, PartialEq)]
pub enum LearnError {
    /// Something of the wrong length.
    Length {
        /// What it is.
        what: String,
        /// Its length.
        found: usize,
        /// The length that is needed.
        expected: usize,
    },
    /// A setting out of its range.
    Setting(OutOfRange),
    /// An observation that isn't a number.
    Observation {
        /// Which number of the observation.
        column: usize,
    },
    /// An action that isn't a number.
    Action {
        /// Which number of the action.
        column: usize,
    },
    /// A return or an advantage that isn't a number.
    NotFinite {
        /// What it is.
        what: &'static str,
        /// Which sample of the batch.
        sample: usize,
    },
    /// A gradient that isn't a number.
    Diverged {
        /// Pass over the batch, from 0.
        epoch: usize,
        /// Part of the batch, from 0.
        minibatch: usize,
    },
    /// A saved state of another network.
    Network {
        /// The network that was saved.
        found: String,
        /// The network that goes on.
        expected: String,
    },
}

impl Explain for LearnError {
    fn explain(&self) -> Explanation {
        match self {
            Self::Length {
                what,
                found,
                expected,
            } => Explanation::input(format!(
                "{what} has {found} values where {expected} are needed"
            ))
            .remedy("use files of one and the same run"),
            Self::Setting(error) => error.explain(),
            Self::Observation { column } => {
                Explanation::work(format!("observation {column} is not finite"))
                    .remedy("look for a simulation that diverged or a division by zero")
            }
            Self::Action { column } => {
                Explanation::work(format!("action {column} of the policy is not finite"))
                    .remedy("train the policy again")
            }
            Self::NotFinite { what, sample } => {
                Explanation::work(format!("{what} are not finite at sample {sample}"))
                    .remedy("look for a simulation that diverged")
            }
            Self::Diverged { epoch, minibatch } => Explanation::work(format!(
                "the gradient is not finite in epoch {epoch}, minibatch {minibatch}"
            ))
            .remedy(
                "lower the learning rate, or look for rewards and observations that are not finite",
            ),
            Self::Network { found, expected } => Explanation::input(format!(
                "the saved state is for a network {found}; this one is {expected}"
            ))
            .remedy("train into a new folder, or use the saved configuration"),
        }
    }
}

explained!(LearnError);

impl From<OutOfRange> for LearnError {
    fn from(error: OutOfRange) -> Self {
        Self::Setting(error)
    }
}

/// Checks that `what` has as many values as are needed.
///
/// # Errors
/// [`LearnError::Length`] where it hasn't.
pub(crate) fn check_length(what: &str, found: usize, expected: usize) -> Result<(), LearnError> {
    if found == expected {
        return Ok(());
    }
    Err(LearnError::Length {
        what: what.to_owned(),
        found,
        expected,
    })
}
