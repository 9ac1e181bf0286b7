//! No step from a frame to the next that the source doesn't take.

use super::super::limbs::{ARMS, LEGS};
use super::*;
use std::f64::consts::TAU;

/// The two clips that rest in mid-stride, a head that turns all the way round, and a knee that meets the ground.
const FILES: [&str; 4] = [
    "bitmoji/bitmoji_run.glb",
    "bitmoji/bitmoji_jump-flip.glb",
    "quaternius/RobotExpressive.glb",
    "poser-bvh/spinning.bvh",
];
/// Metres.
const LONGEST: f64 = 0.06;

/// By how much a step of an elbow, wrist, knee or ankle is at most longer than the source's, whose bones are drawn in
/// the skeleton's lengths; both from where the limb begins. A step to or from a place below the ground isn't compared, for there
/// the source goes where nobody can.
fn longest_jump(clip: &Clip, skeleton: &Skeleton) -> f64 {
    let map = crate::humanoid::map(&clip.joints).unwrap();
    let motion = on_humanoid(clip).motion;
    let frames = 0..motion.bodies.len().min(clip.frames.len());
    let worlds: Vec<Vec<Isometry3<f64>>> = frames.map(|f| clip.world(f)).collect();
    let (mut longest, mut compared, mut all): (f64, usize, usize) = (0.0, 0, 0);
    for limb in ARMS.iter().chain(&LEGS) {
        let bodies = limb.map(|slot| skeleton.slots[&slot]);
        let joints = limb.map(|slot| map.joint(slot).unwrap());
        for end in [1, 2] {
            let ours = |f: usize| chain(&motion.bodies[f], &bodies[..=end], None);
            let theirs = |f: usize| chain(&worlds[f], &joints[..=end], Some((skeleton, &bodies)));
            let is_below = |f: usize| worlds[f][joints[end]].translation.z < 0.0;
            for f in (1..worlds.len()).filter(|f| !is_below(f - 1) && !is_below(*f)) {
                let step = (ours(f) - ours(f - 1)).norm();
                longest = longest.max(step - (theirs(f) - theirs(f - 1)).norm());
                compared += 1;
            }
            all += worlds.len() - 1;
        }
    }
    assert!(
        10 * compared > 8 * all,
        "{compared} of {all} steps compared"
    );
    longest
}

/// The end of a chain of joints from its beginning; with these bodies' bones, if given.
fn chain(
    at: &[Isometry3<f64>],
    joints: &[usize],
    lengths: Option<(&Skeleton, &[usize; 3])>,
) -> Vector3<f64> {
    let place = |joint: usize| at[joint].translation.vector;
    let bone = |(i, pair): (usize, &[usize])| {
        let bone = place(pair[1]) - place(pair[0]);
        let length = lengths.map(|(skeleton, bodies)| {
            let own = &skeleton.bodies[bodies[i + 1]].rest;
            own.translation.vector.norm()
        });
        length.map_or(bone, |length| bone.normalize() * length)
    };
    joints.windows(2).enumerate().map(bone).sum()
}

#[test]
fn no_limb_jumps_where_the_sources_does_not() {
    let skeleton = humanoid();
    for file in FILES {
        let Some(clip) = clip(file, None) else {
            continue;
        };
        let jump = longest_jump(&clip, &skeleton);
        assert!(jump < LONGEST, "{file}: {jump:.3} m");
    }
}

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
