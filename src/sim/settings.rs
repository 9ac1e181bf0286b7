//! What physics is set to: which engine, at which rates.

use crate::schema::OutOfRange;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The engine that moves a character.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Engine {
    /// Our own engine: reduced coordinates, drives that are stable at any stiffness.
    #[default]
    Articulated,
    /// rapier3d with impulse joints: maximal coordinates.
    Rapier,
}

/// Rates and solver settings of the physics.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Control steps per second: how often the policy acts.
    #[schemars(range(min = 1.0, max = 1000.0), extend("x-unit" = "Hz"))]
    pub control_hz: f64,
    /// Physics steps per control step.
    #[schemars(range(min = 1, max = 1000))]
    pub steps_per_control: u32,
    /// Substeps per physics step, each of which integrates joints, drives and contacts. A control step has at most 10000 of
    /// them.
    #[schemars(range(min = 1, max = 1000))]
    pub substeps: u32,
    /// Time constant with which the ground gives way under a contact, as in MuJoCo's `solref`, where 0.02 s is usual. At 0 the
    /// ground is hard. The rapier engine ignores this and uses its own contact model.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "s"))]
    pub contact_s: f64,
    /// The engine that moves the character.
    pub engine: Engine,
}

/// Most substeps of a control step. Chosen: physics at 10 kHz for a policy that acts once a second.
const MOST_SUBSTEPS: u32 = 10_000;

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
    /// Duration of one control step, seconds.
    pub fn control_dt(&self) -> f64 {
        1.0 / self.control_hz
    }

    /// Checks that a control step ends in bearable time.
    ///
    /// # Errors
    /// Too many substeps in a control step.
    pub(crate) fn check(&self) -> Result<(), OutOfRange> {
        // Within their ranges, the product of the two doesn't overflow.
        let substeps = self.steps_per_control * self.substeps;
        match substeps {
            ..=MOST_SUBSTEPS => Ok(()),
            _ => Err(OutOfRange {
                setting: "task.physics.steps_per_control × substeps".to_owned(),
                value: substeps.to_string(),
                allowed: format!("at most {MOST_SUBSTEPS} substeps in a control step"),
            }),
        }
    }

    /// Rate at which joints, drives and contacts are integrated, Hz.
    pub fn physics_hz(&self) -> f64 {
        self.control_hz * f64::from(self.steps_per_control * self.substeps)
    }
}
