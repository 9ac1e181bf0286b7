//! The policy: a diagonal Gaussian around an actor network, and a critic, in one flat parameter vector.

use super::activation::Activation;
use super::error::{LearnError, check_length};
use super::kernels::Scalar;
use super::network::{Mlp, Workspace};
use crate::schema::OutOfRange;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::fmt;
use std::ops::Range;

/// The shape of a policy: all that its parameter vector's layout depends on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PolicySpec {
    /// Numbers in an observation.
    pub observation: usize,
    /// Numbers in an action.
    pub action: usize,
    /// Hidden widths of the actor and of the critic.
    pub hidden: Vec<usize>,
    /// What follows every hidden layer.
    #[serde(default)]
    pub activation: Activation,
}

impl fmt::Display for PolicySpec {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self {
            observation,
            action,
            hidden,
            activation,
        } = self;
        let widths: Vec<String> = hidden.iter().map(usize::to_string).collect();
        let (widths, activation) = (widths.join(", "), json!(activation));
        let activation = activation.as_str().unwrap_or_default();
        write!(
            f,
            "of {observation} observations, hidden layers of {widths} ({activation}), and {action} actions"
        )
    }
}

/// A piece of the parameter vector with a name and a shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedTensor {
    /// Its name in files, such as `actor.0.weight`.
    pub name: String,
    /// Its dimensions, row-major.
    pub shape: Vec<usize>,
    /// Where it lies in the parameter vector.
    pub range: Range<usize>,
}

/// Networks and layout of a policy; the parameters themselves are a plain vector of [`Policy::parameter_count`] values.
///
/// In order: `actor.L.weight`, `actor.L.bias`, `log_std` (natural logarithm of the action noise), `critic.L.weight`,
/// `critic.L.bias`, `value_mean`, `value_std`. The critic puts out `(value − value_mean) / value_std`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Policy {
    spec: PolicySpec,
    pub(crate) actor: Mlp,
    pub(crate) critic: Mlp,
}

/// Buffers for acting, one per thread.
#[derive(Clone, Debug, Default)]
pub struct ActWorkspace<T> {
    network: Workspace<T>,
    std: Vec<T>,
    means: Vec<T>,
    actions: Vec<T>,
    log_probs: Vec<T>,
    values: Vec<T>,
}

/// What a policy did on a batch of observations.
#[derive(Clone, Copy, Debug)]
pub struct Acted<'w, T> {
    /// `[batch, action]`: what it would have done without noise.
    pub means: &'w [T],
    /// `[batch, action]`: mean + std · noise.
    pub actions: &'w [T],
    /// `[batch]`: natural logarithm of the actions' probability density.
    pub log_probs: &'w [T],
}

/// Largest width of a layer, and most hidden layers. Chosen: far above any use, and a damaged file can't ask for more memory
/// than there is.
const MAX_WIDTH: usize = 1 << 16;
const MAX_LAYERS: usize = 16;
/// Most parameters. Chosen: twenty times the largest network of the presets; a learner holds about ten numbers for each.
const MAX_PARAMETERS: usize = 1 << 24;

/// Rows in one pass of the critic. A product of larger matrices is cut into blocks by its size, which gives other bits.
const CRITIC_ROWS: usize = 64;

impl Policy {
    /// The networks of this shape.
    ///
    /// # Errors
    /// A width of 0 or above 65536, more than 16 hidden layers, or more than 16,777,216 parameters.
    pub fn new(spec: PolicySpec) -> Result<Self, LearnError> {
        let widths = spec.hidden.iter().chain([&spec.observation, &spec.action]);
        for &width in widths {
            // Bounds that also keep every later product of sizes far from overflow.
            if !(1..=MAX_WIDTH).contains(&width) {
                return Err(setting(
                    "network width",
                    width,
                    "a whole number from 1 to 65536",
                ));
            }
        }
        if spec.hidden.len() > MAX_LAYERS {
            return Err(setting(
                "number of hidden layers",
                spec.hidden.len(),
                "a whole number from 0 to 16",
            ));
        }
        let actor = Mlp::new(spec.observation, &spec.hidden, spec.action, spec.activation);
        let critic = Mlp::new(spec.observation, &spec.hidden, 1, spec.activation);
        let policy = Self {
            spec,
            actor,
            critic,
        };
        match policy.parameter_count() {
            ..=MAX_PARAMETERS => Ok(policy),
            count => Err(setting(
                "hidden",
                format!("a network of {count} parameters"),
                format!("widths that make at most {MAX_PARAMETERS} of them"),
            )),
        }
    }

    /// The shape.
    pub fn spec(&self) -> &PolicySpec {
        &self.spec
    }

    /// Length of the parameter vector.
    pub fn parameter_count(&self) -> usize {
        self.value_std_index() + 1
    }

    pub(crate) fn actor_range(&self) -> Range<usize> {
        0..self.actor.parameter_count()
    }

    /// Where the natural logarithm of the action noise lies in the parameter vector, one number for each action.
    pub fn log_std_range(&self) -> Range<usize> {
        let start = self.actor_range().end;
        start..start + self.spec.action
    }

