//! Clips that other people recorded.

use super::super::*;
use super::{clip, coordinate, data, humanoid, on_humanoid};
use crate::humanoid::Slot;

/// Whether a motion has human knees and elbows, its left on the left, and walks forward on alternating feet.
fn assert_walks(motion: &Motion, skeleton: &Skeleton) {
    let body = |slot: Slot| skeleton.slots[&slot];
    let bend = |slot: Slot| coordinate(skeleton, slot);
    for qpos in &motion.qpos {
        for (slot, sign) in [
            (Slot::LeftLowerLeg, 1.0),
            (Slot::RightLowerLeg, 1.0),
            (Slot::LeftLowerArm, -1.0),
            (Slot::RightLowerArm, -1.0),
        ] {
            assert!(
                qpos[bend(slot)] * sign >= -1e-9,
                "{slot} bends the wrong way"
            );
        }
    }
    let gap = |f: usize, axis: usize| {
        let at = |slot| motion.bodies[f][body(slot)].translation.vector[axis];
        at(Slot::LeftFoot) - at(Slot::RightFoot)
    };
    let frames = motion.bodies.len();
    assert!(
        (0..frames).map(|f| gap(f, 1)).sum::<f64>() > 0.05 * frames as f64,
        "left is on the left"
    );
    assert!(
        (0..frames).any(|f| gap(f, 0) > 0.3) && (0..frames).any(|f| gap(f, 0) < -0.3),
        "feet alternate"
    );
    assert!(motion.cycle.translation.x > 1.0 && motion.cycle.translation.y.abs() < 0.1);
}

fn assert_good(report: &Report, keypoints: f64) {
    assert!(
        report.keypoint_error_m.mean < keypoints,
        "{:?}",
        report.keypoint_error_m
    );
    assert!(report.foot_skate_m_s < 0.02, "{}", report.foot_skate_m_s);
    assert!(
        report.penetration_m.max < 0.01,
        "{:?}",
        report.penetration_m
    );
    assert!(report.float_m < 0.005, "{}", report.float_m);
    assert_eq!(report.joint_limit_violations, 0);
}

#[test]
fn walks_of_several_rigs_walk() {
    let walk = clip("deepmimic/humanoid3d_walk.txt", None).map(|c| (c, 0.01));
    let xbot = clip("mixamo/Xbot.glb", Some("walk")).map(|c| (c, 0.03));
    let soldier = clip("mixamo/Soldier.glb", Some("Walk")).map(|c| (c, 0.03));
    let skeleton = humanoid();
    for (clip, keypoints) in [walk, xbot, soldier].into_iter().flatten() {
        let done = on_humanoid(&clip);
        assert_good(&done.report, keypoints);
        assert_walks(&done.motion, &skeleton);
    }
}

#[test]
fn acrobatics_of_the_same_proportions_stay_near_their_source() {
    for file in ["kick", "backflip", "getup_facedown"] {
        let Some(clip) = clip(&format!("deepmimic/humanoid3d_{file}.txt"), None) else {
            return;
        };
        assert_good(&on_humanoid(&clip).report, 0.015);
    }
}

#[test]
fn a_skeleton_of_hinges_in_t_pose_does_as_well() {
    let Some(path) = data("characters/mimickit_humanoid.xml") else {
        return;
    };
    let skeleton = Skeleton::load(&path).unwrap();
    let Some(clip) = clip("deepmimic/humanoid3d_walk.txt", None) else {
        return;
    };
    let done = retarget(&clip, &skeleton, &Options::default()).unwrap();
    assert_good(&done.report, 0.01);
}
