//! Proximal policy optimisation: the settings, the learner's state and its update.

use super::adam::{Adam, AdamConfig, PIECE};
use super::kernels::{Scalar, add, sum_of_squares};
use super::policy::{Policy, PolicySpec, entropy};
use super::surrogate::{LossTerms, Objective, Samples, Shard};
use super::value_scale::{ValueScale, mean_and_std};
use super::{LearnError, check_length};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How to learn. Left-out fields take the defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
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
    /// Whether the critic learns returns on a running scale (see [`Learner`]).
    pub normalize_returns: bool,
    pub adam: AdamConfig,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            gamma: 0.95,
            lambda: 0.95,
            clip: 0.2,
            epochs: 4,
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
            target_kl: Some(0.02),
            stop_kl_factor: 3.0,
            initial_std: 0.15,
            learn_std: false,
            normalize_returns: true,
            adam: AdamConfig::default(),
        }
    }
}

impl Config {
    fn check(&self) -> Result<(), LearnError> {
        let positive = f64::MIN_POSITIVE..=f64::MAX;
        let unit = 0.0..=1.0;
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

    fn objective(&self) -> Objective {
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

/// What a rollout gives to learn from: `samples` rows each.
#[derive(Clone, Copy, Debug)]
pub struct Batch<'a, T> {
    /// `[samples, observation]`, normalised as they were acted on.
    pub observations: &'a [T],
    /// `[samples, action]`.
    pub actions: &'a [T],
    /// `[samples]`: log-probability of the actions when they were taken.
    pub log_probs: &'a [T],
    /// `[samples]`: what the critic expected.
    pub values: &'a [T],
    /// `[samples]`.
    pub advantages: &'a [T],
    /// `[samples]`.
    pub returns: &'a [T],
}

/// How an update went. Losses are means over the minibatches used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UpdateStats {
    pub policy_loss: f64,
    /// Mean squared error on the critic's own scale.
    pub value_loss: f64,
    pub action_bound_loss: f64,
    /// Mean over the last epoch; of the last minibatch if that stopped the update.
    pub approx_kl: f64,
    pub clip_fraction: f64,
    /// `1 − Var(return − value)/Var(return)` of the critic before the update.
    pub explained_variance: f64,
    /// Of the policy after the update, nats.
    pub entropy: f64,
    /// Mean Euclidean norm of the gradient before clipping.
    pub gradient_norm: f64,
    /// That this update used.
    pub learning_rate: f64,
    /// Gradient steps taken.
    pub steps: usize,
    /// Whether the KL divergence ended the update early.
    pub stopped_early: bool,
}

/// Everything of a learner that changes while it learns.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnerState<T> {
    pub spec: PolicySpec,
    pub parameters: Vec<T>,
    pub adam: Adam<T>,
    pub learning_rate: f64,
    pub value_scale: ValueScale,
}

/// Learns a [`Policy`] from batches of experience.
///
/// Advantages are normalised over the batch. The critic learns `(return − value_mean)/value_std`, whose statistics follow
/// the batches; when they move, its last layer is rewritten so that its values stay (van Hasselt et al. 2016, "Learning
/// values across many orders of magnitude"), which keeps the value loss near 1 at any size of reward.
#[derive(Clone, Debug)]
pub struct Learner<T> {
    config: Config,
    policy: Policy,
    state: LearnerState<T>,
    shards: Vec<Shard<T>>,
    gradient: Vec<T>,
    piece_norms: Vec<f64>,
    advantages: Vec<T>,
    targets: Vec<T>,
}

impl<T: Scalar> Learner<T> {
    pub fn new(config: Config, spec: PolicySpec, rng: &mut ChaCha8Rng) -> Result<Self, LearnError> {
        config.check()?;
        let policy = Policy::new(spec.clone())?;
        let parameters = policy.initialise(config.initial_std, rng);
        let state = LearnerState {
            spec,
            adam: Adam::new(parameters.len()),
            learning_rate: config.learning_rate,
            value_scale: ValueScale::default(),
            parameters,
        };
        Ok(Self {
            shards: vec![Shard::new(state.parameters.len()); config.shards],
            gradient: vec![T::ZERO; state.parameters.len()],
            piece_norms: Vec::new(),
            advantages: Vec::new(),
            targets: Vec::new(),
            config,
            policy,
            state,
        })
    }

