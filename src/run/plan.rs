//! The plan of a run: what it learns, and how.

use super::error::RunError;
use crate::learn::{Activation, PpoConfig, TrainerSettings};
use crate::task::TaskSettings;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::borrow::Cow;

/// Everything that decides what a run learns. The number of threads does not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Plan {
    /// See [`TrainerSettings::seed`].
    pub seed: u64,
    /// What is learned.
    pub task: TaskSettings,
    /// See [`TrainerSettings::ppo`].
    pub ppo: PpoConfig,
    /// See [`TrainerSettings::hidden`].
    pub hidden: Vec<usize>,
    /// See [`TrainerSettings::activation`].
    pub activation: Activation,
    /// See [`TrainerSettings::environments`].
    pub environments: usize,
    /// See [`TrainerSettings::group`].
    pub group: usize,
    /// See [`TrainerSettings::horizon`].
    pub horizon: usize,
    /// See [`TrainerSettings::round`].
    pub round: u64,
    /// See [`TrainerSettings::samples`].
    pub samples: u64,
    /// See [`TrainerSettings::final_std`].
    pub final_std: f64,
    /// See [`TrainerSettings::final_learning_rate`].
    pub final_learning_rate: f64,
}

/// The settings of the trainer, and among them those of the task.
impl JsonSchema for Plan {
    fn schema_name() -> Cow<'static, str> {
        "Plan".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let task = generator.subschema_for::<TaskSettings>();
        let mut schema = TrainerSettings::json_schema(generator);
        schema
            .ensure_object()
            .entry("properties")
            .or_insert_with(|| json!({}))["task"] = task.into();
        schema
    }
}

impl Default for Plan {
    /// Chosen so that a kick or a walk is learned in minutes on two cores; `docs/notebook/training-choices.md` has what other
    /// networks, horizons and noise would change.
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
            final_learning_rate: 0.2,
        }
    }
}

impl Plan {
    /// The settings of the trainer.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_settings_ask_for_together_is_bounded() {
        let wrong = |change: fn(&mut Plan)| {
            let mut plan = Plan::default();
            change(&mut plan);
            let checked = plan.trainer().check();
            checked.err().map(|e| e.to_string()).unwrap_or_default()
        };
        assert_eq!(wrong(|_| {}), "");
        assert_eq!(wrong(|p| p.environments = 8192), "");
        for (name, change) in [
            (
                "setting `environments`",
                (|p| p.environments = usize::MAX) as fn(&mut Plan),
            ),
            ("setting `horizon`", |p| p.horizon = 1 << 40),
            ("setting `group`", |p| p.group = usize::MAX),
            ("setting `environments × horizon`", |p| {
                (p.environments, p.horizon) = (16384, 65536);
            }),
            ("setting `hidden × ppo.minibatch`", |p| {
                p.hidden = vec![65536; 16];
                (p.environments, p.ppo.minibatch) = (8192, 1_000_000_000);
            }),
        ] {
            let said = wrong(change);
            assert!(said.starts_with(name), "{name}: {said}");
        }
    }
}
