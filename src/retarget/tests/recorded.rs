//! Clips that other people recorded.

use super::super::*;
use super::{clip, coordinate, foreign, foreign_skeleton, humanoid, on_humanoid};
use crate::humanoid::Slot;
use crate::import;
use nalgebra::{Isometry3, Vector3};

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

fn assert_good(report: &RetargetReport, keypoints: f64, skate: f64) {
    assert!(
        report.keypoint_error_m.mean < keypoints,
        "{:?}",
        report.keypoint_error_m
    );
    assert!(report.foot_skate_m_s < skate, "{}", report.foot_skate_m_s);
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
    let walk = clip("deepmimic/humanoid3d_walk.txt", None).map(|c| (c, 0.012, 0.02));
    // These walk on the spot; how fast is a mean, so that their feet rest in few frames.
    let xbot = clip("mixamo/Xbot.glb", Some("walk")).map(|c| (c, 0.03, 0.07));
    let soldier = clip("mixamo/Soldier.glb", Some("Walk")).map(|c| (c, 0.03, 0.07));
    let skeleton = humanoid();
    for (clip, keypoints, skate) in [walk, xbot, soldier].into_iter().flatten() {
        let done = on_humanoid(&clip);
        assert_good(&done.report, keypoints, skate);
        assert_walks(&done.motion, &skeleton);
    }
}

#[test]
fn acrobatics_of_the_same_proportions_stay_near_their_source() {
    // Whoever gets up leans on hands that are up to 10 cm above the ground in the source.
    for (file, keypoints) in [
        ("kick", 0.025),
        ("backflip", 0.025),
        ("getup_facedown", 0.03),
    ] {
        let Some(clip) = clip(&format!("deepmimic/humanoid3d_{file}.txt"), None) else {
            return;
        };
        assert_good(&on_humanoid(&clip).report, keypoints, 0.03);
    }
}

/// The source has 16 frames a second.
#[test]
fn a_backflip_of_few_frames_falls_freely() {
    let Some(clip) = clip("deepmimic/humanoid3d_backflip.txt", None) else {
        return;
    };
    let motion = on_humanoid(&clip).motion;
    let frames = 4 * (clip.frames.len() - 1) + 1;
    assert_eq!((motion.fps, motion.qpos.len()), (64.0, frames));
    let at = |seconds: f64| (seconds * motion.fps).round() as usize;
    let com = &motion.tracks.com;
    for f in at(0.72)..at(1.12) {
        let acceleration = (com[f + 1] - com[f] * 2.0 + com[f - 1]) * motion.fps.powi(2);
        let off = acceleration + Vector3::z() * crate::skeleton::GRAVITY;
        assert!(off.norm() < 0.05, "{f}: {off}");
    }
}

/// Without and with [`Options::to_perform`].
fn as_it_is_and_to_perform(clip: &Clip) -> [Retargeted; 2] {
    [false, true].map(|to_perform| {
        let options = Options {
            to_perform,
            ..Options::default()
        };
        retarget(clip, &humanoid(), &options).unwrap_or_else(|e| panic!("{e}"))
    })
}

/// To spin freely this flight would have to be turned by 51 degrees: it stays as it is, or is turned by 17 for a body that
/// is to perform it. The mean of its momentum's distance from its own mean tells how freely it spins.
#[test]
fn a_backflip_is_turned_for_a_body_that_performs_it() {
    let Some(clip) = clip("deepmimic/humanoid3d_backflip.txt", None) else {
        return;
    };
    let [kept, turned] = as_it_is_and_to_perform(&clip);
    let changes = |done: &Retargeted| {
        let at = |seconds: f64| (seconds * done.motion.fps).round() as usize;
        let flight = &done.motion.tracks.angular_momentum[at(0.75)..at(1.1)];
        let mean = flight.iter().sum::<Vector3<f64>>() / flight.len() as f64;
        flight.iter().map(|m| (m - mean).norm()).sum::<f64>() / flight.len() as f64
    };
    let told = |done: &Retargeted| {
        let problems = done.report.problems.iter();
        let mut ids = problems.map(|problem| problem.id.as_str());
        ids.any(|id| id == "spin-corrected")
    };
    assert_eq!([told(&kept), told(&turned)], [false, true]);
    let (before, after) = (changes(&kept), changes(&turned));
    assert!(after < 0.8 * before, "{after} of {before} kg·m²/s");
    let [near, far] = [kept, turned].map(|done| done.report.keypoint_error_m.mean);
    assert!(near < far && far < 0.03, "{near} and {far} m");
}

