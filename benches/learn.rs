//! Speed of learning and of acting, on one and two threads.
//!
//! `cargo bench -p mimic --bench learn`. All cases alternate within each round; figures are medians over rounds, so that
//! their ratios mean something on a machine that does other work too.

use mimic::learn::{
    ActWorkspace, Activation, Batch, FrozenNormalizer, Learner, Normalizer, PolicySpec, PpoConfig,
    fill_normal,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use std::error::Error;
use std::time::Instant;

const OBSERVATION: usize = 220;
const ACTION: usize = 28;
const SAMPLES: usize = 4096;
const ROUNDS: usize = 9;

fn normal(count: usize, rng: &mut ChaCha8Rng) -> Vec<f32> {
    let mut values = vec![0.0; count];
    fill_normal(&mut values, rng);
    values
}

/// Samples per second of one epoch: forward, backward, Adam.
fn training(
    learner: &mut Learner<f32>,
    observations: &[f32],
    rng: &mut ChaCha8Rng,
) -> Result<f64, Box<dyn Error>> {
    let noise = normal(SAMPLES * ACTION, rng);
    let mut workspace = ActWorkspace::default();
    let acted = learner
        .policy()
        .act(learner.parameters(), observations, &noise, &mut workspace)?;
    let (advantages, returns) = (normal(SAMPLES, rng), normal(SAMPLES, rng));
    let (actions, log_probs) = (acted.actions.to_vec(), acted.log_probs.to_vec());
    let values = learner
        .policy()
        .values(learner.parameters(), observations, &mut workspace)?
        .to_vec();
    let batch = Batch {
        observations,
        actions: &actions,
        log_probs: &log_probs,
        values: &values,
        advantages: &advantages,
        returns: &returns,
    };
    let start = Instant::now();
    learner.update(&batch, rng)?;
    Ok(SAMPLES as f64 / start.elapsed().as_secs_f64())
}

/// Microseconds to normalise and act on `batch` observations.
fn acting(
    learner: &Learner<f32>,
    normalizer: &FrozenNormalizer<f32>,
    observations: &[f32],
    batch: usize,
) -> Result<f64, Box<dyn Error>> {
    let raw = &observations[..batch * OBSERVATION];
    let noise = vec![0.5; batch * ACTION];
    let mut normalised = vec![0.0; raw.len()];
    let mut workspace = ActWorkspace::default();
    let start = Instant::now();
    for _ in 0..200 {
        normalizer.apply(raw, &mut normalised)?;
        learner
            .policy()
            .act(learner.parameters(), &normalised, &noise, &mut workspace)?;
    }
    Ok(start.elapsed().as_secs_f64() * 1e6 / 200.0)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let spec = PolicySpec {
        observation: OBSERVATION,
        action: ACTION,
        hidden: vec![256, 128],
        activation: Activation::Relu,
    };
    let config = PpoConfig {
        epochs: 1,
        target_kl: None,
        ..PpoConfig::default()
    };
    let observations = normal(SAMPLES * OBSERVATION, &mut rng);
    let mut normalizer = Normalizer::new(OBSERVATION);
    normalizer.update(&observations)?;
    let normalizer = normalizer.frozen(10.0);
    let mut pools = Vec::new();
    for (threads, shards) in [(1, 2), (1, 4), (1, 8), (2, 2), (2, 4), (2, 8)] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()?;
        let config = PpoConfig {
            shards,
            ..config.clone()
        };
        let learner = Learner::<f32>::new(config, spec.clone(), &mut rng)?;
        pools.push((threads, shards, pool, learner, Vec::new()));
    }
    let (mut one, mut many) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        for (_, _, pool, learner, speeds) in &mut pools {
            let speed = pool.install(|| training(learner, &observations, &mut rng).ok());
            speeds.extend(speed);
        }
        let learner = &pools[0].3;
        one.push(acting(learner, &normalizer, &observations, 1)?);
        many.push(acting(learner, &normalizer, &observations, 32)?);
    }
    for (threads, shards, _, _, speeds) in pools {
        let best = speeds.iter().copied().fold(0.0, f64::max);
        let typical = median(speeds);
        println!("{threads} threads, {shards} shards: {typical:.0} samples/s, at best {best:.0}");
    }
    println!(
        "acting: {:.1} us for 1, {:.1} us for 32",
        median(one),
        median(many)
    );
    Ok(())
}
