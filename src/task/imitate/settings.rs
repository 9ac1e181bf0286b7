//! The settings of the imitation task.

use super::reward::{Kernels, TERM_NAMES};
use crate::schema::{self, OutOfRange};
use crate::sim::Settings;
use crate::task::disturbance::Perturbations;
use crate::task::error::TaskError;
use schemars::JsonSchema;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// What the network's output means.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Actions {
    /// The output is a rotation that is added to the reference's own joint targets.
    Residual {
        /// Rotation for an output of 1.
        #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0, "x-unit" = "rad"))]
        scale: f32,
    },
    /// The output is the target itself, as an exponential map: 0 is the middle of each coordinate's range. A hinge is aimed at
    /// most half a radian beyond its range.
    Absolute {
        /// Target for an output of ±1, as a share of the way from the target for 0 to the end of the range; under `from-rest` to
        /// the farther end.
        #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0))]
        reach: f32,
    },
    /// The output is the target itself, as an exponential map: 0 is the rest pose. A hinge is aimed at most half a radian
    /// beyond its range.
    FromRest {
        /// Target for an output of ±1, as a share of the way from the target for 0 to the end of the range; under `from-rest` to
        /// the farther end.
        #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0))]
        reach: f32,
    },
}

/// [`Actions`] as they are read: field by field, so that one of another name is found, and takes no memory.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ActionFields {
    kind: ActionKind,
    scale: Option<f32>,
    reach: Option<f32>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ActionKind {
    Residual,
    Absolute,
    FromRest,
}

impl<'de> Deserialize<'de> for Actions {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use ActionKind::{Absolute, FromRest, Residual};
        let fields = ActionFields::deserialize(deserializer)?;
        let missing = D::Error::missing_field;
        match (fields.kind, fields.scale, fields.reach) {
            (Residual, _, Some(_)) => Err(D::Error::unknown_field("reach", &["kind", "scale"])),
            (Absolute | FromRest, Some(_), _) => {
                Err(D::Error::unknown_field("scale", &["kind", "reach"]))
            }
            (Residual, scale, None) => Ok(Self::Residual {
                scale: scale.ok_or_else(|| missing("scale"))?,
            }),
            (Absolute, None, reach) => Ok(Self::Absolute {
                reach: reach.ok_or_else(|| missing("reach"))?,
            }),
            (FromRest, None, reach) => Ok(Self::FromRest {
                reach: reach.ok_or_else(|| missing("reach"))?,
            }),
        }
    }
}

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

/// Weights of the reward terms; what a step earns is divided by their sum. See [`super::Terms`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Rewards {
    /// Which errors the terms are made of.
    pub kernels: Kernels,
    /// Weight of the error of the joints' rotations.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub pose: f32,
    /// Weight of the error of the joints' or bodies' angular velocities.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub velocity: f32,
    /// Weight of the error of the bodies' positions relative to the root.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub position: f32,
    /// Weight of the error of the root's position and rotation.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub root: f32,
    /// Weight of the error of the root's linear and angular velocity.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub root_velocity: f32,
    /// Weight of the error of the centre of mass's velocity.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub com: f32,
    /// Weight of the error of the angular momentum about the centre of mass.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub angular_momentum: f32,
    /// Weight of the error of the positions of hands and feet.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub end_effector: f32,
    /// Weight of the error of the velocities of hands and feet.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub end_effector_velocity: f32,
    /// Weight of the error of the centre of mass's position.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub com_position: f32,
}

impl Rewards {
    /// All weights, in the order of [`TERM_NAMES`].
    pub fn weights(&self) -> [f32; TERM_NAMES.len()] {
        [
            self.pose,
            self.velocity,
            self.position,
            self.root,
            self.root_velocity,
            self.com,
            self.angular_momentum,
            self.end_effector,
            self.end_effector_velocity,
            self.com_position,
        ]
    }

    /// A weight for a term that the kernels don't have would only make every reward smaller, and rewards are divided by the
    /// sum of the weights.
    pub(in crate::task) fn check(&self) -> Result<(), TaskError> {
        let weights = self.weights().into_iter().zip(self.kernels.has());
        match TERM_NAMES
            .iter()
            .zip(weights)
            .find(|(_, (weight, has))| !has && *weight != 0.0)
        {
            Some((term, _)) => Err(TaskError::NoSuchTerm {
                term,
                kernels: self.kernels.to_string(),
            }),
            None if self.weights().iter().sum::<f32>() > 0.0 => Ok(()),
            None => Err(TaskError::Setting(OutOfRange {
                setting: "task.rewards".to_owned(),
                value: "a sum of weights of 0".to_owned(),
                allowed: "at least one weight above 0".to_owned(),
            })),
        }
    }
}

impl Default for Rewards {
    fn default() -> Self {
        Self {
            kernels: Kernels::Tracking,
            pose: 0.3,
            velocity: 0.1,
            position: 0.25,
            root: 0.15,
            root_velocity: 0.1,
            com: 0.05,
            angular_momentum: 0.05,
            end_effector: 0.0,
            end_effector_velocity: 0.0,
            com_position: 0.0,
        }
    }
}

/// When an episode fails.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Terminations {
    /// An episode fails when any body is farther than this from its reference. `null` leaves the rule out.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0, "x-unit" = "m"))]
    pub distance: Option<f32>,
    /// An episode fails when a body touches the ground that the reference never puts there.
    pub fall: bool,
    /// An episode fails when the reward of a step is below this, as in Booth & Ivanov 2020. `null` leaves the rule out.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub reward: Option<f32>,
}

impl Default for Terminations {
    fn default() -> Self {
        Self {
            distance: Some(0.5),
            fall: true,
            reward: None,
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
