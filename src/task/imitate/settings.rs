//! The settings of the imitation task.

use crate::schema;
use crate::sim::Settings;
use crate::task::disturbance::Perturbations;
use crate::task::error::TaskError;
use crate::task::follow::{Actions, Rewards, Terminations};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What the policy sees; see [`super::layout`] for the blocks of each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Observations {
    /// Our own: the agent, its errors against the reference, and the phase, in the root's frame.
    #[default]
    Tracking,
    /// As `tracking`, and where the reference is going: its root, joints and contacts 0.1 and 0.3 s after the next control
    /// step.
    TrackingAhead,
    /// Peng et al. 2018, "DeepMimic", section 4: all bodies in the heading frame, and the phase.
    Deepmimic,
    /// Booth & Ivanov 2020: all bodies, the last action, the centre of mass, angular momentum, soles, and the phase.
    Booth2020,
}

impl Observations {
    /// The moments of the reference that are seen beside the next control step's, seconds after it.
    pub fn ahead(self) -> &'static [f64] {
        match self {
            Observations::TrackingAhead => &[0.1, 0.3],
            _ => &[],
        }
    }
}

/// Settings of the imitation of reference motions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ImitationSettings {
    /// Rates and solver settings of the physics.
    pub physics: Settings,
    /// What the policy's output means.
    pub actions: Actions,
    /// What the policy sees.
    pub observations: Observations,
    /// What the policy is rewarded for.
    pub rewards: Rewards,
    /// When an episode fails.
    pub terminations: Terminations,
    /// What disturbs the episodes of training.
    pub perturbations: Perturbations,
    /// Whether episodes begin at any phase (reference state initialisation) instead of at the first frame alone.
    pub start_anywhere: bool,
    /// Share of the episodes that begin where failure is likely; the others begin in any motion, and anywhere in it if
    /// `task.start_anywhere`. Failures from starts beyond reach, where the reference asks for more force than the ground can give,
    /// don't count here.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub adaptive_starts: f64,
    /// Time from the start of an episode to its first transition into another motion of the run, and from each to the next: the
    /// least and the most. `null` keeps an episode to one motion.
    #[schemars(
        inner(range(min = 0.1, max = 3600.0)),
        extend("x-ascending" = true, "x-unit" = "s")
    )]
    pub transitions_s: Option<[f64; 2]>,
    /// Whether each cycle of a looping motion begins where the agent's root is along the ground, so that the agent never has to
    /// catch up. Otherwise the motion goes its own way, until a shove or a transition moves it.
    pub cycles_follow: bool,
    /// Longest episode in training.
    #[schemars(range(max = 3600.0), extend("exclusiveMinimum" = 0, "x-unit" = "s"))]
    pub episode_s: f64,
}

impl Default for ImitationSettings {
    fn default() -> Self {
        Self {
            physics: Settings::default(),
            actions: Actions::Residual { scale: 0.3 },
            observations: Observations::Tracking,
            rewards: Rewards::default(),
            terminations: Terminations::default(),
            perturbations: Perturbations::default(),
            start_anywhere: true,
            adaptive_starts: 0.25,
            transitions_s: None,
            cycles_follow: false,
            episode_s: 10.0,
        }
    }
}

impl ImitationSettings {
    /// Checks that all numbers are in their ranges, and that the reward has the terms that are weighted.
    ///
    /// # Errors
    /// The first that isn't.
    pub fn check(&self) -> Result<(), TaskError> {
        schema::check(self, "task")?;
        self.physics.check()?;
        self.rewards.check()
    }
}
