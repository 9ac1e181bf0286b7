use super::*;
use nalgebra::{Isometry3, Matrix4, Vector3};
use std::path::PathBuf;

/// Joints from name, parent's name and world position.
fn figure(joints: &[(&str, &str, [f64; 3])]) -> Vec<Joint> {
    let place = |name: &str| joints.iter().position(|j| j.0 == name);
    let build = |(name, parent, at): &(&str, &str, [f64; 3])| {
        let up = place(parent);
        let base = up.map_or_else(Vector3::zeros, |p| Vector3::from(joints[p].2));
        let offset = Vector3::from(*at) - base;
        Joint {
            name: (*name).to_owned(),
            parent: up,
            rest: Isometry3::translation(offset.x, offset.y, offset.z),
        }
    };
    joints.iter().map(build).collect()
}

/// A figure in T-pose whose names say nothing; it faces −Y, so that its left is +X.
fn nameless() -> Vec<Joint> {
    figure(&[
        ("a", "", [0.0, 0.0, 0.0]),
        ("b", "a", [0.0, 0.0, 0.95]),
        ("c", "b", [0.0, 0.0, 1.1]),
        ("d", "c", [0.0, 0.0, 1.35]),
        ("e", "d", [0.0, 0.0, 1.5]),
        ("f", "e", [0.0, 0.0, 1.6]),
        ("g", "d", [0.05, 0.0, 1.4]),
        ("h", "g", [0.18, 0.0, 1.4]),
        ("i", "h", [0.45, 0.0, 1.4]),
        ("j", "i", [0.70, 0.0, 1.4]),
        ("k", "d", [-0.05, 0.0, 1.4]),
        ("l", "k", [-0.18, 0.0, 1.4]),
        ("m", "l", [-0.45, 0.0, 1.4]),
        ("n", "m", [-0.70, 0.0, 1.4]),
        ("o", "b", [-0.09, 0.0, 0.9]),
        ("p", "o", [-0.09, 0.0, 0.5]),
        ("q", "p", [-0.09, 0.0, 0.08]),
        ("r", "q", [-0.09, -0.15, 0.02]),
        ("s", "b", [0.09, 0.0, 0.9]),
        ("t", "s", [0.09, 0.0, 0.5]),
        ("u", "t", [0.09, 0.0, 0.08]),
        ("v", "u", [0.09, -0.15, 0.02]),
    ])
}

fn names(joints: &[Joint]) -> Vec<(&'static str, String)> {
    let map = map(joints).unwrap_or_else(|e| panic!("{e}"));
    let name = |(slot, found): (&Slot, &Match)| (slot.name(), joints[found.joint].name.clone());
    map.matches.iter().map(name).collect()
}

