//! What a run is told.

use super::{Activation, Config, LearnError};
use crate::task::{Setting, TaskError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Everything that decides what a run learns. The number of threads does not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Plan {
    /// Decides all random numbers. On one kind of processor, the same seed gives the same bits.
    pub seed: u64,
    pub task: Setting,
    pub ppo: Config,
    /// Widths of the hidden layers of actor and critic, up to 16 of them.
    #[schemars(inner(range(min = 1, max = 65536)))]
    pub hidden: Vec<usize>,
    /// Activation after every hidden layer.
    pub activation: Activation,
    /// Environments that act side by side.
    #[schemars(range(min = 1))]
    pub environments: usize,
    /// Environments that share a network call and physics steps. A multiple of 8 leaves no lane idle.
    #[schemars(range(min = 1))]
    pub group: usize,
    /// Control steps of each environment in an iteration, which is one batch.
    #[schemars(range(min = 1))]
    pub horizon: usize,
    /// Iterations after which all episodes begin anew. No episode is under way then, so that is where a run can be stopped and
    /// resumed to the same bits.
    #[schemars(range(min = 1))]
    pub round: u64,
    /// Samples (control steps of one environment) after which training ends.
    #[schemars(range(min = 1))]
    pub samples: u64,
    /// Action noise at the end, as a share of that at the start. It changes evenly over the samples.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub final_std: f64,
    /// Learning rate at the end, as a share of that at the start, where `ppo.target_kl` doesn't steer it. It changes evenly over
    /// the samples.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub final_learning_rate: f64,
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            seed: 1,
            task: Setting::default(),
            ppo: Config::default(),
            hidden: vec![256, 128],
            activation: Activation::Relu,
            environments: 64,
            group: 8,
            horizon: 64,
            round: 20,
            samples: 4_000_000,
            final_std: 0.4,
            final_learning_rate: 1.0,
        }
    }
}

impl Plan {
    pub(super) fn check(&self) -> Result<(), TrainError> {
        for (name, value) in [
            ("environments", self.environments),
            ("group", self.group),
            ("horizon", self.horizon),
        ] {
            if value == 0 {
                return Err(TrainError::Zero(name));
            }
        }
        if !(self.final_std > 0.0 && self.final_std.is_finite()) {
            return Err(TrainError::FinalStd(self.final_std));
        }
        if !(0.0..=1.0).contains(&self.final_learning_rate) {
            return Err(TrainError::FinalRate(self.final_learning_rate));
        }
        Ok(self.task.check()?)
    }
}

/// Why a run can't be set up or go on.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    #[error(transparent)]
    Task(#[from] TaskError),
    #[error(transparent)]
    Learn(#[from] LearnError),
    #[error("{0} must be at least 1")]
    Zero(&'static str),
    #[error(
        "motions `{first}` and `{other}` put different bodies on the ground, and one policy sees the contacts of one set; train them apart"
    )]
    OtherContacts { first: String, other: String },
    #[error(
        "final_std is {0}, and must be positive: it is the share of the action noise that is left at the end"
    )]
    FinalStd(f64),
    #[error(
        "final_learning_rate is {0}, and must be 0 to 1: it is the share of the learning rate that is left at the end"
    )]
    FinalRate(f64),
    #[error("there is no motion to learn")]
    NoMotion,
}
