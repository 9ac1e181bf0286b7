//! Retargeting, on rigs that are built by hand and on clips that people recorded.

mod jumps;
mod nailed;
mod recorded;
mod trimmed;

use super::qpos::put_quaternion;
use super::*;
use crate::clip::{Joint, LoopMode, Margin, Source};
use crate::explain::{Explain, Fault, Parameter};
use crate::humanoid::Slot;
use crate::import;
use mimic_test_support::foreign;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

pub(super) fn clip(file: &str, take: Option<&str>) -> Option<Clip> {
    let options = import::Options {
        take: take.map(str::to_owned),
        ..Default::default()
    };
    Some(import::load(foreign(file)?, &options).unwrap_or_else(|e| panic!("{file}: {e}")))
}

/// A character by other people.
pub(super) fn foreign_skeleton(file: &str) -> Option<Skeleton> {
    let path = foreign(file)?;
    let path = path.to_str().expect("the path is text");
    Some(Skeleton::load(path).unwrap_or_else(|e| panic!("{e}")))
}

pub(super) fn humanoid() -> Skeleton {
    Skeleton::load("humanoid").unwrap()
}

pub(super) fn on_humanoid(clip: &Clip) -> Retargeted {
    retarget(clip, &humanoid(), &Options::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Numbers between −1 and 1.
pub(super) fn random() -> impl FnMut() -> f64 {
    let mut seed = 11_u64;
    move || {
        seed = seed
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (seed >> 33) as f64 / (1_u64 << 30) as f64 - 1.0
    }
}

/// Mixamo's names for the humanoid's slots.
fn mixamo(slot: Slot) -> &'static str {
    match slot {
        Slot::Hips => "Hips",
        Slot::Chest => "Spine",
        Slot::Head => "Head",
        Slot::LeftUpperArm => "LeftArm",
        Slot::LeftLowerArm => "LeftForeArm",
        Slot::LeftHand => "LeftHand",
        Slot::RightUpperArm => "RightArm",
        Slot::RightLowerArm => "RightForeArm",
        Slot::RightHand => "RightHand",
        Slot::LeftUpperLeg => "LeftUpLeg",
        Slot::LeftLowerLeg => "LeftLeg",
        Slot::LeftFoot => "LeftFoot",
        Slot::RightUpperLeg => "RightUpLeg",
        Slot::RightLowerLeg => "RightLeg",
        Slot::RightFoot => "RightFoot",
        other => panic!("the humanoid has no {other}"),
    }
}

/// The coordinates of a joint that turns the body in `slot`.
fn coordinate(skeleton: &Skeleton, slot: Slot) -> usize {
    skeleton.bodies[skeleton.slots[&slot]].joints[0].qpos
}

fn turned(skeleton: &Skeleton, qpos: &mut [f64], slot: Slot, by: [f64; 3]) {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::from(by));
    put_quaternion(qpos, coordinate(skeleton, slot), &turn);
}

/// A clip of a rig that has the skeleton's bones `size` times as large, `down` lower, with local axes of its own, and
/// shows the poses `frames`; its rest pose is `rest`.
fn rig(skeleton: &Skeleton, rest: &[f64], frames: &[Vec<f64>], size: f64, down: f64) -> Clip {
    let mut random = random();
    let axes: Vec<UnitQuaternion<f64>> = (skeleton.bodies.iter())
        .map(|_| UnitQuaternion::from_scaled_axis(Vector3::new(random(), random(), random()) * 2.0))
        .collect();
    let world = |qpos: &[f64]| -> Vec<Isometry3<f64>> {
        let bodies = skeleton.forward(qpos);
        let own = bodies.iter().zip(&axes).map(|(body, axes)| {
            let at = body.translation.vector * size - Vector3::z() * down;
            Isometry3::from_parts(at.into(), body.rotation * axes)
        });
        own.collect()
    };
    let local = |world: &[Isometry3<f64>]| -> Vec<Isometry3<f64>> {
        let up = |b: usize| {
            skeleton.bodies[b]
                .parent
                .map_or_else(Isometry3::identity, |p| world[p])
        };
        (0..world.len())
            .map(|b| up(b).inverse() * world[b])
            .collect()
    };
    let name = |b: usize| {
        skeleton
            .slots
            .iter()
            .find(|(_, body)| **body == b)
            .map(|(slot, _)| mixamo(*slot))
    };
    let joints = local(&world(rest))
        .into_iter()
        .enumerate()
        .map(|(b, rest)| Joint {
            name: name(b).unwrap_or("Other").to_owned(),
            parent: skeleton.bodies[b].parent,
            rest,
            bone: None,
        });
    Clip {
        name: "rig".to_owned(),
        fps: 30.0,
        loop_mode: LoopMode::Clamp,
        joints: joints.collect(),
        frames: frames.iter().map(|qpos| local(&world(qpos))).collect(),
        margin: Margin::default(),
        source: Source {
            file: "rig".to_owned(),
            sha256: String::new(),
            format: "gltf".to_owned(),
            take: String::new(),
            fps: 30.0,
            up_axis: "+Z".to_owned(),
            unit_m: 1.0,
        },
        problems: Vec::new(),
    }
}

