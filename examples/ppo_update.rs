//! Writes the inputs and results of one PPO update, in f64 and f32. `tests/outside/ppo_update.py` computes it again in JAX.
//!
//! `cargo run --release --example ppo_update -- FOLDER` writes `f64.safetensors` and `f32.safetensors`.

use mimic::learn::{
    ActWorkspace, Activation, Batch, Learner, PolicySpec, PpoConfig, Scalar, fill_normal, shuffled,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use safetensors::tensor::{Dtype, TensorView, serialize};
use std::collections::HashMap;
use std::error::Error;
use std::path::Path;

const SAMPLES: usize = 600;

fn config() -> PpoConfig {
    PpoConfig {
        epochs: 2,
        minibatch: 150,
        learning_rate: 1e-3,
        target_kl: None,
        learn_std: true,
        entropy_coefficient: 0.01,
        action_bound: 0.1,
        action_bound_coefficient: 0.5,
        max_gradient_norm: 0.3,
        ..PpoConfig::default()
    }
}

/// Tensors of one file: name, type, shape, little-endian bytes.
type Tensors = Vec<(String, Dtype, Vec<usize>, Vec<u8>)>;

fn push<T: Scalar>(tensors: &mut Tensors, name: &str, values: &[T]) {
    let bytes = values
        .iter()
        .flat_map(|v| v.to_f64().to_le_bytes())
        .collect();
    tensors.push((name.to_owned(), Dtype::F64, vec![values.len()], bytes));
}

fn random<T: Scalar>(count: usize, rng: &mut ChaCha8Rng) -> Vec<T> {
    let mut values = vec![T::ZERO; count];
    fill_normal(&mut values, rng);
    values
}

/// A learner that has left its initial point, so that its actions reach the bound.
fn learner<T: Scalar>(rng: &mut ChaCha8Rng) -> Result<Learner<T>, Box<dyn Error>> {
    let spec = PolicySpec {
        observation: 17,
        action: 6,
        hidden: vec![48, 32],
        activation: Activation::Relu,
    };
    let mut learner = Learner::new(config(), spec, rng)?;
    let mut state = learner.state().clone();
    let shift = random::<T>(state.parameters.len() - 2, rng);
    for (p, s) in state.parameters.iter_mut().zip(shift) {
        *p += T::from_f64(0.03) * s;
    }
    learner.restore(state)?;
    Ok(learner)
}

/// A batch and what its making needs to be checked.
struct Experience<T> {
    observations: Vec<T>,
    noise: Vec<T>,
    actions: Vec<T>,
    /// Of the actions, under the policy that acted.
    log_probs_acted: Vec<T>,
    log_probs: Vec<T>,
    values: Vec<T>,
    advantages: Vec<T>,
    returns: Vec<T>,
}

impl<T: Scalar> Experience<T> {
    fn new(learner: &Learner<T>, rng: &mut ChaCha8Rng) -> Result<Self, Box<dyn Error>> {
        let policy = learner.policy();
        let observations = random::<T>(SAMPLES * policy.spec().observation, rng);
        let noise = random::<T>(SAMPLES * policy.spec().action, rng);
        let mut workspace = ActWorkspace::default();
        let acted = policy.act(learner.parameters(), &observations, &noise, &mut workspace)?;
        let mut judging = ActWorkspace::default();
        let values = policy.values(learner.parameters(), &observations, &mut judging)?;
        // As if an older policy had acted: ratios fall on both sides of the clipping range.
        let shift = random::<T>(SAMPLES, rng);
        let log_probs = acted.log_probs.iter().zip(shift);
        let log_probs = log_probs.map(|(&l, s)| l + T::from_f64(0.2) * s).collect();
        let advantages = random(SAMPLES, rng);
        let returns = random::<T>(SAMPLES, rng).into_iter();
        let returns = returns.map(|r| T::from_f64(7.0) + T::from_f64(3.0) * r);
        Ok(Self {
            actions: acted.actions.to_vec(),
            log_probs_acted: acted.log_probs.to_vec(),
            log_probs,
            values: values.to_vec(),
            advantages,
            returns: returns.collect(),
            observations,
            noise,
        })
    }

    fn batch(&self) -> Batch<'_, T> {
        Batch {
            observations: &self.observations,
            actions: &self.actions,
            log_probs: &self.log_probs,
            values: &self.values,
            advantages: &self.advantages,
            returns: &self.returns,
        }
    }

    fn push(&self, tensors: &mut Tensors) {
        push(tensors, "observations", &self.observations);
        push(tensors, "noise", &self.noise);
        push(tensors, "actions", &self.actions);
        push(tensors, "log_probs_acted", &self.log_probs_acted);
        push(tensors, "log_probs", &self.log_probs);
        push(tensors, "values", &self.values);
        push(tensors, "advantages", &self.advantages);
        push(tensors, "returns", &self.returns);
    }
}

fn write<T: Scalar>(path: &Path) -> Result<(), Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(2024);
    let mut learner = learner::<T>(&mut rng)?;
    let experience = Experience::new(&learner, &mut rng)?;
    let mut tensors = Tensors::new();
    experience.push(&mut tensors);
    push(&mut tensors, "parameters_before", learner.parameters());
    let first: Vec<u32> = (0..150).collect();
    let (terms, gradient) = learner.gradient(&experience.batch(), &first)?;
    let losses = [terms.policy, terms.value, terms.action_bound];
    push(&mut tensors, "losses", &losses);
    push(
        &mut tensors,
        "divergence",
        &[terms.approx_kl, terms.clip_fraction],
    );
    push(&mut tensors, "gradient", gradient);
    // The update draws the same orders from the same state of the stream.
    let mut peek = rng.clone();
    let orders = (0..config().epochs).flat_map(|_| shuffled(SAMPLES, &mut peek));
    push(
        &mut tensors,
        "order",
        &orders.map(f64::from).collect::<Vec<_>>(),
    );
    let stats = learner.update(&experience.batch(), &mut rng)?;
    push(&mut tensors, "parameters_after", learner.parameters());
    save(path, &tensors, &learner, serde_json::to_value(stats)?)
}

fn save<T: Scalar>(
    path: &Path,
    tensors: &Tensors,
    learner: &Learner<T>,
    stats: serde_json::Value,
) -> Result<(), Box<dyn Error>> {
    let layout = learner.policy().tensors();
    let layout = layout
        .iter()
        .map(|t| (&t.name, &t.shape, t.range.start))
        .collect::<Vec<_>>();
    let metadata =
        serde_json::json!({ "config": learner.config(), "layout": layout, "stats": stats });
    let views = tensors.iter().map(|(name, dtype, shape, bytes)| {
        TensorView::new(*dtype, shape.clone(), bytes).map(|view| (name.as_str(), view))
    });
    let metadata = HashMap::from([("mimic".to_owned(), metadata.to_string())]);
    std::fs::write(
        path,
        serialize(views.collect::<Result<Vec<_>, _>>()?, Some(metadata))?,
    )?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: ppo_update FOLDER")?;
    let folder = Path::new(&folder);
    write::<f64>(&folder.join("f64.safetensors"))?;
    write::<f32>(&folder.join("f32.safetensors"))
}
