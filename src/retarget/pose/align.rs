//! How the source's bones correspond to the skeleton's.
//!
//! Rigs put a joint's axes anywhere, and rest with arms out, down or in between. So axes are compared by the figure alone:
//! each slot gets a frame from the directions of its bones at rest, once in the source and once in the skeleton. The turn
//! between the two is constant, and carries every orientation of the source's joint over to the body.

use crate::clip::Clip;
use crate::humanoid::{HumanoidMap, Slot};
use crate::retarget::error::RetargetError;
use crate::skeleton::Skeleton;
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;

/// A joint of the source and the skeleton's body that follows it.
#[derive(Clone, Debug)]
pub(super) struct Bind {
    /// The slot of both.
    pub slot: Slot,
    /// Index of the joint in the clip.
    pub joint: usize,
    /// Index of the body in the skeleton.
    pub body: usize,
    /// Joint from body: the body should have the joint's world orientation times this.
    pub joint_from_body: UnitQuaternion<f64>,
}

/// How all bodies follow the source.
pub(super) struct Alignment {
    /// In the order of the skeleton's slots.
    pub binds: Vec<Bind>,
    /// Skeleton's leg length / source's leg length.
    pub scale: f64,
}

/// Right and left joints of the legs whose direction tells where left is, best first.
const LEG_PAIRS: [[Slot; 2]; 3] = [
    [Slot::RightUpperLeg, Slot::LeftUpperLeg],
    [Slot::RightLowerLeg, Slot::LeftLowerLeg],
    [Slot::RightFoot, Slot::LeftFoot],
];
/// The same of the arms.
const ARM_PAIRS: [[Slot; 2]; 3] = [
    [Slot::RightUpperArm, Slot::LeftUpperArm],
    [Slot::RightLowerArm, Slot::LeftLowerArm],
    [Slot::RightHand, Slot::LeftHand],
];
/// Cosine of the farthest that a shin leans over a foot flat on the ground: 37°. Chosen a little beyond what ankles bend.
const STANDS: f64 = 0.8;
/// Distance below which joints coincide, leg lengths. Some rigs put both hips on one point.
const APART: f64 = 0.01;
/// Cosine of the angle between a bone and a direction from which on they are too nearly parallel to span a frame: 18°. Chosen.
const PARALLEL: f64 = 0.95;

/// Where the slots are in a rest pose.
struct Figure {
    at: BTreeMap<Slot, Vector3<f64>>,
}

/// Matches the rest poses of clip and skeleton, whatever these are (arms out, down, in between).
///
/// # Errors
/// [`RetargetError::NoLegs`] or [`RetargetError::NoSourceLegs`] if the skeleton's or the source's legs can't be measured.
pub(super) fn align(
    clip: &Clip,
    map: &HumanoidMap,
    skeleton: &Skeleton,
) -> Result<Alignment, RetargetError> {
    let source_rest = clip.rest_world();
    let body_rest = skeleton.forward(&skeleton.rest_qpos());
    let source = Figure::new(map.matches.iter().map(|(s, m)| (*s, m.joint)), &source_rest);
    let target = Figure::new(skeleton.slots.iter().map(|(s, b)| (*s, *b)), &body_rest);
    let scale = target.leg_length().ok_or(RetargetError::NoLegs)?
        / source.leg_length().ok_or(RetargetError::NoSourceLegs)?;
    let mut binds = Vec::new();
    for (&slot, &body) in &skeleton.slots {
        let (Some(joint), Some(from)) = (map.joint(slot), target.frame(slot)) else {
            continue;
        };
        let Some(to) = source.frame(slot) else {
            continue;
        };
        // The body as it would be in the source's rest pose: turned by what leads from its own slot's frame to the source's.
        // Seen from the joint at rest, that is the turn that stays.
        let body_at_source_rest = to * from.inverse() * body_rest[body].rotation;
        let joint_from_body = source_rest[joint].rotation.inverse() * body_at_source_rest;
        binds.push(Bind {
            slot,
            joint,
            body,
            joint_from_body,
        });
    }
    Ok(Alignment { binds, scale })
}

impl Figure {
    /// Reads the positions of slots off a rest pose.
    fn new(slots: impl Iterator<Item = (Slot, usize)>, rest: &[Isometry3<f64>]) -> Figure {
        Figure {
            at: slots
                .map(|(slot, i)| (slot, rest[i].translation.vector))
                .collect(),
        }
    }

    /// From one slot's joint to another's, metres.
    fn span(&self, from: Slot, to: Slot) -> Option<Vector3<f64>> {
        Some(self.at.get(&to)? - self.at.get(&from)?)
    }

    /// Hip to ankle along the bones, mean of both sides; `None` if there are no legs or they have no length.
    fn leg_length(&self) -> Option<f64> {
        let leg = |upper, lower, foot| {
            Some(self.span(upper, lower)?.norm() + self.span(lower, foot)?.norm())
        };
        let left = leg(Slot::LeftUpperLeg, Slot::LeftLowerLeg, Slot::LeftFoot)?;
        let right = leg(Slot::RightUpperLeg, Slot::RightLowerLeg, Slot::RightFoot)?;
        let mean = (left + right) / 2.0;
        (mean.is_finite() && mean > 1e-6).then_some(mean)
    }

    /// From the right to the left joint of the first pair that doesn't coincide.
    fn across(&self, pairs: &[[Slot; 2]]) -> Option<Vector3<f64>> {
        let least = APART * self.leg_length()?;
        let mut spans = pairs
            .iter()
            .filter_map(|[right, left]| self.span(*right, *left));
        spans.find(|span| span.norm() > least)
    }

