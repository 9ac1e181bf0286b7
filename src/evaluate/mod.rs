//! The field's metrics on a trained agent: how long it survives, how near it stays, how its feet stand.

mod episode;
mod metrics;
#[cfg(test)]
mod tests;

pub use episode::{Frame, Trace, play};
pub use metrics::{Evaluation, measure};

use crate::learn::{LearnError, Performer};
use rayon::prelude::*;

/// What to evaluate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Start phases, evenly spread from the first frame on.
    pub episodes: usize,
    /// Length of an episode of a wrapping motion, seconds; an ending motion is played to its end.
    pub seconds: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            episodes: 16,
            seconds: 20.0,
        }
    }
}

/// Plays deterministic episodes from evenly spread phases of reference number `which` and measures them.
///
/// Episodes are played in parallel and gathered in order.
///
/// # Errors
/// A task of another shape than the policy's.
pub fn evaluate(
    performer: &Performer,
    which: usize,
    options: &Options,
) -> Result<Evaluation, LearnError> {
    let traces: Result<Vec<Trace>, LearnError> = (0..options.episodes.max(1))
        .into_par_iter()
        .map(|n| {
            play(
                performer,
                which,
                n as f64 / options.episodes.max(1) as f64,
                options.seconds,
            )
        })
        .collect();
    Ok(measure(performer.stage(), &traces?))
}