    pub(crate) fn critic_range(&self) -> Range<usize> {
        let start = self.log_std_range().end;
        start..start + self.critic.parameter_count()
    }

    pub(crate) fn value_mean_index(&self) -> usize {
        self.critic_range().end
    }

    pub(crate) fn value_std_index(&self) -> usize {
        self.value_mean_index() + 1
    }

    /// Every piece of the parameter vector, in order.
    pub fn tensors(&self) -> Vec<NamedTensor> {
        let mut tensors = network_tensors("actor", &self.actor, 0);
        tensors.push(vector("log_std", self.log_std_range()));
        tensors.extend(network_tensors(
            "critic",
            &self.critic,
            self.critic_range().start,
        ));
        tensors.push(vector(
            "value_mean",
            self.value_mean_index()..self.value_mean_index() + 1,
        ));
        tensors.push(vector(
            "value_std",
            self.value_std_index()..self.value_std_index() + 1,
        ));
        tensors
    }

    /// Orthogonal weights, and action noise of standard deviation `std`. The actor's last layer is scaled by 0.01, so that a
    /// new policy acts close to zero, as Andrychowicz et al. 2021, "What matters for on-policy deep actor-critic methods?",
    /// recommend.
    pub fn initialise<T: Scalar>(&self, std: f64, rng: &mut ChaCha8Rng) -> Vec<T> {
        let mut parameters = vec![T::ZERO; self.parameter_count()];
        self.actor
            .initialise(0.01, rng, &mut parameters[self.actor_range()]);
        parameters[self.log_std_range()].fill(T::from_f64(std.ln()));
        self.critic
            .initialise(1.0, rng, &mut parameters[self.critic_range()]);
        parameters[self.value_std_index()] = T::ONE;
        parameters
    }

    /// Acts on normalised `observations` `[batch, observation]` with standard normal `noise` `[batch, action]`.
    ///
    /// # Errors
    /// Parameters, observations or noise of another length than the shape says.
    pub fn act<'w, T: Scalar>(
        &self,
        parameters: &[T],
        observations: &[T],
        noise: &[T],
        workspace: &'w mut ActWorkspace<T>,
    ) -> Result<Acted<'w, T>, LearnError> {
        let batch = self.batch_of(parameters, observations)?;
        check_length("action noise", noise.len(), batch * self.spec.action)?;
        self.run_actor(parameters, observations, batch, workspace);
        let ActWorkspace {
            std,
            means,
            actions,
            log_probs,
            ..
        } = workspace;
        let log_std = &parameters[self.log_std_range()];
        let width = log_std.len();
        std.clear();
        std.extend(log_std.iter().map(|s| s.exp()));
        actions.clear();
        for (mean, noise) in means.chunks_exact(width).zip(noise.chunks_exact(width)) {
            let row = mean.iter().zip(noise).zip(&*std);
            actions.extend(row.map(|((&m, &n), &s)| m + s * n));
        }
        // (action − mean)/std is the noise itself, free of the rounding of the sum above.
        log_probs.clear();
        log_probs.extend(
            noise
                .chunks_exact(log_std.len())
                .map(|z| standardised_log_prob(z, log_std)),
        );
        Ok(Acted {
            means,
            actions,
            log_probs,
        })
    }

    /// The mean actions `[batch, action]`: what the policy does without noise.
    ///
    /// # Errors
    /// Parameters or observations of another length than the shape says.
    pub fn mean<'w, T: Scalar>(
        &self,
        parameters: &[T],
        observations: &[T],
        workspace: &'w mut ActWorkspace<T>,
    ) -> Result<&'w [T], LearnError> {
        let batch = self.batch_of(parameters, observations)?;
        self.run_actor(parameters, observations, batch, workspace);
        Ok(&workspace.means)
    }

    /// The critic's estimates of the discounted return, `[batch]`.
    ///
    /// # Errors
    /// Parameters or observations of another length than the shape says.
    pub fn values<'w, T: Scalar>(
        &self,
        parameters: &[T],
        observations: &[T],
        workspace: &'w mut ActWorkspace<T>,
    ) -> Result<&'w [T], LearnError> {
        self.batch_of(parameters, observations)?;
        workspace.values.clear();
        for part in observations.chunks(CRITIC_ROWS * self.spec.observation) {
            self.run_critic(parameters, part, workspace);
        }
        Ok(&workspace.values)
    }

    fn batch_of<T>(&self, parameters: &[T], observations: &[T]) -> Result<usize, LearnError> {
        check_length("parameter vector", parameters.len(), self.parameter_count())?;
        let batch = observations.len() / self.spec.observation;
        check_length(
            "batch of observations",
            observations.len(),
            batch * self.spec.observation,
        )?;
        Ok(batch)
    }

    fn run_actor<T: Scalar>(
        &self,
        parameters: &[T],
        x: &[T],
        batch: usize,
        workspace: &mut ActWorkspace<T>,
    ) {
        let means = self.actor.forward(
            &parameters[self.actor_range()],
            x,
            batch,
            &mut workspace.network,
        );
        workspace.means.clear();
        workspace.means.extend_from_slice(means);
    }

    fn run_critic<T: Scalar>(&self, parameters: &[T], x: &[T], workspace: &mut ActWorkspace<T>) {
        let values = self.critic.forward(
            &parameters[self.critic_range()],
            x,
            x.len() / self.spec.observation,
            &mut workspace.network,
        );
        let (mean, std) = (
            parameters[self.value_mean_index()],
            parameters[self.value_std_index()],
        );
        workspace
            .values
            .extend(values.iter().map(|&v| mean + std * v));
    }
}

