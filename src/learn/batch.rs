//! What an update reads: a batch of experience, and how it is cut into minibatches and shards.

use super::error::{LearnError, check_length};
use super::kernels::Scalar;
use super::policy::Policy;
use crate::schema::OutOfRange;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;

/// What a rollout gives to learn from: `samples` rows each.
#[derive(Clone, Copy, Debug)]
pub struct Batch<'a, T> {
    /// `[samples, observation]`, normalised as they were acted on.
    pub observations: &'a [T],
    /// `[samples, action]`: what was done, noise included.
    pub actions: &'a [T],
    /// `[samples]`: log-probability of the actions when they were taken.
    pub log_probs: &'a [T],
    /// `[samples]`: what the critic expected.
    pub values: &'a [T],
    /// `[samples]`: by how much the actions did better than the critic expected.
    pub advantages: &'a [T],
    /// `[samples]`: the discounted return, estimated as value + advantage.
    pub returns: &'a [T],
}

impl<T: Scalar> Batch<'_, T> {
    /// The number of samples.
    ///
    /// # Errors
    /// No samples or too many, a slice of the wrong length, or a return or an advantage that isn't finite.
    pub(super) fn check(&self, policy: &Policy) -> Result<usize, LearnError> {
        let samples = self.returns.len();
        // Indices are u32, and an empty batch has no mean.
        if samples == 0 || samples > u32::MAX as usize {
            return Err(LearnError::Setting(OutOfRange {
                setting: "number of samples".to_owned(),
                value: samples.to_string(),
                allowed: format!("a whole number from 1 to {}", u32::MAX),
            }));
        }
        check_length(
            "batch of observations",
            self.observations.len(),
            samples * policy.spec().observation,
        )?;
        check_length(
            "batch of actions",
            self.actions.len(),
            samples * policy.spec().action,
        )?;
        check_length("batch of log-probabilities", self.log_probs.len(), samples)?;
        check_length("batch of values", self.values.len(), samples)?;
        check_length("batch of advantages", self.advantages.len(), samples)?;
        check_finite("returns", self.returns)?;
        check_finite("advantages", self.advantages)?;
        Ok(samples)
    }
}

fn check_finite<T: Scalar>(what: &'static str, values: &[T]) -> Result<(), LearnError> {
    match values.iter().position(|v| !v.to_f64().is_finite()) {
        Some(sample) => Err(LearnError::NotFinite { what, sample }),
        None => Ok(()),
    }
}

/// The numbers below `count` in random order (Fisher-Yates).
pub fn shuffled(count: usize, rng: &mut ChaCha8Rng) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count as u32).collect();
    for last in (1..order.len()).rev() {
        // A 64-bit multiply-shift: the bias is below 2⁻³² for fewer than 2³² elements.
        let other = (u128::from(rng.next_u64()) * (last as u128 + 1)) >> 64;
        order.swap(last, other as usize);
    }
    order
}

/// Cuts a slice into `count` parts whose lengths differ by at most one.
pub(super) fn even_parts<T>(values: &[T], count: usize) -> impl Iterator<Item = &[T]> {
    let length = values.len();
    (0..count).map(move |part| &values[part * length / count..(part + 1) * length / count])
}
