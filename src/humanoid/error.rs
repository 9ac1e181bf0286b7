//! Why a joint tree can't be used as a humanoid.

use super::Slot;
use crate::explain::{Explain, Explanation, Parameter, did_you_mean, explained};

/// Why no humanoid was found in a joint tree, or why a joint map doesn't fit it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// The tree has fewer joints than a humanoid has slots that must be filled.
    TooFewJoints {
        /// How many joints the tree has.
        joints: usize,
    },
    /// No joint was found for these slots, all of them in [`Slot::REQUIRED`].
    Missing {
        /// The empty slots, in order.
        slots: Vec<Slot>,
    },
    /// The figure stands on four legs.
    Quadruped {
        /// Angle between the trunk and the legs at rest, degrees: 180 in a person who stands upright.
        degrees: f64,
    },
    /// A joint map that isn't a JSON object from slot to joint name.
    MapSyntax {
        /// What the JSON parser found.
        reason: String,
    },
    /// A joint map with a slot that doesn't exist.
    UnknownSlot {
        /// The name that the map has.
        slot: String,
    },
    /// A joint map with a joint that the clip doesn't have.
    UnknownJoint {
        /// The slot of the joint.
        slot: Slot,
        /// The name that the map has.
        joint: String,
        /// Names of at most three joints that may be meant.
        similar: Vec<String>,
    },
    /// A joint map with a name that several joints of the clip have.
    AmbiguousJoint {
        /// The slot of the joint.
        slot: Slot,
        /// The name that the map has.
        joint: String,
        /// How many joints have it.
        count: usize,
    },
    /// A joint map with one joint in two slots.
    UsedTwice {
        /// The name of the joint.
        joint: String,
        /// One of its slots.
        first: Slot,
        /// The other one.
        second: Slot,
    },
    /// A joint map that leaves a slot of [`Slot::REQUIRED`] empty.
    EmptySlot {
        /// The first empty one.
        slot: Slot,
    },
}

explained!(Error);

impl Explain for Error {
    fn explain(&self) -> Explanation {
        match self {
            Self::TooFewJoints { joints } => Explanation::input(format!(
                "a humanoid has at least {} joints, and this figure has {joints}",
                Slot::REQUIRED.len()
            ))
            .remedy("choose a figure with arms and legs"),
            Self::Missing { slots } => {
                Explanation::input(format!("no joint found for {}", names(slots))).remedy_by(
                    Parameter::JointMap,
                    "name them in a joint map to use this figure as a humanoid",
                )
            }
            Self::Quadruped { degrees } => Explanation::input(format!(
                "the trunk is at {degrees:.0}° to the legs and the arms point the same way as the legs, as in a \
                 four-legged animal"
            ))
            .remedy_by(
                Parameter::JointMap,
                "name the joints in a joint map if it is a humanoid all the same",
            ),
            Self::MapSyntax { reason } => Explanation::input(format!(
                "the joint map isn't a JSON object from slot to joint name ({reason})"
            ))
            .remedy("write it as {\"hips\": \"pelvis\", …}"),
            Self::UnknownSlot { slot } => {
                Explanation::input(format!("the joint map has an unknown slot `{slot}`"))
                    .remedy(did_you_mean(slot, Slot::ALL.map(Slot::name)).unwrap_or_else(|| {
                        format!("use one of {}", names(&Slot::ALL))
                    }))
            }
            Self::UnknownJoint {
                slot,
                joint,
                similar,
            } => in_slot(*slot, format!("the clip has no joint `{joint}`")).remedy(
                match similar.as_slice() {
                    [] => "give the name of one of the clip's joints".to_owned(),
                    some => format!("did you mean `{}`?", some.join("` or `")),
                },
            ),
            Self::AmbiguousJoint { slot, joint, count } => in_slot(
                *slot,
                format!("{count} joints of the clip are called `{joint}`"),
            )
            .remedy("give each joint a name of its own in the source file"),
            Self::UsedTwice {
                joint,
                first,
                second,
            } => Explanation::input(format!(
                "the joint map has `{joint}` in both `{first}` and `{second}`"
            ))
            .remedy("keep it in one of them"),
            Self::EmptySlot { slot } => in_slot(
                *slot,
                "the joint map leaves it empty, and a humanoid needs it".to_owned(),
            )
            .remedy("give it a joint"),
        }
    }
}

fn in_slot(slot: Slot, cause: String) -> Explanation {
    Explanation::input(cause).place(format!("slot `{slot}`"))
}

fn names(slots: &[Slot]) -> String {
    let names: Vec<&str> = slots.iter().map(|slot| slot.name()).collect();
    names.join(", ")
}