    /// Horizontal unit vector to the figure's left, from hips and shoulders.
    fn left(&self) -> Option<Vector3<f64>> {
        let arms = self.across(&ARM_PAIRS);
        let hips = self.across(&LEG_PAIRS).or(arms)?;
        // Hips and shoulders together, for either may be twisted at rest.
        let across = hips + arms.unwrap_or(hips);
        Vector3::new(across.x, across.y, 0.0).try_normalize(1e-9)
    }

    /// The orientation that bones give a slot: the first axis along the bone (to the left for the trunk), the second as near as
    /// possible to where the next bone bends (up for the trunk).
    fn frame(&self, slot: Slot) -> Option<UnitQuaternion<f64>> {
        let (up, left) = (Vector3::z(), self.left()?);
        let forward = left.cross(&up);
        let (along, second) = match slot {
            Slot::Hips | Slot::Spine => (self.across(&LEG_PAIRS).unwrap_or(left), up),
            Slot::Chest | Slot::Neck | Slot::Head => (self.across(&ARM_PAIRS).unwrap_or(left), up),
            Slot::LeftFoot | Slot::LeftToes => {
                return self.foot(Slot::LeftLowerLeg, Slot::LeftFoot, Slot::LeftToes);
            }
            Slot::RightFoot | Slot::RightToes => {
                return self.foot(Slot::RightLowerLeg, Slot::RightFoot, Slot::RightToes);
            }
            // Knees turn about the axis to the left, however far a leg is lifted: rigs that rest in mid-stride have one leg
            // bent.
            Slot::LeftUpperLeg | Slot::LeftLowerLeg | Slot::RightUpperLeg | Slot::RightLowerLeg => {
                let along = self.limb_direction(slot)?;
                return basis(&along, &along.cross(&left));
            }
            limb => (self.limb_direction(limb)?, forward),
        };
        // Forward is no second axis of an arm that is held straight forward; such an arm bends upward.
        let second = if along.dot(&second).abs() > PARALLEL {
            up
        } else {
            second
        };
        basis(&along, &second)
    }

    /// Unit vector along a limb's bone. A forearm without a wrist takes the direction of the upper arm.
    fn limb_direction(&self, slot: Slot) -> Option<Vector3<f64>> {
        let (from, to) = match slot {
            Slot::LeftShoulder => (slot, Slot::LeftUpperArm),
            Slot::LeftUpperArm => (slot, Slot::LeftLowerArm),
            Slot::LeftLowerArm | Slot::LeftHand => (Slot::LeftLowerArm, Slot::LeftHand),
            Slot::RightShoulder => (slot, Slot::RightUpperArm),
            Slot::RightUpperArm => (slot, Slot::RightLowerArm),
            Slot::RightLowerArm | Slot::RightHand => (Slot::RightLowerArm, Slot::RightHand),
            Slot::LeftUpperLeg => (slot, Slot::LeftLowerLeg),
            Slot::LeftLowerLeg => (slot, Slot::LeftFoot),
            Slot::RightUpperLeg => (slot, Slot::RightLowerLeg),
            Slot::RightLowerLeg => (slot, Slot::RightFoot),
            _ => return None,
        };
        let upper_arm = match from {
            Slot::LeftLowerArm => self.span(Slot::LeftUpperArm, from),
            Slot::RightLowerArm => self.span(Slot::RightUpperArm, from),
            _ => None,
        };
        self.span(from, to).or(upper_arm)?.try_normalize(1e-9)
    }

    /// A foot's orientation. The sole of a foot that stands is level, wherever the rig puts the toes' joint. A foot in the
    /// air is taken relative to its shin, as if that were upright; taken as level, its toes pointed backward on two rigs
    /// that rest in mid-stride, and limbs jumped by 32 and 49 cm.
    fn foot(&self, shin: Slot, foot: Slot, toes: Slot) -> Option<UnitQuaternion<f64>> {
        let (up, forward) = (Vector3::z(), self.left()?.cross(&Vector3::z()));
        let lean = self.lean(shin).unwrap_or_else(UnitQuaternion::identity);
        // The heading of the toes counts and not their height: rigs put that joint anywhere between sole and instep.
        let level = |v: Vector3<f64>| (lean.inverse() * v).xy().push(0.0);
        let toes = self.span(foot, toes).map(level);
        let toward = toes.and_then(|v| v.try_normalize(1e-3));
        Some(lean * basis(&toward.unwrap_or(forward), &up)?)
    }

    /// The turn of a shin from upright, if it leans so far that its foot can't be flat on the ground.
    fn lean(&self, shin: Slot) -> Option<UnitQuaternion<f64>> {
        let (down, along, left) = (-Vector3::z(), self.limb_direction(shin)?, self.left()?);
        // The leg's frames with the shin as it is and upright differ by the lean, about the axis to the left.
        let leans = along.dot(&down) < STANDS;
        let leg = |along: &Vector3<f64>| basis(along, &along.cross(&left));
        leans.then_some(leg(&along)? * leg(&down)?.inverse())
    }
}

/// The right-handed frame whose first axis is along `along` and whose second is nearest to `second`; `None` if they are
/// parallel.
fn basis(along: &Vector3<f64>, second: &Vector3<f64>) -> Option<UnitQuaternion<f64>> {
    let x = along.try_normalize(1e-9)?;
    let z = x.cross(second).try_normalize(1e-9)?;
    let matrix = Matrix3::from_columns(&[x, z.cross(&x), z]);
    Some(UnitQuaternion::from_rotation_matrix(
        &Rotation3::from_matrix_unchecked(matrix),
    ))
}
