//! The imitation reward of the program that Peng et al. published with "DeepMimic" (2018). It isn't that of their paper:
//! joints are weighted to a sum of one, and the root has a term of its own.

use super::deepmimic::joint_rate;
use super::{Terms, body, joint_error};
use crate::humanoid::Slot;
use crate::sim::{Character, LinkState};
use crate::skeleton::Skeleton;
use crate::task::reference::heading;
use crate::task::{Dynamics, Stage};
use nalgebra::Vector3;

/// pose exp(−2 Σ wⱼ‖q̂ ⊖ q‖²) and velocity exp(−0.1 Σ wⱼ‖ω̂ − ω‖²) over joints with [`joint_weights`], the root's rotation
/// among them, its rate along the world's axes; end effectors exp(−40 mean‖p̂ − p‖²) over hands and feet as seen from the
/// root, but for their height; root exp(−5 (‖Δp‖² + 0.1 Δθ² + 0.01 ‖Δv‖² + 0.001 ‖Δω‖²)); centre of mass exp(−‖Δv‖²).
pub(super) fn terms(
    stage: &Stage,
    (links, dynamics): (&[LinkState], &Dynamics),
    (wanted, wanted_dynamics): (&[LinkState], &Dynamics),
) -> Terms {
    let (mut pose, mut velocity) = (0.0, 0.0);
    for (i, weight) in stage.joint_weights.iter().enumerate() {
        let rate = match i {
            0 => links[0].angular - wanted[0].angular,
            _ => joint_rate(stage, links, i) - joint_rate(stage, wanted, i),
        };
        pose += weight * joint_error(stage, links, wanted, i);
        velocity += weight * rate.norm_squared();
    }
    let (a, b) = (&links[0], &wanted[0]);
    let root = (a.pose.translation.vector - b.pose.translation.vector).norm_squared()
        + 0.1 * joint_error(stage, links, wanted, 0)
        + 0.01 * (a.linear - b.linear).norm_squared()
        + 0.001 * (a.angular - b.angular).norm_squared();
    let ends = stage.end_bodies.iter();
    let apart =
        ends.map(|&end| (seen(stage, links, end) - seen(stage, wanted, end)).norm_squared());
    let ends = apart.sum::<f32>() / stage.end_bodies.len().max(1) as f32;
    Terms {
        pose: (-2.0 * pose).exp(),
        velocity: (-0.1 * velocity).exp(),
        end_effector: (-40.0 * ends).exp(),
        root: (-5.0 * root).exp(),
        com: (-(dynamics.com_velocity - wanted_dynamics.com_velocity).norm_squared()).exp(),
        ..Terms::default()
    }
}

/// Where a body is from above the root, along the root's heading; its height is that above the ground.
fn seen(stage: &Stage, links: &[LinkState], end: usize) -> Vector3<f32> {
    let root = &links[0].pose;
    let (at, _) = body(stage, links, end);
    let below = Vector3::new(root.translation.x, root.translation.y, 0.0);
    heading(&root.rotation).inverse() * (at - below)
}

/// What each link's joint weighs in the program: root 1, hips and trunk 0.5, knees, shoulders and neck 0.3, ankles and elbows
/// 0.2, over their sum; wrists 0, and toes, which its character hasn't. Where several links make up a joint, one for each
/// motor, those above count as the one that has the slot.
pub(crate) fn joint_weights(skeleton: &Skeleton, character: &Character) -> Vec<f32> {
    let mut slotted: Vec<Option<f32>> = vec![None; character.links.len()];
    for (slot, body) in &skeleton.slots {
        let weighs = &mut slotted[character.bodies[*body].link];
        *weighs = Some(weighs.unwrap_or(0.0).max(weight(*slot)));
    }
    slotted[0] = Some(weight(Slot::Hips));
    let sum: f32 = slotted.iter().flatten().sum();
    let mut below = vec![0.0_f32; character.links.len()];
    // Parents stand before their children.
    for (i, link) in character.links.iter().enumerate().rev() {
        below[i] = slotted[i].unwrap_or(below[i]);
        if let Some(parent) = link.parent {
            below[parent] = below[parent].max(below[i]);
        }
    }
    below.iter().map(|weight| weight / sum).collect()
}

fn weight(slot: Slot) -> f32 {
    use Slot::*;
    match slot {
        Hips => 1.0,
        Spine | Chest | LeftUpperLeg | RightUpperLeg => 0.5,
        Neck | Head | LeftLowerLeg | RightLowerLeg => 0.3,
        LeftShoulder | LeftUpperArm | RightShoulder | RightUpperArm => 0.3,
        LeftFoot | RightFoot | LeftLowerArm | RightLowerArm => 0.2,
        LeftHand | RightHand | LeftToes | RightToes => 0.0,
    }
}
