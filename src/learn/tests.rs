//! The learner as a whole: gradients, determinism, stopping and steering, and that it learns.

use super::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const OBSERVATION: usize = 5;
const ACTION: usize = 3;

fn spec(activation: Activation) -> PolicySpec {
    PolicySpec {
        observation: OBSERVATION,
        action: ACTION,
        hidden: vec![7, 6],
        activation,
    }
}

fn normal<T: Scalar>(count: usize, rng: &mut ChaCha8Rng) -> Vec<T> {
    let mut values = vec![T::ZERO; count];
    fill_normal(&mut values, rng);
    values
}

/// Experience of a policy that is near the learner's, so that ratios lie on both sides of the clipping range.
struct Experience<T> {
    observations: Vec<T>,
    actions: Vec<T>,
    log_probs: Vec<T>,
    values: Vec<T>,
    advantages: Vec<T>,
    returns: Vec<T>,
}

fn valued<T: Scalar>(learner: &Learner<T>, observations: &[T]) -> Vec<T> {
    let mut workspace = ActWorkspace::default();
    let values = learner
        .policy()
        .values(learner.parameters(), observations, &mut workspace);
    values.unwrap().to_vec()
}

impl<T: Scalar> Experience<T> {
    fn new(learner: &Learner<T>, samples: usize, rng: &mut ChaCha8Rng) -> Self {
        let observations = normal(samples * OBSERVATION, rng);
        let noise: Vec<T> = normal(samples * ACTION, rng);
        let mut workspace = ActWorkspace::default();
        let acted = learner
            .policy()
            .act(learner.parameters(), &observations, &noise, &mut workspace)
            .unwrap();
        let shift: Vec<T> = normal(samples, rng);
        let log_probs = acted.log_probs.iter().zip(shift);
        Self {
            actions: acted.actions.to_vec(),
            log_probs: log_probs.map(|(&l, s)| l + T::from_f64(0.3) * s).collect(),
            values: valued(learner, &observations),
            advantages: normal(samples, rng),
            returns: normal(samples, rng),
            observations,
        }
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
}

/// A learner whose every parameter is random, so that no gradient is zero by symmetry.
fn scattered<T: Scalar>(
    config: PpoConfig,
    activation: Activation,
    rng: &mut ChaCha8Rng,
) -> Learner<T> {
    let mut learner = Learner::new(config, spec(activation), rng).unwrap();
    let mut state = learner.state().clone();
    let shift: Vec<T> = normal(state.parameters.len(), rng);
    state
        .parameters
        .iter_mut()
        .zip(shift)
        .for_each(|(p, s)| *p += T::from_f64(0.2) * s);
    *state.parameters.last_mut().unwrap() = T::from_f64(1.7);
    learner.restore(state).unwrap();
    learner
}

#[test]
fn the_gradient_of_the_whole_loss_is_that_of_finite_differences() {
    let config = PpoConfig {
        learn_std: true,
        entropy_coefficient: 0.03,
        action_bound: 0.2,
        action_bound_coefficient: 0.7,
        shards: 3,
        ..PpoConfig::default()
    };
    for activation in [Activation::Relu, Activation::Elu, Activation::Tanh] {
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        let mut learner: Learner<f64> = scattered(config.clone(), activation, &mut rng);
        let experience = Experience::new(&learner, 40, &mut rng);
        let indices: Vec<u32> = shuffled(40, &mut rng)[..31].to_vec();
        let (terms, gradient) = learner.gradient(&experience.batch(), &indices).unwrap();
        let gradient = gradient.to_vec();
        assert!(terms.clip_fraction > 0.1 && terms.clip_fraction < 0.9 && terms.action_bound > 0.0);
        let state = learner.state().clone();
        let log_std = learner.policy().log_std_range();
        let mut loss = |i: usize, shift: f64| {
            let mut state = state.clone();
            state.parameters[i] += shift;
            let entropy = policy::entropy(&state.parameters[log_std.clone()]);
            learner.restore(state).unwrap();
            let (terms, _) = learner.gradient(&experience.batch(), &indices).unwrap();
            terms.policy + config.value_coefficient * terms.value
                - config.entropy_coefficient * entropy
                + config.action_bound_coefficient * terms.action_bound
        };
        let largest = gradient.iter().fold(0.0_f64, |a, g| a.max(g.abs()));
        // The last two parameters are the value scale, which isn't learned by gradient.
        let (learned, scale) = gradient.split_at(gradient.len() - 2);
        for (i, &found) in learned.iter().enumerate() {
            let slope = (loss(i, 1e-5) - loss(i, -1e-5)) / 2e-5;
            assert!(
                (slope - found).abs() < 1e-6 * largest,
                "{activation:?} {i}: {slope} {found}"
            );
        }
        assert_eq!(scale, [0.0; 2]);
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let config = PpoConfig {
                minibatch: 300,
                target_kl: None,
                learn_std: true,
                ..PpoConfig::default()
            };
            let mut rng = ChaCha8Rng::seed_from_u64(8);
            // Wide enough for several pieces of the optimiser's work.
            let spec = PolicySpec {
                hidden: vec![128, 128],
                ..spec(Activation::Relu)
            };
            let mut learner = Learner::<f32>::new(config, spec, &mut rng).unwrap();
            let mut all = Vec::new();
            for _ in 0..3 {
                let experience = Experience::new(&learner, 1000, &mut rng);
                all.push(learner.update(&experience.batch(), &mut rng).unwrap());
            }
            (all, learner.state().clone())
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(3));
}

#[test]
fn a_resumed_learner_goes_on_with_the_same_bits() {
    let mut rng = ChaCha8Rng::seed_from_u64(30);
    let mut learner =
        Learner::<f32>::new(PpoConfig::default(), spec(Activation::Relu), &mut rng).unwrap();
    let experience = Experience::new(&learner, 200, &mut rng);
    learner.update(&experience.batch(), &mut rng).unwrap();
    let mut other_rng = ChaCha8Rng::seed_from_u64(99);
    let mut resumed =
        Learner::new(PpoConfig::default(), spec(Activation::Relu), &mut other_rng).unwrap();
    resumed.restore(learner.state().clone()).unwrap();
    let mut resumed_rng = rng.clone();
    learner.update(&experience.batch(), &mut rng).unwrap();
    resumed
        .update(&experience.batch(), &mut resumed_rng)
        .unwrap();
    assert_eq!(learner.state(), resumed.state());
}

#[test]
fn learning_rate_follows_the_divergence() {
    let mut rng = ChaCha8Rng::seed_from_u64(14);
    let experience = |learner: &Learner<f32>, rng: &mut ChaCha8Rng| {
        let mut experience = Experience::new(learner, 400, rng);
        let mut workspace = ActWorkspace::default();
        let noise: Vec<f32> = normal(experience.actions.len(), rng);
        let acted = learner.policy().act(
            learner.parameters(),
            &experience.observations,
            &noise,
            &mut workspace,
        );
        let acted = acted.unwrap();
        experience.actions = acted.actions.to_vec();
        experience.log_probs = acted.log_probs.to_vec();
        experience
    };
    let config = PpoConfig {
        minibatch: 50,
        epochs: 4,
        ..PpoConfig::default()
    };
    let slow = PpoConfig {
        learning_rate: 2e-5,
        ..config.clone()
    };
    let mut learner = Learner::new(slow, spec(Activation::Relu), &mut rng).unwrap();
    let stats = learner
        .update(&experience(&learner, &mut rng).batch(), &mut rng)
        .unwrap();
    assert!(!stats.stopped_early && stats.steps == 32 && stats.learning_rate == 2e-5);
    assert!((learner.state().learning_rate / 3e-5 - 1.0).abs() < 1e-12);

    let fast = PpoConfig {
        learning_rate: 0.3,
        ..config
    };
    let mut learner = Learner::new(fast, spec(Activation::Relu), &mut rng).unwrap();
    let experience = experience(&learner, &mut rng);
    let batch = experience.batch();
    let stats = learner.update(&batch, &mut rng).unwrap();
    // The step that led too far was taken back.
    assert!(stats.stopped_early && stats.steps < 32, "{stats:?}");
    let everything: Vec<u32> = (0..400).collect();
    let (terms, _) = learner.gradient(&batch, &everything).unwrap();
    assert!(
        terms.approx_kl < 0.15 && stats.approx_kl < 0.15,
        "{terms:?}"
    );
    assert!((learner.state().learning_rate / 0.2 - 1.0).abs() < 1e-12);
}

#[test]
fn numbers_that_are_not_finite_are_refused_before_they_reach_the_parameters() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut learner =
        Learner::<f32>::new(PpoConfig::default(), spec(Activation::Relu), &mut rng).unwrap();
    let before = learner.state().parameters.clone();
    let mut experience = Experience::new(&learner, 50, &mut rng);
    experience.returns[7] = f32::INFINITY;
    let error = learner.update(&experience.batch(), &mut rng).unwrap_err();
    assert_eq!(
        error,
        LearnError::NotFinite {
            what: "returns",
            sample: 7
        }
    );
    assert_eq!(learner.state().parameters, before);
    experience.returns[7] = 0.0;
    experience.observations[3] = f32::NAN;
    let error = learner.update(&experience.batch(), &mut rng).unwrap_err();
    assert!(matches!(error, LearnError::Diverged { epoch: 0, .. }));
    experience.actions.pop();
    assert!(matches!(
        learner.update(&experience.batch(), &mut rng),
        Err(LearnError::Length { .. })
    ));
}

