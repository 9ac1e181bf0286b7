//! The settings of a task, whichever it is.

use super::disturbance::Perturbations;
use super::environment::Task;
use super::error::TaskError;
use super::imitate::{self, Imitate, ImitationSettings};
use super::model::CharacterModel;
use crate::motion::Motion;
use crate::sim::Settings;
use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeSeed, Error, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;
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
        deserializer.deserialize_map(Named)
    }
}

/// Reads the settings of a task as they stand, beside its name: kept until the name is known, a large file would fill the memory.
struct Named;

impl<'de> Visitor<'de> for Named {
    type Value = TaskSettings;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("the settings of a task")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<TaskSettings, A::Error> {
        let settings = MapAccessDeserializer::new(WithoutKind(map));
        ImitationSettings::deserialize(settings).map(TaskSettings::Imitate)
    }
}

/// The fields of an object but for `kind`, which has to be the name of a task.
struct WithoutKind<A>(A);

impl<'de, A: MapAccess<'de>> MapAccess<'de> for WithoutKind<A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, A::Error> {
        while let Some(key) = self.0.next_key::<String>()? {
            if key != "kind" {
                return seed.deserialize(key.into_deserializer()).map(Some);
            }
            let kind: String = self.0.next_value()?;
            if kind != imitate::NAME {
                let known = TASKS.map(|(name, _)| name).join(", ");
                let cause = format!("task: there is no task `{kind}`; use one of {known}");
                return Err(A::Error::custom(cause));
            }
        }
        Ok(None)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.0.next_value_seed(seed)
    }
}
