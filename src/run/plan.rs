//! What a run is told.

use super::error::RunError;
use crate::learn::{Activation, PpoConfig, TrainerSettings};
use crate::task::TaskSettings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Everything that decides what a run learns. The number of threads does not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Plan {
    /// Decides all random numbers. On one kind of processor, the same seed gives the same bits.
    pub seed: u64,
    /// What is learned.
    pub task: TaskSettings,
    /// The settings of the learner.
    pub ppo: PpoConfig,
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
            task: TaskSettings::default(),
            ppo: PpoConfig::default(),
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
    /// The part that says how to learn.
    pub fn trainer(&self) -> TrainerSettings {
        TrainerSettings {
            seed: self.seed,
            ppo: self.ppo.clone(),
            hidden: self.hidden.clone(),
            activation: self.activation,
            environments: self.environments,
            group: self.group,
            horizon: self.horizon,
            round: self.round,
            samples: self.samples,
            final_std: self.final_std,
            final_learning_rate: self.final_learning_rate,
        }
    }

    /// Checks that all numbers are in their ranges.
    ///
    /// # Errors
    /// The first that isn't.
    pub fn check(&self) -> Result<(), RunError> {
        self.task.check()?;
        Ok(self.trainer().check()?)
    }
}
