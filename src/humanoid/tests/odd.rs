//! Rigs with joints in odd places, and names that few rigs use.

use super::super::*;
use super::{assert_maps, figure, nameless};
use mimic_test_support::foreign;
use nalgebra::Isometry3;

/// The joints of a BVH file's hierarchy; `turn` brings its axes to X forward and Z up.
fn bvh_joints(file: &str, turn: fn([f64; 3]) -> [f64; 3]) -> Option<Vec<Joint>> {
    let text = std::fs::read_to_string(foreign(file)?).expect("the file can be read");
    let mut joints: Vec<Joint> = Vec::new();
    let mut open: Vec<Option<usize>> = Vec::new();
    let mut next = None;
    for line in text.lines().take_while(|line| line.trim() != "MOTION") {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["ROOT" | "JOINT", name] => {
                next = Some(joints.len());
                joints.push(Joint {
                    name: name.to_owned(),
                    parent: open.last().copied().flatten(),
                    rest: Isometry3::identity(),
                    bone: None,
                });
            }
            ["End", ..] => next = None,
            ["{"] => open.push(next),
            ["}"] => drop(open.pop()),
            ["OFFSET", x, y, z] => {
                let number = |text: &str| text.parse().expect("an offset is a number");
                if let Some(Some(joint)) = open.last() {
                    let [x, y, z] = turn([number(x), number(y), number(z)]);
                    joints[*joint].rest = Isometry3::translation(x, y, z);
                }
            }
            _ => {}
        }
    }
    Some(joints)
}

/// Both files have a joint on the midline that is called as the leg's: `LHipJoint`, `__UpLeg_L`.
#[test]
fn joints_between_hips_and_legs_are_no_legs() {
    if let Some(joints) = bvh_joints("cmu/jumping_jacks.bvh", |[x, y, z]| [z, x, y]) {
        assert_maps(
            &joints,
            &[
                ("hips", "Hips"),
                ("spine", "lowerback"),
                ("chest", "Chest2"),
                ("neck", "Neck"),
                ("head", "Head"),
                ("left-shoulder", "LeftCollar"),
                ("left-upper-arm", "LeftShoulder"),
                ("left-lower-arm", "LeftElbow"),
                ("left-hand", "LeftWrist"),
                ("right-shoulder", "RightCollar"),
                ("right-upper-arm", "RightShoulder"),
                ("right-lower-arm", "RightElbow"),
                ("right-hand", "RightWrist"),
                ("left-upper-leg", "LeftHip"),
                ("left-lower-leg", "LeftKnee"),
                ("left-foot", "LeftAnkle"),
                ("left-toes", "LeftToe"),
                ("right-upper-leg", "RightHip"),
                ("right-lower-leg", "RightKnee"),
                ("right-foot", "RightAnkle"),
                ("right-toes", "RightToe"),
            ],
        );
    }
    for file in ["makehuman/mh_walk1.bvh", "makehuman/mh_dance1.bvh"] {
        let Some(joints) = bvh_joints(file, |[x, y, z]| [-y, x, z]) else {
            return;
        };
        assert_maps(
            &joints,
            &[
                ("hips", "Hips"),
                ("spine", "Spine1"),
                ("chest", "Spine3"),
                ("neck", "Neck"),
                ("head", "Head"),
                ("left-shoulder", "Clavicle_L"),
                ("left-upper-arm", "UpArm_L"),
                ("left-lower-arm", "LoArm_L"),
                ("left-hand", "Hand_L"),
                ("right-shoulder", "Clavicle_R"),
                ("right-upper-arm", "UpArm_R"),
                ("right-lower-arm", "LoArm_R"),
                ("right-hand", "Hand_R"),
                ("left-upper-leg", "UpLeg_L"),
                ("left-lower-leg", "LoLeg_L"),
                ("left-foot", "Foot_L"),
                ("left-toes", "Toe_L"),
                ("right-upper-leg", "UpLeg_R"),
                ("right-lower-leg", "LoLeg_R"),
                ("right-foot", "Foot_R"),
                ("right-toes", "Toe_R"),
            ],
        );
    }
}

/// The nameless figure with other names for some of its joints.
fn named(names: &[(&str, &str)]) -> Vec<Joint> {
    let mut joints = nameless();
    for joint in &mut joints {
        if let Some((_, name)) = names.iter().find(|(old, _)| *old == joint.name) {
            joint.name = (*name).to_owned();
        }
    }
    joints
}

fn found(joints: &[Joint], slot: Slot) -> String {
    let map = map(joints).unwrap_or_else(|e| panic!("{e}"));
    joints[map.joint(slot).expect("the slot is filled")]
        .name
        .clone()
}