#[test]
fn settings_outside_their_range_are_errors() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for config in [
        PpoConfig {
            gamma: 1.5,
            ..PpoConfig::default()
        },
        PpoConfig {
            gamma: f64::NAN,
            ..PpoConfig::default()
        },
        PpoConfig {
            minibatch: 0,
            ..PpoConfig::default()
        },
        PpoConfig {
            shards: 0,
            ..PpoConfig::default()
        },
        PpoConfig {
            initial_std: 0.0,
            ..PpoConfig::default()
        },
    ] {
        assert!(Learner::<f32>::new(config, spec(Activation::Relu), &mut rng).is_err());
    }
    let config: PpoConfig = serde_json::from_str(r#"{"clip": 0.1, "target_kl": null}"#).unwrap();
    assert_eq!(
        config,
        PpoConfig {
            clip: 0.1,
            target_kl: None,
            ..PpoConfig::default()
        }
    );
}

/// A one-step task with a known answer: the reward is −‖action − target(observation)‖².
#[test]
fn a_simple_task_is_learned() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let config = PpoConfig {
        minibatch: 128,
        initial_std: 0.2,
        learning_rate: 1e-3,
        max_learning_rate: 1e-2,
        ..PpoConfig::default()
    };
    let mut learner = Learner::<f32>::new(config, spec(Activation::Relu), &mut rng).unwrap();
    let reward = |o: &[f32], a: &[f32]| {
        let target = [0.5 * o[0], 0.3 - 0.2 * o[1], 0.4 * o[2].abs()];
        -a.iter()
            .zip(target)
            .map(|(a, t)| (a - t).powi(2))
            .sum::<f32>()
    };
    let mean_error = |learner: &Learner<f32>, rng: &mut ChaCha8Rng| {
        let observations: Vec<f32> = normal(500 * OBSERVATION, rng);
        let mut workspace = ActWorkspace::default();
        let means = learner
            .policy()
            .mean(learner.parameters(), &observations, &mut workspace)
            .unwrap();
        let rows = observations
            .chunks_exact(OBSERVATION)
            .zip(means.chunks_exact(ACTION));
        -rows.map(|(o, a)| reward(o, a)).sum::<f32>() / 500.0
    };
    let before = mean_error(&learner, &mut rng);
    for _ in 0..60 {
        let mut experience = Experience::new(&learner, 512, &mut rng);
        let mut workspace = ActWorkspace::default();
        let noise: Vec<f32> = normal(512 * ACTION, &mut rng);
        let acted = learner.policy().act(
            learner.parameters(),
            &experience.observations,
            &noise,
            &mut workspace,
        );
        let acted = acted.unwrap();
        let rewards = experience
            .observations
            .chunks_exact(OBSERVATION)
            .zip(acted.actions.chunks_exact(ACTION));
        experience.returns = rewards.map(|(o, a)| reward(o, a)).collect();
        experience.actions = acted.actions.to_vec();
        experience.log_probs = acted.log_probs.to_vec();
        experience.values = valued(&learner, &experience.observations);
        let pairs = experience.returns.iter().zip(&experience.values);
        experience.advantages = pairs.map(|(r, v)| r - v).collect();
        learner.update(&experience.batch(), &mut rng).unwrap();
    }
    let after = mean_error(&learner, &mut rng);
    assert!(
        after < 0.1 * before,
        "mean squared error {before} -> {after}"
    );
}