/// Arms out, arms half down, arms hanging.
const ARM_ANGLES: [f64; 3] = [FRAC_PI_2, 0.8, 0.0];

#[test]
fn poses_come_back_from_a_rig_of_another_size_axes_and_rest_pose() {
    let skeleton = humanoid();
    let standing = skeleton.rest_qpos();
    let frames: Vec<Vec<f64>> = (0..40)
        .map(|f| {
            let t = f64::from(f) * 0.15;
            let mut qpos = standing.clone();
            turned(
                &skeleton,
                &mut qpos,
                Slot::Chest,
                [0.1 * t.sin(), 0.2, 0.4 * t.cos()],
            );
            turned(&skeleton, &mut qpos, Slot::Head, [0.0, 0.3 * t.sin(), 0.3]);
            turned(
                &skeleton,
                &mut qpos,
                Slot::LeftUpperArm,
                [0.6, -0.8 - 0.5 * t.sin(), 0.2],
            );
            turned(
                &skeleton,
                &mut qpos,
                Slot::RightUpperArm,
                [-0.4, -0.3 + 0.6 * t.cos(), -0.3],
            );
            qpos[coordinate(&skeleton, Slot::LeftLowerArm)] = -0.9 - 0.4 * t.cos();
            qpos[coordinate(&skeleton, Slot::RightLowerArm)] = -0.6 - 0.4 * t.sin();
            qpos
        })
        .collect();
    for angle in ARM_ANGLES {
        let mut rest = standing.clone();
        turned(&skeleton, &mut rest, Slot::LeftUpperArm, [angle, 0.0, 0.0]);
        turned(
            &skeleton,
            &mut rest,
            Slot::RightUpperArm,
            [-angle, 0.0, 0.0],
        );
        let done = on_humanoid(&rig(&skeleton, &rest, &frames, 1.7, 0.3));
        for (f, qpos) in frames.iter().enumerate() {
            let expected = skeleton.forward(qpos);
            for (b, body) in expected.iter().enumerate() {
                let found = &done.motion.bodies[f][b];
                let away = (found.translation.vector - body.translation.vector).norm();
                assert!(
                    away < 0.005,
                    "arms {angle}, frame {f}, {}: {away} m",
                    skeleton.bodies[b].name
                );
                let turned = found.rotation.angle_to(&body.rotation);
                assert!(
                    turned < 0.05,
                    "arms {angle}, frame {f}, {}: {turned} rad",
                    skeleton.bodies[b].name
                );
            }
        }
        for foot in feet(&done.motion, &skeleton) {
            assert!(done.motion.tracks.contact.iter().all(|row| row[foot]));
        }
        assert!(done.report.foot_skate_m_s < 1e-3);
    }
}

/// The columns of the feet in the contact track of a motion.
fn feet(motion: &Motion, skeleton: &Skeleton) -> Vec<usize> {
    let feet = [Slot::LeftFoot, Slot::RightFoot].map(|slot| skeleton.slots[&slot]);
    let bodies = motion.contact_bodies.iter().enumerate();
    let found = bodies.filter(|(_, body)| feet.contains(body));
    found.map(|(column, _)| column).collect()
}

