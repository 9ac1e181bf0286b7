//! The slots of arms and legs, and which joint of a limb lies between the trunk and its end.

use crate::humanoid::Slot;

/// Shoulder, elbow and wrist, left and right.
pub(super) const ARMS: [[Slot; 3]; 2] = [
    [Slot::LeftUpperArm, Slot::LeftLowerArm, Slot::LeftHand],
    [Slot::RightUpperArm, Slot::RightLowerArm, Slot::RightHand],
];
/// Hip, knee and ankle, left and right.
pub(super) const LEGS: [[Slot; 3]; 2] = [
    [Slot::LeftUpperLeg, Slot::LeftLowerLeg, Slot::LeftFoot],
    [Slot::RightUpperLeg, Slot::RightLowerLeg, Slot::RightFoot],
];
/// The ends of the legs.
pub(super) const FEET: [Slot; 2] = [Slot::LeftFoot, Slot::RightFoot];
/// The ends of the arms.
pub(super) const HANDS: [Slot; 2] = [Slot::LeftHand, Slot::RightHand];

/// Both arms, then both legs.
pub(super) fn arms_and_legs() -> [[Slot; 3]; 4] {
    [ARMS[0], ARMS[1], LEGS[0], LEGS[1]]
}

/// The knee above a foot or the elbow above a hand.
pub(super) fn joint_above(end: Slot) -> Option<Slot> {
    arms_and_legs()
        .into_iter()
        .find_map(|[_, middle, last]| (last == end).then_some(middle))
}

/// The foot below a knee or the hand below an elbow.
pub(super) fn end_below(middle: Slot) -> Option<Slot> {
    arms_and_legs()
        .into_iter()
        .find_map(|[_, joint, last]| (joint == middle).then_some(last))
}
