//! How a policy is learned: networks over one flat parameter vector, proximal policy optimisation and its parts.
//!
//! Everything works on plain slices in row-major order (`[rows, columns]`, a row per sample) and is generic over
//! [`Scalar`], so the code that trains in `f32` is the code whose gradients are checked in `f64`. Results carry the same
//! bits at any number of threads: work is cut into a fixed number of pieces and sums are added in a fixed order.

mod activation;
mod adam;
mod batch;
mod config;
mod error;
mod gae;
mod kernels;
mod network;
mod normalizer;
mod policy;
mod ppo;
mod random;
mod rollout;
mod settings;
mod stats;
mod surrogate;
#[cfg(test)]
mod tests;
mod trainer;
mod value_scale;

pub use activation::Activation;
pub use adam::{Adam, AdamConfig};
pub use batch::{Batch, shuffled};
pub use config::PpoConfig;
pub use error::LearnError;
pub(crate) use error::check_length;
pub use gae::{StepEnd, Trajectories, advantages};
pub use kernels::Scalar;
pub use network::{Mlp, Workspace};
pub(crate) use normalizer::OBSERVATION_LIMIT;
pub use normalizer::{FrozenNormalizer, Normalizer};
pub use policy::{ActWorkspace, Acted, NamedTensor, Policy, PolicySpec, fill_normal};
pub use ppo::{Learner, LearnerState};
pub use settings::TrainerSettings;
pub use stats::UpdateStats;
pub use surrogate::LossTerms;
pub use trainer::{Metrics, Trainer, TrainerState};
pub use value_scale::ValueScale;