    /// Goes on from a saved state, which must be of the same network.
    pub fn restore(&mut self, state: LearnerState<T>) -> Result<(), LearnError> {
        if &state.spec != self.policy.spec() {
            let (found, expected) = (
                format!("{:?}", state.spec),
                format!("{:?}", self.policy.spec()),
            );
            return Err(LearnError::Network { found, expected });
        }
        let count = self.policy.parameter_count();
        check_length("saved parameter vector", state.parameters.len(), count)?;
        check_length("saved optimiser mean", state.adam.mean.len(), count)?;
        check_length("saved optimiser square", state.adam.square.len(), count)?;
        self.state = state;
        Ok(())
    }

    pub fn config(&self) -> &Config {
        &self.config
    }

    pub fn policy(&self) -> &Policy {
        &self.policy
    }

    pub fn parameters(&self) -> &[T] {
        &self.state.parameters
    }

    pub fn state(&self) -> &LearnerState<T> {
        &self.state
    }

    /// Sets the standard deviation of the action noise, for noise that follows a schedule.
    pub fn set_std(&mut self, std: f64) {
        let range = self.policy.log_std_range();
        self.state.parameters[range].fill(T::from_f64(std.ln()));
    }

    /// Learns from a batch; `rng` shuffles it. Runs on the current rayon pool with the same bits at any size of it.
    pub fn update(
        &mut self,
        batch: &Batch<T>,
        rng: &mut ChaCha8Rng,
    ) -> Result<UpdateStats, LearnError> {
        let samples = batch.check(&self.policy)?;
        self.rescale_values(batch.returns);
        self.prepare(batch);
        let mut run = Run::default();
        'epochs: for epoch in 0..self.config.epochs {
            run.begin_epoch();
            let order = shuffled(samples, rng);
            for (minibatch, indices) in even_parts(&order, self.minibatches(samples)).enumerate() {
                let (terms, norm) = self.minibatch_gradient(batch, indices);
                if !norm.is_finite() {
                    return Err(LearnError::Diverged { epoch, minibatch });
                }
                if self.exceeds(terms.approx_kl) {
                    run.stop(terms.approx_kl);
                    break 'epochs;
                }
                run.record(terms, norm);
                self.step(norm);
            }
        }
        let stats = self.summary(&run, batch);
        self.steer(stats.approx_kl);
        Ok(stats)
    }

    /// The loss terms of the samples at `indices` and their gradient, beside the parameter vector.
    pub fn gradient(
        &mut self,
        batch: &Batch<T>,
        indices: &[u32],
    ) -> Result<(LossTerms, &[T]), LearnError> {
        let samples = batch.check(&self.policy)?;
        if let Some(&index) = indices.iter().find(|&&i| i as usize >= samples) {
            return Err(LearnError::Length {
                what: "batch".to_owned(),
                found: samples,
                expected: index as usize + 1,
            });
        }
        self.prepare(batch);
        let (terms, _) = self.minibatch_gradient(batch, indices);
        Ok((terms, &self.gradient))
    }

    fn minibatches(&self, samples: usize) -> usize {
        (samples as f64 / self.config.minibatch as f64)
            .round()
            .max(1.0) as usize
    }

    fn exceeds(&self, kl: f64) -> bool {
        self.config
            .target_kl
            .is_some_and(|target| kl > self.config.stop_kl_factor * target)
    }

    fn rescale_values(&mut self, returns: &[T]) {
        if self.config.normalize_returns {
            self.state.value_scale.follow(returns);
            self.state
                .value_scale
                .apply(&self.policy, &mut self.state.parameters);
        }
    }

    /// Normalised advantages, and returns on the critic's scale.
    fn prepare(&mut self, batch: &Batch<T>) {
        let (mean, std) = mean_and_std(batch.advantages);
        let standardise = |x: &T, mean: f64, std: f64| T::from_f64((x.to_f64() - mean) / std);
        self.advantages.clear();
        self.advantages.extend(
            batch
                .advantages
                .iter()
                .map(|a| standardise(a, mean, std + 1e-8)),
        );
        let mean = self.state.parameters[self.policy.value_mean_index()].to_f64();
        let std = self.state.parameters[self.policy.value_std_index()].to_f64();
        self.targets.clear();
        self.targets
            .extend(batch.returns.iter().map(|r| standardise(r, mean, std)));
    }

    /// Fills `gradient` with that of the loss over the samples at `indices`; gives the loss's terms and the norm.
    fn minibatch_gradient(&mut self, batch: &Batch<T>, indices: &[u32]) -> (LossTerms, f64) {
        let objective = self.config.objective();
        let samples = Samples {
            observations: batch.observations,
            actions: batch.actions,
            log_probs: batch.log_probs,
            advantages: &self.advantages,
            targets: &self.targets,
        };
        let (policy, parameters) = (&self.policy, &self.state.parameters[..]);
        let parts: Vec<&[u32]> = even_parts(indices, self.shards.len()).collect();
        self.shards
            .par_iter_mut()
            .zip(parts)
            .for_each(|(shard, part)| {
                shard.run(
                    policy,
                    &objective,
                    parameters,
                    &samples,
                    part,
                    indices.len(),
                );
            });
        let mut terms = LossTerms::default();
        self.shards.iter().for_each(|shard| terms += shard.terms);
        (
            terms.scaled(1.0 / indices.len().max(1) as f64),
            self.reduce(),
        )
    }

    /// Adds the shards' gradients in order, piece by piece, and gives the norm of the sum.
    fn reduce(&mut self) -> f64 {
        let shards = &self.shards;
        let pieces = self
            .gradient
            .par_chunks_mut(PIECE)
            .enumerate()
            .map(|(index, sum)| {
                let range = index * PIECE..index * PIECE + sum.len();
                sum.fill(T::ZERO);
                shards
                    .iter()
                    .for_each(|shard| add(sum, &shard.gradient[range.clone()]));
                sum_of_squares(sum)
            });
        pieces.collect_into_vec(&mut self.piece_norms);
        self.piece_norms.iter().sum::<f64>().sqrt()
    }

    fn step(&mut self, norm: f64) {
        let LearnerState {
            parameters,
            adam,
            learning_rate,
            ..
        } = &mut self.state;
        let Config {
            adam: config,
            max_gradient_norm,
            ..
        } = &self.config;
        adam.step(
            config,
            *learning_rate,
            *max_gradient_norm,
            parameters,
            &self.gradient,
            norm,
        );
    }

    fn summary(&self, run: &Run, batch: &Batch<T>) -> UpdateStats {
        let steps = run.steps.max(1) as f64;
        let terms = run.terms.scaled(1.0 / steps);
        UpdateStats {
            policy_loss: terms.policy,
            value_loss: terms.value,
            action_bound_loss: terms.action_bound,
            approx_kl: run.kl(),
            clip_fraction: terms.clip_fraction,
            explained_variance: explained_variance(batch.values, batch.returns),
            entropy: entropy(&self.state.parameters[self.policy.log_std_range()]),
            gradient_norm: run.norms / steps,
            learning_rate: self.state.learning_rate,
            steps: run.steps,
            stopped_early: run.stopped.is_some(),
        }
    }

    /// Moves the learning rate towards steps of the target size.
    fn steer(&mut self, kl: f64) {
        let Some(target) = self.config.target_kl else {
            return;
        };
        let rate = &mut self.state.learning_rate;
        if kl > 2.0 * target {
            *rate = (*rate / 1.5).max(self.config.min_learning_rate);
        } else if kl < 0.5 * target {
            *rate = (*rate * 1.5).min(self.config.max_learning_rate);
        }
    }
}

