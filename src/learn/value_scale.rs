//! The scale that the critic learns returns on.

use super::kernels::Scalar;
use super::policy::Policy;

/// Share of the newest batch in the running statistics, once there were 1/rate batches: a memory of about 20 batches. Chosen.
const RATE: f64 = 0.05;
/// Returns that vary less than this count as varying this much, so that a constant return isn't divided by 0. Chosen.
const SMALLEST_STD: f64 = 1e-3;

/// Running statistics of returns (van Hasselt et al. 2016, "Learning values across many orders of magnitude").
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ValueScale {
    /// Mean return.
    pub mean: f64,
    /// Mean of the squared return.
    pub square: f64,
    /// Batches taken in.
    pub batches: f64,
}

impl ValueScale {
    /// Takes in a batch: the plain mean over batches at first, an exponential one later. An exponential mean alone would
    /// take 20 batches to forget where it began.
    pub(crate) fn follow<T: Scalar>(&mut self, returns: &[T]) {
        let (mean, std) = mean_and_std(returns);
        self.batches += 1.0;
        let rate = RATE.max(1.0 / self.batches);
        self.mean += rate * (mean - self.mean);
        self.square += rate * (std * std + mean * mean - self.square);
    }

    fn std(&self) -> f64 {
        (self.square - self.mean * self.mean)
            .max(0.0)
            .sqrt()
            .max(SMALLEST_STD)
    }

    /// Writes the scale into the parameter vector and rewrites the critic's last layer so that values stay:
    /// `w' = w·σ/σ'`, `b' = (σ·b + μ − μ')/σ'` (van Hasselt et al. 2016, Algorithm 1).
    pub(crate) fn apply<T: Scalar>(&self, policy: &Policy, parameters: &mut [T]) {
        let (mean_index, std_index) = (policy.value_mean_index(), policy.value_std_index());
        let (old_mean, old_std) = (
            parameters[mean_index].to_f64(),
            parameters[std_index].to_f64(),
        );
        let new_mean = T::from_f64(self.mean);
        let new_std = T::from_f64(self.std());
        parameters[mean_index] = new_mean;
        parameters[std_index] = new_std;
        let critic = &mut parameters[policy.critic_range()];
        let Some(last) = policy.critic.layers().last() else {
            return;
        };
        // As rounded to the parameters' precision, for these are the numbers that values are computed with.
        let (new_mean, new_std) = (new_mean.to_f64(), new_std.to_f64());
        for w in &mut critic[last.weight.clone()] {
            *w = T::from_f64(w.to_f64() * old_std / new_std);
        }
        for b in &mut critic[last.bias.clone()] {
            *b = T::from_f64((old_std * b.to_f64() + old_mean - new_mean) / new_std);
        }
    }
}

/// Mean and population standard deviation.
pub(crate) fn mean_and_std<T: Scalar>(values: &[T]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = values.iter().map(|v| v.to_f64()).sum::<f64>() / count;
    let variance = values
        .iter()
        .map(|v| (v.to_f64() - mean).powi(2))
        .sum::<f64>()
        / count;
    (mean, variance.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::{ActWorkspace, Activation, PolicySpec};
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    #[test]
    fn a_new_scale_leaves_values_as_they_were() {
        let spec = PolicySpec {
            observation: 2,
            action: 1,
            hidden: vec![6],
            activation: Activation::Tanh,
        };
        let policy = Policy::new(spec).unwrap();
        let mut parameters: Vec<f64> = policy.initialise(0.1, &mut ChaCha8Rng::seed_from_u64(2));
        let observations = [0.3, -1.0, 2.0, 0.4];
        let mut workspace = ActWorkspace::default();
        let before = policy
            .values(&parameters, &observations, &mut workspace)
            .unwrap()
            .to_vec();
        let mut scale = ValueScale::default();
        for returns in [[3.0, 5.0, 10.0], [30.0, 20.0, 25.0]] {
            scale.follow(&returns);
            scale.apply(&policy, &mut parameters);
            let after = policy
                .values(&parameters, &observations, &mut workspace)
                .unwrap();
            assert!(before.iter().zip(after).all(|(a, b)| (a - b).abs() < 1e-12));
        }
        // Two batches weigh the same: the statistics are those of all six returns.
        let (mean, std) = mean_and_std(&[3.0, 5.0, 10.0, 30.0, 20.0, 25.0]);
        assert!((scale.mean - mean).abs() < 1e-12 && (scale.std() - std).abs() < 1e-12);
    }
}
