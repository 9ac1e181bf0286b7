//! What an action aims the drives at.

use super::settings::Actions;
use crate::sim::{Character, HingeAxis, LinkJoint, LinkState, Target};
use crate::skeleton::Drive;
use nalgebra::{UnitQuaternion, Vector3};

/// Writes the targets that `action` stands for, one per link; `wanted` is the reference at the next control step.
pub fn aim(
    actions: Actions,
    character: &Character,
    wanted: &[LinkState],
    action: &[f32],
    targets: &mut [Target],
) {
    for (i, link) in character.links.iter().enumerate() {
        let Some(parent) = link.parent else { continue };
        let part = &action[link.dof..link.dof + link.joint.dof()];
        targets[i] = match actions {
            Actions::Residual { scale } => residual(character, wanted, (i, parent), part, scale),
            Actions::Absolute { reach } => absolute(&link.joint, part, |[low, high], a| {
                (low + high) / 2.0 + a * reach * (high - low) / 2.0
            }),
            Actions::FromRest { reach } => absolute(&link.joint, part, |[low, high], a| {
                a * reach * low.abs().max(high.abs())
            }),
        };
    }
}

/// The reference's own joint rotation, and on top of it the action's.
///
/// A drive kp (q* − q) − kd ω trails a target that moves at ω by kd/kp · ω. So the target leads the reference by as much,
/// which is feed-forward of the velocity with position drives alone.
fn residual(
    character: &Character,
    wanted: &[LinkState],
    (link, parent): (usize, usize),
    action: &[f32],
    scale: f32,
) -> Target {
    let (mine, other) = (&wanted[link], &wanted[parent]);
    let turn = character.joint_rotation(link, other.pose.rotation, mine.pose.rotation);
    let rate = mine
        .pose
        .rotation
        .inverse_transform_vector(&(mine.angular - other.angular));
    let joint = &character.links[link].joint;
    match joint {
        LinkJoint::Free => Target::Free,
        LinkJoint::Ball { drives, .. } | LinkJoint::Hinges { drives, .. } => {
            let lead = Vector3::from_fn(|k, _| lag(&drives[k]) * rate[k]);
            let added = rotation_vector(joint, action) * scale;
            Target::Ball(turn * UnitQuaternion::from_scaled_axis(lead + added))
        }
        LinkJoint::Hinge { axis, drive } => {
            let direction = axis.direction.cast::<f32>();
            let lead = lag(drive) * rate.dot(&direction);
            let angle = turn.scaled_axis().dot(&direction) + lead + action[0] * scale;
            Target::Hinge(within_reach(axis, angle))
        }
    }
}

/// How far beyond a hinge's range its drive may aim, radians: to press against the end of the range, or to hold a load near
/// it. Chosen; `skeletons/humanoid.xml` has the same in its control ranges.
const BEYOND_LIMIT: f32 = 0.5;

/// The angle, limited to where a hinge's drive may aim, radians.
fn within_reach(axis: &HingeAxis, angle: f32) -> f32 {
    let [low, high] = axis.limit.map(|end| end as f32);
    angle.clamp(low - BEYOND_LIMIT, high + BEYOND_LIMIT)
}

/// Rotation vector, in the link's frame, that the action of a joint with several coordinates stands for.
fn rotation_vector(joint: &LinkJoint, action: &[f32]) -> Vector3<f32> {
    match joint {
        LinkJoint::Hinges { hinges, .. } => hinges
            .iter()
            .zip(action)
            .map(|(hinge, a)| hinge.direction.cast() * *a)
            .sum(),
        _ => Vector3::from_column_slice(action),
    }
}

/// Seconds by which a drive trails a target that moves at constant speed.
fn lag(drive: &Drive) -> f32 {
    if drive.kp > 0.0 {
        (drive.kd / drive.kp) as f32
    } else {
        0.0
    }
}

/// A target that doesn't depend on the reference: `place` maps a coordinate's range and its action to an angle, radians.
fn absolute(joint: &LinkJoint, action: &[f32], place: impl Fn([f32; 2], f32) -> f32) -> Target {
    let place = |limit: &[f64; 2], a: f32| place(limit.map(|end| end as f32), a);
    match joint {
        LinkJoint::Free => Target::Free,
        LinkJoint::Hinge { axis, .. } => {
            Target::Hinge(within_reach(axis, place(&axis.limit, action[0])))
        }
        LinkJoint::Ball { limits, .. } => {
            let v = Vector3::from_fn(|k, _| place(&limits[k], action[k]));
            Target::Ball(UnitQuaternion::from_scaled_axis(v))
        }
        LinkJoint::Hinges { hinges, .. } => {
            let turn = |(hinge, a): (&HingeAxis, &f32)| {
                let angle = within_reach(hinge, place(&hinge.limit, *a));
                UnitQuaternion::from_scaled_axis(hinge.direction.cast() * angle)
            };
            let turns = hinges.iter().zip(action).map(turn);
            Target::Ball(turns.fold(UnitQuaternion::identity(), |all, next| all * next))
        }
    }
}
