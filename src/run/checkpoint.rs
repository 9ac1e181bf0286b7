//! The files of a run: the checkpoint, from which learning goes on, and the policy, which is all that replay needs.

use crate::file::{self, FileError, Flaw, Format, Reader, Writer};
use crate::learn::{
    Adam, LearnError, LearnerState, Normalizer, Policy, PolicySpec, ValueScale, check_length,
};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

const CHECKPOINT: Format = Format {
    name: "checkpoint",
    version: 1,
    remedy: "train into a new run",
};
const POLICY: Format = Format {
    name: "policy",
    version: 1,
    remedy: "train it again",
};

/// All that a resumed run needs to go on with the same bits. Numbers that must be exact are tensors, not JSON. It holds no
/// random streams, for these follow from the seed and the iteration.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// Iterations done.
    pub iteration: u64,
    /// Environment steps learned from.
    pub samples: u64,
    /// Parameters and optimiser.
    pub learner: LearnerState<f32>,
    /// Statistics of the observations.
    pub normalizer: Normalizer,
    /// Other state of the run, by name: flat vectors.
    pub tensors: BTreeMap<String, Vec<f32>>,
}

/// A policy that can act: parameters and observation statistics.
#[derive(Clone, Debug, PartialEq)]
pub struct PolicyFile {
    /// Shape of the networks.
    pub spec: PolicySpec,
    /// In the order of [`Policy::tensors`].
    pub parameters: Vec<f32>,
    /// Statistics of the observations.
    pub normalizer: Normalizer,
    /// What the observations and actions mean, as JSON.
    pub details: Value,
}

/// The metadata of a checkpoint.
#[derive(Serialize, Deserialize)]
struct CheckpointHeader {
    iteration: u64,
    samples: u64,
    policy: PolicySpec,
}

/// The metadata of a policy file.
#[derive(Serialize, Deserialize)]
struct PolicyHeader {
    policy: PolicySpec,
    details: Value,
}

impl Checkpoint {
    /// Writes to `path` in one step: a run that is killed while saving keeps its last checkpoint.
    ///
    /// # Errors
    /// A file that can't be written, or parameters that don't fit the network.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        let path = path.as_ref();
        let writer = self.writer().map_err(|e| misfit(e).of(path, CHECKPOINT))?;
        let header = CheckpointHeader {
            iteration: self.iteration,
            samples: self.samples,
            policy: self.learner.spec.clone(),
        };
        writer.save(path, CHECKPOINT, &header)
    }

    fn writer(&self) -> Result<Writer, LearnError> {
        let mut writer = Writer::default();
        let LearnerState {
            spec,
            parameters,
            adam,
            learning_rate,
            value_scale,
        } = &self.learner;
        let policy = Policy::new(spec.clone())?;
        for (prefix, values) in [
            ("", parameters),
            ("adam.mean.", &adam.mean),
            ("adam.square.", &adam.square),
        ] {
            push_parameters(&mut writer, prefix, &policy, values)?;
        }
        writer.push("adam.steps", &[1], [adam.steps]);
        writer.push("learning_rate", &[1], [*learning_rate]);
        let ValueScale {
            mean,
            square,
            batches,
        } = *value_scale;
        writer.push("value_scale", &[3], [mean, square, batches]);
        push_normalizer(&mut writer, &self.normalizer);
        for (name, values) in &self.tensors {
            let name = format!("{EXTRA}{name}");
            writer.push(name, &[values.len()], values.iter().copied());
        }
        Ok(writer)
    }

    /// Reads the checkpoint `path`.
    ///
    /// # Errors
    /// A file that can't be read, or is no whole checkpoint of this version or an older one.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, FileError> {
        file::load(path.as_ref(), CHECKPOINT, Self::from_bytes)
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, Flaw> {
        let reader = Reader::open(bytes, CHECKPOINT)?;
        let header: CheckpointHeader = reader.fields()?;
        let policy = Policy::new(header.policy).map_err(misfit)?;
        let [mean, square, batches] = finite_array(&reader, "value_scale")?;
        let [steps] = reader.array("adam.steps")?;
        let [learning_rate] = finite_array(&reader, "learning_rate")?;
        let adam = Adam {
            mean: parameters(&reader, "adam.mean.", &policy)?,
            square: parameters(&reader, "adam.square.", &policy)?,
            steps,
        };
        Ok(Self {
            iteration: header.iteration,
            samples: header.samples,
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
            tensors: extra(&reader)?,
        })
    }
}

impl PolicyFile {
    /// Writes to `path` in one step.
    ///
    /// # Errors
    /// A file that can't be written, or parameters that don't fit the network.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        let path = path.as_ref();
        let writer = self.writer().map_err(|e| misfit(e).of(path, POLICY))?;
        let header = PolicyHeader {
            policy: self.spec.clone(),
            details: self.details.clone(),
        };
        writer.save(path, POLICY, &header)
    }

    fn writer(&self) -> Result<Writer, LearnError> {
        let policy = Policy::new(self.spec.clone())?;
        let mut writer = Writer::default();
        push_parameters(&mut writer, "", &policy, &self.parameters)?;
        push_normalizer(&mut writer, &self.normalizer);
        Ok(writer)
    }

    /// Reads the policy file `path`.
    ///
    /// # Errors
    /// A file that can't be read, or is no whole policy of this version or an older one.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, FileError> {
        file::load(path.as_ref(), POLICY, Self::from_bytes)
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, Flaw> {
        let reader = Reader::open(bytes, POLICY)?;
        let header: PolicyHeader = reader.fields()?;
        let policy = Policy::new(header.policy).map_err(misfit)?;
        Ok(Self {
            parameters: parameters(&reader, "", &policy)?,
            normalizer: normalizer(&reader, &policy)?,
            details: header.details,
            spec: policy.spec().clone(),
        })
    }
}

