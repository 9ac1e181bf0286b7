//! Generalised advantage estimation over parallel environments.

use super::error::{LearnError, check_length};
use super::kernels::Scalar;

/// How a step left its environment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StepEnd {
    /// The episode goes on.
    #[default]
    Continues,
    /// The episode failed or reached a true end: nothing is earned after it.
    Terminated,
    /// The episode was cut by a time limit: what the critic expects after it still counts.
    Truncated,
}

/// What a rollout recorded; every `[steps, environments]` slice is row-major, a row per step.
#[derive(Clone, Copy, Debug)]
pub struct Trajectories<'a, T> {
    /// Environments that stepped side by side.
    pub environments: usize,
    /// `[steps, environments]`: what each step earned.
    pub rewards: &'a [T],
    /// `[steps, environments]`: the value of the observation acted on.
    pub values: &'a [T],
    /// `[steps, environments]`: how each step left its environment.
    pub ends: &'a [StepEnd],
    /// `[steps, environments]`: the value of the last observation of an episode, before its reset. Read only where
    /// `ends` is [`StepEnd::Truncated`].
    pub final_values: &'a [T],
    /// `[environments]`: the value of the observation after the last step. Read only where that step continues.
    pub next_values: &'a [T],
}

/// Writes advantages and returns (advantage + value), both `[steps, environments]`.
///
/// `Aₜ = δₜ + γλ·Aₜ₊₁` with `δₜ = rₜ + γ·Vₜ₊₁ − Vₜ` (Schulman et al. 2016, "High-dimensional continuous control using
/// generalized advantage estimation", eq. 16); a termination has `Vₜ₊₁ = 0`, and neither kind of end passes `Aₜ₊₁` on.
///
/// # Errors
/// [`LearnError::Length`] for a slice of another length than the shapes say.
pub fn advantages<T: Scalar>(
    rollout: &Trajectories<T>,
    gamma: f64,
    lambda: f64,
    advantages: &mut [T],
    returns: &mut [T],
) -> Result<(), LearnError> {
    rollout.check(advantages.len(), returns.len())?;
    let environments = rollout.environments;
    let steps = rollout.rewards.len() / environments.max(1);
    for environment in 0..environments {
        // Backward in time, in double precision: every advantage is a running sum of all that follow it.
        let mut next_value = rollout.next_values[environment].to_f64();
        let mut next_advantage = 0.0;
        for step in (0..steps).rev() {
            let i = step * environments + environment;
            let value = rollout.values[i].to_f64();
            // A time limit says nothing about the state, so its value counts; the next row belongs to another episode.
            let (after, passed_on) = match rollout.ends[i] {
                StepEnd::Continues => (next_value, next_advantage),
                StepEnd::Terminated => (0.0, 0.0),
                StepEnd::Truncated => (rollout.final_values[i].to_f64(), 0.0),
            };
            let delta = rollout.rewards[i].to_f64() + gamma * after - value;
            let advantage = delta + gamma * lambda * passed_on;
            advantages[i] = T::from_f64(advantage);
            returns[i] = T::from_f64(advantage + value);
            next_value = value;
            next_advantage = advantage;
        }
    }
    Ok(())
}

impl<T> Trajectories<'_, T> {
    fn check(&self, advantages: usize, returns: usize) -> Result<(), LearnError> {
        let total = self.rewards.len();
        let whole = total / self.environments.max(1) * self.environments;
        check_length("rollout (steps × environments)", total, whole)?;
        check_length("rollout values", self.values.len(), total)?;
        check_length("rollout ends", self.ends.len(), total)?;
        check_length("rollout final values", self.final_values.len(), total)?;
        check_length(
            "rollout next values",
            self.next_values.len(),
            self.environments,
        )?;
        check_length("advantages", advantages, total)?;
        check_length("returns", returns, total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use StepEnd::{Continues, Terminated, Truncated};

    #[test]
    fn agrees_with_values_computed_by_hand() {
        // γ = ½, λ = ½. Environment 0 is truncated at step 1, environment 1 terminates there, environment 2 goes on.
        let rollout = Trajectories::<f64> {
            environments: 3,
            rewards: &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0],
            values: &[4.0, 4.0, 4.0, 6.0, 6.0, 6.0, 8.0, 8.0, 8.0],
            ends: &[
                Continues, Continues, Continues, Truncated, Terminated, Continues, Continues,
                Continues, Continues,
            ],
            final_values: &[
                f64::NAN,
                f64::NAN,
                f64::NAN,
                16.0,
                f64::NAN,
                f64::NAN,
                f64::NAN,
                f64::NAN,
                f64::NAN,
            ],
            next_values: &[12.0; 3],
        };
        let (mut a, mut r) = ([0.0; 9], [0.0; 9]);
        advantages(&rollout, 0.5, 0.5, &mut a, &mut r).unwrap();
        // Step 2: δ = 3 + 6 − 8 = 1.
        // Step 1: truncated 2 + 8 − 6 = 4; terminated 2 − 6 = −4; continuing 2 + 4 − 6 + ¼·1 = ¼.
        // Step 0: δ = 1 + 3 − 4 = 0, plus a quarter of the step after it.
        assert_eq!(a, [1.0, -1.0, 0.0625, 4.0, -4.0, 0.25, 1.0, 1.0, 1.0]);
        assert_eq!(r, [5.0, 3.0, 4.0625, 10.0, 2.0, 6.25, 9.0, 9.0, 9.0]);
    }

    #[test]
    fn with_lambda_one_the_return_is_the_discounted_sum() {
        let rewards = [0.3, -0.2, 0.9, 0.5];
        let rollout = Trajectories {
            environments: 1,
            rewards: &rewards,
            values: &[0.1, 0.7, -0.4, 0.2],
            ends: &[Continues; 4],
            final_values: &[0.0; 4],
            next_values: &[2.0],
        };
        let (mut a, mut r) = ([0.0_f64; 4], [0.0; 4]);
        advantages(&rollout, 0.9, 1.0, &mut a, &mut r).unwrap();
        let sum = rewards
            .iter()
            .rev()
            .fold(2.0, |after, reward| reward + 0.9 * after);
        assert!((r[0] - sum).abs() < 1e-14);
    }

    #[test]
    fn a_ragged_rollout_is_an_error() {
        let rollout = Trajectories::<f32> {
            environments: 2,
            rewards: &[0.0; 3],
            values: &[0.0; 3],
            ends: &[Continues; 3],
            final_values: &[0.0; 3],
            next_values: &[0.0; 2],
        };
        assert!(advantages(&rollout, 0.9, 0.9, &mut [0.0; 3], &mut [0.0; 3]).is_err());
    }
}
