//! The files of a run: the checkpoint, from which learning goes on, and the policy, which is all that replay needs.

use super::file::{FileError, Reader, Writer, read};
use super::{Adam, LearnerState, Normalizer, Policy, PolicySpec, RngState, ValueScale};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

const VERSION: u64 = 1;

/// All that a resumed run needs to go on with the same bits. Numbers that must be exact lie in tensors, not in JSON.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    pub iteration: u64,
    /// Environment steps learned from.
    pub samples: u64,
    pub learner: LearnerState<f32>,
    pub normalizer: Normalizer,
    /// Random streams by name: one for shuffling, one per environment, and so on.
    pub rngs: BTreeMap<String, Vec<RngState>>,
    /// The environments' own state.
    pub tensors: BTreeMap<String, Vec<f32>>,
    /// The environments' own settings and state, as JSON.
    pub details: Value,
}

/// A policy that can act: parameters and observation statistics.
#[derive(Clone, Debug, PartialEq)]
pub struct PolicyFile {
    pub spec: PolicySpec,
    /// In the order of [`Policy::tensors`].
    pub parameters: Vec<f32>,
    pub normalizer: Normalizer,
    pub tensors: BTreeMap<String, Vec<f32>>,
    /// What the observations and actions mean, as JSON.
    pub details: Value,
}

impl Checkpoint {
    /// Replaces `path` at once: a run that dies while saving keeps its last checkpoint.
    pub fn save(&self, path: &Path) -> Result<(), FileError> {
        let mut writer = Writer::default();
        let LearnerState {
            spec,
            parameters,
            adam,
            learning_rate,
            value_scale,
        } = &self.learner;
        let network = |source| FileError::Network {
            path: path.to_owned(),
            source,
        };
        let policy = Policy::new(spec.clone()).map_err(network)?;
        for (prefix, values) in [
            ("", parameters),
            ("adam.mean.", &adam.mean),
            ("adam.square.", &adam.square),
        ] {
            super::check_length("parameter vector", values.len(), policy.parameter_count())
                .map_err(network)?;
            push_parameters(&mut writer, prefix, &policy, values);
        }
        writer.push("adam.steps", &[1], &[adam.steps]);
        writer.push("learning_rate", &[1], &[*learning_rate]);
        let ValueScale {
            mean,
            square,
            batches,
        } = *value_scale;
        writer.push("value_scale", &[3], &[mean, square, batches]);
        push_normalizer(&mut writer, &self.normalizer);
        for (name, states) in &self.rngs {
            let words: Vec<u64> = states.iter().flat_map(|state| state.to_words()).collect();
            writer.push(format!("rng.{name}"), &[states.len(), 7], &words);
        }
        push_extra(&mut writer, &self.tensors);
        writer.save(
            path,
            &json!({
                "format": "checkpoint", "version": VERSION, "iteration": self.iteration, "samples": self.samples,
                "policy": spec, "details": self.details,
            }),
        )
    }

    pub fn load(path: &Path) -> Result<Self, FileError> {
        let bytes = read(path)?;
        let reader = Reader::open(path, &bytes, "checkpoint", VERSION)?;
        let policy = policy(&reader)?;
        let [mean, square, batches] = exactly(&reader, "value_scale")?;
        let [steps] = exactly(&reader, "adam.steps")?;
        let [learning_rate] = exactly(&reader, "learning_rate")?;
        let adam = Adam {
            mean: parameters(&reader, "adam.mean.", &policy)?,
            square: parameters(&reader, "adam.square.", &policy)?,
            steps,
        };
        Ok(Self {
            iteration: reader.integer("iteration")?,
            samples: reader.integer("samples")?,
            learner: LearnerState {
                parameters: parameters(&reader, "", &policy)?,
                spec: policy.spec().clone(),
                adam,
                learning_rate,
                value_scale: ValueScale {
                    mean,
                    square,
                    batches,
                },
            },
            normalizer: normalizer(&reader, &policy)?,
            rngs: rngs(&reader)?,
            tensors: extra(&reader)?,
            details: reader.field("details")?.clone(),
        })
    }
}

