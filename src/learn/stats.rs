//! What an update reports.

use super::kernels::Scalar;
use super::surrogate::LossTerms;
use super::value_scale::mean_and_std;
use serde::{Deserialize, Serialize};

/// How an update went. Losses are means over the minibatches used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UpdateStats {
    /// The clipped surrogate; see [`LossTerms::policy`].
    pub policy_loss: f64,
    /// Mean squared error on the critic's own scale.
    pub value_loss: f64,
    /// Squared excess of mean actions over their bound, before its coefficient.
    pub action_bound_loss: f64,
    /// KL divergence of the new policy from the old, nats: the mean over the last epoch, or, where a step led too far and was
    /// taken back, that of the minibatch before it.
    pub approx_kl: f64,
    /// Share of samples whose probability ratio left 1 ± ε.
    pub clip_fraction: f64,
    /// `1 − Var(return − value)/Var(return)` of the critic before the update.
    pub explained_variance: f64,
    /// Entropy of the policy after the update, nats.
    pub entropy: f64,
    /// Mean Euclidean norm of the gradient before clipping.
    pub gradient_norm: f64,
    /// The actor's learning rate in this update.
    pub learning_rate: f64,
    /// Gradient steps taken.
    pub steps: usize,
    /// Whether the KL divergence ended the update early.
    pub stopped_early: bool,
}

/// Sums over the minibatches of one update.
#[derive(Default)]
pub(super) struct UpdateTotals {
    pub(super) terms: LossTerms,
    /// Euclidean norms of the gradients before clipping.
    pub(super) norms: f64,
    pub(super) steps: usize,
    /// KL divergences of the present epoch's minibatches.
    pub(super) epoch_kl: f64,
    pub(super) epoch_steps: usize,
    /// KL divergence of the last minibatch that was learned from.
    pub(super) last_kl: f64,
    /// KL divergence of the minibatch that ended the update early.
    pub(super) stopped: Option<f64>,
}

impl UpdateTotals {
    pub(super) fn begin_epoch(&mut self) {
        self.epoch_kl = 0.0;
        self.epoch_steps = 0;
    }

    pub(super) fn record(&mut self, terms: LossTerms, norm: f64) {
        self.terms += terms;
        self.norms += norm;
        self.steps += 1;
        self.last_kl = terms.approx_kl;
        self.epoch_kl += terms.approx_kl;
        self.epoch_steps += 1;
    }

    pub(super) fn stop(&mut self, kl: f64) {
        self.stopped = Some(kl);
    }

    /// How far the policy was led.
    pub(super) fn kl(&self) -> f64 {
        match self.stopped {
            Some(_) => self.last_kl,
            None => self.epoch_kl / self.epoch_steps.max(1) as f64,
        }
    }

    /// How far it would have been led without a step that was taken back.
    pub(super) fn attempted_kl(&self) -> f64 {
        self.stopped.unwrap_or_else(|| self.kl())
    }
}

/// `1 − Var(return − value)/Var(return)`, 0 where all returns are the same: 1 for a critic that foresees every return, 0 for
/// one that knows no more than their mean.
pub(super) fn explained_variance<T: Scalar>(values: &[T], returns: &[T]) -> f64 {
    let errors: Vec<f64> = returns
        .iter()
        .zip(values)
        .map(|(r, v)| r.to_f64() - v.to_f64())
        .collect();
    let (_, error) = mean_and_std(&errors);
    let (_, all) = mean_and_std(returns);
    if all > 0.0 {
        1.0 - (error / all).powi(2)
    } else {
        0.0
    }
}