fn assert_maps(joints: &[Joint], expected: &[(&'static str, &str)]) {
    let mut expected: Vec<_> = expected
        .iter()
        .map(|(s, j)| (*s, (*j).to_owned()))
        .collect();
    let mut found = names(joints);
    expected.sort();
    found.sort();
    assert_eq!(found, expected);
}

#[test]
fn a_figure_without_names_is_read_from_its_shape() {
    let joints = nameless();
    assert_maps(
        &joints,
        &[
            ("hips", "b"),
            ("spine", "c"),
            ("chest", "d"),
            ("neck", "e"),
            ("head", "f"),
            ("left-shoulder", "g"),
            ("left-upper-arm", "h"),
            ("left-lower-arm", "i"),
            ("left-hand", "j"),
            ("right-shoulder", "k"),
            ("right-upper-arm", "l"),
            ("right-lower-arm", "m"),
            ("right-hand", "n"),
            ("right-upper-leg", "o"),
            ("right-lower-leg", "p"),
            ("right-foot", "q"),
            ("right-toes", "r"),
            ("left-upper-leg", "s"),
            ("left-lower-leg", "t"),
            ("left-foot", "u"),
            ("left-toes", "v"),
        ],
    );
    assert!(
        map(&joints)
            .unwrap()
            .matches
            .values()
            .all(|m| m.confidence < 1.01 && !m.reason.is_empty())
    );
}

#[test]
fn a_four_legged_animal_with_human_names_is_refused() {
    let mut parts = vec![
        ("Hips", "", [-0.4, 0.0, 0.6]),
        ("Spine", "Hips", [0.0, 0.0, 0.62]),
        ("Chest", "Spine", [0.3, 0.0, 0.62]),
        ("Head", "Chest", [0.5, 0.0, 0.8]),
    ];
    for (arm, fore, hand, leg, knee, foot, y) in [
        (
            "LeftArm",
            "LeftForeArm",
            "LeftHand",
            "LeftUpLeg",
            "LeftLeg",
            "LeftFoot",
            0.1,
        ),
        (
            "RightArm",
            "RightForeArm",
            "RightHand",
            "RightUpLeg",
            "RightLeg",
            "RightFoot",
            -0.1,
        ),
    ] {
        parts.extend([
            (arm, "Chest", [0.3, y, 0.55]),
            (fore, arm, [0.28, y, 0.3]),
            (hand, fore, [0.3, y, 0.05]),
            (leg, "Hips", [-0.4, y, 0.55]),
            (knee, leg, [-0.38, y, 0.3]),
            (foot, knee, [-0.4, y, 0.05]),
        ]);
    }
    assert!(matches!(
        map(&figure(&parts)),
        Err(NotHumanoid::Quadruped { .. })
    ));
}

#[test]
fn a_figure_without_arms_is_refused_by_slot() {
    let joints: Vec<Joint> = nameless()
        .into_iter()
        .filter(|j| !"hijlmn".contains(&j.name))
        .collect();
    let kept = |name: &str| joints.iter().position(|j| j.name == name);
    let whole = nameless();
    let relinked: Vec<Joint> = joints
        .iter()
        .map(|j| Joint {
            parent: j.parent.and_then(|p| kept(&whole[p].name)),
            ..j.clone()
        })
        .collect();
    let error = map(&relinked).unwrap_err();
    assert!(error.to_string().contains("left-upper-arm"), "{error}");
    let cube = figure(&[("Cube", "", [0.0; 3])]);
    assert_eq!(map(&cube), Err(NotHumanoid::TooFewJoints { joints: 1 }));
}

#[test]
fn the_map_file_survives_editing_and_names_its_mistakes() {
    let joints = nameless();
    let found = map(&joints).unwrap();
    let text = found.to_json(&joints);
    let back = HumanoidMap::from_json(&text, &joints).unwrap();
    for (slot, m) in &found.matches {
        assert_eq!(back.joint(*slot), Some(m.joint), "{slot}");
    }
    let wrong = |from: &str, to: &str| {
        let text = text.replace(from, to);
        HumanoidMap::from_json(&text, &joints)
            .unwrap_err()
            .to_string()
    };
    assert!(wrong("\"hips\"", "\"hip\"").contains("unknown slot `hip`"));
    assert!(wrong("\"hips\": \"b\"", "\"hips\": \"bb\"").contains("did you mean `b`"));
    assert!(wrong("\"hips\": \"b\"", "\"hips\": \"c\"").contains("both `hips` and `spine`"));
    assert!(wrong("\"hips\": \"b\"", "\"hips\": null").contains("leaves `hips` empty"));
    assert!(HumanoidMap::from_json("[]", &joints).is_err());
}

#[test]
fn hostile_trees_cost_no_more_than_their_size() {
    let arm = |j: usize| Joint {
        name: ["LeftArm", "LeftForeArm", "LeftUpLeg", "LeftLeg"][j % 4].to_owned(),
        parent: if j % 3 == 0 {
            Some(j + 5)
        } else {
            j.checked_sub(1)
        },
        rest: Isometry3::translation(0.0, 0.0, f64::NAN),
    };
    let joints: Vec<Joint> = (0..20_000).map(arm).collect();
    assert!(map(&joints).is_err());
}

fn data(file: &str) -> Option<Vec<u8>> {
    let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data"));
    let bytes = std::fs::read(root.join(file)).ok();
    if bytes.is_none() {
        eprintln!("skipped: no test data `{file}`");
    }
    bytes
}

/// All nodes of a glTF file as joints, its +Y turned to +Z and its +Z to +X.
fn gltf_joints(file: &str) -> Option<Vec<Joint>> {
    let gltf = gltf::Gltf::from_slice_without_validation(&data(file)?).unwrap();
    let mut joints: Vec<Joint> = Vec::new();
    let mut stack: Vec<(gltf::Node, Option<usize>, Matrix4<f64>)> = gltf
        .scenes()
        .flat_map(|s| s.nodes())
        .map(|n| (n, None, Matrix4::identity()))
        .collect();
    let mut at: Vec<Vector3<f64>> = Vec::new();
    while let Some((node, parent, above)) = stack.pop() {
        let local = Matrix4::from_fn(|r, c| f64::from(node.transform().matrix()[c][r]));
        let world = above * local;
        let here = Vector3::new(world[(2, 3)], world[(0, 3)], world[(1, 3)]);
        let offset = here - parent.map_or_else(Vector3::zeros, |p: usize| at[p]);
        let index = joints.len();
        joints.push(Joint {
            name: node.name().unwrap_or_default().to_owned(),
            parent,
            rest: Isometry3::translation(offset.x, offset.y, offset.z),
        });
        at.push(here);
        stack.extend(node.children().map(|child| (child, Some(index), world)));
    }
    Some(joints)
}

const MIXAMO: [(&str, &str); 21] = [
    ("hips", "Hips"),
    ("spine", "Spine"),
    ("chest", "Spine2"),
    ("neck", "Neck"),
    ("head", "Head"),
    ("left-shoulder", "LeftShoulder"),
    ("left-upper-arm", "LeftArm"),
    ("left-lower-arm", "LeftForeArm"),
    ("left-hand", "LeftHand"),
    ("right-shoulder", "RightShoulder"),
    ("right-upper-arm", "RightArm"),
    ("right-lower-arm", "RightForeArm"),
    ("right-hand", "RightHand"),
    ("left-upper-leg", "LeftUpLeg"),
    ("left-lower-leg", "LeftLeg"),
    ("left-foot", "LeftFoot"),
    ("left-toes", "LeftToeBase"),
    ("right-upper-leg", "RightUpLeg"),
    ("right-lower-leg", "RightLeg"),
    ("right-foot", "RightFoot"),
    ("right-toes", "RightToeBase"),
];

#[test]
fn mixamo_rigs_with_any_prefix_map_alike() {
    for (file, prefix) in [
        ("mixamo/Xbot.glb", "mixamorig:"),
        ("mixamo/Soldier.glb", "mixamorig:"),
        ("mixamo/animations-mixamo-default.glb", "mixamorig_"),
    ] {
        let Some(joints) = gltf_joints(file) else {
            return;
        };
        for spelling in [prefix, "mixamorig1:", "mixamorig_", ""] {
            let renamed: Vec<Joint> = joints
                .iter()
                .map(|j| Joint {
                    name: j.name.replace(prefix, spelling),
                    ..j.clone()
                })
                .collect();
            let expected: Vec<(&'static str, String)> = MIXAMO
                .map(|(slot, joint)| (slot, format!("{spelling}{joint}")))
                .into();
            let expected: Vec<(&'static str, &str)> =
                expected.iter().map(|(s, j)| (*s, j.as_str())).collect();
            assert_maps(&renamed, &expected);
        }
    }
}

#[test]
fn kaykit_maps_to_its_twelve_and_its_wrists() {
    let Some(joints) = gltf_joints("kaykit/Med_MovementBasic.glb") else {
        return;
    };
    assert_maps(
        &joints,
        &[
            ("hips", "hips"),
            ("spine", "spine"),
            ("chest", "chest"),
            ("head", "head"),
            ("left-upper-arm", "upperarm.l"),
            ("left-lower-arm", "lowerarm.l"),
            ("left-hand", "wrist.l"),
            ("right-upper-arm", "upperarm.r"),
            ("right-lower-arm", "lowerarm.r"),
            ("right-hand", "wrist.r"),
            ("left-upper-leg", "upperleg.l"),
            ("left-lower-leg", "lowerleg.l"),
            ("left-foot", "foot.l"),
            ("left-toes", "toes.l"),
            ("right-upper-leg", "upperleg.r"),
            ("right-lower-leg", "lowerleg.r"),
            ("right-foot", "foot.r"),
            ("right-toes", "toes.r"),
        ],
    );
}

#[test]
fn unreal_names_map() {
    let Some(joints) = gltf_joints("ue-mannequin-like/mannequiny.glb") else {
        return;
    };
    assert_maps(
        &joints,
        &[
            ("hips", "pelvis"),
            ("spine", "spine_01"),
            ("chest", "spine_02"),
            ("neck", "neck_01"),
            ("head", "head"),
            ("left-shoulder", "clavicle.l"),
            ("left-upper-arm", "upperarm.l"),
            ("left-lower-arm", "lowerarm.l"),
            ("left-hand", "hand.l"),
            ("right-shoulder", "clavicle.r"),
            ("right-upper-arm", "upperarm.r"),
            ("right-lower-arm", "lowerarm.r"),
            ("right-hand", "hand.r"),
            ("left-upper-leg", "thigh.l"),
            ("left-lower-leg", "calf.l"),
            ("left-foot", "foot.l"),
            ("left-toes", "ball.l"),
            ("right-upper-leg", "thigh.r"),
            ("right-lower-leg", "calf.r"),
            ("right-foot", "foot.r"),
            ("right-toes", "ball.r"),
        ],
    );
}

/// Joints of DeepMimic's humanoid from its character file, whose axes are Y up and X forward.
fn deepmimic_joints() -> Option<Vec<Joint>> {
    let file: serde_json::Value =
        serde_json::from_slice(&data("deepmimic/humanoid3d.txt")?).unwrap();
    let joints = file["Skeleton"]["Joints"].as_array().unwrap();
    let number = |joint: &serde_json::Value, key: &str| joint[key].as_f64().unwrap();
    let build = |joint: &serde_json::Value| Joint {
        name: joint["Name"].as_str().unwrap().to_owned(),
        parent: joint["Parent"].as_u64().map(|p| p as usize),
        rest: Isometry3::translation(
            number(joint, "AttachX"),
            -number(joint, "AttachZ"),
            number(joint, "AttachY"),
        ),
    };
    Some(joints.iter().map(build).collect())
}

#[test]
fn deepmimic_names_mean_the_bones_below_them() {
    let Some(joints) = deepmimic_joints() else {
        return;
    };
    assert_maps(
        &joints,
        &[
            ("hips", "root"),
            ("chest", "chest"),
            ("head", "neck"),
            ("left-upper-arm", "left_shoulder"),
            ("left-lower-arm", "left_elbow"),
            ("left-hand", "left_wrist"),
            ("right-upper-arm", "right_shoulder"),
            ("right-lower-arm", "right_elbow"),
            ("right-hand", "right_wrist"),
            ("left-upper-leg", "left_hip"),
            ("left-lower-leg", "left_knee"),
            ("left-foot", "left_ankle"),
            ("right-upper-leg", "right_hip"),
            ("right-lower-leg", "right_knee"),
            ("right-foot", "right_ankle"),
        ],
    );
}

#[test]
fn other_rigs_map_whole() {
    for (file, feet) in [
        ("quaternius/RobotExpressive.glb", "Foot.L"),
        ("quaternius/cyberpunk_Character.glb", "Foot.L"),
        ("quaternius/main_skeleton.glb", "Foot.L"),
        ("rigify/human-skeleton.glb", "DEF-foot.L"),
        ("khronos/CesiumMan.glb", "leg_joint_L_3"),
        ("bitmoji/bitmoji_walk.glb", "L_foot0001_bind_JNT"),
        ("vrm/basic_armature.vrm", "foot.L"),
        ("vrm/idle_loop.vrma", "l_foot"),
    ] {
        let Some(joints) = gltf_joints(file) else {
            return;
        };
        let map = map(&joints).unwrap_or_else(|e| panic!("{file}: {e}"));
        let foot = map.joint(Slot::LeftFoot).unwrap();
        assert_eq!(joints[foot].name, feet, "{file}");
        assert!(map.joint(Slot::Head).is_some(), "{file}");
    }
}

#[test]
fn animals_and_toys_are_refused() {
    for file in [
        "khronos/Fox.glb",
        "nonhumanoid/quad-creature-animations.glb",
    ] {
        let Some(joints) = gltf_joints(file) else {
            return;
        };
        assert!(
            matches!(map(&joints), Err(NotHumanoid::Quadruped { .. })),
            "{file}"
        );
    }
    let Some(joints) = gltf_joints("raylib/greenman.glb") else {
        return;
    };
    assert!(matches!(map(&joints), Err(NotHumanoid::Missing { .. })));
}
