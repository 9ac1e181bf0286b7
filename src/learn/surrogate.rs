//! The PPO loss of a few samples and its gradient.

use super::kernels::Scalar;
use super::network::Workspace;
use super::policy::{Policy, standardised_log_prob};
use std::ops::{AddAssign, Range};

/// The weights of the loss's terms.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Objective {
    /// ε of the clipped surrogate.
    pub(crate) clip: f64,
    pub(crate) value_coefficient: f64,
    pub(crate) entropy_coefficient: f64,
    pub(crate) action_bound: f64,
    pub(crate) action_bound_coefficient: f64,
    pub(crate) learn_std: bool,
}

/// Samples as the loss wants them, a row each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Samples<'a, T> {
    pub(crate) observations: &'a [T],
    pub(crate) actions: &'a [T],
    pub(crate) log_probs: &'a [T],
    /// Normalised.
    pub(crate) advantages: &'a [T],
    /// Returns on the critic's scale.
    pub(crate) targets: &'a [T],
}

/// Means over samples of the loss's terms, each before its coefficient.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LossTerms {
    /// `−min(r·A, clip(r, 1 ± ε)·A)`.
    pub policy: f64,
    /// Squared error of the critic on its own scale.
    pub value: f64,
    /// Squared excess of the mean action over the bound, summed over actions.
    pub action_bound: f64,
    /// `(r − 1) − log r`, an estimate of KL(old ‖ new) that is never negative (Schulman 2020, "Approximating KL
    /// divergence").
    pub approx_kl: f64,
    /// Share of samples whose ratio lies outside 1 ± ε.
    pub clip_fraction: f64,
}

impl AddAssign for LossTerms {
    fn add_assign(&mut self, other: Self) {
        self.policy += other.policy;
        self.value += other.value;
        self.action_bound += other.action_bound;
        self.approx_kl += other.approx_kl;
        self.clip_fraction += other.clip_fraction;
    }
}

impl LossTerms {
    pub(crate) fn scaled(mut self, factor: f64) -> Self {
        self.policy *= factor;
        self.value *= factor;
        self.action_bound *= factor;
        self.approx_kl *= factor;
        self.clip_fraction *= factor;
        self
    }
}

/// One of the fixed number of pieces that a minibatch is cut into: buffers and results.
#[derive(Clone, Debug)]
pub(crate) struct Shard<T> {
    /// `[parameters]`: what this shard adds to the minibatch's gradient.
    pub(crate) gradient: Vec<T>,
    /// Sums over this shard's samples.
    pub(crate) terms: LossTerms,
    /// Normalised observations of this shard's samples, a row each.
    observations: Vec<T>,
    actor: NetworkPass<T>,
    critic: NetworkPass<T>,
}

/// What one of the two networks works with.
#[derive(Clone, Debug, Default)]
struct NetworkPass<T> {
    network: Workspace<T>,
    /// `[samples, outputs]`: gradient by the network's output.
    delta: Vec<T>,
    terms: LossTerms,
}

/// What the two networks of a shard read.
#[derive(Clone, Copy)]
struct Inputs<'a, T> {
    policy: &'a Policy,
    objective: &'a Objective,
    parameters: &'a [T],
    samples: &'a Samples<'a, T>,
    indices: &'a [u32],
    /// Normalised observations of `indices`, a row each.
    observations: &'a [T],
    /// One over the samples of the whole minibatch.
    weight: f64,
}

impl<T: Scalar> Shard<T> {
    pub(crate) fn new(parameters: usize) -> Self {
        let gradient = vec![T::ZERO; parameters];
        let pass = NetworkPass {
            network: Workspace::default(),
            delta: Vec::new(),
            terms: LossTerms::default(),
        };
        let terms = LossTerms::default();
        Self {
            gradient,
            terms,
            observations: Vec::new(),
            actor: pass.clone(),
            critic: pass,
        }
    }

