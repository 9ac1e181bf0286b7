//! The settings of the steering task.

use crate::schema;
use crate::sim::Settings;
use crate::task::disturbance::Perturbations;
use crate::task::error::TaskError;
use crate::task::follow::{Actions, Rewards, Terminations};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What players ask for in training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct InputSettings {
    /// How long a wish is held: the least and the most.
    #[schemars(
        inner(range(min = 0.05, max = 3600.0)),
        extend("x-ascending" = true, "x-unit" = "s")
    )]
    pub held_s: [f64; 2],
    /// Share of the wishes that are stops.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub stops: f64,
    /// Most speed that is asked for; `null` is that of the fastest gait forward.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0, "x-unit" = "m/s"))]
    pub fastest_m_s: Option<f32>,
    /// Share of the wishes with a facing of their own, where the character has gaits to the side.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub facings: f64,
}

impl Default for InputSettings {
    fn default() -> Self {
        Self {
            held_s: [1.0, 6.0],
            stops: 0.1,
            fastest_m_s: None,
            facings: 0.2,
        }
    }
}

/// Settings of a character that is steered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SteerSettings {
    /// Rates and solver settings of the physics.
    pub physics: Settings,
    /// What the policy's output means.
    pub actions: Actions,
    /// What the policy is rewarded for.
    pub rewards: Rewards,
    /// When an episode fails.
    pub terminations: Terminations,
    /// What disturbs the episodes of training.
    pub perturbations: Perturbations,
    /// What is asked for in training.
    pub input: InputSettings,
    /// Farthest that the animated character goes ahead of the simulated one; beyond, it waits.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0, "x-unit" = "m"))]
    pub leash_m: f32,
    /// Longest episode in training.
    #[schemars(range(max = 3600.0), extend("exclusiveMinimum" = 0, "x-unit" = "s"))]
    pub episode_s: f64,
}

impl Default for SteerSettings {
    fn default() -> Self {
        Self {
            physics: Settings::default(),
            actions: Actions::Residual { scale: 0.3 },
            rewards: Rewards::default(),
            // Half a metre, as in imitation, ends most turns before they are learned (`docs/notebook/steering.md`).
            terminations: Terminations {
                distance: Some(1.0),
                ..Terminations::default()
            },
            perturbations: Perturbations::default(),
            input: InputSettings::default(),
            leash_m: 0.25,
            episode_s: 10.0,
        }
    }
}

impl SteerSettings {
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