#[test]
fn equal_inputs_give_equal_bits() {
    for file in ["walk", "backflip", "spinkick"] {
        let Some(clip) = clip(&format!("deepmimic/humanoid3d_{file}.txt"), None) else {
            return;
        };
        let (once, again) = (on_humanoid(&clip), on_humanoid(&clip));
        assert_eq!(once.motion, again.motion);
        let times = (once.motion.fps / clip.fps).round() as usize;
        let frames = times * (clip.frames.len() - 1) + 1;
        assert_eq!(once.motion.qpos.len(), frames);
    }
}

/// A body's velocity changes hardly more at the seam of a cycle than within it, though no source closes exactly.
#[test]
fn velocities_pass_over_the_seam() {
    for file in ["walk", "run", "jog"] {
        let Some(clip) = clip(&format!("deepmimic/humanoid3d_{file}.txt"), None) else {
            return;
        };
        let motion = on_humanoid(&clip).motion;
        assert_eq!(motion.loop_mode, LoopMode::Wrap);
        let last = motion.bodies.len() - 1;
        let place = |f: usize, b: usize| motion.bodies[f][b].translation.vector;
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * motion.cycle.heading);
        let change =
            |before: Vector3<f64>, after: Vector3<f64>| (after - before).norm() * motion.fps;
        for (b, body) in humanoid().bodies.iter().enumerate() {
            let step = |f: usize| place(f + 1, b) - place(f, b);
            let within = (1..last).map(|f| change(step(f - 1), step(f)));
            let most = within.fold(0.0, f64::max);
            let seam = change(step(last - 1), turn * step(0));
            assert!(
                seam <= most * 1.25,
                "{file}, {}: {seam} {most} m/s",
                body.name
            );
        }
    }
}

/// A part of a clip becomes what it becomes in the whole. Only a stance in whose midst the cut is, and the time in
/// which its shift fades, may tell of it: where its foot stood before isn't known any more.
#[test]
fn a_later_start_changes_no_later_frames() {
    const CUT: usize = 10;
    for (file, take) in [
        ("deepmimic/humanoid3d_kick.txt", None),
        ("deepmimic/humanoid3d_walk.txt", None),
        ("mixamo/MarathonManMMAKick.fbx", None),
        ("mixamo/MarathonManWalking.fbx", None),
        ("mixamo/Samba-Dancing.fbx", None),
    ] {
        let Some(mut whole) = clip(file, take) else {
            return;
        };
        whole.loop_mode = LoopMode::Clamp;
        let mut cut = whole.clone();
        cut.frames.drain(..CUT);
        let (whole, cut) = (on_humanoid(&whole).motion, on_humanoid(&cut).motion);
        let fade = (0.4 * whole.fps).ceil() as usize;
        let place = |motion: &Motion, f: usize, b: usize| motion.bodies[f][b].translation.vector;
        let last = cut.bodies.len() - 1;
        // Both start above the origin.
        let mut shift = place(&whole, last + CUT, 0) - place(&cut, last, 0);
        shift.z = 0.0;
        for f in 0..=last {
            let allowed = if f < fade { 0.03 } else { 0.002 };
            for b in 0..whole.body_names.len() {
                let apart = (place(&whole, f + CUT, b) - place(&cut, f, b) - shift).norm();
                assert!(apart < allowed, "{file}, frame {f}, body {b}: {apart} m");
            }
        }
    }
}

#[test]
fn a_clip_of_few_frames_becomes_a_motion_of_many() {
    let skeleton = humanoid();
    let pose = |f: usize| {
        let mut qpos = skeleton.rest_qpos();
        let raised = -0.2 * f as f64;
        turned(&skeleton, &mut qpos, Slot::LeftUpperArm, [raised, 0.0, 0.0]);
        qpos
    };
    let frames: Vec<Vec<f64>> = (0..7).map(pose).collect();
    let rest = skeleton.rest_qpos();
    let mut clip = rig(&skeleton, &rest, &frames, 1.0, 0.0);
    let count = |clip: &Clip| {
        let motion = on_humanoid(clip).motion;
        (motion.fps, motion.qpos.len())
    };
    assert_eq!(count(&clip), (30.0, 7));
    clip.fps = 12.0;
    assert_eq!(count(&clip), (60.0, 31));
    clip.fps = 1.0;
    assert_eq!(count(&clip), (8.0, 49));
}

