use super::super::Plane;
use super::*;
use crate::humanoid;
use nalgebra::Unit;
use std::f64::consts::{FRAC_PI_2, PI};

/// The clip in the mirror, with the pairs of its joint map.
fn mirrored(clip: &Clip) -> Clip {
    let map = humanoid::map(&clip.joints).unwrap_or_else(|e| panic!("{e}"));
    let pairs = humanoid::pairs(&clip.joints, &map);
    clip.mirror(&pairs, &Plane::sagittal(&clip.joints, &pairs))
        .unwrap_or_else(|e| panic!("{e}"))
}

fn partner(name: &str) -> String {
    if name.contains("Left") {
        name.replace("Left", "Right")
    } else {
        name.replace("Right", "Left")
    }
}

#[test]
fn every_joint_of_our_clips_is_where_its_partner_was_in_the_mirror() {
    for file in ["walk.glb", "kick.fbx"] {
        let clip = ours(file);
        let other = mirrored(&clip);
        assert_eq!(other.problems, clip.problems, "{file} is symmetric at rest");
        for frame in 0..clip.frames.len() {
            for joint in &clip.joints {
                // Our figures face X with their middle on it, so the mirror is the plane of X and Z.
                let mut wanted = place(&clip, &partner(&joint.name), frame);
                wanted.y = -wanted.y;
                let error = (place(&other, &joint.name, frame) - wanted).norm();
                assert!(error < 1e-6, "{file} {frame} {}: {error}", joint.name);
            }
        }
    }
}

#[test]
fn the_kick_of_the_right_leg_becomes_one_of_the_left() {
    let kick = ours("kick.fbx");
    let highest = |clip: &Clip, name: &str| {
        let heights = (0..clip.frames.len()).map(|f| place(clip, name, f).z);
        heights.fold(0.0, f64::max)
    };
    let other = mirrored(&kick);
    assert!(highest(&kick, "RightFoot") > 0.7 && highest(&other, "LeftFoot") > 0.7);
    assert!(highest(&other, "RightFoot") < 0.3);
}

#[test]
fn twice_in_the_mirror_is_the_clip_again() {
    let others = [
        theirs("mixamo/Samba-Dancing.fbx", None),
        theirs("deepmimic/humanoid3d_spinkick.txt", None),
        theirs("cmu/07_01_cmu.fbx", None),
        theirs("ue-mannequin-like/mannequiny.glb", None),
        theirs("kaykit/Med_MovementBasic.glb", None),
        theirs("games105/walk_and_turn_left.bvh", None),
    ];
    let clips = [ours("walk.glb"), ours("kick.fbx")];
    for clip in clips.into_iter().chain(others.into_iter().flatten()) {
        let back = mirrored(&mirrored(&clip));
        let error = (clip.frames.iter().zip(&back.frames))
            .map(|(a, b)| local_change(a, b))
            .fold(0.0, f64::max);
        assert!(error < 1e-9, "{}: {error}", clip.source.file);
        assert_eq!(clip.joints, back.joints);
    }
}

/// Left and right axes of other rigs differ by half turns, and their rests are symmetric to how files round.
#[test]
fn rigs_of_others_are_mirrored_in_the_world() {
    for file in [
        "mixamo/Samba-Dancing.fbx",
        "mixamo/MarathonManRunning.fbx",
        "deepmimic/humanoid3d_spinkick.txt",
        "ue-mannequin-like/mannequiny.glb",
        "kaykit/Med_MovementBasic.glb",
    ] {
        let Some(clip) = theirs(file, None) else {
            return;
        };
        let map = humanoid::map(&clip.joints).unwrap_or_else(|e| panic!("{e}"));
        let pairs = humanoid::pairs(&clip.joints, &map);
        let plane = Plane::sagittal(&clip.joints, &pairs);
        let rest = clip.rest_world();
        let asymmetry = pairs.iter().map(|&(l, r)| {
            let image = plane.reflect(&rest[l].translation.vector);
            (image - rest[r].translation.vector).norm()
        });
        let asymmetry = asymmetry.fold(0.0, f64::max);
        let other = clip.mirror(&pairs, &plane).expect("it mirrors");
        let mut error = 0.0_f64;
        for frame in (0..clip.frames.len()).step_by(7) {
            let (here, there) = (clip.world(frame), other.world(frame));
            for (left, right) in pairs.iter().flat_map(|&(l, r)| [(l, r), (r, l)]) {
                let image = plane.reflect(&here[left].translation.vector);
                error = error.max((image - there[right].translation.vector).norm());
            }
        }
        println!(
            "{file}: {} pairs, rest {asymmetry:.2e} m, mirrored {error:.2e} m",
            pairs.len()
        );
        assert!(error < 1e-6 + 10.0 * asymmetry, "{file}: {error}");
    }
}

