//! Humanoid slots: the joints that every humanoid has, whatever its rig calls them.

use serde::{Deserialize, Serialize};

/// A place in the canonical humanoid. Serialised in kebab-case, e.g. `left-upper-leg`.
///
/// A slot names the joint at the *start* of its bone: `left-lower-leg` is the knee, `left-hand` the wrist.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Slot {
    Hips,
    /// Lowest spine joint above the hips.
    Spine,
    /// Joint of the upper trunk from which neck and shoulders spring.
    Chest,
    Neck,
    Head,
    LeftShoulder,
    LeftUpperArm,
    LeftLowerArm,
    LeftHand,
    RightShoulder,
    RightUpperArm,
    RightLowerArm,
    RightHand,
    LeftUpperLeg,
    LeftLowerLeg,
    LeftFoot,
    LeftToes,
    RightUpperLeg,
    RightLowerLeg,
    RightFoot,
    RightToes,
}
