//! Proximal policy optimisation: the learner's state and its update.

use super::adam::{Adam, PIECE, Rule};
use super::batch::{Batch, even_parts, shuffled};
use super::config::PpoConfig;
use super::error::{LearnError, check_length};
use super::kernels::{Scalar, add, sum_of_squares};
use super::policy::{Policy, PolicySpec, entropy};
use super::stats::{UpdateStats, UpdateTotals, explained_variance};
use super::surrogate::{LossTerms, Samples, Shard};
use super::value_scale::{ValueScale, mean_and_std};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Everything of a learner that changes while it learns.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnerState<T> {
    /// Shape of the networks.
    pub spec: PolicySpec,
    /// `[parameters]`, laid out as [`Policy::tensors`] says.
    pub parameters: Vec<T>,
    /// The optimiser's running means.
    pub adam: Adam<T>,
    /// The actor's learning rate now.
    pub learning_rate: f64,
    /// The scale on which the critic learns returns.
    pub value_scale: ValueScale,
}

/// Learns a [`Policy`] from batches of experience.
///
/// Advantages are normalised over the batch. The critic learns `(return − value_mean)/value_std`, whose statistics follow
/// the batches; when they move, its last layer is rewritten so that its values stay (van Hasselt et al. 2016, "Learning
/// values across many orders of magnitude"), which keeps the value loss near 1 at any size of reward.
#[derive(Clone, Debug)]
pub struct Learner<T> {
    config: PpoConfig,
    policy: Policy,
    state: LearnerState<T>,
    shards: Vec<Shard<T>>,
    gradient: Vec<T>,
    piece_norms: Vec<f64>,
    advantages: Vec<T>,
    targets: Vec<T>,
    /// Parameters before the last step, so that one that went too far can be taken back.
    before: Vec<T>,
    /// Share of their learning rates that the critic has now, and that the actor may have at most.
    anneal: f64,
}