impl PolicyFile {
    pub fn save(&self, path: &Path) -> Result<(), FileError> {
        let network = |source| FileError::Network {
            path: path.to_owned(),
            source,
        };
        let policy = Policy::new(self.spec.clone()).map_err(network)?;
        let (found, expected) = (self.parameters.len(), policy.parameter_count());
        super::check_length("parameter vector", found, expected).map_err(network)?;
        let mut writer = Writer::default();
        push_parameters(&mut writer, "", &policy, &self.parameters);
        push_normalizer(&mut writer, &self.normalizer);
        push_extra(&mut writer, &self.tensors);
        let metadata = json!({ "format": "policy", "version": VERSION, "policy": self.spec, "details": self.details });
        writer.save(path, &metadata)
    }

    pub fn load(path: &Path) -> Result<Self, FileError> {
        let bytes = read(path)?;
        let reader = Reader::open(path, &bytes, "policy", VERSION)?;
        let policy = policy(&reader)?;
        Ok(Self {
            parameters: parameters(&reader, "", &policy)?,
            normalizer: normalizer(&reader, &policy)?,
            tensors: extra(&reader)?,
            details: reader.field("details")?.clone(),
            spec: policy.spec().clone(),
        })
    }
}

fn push_parameters(writer: &mut Writer, prefix: &str, policy: &Policy, values: &[f32]) {
    for tensor in policy.tensors() {
        writer.push(
            format!("{prefix}{}", tensor.name),
            &tensor.shape,
            &values[tensor.range],
        );
    }
}

fn push_normalizer(writer: &mut Writer, normalizer: &Normalizer) {
    writer.push("normalizer.count", &[1], &[normalizer.count]);
    writer.push(
        "normalizer.mean",
        &[normalizer.mean.len()],
        &normalizer.mean,
    );
    writer.push(
        "normalizer.squares",
        &[normalizer.squares.len()],
        &normalizer.squares,
    );
}

fn push_extra(writer: &mut Writer, tensors: &BTreeMap<String, Vec<f32>>) {
    for (name, values) in tensors {
        writer.push(format!("extra.{name}"), &[values.len()], values);
    }
}

fn policy(reader: &Reader) -> Result<Policy, FileError> {
    let spec: PolicySpec = serde_json::from_value(reader.field("policy")?.clone())
        .map_err(|_| reader.malformed("policy"))?;
    Policy::new(spec).map_err(|source| reader.network(source))
}

fn parameters(reader: &Reader, prefix: &str, policy: &Policy) -> Result<Vec<f32>, FileError> {
    let mut values = Vec::new();
    for tensor in policy.tensors() {
        values.extend(reader.tensor::<f32>(&format!("{prefix}{}", tensor.name), &tensor.shape)?);
    }
    Ok(values)
}

fn normalizer(reader: &Reader, policy: &Policy) -> Result<Normalizer, FileError> {
    let columns = policy.spec().observation;
    let [count] = exactly(reader, "normalizer.count")?;
    let mean = reader.tensor("normalizer.mean", &[columns])?;
    let squares = reader.tensor("normalizer.squares", &[columns])?;
    Ok(Normalizer {
        count,
        mean,
        squares,
    })
}

fn rngs(reader: &Reader) -> Result<BTreeMap<String, Vec<RngState>>, FileError> {
    let mut rngs = BTreeMap::new();
    for (name, shape) in reader.under("rng.") {
        let rows = shape.first().copied().unwrap_or(0);
        let words = reader.tensor::<u64>(&format!("rng.{name}"), &[rows, 7])?;
        let (states, _) = words.as_chunks::<7>();
        rngs.insert(
            name,
            states
                .iter()
                .map(|&state| RngState::from_words(state))
                .collect(),
        );
    }
    Ok(rngs)
}

fn extra(reader: &Reader) -> Result<BTreeMap<String, Vec<f32>>, FileError> {
    let mut tensors = BTreeMap::new();
    for (name, shape) in reader.under("extra.") {
        let length = shape.first().copied().unwrap_or(0);
        let values = reader.tensor(&format!("extra.{name}"), &[length])?;
        tensors.insert(name, values);
    }
    Ok(tensors)
}