/// A trunk with an arm on each side, whose axes are turned by `left` and `right`, in a plane off the origin.
fn two_arms(left: UnitQuaternion<f64>, right: UnitQuaternion<f64>) -> Clip {
    let trunk = Isometry3::from_parts(
        Vector3::new(0.2, 0.5, 1.0).into(),
        about(Vector3::new(1.0, 2.0, 3.0), 0.7),
    );
    let arm = |side: f64, own: UnitQuaternion<f64>| {
        let world = Isometry3::from_parts(Vector3::new(0.2, 0.5 + side, 1.4).into(), own);
        trunk.inverse() * world
    };
    let hand = |side: f64, own: UnitQuaternion<f64>| {
        let shift = own.inverse() * Vector3::new(0.1, 0.3 * side, -0.05);
        Isometry3::from(shift)
    };
    let joints = vec![
        joint("trunk", None, trunk),
        joint("arm.l", Some(0), arm(0.2, left)),
        joint("arm.r", Some(0), arm(-0.2, right)),
        joint("hand.l", Some(1), hand(1.0, left)),
        joint("hand.r", Some(2), hand(-1.0, right)),
        joint("sword", Some(4), at(0.0, 0.4, 0.0)),
    ];
    let frame = |f: usize| {
        let t = f as f64 * 0.1;
        let mut frame: Vec<_> = joints.iter().map(|joint| joint.rest).collect();
        frame[0] = Isometry3::from_parts(
            Vector3::new(t, 0.5 + 0.1 * t, 1.0).into(),
            about(Vector3::z(), 0.4 * t) * trunk.rotation,
        );
        frame[1].rotation *= about(Vector3::new(0.3, 1.0, -0.4), 0.9 * t);
        frame[2].rotation *= about(Vector3::new(-0.8, 0.2, 0.5), -0.5 * t);
        frame[5].rotation *= about(Vector3::x(), 0.2 * t);
        frame
    };
    clip(joints.clone(), 30.0, (0..20).map(frame).collect())
}

#[test]
fn whatever_the_axes_of_both_sides_the_world_is_mirrored() {
    let axes = [
        UnitQuaternion::identity(),
        about(Vector3::z(), PI),
        about(Vector3::new(1.0, 1.0, 1.0), 2.0),
        about(Vector3::x(), -FRAC_PI_2),
    ];
    let pairs = [(1, 2), (3, 4)];
    for (left, right) in axes.iter().flat_map(|l| axes.iter().map(move |r| (*l, *r))) {
        let clip = two_arms(left, right);
        let plane = Plane::sagittal(&clip.joints, &pairs);
        assert!((plane.offset.abs() - 0.5).abs() < 1e-12 && plane.normal.y.abs() > 1.0 - 1e-12);
        let other = clip.mirror(&pairs, &plane).expect("it mirrors");
        for frame in 0..clip.frames.len() {
            for (here, there) in [(0, 0), (1, 2), (2, 1), (3, 4), (4, 3)] {
                let p = clip.world(frame)[here].translation.vector;
                let image = Vector3::new(p.x, 1.0 - p.y, p.z);
                let got = other.world(frame)[there].translation.vector;
                assert!((image - got).norm() < 1e-12, "{frame} {here}");
            }
            assert_eq!(
                clip.frames[frame][5], other.frames[frame][5],
                "the sword stays in its hand"
            );
        }
    }
}

#[test]
fn the_mirror_stands_where_the_rest_pose_is_symmetric() {
    // A figure whose left is at 40° from +Y.
    let turn = about(Vector3::z(), 0.7);
    let there = |x: f64, y: f64, z: f64| Isometry3::from(turn * Vector3::new(x, y + 0.3, z));
    let joints = vec![
        joint("l", None, there(0.3, 0.1, 1.0)),
        joint("r", None, there(0.3, -0.1, 1.0)),
        joint("hand.l", None, there(-0.2, 0.8, 1.4)),
        joint("hand.r", None, there(-0.2, -0.8, 1.4)),
    ];
    let plane = Plane::sagittal(&joints, &[(0, 1), (2, 3)]);
    let normal = Unit::new_normalize(turn * Vector3::y());
    assert!(plane.normal.cross(&normal).norm() < 1e-12);
    assert!(
        (plane.reflect(&joints[0].rest.translation.vector) - joints[1].rest.translation.vector)
            .norm()
            < 1e-12
    );
    // In the midst of a stride nothing is symmetric: clips face X.
    let stride = vec![
        joint("leg.l", None, at(0.02, 0.1, 0.9)),
        joint("leg.r", None, at(-0.02, -0.1, 0.9)),
        joint("foot.l", None, at(0.4, 0.12, 0.1)),
        joint("foot.r", None, at(-0.3, -0.08, 0.0)),
    ];
    let plane = Plane::sagittal(&stride, &[(0, 1), (2, 3)]);
    assert_eq!(plane.normal, Vector3::y_axis());
    assert!((plane.offset - 0.01).abs() < 1e-12, "the mean of all");
}

#[test]
fn a_rest_pose_that_is_not_symmetric_is_told_of() {
    let mut walk = ours("walk.glb");
    let thigh = walk
        .joints
        .iter()
        .position(|joint| joint.name == "LeftUpLeg");
    walk.joints[thigh.expect("a thigh")].rest.rotation *= about(Vector3::x(), 0.5);
    let other = mirrored(&walk);
    let told = other.problems.iter().filter(|p| p.id == "asymmetric-rest");
    assert_eq!(told.count(), 1);
    assert_eq!(
        other.loop_mode,
        LoopMode::Wrap,
        "its mirror image loops too"
    );
}

#[test]
fn pairs_that_do_not_fit_are_refused() {
    let walk = ours("walk.glb");
    let plane = Plane::sagittal(&walk.joints, &[]);
    for pairs in [&[(3, 3)][..], &[(1, 99)], &[(1, 2), (2, 3)]] {
        assert!(matches!(
            walk.mirror(pairs, &plane),
            Err(Error::Pair { .. })
        ));
    }
}