#[test]
fn what_is_no_motion_of_a_humanoid_is_refused() {
    let skeleton = humanoid();
    let rest = skeleton.rest_qpos();
    let good = rig(&skeleton, &rest, &[rest.clone(), rest.clone()], 1.0, 0.0);
    assert!(retarget(&good, &skeleton, &Options::default()).is_ok());
    let error = |change: &dyn Fn(&mut Clip)| {
        let mut clip = good.clone();
        change(&mut clip);
        let error = retarget(&clip, &skeleton, &Options::default()).unwrap_err();
        let told = error.explain();
        assert_eq!(told.fault, Fault::Input, "{error}");
        assert!(told.remedy.is_some(), "{error}");
        (error, told.place.unwrap_or_default())
    };
    let (empty, _) = error(&|clip| clip.frames.clear());
    assert!(matches!(empty, RetargetError::Empty { .. }), "{empty}");
    let (rate, _) = error(&|clip| clip.fps = 0.0);
    assert!(
        matches!(rate, RetargetError::FrameRate { fps: 0.0, .. }),
        "{rate}"
    );
    let (ragged, place) = error(&|clip| clip.frames[1].truncate(3));
    assert!(
        matches!(ragged, RetargetError::Ragged { found: 3, .. }),
        "{ragged}"
    );
    assert_eq!(place, "frame 1");
    let (_, place) = error(&|clip| clip.frames[1][2].translation.x = f64::NAN);
    assert_eq!(place, format!("frame 1, joint `{}`", good.joints[2].name));
    let (_, place) = error(&|clip| clip.joints[2].rest.translation.x = f64::INFINITY);
    assert_eq!(place, format!("rest pose, joint `{}`", good.joints[2].name));
}

/// A figure whose joints are all in one place has no size; only a joint map gets it so far.
#[test]
fn a_source_without_size_is_refused() {
    let skeleton = humanoid();
    let rest = skeleton.rest_qpos();
    let mut clip = rig(&skeleton, &rest, &[rest.clone(), rest.clone()], 1.0, 0.0);
    let options = Options {
        map: Some(crate::humanoid::map(&clip.joints).unwrap()),
        ..Options::default()
    };
    for joint in &mut clip.joints {
        joint.rest.translation.vector *= 0.0;
    }
    let error = retarget(&clip, &skeleton, &options).unwrap_err();
    assert!(matches!(error, RetargetError::NoSourceLegs), "{error}");
}

#[test]
fn a_joint_map_for_another_clip_is_refused() {
    let skeleton = humanoid();
    let rest = skeleton.rest_qpos();
    let clip = rig(&skeleton, &rest, &[rest.clone(), rest.clone()], 1.0, 0.0);
    let mut map = crate::humanoid::map(&clip.joints).unwrap();
    map.matches.get_mut(&Slot::Head).unwrap().joint = clip.joints.len();
    let options = Options {
        map: Some(map),
        ..Options::default()
    };
    let error = retarget(&clip, &skeleton, &options).unwrap_err();
    let remedy = error.explain().remedy.expect("a remedy");
    assert_eq!(remedy.parameter, Some(Parameter::JointMap));
}

#[test]
fn the_shortest_clips_work() {
    let skeleton = humanoid();
    let rest = skeleton.rest_qpos();
    for count in 1..8 {
        for loop_mode in [LoopMode::Clamp, LoopMode::Wrap] {
            let mut clip = rig(&skeleton, &rest, &vec![rest.clone(); count], 1.0, 0.0);
            clip.loop_mode = loop_mode;
            let done = on_humanoid(&clip);
            assert_eq!(done.motion.qpos.len(), count);
            assert!(done.motion.qpos.iter().flatten().all(|x| x.is_finite()));
        }
    }
}
