//! Settings that every task with a reference has.

use super::reward::{Kernels, TERM_NAMES};
use crate::schema::OutOfRange;
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
    ///
    /// # Errors
    /// A weight for a term that the kernels don't have, or no weight at all.
    pub fn check(&self) -> Result<(), TaskError> {
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
