//! Adam, or plain momentum, with global-norm clipping.

use super::kernels::{AdamStep, MomentumStep, Scalar, adam, momentum_step};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Elements per piece of parallel work: fixed, so that sums don't depend on the number of threads.
pub(crate) const PIECE: usize = 1 << 14;

/// Kingma & Ba 2015, "Adam: a method for stochastic optimization", with their defaults.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AdamConfig {
    /// Decay of the running mean of the gradient, per step.
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 1))]
    pub beta1: f64,
    /// Decay of the running mean of the squared gradient, per step.
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 1))]
    pub beta2: f64,
    /// Added to the root of the squared gradient's mean, so that no division is by zero.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub epsilon: f64,
}

impl Default for AdamConfig {
    fn default() -> Self {
        Self {
            beta1: 0.9,
            beta2: 0.999,
            epsilon: 1e-8,
        }
    }
}

/// How a step is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// Decay rates and ε of Adam.
    pub adam: AdamConfig,
    /// Plain gradient descent with this momentum, m ← μ·m + g and θ ← θ − α·m, instead of Adam.
    pub momentum: Option<f64>,
    /// Euclidean norm that the whole gradient is clipped to.
    pub max_norm: f64,
    /// Learning rate of all parameters before `critic_from`.
    pub learning_rate: f64,
    /// First parameter that has the critic's rate instead.
    pub critic_from: usize,
    /// Learning rate of the parameters from there on.
    pub critic_learning_rate: f64,
}

/// The optimiser's state, element by element beside the parameter vector.
#[derive(Clone, Debug, PartialEq)]
pub struct Adam<T> {
    /// Running mean of the gradient; under plain momentum its running sum.
    pub mean: Vec<T>,
    /// Running mean of the squared gradient.
    pub square: Vec<T>,
    /// Steps taken.
    pub steps: u64,
}

impl<T: Scalar> Adam<T> {
    /// An optimiser of so many `parameters` that hasn't taken a step yet.
    pub fn new(parameters: usize) -> Self {
        Self {
            mean: vec![T::ZERO; parameters],
            square: vec![T::ZERO; parameters],
            steps: 0,
        }
    }

    /// One step on `parameters`, the gradient scaled down first so that its Euclidean `norm` is at most that of the rule
    /// (Pascanu et al. 2013, "On the difficulty of training recurrent neural networks", Algorithm 1).
    ///
    /// # Panics
    /// If the state or the gradient has another length than the parameters.
    pub fn step(&mut self, rule: &Rule, parameters: &mut [T], gradient: &[T], norm: f64) {
        self.steps = self.steps.saturating_add(1);
        let scale = if norm > rule.max_norm {
            rule.max_norm / norm
        } else {
            1.0
        };
        // Elements don't depend on each other, so cutting them into pieces for the threads changes no bit.
        let at = rule.critic_from.min(parameters.len());
        let rates = [rule.learning_rate, rule.critic_learning_rate];
        for (range, rate) in [0..at, at..parameters.len()].into_iter().zip(rates) {
            let (parameters, gradient) = (&mut parameters[range.clone()], &gradient[range.clone()]);
            match rule.momentum {
                Some(momentum) => {
                    let step = MomentumStep {
                        gradient_scale: T::from_f64(scale),
                        momentum: T::from_f64(momentum),
                        step_size: T::from_f64(rate),
                    };
                    let mean = self.mean[range].par_chunks_mut(PIECE);
                    let pieces = parameters.par_chunks_mut(PIECE).zip(mean);
                    pieces.zip(gradient.par_chunks(PIECE)).for_each(
                        |((parameters, mean), gradient)| {
                            momentum_step(parameters, mean, gradient, step);
                        },
                    );
                }
                None => {
                    let step = self.coefficients(&rule.adam, rate, scale);
                    let mean = self.mean[range.clone()].par_chunks_mut(PIECE);
                    let pieces = parameters.par_chunks_mut(PIECE).zip(mean);
                    pieces
                        .zip(self.square[range].par_chunks_mut(PIECE))
                        .zip(gradient.par_chunks(PIECE))
                        .for_each(|(((parameters, mean), square), gradient)| {
                            adam(parameters, mean, square, gradient, step);
                        });
                }
            }
        }
    }

    /// `α·m̂/(√v̂ + ε)` with both bias corrections moved into α and ε (Kingma & Ba 2015, end of section 2).
    fn coefficients(
        &self,
        config: &AdamConfig,
        learning_rate: f64,
        gradient_scale: f64,
    ) -> AdamStep<T> {
        let steps = self.steps as f64;
        let mean_correction = 1.0 - config.beta1.powf(steps);
        let square_correction = (1.0 - config.beta2.powf(steps)).sqrt();
        AdamStep {
            gradient_scale: T::from_f64(gradient_scale),
            beta1: T::from_f64(config.beta1),
            beta2: T::from_f64(config.beta2),
            one_minus_beta1: T::from_f64(1.0 - config.beta1),
            one_minus_beta2: T::from_f64(1.0 - config.beta2),
            step_size: T::from_f64(learning_rate * square_correction / mean_correction),
            epsilon: T::from_f64(config.epsilon * square_correction),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rule(learning_rate: f64, critic_learning_rate: f64) -> Rule {
        Rule {
            adam: AdamConfig::default(),
            momentum: None,
            max_norm: 1.0,
            learning_rate,
            critic_from: 1,
            critic_learning_rate,
        }
    }

    /// Heavy-ball steps from m = 0 along constant gradients: after two, each parameter has moved by α·g·(2 + μ).
    #[test]
    fn momentum_adds_up_and_the_critic_has_its_own_rate() {
        let mut parameters = [1.0, 2.0];
        let mut optimiser = Adam::new(2);
        let rule = Rule {
            momentum: Some(0.9),
            ..rule(0.01, 0.1)
        };
        for _ in 0..2 {
            optimiser.step(&rule, &mut parameters, &[0.6, -0.8], 1.0);
        }
        let moved: [f64; 2] = [0.01 * 0.6 * 2.9, -0.1 * 0.8 * 2.9];
        assert!((parameters[0] - (1.0 - moved[0])).abs() < 1e-15);
        assert!((parameters[1] - (2.0 - moved[1])).abs() < 1e-15);
    }

    #[test]
    fn two_steps_follow_the_published_algorithm() {
        let (a, b1, b2, eps) = (0.01, 0.9, 0.999, 1e-8);
        let gradients = [[3.0, -4.0], [0.6, 0.8]];
        let (mut theta, mut m, mut v) = ([1.0, 2.0], [0.0; 2], [0.0; 2]);
        for (t, g) in gradients.iter().enumerate() {
            for i in 0..2 {
                // The first gradient has norm 5 and is clipped to 1, the second has norm 1.
                let g = if t == 0 { g[i] / 5.0 } else { g[i] };
                m[i] = b1 * m[i] + (1.0 - b1) * g;
                v[i] = b2 * v[i] + (1.0 - b2) * g * g;
                let m_hat = m[i] / (1.0 - f64::powi(b1, t as i32 + 1));
                let v_hat: f64 = v[i] / (1.0 - f64::powi(b2, t as i32 + 1));
                theta[i] -= a * m_hat / (v_hat.sqrt() + eps);
            }
        }
        let mut parameters = [1.0, 2.0];
        let mut optimiser = Adam::new(2);
        for (gradient, norm) in gradients.iter().zip([5.0, 1.0]) {
            optimiser.step(&rule(a, a), &mut parameters, gradient, norm);
        }
        for i in 0..2 {
            assert!((parameters[i] - theta[i]).abs() < 1e-14);
        }
    }
}
