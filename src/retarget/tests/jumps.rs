//! No step from a frame to the next that the source doesn't take.

use super::super::goals::LEGS;
use super::*;
use std::f64::consts::TAU;

/// Steps on the spot, knees and hips bent.
fn stepping(skeleton: &Skeleton) -> Vec<Vec<f64>> {
    let pose = |f: i32| {
        let mut qpos = skeleton.rest_qpos();
        let swing = (f64::from(f) * 0.3).sin();
        for (leg, lift) in LEGS.iter().zip([swing.max(0.0), (-swing).max(0.0)]) {
            turned(skeleton, &mut qpos, leg[0], [0.0, -1.2 * lift, 0.0]);
            qpos[coordinate(skeleton, leg[1])] = 1.5 * lift;
        }
        qpos
    };
    (0..40).map(pose).collect()
}

#[test]
fn a_rest_pose_with_a_leg_in_the_air_makes_no_difference() {
    let skeleton = humanoid();
    let frames = stepping(&skeleton);
    let mut rest = skeleton.rest_qpos();
    turned(&skeleton, &mut rest, Slot::LeftUpperLeg, [0.0, 0.7, 0.0]);
    rest[coordinate(&skeleton, Slot::LeftLowerLeg)] = 0.9;
    turned(&skeleton, &mut rest, Slot::RightUpperLeg, [0.0, -1.6, 0.0]);
    rest[coordinate(&skeleton, Slot::RightLowerLeg)] = 0.5;
    let done = on_humanoid(&rig(&skeleton, &rest, &frames, 1.2, 0.0));
    for (f, qpos) in frames.iter().enumerate() {
        let expected = skeleton.forward(qpos);
        for slot in LEGS.into_iter().flatten() {
            let body = skeleton.slots[&slot];
            let (found, expected) = (&done.motion.bodies[f][body], &expected[body]);
            let away = (found.translation.vector - expected.translation.vector).norm();
            assert!(away < 0.01, "frame {f}, {slot}: {away} m");
            let turned = found.rotation.angle_to(&expected.rotation);
            assert!(turned < 0.05, "frame {f}, {slot}: {turned} rad");
        }
    }
}

/// A robot's can, and no neck of a skeleton.
#[test]
fn a_head_that_turns_all_the_way_round_takes_nothing_along() {
    let skeleton = humanoid();
    let pose = |f: i32| {
        let mut qpos = skeleton.rest_qpos();
        let angle = TAU * f64::from(f) / 40.0;
        turned(&skeleton, &mut qpos, Slot::Head, [0.0, 0.0, angle]);
        qpos
    };
    let frames: Vec<Vec<f64>> = (0..40).map(pose).collect();
    let rest = skeleton.rest_qpos();
    let done = on_humanoid(&rig(&skeleton, &rest, &frames, 1.0, 0.0));
    let (hips, chest) = (skeleton.slots[&Slot::Hips], skeleton.slots[&Slot::Chest]);
    for (f, bodies) in done.motion.bodies.iter().enumerate() {
        for body in [hips, chest] {
            let turned = bodies[body].rotation.angle();
            assert!(turned < 0.05, "frame {f}: {turned} rad");
        }
    }
}
