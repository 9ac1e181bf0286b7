//! Checks of a motion: what each measures, its limit, and what to do beyond the limit.

use crate::clip::Severity;
use crate::explain::Parameter;
use serde::Serialize;

/// One measure of a motion against its limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// Stable identifier in kebab-case, e.g. `foot-skate`. It never changes its meaning.
    pub id: &'static str,
    /// What is measured, in words.
    pub name: &'static str,
    /// The measured value, in `unit`.
    pub value: f64,
    /// Unit of `value` and `limit`; empty for shares and counts.
    pub unit: &'static str,
    /// Largest value that passes.
    pub limit: f64,
    /// Whether the value is within the limit.
    pub passed: bool,
    /// How much it matters if the check fails.
    pub severity: Severity,
    /// Frame with the greatest value; `None` for a mean or a count without one.
    pub frame: Option<usize>,
    /// What to do if the check fails.
    pub advice: &'static str,
    /// The parameters that the advice is about. A command line knows which flags set them.
    #[serde(skip)]
    pub parameters: &'static [Parameter],
}

/// What a check is, apart from its value.
pub(super) struct Kind {
    id: &'static str,
    name: &'static str,
    unit: &'static str,
    limit: f64,
    severity: Severity,
    advice: &'static str,
    parameters: &'static [Parameter],
}

/// Limit chosen: about the thickness of an arm. Beyond it a limb visibly isn't where the source's is.
pub(super) const KEY_POINTS: Kind = Kind {
    id: "keypoint-error",
    name: "mean distance of the joints from the source's",
    unit: "m",
    limit: 0.05,
    severity: Severity::Warning,
    advice: "check the joint map, and correct it if a joint is wrong",
    parameters: &[Parameter::JointMap],
};
/// Limit chosen: contacts of motion and source are found in different ways and so differ in a frame or two at each end of a
/// stance, which is less than a tenth of the frames of a gait.
pub(super) const AGREEMENT: Kind = Kind {
    id: "contact-disagreement",
    name: "share of contacts of feet and hands that differ from the source's",
    unit: "",
    limit: 0.1,
    severity: Severity::Warning,
    advice: "check the ground, the up axis and the unit of the clip, because the source floats or sinks",
    parameters: &[Parameter::UpAxis, Parameter::Unit],
};
/// Limit chosen: a foot that is carried along with a walk slides at more than 1 m/s, twenty times as fast.
pub(super) const SKATE: Kind = Kind {
    id: "foot-skate",
    name: "mean speed of feet and hands in the middle of their stances",
    unit: "m/s",
    limit: 0.05,
    severity: Severity::Warning,
    advice: "look at the source, whose own feet may slide, or cut this part",
    parameters: &[Parameter::Trim],
};
/// Limit chosen: about the width of a foot. Only a note, because a pivot or a slide may be meant.
pub(super) const SLIDE: Kind = Kind {
    id: "stance-slide",
    name: "longest slide of a foot or hand within one stance",
    unit: "m",
    limit: 0.1,
    severity: Severity::Note,
    advice: "cut this part, unless the pivot or slide is meant",
    parameters: &[Parameter::Trim],
};
/// Limit chosen: 1 cm.
pub(super) const PENETRATION: Kind = Kind {
    id: "penetration",
    name: "greatest depth below the ground",
    unit: "m",
    limit: 0.01,
    severity: Severity::Warning,
    advice: "check the ground of the clip, because the ground pushes the body out when an episode starts there",
    parameters: &[],
};
/// Limit chosen: 1 cm, like that of [`PENETRATION`].
pub(super) const FLOAT: Kind = Kind {
    id: "float",
    name: "mean height of standing feet and hands above the ground",
    unit: "m",
    limit: 0.01,
    severity: Severity::Warning,
    advice: "check the ground of the clip, because a policy can't push on ground that it doesn't touch",
    parameters: &[],
};
/// The limit is by definition: the solver keeps every coordinate within its range.
pub(super) const LIMITS: Kind = Kind {
    id: "joint-limits",
    name: "coordinates outside their range, over all frames",
    unit: "",
    limit: 0.0,
    severity: Severity::Error,
    advice: "retarget the clip again, or widen the range in the skeleton's MJCF",
    parameters: &[],
};
/// Limit chosen: a frame that was lost or doubled in a steady movement has many times the acceleration of those around it.
pub(super) const SMOOTHNESS: Kind = Kind {
    id: "smoothness",
    name: "greatest acceleration of a body relative to the frames around",
    unit: "times",
    limit: 8.0,
    severity: Severity::Warning,
    advice: "look at the source, which seems to jump there, and cut the jump",
    parameters: &[Parameter::Trim],
};
/// Limit chosen: a quarter of the weight.
pub(super) const RESIDUAL: Kind = Kind {
    id: "root-residual",
    name: "mean force that no contact can supply, relative to the weight",
    unit: "",
    limit: 0.25,
    severity: Severity::Warning,
    advice: "expect the policy to move differently there, because the motion needs a force that no contact can supply",
    parameters: &[],
};
/// Limit chosen: half the weight is missing where a clip was slowed down to 0.7 of its speed, because accelerations go with
/// the square of the speed.
pub(super) const BALLISTIC: Kind = Kind {
    id: "ballistic",
    name: "mean force that is missing during flights, relative to the weight",
    unit: "",
    limit: 0.5,
    severity: Severity::Warning,
    advice: "check the unit, and give a clip that was slowed down its own speed back, because its flights aren't free fall",
    parameters: &[Parameter::Unit, Parameter::Speed],
};
/// The limit is by definition: 1 is the drive's own limit.
pub(super) const TORQUE: Kind = Kind {
    id: "joint-torque",
    name: "torque relative to the drive's limit, 99th percentile of the frames",
    unit: "times",
    limit: 1.0,
    severity: Severity::Note,
    advice: "raise `forcerange` in the skeleton's MJCF, or expect softer movement, because the skeleton is weaker than the performer was",
    parameters: &[],
};

impl Kind {
    /// The check of this value.
    pub(super) fn check(&self, value: f64, frame: Option<usize>) -> Check {
        Check {
            id: self.id,
            name: self.name,
            value,
            unit: self.unit,
            limit: self.limit,
            passed: value <= self.limit,
            severity: self.severity,
            frame,
            advice: self.advice,
            parameters: self.parameters,
        }
    }

    /// The check of the mean of these values; `None` where there are none.
    pub(super) fn mean(&self, values: impl Iterator<Item = f64>) -> Option<Check> {
        let values: Vec<f64> = values.collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (!values.is_empty()).then(|| self.check(mean, None))
    }

    /// The check of the greatest of these values, each with its frame; `None` where there are none.
    pub(super) fn greatest(&self, values: impl Iterator<Item = (usize, f64)>) -> Option<Check> {
        let (frame, value) = values.max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(self.check(value, Some(frame)))
    }
}