/// A vector of `N` numbers.
fn exactly<E: super::file::Element, const N: usize>(
    reader: &Reader,
    name: &str,
) -> Result<[E; N], FileError> {
    let values: Vec<E> = reader.tensor(name, &[N])?;
    values.try_into().map_err(|_| reader.malformed(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::{Activation, Config, Learner};
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    fn checkpoint() -> Checkpoint {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let spec = PolicySpec {
            observation: 4,
            action: 2,
            hidden: vec![6, 5],
            activation: Activation::Elu,
        };
        let learner = Learner::<f32>::new(Config::default(), spec, &mut rng).unwrap();
        let mut state = learner.state().clone();
        state
            .adam
            .mean
            .iter_mut()
            .enumerate()
            .for_each(|(i, m)| *m = (i as f32).sin());
        state.adam.steps = u64::MAX - 3;
        state.learning_rate = 0.1 + 0.2;
        let mut normalizer = Normalizer::new(4);
        normalizer
            .update(&[0.1, 0.2, 0.3, 0.4, 1.0, 2.0, 3.0, 4.0])
            .unwrap();
        let mut other = rng.clone();
        other.set_stream(77);
        other.next_u32();
        Checkpoint {
            iteration: 12,
            samples: 1 << 40,
            learner: state,
            normalizer,
            rngs: [
                ("shuffle".to_owned(), vec![RngState::of(&rng)]),
                ("environments".to_owned(), vec![RngState::of(&other); 3]),
            ]
            .into(),
            tensors: [
                ("phase".to_owned(), vec![0.25, 0.5]),
                ("empty".to_owned(), vec![]),
            ]
            .into(),
            details: json!({ "clip": "kick" }),
        }
    }

    fn saved() -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint.safetensors");
        checkpoint().save(&path).unwrap();
        (folder, path)
    }

    #[test]
    fn a_checkpoint_comes_back_as_it_was() {
        let (folder, path) = saved();
        assert_eq!(Checkpoint::load(&path).unwrap(), checkpoint());
        checkpoint().save(&path).unwrap();
        assert_eq!(
            std::fs::read_dir(folder.path()).unwrap().count(),
            1,
            "no temporary file stays"
        );
    }

    #[test]
    fn the_same_state_gives_the_same_bytes() {
        let (_one, first) = saved();
        let (_two, second) = saved();
        assert_eq!(
            std::fs::read(first).unwrap(),
            std::fs::read(second).unwrap()
        );
    }

    #[test]
    fn a_policy_file_comes_back_as_it_was() {
        let Checkpoint {
            learner,
            normalizer,
            tensors,
            details,
            ..
        } = checkpoint();
        let policy = PolicyFile {
            spec: learner.spec,
            parameters: learner.parameters,
            normalizer,
            tensors,
            details,
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("policy.safetensors");
        policy.save(&path).unwrap();
        assert_eq!(PolicyFile::load(&path).unwrap(), policy);
        assert!(matches!(
            Checkpoint::load(&path),
            Err(FileError::Format { .. })
        ));
    }

    #[test]
    fn a_cut_or_altered_file_is_an_error_and_never_a_panic() {
        let (_folder, path) = saved();
        let whole = std::fs::read(&path).unwrap();
        let header = 8 + u64::from_le_bytes(whole[..8].try_into().unwrap()) as usize;
        for length in (0..header + 64)
            .step_by(7)
            .chain((header..whole.len()).step_by(97))
        {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(Checkpoint::load(&path).is_err(), "{length}");
        }
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for _ in 0..500 {
            let mut bytes = whole.clone();
            bytes[rng.next_u32() as usize % header] = rng.next_u32() as u8;
            std::fs::write(&path, &bytes).unwrap();
            // A changed digit may still be a valid file: what counts is that reading it ends.
            let _ = Checkpoint::load(&path);
        }
    }

    #[test]
    fn a_tensor_of_another_shape_is_named() {
        let (_folder, path) = saved();
        let text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
        assert!(text.contains(r#""actor.0.weight":{"dtype":"F32","shape":[4,6]"#));
        let mut bytes = std::fs::read(&path).unwrap();
        let needle = br#""actor.0.weight":{"dtype":"F32","shape":[4,6]"#;
        let at = bytes
            .windows(needle.len())
            .position(|w| w == needle)
            .unwrap();
        bytes[at + needle.len() - 4] = b'6';
        bytes[at + needle.len() - 2] = b'4';
        std::fs::write(&path, &bytes).unwrap();
        let message = Checkpoint::load(&path).unwrap_err().to_string();
        assert!(
            message.contains("actor.0.weight is F32 [6, 4], not F32 [4, 6]"),
            "{message}"
        );
    }

    #[test]
    fn a_failed_save_keeps_the_last_good_file() {
        let (_folder, path) = saved();
        let mut broken = checkpoint();
        broken.learner.parameters.pop();
        assert!(broken.save(&path).is_err());
        assert_eq!(Checkpoint::load(&path).unwrap(), checkpoint());
        assert!(checkpoint().save(&path.join("no/such/folder")).is_err());
    }
}