    /// Loss and gradient of the samples at `indices`, as their part of a minibatch of `minibatch` samples.
    pub(crate) fn run(
        &mut self,
        policy: &Policy,
        objective: &Objective,
        parameters: &[T],
        samples: &Samples<T>,
        indices: &[u32],
        minibatch: usize,
    ) {
        let width = policy.spec().observation;
        self.observations.clear();
        for &i in indices {
            self.observations
                .extend_from_slice(row(samples.observations, i, width));
        }
        self.gradient.fill(T::ZERO);
        let inputs = Inputs {
            policy,
            objective,
            parameters,
            samples,
            indices,
            observations: &self.observations,
            weight: 1.0 / minibatch as f64,
        };
        // The two networks share no parameter, so their passes run side by side.
        let (actor_gradient, critic_gradient) =
            self.gradient.split_at_mut(policy.critic_range().start);
        rayon::join(
            || self.actor.run_actor(inputs, actor_gradient),
            || self.critic.run_critic(inputs, critic_gradient),
        );
        self.terms = self.actor.terms;
        self.terms += self.critic.terms;
    }
}

impl<T: Scalar> NetworkPass<T> {
    /// The terms that depend on the actions, and their gradient. `gradient` covers the actor's parameters and `log_std`.
    fn run_actor(&mut self, inputs: Inputs<T>, gradient: &mut [T]) {
        let (policy, parameters) = (inputs.policy, inputs.parameters);
        let (observations, batch) = (inputs.observations, inputs.indices.len());
        let actor_parameters = &parameters[policy.actor_range()];
        let means = policy
            .actor
            .forward(actor_parameters, observations, batch, &mut self.network);
        let (network_gradient, log_std_gradient) =
            gradient.split_at_mut(policy.actor.parameter_count());
        self.delta.clear();
        self.delta.resize(means.len(), T::ZERO);
        self.terms = policy_terms(inputs, means, &mut self.delta, log_std_gradient);
        policy.actor.backward(
            actor_parameters,
            observations,
            batch,
            &self.delta,
            &mut self.network,
            network_gradient,
        );
    }

    /// Squared errors of the values on the critic's scale, and their gradient. `gradient` covers the critic's parameters and
    /// what comes after them, which isn't learned by gradient.
    fn run_critic(&mut self, inputs: Inputs<T>, gradient: &mut [T]) {
        let (policy, parameters) = (inputs.policy, inputs.parameters);
        let (observations, batch) = (inputs.observations, inputs.indices.len());
        let critic_parameters = &parameters[policy.critic_range()];
        let values =
            policy
                .critic
                .forward(critic_parameters, observations, batch, &mut self.network);
        let slope = T::from_f64(2.0 * inputs.objective.value_coefficient * inputs.weight);
        self.terms = LossTerms::default();
        self.delta.clear();
        for (&value, &i) in values.iter().zip(inputs.indices) {
            let error = value - inputs.samples.targets[i as usize];
            self.terms.value += (error * error).to_f64();
            self.delta.push(slope * error);
        }
        policy.critic.backward(
            critic_parameters,
            observations,
            batch,
            &self.delta,
            &mut self.network,
            &mut gradient[..policy.critic.parameter_count()],
        );
    }
}

