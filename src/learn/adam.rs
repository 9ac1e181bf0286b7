//! The Adam optimiser with global-norm clipping.

use super::kernels::{AdamStep, Scalar, adam};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Elements per piece of parallel work: fixed, so that sums don't depend on the number of threads.
pub(crate) const PIECE: usize = 1 << 14;

/// Kingma & Ba 2015, "Adam: a method for stochastic optimization", with their defaults.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AdamConfig {
    pub beta1: f64,
    pub beta2: f64,
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

/// The optimiser's state, element by element beside the parameter vector.
#[derive(Clone, Debug, PartialEq)]
pub struct Adam<T> {
    /// Running mean of the gradient.
    pub mean: Vec<T>,
    /// Running mean of the squared gradient.
    pub square: Vec<T>,
    /// Steps taken.
    pub steps: u64,
}

impl<T: Scalar> Adam<T> {
    pub fn new(parameters: usize) -> Self {
        Self {
            mean: vec![T::ZERO; parameters],
            square: vec![T::ZERO; parameters],
            steps: 0,
        }
    }

    /// One step on `parameters`, the gradient scaled down first so that its Euclidean `norm` is at most `max_norm`.
    pub fn step(
        &mut self,
        config: &AdamConfig,
        learning_rate: f64,
        max_norm: f64,
        parameters: &mut [T],
        gradient: &[T],
        norm: f64,
    ) {
        self.steps = self.steps.saturating_add(1);
        let step = self.coefficients(
            config,
            learning_rate,
            if norm > max_norm {
                max_norm / norm
            } else {
                1.0
            },
        );
        let pieces = parameters
            .par_chunks_mut(PIECE)
            .zip(self.mean.par_chunks_mut(PIECE));
        pieces
            .zip(self.square.par_chunks_mut(PIECE))
            .zip(gradient.par_chunks(PIECE))
            .for_each(|(((parameters, mean), square), gradient)| {
                adam(parameters, mean, square, gradient, step)
            });
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
            optimiser.step(
                &AdamConfig::default(),
                a,
                1.0,
                &mut parameters,
                gradient,
                norm,
            );
        }
        for i in 0..2 {
            assert!((parameters[i] - theta[i]).abs() < 1e-14);
        }
    }
}