/// In its flight, but for the velocities of the frames next to the ground, the jump's centre of mass falls freely and its
/// angular momentum stays. The source's changes by 14 kg·m²/s.
#[test]
fn a_jump_falls_and_spins_freely() {
    let Some(clip) = clip("deepmimic/humanoid3d_jump.txt", None) else {
        return;
    };
    let motion = on_humanoid(&clip).motion;
    let at = |seconds: f64| (seconds * motion.fps).round() as usize;
    let flight = at(0.85)..at(1.15);
    let momenta = &motion.tracks.angular_momentum[flight.clone()];
    for momentum in momenta {
        assert!(
            (momentum - momenta[0]).norm() < 0.2,
            "{momentum} {}",
            momenta[0]
        );
    }
    let velocity = &motion.tracks.com_velocity;
    for f in flight {
        let acceleration = (velocity[f + 1] - velocity[f - 1]) * (motion.fps / 2.0);
        assert!(
            (acceleration + Vector3::z() * crate::skeleton::GRAVITY).norm() < 0.3,
            "{f}"
        );
    }
}

/// At 44 % of the jump its toes push for the last time, against the source's forward spin: who is to perform it has most of
/// the flight's own then.
#[test]
fn a_jump_has_its_spin_with_the_last_push_of_a_body_that_performs_it() {
    let Some(clip) = clip("deepmimic/humanoid3d_jump.txt", None) else {
        return;
    };
    let [kept, early] = as_it_is_and_to_perform(&clip).map(|done| {
        let motion = done.motion;
        let at = |share: f64| (share * motion.qpos.len() as f64).round() as usize;
        let momenta = &motion.tracks.angular_momentum;
        (momenta[at(0.44)] - momenta[at(0.56)]).norm()
    });
    assert!(early < 0.6 * kept, "{early} of {kept} kg·m²/s");
}

/// The loop of this run lacks 4 cm of the right foot's height, in the midst of its stance.
#[test]
fn a_foot_stands_over_a_seam_that_does_not_close() {
    let Some(run) = clip("deepmimic/humanoid3d_run.txt", None) else {
        return;
    };
    let motion = on_humanoid(&run).motion;
    let frames = motion.tracks.contact.len();
    for foot in super::feet(&motion, &humanoid()) {
        let stands = motion.tracks.contact.iter().filter(|row| row[foot]);
        let share = stands.count() as f64 / frames as f64;
        assert!((0.12..0.4).contains(&share), "foot {foot}: {share}");
    }
}

/// A boxer who is on his toes for a third of the time, in a file whose ground is elsewhere.
#[test]
fn a_boxer_on_his_toes_does_not_lift_the_ground() {
    let Some(boxing) = clip("poser-bvh/boxing.bvh", None) else {
        return;
    };
    let motion = on_humanoid(&boxing).motion;
    let stands = motion
        .tracks
        .contact
        .iter()
        .filter(|row| row.contains(&true));
    let share = stands.count() as f64 / motion.tracks.contact.len() as f64;
    assert!(share > 0.9, "{share}");
}

#[test]
fn a_skeleton_of_hinges_in_t_pose_does_as_well() {
    let Some(skeleton) = foreign_skeleton("characters/mimickit_humanoid.xml") else {
        return;
    };
    let Some(clip) = clip("deepmimic/humanoid3d_walk.txt", None) else {
        return;
    };
    let done = retarget(&clip, &skeleton, &Options::default()).unwrap();
    assert_good(&done.report, 0.012, 0.02);
}