/// The clipped surrogate of Schulman et al. 2017, "Proximal policy optimization algorithms", eq. 7, the entropy and the
/// action bound: their sums over samples, and their gradients by the mean actions and by log σ.
fn policy_terms<T: Scalar>(
    inputs: Inputs<T>,
    means: &[T],
    delta: &mut [T],
    log_std_gradient: &mut [T],
) -> LossTerms {
    let (policy, objective, samples) = (inputs.policy, inputs.objective, inputs.samples);
    let actions = policy.spec().action;
    let log_std = &inputs.parameters[policy.log_std_range()];
    let inverse_std: Vec<T> = log_std.iter().map(|&s| (-s).exp()).collect();
    let mut z = vec![T::ZERO; actions];
    let mut terms = LossTerms::default();
    let rows = means
        .chunks_exact(actions)
        .zip(delta.chunks_exact_mut(actions));
    for ((mean, delta), &i) in rows.zip(inputs.indices) {
        let action = row(samples.actions, i, actions);
        for (((z, &a), &m), &s) in z.iter_mut().zip(action).zip(mean).zip(&inverse_std) {
            *z = (a - m) * s;
        }
        // r = π(a|s)/π_old(a|s), from the difference of log-probabilities: densities themselves over- and underflow.
        let log_ratio = standardised_log_prob(&z, log_std) - samples.log_probs[i as usize];
        let advantage = samples.advantages[i as usize];
        let by_log_prob = surrogate(log_ratio, advantage, objective.clip, &mut terms);
        let by_log_prob = by_log_prob * T::from_f64(inputs.weight);
        // With z = (a − μ)/σ: ∂ log π/∂μ = z/σ and ∂ log π/∂ log σ = z² − 1.
        for ((d, &z), &s) in delta.iter_mut().zip(&z).zip(&inverse_std) {
            *d = by_log_prob * z * s;
        }
        if objective.learn_std {
            for (g, &z) in log_std_gradient.iter_mut().zip(&z) {
                *g += by_log_prob * (z * z - T::ONE);
            }
        }
        terms.action_bound += action_bound(mean, objective, inputs.weight, delta);
    }
    if objective.learn_std {
        reward_entropy(inputs, log_std_gradient);
    }
    terms
}

/// Adds the gradient of the entropy's share of the loss. The entropy is Σ log σ and a constant, so each log σ has slope 1; it is
/// rewarded, hence the minus.
fn reward_entropy<T: Scalar>(inputs: Inputs<T>, log_std_gradient: &mut [T]) {
    let samples = inputs.indices.len() as f64;
    let share = T::from_f64(inputs.objective.entropy_coefficient * inputs.weight * samples);
    log_std_gradient.iter_mut().for_each(|g| *g = *g - share);
}

/// Adds one sample's terms, and returns the derivative of its surrogate by the log-probability.
fn surrogate<T: Scalar>(log_ratio: T, advantage: T, clip: f64, terms: &mut LossTerms) -> T {
    let ratio = log_ratio.exp();
    let (low, high) = (T::from_f64(1.0 - clip), T::from_f64(1.0 + clip));
    let clipped = if ratio < low { low } else { ratio };
    let clipped = if clipped > high { high } else { clipped };
    let plain = ratio * advantage;
    let held = clipped * advantage;
    // exp(x) − 1 − x loses all its digits near x = 0, where most ratios are; `exp_m1` keeps them.
    terms.approx_kl += log_ratio.to_f64().exp_m1() - log_ratio.to_f64();
    if clipped != ratio {
        terms.clip_fraction += 1.0;
    }
    // min(r·A, clip(r)·A): where the clipped branch is the smaller one, moving r further earns nothing and has no slope.
    if held < plain {
        terms.policy -= held.to_f64();
        T::ZERO
    } else {
        terms.policy -= plain.to_f64();
        -plain
    }
}

/// The squared excess of a mean action beyond ± the bound; adds its gradient to `delta`.
fn action_bound<T: Scalar>(mean: &[T], objective: &Objective, weight: f64, delta: &mut [T]) -> f64 {
    if objective.action_bound_coefficient == 0.0 {
        return 0.0;
    }
    let bound = T::from_f64(objective.action_bound);
    let slope = T::from_f64(2.0 * objective.action_bound_coefficient * weight);
    let mut sum = 0.0;
    for (&m, d) in mean.iter().zip(delta) {
        let excess = if m > bound {
            m - bound
        } else if m < -bound {
            m + bound
        } else {
            continue;
        };
        *d += slope * excess;
        sum += (excess * excess).to_f64();
    }
    sum
}

fn row<T>(values: &[T], index: u32, width: usize) -> &[T] {
    let start = index as usize * width;
    let range: Range<usize> = start..start + width;
    &values[range]
}
