//! The settings of the learner.

use super::adam::AdamConfig;
use super::error::LearnError;
use super::surrogate::Objective;
use crate::schema::{self, OutOfRange};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How to learn, by proximal policy optimisation. Fields that are left out take the defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PpoConfig {
    /// Discount γ of later rewards, per control step.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub gamma: f64,
    /// λ of generalised advantage estimation: how slowly the weight of later steps decays.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub lambda: f64,
    /// ε of the clipped objective: the ratio of new and old probability is clipped to 1 ± ε.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub clip: f64,
    /// Passes over a batch.
    #[schemars(range(min = 1, max = 1000))]
    pub epochs: usize,
    /// Samples per gradient step. A batch is cut into parts of nearly this size.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    pub minibatch: usize,
    /// Parts of a minibatch whose gradients are computed side by side. Another number gives other bits.
    #[schemars(range(min = 1, max = 1024))]
    pub shards: usize,
    /// Weight of the critic's loss.
    #[schemars(range(min = 0.0))]
    pub value_coefficient: f64,
    /// Weight of the entropy of the action noise, which is rewarded.
    #[schemars(range(min = 0.0))]
    pub entropy_coefficient: f64,
    /// Mean actions beyond ± this are penalised.
    #[schemars(range(min = 0.0))]
    pub action_bound: f64,
    /// Weight of that penalty, times the square of the excess. 0 switches it off.
    #[schemars(range(min = 0.0))]
    pub action_bound_coefficient: f64,
    /// Largest Euclidean norm of a gradient; a longer one is scaled down to it.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_gradient_norm: f64,
    /// Learning rate at the start.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub learning_rate: f64,
    /// Smallest learning rate that `target_kl` may set.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub min_learning_rate: f64,
    /// Largest learning rate that `target_kl` may set: at least `min_learning_rate`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_learning_rate: f64,
    /// KL divergence per update that steers the learning rate: it grows by 1.5 below half of this, and shrinks by 1.5 above twice
    /// of it. `null` keeps the learning rate and never ends an update early.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub target_kl: Option<f64>,
    /// An update ends before the step of a minibatch whose KL divergence exceeds this many times `target_kl`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stop_kl_factor: f64,
    /// Standard deviation of the action noise at the start.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub initial_std: f64,
    /// Whether the standard deviation of the noise is learned. Otherwise `final_std` alone changes it.
    pub learn_std: bool,
    /// Whether the critic learns returns on a running scale.
    pub normalize_returns: bool,
    /// Normalised advantages are limited to ± this. `null` sets no limit.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub advantage_limit: Option<f64>,
    /// Learning rate of the critic at the start. `null` gives it `learning_rate`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub critic_learning_rate: Option<f64>,
    /// Momentum of plain gradient descent, which then replaces Adam. `null` is Adam.
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 1))]
    pub momentum: Option<f64>,
    /// Settings of Adam, the optimiser.
    pub adam: AdamConfig,
}

impl Default for PpoConfig {
    /// `docs/notebook/training-choices.md` has what `gamma` and `epochs` change. `clip` and `lambda` are those of Schulman et
    /// al. 2017, "Proximal policy optimization algorithms". All else is chosen.
    fn default() -> Self {
        Self {
            // A reward 20 control steps later counts a third as much: imitation asks for little foresight.
            gamma: 0.95,
            lambda: 0.95,
            clip: 0.2,
            epochs: 3,
            minibatch: 1024,
            shards: 4,
            value_coefficient: 0.5,
            entropy_coefficient: 0.0,
            action_bound: 1.0,
            action_bound_coefficient: 0.0,
            max_gradient_norm: 1.0,
            learning_rate: 3e-4,
            min_learning_rate: 1e-5,
            max_learning_rate: 1e-3,
            target_kl: Some(0.05),
            stop_kl_factor: 3.0,
            initial_std: 0.5,
            learn_std: false,
            normalize_returns: true,
            advantage_limit: None,
            critic_learning_rate: Some(1e-3),
            momentum: None,
            adam: AdamConfig::default(),
        }
    }
}

impl PpoConfig {
    /// Checks that all numbers are in their ranges.
    ///
    /// # Errors
    /// The first that isn't.
    pub fn check(&self) -> Result<(), LearnError> {
        schema::check(self, "ppo")?;
        if self.max_learning_rate < self.min_learning_rate {
            return Err(LearnError::Setting(OutOfRange {
                setting: "ppo.max_learning_rate".to_owned(),
                value: self.max_learning_rate.to_string(),
                allowed: format!(
                    "a number of {} or more, which is `ppo.min_learning_rate`",
                    self.min_learning_rate
                ),
            }));
        }
        Ok(())
    }

    /// The largest learning rate that `target_kl` may set when rates have come down to this share.
    pub(super) fn largest_rate(&self, share: f64) -> f64 {
        let largest = self.max_learning_rate.max(self.learning_rate);
        (largest * share).max(self.min_learning_rate)
    }

    /// What the loss is made of.
    pub(super) fn objective(&self) -> Objective {
        Objective {
            clip: self.clip,
            value_coefficient: self.value_coefficient,
            entropy_coefficient: self.entropy_coefficient,
            action_bound: self.action_bound,
            action_bound_coefficient: self.action_bound_coefficient,
            learn_std: self.learn_std,
        }
    }
}
