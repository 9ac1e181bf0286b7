//! The settings of a trainer.

use super::{Activation, LearnError, PpoConfig};

/// How a trainer learns, whatever the task.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainerSettings {
    /// Decides all random numbers.
    pub seed: u64,
    /// The learner's own settings.
    pub ppo: PpoConfig,
    /// Widths of the hidden layers of actor and critic.
    pub hidden: Vec<usize>,
    /// What follows every hidden layer.
    pub activation: Activation,
    /// Environments that act side by side.
    pub environments: usize,
    /// Environments that share a network call and physics steps: a multiple of [`LANES`](crate::sim::LANES) leaves no lane
    /// idle.
    pub group: usize,
    /// Control steps of each environment in an iteration.
    pub horizon: usize,
    /// Iterations after which all episodes begin anew.
    pub round: u64,
    /// Samples after which training ends.
    pub samples: u64,
    /// Action noise at the end, as a share of that at the start.
    pub final_std: f64,
    /// Learning rate at the end, as a share of that at the start, where no KL steers it.
    pub final_learning_rate: f64,
}

impl TrainerSettings {
    /// Checks that all numbers are in their ranges.
    ///
    /// # Errors
    /// The first that isn't.
    pub fn check(&self) -> Result<(), LearnError> {
        let least_one = 1.0..=f64::MAX;
        let ranges = [
            (
                "environments",
                self.environments as f64,
                &least_one,
                "1 or more",
            ),
            ("group", self.group as f64, &least_one, "1 or more"),
            ("horizon", self.horizon as f64, &least_one, "1 or more"),
            (
                "final_std",
                self.final_std,
                &(f64::MIN_POSITIVE..=f64::MAX),
                "the positive numbers: it is the share of the action noise that is left at the end",
            ),
            (
                "final_learning_rate",
                self.final_learning_rate,
                &(0.0..=1.0),
                "0 to 1: it is the share of the learning rate that is left at the end",
            ),
        ];
        for (name, value, range, text) in ranges {
            if !range.contains(&value) {
                return Err(LearnError::Setting {
                    name,
                    value: value.to_string(),
                    range: text,
                });
            }
        }
        self.ppo.check()
    }
}
