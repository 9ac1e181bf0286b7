//! Writes what one PPO update reads and makes, in f64 and f32, for `tests/outside/ppo_update.py` to compute again.
//!
//! `cargo run --release --example ppo_update -- FOLDER` writes `f64.safetensors` and `f32.safetensors`.

use mimic::learn::{
    ActWorkspace, Activation, Batch, Config, Learner, PolicySpec, Scalar, fill_normal, shuffled,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use safetensors::tensor::{Dtype, TensorView, serialize};
use std::collections::HashMap;
use std::error::Error;
use std::path::Path;

const SAMPLES: usize = 600;

fn config() -> Config {
    Config {
        epochs: 2,
        minibatch: 150,
        learning_rate: 1e-3,
        target_kl: None,
        learn_std: true,
        entropy_coefficient: 0.01,
        action_bound: 0.1,
        action_bound_coefficient: 0.5,
        max_gradient_norm: 0.3,
        ..Config::default()
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

fn write<T: Scalar>(path: &Path) -> Result<(), Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(2024);
    let mut learner = learner::<T>(&mut rng)?;
    let spec = learner.policy().spec().clone();
    let observations = random::<T>(SAMPLES * spec.observation, &mut rng);
    let noise = random::<T>(SAMPLES * spec.action, &mut rng);
    let mut workspace = ActWorkspace::default();
    let acted =
        learner
            .policy()
            .act(learner.parameters(), &observations, &noise, &mut workspace)?;
    let (actions, values) = (acted.actions.to_vec(), acted.values.to_vec());
    // As if the actions had come from an older policy: ratios fall on both sides of the clipping range.
    let shift = random::<T>(SAMPLES, &mut rng);
    let old = acted.log_probs.iter().zip(shift);
    let log_probs: Vec<T> = old.map(|(&l, s)| l + T::from_f64(0.2) * s).collect();
    let advantages = random::<T>(SAMPLES, &mut rng);
    let scaled = random::<T>(SAMPLES, &mut rng).into_iter();
    let returns: Vec<T> = scaled
        .map(|r| T::from_f64(7.0) + T::from_f64(3.0) * r)
        .collect();
    let batch = Batch {
        observations: &observations,
        actions: &actions,
        log_probs: &log_probs,
        values: &values,
        advantages: &advantages,
        returns: &returns,
    };

    let mut tensors = Tensors::new();
    let before = learner.parameters().to_vec();
    push(&mut tensors, "parameters_before", &before);
    push(&mut tensors, "observations", &observations);
    push(&mut tensors, "noise", &noise);
    push(&mut tensors, "actions", &actions);
    push(&mut tensors, "log_probs_acted", acted.log_probs);
    push(&mut tensors, "log_probs", &log_probs);
    push(&mut tensors, "values", &values);
    push(&mut tensors, "advantages", &advantages);
    push(&mut tensors, "returns", &returns);
    let first: Vec<u32> = (0..150).collect();
    let (terms, gradient) = learner.gradient(&batch, &first)?;
    let terms = [
        terms.policy,
        terms.value,
        terms.action_bound,
        terms.approx_kl,
        terms.clip_fraction,
    ];
    push(&mut tensors, "gradient_terms", &terms);
    push(&mut tensors, "gradient", gradient);
    let mut peek = rng.clone();
    let order: Vec<f64> = (0..config().epochs)
        .flat_map(|_| shuffled(SAMPLES, &mut peek))
        .map(f64::from)
        .collect();
    push(&mut tensors, "order", &order);
    let stats = learner.update(&batch, &mut rng)?;
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
