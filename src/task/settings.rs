//! The settings of a task, whichever it is.

use super::disturbance::Perturbations;
use super::environment::Task;
use super::error::TaskError;
use super::imitate::{self, Imitate, ImitationSettings};
use super::model::CharacterModel;
use crate::motion::Motion;
use crate::sim::Settings;
use schemars::JsonSchema;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;
use std::sync::Arc;

/// Names of the tasks, each with what it is, the default first.
pub const TASKS: [(&str, &str); 1] = [(
    imitate::NAME,
    "perform the motion, guided by its phase (the default)",
)];

/// The settings of one task. In JSON an object with the task's own settings and its name as `kind`. An object
/// without `kind` is of the task `imitate`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "lowercase")]
#[non_exhaustive]
pub enum TaskSettings {
    /// Imitation of reference motions.
    Imitate(ImitationSettings),
}

impl TaskSettings {
    /// The task's name on the command line and in files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Imitate(_) => imitate::NAME,
        }
    }

    /// The default settings of the task of this name, one of [`TASKS`].
    pub fn named(name: &str) -> Option<Self> {
        match name {
            imitate::NAME => Some(Self::default()),
            _ => None,
        }
    }

    /// The task with these settings, for a character and its motions.
    ///
    /// # Errors
    /// Settings out of their ranges, or motions that can't be learned together by this character.
    pub fn build(
        &self,
        model: Arc<CharacterModel>,
        motions: &[Motion],
    ) -> Result<Arc<dyn Task>, TaskError> {
        Ok(match self {
            Self::Imitate(settings) => Arc::new(Imitate::new(model, motions, *settings)?),
        })
    }

    /// Checks that all numbers are in their ranges.
    ///
    /// # Errors
    /// The first that isn't.
    pub fn check(&self) -> Result<(), TaskError> {
        match self {
            Self::Imitate(settings) => settings.check(),
        }
    }

    /// The physics in which the character moves.
    pub fn physics(&self) -> &Settings {
        match self {
            Self::Imitate(settings) => &settings.physics,
        }
    }

    /// What disturbs training.
    pub fn perturbations(&self) -> &Perturbations {
        match self {
            Self::Imitate(settings) => &settings.perturbations,
        }
    }

    /// What disturbs training, to be changed.
    pub fn perturbations_mut(&mut self) -> &mut Perturbations {
        match self {
            Self::Imitate(settings) => &mut settings.perturbations,
        }
    }

    /// Whether training goes over from one motion into another.
    pub fn has_transitions(&self) -> bool {
        match self {
            Self::Imitate(settings) => settings.transitions_s.is_some(),
        }
    }
}

impl Default for TaskSettings {
    fn default() -> Self {
        Self::Imitate(ImitationSettings::default())
    }
}

impl From<ImitationSettings> for TaskSettings {
    fn from(settings: ImitationSettings) -> Self {
        Self::Imitate(settings)
    }
}

impl<'de> Deserialize<'de> for TaskSettings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut settings = Value::deserialize(deserializer)?;
        let kind = settings.as_object_mut().and_then(|s| s.remove("kind"));
        match kind.as_ref().map(|kind| kind.as_str().unwrap_or_default()) {
            None | Some(imitate::NAME) => serde_json::from_value(settings)
                .map(Self::Imitate)
                .map_err(|e| D::Error::custom(format!("task: {e}"))),
            Some(other) => {
                let known = TASKS.map(|(name, _)| name).join(", ");
                Err(D::Error::custom(format!(
                    "task: there is no task `{other}`; use one of {known}"
                )))
            }
        }
    }
}