#[test]
fn one_unknown_name_does_not_discard_the_others() {
    let legs = [
        ("s", "lThighBend"),
        ("t", "lFantasy"),
        ("u", "lFoot"),
        ("o", "rFantasy"),
        ("p", "rShin"),
        ("q", "rFoot"),
        ("h", "lShldrBend"),
        ("i", "lSomething"),
        ("j", "lHand"),
    ];
    let joints = named(&legs);
    let map = map(&joints).unwrap();
    for (slot, name, by_name) in [
        (Slot::LeftUpperLeg, "lThighBend", true),
        (Slot::LeftLowerLeg, "lFantasy", false),
        (Slot::LeftFoot, "lFoot", true),
        (Slot::RightUpperLeg, "rFantasy", false),
        (Slot::RightLowerLeg, "rShin", true),
        (Slot::RightFoot, "rFoot", true),
        (Slot::LeftUpperArm, "lShldrBend", true),
        (Slot::LeftLowerArm, "lSomething", false),
        (Slot::LeftHand, "lHand", true),
        (Slot::RightUpperArm, "l", false),
    ] {
        let found = &map.matches[&slot];
        assert_eq!(joints[found.joint].name, name, "{slot}");
        assert_eq!(found.confidence > 0.6, by_name, "{slot}: {found:?}");
    }
}

/// The figure faces −Y, so by its feet +X is its left; its names say otherwise, and they know.
#[test]
fn a_named_side_overrules_the_shape() {
    let joints = named(&[
        ("s", "q_right"),
        ("o", "q_left"),
        ("h", "y_R"),
        ("l", "y_L"),
    ]);
    assert_eq!(found(&joints, Slot::RightUpperLeg), "q_right");
    assert_eq!(found(&joints, Slot::LeftUpperLeg), "q_left");
    assert_eq!(found(&joints, Slot::RightUpperArm), "y_R");
}

/// Hips on one point: knees and ankles say which leg is the left one.
#[test]
fn hips_may_coincide() {
    let mut joints = nameless();
    for (hip, knee) in [("o", "p"), ("s", "t")] {
        let x = joints
            .iter()
            .find(|j| j.name == hip)
            .map(|j| j.rest.translation.x);
        let x = x.expect("there is a hip");
        for joint in &mut joints {
            if joint.name == hip {
                joint.rest.translation.x = 0.0;
            } else if joint.name == knee {
                joint.rest.translation.x += x;
            }
        }
    }
    assert_eq!(found(&joints, Slot::LeftUpperLeg), "s");
    assert_eq!(found(&joints, Slot::RightUpperLeg), "o");
}

/// Names of MikuMikuDance's standard figure.
#[test]
fn japanese_names_map() {
    let side = |name: &str, side: &str, x: f64| (format!("{side}{name}"), x);
    let mut parts: Vec<(String, String, [f64; 3])> = vec![
        ("センター".into(), String::new(), [0.0, 0.0, 0.8]),
        ("上半身".into(), "センター".into(), [0.0, 0.0, 1.0]),
        ("上半身2".into(), "上半身".into(), [0.0, 0.0, 1.2]),
        ("首".into(), "上半身2".into(), [0.0, 0.0, 1.4]),
        ("頭".into(), "首".into(), [0.0, 0.0, 1.5]),
        ("下半身".into(), "センター".into(), [0.0, 0.0, 0.9]),
    ];
    for (letter, sign) in [("左", 1.0), ("右", -1.0)] {
        let name = |part: &str| side(part, letter, sign).0;
        let at = |x: f64, z: f64| [0.0, sign * x, z];
        parts.extend([
            (name("肩"), "上半身2".into(), at(0.05, 1.35)),
            (name("腕"), name("肩"), at(0.15, 1.35)),
            (name("ひじ"), name("腕"), at(0.4, 1.35)),
            (name("手首"), name("ひじ"), at(0.6, 1.35)),
            (name("足"), "下半身".into(), at(0.1, 0.85)),
            (name("ひざ"), name("足"), at(0.1, 0.45)),
            (name("足首"), name("ひざ"), at(0.1, 0.08)),
            (name("つま先"), name("足首"), [0.12, sign * 0.1, 0.0]),
        ]);
    }
    let parts: Vec<(&str, &str, [f64; 3])> = parts
        .iter()
        .map(|(name, parent, at)| (name.as_str(), parent.as_str(), *at))
        .collect();
    let joints = figure(&parts);
    assert_maps(
        &joints,
        &[
            ("hips", "下半身"),
            ("spine", "上半身"),
            ("chest", "上半身2"),
            ("neck", "首"),
            ("head", "頭"),
            ("left-shoulder", "左肩"),
            ("left-upper-arm", "左腕"),
            ("left-lower-arm", "左ひじ"),
            ("left-hand", "左手首"),
            ("right-shoulder", "右肩"),
            ("right-upper-arm", "右腕"),
            ("right-lower-arm", "右ひじ"),
            ("right-hand", "右手首"),
            ("left-upper-leg", "左足"),
            ("left-lower-leg", "左ひざ"),
            ("left-foot", "左足首"),
            ("left-toes", "左つま先"),
            ("right-upper-leg", "右足"),
            ("right-lower-leg", "右ひざ"),
            ("right-foot", "右足首"),
            ("right-toes", "右つま先"),
        ],
    );
}