impl<T: Scalar> Learner<T> {
    /// A learner that hasn't learned anything yet; `rng` decides its first parameters.
    ///
    /// # Errors
    /// A setting out of its range, or a network of no size or too large.
    pub fn new(
        config: PpoConfig,
        spec: PolicySpec,
        rng: &mut ChaCha8Rng,
    ) -> Result<Self, LearnError> {
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
            before: Vec::new(),
            anneal: 1.0,
            config,
            policy,
            state,
        })
    }

    /// Goes on from a saved state.
    ///
    /// # Errors
    /// A state of another network, or of vectors that don't fit it; the learner is then unchanged.
    pub fn restore(&mut self, state: LearnerState<T>) -> Result<(), LearnError> {
        if &state.spec != self.policy.spec() {
            let (found, expected) = (state.spec.to_string(), self.policy.spec().to_string());
            return Err(LearnError::Network { found, expected });
        }
        let count = self.policy.parameter_count();
        check_length("saved parameter vector", state.parameters.len(), count)?;
        check_length("saved optimiser mean", state.adam.mean.len(), count)?;
        check_length("saved optimiser square", state.adam.square.len(), count)?;
        self.state = state;
        Ok(())
    }

    /// How it learns.
    pub fn config(&self) -> &PpoConfig {
        &self.config
    }

    /// The networks and their layout.
    pub fn policy(&self) -> &Policy {
        &self.policy
    }

    /// `[parameters]`, laid out as [`Policy::tensors`] says.
    pub fn parameters(&self) -> &[T] {
        &self.state.parameters
    }

    /// Everything that must be saved to go on later.
    pub fn state(&self) -> &LearnerState<T> {
        &self.state
    }

    /// Standard deviation of the action noise, the geometric mean over actions.
    pub fn mean_std(&self) -> f64 {
        let log_std = &self.state.parameters[self.policy.log_std_range()];
        (log_std.iter().map(|s| s.to_f64()).sum::<f64>() / log_std.len() as f64).exp()
    }

    /// Sets the standard deviation of the action noise, for noise that follows a schedule.
    pub fn set_std(&mut self, std: f64) {
        let range = self.policy.log_std_range();
        self.state.parameters[range].fill(T::from_f64(std.ln()));
    }

    /// Sets the share of their learning rates at the start that actor and critic have now. Where a KL divergence steers the actor's,
    /// it is the share of the largest rate that the actor may have.
    pub fn anneal(&mut self, share: f64) {
        self.anneal = share;
        let rate = &mut self.state.learning_rate;
        *rate = match self.config.target_kl {
            Some(_) => rate.min(self.config.largest_rate(share)),
            None => self.config.learning_rate * share,
        };
    }

    /// Learns from a batch; `rng` shuffles it. Runs on the current rayon pool with the same bits at any size of it.
    ///
    /// # Errors
    /// A batch of the wrong lengths or with values that aren't finite, or a gradient that stopped being finite.
    pub fn update(
        &mut self,
        batch: &Batch<T>,
        rng: &mut ChaCha8Rng,
    ) -> Result<UpdateStats, LearnError> {
        let samples = batch.check(&self.policy)?;
        self.rescale_values(batch.returns);
        self.prepare(batch);
        let mut totals = UpdateTotals::default();
        self.before.clear();
        'epochs: for epoch in 0..self.config.epochs {
            totals.begin_epoch();
            let order = shuffled(samples, rng);
            for (minibatch, indices) in even_parts(&order, self.minibatches(samples)).enumerate() {
                let (terms, norm) = self.minibatch_gradient(batch, indices);
                if !norm.is_finite() {
                    return Err(LearnError::Diverged { epoch, minibatch });
                }
                if self.exceeds_kl_limit(terms.approx_kl) {
                    self.take_back();
                    totals.stop(terms.approx_kl);
                    break 'epochs;
                }
                totals.record(terms, norm);
                self.before.clone_from(&self.state.parameters);
                self.step(norm);
            }
        }
        let stats = self.summary(&totals, batch);
        self.adapt_learning_rate(totals.attempted_kl());
        Ok(stats)
    }

    /// The loss terms of the samples at `indices` and their gradient, laid out as the parameters.
    ///
    /// # Errors
    /// A batch of the wrong lengths or with values that aren't finite, or an index beyond it.
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

    /// Minibatches of nearly the size that was asked for. Cutting the batch evenly leaves no small rest, whose noisy gradient
    /// would weigh as much as that of a whole minibatch.
    fn minibatches(&self, samples: usize) -> usize {
        (samples as f64 / self.config.minibatch as f64)
            .round()
            .max(1.0) as usize
    }

    /// Whether the policy has moved too far from the one that acted for its samples to be of use.
    fn exceeds_kl_limit(&self, kl: f64) -> bool {
        self.config
            .target_kl
            .is_some_and(|target| kl > self.config.stop_kl_factor * target)
    }

    /// Takes the last step back, which led the policy too far; the critic keeps what it learned in it.
    fn take_back(&mut self) {
        let actor = ..self.policy.critic_range().start;
        if let Some(before) = self.before.get(actor) {
            self.state.parameters[actor].copy_from_slice(before);
        }
    }

    /// Before targets are computed, so that these samples are already learned on the new scale.
    fn rescale_values(&mut self, returns: &[T]) {
        if self.config.normalize_returns {
            self.state.value_scale.follow(returns);
            self.state
                .value_scale
                .apply(&self.policy, &mut self.state.parameters);
        }
    }

    /// Normalised advantages, and returns on the critic's scale.
    ///
    /// Advantages are normalised over the whole batch and not over each minibatch, so that a sample weighs the same in
    /// whichever minibatch it lands.
    fn prepare(&mut self, batch: &Batch<T>) {
        let (mean, std) = mean_and_std(batch.advantages);
        let standardise = |x: &T, mean: f64, std: f64| T::from_f64((x.to_f64() - mean) / std);
        self.advantages.clear();
        self.advantages.extend(
            batch
                .advantages
                .iter()
                .map(|a| standardise(a, mean, std.max(1e-8))),
        );
        if let Some(limit) = self.config.advantage_limit.map(T::from_f64) {
            for a in &mut self.advantages {
                *a = if *a > limit { limit } else { *a };
                *a = if *a < -limit { -limit } else { *a };
            }
        }
        let mean = self.state.parameters[self.policy.value_mean_index()].to_f64();
        let std = self.state.parameters[self.policy.value_std_index()].to_f64();
        self.targets.clear();
        self.targets
            .extend(batch.returns.iter().map(|r| standardise(r, mean, std)));
    }

    /// Fills `gradient` with that of the loss over the samples at `indices`, and returns the loss's terms and the gradient's
    /// norm. Each shard takes a fixed part of the samples: how many threads there are changes no sum.
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

    /// Adds the shards' gradients in order, piece by piece, and returns the norm of the sum. Pieces have a fixed size and their
    /// squares are added in order, so that the norm has the same bits at any number of threads.
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

    /// Takes one gradient step; `norm` is that of the gradient.
    fn step(&mut self, norm: f64) {
        let (config, rate) = (&self.config, self.state.learning_rate);
        // A KL divergence says how far the actor may go, and nothing of the critic.
        let critic = config.critic_learning_rate.unwrap_or(config.learning_rate) * self.anneal;
        let rule = Rule {
            adam: config.adam,
            momentum: config.momentum,
            max_norm: config.max_gradient_norm,
            learning_rate: rate,
            critic_from: self.policy.critic_range().start,
            critic_learning_rate: critic,
        };
        let state = &mut self.state;
        state
            .adam
            .step(&rule, &mut state.parameters, &self.gradient, norm);
    }

    fn summary(&self, totals: &UpdateTotals, batch: &Batch<T>) -> UpdateStats {
        let steps = totals.steps.max(1) as f64;
        let terms = totals.terms.scaled(1.0 / steps);
        UpdateStats {
            policy_loss: terms.policy,
            value_loss: terms.value,
            action_bound_loss: terms.action_bound,
            approx_kl: totals.kl(),
            clip_fraction: terms.clip_fraction,
            explained_variance: explained_variance(batch.values, batch.returns),
            entropy: entropy(&self.state.parameters[self.policy.log_std_range()]),
            gradient_norm: totals.norms / steps,
            learning_rate: self.state.learning_rate,
            steps: totals.steps,
            stopped_early: totals.stopped.is_some(),
        }
    }

    /// Moves the learning rate towards updates of the target KL divergence: the factors are those of `rsl_rl`, the program
    /// of Rudin et al. 2022, "Learning to walk in minutes using massively parallel deep reinforcement learning".
    fn adapt_learning_rate(&mut self, kl: f64) {
        let Some(target) = self.config.target_kl else {
            return;
        };
        let rate = &mut self.state.learning_rate;
        if kl > 2.0 * target {
            *rate = (*rate / 1.5).max(self.config.min_learning_rate);
        } else if kl < 0.5 * target {
            *rate = (*rate * 1.5).min(self.config.largest_rate(self.anneal));
        }
    }
}
