//! How a policy is learned: networks over one flat parameter vector, proximal policy optimisation and its parts.
//!
//! Everything works on plain slices in row-major order (`[rows, columns]`, a row per sample) and is generic over
//! [`Scalar`], so the code that trains in `f32` is the code whose gradients are checked in `f64`. Results carry the same
//! bits at any number of threads: work is cut into a fixed number of pieces and sums are added in a fixed order.

mod adam;
mod batch;
mod checkpoint;
mod config;
mod gae;
mod kernels;
mod network;
mod normalizer;
mod performer;
mod plan;
mod policy;
mod ppo;
mod presets;
mod random;
mod rollout;
mod run;
mod starts;
mod stats;
mod surrogate;
#[cfg(test)]
mod tests;
mod trainer;
mod value_scale;

pub use adam::{Adam, AdamConfig};
pub use batch::{Batch, shuffled};
pub use checkpoint::{Checkpoint, PolicyFile};
pub use config::Config;
pub use gae::{StepEnd, Trajectories, advantages};
pub use kernels::Scalar;
pub use network::{Activation, Mlp, Workspace};
pub use normalizer::{FrozenNormalizer, Normalizer};
pub use performer::{Memory, Performer};
pub use plan::{Plan, TrainError};
pub use policy::{ActWorkspace, Acted, NamedTensor, Policy, PolicySpec, fill_normal};
pub use ppo::{Learner, LearnerState};
pub use presets::{PRESETS, Preset, preset};
pub use run::{Run, RunError};
pub use stats::UpdateStats;
pub use surrogate::LossTerms;
pub use trainer::{Metrics, Trainer, TrainerState};
pub use value_scale::ValueScale;

/// Normalised observations are clipped to ± this.
const OBSERVATION_LIMIT: f64 = 10.0;

/// Why learning can't go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LearnError {
    #[error("{what} has {found} values where {expected} are needed")]
    Length {
        what: String,
        found: usize,
        expected: usize,
    },
    #[error("{name} is {value}, which lies outside {range}; correct the training configuration")]
    Setting {
        name: &'static str,
        value: String,
        range: &'static str,
    },
    #[error(
        "observation {column} is not finite; look for a simulation that blew up or a division by zero in the observation"
    )]
    Observation { column: usize },
    #[error("{what} are not finite at sample {sample}; look for a simulation that blew up")]
    NotFinite { what: &'static str, sample: usize },
    #[error(
        "the gradient is not finite in epoch {epoch}, minibatch {minibatch}; lower the learning rate or look for non-finite rewards and observations"
    )]
    Diverged { epoch: usize, minibatch: usize },
    #[error(
        "the saved state is for the network {found}, not {expected}; train into a new run folder or use the saved configuration"
    )]
    Network { found: String, expected: String },
}

fn check_length(what: &str, found: usize, expected: usize) -> Result<(), LearnError> {
    if found == expected {
        return Ok(());
    }
    Err(LearnError::Length {
        what: what.to_owned(),
        found,
        expected,
    })
}
