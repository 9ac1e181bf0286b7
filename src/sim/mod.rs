//! A character under drives, gravity and ground contact.
//!
//! Two engines move it, behind one [`World`]: our own in reduced coordinates, and rapier. Characters, targets and
//! states are the same for both, so a skill that was learned in one can be performed in the other.

mod articulated;
mod character;
mod rapier;
#[cfg(test)]
mod tests;
mod world;

pub use articulated::LANES;
pub use character::{Attachment, Character, HingeAxis, Link, LinkJoint};
pub use world::{LinkState, Target, World};

use serde::{Deserialize, Serialize};

/// What moves the character.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Engine {
    /// Our own: reduced coordinates, drives that are stable at any gain.
    #[default]
    Articulated,
    /// rapier's impulse joints: maximal coordinates.
    Rapier,
}

/// Rates and solver settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Control steps per second; default 30.
    pub control_hz: f64,
    /// Physics steps in one control step; default 2.
    pub steps_per_control: u32,
    /// Substeps in one physics step, each of which integrates joints, drives and contacts; default 4.
    pub substeps: u32,
    /// Seconds in which the ground yields to a foot, as the time constant of MuJoCo's `solref`, which is 0.02 there by
    /// default; 0: the ground is hard. The rapier engine has its own.
    pub contact_s: f64,
    /// Default [`Engine::Articulated`].
    pub engine: Engine,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            control_hz: 30.0,
            steps_per_control: 2,
            substeps: 4,
            contact_s: 0.0,
            engine: Engine::Articulated,
        }
    }
}

impl Settings {
    /// Seconds of one control step.
    pub fn control_dt(&self) -> f64 {
        1.0 / self.control_hz
    }

    /// Rate at which joints and contacts are integrated, in Hz.
    pub fn physics_hz(&self) -> f64 {
        self.control_hz * f64::from(self.steps_per_control * self.substeps)
    }
}

/// The state stopped being finite or left the world; the episode has to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the simulation diverged")]
pub struct Diverged;

/// Why a skeleton can't be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    #[error(
        "body `{body}` slides on joint `{joint}`, and only free, ball and hinge joints can be simulated"
    )]
    SlideJoint { body: String, joint: String },
    #[error(
        "body `{body}` has {count} joints; one ball joint or up to three hinges can be simulated"
    )]
    TooManyJoints { body: String, count: usize },
    #[error("two hinges of body `{body}` turn about the same axis: make them one")]
    ParallelHinges { body: String },
    #[error("the root body `{body}` must have a free joint and nothing else")]
    RootIsNotFree { body: String },
    #[error("body `{body}` starts a second character; only one root is simulated")]
    SecondRoot { body: String },
    #[error("body `{body}` has no mass, so no force can move it: give it a shape or an inertial")]
    Massless { body: String },
    #[error("the skeleton has no bodies")]
    Empty,
}