/// `log N(μ + σ·z; μ, σ)` for a diagonal Gaussian: `−½Σz² − Σlog σ − ½n·log 2π`.
pub(crate) fn standardised_log_prob<T: Scalar>(z: &[T], log_std: &[T]) -> T {
    let half_log_two_pi = T::from_f64(0.5 * std::f64::consts::TAU.ln());
    let half = T::from_f64(0.5);
    let mut sum = T::ZERO;
    for (&z, &s) in z.iter().zip(log_std) {
        sum += half * z * z + s + half_log_two_pi;
    }
    -sum
}

/// The entropy of a diagonal Gaussian, nats: `Σ(log σ + ½·log 2πe)`.
pub(crate) fn entropy<T: Scalar>(log_std: &[T]) -> f64 {
    let each = 0.5 * (std::f64::consts::TAU.ln() + 1.0);
    log_std.iter().map(|s| s.to_f64() + each).sum()
}

/// Fills `noise` with standard normal deviates.
pub fn fill_normal<T: Scalar>(noise: &mut [T], rng: &mut ChaCha8Rng) {
    for x in noise {
        let deviate: f64 = StandardNormal.sample(rng);
        *x = T::from_f64(deviate);
    }
}

fn setting(name: &str, value: impl ToString, allowed: impl Into<String>) -> LearnError {
    LearnError::Setting(OutOfRange {
        setting: name.to_owned(),
        value: value.to_string(),
        allowed: allowed.into(),
    })
}

fn vector(name: &str, range: Range<usize>) -> NamedTensor {
    NamedTensor {
        name: name.to_owned(),
        shape: vec![range.len()],
        range,
    }
}

fn network_tensors(prefix: &str, network: &Mlp, offset: usize) -> Vec<NamedTensor> {
    let shift = |range: &Range<usize>| range.start + offset..range.end + offset;
    let layers = network.layers().iter().enumerate();
    layers
        .flat_map(|(index, layer)| {
            let weight = NamedTensor {
                name: format!("{prefix}.{index}.weight"),
                shape: vec![layer.inputs, layer.outputs],
                range: shift(&layer.weight),
            };
            [
                weight,
                vector(&format!("{prefix}.{index}.bias"), shift(&layer.bias)),
            ]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::rand_core::SeedableRng;

    fn policy() -> Policy {
        let spec = PolicySpec {
            observation: 3,
            action: 2,
            hidden: vec![8, 5],
            activation: Activation::Relu,
        };
        Policy::new(spec).unwrap()
    }

    #[test]
    fn tensors_cover_the_parameter_vector_without_gaps() {
        let mut end = 0;
        for tensor in policy().tensors() {
            assert_eq!(tensor.range.start, end, "{}", tensor.name);
            assert_eq!(tensor.range.len(), tensor.shape.iter().product::<usize>());
            end = tensor.range.end;
        }
        assert_eq!(end, policy().parameter_count());
    }

    #[test]
    fn log_prob_is_that_of_independent_normals() {
        let policy = policy();
        let parameters: Vec<f64> = policy.initialise(0.3, &mut ChaCha8Rng::seed_from_u64(1));
        let mut workspace = ActWorkspace::default();
        let acted = policy
            .act(&parameters, &[0.1, -0.4, 2.0], &[0.7, -1.3], &mut workspace)
            .unwrap();
        let density = |a: f64, m: f64| {
            let z = (a - m) / 0.3;
            (-0.5 * z * z).exp() / (0.3 * std::f64::consts::TAU.sqrt())
        };
        let product: f64 = acted
            .actions
            .iter()
            .zip(acted.means)
            .map(|(&a, &m)| density(a, m))
            .product();
        assert!((acted.log_probs[0] - product.ln()).abs() < 1e-12);
    }

    #[test]
    fn wrong_lengths_and_sizes_are_errors() {
        let policy = policy();
        let mut workspace = ActWorkspace::default();
        let parameters = vec![0.0_f32; policy.parameter_count()];
        assert!(policy.mean(&parameters, &[0.0; 4], &mut workspace).is_err());
        assert!(
            policy
                .mean(&parameters[1..], &[0.0; 3], &mut workspace)
                .is_err()
        );
        let spec = PolicySpec {
            observation: 0,
            ..policy.spec().clone()
        };
        assert!(Policy::new(spec).is_err());
    }
}
