//! What a task can be told, and the stage on which it plays.

use crate::humanoid::Slot;
use crate::motion::MotionError;
use crate::sim::{Character, Settings, SimError};
use crate::skeleton::Skeleton;
use serde::{Deserialize, Serialize};

/// What the network's output means.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Actions {
    /// Rotation added to the reference's own joint targets, `scale` radians for an output of one.
    Residual { scale: f32 },
    /// Exponential-map target itself: the middle of each coordinate's range for zero, its ends times `reach` for ±1.
    Absolute { reach: f32 },
}

impl Actions {
    fn size(&self) -> f64 {
        match self {
            Actions::Residual { scale } => f64::from(*scale),
            Actions::Absolute { reach } => f64::from(*reach),
        }
    }
}

/// Weights of the reward terms; their sum is the largest reward of a step. See [`super::Terms`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rewards {
    pub pose: f32,
    pub velocity: f32,
    pub position: f32,
    pub root: f32,
    pub root_velocity: f32,
    pub com: f32,
    pub angular_momentum: f32,
}

impl Default for Rewards {
    fn default() -> Self {
        Self {
            pose: 0.3,
            velocity: 0.1,
            position: 0.25,
            root: 0.15,
            root_velocity: 0.1,
            com: 0.05,
            angular_momentum: 0.05,
        }
    }
}

/// When an episode fails.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Terminations {
    /// A body further than this from its reference, metres.
    pub distance: f32,
    /// A body that the reference never puts on the ground touches it.
    pub fall: bool,
    /// Reward of a step below this, as in the paper; `None` leaves the rule out.
    pub reward: Option<f32>,
}

impl Default for Terminations {
    fn default() -> Self {
        Self {
            distance: 0.5,
            fall: true,
            reward: None,
        }
    }
}

/// Everything that a task can be told.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Setting {
    pub physics: Settings,
    pub actions: Actions,
    pub rewards: Rewards,
    pub terminations: Terminations,
    /// Start at any phase (reference state initialisation), not only at the first frame.
    pub start_anywhere: bool,
    /// Longest episode in training, seconds.
    pub episode_s: f64,
}

impl Default for Setting {
    fn default() -> Self {
        Self {
            physics: Settings::default(),
            actions: Actions::Residual { scale: 0.3 },
            rewards: Rewards::default(),
            terminations: Terminations::default(),
            start_anywhere: true,
            episode_s: 10.0,
        }
    }
}

impl Setting {
    /// # Errors
    /// A number that no task can have.
    pub fn check(&self) -> Result<(), TaskError> {
        let w = &self.rewards;
        let weights = [
            w.pose,
            w.velocity,
            w.position,
            w.root,
            w.root_velocity,
            w.com,
            w.angular_momentum,
        ];
        let least = weights.iter().copied().fold(f32::INFINITY, f32::min);
        let physics = &self.physics;
        let positive = f64::MIN_POSITIVE..=1e6;
        let checks = [
            ("control_hz", physics.control_hz, 1.0..=1e4, "1 to 10000"),
            (
                "steps_per_control",
                f64::from(physics.steps_per_control),
                1.0..=1e3,
                "1 to 1000",
            ),
            (
                "substeps",
                f64::from(physics.substeps),
                1.0..=1e3,
                "1 to 1000",
            ),
            ("episode_s", self.episode_s, positive.clone(), "positive"),
            (
                "the smallest reward weight",
                f64::from(least),
                0.0..=f64::MAX,
                "0 or more",
            ),
            (
                "the sum of the reward weights",
                f64::from(weights.iter().sum::<f32>()),
                positive.clone(),
                "positive",
            ),
            (
                "the distance that ends an episode",
                f64::from(self.terminations.distance),
                positive.clone(),
                "positive",
            ),
            (
                "the reward that ends an episode",
                f64::from(self.terminations.reward.unwrap_or(0.0)),
                0.0..=1.0,
                "0 to 1",
            ),
            (
                "the size of an action",
                self.actions.size(),
                positive,
                "positive",
            ),
        ];
        for (name, value, range, text) in checks {
            if !range.contains(&value) {
                return Err(TaskError::Setting {
                    name,
                    value,
                    range: text,
                });
            }
        }
        Ok(())
    }
}

/// Why a task can't be set up.
#[derive(Debug, thiserror::Error)]
pub enum TaskError {
    #[error(transparent)]
    Sim(#[from] SimError),
    #[error(transparent)]
    Motion(#[from] MotionError),
    #[error("{name} is {value}, and must be {range}")]
    Setting {
        name: &'static str,
        value: f64,
        range: &'static str,
    },
    #[error(
        "skeleton `{skeleton}` stands {leg} m tall from hip to sole, so its size can't be judged: give it slots for hips and legs"
    )]
    NoLegs { skeleton: String, leg: f64 },
    #[error("the motion has {frames} frame(s), and imitation needs at least two")]
    TooShort { frames: usize },
}

/// What every environment of a run shares: skeleton, character and the bodies of interest.
#[derive(Clone, Debug)]
pub struct Stage {
    pub skeleton: Skeleton,
    pub character: Character,
    /// Bodies whose positions the observation holds: head, hands and feet where the skeleton has them.
    pub key_bodies: Vec<usize>,
    /// What divides angular momentum: mass × leg length × √(g × leg length), kg·m²/s.
    pub momentum_scale: f32,
}

impl Stage {
    /// # Errors
    /// A skeleton that can't be simulated.
    pub fn new(skeleton: Skeleton) -> Result<Self, TaskError> {
        let character = Character::new(&skeleton)?;
        let ends = [
            Slot::Head,
            Slot::LeftHand,
            Slot::RightHand,
            Slot::LeftFoot,
            Slot::RightFoot,
        ];
        let key_bodies = ends
            .iter()
            .filter_map(|slot| skeleton.slots.get(slot).copied())
            .collect();
        let leg = skeleton.leg_length();
        if !(leg.is_finite() && leg > 0.0) {
            return Err(TaskError::NoLegs {
                skeleton: skeleton.name,
                leg,
            });
        }
        let momentum_scale = (skeleton.total_mass() * leg * (9.81 * leg).sqrt()) as f32;
        Ok(Stage {
            skeleton,
            character,
            key_bodies,
            momentum_scale,
        })
    }
}