impl<T: Scalar> Batch<'_, T> {
    /// The number of samples.
    fn check(&self, policy: &Policy) -> Result<usize, LearnError> {
        let samples = self.returns.len();
        // Indices are u32, and an empty batch has no mean.
        if samples == 0 || samples > u32::MAX as usize {
            return Err(LearnError::Setting {
                name: "number of samples",
                value: samples.to_string(),
                range: "1..2^32",
            });
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
        Ok(samples)
    }
}

/// Sums over the minibatches of one update.
#[derive(Default)]
struct Run {
    terms: LossTerms,
    norms: f64,
    steps: usize,
    epoch_kl: f64,
    epoch_steps: usize,
    stopped: Option<f64>,
}

impl Run {
    fn begin_epoch(&mut self) {
        self.epoch_kl = 0.0;
        self.epoch_steps = 0;
    }

    fn record(&mut self, terms: LossTerms, norm: f64) {
        self.terms += terms;
        self.norms += norm;
        self.steps += 1;
        self.epoch_kl += terms.approx_kl;
        self.epoch_steps += 1;
    }

    fn stop(&mut self, kl: f64) {
        self.stopped = Some(kl);
    }

    fn kl(&self) -> f64 {
        self.stopped
            .unwrap_or(self.epoch_kl / self.epoch_steps.max(1) as f64)
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
fn even_parts<T>(values: &[T], count: usize) -> impl Iterator<Item = &[T]> {
    let length = values.len();
    (0..count).map(move |part| &values[part * length / count..(part + 1) * length / count])
}

fn explained_variance<T: Scalar>(values: &[T], returns: &[T]) -> f64 {
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