/// What the names of a checkpoint's other tensors begin with.
const EXTRA: &str = "extra.";

/// The error of a file whose network is impossible or doesn't fit its parameters.
fn misfit(error: LearnError) -> Flaw {
    Flaw::content("policy", error.to_string())
}

fn push_parameters(
    writer: &mut Writer,
    prefix: &str,
    policy: &Policy,
    values: &[f32],
) -> Result<(), LearnError> {
    check_length("parameter vector", values.len(), policy.parameter_count())?;
    for tensor in policy.tensors() {
        let values = values[tensor.range].iter().copied();
        writer.push(format!("{prefix}{}", tensor.name), &tensor.shape, values);
    }
    Ok(())
}

fn push_normalizer(writer: &mut Writer, normalizer: &Normalizer) {
    let Normalizer {
        count,
        mean,
        squares,
    } = normalizer;
    writer.push("normalizer.count", &[1], [*count]);
    for (name, values) in [("normalizer.mean", mean), ("normalizer.squares", squares)] {
        writer.push(name, &[values.len()], values.iter().copied());
    }
}

fn parameters(reader: &Reader, prefix: &str, policy: &Policy) -> Result<Vec<f32>, Flaw> {
    let mut values = Vec::new();
    for tensor in policy.tensors() {
        let shape: Vec<_> = tensor.shape.iter().copied().map(Some).collect();
        let name = format!("{prefix}{}", tensor.name);
        values.extend(finite(&name, reader.tensor::<f32>(&name, &shape)?)?);
    }
    Ok(values)
}

fn normalizer(reader: &Reader, policy: &Policy) -> Result<Normalizer, Flaw> {
    let columns = Some(policy.spec().observation);
    let [count]: [f64; 1] = reader.array("normalizer.count")?;
    let numbers = |name: &str| finite(name, reader.tensor(name, &[columns])?);
    let squares = numbers("normalizer.squares")?;
    if !count.is_finite() || count < 0.0 || squares.iter().any(|square| *square < 0.0) {
        return Err(Flaw::in_tensor(
            "normalizer.count",
            "it counts no observations",
        ));
    }
    Ok(Normalizer {
        count,
        mean: numbers("normalizer.mean")?,
        squares,
    })
}

/// The values of a tensor, all of which have to be numbers: a network with one that isn't gives nothing else.
fn finite<T: Copy + Into<f64>>(name: &str, values: Vec<T>) -> Result<Vec<T>, Flaw> {
    match values.iter().position(|&value| !value.into().is_finite()) {
        Some(at) => Err(Flaw::in_tensor(
            name,
            format!("value {at} is not a finite number"),
        )),
        None => Ok(values),
    }
}

/// A tensor of exactly `N` numbers, all finite.
fn finite_array<const N: usize>(reader: &Reader, name: &str) -> Result<[f64; N], Flaw> {
    let values: [f64; N] = reader.array(name)?;
    finite(name, values.to_vec()).map(|_| values)
}

fn extra(reader: &Reader) -> Result<BTreeMap<String, Vec<f32>>, Flaw> {
    let named = reader.names().filter_map(|name| {
        let rest = name.strip_prefix(EXTRA)?;
        Some(
            reader
                .tensor(name, &[None])
                .and_then(|values| finite(name, values))
                .map(|values| (rest.to_owned(), values)),
        )
    });
    named.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::{Activation, Learner, PpoConfig};
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};
    use serde_json::json;

    fn checkpoint() -> Checkpoint {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let spec = PolicySpec {
            observation: 4,
            action: 2,
            hidden: vec![6, 5],
            activation: Activation::Elu,
        };
        let learner = Learner::<f32>::new(PpoConfig::default(), spec, &mut rng).unwrap();
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
        Checkpoint {
            iteration: 12,
            samples: 1 << 40,
            learner: state,
            normalizer,
            tensors: [
                ("phase".to_owned(), vec![0.25, 0.5]),
                ("empty".to_owned(), vec![]),
            ]
            .into(),
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
            ..
        } = checkpoint();
        let policy = PolicyFile {
            spec: learner.spec,
            parameters: learner.parameters,
            normalizer,
            details: json!({ "clip": "kick" }),
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("policy.safetensors");
        policy.save(&path).unwrap();
        assert_eq!(PolicyFile::load(&path).unwrap(), policy);
        assert!(matches!(
            Checkpoint::load(&path),
            Err(FileError {
                flaw: Flaw::OtherFormat { .. },
                ..
            })
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
            message.contains("tensor `actor.0.weight` is F32 [6, 4], not F32 [4, 6]"),
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
        assert!(checkpoint().save(path.join("no/such/folder")).is_err());
    }
}
