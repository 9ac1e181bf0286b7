//! The settings of the learner.

use super::LearnError;
use super::adam::AdamConfig;
use super::surrogate::Objective;
use serde::{Deserialize, Serialize};

/// How to learn. Left-out fields take the defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Discount per control step.
    pub gamma: f64,
    /// Decay of generalised advantage estimation.
    pub lambda: f64,
    /// ε of the clipped ratio.
    pub clip: f64,
    /// Passes over a batch.
    pub epochs: usize,
    /// Samples per gradient step; a batch is cut into parts of nearly this size.
    pub minibatch: usize,
    /// Parts of a minibatch whose gradients are computed side by side. Other numbers give other bits.
    pub shards: usize,
    pub value_coefficient: f64,
    pub entropy_coefficient: f64,
    /// Mean actions beyond ± this are penalised.
    pub action_bound: f64,
    /// Times the squared excess; 0 switches the penalty off.
    pub action_bound_coefficient: f64,
    /// Euclidean norm that gradients are clipped to.
    pub max_gradient_norm: f64,
    /// Learning rate at the start.
    pub learning_rate: f64,
    pub min_learning_rate: f64,
    pub max_learning_rate: f64,
    /// KL divergence per update that steers the learning rate: × 1.5 below half of it, ÷ 1.5 above twice of it.
    /// `null` keeps the learning rate and never stops early.
    pub target_kl: Option<f64>,
    /// An update stops before the step of a minibatch whose KL exceeds this many times the target.
    pub stop_kl_factor: f64,
    /// Standard deviation of the action noise at the start.
    pub initial_std: f64,
    /// Whether the noise is learned; otherwise it stays.
    pub learn_std: bool,
    /// Whether the critic learns returns on a running scale (see [`super::Learner`]).
    pub normalize_returns: bool,
    /// Normalised advantages are cut off beyond ± this; `null` keeps them all.
    pub advantage_limit: Option<f64>,
    /// Learning rate of the critic at the start; `null` gives it the actor's.
    pub critic_learning_rate: Option<f64>,
    /// Gradient descent with this momentum instead of Adam; `null` is Adam.
    pub momentum: Option<f64>,
    pub adam: AdamConfig,
}

impl Default for Config {
    fn default() -> Self {
        Self {
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
            max_learning_rate: 1e-2,
            target_kl: Some(0.05),
            stop_kl_factor: 3.0,
            initial_std: 0.5,
            learn_std: false,
            normalize_returns: true,
            advantage_limit: None,
            critic_learning_rate: None,
            momentum: None,
            adam: AdamConfig::default(),
        }
    }
}

impl Config {
    pub(super) fn check(&self) -> Result<(), LearnError> {
        let positive = f64::MIN_POSITIVE..=f64::MAX;
        let unit = 0.0..=1.0;
        let least = 0.0..=f64::MAX;
        let decay = 0.0..=1.0 - f64::EPSILON;
        let settings = [
            ("gamma", self.gamma, &unit, "0..=1"),
            ("lambda", self.lambda, &unit, "0..=1"),
            ("clip", self.clip, &positive, "the positive numbers"),
            ("epochs", self.epochs as f64, &(1.0..=1000.0), "1..=1000"),
            (
                "minibatch",
                self.minibatch as f64,
                &(1.0..=1e9),
                "1..=1000000000",
            ),
            (
                "value_coefficient",
                self.value_coefficient,
                &least,
                "0 or more",
            ),
            (
                "entropy_coefficient",
                self.entropy_coefficient,
                &least,
                "0 or more",
            ),
            (
                "action_bound_coefficient",
                self.action_bound_coefficient,
                &least,
                "0 or more",
            ),
            ("action_bound", self.action_bound, &least, "0 or more"),
            ("adam.beta1", self.adam.beta1, &decay, "0 up to below 1"),
            ("adam.beta2", self.adam.beta2, &decay, "0 up to below 1"),
            (
                "adam.epsilon",
                self.adam.epsilon,
                &positive,
                "the positive numbers",
            ),
            ("shards", self.shards as f64, &(1.0..=1024.0), "1..=1024"),
            (
                "max_gradient_norm",
                self.max_gradient_norm,
                &positive,
                "the positive numbers",
            ),
            (
                "learning_rate",
                self.learning_rate,
                &positive,
                "the positive numbers",
            ),
            (
                "min_learning_rate",
                self.min_learning_rate,
                &positive,
                "the positive numbers",
            ),
            (
                "max_learning_rate",
                self.max_learning_rate,
                &(self.min_learning_rate..=f64::MAX),
                "min_learning_rate..",
            ),
            (
                "target_kl",
                self.target_kl.unwrap_or(1.0),
                &positive,
                "the positive numbers",
            ),
            (
                "advantage_limit",
                self.advantage_limit.unwrap_or(1.0),
                &positive,
                "the positive numbers",
            ),
            (
                "critic_learning_rate",
                self.critic_learning_rate.unwrap_or(1.0),
                &positive,
                "the positive numbers",
            ),
            (
                "momentum",
                self.momentum.unwrap_or(0.0),
                &decay,
                "0 up to below 1",
            ),
            (
                "stop_kl_factor",
                self.stop_kl_factor,
                &positive,
                "the positive numbers",
            ),
            (
                "initial_std",
                self.initial_std,
                &positive,
                "the positive numbers",
            ),
        ];
        for (name, value, range, text) in settings {
            if !range.contains(&value) {
                return Err(LearnError::Setting {
                    name,
                    value: value.to_string(),
                    range: text,
                });
            }
        }
        Ok(())
    }

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
