//! Why a clip can't be retargeted.

use crate::clip::{LEAST_FPS, MOST_FPS, MOST_SECONDS};
use crate::explain::{Explain, Explanation, Parameter, explained};
use crate::humanoid::{self, Slot};

/// The largest weight of a slot. Chosen: beyond it, hardly anything else has a say in the solution.
pub(super) const MOST_WEIGHT: f64 = 100.0;

/// Why a clip can't be carried onto a skeleton.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum RetargetError {
    /// No joint map was given, and none can be found.
    NotHumanoid {
        /// The clip's name.
        clip: String,
        /// What a humanoid has and this figure lacks.
        reason: humanoid::Error,
    },
    /// The joint map names a joint that the clip doesn't have.
    NoSuchJoint {
        /// The slot with that joint.
        slot: Slot,
        /// Its index in the clip's joints.
        joint: usize,
        /// How many joints the clip has.
        count: usize,
    },
    /// The weight of a slot is out of range.
    Weight {
        /// The slot.
        slot: Slot,
        /// Its weight.
        weight: f64,
    },
    /// The clip has no frames.
    Empty {
        /// The clip's name.
        clip: String,
    },
    /// A transform of the clip has a value that is infinite or NaN.
    NotFinite {
        /// The clip's name.
        clip: String,
        /// The frame, from 0; none for the rest pose.
        frame: Option<usize>,
        /// The joint's name.
        joint: String,
    },
    /// The clip's frame rate is out of range, or it lasts too long.
    FrameRate {
        /// The clip's name.
        clip: String,
        /// Hz.
        fps: f64,
        /// How long it lasts.
        seconds: f64,
    },
    /// A frame has more or fewer transforms than the clip has joints.
    Ragged {
        /// The clip's name.
        clip: String,
        /// The frame, from 0.
        frame: usize,
        /// How many transforms it has.
        found: usize,
        /// How many joints the clip has.
        expected: usize,
    },
    /// The size of the source is unknown, for its legs can't be measured.
    NoSourceLegs,
    /// The size of the skeleton is unknown, for its legs can't be measured.
    NoLegs,
    /// The skeleton isn't one figure that moves freely.
    NoFreeRoot {
        /// The skeleton's name.
        skeleton: String,
    },
}

impl Explain for RetargetError {
    fn explain(&self) -> Explanation {
        match self {
            Self::NotHumanoid { clip, reason } => {
                let reason = reason.explain();
                Explanation {
                    cause: format!("clip `{clip}` is no humanoid: {}", reason.cause),
                    ..reason
                }
            }
            Self::NoSuchJoint { slot, joint, count } => Explanation::input(format!(
                "the joint map puts joint number {joint} in slot `{slot}`, but the clip has {count} joints"
            ))
            .remedy_by(
                Parameter::JointMap,
                "use a joint map that was made for this clip",
            ),
            Self::Weight { slot, weight } => {
                Explanation::input(format!("slot `{slot}` has the weight {weight}"))
                    .remedy_by(Parameter::SlotWeight, format!("give it a weight from 0 to {MOST_WEIGHT}"))
            }
            Self::Empty { clip } => Explanation::input(format!("clip `{clip}` has no frames"))
                .remedy_by(Parameter::Take, "choose a take that has frames"),
            Self::NotFinite {
                clip,
                frame: Some(frame),
                joint,
            } => Explanation::input(format!(
                "clip `{clip}` has a value that is no finite number"
            ))
            .place(format!("frame {frame}, joint `{joint}`"))
            .remedy_by(
                Parameter::Trim,
                "export the clip again, or keep a part without that frame",
            ),
            Self::NotFinite {
                clip,
                frame: None,
                joint,
            } => Explanation::input(format!(
                "clip `{clip}` has a value that is no finite number"
            ))
            .place(format!("rest pose, joint `{joint}`"))
            .remedy("export the clip again"),
            Self::FrameRate { clip, fps, seconds } => Explanation::input(format!(
                "clip `{clip}` has a frame rate of {fps} Hz and lasts {seconds:.0} s"
            ))
            .remedy_by(
                Parameter::FrameRate,
                format!("use a rate from {LEAST_FPS} to {MOST_FPS} Hz, and at most {MOST_SECONDS} s"),
            ),
            Self::Ragged {
                clip,
                frame,
                found,
                expected,
            } => Explanation::input(format!(
                "clip `{clip}` has {expected} joints, but {found} joint transforms in this frame"
            ))
            .place(format!("frame {frame}"))
            .remedy("give every frame one transform for each joint"),
            Self::NoSourceLegs => {
                Explanation::input("the legs of the clip's rest pose can't be measured").remedy_by(
                    Parameter::JointMap,
                    "use a joint map with hip, knee and ankle of both legs at different places",
                )
            }
            Self::NoLegs => Explanation::input("the skeleton has no slots for both legs").remedy_by(
                Parameter::Skeleton,
                "name its bodies in a JSON file beside the MJCF file",
            ),
            Self::NoFreeRoot { skeleton } => Explanation::input(format!(
                "the root of skeleton `{skeleton}` isn't its one free joint"
            ))
            .remedy_by(
                Parameter::Skeleton,
                "give the root body a free joint and nothing else, and no other body one",
            ),
        }
    }
}

explained!(RetargetError);