/// Arms of two hinges and an elbow reach backward in one way and forward in another: from a frame to the next they were
/// 2.6 rad apart, at 77 rad/s.
#[test]
fn hinges_go_from_one_way_of_bending_to_another_as_fast_as_limbs_turn() {
    let Some(clip) = clip("cmu/91_50.fbx", None) else {
        return;
    };
    let marathon = Skeleton::load("marathon").expect("a built-in character");
    let motion = retarget(&clip, &marathon, &Options::default());
    let motion = motion.expect("a human's motion").motion;
    for (f, pair) in motion.qpos.windows(2).enumerate() {
        let steps = pair[0][7..].iter().zip(&pair[1][7..]);
        let most = steps.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let rate = most * motion.fps;
        assert!(rate < 30.0, "{rate} rad/s after frame {f}");
    }
}

/// In the midst of a cartwheel only hands are down: the feet are no ground to stand on.
#[test]
fn a_part_in_which_no_foot_comes_down_keeps_its_height() {
    let options = import::Options {
        trim: Some((1.25, 1.45)),
        ..Default::default()
    };
    let Some(path) = foreign("deepmimic/humanoid3d_cartwheel.txt") else {
        return;
    };
    let clip = import::load(path, &options).unwrap();
    let done = on_humanoid(&clip);
    // The character of these files has the humanoid's own proportions, and their ground is z = 0.
    let scaled = |f: usize| clip.world(f)[0].translation.z;
    for (f, bodies) in done.motion.bodies.iter().enumerate() {
        assert!(
            (bodies[0].translation.z - scaled(f)).abs() < 0.02,
            "frame {f}"
        );
    }
    assert!(done.report.penetration_m.max < 0.01);
}

/// Google's MuJoCo humanoid hangs on its torso; its hips go where the source's are all the same.
#[test]
fn a_skeleton_rooted_at_its_torso_has_its_hips_where_the_source_has_them() {
    let Some(skeleton) = foreign_skeleton("characters/mujoco_humanoid.xml") else {
        return;
    };
    let Some(clip) = clip("deepmimic/humanoid3d_spinkick.txt", None) else {
        return;
    };
    let options = Options::default();
    let input = input::prepare(&clip, &skeleton, &options).unwrap();
    let model = Model::new(&skeleton);
    let posed = pose::pose(&input, &model, &options.weights).unwrap();
    for (f, qpos) in posed.goals.guess.iter().enumerate() {
        let bodies = skeleton.forward(qpos);
        let mut apart = Vector3::zeros();
        for slot in [Slot::LeftUpperLeg, Slot::RightUpperLeg] {
            apart += bodies[skeleton.slots[&slot]].translation.vector;
            apart -= posed.source.at(slot, f).unwrap();
        }
        assert!(apart.norm() < 1e-9, "frame {f}: {}", apart.norm());
    }
}

/// Hands that hang on a skeleton's shorter arms would turn a cartwheel in the air.
#[test]
fn hands_on_shorter_arms_reach_the_ground() {
    let Some(clip) = clip("deepmimic/humanoid3d_cartwheel.txt", None) else {
        return;
    };
    let ours = humanoid();
    let shorter = ours.mjcf.replace("0 0 -0.274788", "0 0 -0.23");
    assert_ne!(shorter, ours.mjcf, "the upper arms' length has changed");
    let skeleton = Skeleton::from_mjcf("short", &shorter, Some(&ours.slots_json())).unwrap();
    let done = retarget(&clip, &skeleton, &Options::default()).unwrap();
    let hands =
        |skeleton: &Skeleton| [Slot::LeftHand, Slot::RightHand].map(|slot| skeleton.slots[&slot]);
    let touching = |done: &Retargeted, skeleton: &Skeleton| {
        let low =
            |poses: &&Vec<Isometry3<f64>>| skeleton.lowest_point_of(poses, &hands(skeleton)) < 0.01;
        done.motion.bodies.iter().filter(low).count()
    };
    // The clip's character has arms as long as the humanoid's.
    let (same, short) = (
        touching(&on_humanoid(&clip), &ours),
        touching(&done, &skeleton),
    );
    assert!(same * 10 > clip.frames.len(), "{same}");
    assert!(short * 10 > same * 9, "{short} of {same}");
}
