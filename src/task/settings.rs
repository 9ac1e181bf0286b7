//! The settings of a task, whichever it is.

use super::disturbance::Perturbations;
use super::environment::Task;
use super::error::TaskError;
use super::follow::{Actions, Rewards, Terminations};
use super::imitate::{self, Imitate, ImitationSettings, Observations};
use super::model::CharacterModel;
use super::steer::{self, InputSettings, Steer, SteerSettings};
use crate::motion::Motion;
use crate::sim::Settings;
use schemars::JsonSchema;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};
use std::sync::Arc;

/// Names of the tasks, each with what it is, the default first.
pub const TASKS: [(&str, &str); 2] = [
    (
        imitate::NAME,
        "perform the motion, guided by its phase (the default)",
    ),
    (
        steer::NAME,
        "go where a player asks, in the style of the motions: one that stands and at least one that walks",
    ),
];

/// The settings of one task. In JSON an object with the task's own settings and its name as `kind`. An object
/// without `kind` is of the task `imitate`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "lowercase")]
#[non_exhaustive]
pub enum TaskSettings {
    /// Imitation of reference motions.
    Imitate(ImitationSettings),
    /// Following a player.
    Steer(SteerSettings),
}

impl TaskSettings {
    /// The task's name on the command line and in files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Imitate(_) => imitate::NAME,
            Self::Steer(_) => steer::NAME,
        }
    }

    /// The default settings of the task of this name, one of [`TASKS`].
    pub fn named(name: &str) -> Option<Self> {
        match name {
            imitate::NAME => Some(Self::default()),
            steer::NAME => Some(Self::Steer(SteerSettings::default())),
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
            Self::Steer(settings) => Arc::new(Steer::new(model, motions, *settings)?),
        })
    }

    /// Checks that all numbers are in their ranges.
    ///
    /// # Errors
    /// The first that isn't.
    pub fn check(&self) -> Result<(), TaskError> {
        match self {
            Self::Imitate(settings) => settings.check(),
            Self::Steer(settings) => settings.check(),
        }
    }

    /// The physics in which the character moves.
    pub fn physics(&self) -> &Settings {
        match self {
            Self::Imitate(settings) => &settings.physics,
            Self::Steer(settings) => &settings.physics,
        }
    }

    /// What disturbs training.
    pub fn perturbations(&self) -> &Perturbations {
        match self {
            Self::Imitate(settings) => &settings.perturbations,
            Self::Steer(settings) => &settings.perturbations,
        }
    }

    /// What disturbs training, to be changed.
    pub fn perturbations_mut(&mut self) -> &mut Perturbations {
        match self {
            Self::Imitate(settings) => &mut settings.perturbations,
            Self::Steer(settings) => &mut settings.perturbations,
        }
    }

    /// Whether training goes over from one motion into another.
    pub fn has_transitions(&self) -> bool {
        match self {
            Self::Imitate(settings) => settings.transitions_s.is_some(),
            Self::Steer(_) => false,
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

/// The fields of all tasks as they are read: the name may stand behind them, and kept until it is known, a large file would fill
/// the memory.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Fields {
    kind: Option<String>,
    physics: Option<Settings>,
    actions: Option<Actions>,
    observations: Option<Observations>,
    rewards: Option<Rewards>,
    terminations: Option<Terminations>,
    perturbations: Option<Perturbations>,
    start_anywhere: Option<bool>,
    adaptive_starts: Option<f64>,
    /// `null` means something here, unlike a field that isn't there.
    #[serde(default, deserialize_with = "given")]
    transitions_s: Option<Option<[f64; 2]>>,
    cycles_follow: Option<bool>,
    input: Option<InputSettings>,
    leash_m: Option<f32>,
    episode_s: Option<f64>,
}

/// A field that is there, even if it is `null`.
fn given<'de, D: Deserializer<'de>, T: Deserialize<'de>>(from: D) -> Result<Option<T>, D::Error> {
    T::deserialize(from).map(Some)
}

impl<'de> Deserialize<'de> for TaskSettings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let fields = Fields::deserialize(deserializer)?;
        let kind = fields
            .kind
            .clone()
            .unwrap_or_else(|| imitate::NAME.to_owned());
        let made = match kind.as_str() {
            imitate::NAME => fields.imitate().map(Self::Imitate),
            steer::NAME => fields.steer().map(Self::Steer),
            _ => {
                let known = TASKS.map(|(name, _)| name).join(", ");
                let cause = format!("task: there is no task `{kind}`; use one of {known}");
                return Err(D::Error::custom(cause));
            }
        };
        made.map_err(|field| D::Error::custom(format!("task: `{kind}` has no setting `{field}`")))
    }
}

impl Fields {
    /// Settings of imitation; fails with the name of a field that it doesn't have.
    fn imitate(self) -> Result<ImitationSettings, &'static str> {
        let own = ImitationSettings::default();
        match (&self.input, &self.leash_m) {
            (Some(_), _) => return Err("input"),
            (_, Some(_)) => return Err("leash_m"),
            _ => {}
        }
        Ok(ImitationSettings {
            physics: self.physics.unwrap_or(own.physics),
            actions: self.actions.unwrap_or(own.actions),
            observations: self.observations.unwrap_or(own.observations),
            rewards: self.rewards.unwrap_or(own.rewards),
            terminations: self.terminations.unwrap_or(own.terminations),
            perturbations: self.perturbations.unwrap_or(own.perturbations),
            start_anywhere: self.start_anywhere.unwrap_or(own.start_anywhere),
            adaptive_starts: self.adaptive_starts.unwrap_or(own.adaptive_starts),
            transitions_s: self.transitions_s.unwrap_or(own.transitions_s),
            cycles_follow: self.cycles_follow.unwrap_or(own.cycles_follow),
            episode_s: self.episode_s.unwrap_or(own.episode_s),
        })
    }

    /// Settings of steering; likewise.
    fn steer(self) -> Result<SteerSettings, &'static str> {
        let foreign = [
            ("observations", self.observations.is_some()),
            ("start_anywhere", self.start_anywhere.is_some()),
            ("adaptive_starts", self.adaptive_starts.is_some()),
            ("transitions_s", self.transitions_s.is_some()),
            ("cycles_follow", self.cycles_follow.is_some()),
        ];
        if let Some((field, _)) = foreign.into_iter().find(|(_, given)| *given) {
            return Err(field);
        }
        let own = SteerSettings::default();
        Ok(SteerSettings {
            physics: self.physics.unwrap_or(own.physics),
            actions: self.actions.unwrap_or(own.actions),
            rewards: self.rewards.unwrap_or(own.rewards),
            terminations: self.terminations.unwrap_or(own.terminations),
            perturbations: self.perturbations.unwrap_or(own.perturbations),
            input: self.input.unwrap_or(own.input),
            leash_m: self.leash_m.unwrap_or(own.leash_m),
            episode_s: self.episode_s.unwrap_or(own.episode_s),
        })
    }
}
