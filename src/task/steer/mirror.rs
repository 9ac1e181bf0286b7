//! Poses with left and right swapped, for characters whose two sides are alike.

use super::pose::Pose;
use crate::humanoid::Slot;
use crate::task::model::CharacterModel;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// The slots of the two sides.
const SIDES: [[Slot; 2]; 8] = [
    [Slot::LeftShoulder, Slot::RightShoulder],
    [Slot::LeftUpperArm, Slot::RightUpperArm],
    [Slot::LeftLowerArm, Slot::RightLowerArm],
    [Slot::LeftHand, Slot::RightHand],
    [Slot::LeftUpperLeg, Slot::RightUpperLeg],
    [Slot::LeftLowerLeg, Slot::RightLowerLeg],
    [Slot::LeftFoot, Slot::RightFoot],
    [Slot::LeftToes, Slot::RightToes],
];

/// How a character's sides correspond.
#[derive(Clone, Debug)]
pub(super) struct Mirror {
    /// The link on the other side, by link; links in the middle have themselves.
    other: Vec<usize>,
    /// World from link in the rest pose, by link.
    upright: Vec<UnitQuaternion<f32>>,
}

impl Mirror {
    /// Pairs the links of a character by the slots of its skeleton.
    pub fn new(model: &CharacterModel) -> Mirror {
        let (skeleton, character) = (&model.skeleton, &model.character);
        let mut other: Vec<usize> = (0..character.links.len()).collect();
        for slots in SIDES {
            let link = |slot: Slot| Some(character.bodies[*skeleton.slots.get(&slot)?].link);
            let (mut left, mut right) = (link(slots[0]), link(slots[1]));
            // Links between two slots, such as those of a hip of three hinges, correspond as well.
            while let (Some(a), Some(b)) = (left, right) {
                if a == b || other[a] != a || other[b] != b {
                    break;
                }
                (other[a], other[b]) = (b, a);
                (left, right) = (character.links[a].parent, character.links[b].parent);
            }
        }
        let rest = skeleton.forward(&skeleton.rest_qpos());
        let upright = |link: &crate::sim::Link| rest[link.body].rotation.cast();
        Mirror {
            other,
            upright: character.links.iter().map(upright).collect(),
        }
    }

    /// The pose with its sides swapped, in a frame whose XZ plane is the mirror.
    pub fn pose(&self, pose: &Pose) -> Pose {
        let at = reflected(&pose.root.translation.vector);
        let upright = self.upright[0];
        let turn = turned_over(&(pose.root.rotation * upright.inverse())) * upright;
        let joint = |(i, other): (usize, &usize)| {
            let there = self.upright[*other];
            let world = there * pose.joints[*other] * there.inverse();
            self.upright[i].inverse() * turned_over(&world) * self.upright[i]
        };
        Pose {
            root: Isometry3::from_parts(Translation3::from(at), turn),
            joints: self.other.iter().enumerate().map(joint).collect(),
        }
    }
}

/// A place in the mirror.
fn reflected(v: &Vector3<f32>) -> Vector3<f32> {
    Vector3::new(v.x, -v.y, v.z)
}

/// A rotation in the mirror: axes are reflected, and turn the other way round.
fn turned_over(turn: &UnitQuaternion<f32>) -> UnitQuaternion<f32> {
    let q = turn.quaternion();
    UnitQuaternion::new_unchecked(Quaternion::new(q.w, -q.i, q.j, -q.k))
}

#[cfg(test)]
mod tests {
    use super::super::pose::Tree;
    use super::*;
    use crate::skeleton::Skeleton;

    /// Every body of a mirrored pose is where the other side's was, for all characters whose sides are alike.
    #[test]
    fn bodies_swap_their_places() {
        for name in ["humanoid", "marathon", "robot"] {
            let skeleton = Skeleton::load(name).expect("the character loads");
            let model = CharacterModel::new(skeleton).expect("it can be simulated");
            let (mirror, tree) = (Mirror::new(&model), Tree::new(&model.character));
            let mut pose = Pose::rest(&model.character);
            pose.root = Isometry3::from_parts(
                Translation3::new(0.1, 0.2, 0.9),
                UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3) * mirror.upright[0],
            );
            for (i, joint) in pose.joints.iter_mut().enumerate() {
                let x = i as f32;
                *joint = UnitQuaternion::from_euler_angles(0.3 * x.sin(), 0.2, 0.4 * x.cos());
            }
            let places = |pose: &Pose| {
                let mut poses = vec![Isometry3::identity(); pose.joints.len()];
                tree.place(pose, &mut poses, 0);
                poses
            };
            let (own, swapped) = (places(&pose), places(&mirror.pose(&pose)));
            for (i, other) in mirror.other.iter().enumerate() {
                let expected = reflected(&own[*other].translation.vector);
                let found = swapped[i].translation.vector;
                assert!(
                    (expected - found).norm() < 2e-3,
                    "{name} {i}: {expected} {found}"
                );
            }
            assert!(
                mirror
                    .other
                    .iter()
                    .enumerate()
                    .any(|(i, other)| i != *other)
            );
        }
    }
}
