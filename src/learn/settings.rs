//! The settings of a trainer.

use super::activation::Activation;
use super::config::PpoConfig;
use super::error::LearnError;
use crate::schema::{self, OutOfRange};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a trainer learns, whatever the task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrainerSettings {
    /// Decides all random numbers. On one kind of processor, the same seed gives the same bits.
    pub seed: u64,
    /// Settings of proximal policy optimisation, the learner.
    pub ppo: PpoConfig,
    /// Widths of the hidden layers of actor and critic, up to 16 of them.
    #[schemars(inner(range(min = 1, max = 65536)))]
    pub hidden: Vec<usize>,
    /// Activation after every hidden layer.
    pub activation: Activation,
    /// Environments that act side by side. Together with `horizon` they give at most 524288 samples an iteration.
    #[schemars(range(min = 1, max = 16384))]
    pub environments: usize,
    /// Environments that share a network call and physics steps. A multiple of 8 leaves no lane idle.
    #[schemars(range(min = 1, max = 16384))]
    pub group: usize,
    /// Control steps of each environment in an iteration, which is one batch.
    #[schemars(range(min = 1, max = 65536))]
    pub horizon: usize,
    /// Iterations after which all episodes begin anew. No episode is under way then, so that is where a run can be stopped and
    /// resumed to the same bits.
    #[schemars(range(min = 1, max = 1e6))]
    pub round: u64,
    /// Samples (control steps of one environment) after which training ends.
    #[schemars(range(min = 1, max = 1e15))]
    pub samples: u64,
    /// Action noise at the end, as a share of that at the start. It changes evenly over the samples.
    #[schemars(range(max = 1e3), extend("exclusiveMinimum" = 0))]
    pub final_std: f64,
    /// Learning rates at the end, as a share of those at the start. They change evenly over the samples. Where `ppo.target_kl`
    /// steers the actor's, it is the largest that it may set, `ppo.max_learning_rate`, that changes.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub final_learning_rate: f64,
}

/// Most samples of an iteration, and most activations of a network that are in memory at a time. Chosen: four times the
/// largest batch that is in use for such characters (131072, on a graphics card), and half a gigabyte for one network.
const MOST_SAMPLES: usize = 1 << 19;
const MOST_ACTIVATIONS: usize = 1 << 27;

impl TrainerSettings {
    /// Checks that all numbers are in their ranges, and that what they ask for together fits into memory.
    ///
    /// # Errors
    /// The first that isn't.
    pub fn check(&self) -> Result<(), LearnError> {
        schema::check(self, "")?;
        self.ppo.check()?;
        // Within their ranges, none of these products overflows.
        let samples = self.environments * self.horizon;
        most("environments × horizon", samples, MOST_SAMPLES)?;
        let widths: usize = self.hidden.iter().sum();
        let activations = widths * samples.min(self.ppo.minibatch);
        most("hidden × ppo.minibatch", activations, MOST_ACTIVATIONS)
    }
}

/// Checks that a product of settings isn't larger than `most`.
fn most(setting: &str, value: usize, most: usize) -> Result<(), LearnError> {
    if value <= most {
        return Ok(());
    }
    Err(LearnError::Setting(OutOfRange {
        setting: setting.to_owned(),
        value: value.to_string(),
        allowed: format!("settings whose product is at most {most}"),
    }))
}
