//! The field's metrics on a trained agent: how long it survives, how near it stays, how its feet stand.

mod episode;
mod metrics;
#[cfg(test)]
mod tests;

pub use episode::{Frame, Opening, Start, Trace, play, play_sequence};
pub use metrics::{Digest, Evaluation, Failed, measure};

use crate::learn::{LearnError, Performer};
use crate::sim::LANES;
use crate::task::Perturbations;
use rayon::prelude::*;

/// What to evaluate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Start phases, evenly spread from the first frame on.
    pub episodes: usize,
    /// Length of an episode of a wrapping motion, seconds; an ending motion is played to its end.
    pub seconds: f64,
    /// Play the same phases a second time, disturbed like this; the number of the phase says how.
    pub perturbations: Option<Perturbations>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            episodes: 32,
            seconds: 20.0,
            perturbations: None,
        }
    }
}

/// Plays deterministic episodes from evenly spread phases of reference number `which`, and one from rest, and measures
/// them.
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
    let count = options.episodes.max(1);
    let phases = (0..count).map(|n| (Start::At(n as f64 / count as f64), None));
    let rest = (Start::Rest, None);
    let disturbed = options.perturbations.into_iter().flat_map(|ranges| {
        (0..count).map(move |n| (Start::At(n as f64 / count as f64), Some((ranges, n as u64))))
    });
    let all: Vec<Opening> = phases.chain([rest]).chain(disturbed).collect();
    let traces: Result<Vec<Vec<Trace>>, LearnError> = all
        .par_chunks(LANES)
        .map(|openings| play(performer, which, openings, options.seconds))
        .collect();
    let traces = traces?.concat();
    let (undisturbed, disturbed) = traces.split_at(count + 1);
    let stage = performer.stage();
    let digest = |traces: &[Trace]| Digest::from(measure(stage, traces));
    Ok(Evaluation {
        from_rest: Some(digest(&undisturbed[count..])),
        perturbed: (!disturbed.is_empty()).then(|| digest(disturbed)),
        ..measure(stage, &undisturbed[..count])
    })
}
