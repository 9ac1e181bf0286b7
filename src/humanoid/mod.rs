//! Humanoid slots: the joints that every humanoid has, whatever its rig calls them, and how they are found.
//!
//! Three sources, in order of trust: what the file itself says (VRM), names of joints, and the shape of the rest pose. Limbs
//! are found first. The trunk follows from the tree: the hips are where the legs meet, the chest is where the arms meet.

mod error;
mod file;
mod limbs;
mod names;
mod shape;
mod sides;
mod stated;
mod tree;
mod trunk;

use crate::clip::Joint;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

pub use error::Error;
pub use sides::pairs;

/// A place in the canonical humanoid. Serialised in kebab-case, e.g. `left-upper-leg`.
///
/// A slot names the joint at the *start* of its bone: `left-lower-leg` is the knee, `left-hand` the wrist.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Slot {
    /// Root of the trunk, where both legs meet.
    Hips,
    /// Lowest spine joint above the hips.
    Spine,
    /// Joint of the upper trunk from which the neck and the shoulders branch off.
    Chest,
    /// Joint between the chest and the head.
    Neck,
    /// Joint at the base of the skull.
    Head,
    /// Left clavicle, which carries the arm.
    LeftShoulder,
    /// Left shoulder joint.
    LeftUpperArm,
    /// Left elbow.
    LeftLowerArm,
    /// Left wrist.
    LeftHand,
    /// Right clavicle, which carries the arm.
    RightShoulder,
    /// Right shoulder joint.
    RightUpperArm,
    /// Right elbow.
    RightLowerArm,
    /// Right wrist.
    RightHand,
    /// Left hip joint.
    LeftUpperLeg,
    /// Left knee.
    LeftLowerLeg,
    /// Left ankle.
    LeftFoot,
    /// Left joint at the ball of the foot.
    LeftToes,
    /// Right hip joint.
    RightUpperLeg,
    /// Right knee.
    RightLowerLeg,
    /// Right ankle.
    RightFoot,
    /// Right joint at the ball of the foot.
    RightToes,
}

impl Slot {
    /// All slots, in order.
    pub const ALL: [Slot; 21] = [
        Slot::Hips,
        Slot::Spine,
        Slot::Chest,
        Slot::Neck,
        Slot::Head,
        Slot::LeftShoulder,
        Slot::LeftUpperArm,
        Slot::LeftLowerArm,
        Slot::LeftHand,
        Slot::RightShoulder,
        Slot::RightUpperArm,
        Slot::RightLowerArm,
        Slot::RightHand,
        Slot::LeftUpperLeg,
        Slot::LeftLowerLeg,
        Slot::LeftFoot,
        Slot::LeftToes,
        Slot::RightUpperLeg,
        Slot::RightLowerLeg,
        Slot::RightFoot,
        Slot::RightToes,
    ];

    /// The slots without which a figure is no humanoid.
    pub const REQUIRED: [Slot; 12] = [
        Slot::Hips,
        Slot::Chest,
        Slot::LeftUpperArm,
        Slot::LeftLowerArm,
        Slot::RightUpperArm,
        Slot::RightLowerArm,
        Slot::LeftUpperLeg,
        Slot::LeftLowerLeg,
        Slot::LeftFoot,
        Slot::RightUpperLeg,
        Slot::RightLowerLeg,
        Slot::RightFoot,
    ];

    /// The name under which files know the slot, e.g. `left-upper-leg`.
    pub fn name(self) -> &'static str {
        match self {
            Slot::Hips => "hips",
            Slot::Spine => "spine",
            Slot::Chest => "chest",
            Slot::Neck => "neck",
            Slot::Head => "head",
            Slot::LeftShoulder => "left-shoulder",
            Slot::LeftUpperArm => "left-upper-arm",
            Slot::LeftLowerArm => "left-lower-arm",
            Slot::LeftHand => "left-hand",
            Slot::RightShoulder => "right-shoulder",
            Slot::RightUpperArm => "right-upper-arm",
            Slot::RightLowerArm => "right-lower-arm",
            Slot::RightHand => "right-hand",
            Slot::LeftUpperLeg => "left-upper-leg",
            Slot::LeftLowerLeg => "left-lower-leg",
            Slot::LeftFoot => "left-foot",
            Slot::LeftToes => "left-toes",
            Slot::RightUpperLeg => "right-upper-leg",
            Slot::RightLowerLeg => "right-lower-leg",
            Slot::RightFoot => "right-foot",
            Slot::RightToes => "right-toes",
        }
    }
}

impl fmt::Display for Slot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The joint chosen for a slot, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Match {
    /// Index of the joint in the clip.
    pub joint: usize,
    /// From 0 (a guess) to 1 (certain).
    pub confidence: f64,
    /// Why this joint, for people: its name, its place, or that the file says so.
    pub reason: String,
}

/// Which joint stands for which slot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HumanoidMap {
    /// The joint of every slot that has one.
    pub matches: BTreeMap<Slot, Match>,
}

impl HumanoidMap {
    /// Index of the joint in `slot`; `None` if it is empty.
    pub fn joint(&self, slot: Slot) -> Option<usize> {
        self.matches.get(&slot).map(|found| found.joint)
    }

    fn insert(&mut self, slot: Slot, joint: usize, confidence: f64, reason: String) {
        self.matches.insert(
            slot,
            Match {
                joint,
                confidence,
                reason,
            },
        );
    }
}

/// The slots whose joints can be found, in any joint tree: few or none in a figure that isn't a humanoid. A map that is
/// written by hand can start from them.
pub fn partial(joints: &[Joint]) -> HumanoidMap {
    let tree = tree::Tree::new(joints);
    let mut found = stated::find(joints);
    let guessed = guesses(&tree, joints);
    if found.matches.is_empty() {
        return guessed;
    }
    stated::supplement(&tree, &mut found, guessed);
    found
}

/// The slots by names and shape alone: limbs by name, gaps in limbs by shape, then the trunk between the limbs.
fn guesses(tree: &tree::Tree, joints: &[Joint]) -> HumanoidMap {
    let labels: Vec<names::Label> = joints.iter().map(|j| names::Label::new(&j.name)).collect();
    let mut found = HumanoidMap::default();
    // Each step relies on the slots that the one before has filled.
    limbs::find(tree, joints, &labels, &mut found);
    shape::complete(tree, &labels, &mut found);
    trunk::find(tree, joints, &labels, &mut found);
    found
}

/// Finds the joint of every humanoid slot in a joint tree: by what the file says, by names, and by the shape of the rest
/// pose, which must have Z up and should face +X.
///
/// # Errors
/// An [`Error`] when a slot of [`Slot::REQUIRED`] stays empty, or the figure stands on four legs.
pub fn map(joints: &[Joint]) -> Result<HumanoidMap, Error> {
    if joints.len() < Slot::REQUIRED.len() {
        return Err(Error::TooFewJoints {
            joints: joints.len(),
        });
    }
    let found = partial(joints);
    let slots: Vec<Slot> = Slot::REQUIRED
        .into_iter()
        .filter(|slot| found.joint(*slot).is_none())
        .collect();
    if !slots.is_empty() {
        return Err(Error::Missing { slots });
    }
    shape::refuse_quadruped(&tree::Tree::new(joints), &found)?;
    Ok(found)
}

#[cfg(test)]
mod tests;
