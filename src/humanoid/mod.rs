//! Humanoid slots: the joints that every humanoid has, whatever its rig calls them, and how they are found.
//!
//! What the file itself tells goes before all. Limbs are found by their names where these are telling, else by the shape
//! of the rest pose; the trunk follows from the tree: hips are where the legs meet, the chest where the arms meet.

mod error;
mod file;
mod limbs;
mod names;
mod shape;
mod sides;
mod told;
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
    pub reason: String,
}

/// Which joint stands for which slot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HumanoidMap {
    pub matches: BTreeMap<Slot, Match>,
}

impl HumanoidMap {
    /// Index of the joint in `slot`.
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

/// The slots whose joints can be found in any joint tree, few or none in one that is no humanoid: where to begin a map
/// by hand.
pub fn partial(joints: &[Joint]) -> HumanoidMap {
    let tree = tree::Tree::new(joints);
    let mut found = told::find(joints);
    let guessed = guesses(&tree, joints);
    if found.matches.is_empty() {
        return guessed;
    }
    told::supplement(&tree, &mut found, guessed);
    found
}

/// The slots by names and shape alone.
fn guesses(tree: &tree::Tree, joints: &[Joint]) -> HumanoidMap {
    let labels: Vec<names::Label> = joints.iter().map(|j| names::Label::new(&j.name)).collect();
    let mut found = HumanoidMap::default();
    limbs::find(tree, joints, &labels, &mut found);
    shape::complete(tree, &labels, &mut found);
    trunk::find(tree, joints, &labels, &mut found);
    found
}

/// Finds the joint of every humanoid slot in a joint tree: those that the file tells, then from names, then from the
/// shape of the rest pose.
///
/// # Errors
/// [`Error`] when a required slot stays empty or the figure stands on four legs.
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