/// Rollouts may be cut into groups of environments in any way.
#[test]
fn the_size_of_the_batch_acted_on_or_valued_changes_no_bit() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (observation, action) in [(220, 28), (5, 3), (258, 21)] {
        let spec = PolicySpec {
            observation,
            action,
            hidden: vec![256, 128],
            activation: Activation::Relu,
        };
        let policy = Policy::new(spec).unwrap();
        let parameters: Vec<f32> = policy.initialise(0.1, &mut rng);
        let observations: Vec<f32> = normal(64 * observation, &mut rng);
        let noise: Vec<f32> = normal(64 * action, &mut rng);
        let mut workspace = ActWorkspace::default();
        let mut run = |rows: usize| {
            let mut actions = Vec::new();
            let batches = observations.chunks(rows * observation);
            for (x, n) in batches.zip(noise.chunks(rows * action)) {
                let acted = policy.act(&parameters, x, n, &mut workspace).unwrap();
                actions.extend_from_slice(acted.actions);
            }
            actions
        };
        let whole = run(64);
        for rows in [1, 2, 3, 5, 8, 13, 32, 33] {
            assert!(run(rows) == whole, "{observation} {rows}");
        }
        let observations: Vec<f32> = normal(500 * observation, &mut rng);
        let mut judge = |rows: usize| -> Vec<f32> {
            let batches = observations.chunks(rows * observation);
            let mut values = Vec::new();
            for x in batches {
                let part = policy.values(&parameters, x, &mut workspace).unwrap();
                values.extend_from_slice(part);
            }
            values
        };
        let whole = judge(500);
        for rows in [1, 7, 64, 65, 128, 333] {
            assert!(judge(rows) == whole, "{observation} {rows}");
        }
    }
}
